// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// GOSPA, HOTA, NEES, gaps and distributions in cases with a known closed-form result.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "tests/support/metric_lines.h"
#include "tools/evaluation/metrics/assignment.h"
#include "tools/evaluation/metrics/consistency.h"
#include "tools/evaluation/metrics/gospa.h"
#include "tools/evaluation/metrics/hota.h"
#include "tools/evaluation/metrics/summary.h"

using namespace overtake::metrics;
using doctest::Approx;
using overtake::test::Line;
using overtake::test::places;

namespace {

// The minimum over all pairings, by trying every one.
double brute_gospa(const std::vector<MotPlace>& objects, const std::vector<MotPlace>& tracks, std::size_t i,
                   std::vector<bool>& taken, double c, double p) {
  if (i == objects.size()) {
    double sum = 0;
    for (const bool t : taken) sum += t ? 0 : std::pow(c, p) / 2;
    return sum;
  }
  double best = brute_gospa(objects, tracks, i + 1, taken, c, p) + std::pow(c, p) / 2;
  for (std::size_t j = 0; j < tracks.size(); ++j) {
    const double d = std::hypot(objects[i].x_m - tracks[j].x_m, objects[i].y_m - tracks[j].y_m);
    if (taken[j] || d >= c) continue;
    taken[j] = true;
    best = std::min(best, brute_gospa(objects, tracks, i + 1, taken, c, p) + std::pow(d, p));
    taken[j] = false;
  }
  return best;
}

}  // namespace

TEST_CASE("gospa: one pair costs its distance, a miss or a false track c / sqrt 2") {
  CHECK(gospa(places({{1, 0}}), places({{10, 1.5}})).distance_m == Approx(1.5));
  CHECK(gospa(places({{1, 0}}), {}).distance_m == Approx(std::sqrt(2.0)));
  CHECK(gospa({}, places({{10, 0}})).distance_m == Approx(std::sqrt(2.0)));
  CHECK(gospa({}, {}).distance_m == 0);
  const Gospa far = gospa(places({{1, 0}}), places({{10, 2.5}}));  // farther than c: one miss, one false track
  CHECK(far.distance_m == Approx(2.0));
  CHECK(far.pairs == 0);
  CHECK(far.missed_count == 1);
  CHECK(far.false_count == 1);
}

TEST_CASE("gospa: keeps two good pairs instead of three bad ones, and one instead of two") {
  // objects 1 at 0, 2 at 1.9;  tracks 10 at 0, 20 at -1.9: 1-10 alone costs 0 + 2 + 2, both pairs 2 * 1.9^2 = 7.22
  const Gospa g = gospa(places({{1, 0}, {2, 1.9}}), places({{10, 0}, {20, -1.9}}));
  CHECK(g.pairs == 1);
  CHECK(g.distance_m == Approx(2.0));
  CHECK(g.localisation + g.missed + g.false_tracks == Approx(4.0));
}

TEST_CASE("gospa: agrees with a search over all pairings") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(0, 4);
  for (int32_t k = 0; k < 300; ++k) {
    std::vector<MotPlace> objects(std::size_t(random() % 5)), tracks(std::size_t(random() % 5));
    for (MotPlace& o : objects) o = {1, place(random), place(random)};
    for (MotPlace& t : tracks) t = {1, place(random), place(random)};
    std::vector<bool> taken(tracks.size(), false);
    const double least = brute_gospa(objects, tracks, 0, taken, 2, 2);
    CAPTURE(k);
    CHECK(gospa(objects, tracks).distance_m == Approx(std::sqrt(least)));
  }
}

TEST_CASE("hota: a perfect tracker has 1, no track has 0") {
  Hota good, none;
  for (int32_t k = 0; k < 10; ++k) {
    good.add_frame(places({{1, k}, {2, 50}}), places({{10, k}, {20, 50}}));
    none.add_frame(places({{1, k}}), {});
  }
  CHECK(good.result().hota == Approx(1));
  CHECK(good.result().localisation == Approx(1));
  CHECK(none.result().hota == 0);
  CHECK(std::isnan(Hota().result().hota));
}

TEST_CASE("hota: an id that changes half-way halves the association and keeps the detection") {
  // Each half: A(c) = 5 / (10 + 5 - 5) = 1/2, so AssA = 1/2, DetA = 1, HOTA = sqrt(1/2)
  Hota hota;
  for (int32_t k = 0; k < 10; ++k) hota.add_frame(places({{1, k}}), places({{k < 5 ? 10u : 20u, k}}));
  CHECK(hota.result().detection == Approx(1));
  CHECK(hota.result().association == Approx(0.5));
  CHECK(hota.result().hota == Approx(std::sqrt(0.5)));
}

