// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/iteration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/math.h"

namespace overtake {
namespace {

TrackerEgo make_sane(const TrackerEgo& ego) {
  const bool finite = std::fabs(ego.x_m) <= kMaxPlace_m && std::fabs(ego.y_m) <= kMaxPlace_m &&
                      std::fabs(ego.heading_rad) <= kMaxAngle_rad && std::fabs(ego.speed_mps) <= kMaxSpeed_mps;
  if (!ego.known || !finite) return {};
  TrackerEgo sane = ego;
  if (!(std::fabs(ego.yaw_rate_rps) <= kMaxYawRate_rps)) sane.yaw_rate_rps = 0;
  return sane;
}

// A jump is at least so far, and this share of the way: the published heading may be off the course by the slip angle.
constexpr double kPoseJump_m = 0.5, kPoseJumpShare = 0.07, kPoseJump_rad = 0.5 * kPi / 180.0;
constexpr double kPoseGap_s = 0.3, kPoseFade_s = 0.05, kFarJump_m = 5.0;

bool is_measurement(const Measurement& z, int64_t frame_ns) noexcept {
  return std::fabs(z.x_m) <= kMaxPlace_m && std::fabs(z.y_m) <= kMaxPlace_m &&
         std::fabs(seconds_between(frame_ns, z.stamp_ns)) <= kMaxStampSpread_s;
}

double value_or_none(double value, double low, double high) noexcept {
  return value >= low && value <= high ? value : kNotMeasured;
}

// Keeps the measurement's covariance if it is valid, else uses R of the parameters.
Measurement make_sane(Measurement z, const double* r_diag) noexcept {
  if (r_diag) ensure_covariance(r_diag, z);
  z.heading_rad = wrap_angle(value_or_none(z.heading_rad, -kMaxAngle_rad, kMaxAngle_rad));
  z.length_m = value_or_none(z.length_m, 0.0, 1e3);
  z.width_m = value_or_none(z.width_m, 0.0, 1e3);
  z.height_m = value_or_none(z.height_m, -1e3, 1e3);
  z.score = value_or_none(z.score, 0.0, 1.0);
  return z;
}

}  // namespace

int32_t count_unusable(const Measurement& z, bool gives_covariance) noexcept {
  const Measurement sane = make_sane(z, nullptr);
  const auto is_lost = [](double given, double kept) { return given == given && kept != kept; };
  return (gives_covariance && !has_covariance(z)) + is_lost(z.heading_rad, sane.heading_rad) +
         is_lost(z.length_m, sane.length_m) + is_lost(z.width_m, sane.width_m) + is_lost(z.height_m, sane.height_m) +
         is_lost(z.score, sane.score);
}

namespace {

// Selects at most detection_capacity of the frame's measurements: the nearest to the ego.
void select_rows(const TrackerParams& params, const TrackerFrame& frame, Iteration& it) noexcept {
  const Measurement* const given = frame.measurements.data();
  const Place ego = {it.ego.x_m, it.ego.y_m};
  // Total orders by the measured values; the row number only breaks ties.
  const auto is_nearer = [&](int32_t i, int32_t k) {
    const Measurement &a = given[i], &b = given[k];
    const double of_a = distance_m2(place_of(a), ego), of_b = distance_m2(place_of(b), ego);
    return std::tie(of_a, a.stamp_ns, a.x_m, a.y_m, i) < std::tie(of_b, b.stamp_ns, b.x_m, b.y_m, k);
  };
  const auto is_earlier = [&](int32_t i, int32_t k) {
    const Measurement &a = given[i], &b = given[k];
    return std::tie(a.stamp_ns, a.x_m, a.y_m, i) < std::tie(b.stamp_ns, b.x_m, b.y_m, k);
  };
  int32_t* const kept = it.row;  // a heap with the farthest on top once it is full
  int32_t count = 0;
  it.rejected = it.unread = 0;
  for (int32_t row = 0; row < int32_t(frame.measurements.size()); ++row) {
    if (!is_measurement(given[row], frame.stamp_ns)) {
      it.rejected += !given[row].faint;
      continue;
    }
    if (count < params.detection_capacity) {
      kept[count++] = row;
      if (count == params.detection_capacity) std::make_heap(kept, kept + count, is_nearer);
      continue;
    }
    const int32_t left = is_nearer(row, kept[0]) ? kept[0] : row;
    it.unread += !given[left].faint;
    if (left == row) continue;
    std::pop_heap(kept, kept + count, is_nearer);
    kept[count - 1] = row;
    std::push_heap(kept, kept + count, is_nearer);
  }
  std::sort(kept, kept + count, is_earlier);
  it.count = count;
}

bool is_between(const Sector& s, double angle_rad) noexcept {
  const double width_rad = s.left_rad - s.right_rad;
  if (width_rad >= kTwoPi - 1e-9) return true;  // rounding may leave a gap in a full turn
  double right_of_left_rad = wrap_angle(s.left_rad - angle_rad);
  if (right_of_left_rad < 0.0) right_of_left_rad += kTwoPi;
  return right_of_left_rad <= width_rad;
}

bool is_in_sector(const ObservedSector& s, double x_m, double y_m) noexcept {
  const double dx = x_m - s.x_m, dy = y_m - s.y_m, range_m = hypot_f64(dx, dy);
  if (!(range_m >= s.range_min_m && range_m <= s.range_max_m && range_m <= 4.0 * kMaxPlace_m)) return false;
  const double angle_rad = atan2_f64(dy, dx);
  return is_between(s.view, angle_rad) &&
         std::none_of(s.gap, s.gap + s.gap_count, [&](const Sector& gap) { return is_between(gap, angle_rad); });
}

}  // namespace

void read_frame(const TrackerParams& params, const TrackerFrame& frame, Iteration& it) noexcept {
  it.stamp_ns = frame.stamp_ns;
  it.ego = make_sane(frame.ego);
  it.in_map = frame.in_map;
  it.ask_map = frame.ask_map;
  it.of_rows = frame.of_rows;
  it.ego_jumped = false;
  it.sector_count = std::min(frame.sector_count, kMaxSensors);
  std::copy_n(frame.sectors, std::max(it.sector_count, 0), it.sectors);
  select_rows(params, frame, it);
  for (int32_t i = 0; i < it.count; ++i) {
    const Measurement& z = frame.measurements[std::size_t(it.row[i])];
    it.measurement[i] = make_sane(z, params.r_diag);
    it.ego_distance_m2[i] = distance_m2(place_of(z), {it.ego.x_m, it.ego.y_m});
  }
}

void EgoJumps::follow(int64_t now_ns, const TrackerEgo& now) noexcept {
  jumped = jumped_far = false;
  if (!now.known) {
    has_way = since.known = false;
    return;
  }
  const double dt_s = seconds_between(stamp_ns, now_ns);
  const TrackerEgo last = ego;
  stamp_ns = now_ns;
  ego = now;
  bool jumps = !last.known || dt_s > kPoseGap_s;
  if (last.known) {
    const double turn_rad = 0.5 * (last.yaw_rate_rps + now.yaw_rate_rps) * dt_s;
    const double way_m = 0.5 * (last.speed_mps + now.speed_mps) * dt_s, keep = kPoseFade_s / (kPoseFade_s + dt_s);
    double sine, cosine;  // of the heading half way
    sin_cos_f64(last.heading_rad + 0.5 * turn_rad, sine, cosine);
    const double x_m = now.x_m - last.x_m - way_m * cosine, y_m = now.y_m - last.y_m - way_m * sine;
    off_x_m = keep * off_x_m + x_m, off_y_m = keep * off_y_m + y_m;
    off_rad = keep * off_rad + wrap_angle(now.heading_rad - last.heading_rad - turn_rad);
    far_x_m = keep * far_x_m + x_m, far_y_m = keep * far_y_m + y_m;
    const double speed_mps = 0.5 * std::fabs(last.speed_mps + now.speed_mps);
    const double most_m = std::max(kPoseJump_m, kPoseJumpShare * speed_mps * (dt_s + kPoseFade_s));
    const double far_m = kFarJump_m + std::fabs(way_m);
    if (!(off_x_m * off_x_m + off_y_m * off_y_m < most_m * most_m && std::fabs(off_rad) < kPoseJump_rad)) jumps = true;
    if (!(far_x_m * far_x_m + far_y_m * far_y_m < far_m * far_m)) note_far_jump(now_ns);
  }
  follow_way(now_ns, last, dt_s);
  jumped = jumped && jumps;
  if (!jumps) return;
  jumped_ns = now_ns;
  off_x_m = off_y_m = off_rad = 0.0;
}

// Where the places lead, without the pushed speed: over kWay_s, because a place has an error of some centimetres. The
// velocity outlasts a jump; after kMostDoubts places that it does not lead to, it is measured anew.
void EgoJumps::follow_way(int64_t now_ns, const TrackerEgo& last, double dt_s) noexcept {
  constexpr double kWay_s = 0.04, kMostAcceleration = 50.0, kError_m = 0.15;
  constexpr int32_t kMostDoubts = 3;
  if (!last.known || dt_s > kPoseGap_s) has_way = since.known = false;
  bool follows = false;
  if (has_way && dt_s > 0.0) {
    jump_x_m = ego.x_m - last.x_m - way_x_mps * dt_s, jump_y_m = ego.y_m - last.y_m - way_y_mps * dt_s;
    const double off_m = hypot_f64(jump_x_m, jump_y_m);
    follows = off_m < kError_m + kMostAcceleration * dt_s * dt_s;
    jumped = !follows && off_m > kPoseJump_m && off_m <= kFarJump_m;
    jumped_far = !follows && off_m > kFarJump_m;
    if (jumped_far) note_far_jump(now_ns);
    doubts = follows ? 0 : doubts + 1;
    if (doubts >= kMostDoubts) has_way = since.known = false;
  }
  if (since.known && (follows || !has_way) && seconds_between(since_ns, now_ns) >= kWay_s) {
    const double way_s = seconds_between(since_ns, now_ns);
    way_x_mps = (ego.x_m - since.x_m) / way_s, way_y_mps = (ego.y_m - since.y_m) / way_s;
    has_way = true;
    doubts = 0;
    since = ego, since_ns = now_ns;
  } else if (!since.known || (has_way && dt_s > 0.0 && !follows)) {
    since = ego, since_ns = now_ns;
  }
}

double EgoJumps::since_jump_s(int64_t now_ns) const noexcept {
  return ego.known ? seconds_between(jumped_ns, now_ns) : std::numeric_limits<double>::infinity();
}

double EgoJumps::since_far_jump_s(int64_t now_ns) const noexcept {
  return jumped_far_ns != INT64_MIN ? seconds_between(jumped_far_ns, now_ns) : std::numeric_limits<double>::infinity();
}

bool is_observed(const Iteration& it, double x_m, double y_m) noexcept {
  if (it.sector_count < 0) return true;
  for (int32_t i = 0; i < it.sector_count; ++i)
    if (is_in_sector(it.sectors[i], x_m, y_m)) return true;
  return false;
}

}  // namespace overtake
