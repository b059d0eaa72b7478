// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/munkres.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

namespace {

using overtake::Munkres;

struct TestPair {
  int32_t row, column;
  double cost;
};
struct Problem {
  int32_t rows, columns;
  std::vector<TestPair> pairs;
};
struct Value {
  int32_t count = 0;
  double cost = 0;
  bool operator==(const Value&) const = default;
};
bool is_better(Value a, Value b) { return a.count != b.count ? a.count > b.count : a.cost < b.cost; }

// Tries every way to give each row one of its columns or none.
Value search_all(const Problem& p, int32_t row, uint32_t taken) {
  if (row == p.rows) return {};
  Value best = search_all(p, row + 1, taken);
  for (const TestPair& pair : p.pairs) {
    if (pair.row != row || (taken >> pair.column & 1)) continue;
    Value with = search_all(p, row + 1, taken | uint32_t(1) << pair.column);
    with.count += 1;
    with.cost += pair.cost;
    if (is_better(with, best)) best = with;
  }
  return best;
}

// The same result for up to 14 columns: best[mask] over the rows so far.
Value search_masks(const Problem& p) {
  std::vector<Value> best(std::size_t(1) << p.columns, Value{-1, 0});
  best[0] = {};
  for (int32_t row = 0; row < p.rows; ++row) {
    std::vector<Value> next = best;
    for (std::size_t mask = 0; mask < best.size(); ++mask)
      for (const TestPair& pair : p.pairs) {
        const std::size_t bit = std::size_t(1) << pair.column;
        if (pair.row != row || best[mask].count < 0 || (mask & bit)) continue;
        const Value with{best[mask].count + 1, best[mask].cost + pair.cost};
        if (is_better(with, next[mask | bit])) next[mask | bit] = with;
      }
    best = next;
  }
  Value answer;
  for (const Value& v : best)
    if (is_better(v, answer)) answer = v;
  return answer;
}

std::vector<int32_t> solve(const Problem& p) {
  Munkres munkres(p.rows, p.columns, int32_t(p.pairs.size()));
  munkres.clear(p.rows, p.columns);
  for (const TestPair& pair : p.pairs) REQUIRE(munkres.add(pair.row, pair.column, pair.cost));
  std::vector<int32_t> column_of_row(std::size_t(p.rows), -2);
  const int32_t count = munkres.solve(column_of_row.data());
  CHECK(count == std::count_if(column_of_row.begin(), column_of_row.end(), [](int32_t c) { return c >= 0; }));
  return column_of_row;
}

// Number of pairs and cost of a solution; every pair must be one of the problem's, every column used once.
Value value_of(const Problem& p, const std::vector<int32_t>& column_of_row) {
  Value value;
  std::vector<int32_t> used(std::size_t(p.columns), 0);
  for (int32_t row = 0; row < p.rows; ++row) {
    const int32_t column = column_of_row[std::size_t(row)];
    REQUIRE(column >= -1);
    REQUIRE(column < p.columns);
    if (column < 0) continue;
    double cost = std::numeric_limits<double>::infinity();
    for (const TestPair& pair : p.pairs)
      if (pair.row == row && pair.column == column) cost = std::min(cost, pair.cost);
    REQUIRE(cost < std::numeric_limits<double>::infinity());
    REQUIRE(used[std::size_t(column)]++ == 0);
    value.count += 1;
    value.cost += cost;
  }
  return value;
}

// Costs are multiples of 1/8, so that sums are exact and ties are exact.
Problem make_problem(std::mt19937& random, int32_t max_rows, int32_t max_columns, int32_t cost_range) {
  Problem p{int32_t(random() % uint32_t(max_rows + 1)), int32_t(random() % uint32_t(max_columns + 1)), {}};
  const auto density = random() % 101;
  for (int32_t r = 0; r < p.rows; ++r)
    for (int32_t c = 0; c < p.columns; ++c)
      if (random() % 100 < density) {
        const int32_t eighths = int32_t(random() % uint32_t(2 * cost_range + 1)) - cost_range;
        p.pairs.push_back({r, c, 0.125 * eighths});
      }
  return p;
}

}  // namespace

TEST_CASE("munkres: agrees with a search over every assignment of small problems") {
  for (uint32_t seed = 1; seed <= 6000; ++seed) {
    std::mt19937 random(seed);
    const Problem p = make_problem(random, 6, 6, seed % 3 == 0 ? 2 : 400);  // a third of them has many ties
    CAPTURE(seed);
    CAPTURE(p.rows);
    CAPTURE(p.columns);
    REQUIRE(value_of(p, solve(p)) == search_all(p, 0, 0));
  }
}

