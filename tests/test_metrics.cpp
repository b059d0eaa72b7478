// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// GOSPA, HOTA, NEES, gaps and distributions on cases whose answer is known in closed form.
#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "tools/metrics/consistency.h"
#include "tools/metrics/gospa.h"
#include "tools/metrics/hota.h"
#include "tools/metrics/summary.h"

using namespace overtake::metrics;
using doctest::Approx;

namespace {

using Line = std::vector<std::pair<uint64_t, double>>;

std::vector<MotPlace> places(const Line& line) {
  std::vector<MotPlace> out;
  for (const auto& [id, x] : line) out.push_back({id, x, 0.0});
  return out;
}

// The least over all pairings, by trying every one.
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

TEST_CASE("gospa: one pair is its distance, a miss or a false track c / sqrt 2") {
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

TEST_CASE("gospa: two good pairs are not broken for three bad ones, nor one for two") {
  // objects 1 at 0, 2 at 1.9;  tracks 10 at 0, 20 at -1.9: 1-10 alone costs 0 + 2 + 2, both pairs 2 * 1.9^2 = 7.22
  const Gospa g = gospa(places({{1, 0}, {2, 1.9}}), places({{10, 0}, {20, -1.9}}));
  CHECK(g.pairs == 1);
  CHECK(g.distance_m == Approx(2.0));
  CHECK(g.localisation + g.missed + g.false_tracks == Approx(4.0));
}

TEST_CASE("gospa agrees with trying every pairing") {
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

TEST_CASE("hota: a perfect tracker has 1, none at all has 0") {
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

TEST_CASE("hota: an id that changes half-way halves the association and leaves the detection") {
  // Each half: A(c) = 5 / (10 + 5 - 5) = 1/2, so AssA = 1/2, DetA = 1, HOTA = sqrt(1/2)
  Hota hota;
  for (int32_t k = 0; k < 10; ++k) hota.add_frame(places({{1, k}}), places({{k < 5 ? 10u : 20u, k}}));
  CHECK(hota.result().detection == Approx(1));
  CHECK(hota.result().association == Approx(0.5));
  CHECK(hota.result().hota == Approx(std::sqrt(0.5)));
}

TEST_CASE("hota: an offset counts for the thresholds it is good enough for") {
  // 0.5 m of 2 m: likeness 0.75, good for alpha 0.05 .. 0.75, which are 15 of 19
  Hota hota;
  for (int32_t k = 0; k < 4; ++k) hota.add_frame(places({{1, k}}), places({{10, k + 0.5}}));
  CHECK(hota.result().hota == Approx(15.0 / 19));
  CHECK(hota.result().localisation == Approx(0.75));
  CHECK(hota.result().hota_of_alpha[14] == Approx(1));
  CHECK(hota.result().hota_of_alpha[15] == 0);
}

TEST_CASE("hota: false tracks and misses lower the detection by TP / (TP + FN + FP)") {
  // 4 frames: the track is there in 2 of them; a false one in all. TP 2, FN 2, FP 4
  Hota hota;
  for (int32_t k = 0; k < 4; ++k)
    hota.add_frame(places({{1, 0}}), k < 2 ? places({{10, 0}, {20, 90}}) : places({{20, 90}}));
  CHECK(hota.result().detection == Approx(2.0 / 8));
  CHECK(hota.result().association == Approx(2.0 / 4));
}

TEST_CASE("normalized_square is e^2 / variance, and sees correlation") {
  const double e[2] = {3, 4}, diagonal[3] = {9, 0, 4};
  CHECK(normalized_square(e, diagonal, 1) == Approx(1));
  CHECK(normalized_square(e, diagonal, 2) == Approx(1 + 4));
  // P = [2 1; 1 2], P^-1 = 1/3 [2 -1; -1 2], e = (1, 1): 2/3
  const double ones[2] = {1, 1}, both[3] = {2, 1, 2}, broken[3] = {1, 2, 1};
  CHECK(normalized_square(ones, both, 2) == Approx(2.0 / 3));
  CHECK(std::isnan(normalized_square(ones, broken, 2)));
}

TEST_CASE("continuity: time to confirm and longest gap of a car, and it may come twice") {
  Continuity c;
  // 0.1 s steps: in view 0 .. 2.0, followed from 0.5 to 0.9 and from 1.4 to 1.8; again from 5.0 to 5.2, never followed
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

TEST_CASE("false tracks are those that never were at a car") {
  FalseTracks f;
  for (const uint64_t track : {1u, 2u, 2u, 3u}) f.add(track, false);
  f.add(1, true);
  CHECK(f.count() == 2);
  CHECK(f.per_hour(1800) == Approx(4));
  CHECK(std::isnan(f.per_hour(0)));
}

TEST_CASE("summarize: percentiles of 0 .. 100 are themselves, what is not finite is left out") {
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

TEST_CASE("binomial_share is Wilson's interval") {
  const Share half = binomial_share(5, 10);  // 0.5 +- by the formula: 0.2366, 0.7634
  CHECK(half.value == 0.5);
  CHECK(half.low == Approx(0.2366).epsilon(1e-3));
  CHECK(half.high == Approx(0.7634).epsilon(1e-3));
  const Share none = binomial_share(0, 10);  // z^2 / (n + z^2)
  CHECK(none.low == 0);
  CHECK(none.high == Approx(3.8415 / 13.8415).epsilon(1e-3));
  CHECK(std::isnan(binomial_share(0, 0).value));
}

TEST_CASE("grouped_share: groups that differ make the interval wide, equal ones narrow") {
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

TEST_CASE("chi_square_quantile agrees with the table") {
  CHECK(chi_square_quantile(0.95, 5) == Approx(11.070).epsilon(5e-3));
  CHECK(chi_square_quantile(0.975, 100) == Approx(129.561).epsilon(5e-3));
  CHECK(chi_square_quantile(0.025, 100) == Approx(74.222).epsilon(5e-3));
}
