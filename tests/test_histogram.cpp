// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <random>
#include <sstream>
#include <vector>

#include "bench/histogram.h"

namespace overtake::bench {
namespace {

// The value that `percent` of the sorted values do not exceed, nearest rank.
int64_t exact_percentile(const std::vector<int64_t>& sorted, int64_t per_mille) {
  const auto n = int64_t(sorted.size());
  const int64_t rank = std::max<int64_t>(1, (per_mille * n + 999) / 1000);
  return sorted[std::size_t(rank - 1)];
}

TEST_CASE("histogram: buckets have no gaps and are narrower than a thousandth of their values") {
  int64_t next = 0;
  for (int32_t bucket = 0; bucket < 50'000; ++bucket) {
    REQUIRE(Histogram::bucket_lowest(bucket) == next);
    const int64_t highest = Histogram::bucket_highest(bucket);
    REQUIRE(Histogram::bucket_of(next) == bucket);
    REQUIRE(Histogram::bucket_of(highest) == bucket);
    REQUIRE((highest - next) * 1000 <= next);
    next = highest + 1;
  }
}

TEST_CASE("histogram: percentiles equal those of the sorted values within three significant digits") {
  std::mt19937_64 random(3);
  for (const std::size_t n : {1u, 2u, 3u, 10u, 999u, 1000u, 1001u, 20'000u}) {
    std::vector<int64_t> values;
    Histogram histogram;
    for (std::size_t i = 0; i < n; ++i) {
      values.push_back(int64_t(std::exp2(double(random() % 40'000) / 1000.0)));  // 1 ns to 18 minutes
      histogram.record(values.back());
    }
    std::sort(values.begin(), values.end());
    CAPTURE(n);
    CHECK(histogram.count() == int64_t(n));
    CHECK(histogram.min() == values.front());
    CHECK(histogram.max() == values.back());
    CHECK(histogram.percentile(100) == values.back());
    for (const int64_t per_mille : {0, 1, 100, 500, 900, 990, 999}) {
      const int64_t exact = exact_percentile(values, per_mille), got = histogram.percentile(double(per_mille) / 10);
      CAPTURE(per_mille);
      CHECK(got >= exact);
      CHECK((got - exact) * 1000 <= exact);
    }
  }
}

TEST_CASE("histogram: small values are exact, a negative value counts as zero, an empty histogram gives zero") {
  Histogram histogram;
  CHECK(histogram.percentile(50) == 0);
  CHECK(histogram.min() == 0);
  CHECK(histogram.max() == 0);
  for (int64_t i = 1; i <= 1000; ++i) histogram.record(i);
  CHECK(histogram.percentile(50) == 500);
  CHECK(histogram.percentile(99) == 990);
  CHECK(histogram.percentile(99.9) == 999);
  CHECK(histogram.percentile(100) == 1000);
  CHECK(histogram.mean() == doctest::Approx(500.5));
  CHECK(histogram.deviation() == doctest::Approx(std::sqrt((1000.0 * 1000.0 - 1) / 12)));
  histogram.record(-7);
  CHECK(histogram.min() == 0);
  CHECK(histogram.count() == 1001);
}

TEST_CASE("histogram: the sum of two is the histogram of all their values") {
  Histogram low, high, all;
  for (int64_t i = 0; i < 500; ++i) low.record(i * 3), all.record(i * 3);
  for (int64_t i = 0; i < 700; ++i) high.record(i * 100'003), all.record(i * 100'003);
  low.add(high);
  CHECK(low.format_hgrm(1) == all.format_hgrm(1));
  CHECK(low.min() == all.min());
  CHECK(low.max() == 699 * 100'003);
}

TEST_CASE("histogram: the percentile text has HdrHistogram's columns, grows, and ends with all values") {
  Histogram histogram;
  for (int64_t i = 1; i <= 10'000; ++i) histogram.record(i * 1000);
  std::istringstream text(histogram.format_hgrm(1000));
  std::string line;
  std::getline(text, line);
  CHECK(line == "       Value     Percentile TotalCount 1/(1-Percentile)");
  std::getline(text, line);
  CHECK(line.empty());
  double last_value = -1, last_level = -1;
  int64_t last_count = 0, rows = 0;
  while (std::getline(text, line) && line[0] != '#') {
    std::istringstream row(line);
    double value = 0, level = 0, inverse = 0;
    int64_t count = 0;
    REQUIRE(bool(row >> value >> level >> count));
    CHECK(value >= last_value);
    CHECK(level > last_level);
    CHECK(count >= last_count);
    CHECK(double(count) >= level * 10'000 - 1e-6);
    if (level < 1) {
      REQUIRE(bool(row >> inverse));
      CHECK(inverse == doctest::Approx(1 / (1 - level)).epsilon(0.01));
      CHECK(value == doctest::Approx(std::max(level * 10'000, 1.0)).epsilon(0.003));
    }
    last_value = value, last_level = level, last_count = count, ++rows;
  }
  CHECK(last_level == 1);
  CHECK(last_count == 10'000);
  CHECK(last_value == doctest::Approx(10'000));
  CHECK(rows > 40);
  double mean = 0, deviation = 0;
  REQUIRE(std::sscanf(line.c_str(), "#[Mean    = %12lf, StdDeviation   = %12lf]", &mean, &deviation) == 2);
  CHECK(mean == doctest::Approx(5000.5).epsilon(0.0005));
  CHECK(deviation == doctest::Approx(2886.75).epsilon(0.0005));
  std::getline(text, line);
  CHECK(line == "#[Max     =    10000.000, Total count    =        10000]");
  std::getline(text, line);
  CHECK(line.substr(0, 12) == "#[Buckets = ");
}

}  // namespace
}  // namespace overtake::bench