TEST_CASE("hota: an offset counts for the thresholds that it satisfies") {
  // 0.5 m of 2 m: similarity 0.75, good for alpha 0.05 .. 0.75, which are 15 of 19
  Hota hota;
  for (int32_t k = 0; k < 4; ++k) hota.add_frame(places({{1, k}}), places({{10, k + 0.5}}));
  CHECK(hota.result().hota == Approx(15.0 / 19));
  CHECK(hota.result().localisation == Approx(0.75));
  CHECK(hota.result().hota_of_alpha[14] == Approx(1));
  CHECK(hota.result().hota_of_alpha[15] == 0);
}

TEST_CASE("hota: false tracks and misses reduce the detection to TP / (TP + FN + FP)") {
  // 4 frames: the track exists in 2 of them; a false one in all. TP 2, FN 2, FP 4
  Hota hota;
  for (int32_t k = 0; k < 4; ++k)
    hota.add_frame(places({{1, 0}}), k < 2 ? places({{10, 0}, {20, 90}}) : places({{20, 90}}));
  CHECK(hota.result().detection == Approx(2.0 / 8));
  CHECK(hota.result().association == Approx(2.0 / 4));
}

TEST_CASE("hota: two objects, a switch, a miss and a false track give the result by hand") {
  // Similarity 1 - d / 4 with d = 1: 0.75 for 2-20, 1 for the rest.
  //   frame object 1: track      object 2: track    false
  //   0     10 at 0              20 at 1 m
  //   1     10 at 0              20 at 1 m
  //   2     30 at 0              none
  //   3     30 at 0              20 at 1 m          40
  // alpha <= 0.75 (15 of 19): TP 7, FN 1, FP 1: DetA 7/9. A(1,10) = 2 / (4 + 2 - 2) = 1/2, A(1,30) = 1/2,
  // A(2,20) = 3 / (4 + 3 - 3) = 3/4: AssA = (2/2 + 2/2 + 3 * 3/4) / 7 = 17/28.
  // above (4 of 19): TP 4, FN 4, FP 4: DetA 1/3, AssA 1/2.
  Hota hota(4.0);
  for (int32_t k = 0; k < 4; ++k) {
    Line tracks = {{k < 2 ? 10u : 30u, 0}};
    if (k != 2) tracks.push_back({20, 51});
    if (k == 3) tracks.push_back({40, 90});
    hota.add_frame(places({{1, 0}, {2, 50}}), places(tracks));
  }
  const HotaResult r = hota.result();
  CHECK(r.hota_of_alpha[14] == Approx(std::sqrt(7.0 / 9 * 17 / 28)));
  CHECK(r.hota_of_alpha[15] == Approx(std::sqrt(1.0 / 3 / 2)));
  CHECK(r.detection == Approx((15 * 7.0 / 9 + 4.0 / 3) / 19));
  CHECK(r.association == Approx((15 * 17.0 / 28 + 4 * 0.5) / 19));
  CHECK(r.localisation == Approx((15 * (4 + 3 * 0.75) / 7 + 4 * 1.0) / 19));
}

TEST_CASE("hota: ids that last 1/n of a sequence have an association of 1/n, however good each piece is") {
  for (const uint64_t pieces : {2u, 10u, 40u}) {
    Hota whole, cut;
    for (uint64_t k = 0; k < 400; ++k) {
      const uint64_t piece = k * pieces / 400;
      whole.add_frame(places({{1, 0}}), places({{100 + piece, 0}}));
      cut.add_frame(places({{1000 + piece, 0}}), places({{100 + piece, 0}}));  // the same as separate sequences
    }
    CHECK(whole.result().association == Approx(1.0 / double(pieces)));
    CHECK(cut.result().hota == Approx(1));
  }
}

