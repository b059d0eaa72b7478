// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Jumps of the ego poses, found from iteration to iteration.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "core/math.h"
#include "pipeline/track/iteration.h"

using namespace overtake;

namespace {

constexpr int64_t kStep_ns = 50'000'000, kFirst_ns = 1'000'000'000;

// A vehicle on a circle that brakes: its pose after t_s.
TrackerEgo driving(double t_s, double rate_rps = 0.5, double speed_mps = 80.0, double brake_mps2 = 25.0) {
  TrackerEgo ego;
  ego.known = true;
  const double slope = brake_mps2 / speed_mps,
               share = t_s - 0.5 * slope * t_s * t_s;  // of the speed at first, over time
  ego.speed_mps = speed_mps - brake_mps2 * t_s;
  ego.yaw_rate_rps = rate_rps * (1.0 - slope * t_s);
  ego.heading_rad = rate_rps * share;
  const double radius_m = speed_mps / rate_rps;
  ego.x_m = radius_m * std::sin(ego.heading_rad);
  ego.y_m = radius_m * (1.0 - std::cos(ego.heading_rad));
  return ego;
}

// Follows the vehicle for a second, in steps; from `jump_at` on its poses are changed by `change`. Returns the seconds
// since the last jump.
template <class Change>
double follow(double step_s, double jump_at_s, Change&& change) {
  EgoJumps jumps;
  int64_t now_ns = 0;
  for (double t_s = 0; t_s < 1.01; t_s += step_s) {
    TrackerEgo ego = driving(t_s);
    if (t_s > jump_at_s) change(ego);
    now_ns = kFirst_ns + std::llround(t_s * 1e9);
    jumps.follow(now_ns, ego);
  }
  return jumps.since_jump_s(now_ns);
}

}  // namespace

TEST_CASE("ego jumps: the first pose is a jump, and before it there is none") {
  EgoJumps jumps;
  CHECK(jumps.since_jump_s(kFirst_ns) == std::numeric_limits<double>::infinity());
  jumps.follow(kFirst_ns, {});
  CHECK(jumps.since_jump_s(kFirst_ns) == std::numeric_limits<double>::infinity());
  jumps.follow(kFirst_ns, driving(0));
  CHECK(jumps.since_jump_s(kFirst_ns) == 0.0);
  CHECK(jumps.since_jump_s(kFirst_ns + kStep_ns) == doctest::Approx(0.05));
}

TEST_CASE("ego jumps: a vehicle that brakes in a curve does not jump, at 4 Hz, 10 Hz and 60 Hz") {
  for (const double step_s : {0.25, 0.1, 1.0 / 60})
    CHECK(follow(step_s, 2.0, [](TrackerEgo&) {}) == doctest::Approx(1.0).epsilon(0.02));
}

