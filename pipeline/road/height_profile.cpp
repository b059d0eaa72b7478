// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/road/height_profile.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"
#include "pipeline/clock_watch.h"

namespace overtake {
namespace {

constexpr double kOffRoad_m = 1.0;       // a pose this far outside of the circuit is not on its road
constexpr double kLongestStep_m = 40.0;  // between two poses; a longer one is a jump
constexpr double kLargestClimb = 0.5;    // of the height between two poses: a larger one is a jump
constexpr int64_t kLongestStepNs = 1'000'000'000;
// A step that differs by this, on the level or in height, from going on with the velocity of the step before is one of
// the localisation: a car accelerates by 50 m/s^2 at most, and good poses have a noise of some centimetres.
constexpr double kJump_m = 0.4, kRise_m = 0.25, kMostAcceleration = 50.0;
constexpr int32_t kMostInARow = 3;       // jumps; then the velocity is wrong, not the places
constexpr double kFarthestJump_m = 5.0;  // after a longer one the vehicle is at another place: its height tells nothing
constexpr int32_t kPasses = 4;           // the mean over passes forgets older ones
constexpr int64_t kThisLapNs = 20'000'000'000;
constexpr double kLeastEarlier = 0.25;  // share of earlier laps in the height below the vehicle that shows the drift
// A vehicle that stands at the border of two bins would renew them with each pose. A late scan still finds its value if
// a bin keeps two values that are this far apart: a scan may be late by kLateNs, and poses may be ahead of it.
constexpr int64_t kRenewNs = 1'000'000'000;
constexpr int32_t kHere = RoadData::kStations / 2, kAhead = 2;  // stations; so many ahead count as known
static_assert(kRenewNs >= kLateNs + HeightProfile::kLagNs);
constexpr double kDriftShare = 0.2;  // of a new bin in the drift since the last lap: the mean of about 25 m

bool is_on_road(const MapProjection& at) noexcept {
  return at.d_m <= at.width_left_m + kOffRoad_m && at.d_m >= -at.width_right_m - kOffRoad_m;
}

// The range less the runs of poses that begin long after the scan. Their clock may have stepped ahead, which only the
// frame can tell (FrameAssembler::watch_ego); a place between such a run and the poses before it would be wrong.
EgoRange without_later_runs(const EgoBuffer& poses, EgoRange range, int64_t stamp_ns) noexcept {
  const int64_t oldest = poses.oldest_safe(range);
  while (range.count > oldest) {
    const int64_t begin = poses.run_at(range.count - 1);
    if (begin <= oldest || difference_ns(poses.stamp_at(begin), stamp_ns) <= kEgoFreshNs) break;
    range.count = begin;
  }
  return range;
}

}  // namespace

bool HeightProfile::build(const CircuitMap* map, const Allocator& allocator) {
  map_ = map;
  count_ = map ? std::max(1, int32_t(std::min(map->length_m() / kBin_m, 1e6))) : 0;
  if (!arena_.build(allocator, [&](Carver& carver) { bins_ = carver.take<Bin>(std::size_t(count_)); })) return false;
  std::fill_n(bins_, count_, Bin{});
  return true;
}

void HeightProfile::restart() noexcept {
  for (int32_t i = 0; i < count_; ++i) bins_[i].newest.from_ns = bins_[i].before.from_ns = INT64_MIN;
  has_last_ = has_drift_ = has_velocity_ = false;
  jump_count_ = 0;
  open_bin_ = -1;
  way_.clear();
}

int32_t HeightProfile::bin_at(double s_m) const noexcept {
  const double length = map_->length_m();
  double s = s_m;
  if (map_->closed()) {
    if (s < 0.0) s += length;
    if (s >= length) s -= length;
  }
  if (!(s >= 0.0) || s > length) return -1;
  return std::min(int32_t(s * double(count_) / length), count_ - 1);
}

const HeightProfile::Value& HeightProfile::value_at(int32_t bin, int64_t stamp_ns) const noexcept {
  const Bin& b = bins_[bin];
  return b.newest.from_ns <= stamp_ns ? b.newest : b.before;
}

// The profile between the middles of two bins.
HeightProfile::Reading HeightProfile::read(double s_m, int64_t stamp_ns) const noexcept {
  constexpr Reading kUnknown = {false, 0.0, 0.0, 0.0};
  const double half_m = 0.5 * map_->length_m() / double(count_);
  const int32_t a = bin_at(s_m - half_m), b = bin_at(s_m + half_m);
  if (a < 0 || b < 0) return kUnknown;
  const Value &va = value_at(a, stamp_ns), &vb = value_at(b, stamp_ns);
  if (va.passes == 0 || vb.passes == 0) return kUnknown;
  double from_a = s_m - (a + 0.5) * 2.0 * half_m;
  if (from_a < 0.0) from_a += map_->length_m();
  if (from_a >= map_->length_m()) from_a -= map_->length_m();  // a station beyond the start of a closed line
  const double u = std::clamp(from_a / (2.0 * half_m), 0.0, 1.0);
  const auto is_earlier = [&](const Value& v) {
    return v.from_ns == INT64_MIN || difference_ns(stamp_ns, v.from_ns) >= kThisLapNs;
  };
  const double height_a = va.height_m + rise_since(va, stamp_ns), height_b = vb.height_m + rise_since(vb, stamp_ns);
  return {true, height_a + u * (height_b - height_a), va.cross_slope + u * (vb.cross_slope - va.cross_slope),
          (is_earlier(va) ? 1.0 - u : 0.0) + (is_earlier(vb) ? u : 0.0)};
}

// How far the localisation has risen over the centre line in jumps since a value of this lap was learned.
double HeightProfile::rise_since(const Value& value, int64_t stamp_ns) const noexcept {
  if (jump_count_ == 0 || value.from_ns == INT64_MIN || difference_ns(stamp_ns, value.from_ns) >= kThisLapNs)
    return 0.0;
  double rise_m = 0.0;
  for (int32_t i = 0; i < std::min(jump_count_, kJumps); ++i)
    if (jumps_[i].stamp_ns <= stamp_ns && later_ns(jumps_[i].stamp_ns, kLagNs) > value.from_ns)
      rise_m += jumps_[i].rise_m;
  return rise_m;
}

// Whether the localisation has jumped since the last pose. Afterwards that pose is this one. The velocity outlasts a
// jump: a single wrong pose is two.
bool HeightProfile::is_jump(const EgoPose& pose) noexcept {
  const double seconds = double(difference_ns(pose.stamp_ns, last_pose_.stamp_ns)) * 1e-9;
  const double x_m = pose.x_m - last_pose_.x_m, y_m = pose.y_m - last_pose_.y_m, z_m = pose.z_m - last_pose_.z_m;
  const bool usable = has_last_ && seconds > 0.0;
  last_pose_ = pose;
  bool is_far = false;
  if (usable && has_velocity_) {
    const double error_x = x_m - velocity_x_ * seconds, error_y = y_m - velocity_y_ * seconds;
    const double error_z = std::fabs(z_m - velocity_z_ * seconds), change_m = kMostAcceleration * seconds * seconds;
    const double most_m = kJump_m + change_m, error_m2 = error_x * error_x + error_y * error_y;
    is_far = !(error_m2 + error_z * error_z <= kFarthestJump_m * kFarthestJump_m);
    const bool jumps = !is_far && (error_m2 > most_m * most_m || error_z > kRise_m + change_m);
    jumps_in_a_row_ = jumps ? jumps_in_a_row_ + 1 : 0;
    if (jumps && jumps_in_a_row_ <= kMostInARow) return true;
  }
  jumps_in_a_row_ = 0;
  has_velocity_ = usable && !is_far;
  if (has_velocity_) velocity_x_ = x_m / seconds, velocity_y_ = y_m / seconds, velocity_z_ = z_m / seconds;
  return false;
}

// The vehicle stands on the road before and after a jump, so the jump moves the road with it.
void HeightProfile::add_jump(const EgoState& ego, const Place& place) noexcept {
  const double seconds = double(difference_ns(place.stamp_ns, last_.stamp_ns)) * 1e-9;
  const double climb_m = std::sqrt(velocity_x_ * velocity_x_ + velocity_y_ * velocity_y_) * seconds * ego.r[6];
  const double rise_m = place.height_m - last_.height_m - climb_m;
  jumps_[jump_count_ % kJumps] = {place.stamp_ns, rise_m};
  jump_count_ = jump_count_ < 2 * kJumps ? jump_count_ + 1 : kJumps + 1;
  drift_m_ += rise_m;
  open_bin_ = -1;
}

// The centre line's height at a pose. Without banking in the map, the cross slope is that of the vehicle's own plane.
HeightProfile::Place HeightProfile::place_of(const EgoState& ego, const MapProjection& at) const noexcept {
  double cross_slope;
  if (map_->has_banking()) {
    cross_slope = map_->at(at.s_m).cross_slope();
  } else {
    double sine, cosine;
    sin_cos_f64(at.heading_rad, sine, cosine);
    cross_slope = ego.r[8] > 0.1 ? (ego.r[5] * cosine - ego.r[2] * sine) / ego.r[8] : 0.0;
  }
  return {at.s_m, ego.pose.z_m + at.d_m * cross_slope, cross_slope, ego.pose.stamp_ns};
}

void HeightProfile::complete(int64_t stamp_ns) noexcept {
  if (open_bin_ < 0 || open_samples_ == 0) return;
  Bin& bin = bins_[open_bin_];
  Value& v = bin.newest;
  const int64_t from_ns = later_ns(stamp_ns, kLagNs), age_ns = difference_ns(from_ns, v.from_ns);
  if (v.passes > 0 && age_ns >= 0 && age_ns < kRenewNs) return;
  const double height_m = open_height_m_ / open_samples_, cross_slope = open_cross_slope_ / open_samples_;
  bin.before = v;
  // Heights of an earlier lap get the drift of the localisation since then, so that a mean has heights of this lap.
  if (v.passes == 0) {
    has_drift_ = false;
  } else if (age_ns < 0 || age_ns >= kThisLapNs) {
    const double risen_m = height_m - v.height_m;
    drift_m_ = has_drift_ ? drift_m_ + kDriftShare * (risen_m - drift_m_) : risen_m;
    has_drift_ = true;
    v.height_m += drift_m_;
  } else {
    v.height_m += rise_since(v, stamp_ns);
  }
  v.passes = std::min(v.passes + 1, kPasses);
  v.height_m += (height_m - v.height_m) / v.passes;
  v.cross_slope += (cross_slope - v.cross_slope) / v.passes;
  v.from_ns = from_ns;
}

void HeightProfile::add(const Place& place) noexcept {
  const int32_t bin = bin_at(place.s_m);
  if (bin != open_bin_) {
    complete(place.stamp_ns);
    open_bin_ = bin;
    open_samples_ = 0;
    open_height_m_ = open_cross_slope_ = 0.0;
  }
  ++open_samples_;
  open_height_m_ += place.height_m;
  open_cross_slope_ += place.cross_slope;
}

// Adds the way from the last pose to this one, in pieces shorter than a bin: no bin on the way is left out.
void HeightProfile::learn(const EgoPose& pose) noexcept {
  const MapProjection at = map_->project(pose.x_m, pose.y_m, hint_);
  hint_ = at.segment;
  if (!is_on_road(at) || !pose.has_attitude) {
    complete(pose.stamp_ns);
    open_bin_ = -1;
    has_last_ = has_drift_ = has_velocity_ = false;
    return;
  }
  const EgoState ego = state_of(pose);
  const Place place = place_of(ego, at);
  const bool jumps = is_jump(pose);
  if (jumps) {
    add_jump(ego, place);
  } else if (has_last_) {
    double step_m = place.s_m - last_.s_m;
    const double length = map_->length_m();
    if (map_->closed() && step_m > 0.5 * length) step_m -= length;
    if (map_->closed() && step_m < -0.5 * length) step_m += length;
    const bool steady = std::fabs(step_m) <= kLongestStep_m &&
                        std::fabs(place.height_m - last_.height_m) <= kLargestClimb * (std::fabs(step_m) + 1.0) &&
                        difference_ns(place.stamp_ns, last_.stamp_ns) <= kLongestStepNs;
    if (!steady) {
      open_bin_ = -1;
      has_drift_ = false;
    } else {
      const int32_t pieces = 1 + int32_t(std::fabs(step_m) / (0.5 * kBin_m));
      for (int32_t i = 1; i < pieces; ++i) {
        const double u = double(i) / pieces;
        double s = last_.s_m + u * step_m;
        if (s < 0.0) s += length;
        if (s > length) s -= length;
        add({s, last_.height_m + u * (place.height_m - last_.height_m),
             last_.cross_slope + u * (place.cross_slope - last_.cross_slope), place.stamp_ns});
      }
    }
  }
  add(place);
  last_ = place;
  has_last_ = true;
}

void HeightProfile::describe(const EgoBuffer& poses, const EgoRange& range, int64_t stamp_ns, RoadData& road) noexcept {
  for (int64_t i = std::max(learned_, poses.oldest_safe(range)); i < range.count; ++i) {
    EgoPose pose;
    if (!poses.read(i, pose)) continue;
    way_.add(pose);
    if (map_) learn(pose);
  }
  learned_ = std::max(learned_, range.count);
  poses.copy_window(without_later_runs(poses, range, stamp_ns), stamp_ns, stamp_ns, window_);
  road.has_pose = window_.at(stamp_ns, road.ego) && road.ego.age_ns <= kEgoFreshNs;
  road.map = nullptr;
  road.way_count = 0;
  if (!road.has_pose) return;
  MapProjection at{};
  if (map_) {
    at = map_->project(road.ego.pose.x_m, road.ego.pose.y_m, describe_hint_);
    describe_hint_ = at.segment;
  }
  if (!map_ || !is_on_road(at)) {
    way_.describe(stamp_ns, road);
    return;
  }
  road.map = map_;
  road.s_m = at.s_m;
  road.d_m = at.d_m;
  road.curvature_per_m = at.curvature_per_m;
  double sine, cosine;
  sin_cos_f64(at.heading_rad, sine, cosine);
  road.faces_along = road.ego.r[0] * cosine + road.ego.r[3] * sine >= 0.0;
  if (!road.ego.pose.has_attitude) {  // nor heights: the road is as the scan shows it
    std::fill_n(road.known, RoadData::kStations, false);
    road.has_expected = false;
    return;
  }
  const Place here = place_of(road.ego, at);
  // The heights of two laps may differ by the drift of the localisation. The ego vehicle's height now, against that of
  // an earlier lap at the same place, corrects the part that was driven in an earlier lap.
  const Reading below = read(at.s_m, stamp_ns);
  const double drift_m = below.earlier > kLeastEarlier ? (here.height_m - below.height_m) / below.earlier : 0.0;
  for (int32_t k = 0; k < RoadData::kStations; ++k) {
    const Reading v = read(at.s_m + (k - kHere) * RoadData::kStation_m, stamp_ns);
    road.known[k] = v.known;
    if (!road.known[k]) continue;
    road.height_m[k] = float(v.height_m + v.earlier * drift_m - road.ego.pose.z_m);
    road.cross_slope[k] = float(v.cross_slope);
  }
  fill_stations(float(here.height_m - road.ego.pose.z_m), float(here.cross_slope), road);
  road.has_expected = map_->has_banking();
  if (road.has_expected)
    expect_stations(road);
  else
    extend_stations(road);
}

// Beyond the known stations: a banked road turns about its inner edge, which goes on as it comes to the vehicle.
void HeightProfile::expect_stations(RoadData& road) const noexcept {
  constexpr int32_t kBack = 4;  // stations over which the grade is measured
  int32_t hint = -1;
  const auto place_at = [&](int32_t k) { return map_->at(road.s_m + (k - kHere) * RoadData::kStation_m, &hint); };
  const auto above_edge = [](const MapPose& at, double cross_slope) {
    return cross_slope > 0.0 ? cross_slope * at.width_left_m : -cross_slope * at.width_right_m;
  };
  const auto edge_at = [&](int32_t k) {
    return double(road.height_m[k]) - above_edge(place_at(k), double(road.cross_slope[k]));
  };
  const int32_t ahead = road.faces_along ? 1 : -1, back = kHere - ahead * kBack;
  const double edge_m = edge_at(kHere), step_m = road.known[back] ? (edge_m - edge_at(back)) / kBack : 0.0;
  for (int32_t k = 0; k < RoadData::kStations; ++k) {
    if (road.known[k]) continue;
    const MapPose at = place_at(k);
    const double cross_slope = at.cross_slope();
    const int32_t steps = ahead * (k - kHere);
    road.height_m[k] = float(edge_m + steps * step_m + above_edge(at, cross_slope));
    road.cross_slope[k] = float(cross_slope);
    road.known[k] = steps > 0 && steps <= kAhead;
  }
}

// The vehicle itself stands on the road. Fills the stations between it and the known ones behind it, which are not old
// enough yet.
void HeightProfile::fill_stations(float height_m, float cross_slope, RoadData& road) noexcept {
  constexpr int32_t kLongestGap = 8;
  if (!road.known[kHere]) {
    road.known[kHere] = true;
    road.height_m[kHere] = height_m;
    road.cross_slope[kHere] = cross_slope;
  }
  for (int32_t k = 1, last = 0; k < RoadData::kStations; ++k) {
    if (!road.known[k]) continue;
    const int32_t gap = k - last;
    for (int32_t i = last + 1; road.known[last] && gap <= kLongestGap && i < k; ++i) {
      const float u = float(i - last) / float(gap);
      road.known[i] = true;
      road.height_m[i] = road.height_m[last] + u * (road.height_m[k] - road.height_m[last]);
      road.cross_slope[i] = road.cross_slope[last] + u * (road.cross_slope[k] - road.cross_slope[last]);
    }
    last = k;
  }
}

// Goes on straight for some stations ahead, because the sensors are ahead of the rear axle.
void HeightProfile::extend_stations(RoadData& road) noexcept {
  const int32_t ahead = road.faces_along ? 1 : -1;
  for (int32_t i = 1; i <= kAhead; ++i) {
    const int32_t k = kHere + ahead * i, last = k - ahead, before = last - ahead;
    if (road.known[k] || !road.known[before]) return;
    road.known[k] = true;
    road.height_m[k] = 2.0f * road.height_m[last] - road.height_m[before];
    road.cross_slope[k] = road.cross_slope[last];
  }
}

}  // namespace overtake