TEST_CASE("munkres: agrees with dynamic programming on problems of up to 40 rows") {
  for (uint32_t seed = 1; seed <= 60; ++seed) {
    std::mt19937 random(seed);
    const Problem p = make_problem(random, 40, 11, seed % 2 == 0 ? 3 : 1000);
    CAPTURE(seed);
    REQUIRE(value_of(p, solve(p)) == search_masks(p));
  }
}

TEST_CASE("munkres: prefers one more pair to any saving in cost") {
  // Row 0 with column 0 is cheap, but then row 1 has no column.
  const Problem p{2, 2, {{0, 0, -1000.0}, {0, 1, 1000.0}, {1, 0, 1000.0}}};
  CHECK(solve(p) == std::vector<int32_t>{1, 0});
}

TEST_CASE("munkres: leaves the most expensive row alone if there are too few columns") {
  const Problem p{3, 1, {{0, 0, 3.0}, {1, 0, 1.0}, {2, 0, 2.0}}};
  CHECK(solve(p) == std::vector<int32_t>{-1, 0, -1});
}

TEST_CASE("munkres: keeps its low digits when costs are large") {
  // The two solutions differ only in the last digit.
  const double big = 4503599627370496.0;  // 2^52
  const Problem p{2, 2, {{0, 0, big}, {0, 1, big + 1}, {1, 0, big}, {1, 1, big}}};
  CHECK(solve(p) == std::vector<int32_t>{0, 1});
}

TEST_CASE("munkres: refuses a pair that does not come after the last one, and solves the others") {
  Munkres munkres(3, 3, 9);
  munkres.clear(3, 3);
  CHECK(munkres.add(1, 1, 5.0));
  CHECK_FALSE(munkres.add(1, 1, 1.0));
  CHECK_FALSE(munkres.add(1, 0, 1.0));
  CHECK_FALSE(munkres.add(0, 2, 1.0));
  CHECK(munkres.add(1, 2, 6.0));
  CHECK(munkres.add(2, 0, 7.0));
  int32_t column_of_row[3];
  CHECK(munkres.solve(column_of_row) == 2);
  CHECK(std::vector<int32_t>(column_of_row, column_of_row + 3) == std::vector<int32_t>{-1, 1, 0});
}

TEST_CASE("munkres: solves independent blocks as if each were alone") {
  for (uint32_t seed = 1; seed <= 300; ++seed) {
    std::mt19937 random(seed);
    const Problem a = make_problem(random, 6, 6, 2), b = make_problem(random, 6, 6, 2);
    Problem both{a.rows + b.rows, a.columns + b.columns, a.pairs};
    for (const TestPair& pair : b.pairs) both.pairs.push_back({pair.row + a.rows, pair.column + a.columns, pair.cost});
    std::vector<int32_t> expected = solve(a);
    for (const int32_t c : solve(b)) expected.push_back(c < 0 ? -1 : c + a.columns);
    CAPTURE(seed);
    REQUIRE(solve(both) == expected);
  }
}

TEST_CASE("munkres: accepts empty problems and rows without pairs") {
  CHECK(solve({0, 0, {}}).empty());
  CHECK(solve({0, 5, {}}).empty());
  CHECK(solve({3, 0, {}}) == std::vector<int32_t>{-1, -1, -1});
  CHECK(solve({3, 2, {{1, 1, 7.0}}}) == std::vector<int32_t>{-1, 1, -1});
}

TEST_CASE("munkres: refuses invalid pairs and pairs beyond its capacity") {
  Munkres munkres(2, 2, 2);
  munkres.clear(2, 2);
  CHECK_FALSE(munkres.add(2, 0, 1.0));
  CHECK_FALSE(munkres.add(-1, 0, 1.0));
  CHECK_FALSE(munkres.add(0, 2, 1.0));
  CHECK_FALSE(munkres.add(0, -1, 1.0));
  CHECK_FALSE(munkres.add(0, 0, std::numeric_limits<double>::quiet_NaN()));
  CHECK_FALSE(munkres.add(0, 0, std::numeric_limits<double>::infinity()));
  CHECK(munkres.add(0, 0, 1.0));
  CHECK(munkres.add(1, 1, 1.0));
  CHECK_FALSE(munkres.add(0, 1, 1.0));
  int32_t column_of_row[2];
  CHECK(munkres.solve(column_of_row) == 2);
}