namespace {

// HOTA at one alpha, directly from the paper: tries all matchings of a frame, with the global alignment of eq. 16.
double plain_hota(const std::vector<std::pair<std::vector<MotPlace>, std::vector<MotPlace>>>& frames, double zero_m,
                  double alpha) {
  const auto alike = [&](const MotPlace& a, const MotPlace& b) {
    return std::max(0.0, 1 - std::hypot(a.x_m - b.x_m, a.y_m - b.y_m) / zero_m);
  };
  std::map<std::pair<uint64_t, uint64_t>, double> potential, matched;
  std::map<uint64_t, double> of_object, of_track;
  double objects = 0, tracks = 0;
  for (const auto& [o, t] : frames) {
    for (const MotPlace& a : o) ++of_object[a.id], ++objects;
    for (const MotPlace& b : t) ++of_track[b.id], ++tracks;
    for (const MotPlace& a : o)
      for (const MotPlace& b : t) {
        double row = 0, column = 0;
        for (const MotPlace& c : t) row += alike(a, c);
        for (const MotPlace& c : o) column += alike(c, b);
        if (row + column > 0) potential[{a.id, b.id}] += alike(a, b) / (row + column - alike(a, b));
      }
  }
  double tp = 0;
  for (const auto& [o, t] : frames) {
    std::vector<int32_t> order(std::max(o.size(), t.size()), -1), best;
    for (std::size_t j = 0; j < t.size(); ++j) order[j] = int32_t(j);
    std::sort(order.begin(), order.end());
    double most = -1;
    do {
      double sum = 0;
      for (std::size_t i = 0; i < o.size(); ++i)
        if (order[i] >= 0) {
          const MotPlace& b = t[std::size_t(order[i])];
          const double p = potential[{o[i].id, b.id}];
          sum += p / (of_object[o[i].id] + of_track[b.id] - p) * alike(o[i], b);
        }
      if (sum > most + 1e-12) most = sum, best = order;
    } while (std::next_permutation(order.begin(), order.end()));
    for (std::size_t i = 0; i < o.size(); ++i)
      if (best[i] >= 0 && alike(o[i], t[std::size_t(best[i])]) >= alpha - 1e-9 &&
          alike(o[i], t[std::size_t(best[i])]) > 0)
        ++matched[{o[i].id, t[std::size_t(best[i])].id}], ++tp;
  }
  double association = 0;
  for (const auto& [ids, n] : matched) association += n * n / (of_object[ids.first] + of_track[ids.second] - n);
  return tp > 0 ? std::sqrt(tp / (objects + tracks - tp) * association / tp) : 0;
}

}  // namespace

TEST_CASE("hota: agrees with a plain implementation of the definition that tries every matching") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(0, 6);
  for (int32_t round = 0; round < 60; ++round) {
    std::vector<std::pair<std::vector<MotPlace>, std::vector<MotPlace>>> frames;
    Hota hota(4.0);
    for (int32_t k = 0; k < 6; ++k) {
      std::vector<MotPlace> objects, tracks;
      for (uint64_t id = 1; id <= 3; ++id)
        if (random() % 4) objects.push_back({id, place(random), place(random)});
      for (uint64_t id = 10; id <= 13; ++id)
        if (random() % 3) tracks.push_back({id, place(random), place(random)});
      frames.push_back({objects, tracks});
      hota.add_frame(objects, tracks);
    }
    const HotaResult r = hota.result();
    CAPTURE(round);
    for (const int32_t a : {1, 5, 10, 15, 19})
      CHECK(r.hota_of_alpha[std::size_t(a - 1)] == Approx(plain_hota(frames, 4.0, 0.05 * a)));
  }
}

TEST_CASE("normalized_square: is e^2 / variance, and includes the correlation") {
  const double e[2] = {3, 4}, diagonal[3] = {9, 0, 4};
  CHECK(normalized_square(e, diagonal, 1) == Approx(1));
  CHECK(normalized_square(e, diagonal, 2) == Approx(1 + 4));
  // P = [2 1; 1 2], P^-1 = 1/3 [2 -1; -1 2], e = (1, 1): 2/3
  const double ones[2] = {1, 1}, both[3] = {2, 1, 2}, broken[3] = {1, 2, 1};
  CHECK(normalized_square(ones, both, 2) == Approx(2.0 / 3));
  CHECK(std::isnan(normalized_square(ones, broken, 2)));
}

TEST_CASE("continuity: gives time to confirm and longest gap of a car, which may come twice") {
  Continuity c;
  // 0.1 s steps: in view 0 .. 2.0, tracked from 0.5 to 0.9 and from 1.4 to 1.8; again from 5.0 to 5.2, never tracked
  for (int32_t k = 0; k <= 20; ++k) c.add(0.1 * k, 7, (k >= 5 && k <= 9) || (k >= 14 && k <= 18));
  for (int32_t k = 50; k <= 52; ++k) c.add(0.1 * k, 7, false);
  const auto p = c.presences();
  REQUIRE(p.size() == 2);
  CHECK(p[0].time_to_confirm_s == Approx(0.5));
  CHECK(p[0].longest_gap_s == Approx(0.5));
  CHECK(std::isnan(p[1].time_to_confirm_s));
  CHECK(p[1].longest_gap_s == 0);
}

TEST_CASE("continuity: a car lost until it leaves has a gap to its end") {
  Continuity c;
  for (int32_t k = 0; k <= 20; ++k) c.add(0.1 * k, 7, k < 5);
  CHECK(c.presences().at(0).longest_gap_s == Approx(1.6));
}