namespace {

// Whether poses at a rate that jump aside show a jump at each of 20 phases of iterations at another rate.
bool is_always_found(double pose_s, double step_s, double jump_m) {
  for (int32_t phase = 0; phase < 20; ++phase) {
    EgoJumps jumps;
    const auto pose_of = [&](int32_t pose) { return 80 * pose_s * pose; };
    int64_t now_ns = 0;
    for (double t_s = 0.05 * phase * step_s; t_s < 1; t_s += step_s) {
      const auto pose = int32_t(t_s / pose_s);
      const double share = t_s / pose_s - pose;
      const auto jumped = [&](int32_t k) { return k * pose_s > 0.5 ? jump_m : 0.0; };
      TrackerEgo ego;
      ego.known = true;
      ego.speed_mps = 80;
      ego.x_m = pose_of(pose) + share * (pose_of(pose + 1) - pose_of(pose));
      ego.y_m = jumped(pose) + share * (jumped(pose + 1) - jumped(pose));
      now_ns = kFirst_ns + std::llround(t_s * 1e9);
      jumps.follow(now_ns, ego);
    }
    if (jumps.since_jump_s(now_ns) > 0.7) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("ego jumps: 1.5 m are found at any rate of iterations, though an iteration's pose lies between two others") {
  for (const double pose_s : {0.01, 0.02, 0.05, 0.1})
    for (const double step_s : {0.1, 0.05, 0.02, 0.01, 0.0083}) {
      CAPTURE(pose_s);
      CAPTURE(step_s);
      CHECK(is_always_found(pose_s, step_s, 1.5));
      CHECK(!is_always_found(pose_s, step_s, 0.3));
    }
  CHECK(is_always_found(0.02, 0.02, 0.8));
  CHECK(is_always_found(0.01, 0.0083, 0.8));
}

TEST_CASE("ego jumps: a heading that is off the course by 3 deg is no jump, at any rate of the iterations") {
  for (const double step_s : {0.2, 0.1, 0.05, 0.02, 0.0083}) {
    CAPTURE(step_s);
    EgoJumps jumps;
    int64_t now_ns = 0;
    for (double t_s = 0; t_s < 1; t_s += step_s) {
      TrackerEgo ego;
      ego.known = true;
      ego.speed_mps = 80;
      ego.x_m = 80 * t_s * std::cos(0.052), ego.y_m = 80 * t_s * std::sin(0.052);
      now_ns = kFirst_ns + std::llround(t_s * 1e9);
      jumps.follow(now_ns, ego);
    }
    CHECK(jumps.since_jump_s(now_ns) == doctest::Approx(1).epsilon(0.21));
  }
}

TEST_CASE("ego jumps: a pose that is 0.6 m or 0.6 deg from where speed and yaw rate lead is a jump; 0.4 are not") {
  const auto since = [](double x_m, double y_m, double turn_deg) {
    return follow(0.05, 0.52, [=](TrackerEgo& ego) {
      ego.x_m += x_m, ego.y_m += y_m, ego.heading_rad = wrap_angle(ego.heading_rad + turn_deg * kPi / 180.0);
    });
  };
  for (const double sign : {-1.0, 1.0}) {
    CAPTURE(sign);
    CHECK(since(sign * 0.6, 0, 0) == doctest::Approx(0.45));
    CHECK(since(0, sign * 0.6, 0) == doctest::Approx(0.45));
    CHECK(since(0, 0, sign * 0.6) == doctest::Approx(0.45));
    CHECK(since(sign * 0.4, 0, 0) == doctest::Approx(1.0));
    CHECK(since(0, sign * 0.4, 0) == doctest::Approx(1.0));
    CHECK(since(0, 0, sign * 0.4) == doctest::Approx(1.0));
  }
}

TEST_CASE(
    "ego jumps: a heading that passes 180 deg is no jump; a gap of 0.4 s is one, and an iteration without pose none") {
  EgoJumps jumps;
  int64_t now_ns = kFirst_ns;
  for (int32_t k = 0; k < 20; ++k, now_ns += kStep_ns) {
    TrackerEgo ego;
    ego.known = true;
    ego.heading_rad = wrap_angle(kPi - 0.1 + 0.02 * k);
    ego.yaw_rate_rps = 0.4;
    jumps.follow(now_ns, k % 3 != 2 ? ego : TrackerEgo{});
    CHECK(jumps.since_jump_s(now_ns) == doctest::Approx(0.05 * k));
  }
  TrackerEgo last;
  last.known = true;
  last.heading_rad = wrap_angle(kPi - 0.1 + 0.4 * seconds_between(kFirst_ns, now_ns + 8 * kStep_ns));
  last.yaw_rate_rps = 0.4;
  jumps.follow(now_ns + 8 * kStep_ns, last);
  CHECK(jumps.since_jump_s(now_ns + 8 * kStep_ns) == 0.0);
}

TEST_CASE("ego jumps: a far jump is 5 m from where the places lead, or farther by the speed that is pushed") {
  const auto since = [](double jump_m, double speed_share) {
    EgoJumps jumps;
    int64_t now_ns = 0;
    for (int32_t k = 0; k < 20; ++k) {
      now_ns = kFirst_ns + k * kStep_ns;
      TrackerEgo ego;
      ego.known = true;
      ego.x_m = 80 * 0.05 * k + (k >= 10 ? jump_m : 0.0);
      ego.speed_mps = 80 * speed_share;
      jumps.follow(now_ns, ego);
    }
    return jumps.since_far_jump_s(now_ns);
  };
  constexpr double kNever = std::numeric_limits<double>::infinity();
  CHECK(since(0, 1) == kNever);
  CHECK(since(4.5, 1) == kNever);
  CHECK(since(-4.5, 1) == kNever);
  CHECK(since(6, 1) == doctest::Approx(0.45));  // the places alone tell it
  CHECK(since(-6, 1) == doctest::Approx(0.45));
  CHECK(since(10, 1) == doctest::Approx(0.45));
  CHECK(since(-10, 1) == doctest::Approx(0.45));
  // A speed that is pushed as 0 looks like jumps again and again, so hardly any time goes by after the last one.
  CHECK(since(0, 0) < 0.15);
}

// ---- jumps that move tracks ----------------------------------------------------------------------------------------

namespace {

struct Moves {
  int32_t count = 0;
  double x_m = 0, y_m = 0;  // sums
};

// Follows the vehicle for two seconds; change(t_s, ego) changes its poses.
template <class Change>
Moves follow_places(double step_s, Change&& change) {
  EgoJumps jumps;
  Moves moves;
  for (double t_s = 0; t_s < 2.01; t_s += step_s) {
    TrackerEgo ego = driving(t_s, 0.3, 70.0, 20.0);
    change(t_s, ego);
    jumps.follow(kFirst_ns + std::llround(t_s * 1e9), ego);
    if (!jumps.jumped) continue;
    ++moves.count;
    moves.x_m += jumps.jump_x_m, moves.y_m += jumps.jump_y_m;
  }
  return moves;
}

}  // namespace

TEST_CASE("ego jumps: a jump of the places tells how far, also if the pushed speed is wrong") {
  for (const double step_s : {0.1, 0.05, 0.02})
    for (const double speed_share : {1.0, 0.0, 3.6})
      for (const double size : {0.0, 0.6, 1.0, 3.0}) {
        CAPTURE(step_s);
        CAPTURE(speed_share);
        CAPTURE(size);
        const Moves moves = follow_places(step_s, [&](double t_s, TrackerEgo& ego) {
          ego.speed_mps *= speed_share;
          if (t_s > 1.01) ego.x_m += size * 1.2, ego.y_m -= size * 0.9;
        });
        const bool is_told = size >= 1.0;
        CHECK(moves.count >= int32_t(is_told));
        CHECK(moves.count <= int32_t(size > 0.0));
        if (!is_told) continue;
        CHECK(std::fabs(moves.x_m - size * 1.2) < 0.3);
        CHECK(std::fabs(moves.y_m + size * 0.9) < 0.3);
      }
}

TEST_CASE("ego jumps: one wrong pose is a jump out and back, a far one moves nothing") {
  const auto at = [](double t_s, double from_s, double to_s) { return t_s > from_s - 1e-6 && t_s < to_s - 1e-6; };
  Moves moves = follow_places(0.05, [&](double t_s, TrackerEgo& ego) { ego.y_m += at(t_s, 1.0, 1.05) ? 2.0 : 0.0; });
  CHECK(moves.count == 2);
  CHECK(std::fabs(moves.x_m) < 0.2);
  CHECK(std::fabs(moves.y_m) < 0.2);
  moves = follow_places(0.05, [&](double t_s, TrackerEgo& ego) { ego.y_m += at(t_s, 1.0, 99.0) ? 6.0 : 0.0; });
  CHECK(moves.count == 0);
  // After a far jump, and after a silence, the way is measured anew, and the next jump is told.
  for (const double first_m : {6.0, 0.0}) {
    CAPTURE(first_m);
    moves = follow_places(0.05, [&](double t_s, TrackerEgo& ego) {
      if (at(t_s, 0.5, 0.7) && first_m == 0.0) ego.known = false;
      ego.y_m += (at(t_s, 0.5, 99.0) ? first_m : 0.0) + (at(t_s, 1.5, 99.0) ? 2.0 : 0.0);
    });
    CHECK(moves.count == 1);
    CHECK(std::fabs(moves.y_m - 2.0) < 0.2);
  }
  // A vehicle that is suddenly much faster than its places told (a wrong first way) is followed again soon.
  double off_m = 0;
  moves = follow_places(0.05, [&](double t_s, TrackerEgo& ego) {
    off_m += t_s < 0.4 ? 0.0 : 1.0;
    ego.x_m += off_m;
    ego.y_m += at(t_s, 1.5, 99.0) ? 2.0 : 0.0;
  });
  CHECK(moves.count >= 1);
  CHECK(moves.count <= 5);
  CHECK(std::fabs(moves.y_m - 2.0) < 0.3);
}

TEST_CASE("ego jumps: a vehicle that hits something has places that its speed leads to") {
  EgoJumps jumps;
  TrackerEgo ego;
  ego.known = true;
  for (int32_t k = 0; k < 40; ++k) {
    const double before_mps = ego.speed_mps;
    ego.speed_mps = k < 20 ? 70.0 : 0.0;
    ego.x_m += 0.5 * (before_mps + ego.speed_mps) * 0.05;
    jumps.follow(kFirst_ns + k * kStep_ns, ego);
    if (k > 1) CHECK_FALSE(jumps.jumped);
  }
}