TEST_CASE("munkres: within a step limit a row takes a remaining column") {
  constexpr int32_t kRows = 60;
  std::mt19937_64 random(5);
  std::vector<TestPair> pairs;
  for (int32_t r = 0; r < kRows; ++r)
    for (int32_t c = 0; c < kRows; ++c) pairs.push_back({r, c, double(random() % 1000)});
  Munkres munkres(kRows, kRows, kRows * kRows);
  const auto solve = [&](int64_t max_steps) {
    munkres.clear(kRows, kRows);
    for (const TestPair& p : pairs) munkres.add(p.row, p.column, p.cost);
    std::vector<int32_t> column(kRows);
    CHECK(munkres.solve(column.data(), max_steps) == kRows);  // a full block: every row gets a column
    std::vector<int32_t> sorted = column;
    std::sort(sorted.begin(), sorted.end());
    CHECK(std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end());
    return column;
  };
  const auto cost_of = [&](const std::vector<int32_t>& column) {
    double cost = 0;
    for (const TestPair& p : pairs) cost += column[std::size_t(p.row)] == p.column ? p.cost : 0;
    return cost;
  };
  const std::vector<int32_t> best = solve(INT64_MAX);
  CHECK_FALSE(munkres.was_limited());
  const int64_t needed = munkres.steps();
  CHECK(needed > 1000);
  CHECK(solve(needed) == best);
  CHECK_FALSE(munkres.was_limited());
  double before = cost_of(best);
  for (const int64_t limit : {needed - 1, needed / 2, int64_t(0)}) {
    const std::vector<int32_t> limited = solve(limit);
    CHECK(munkres.was_limited());
    CHECK(munkres.steps() <= limit + 2 * kRows);  // no search exceeds it by much
    CHECK(cost_of(limited) >= before);
    before = cost_of(limited);
    CHECK(solve(limit) == limited);  // the last problem leaves nothing behind
  }
  CHECK(before > cost_of(best));
}

TEST_CASE("munkres: clear removes the last problem") {
  Munkres munkres(3, 3, 9);
  int32_t column_of_row[3];
  munkres.clear(3, 3);
  for (int32_t i = 0; i < 3; ++i) munkres.add(i, 2 - i, 1.0);
  CHECK(munkres.solve(column_of_row) == 3);
  munkres.clear(2, 3);
  munkres.add(1, 0, 1.0);
  CHECK(munkres.solve(column_of_row) == 1);
  CHECK(column_of_row[0] == -1);
  CHECK(column_of_row[1] == 0);
}

TEST_CASE("munkres: a row that may stay alone does so where that is cheaper, also for the others") {
  for (uint32_t seed = 1; seed <= 6000; ++seed) {
    std::mt19937 random(seed);
    Problem p = make_problem(random, 6, 5, seed % 3 == 0 ? 2 : 400);
    std::vector<double> alone(std::size_t(p.rows));
    Munkres munkres(p.rows, p.columns, int32_t(p.pairs.size()));
    munkres.clear(p.rows, p.columns);
    for (double& cost : alone) {
      cost = 0.125 * (int32_t(random() % 801) - 400);
      if (random() % 3 == 0) cost = std::numeric_limits<double>::infinity();
      munkres.leave_alone_for(int32_t(&cost - alone.data()), cost);
    }
    for (const TestPair& pair : p.pairs) REQUIRE(munkres.add(pair.row, pair.column, pair.cost));
    std::vector<int32_t> column_of_row(std::size_t(p.rows), -2);
    munkres.solve(column_of_row.data());
    // The same as a problem in which each of these rows has a column of its own.
    Problem same = p;
    std::vector<int32_t> of_row(std::size_t(p.rows), -1);
    for (int32_t r = 0; r < p.rows; ++r)
      if (alone[std::size_t(r)] < 1e9)
        same.pairs.push_back({r, of_row[std::size_t(r)] = same.columns++, alone[std::size_t(r)]});
    std::vector<int32_t> answer = column_of_row;
    for (int32_t r = 0; r < p.rows; ++r)
      if (answer[std::size_t(r)] < 0) answer[std::size_t(r)] = of_row[std::size_t(r)];
    CAPTURE(seed);
    REQUIRE(value_of(same, answer) == search_all(same, 0, 0));
  }
}