TEST_CASE("false tracks: are tracks that were never at a car") {
  FalseTracks f;
  for (const uint64_t track : {1u, 2u, 2u, 3u}) f.add(track, false);
  f.add(1, true);
  CHECK(f.count() == 2);
  CHECK(f.per_hour(1800) == Approx(4));
  CHECK(std::isnan(f.per_hour(0)));
}

TEST_CASE("summarize: percentiles of 0 .. 100 are exact, values that are not finite are left out") {
  std::vector<double> values = {NAN, INFINITY};
  for (int32_t k = 100; k >= 0; --k) values.push_back(k);
  const Summary s = summarize(values);
  CHECK(s.count == 101);
  CHECK(s.left_out == 2);
  CHECK(s.mean == Approx(50));
  CHECK(s.p5 == Approx(5));
  CHECK(s.p25 == Approx(25));
  CHECK(s.median == Approx(50));
  CHECK(s.p95 == Approx(95));
  CHECK(s.deviation == Approx(std::sqrt(101.0 * 102 / 12)));  // n (n + 1) / 12 for 0 .. n - 1
  CHECK(std::isnan(summarize({}).mean));
  CHECK(summarize({1, 2}).median == Approx(1.5));
}

TEST_CASE("binomial_share: is Wilson's interval") {
  const Share half = binomial_share(5, 10);  // 0.5 +- by the formula: 0.2366, 0.7634
  CHECK(half.value == 0.5);
  CHECK(half.low == Approx(0.2366).epsilon(1e-3));
  CHECK(half.high == Approx(0.7634).epsilon(1e-3));
  const Share none = binomial_share(0, 10);  // z^2 / (n + z^2)
  CHECK(none.low == 0);
  CHECK(none.high == Approx(3.8415 / 13.8415).epsilon(1e-3));
  CHECK(std::isnan(binomial_share(0, 0).value));
}

TEST_CASE("grouped_share: different groups make the interval wide, equal groups narrow") {
  const std::vector<Group> differ = {{100, 100}, {0, 100}, {100, 100}, {0, 100}};
  const std::vector<Group> equal = {{50, 100}, {50, 100}, {50, 100}, {50, 100}};
  const Share wide = grouped_share(differ), narrow = grouped_share(equal);
  CHECK(wide.value == 0.5);
  CHECK(narrow.value == 0.5);
  CHECK(wide.low == Approx(0));
  CHECK(wide.high == Approx(1));
  CHECK(narrow.low == Approx(0.5));
  CHECK(narrow.high == Approx(0.5));
  CHECK(grouped_share({{5, 10}, {0, 0}}).low == binomial_share(5, 10).low);
}

TEST_CASE("chi_square_quantile: agrees with the table") {
  CHECK(chi_square_quantile(0.95, 5) == Approx(11.070).epsilon(5e-3));
  CHECK(chi_square_quantile(0.975, 100) == Approx(129.561).epsilon(5e-3));
  CHECK(chi_square_quantile(0.025, 100) == Approx(74.222).epsilon(5e-3));
}

TEST_CASE("assign: finds the least cost of all assignments, including rows alone") {
  for (uint64_t seed = 1; seed <= 300; ++seed) {
    CAPTURE(seed);
    std::mt19937_64 random(seed);
    const auto draw = [&] { return double(random() >> 11) * 0x1p-53; };
    const int32_t rows = int32_t(random() % 6), columns = int32_t(random() % 6);
    const double alone = 0.2 + draw();
    std::vector<double> cost(std::size_t(rows * columns));
    for (double& c : cost) c = random() % 3 == 0 ? kForbidden : draw() - 0.1;
    const auto cost_of = [&](int32_t i, int32_t j) { return cost[std::size_t(i * columns + j)]; };
    std::vector<bool> taken(std::size_t(columns), false);
    const auto least = [&](auto&& self, int32_t i) -> double {
      if (i == rows) return 0;
      double best = alone + self(self, i + 1);
      for (int32_t j = 0; j < columns; ++j) {
        if (taken[std::size_t(j)] || cost_of(i, j) == kForbidden) continue;
        taken[std::size_t(j)] = true;
        best = std::min(best, cost_of(i, j) + self(self, i + 1));
        taken[std::size_t(j)] = false;
      }
      return best;
    };
    const std::vector<int32_t> column_of = assign(rows, columns, alone, cost_of);
    double sum = 0;
    std::vector<bool> seen(std::size_t(columns), false);
    for (int32_t i = 0; i < rows; ++i) {
      const int32_t j = column_of[std::size_t(i)];
      sum += j < 0 ? alone : cost_of(i, j);
      if (j < 0) continue;
      CHECK_FALSE(seen[std::size_t(j)]);
      seen[std::size_t(j)] = true;
    }
    CHECK(sum == Approx(least(least, 0)).epsilon(1e-12));
  }
}
