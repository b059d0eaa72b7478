// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One pixel of running_ground, for one column or for a vector of columns: the reference and the vector form share it.
#pragma once

#include "core/math.h"
#include "kernels/running_ground.h"

namespace overtake {

// Constants of the walks.
struct GroundBlock {
  struct Tolerance {
    float per_m, limit_m, slope_limit, per_reach;
  };
  float height_m;
  Tolerance known, guess;
  float start_per_m, start_limit_m, level_reach_m, free_level_m, foot_slope, echo_limit_m;
};

OVT_INLINE GroundBlock make_ground_block(const RunningGroundParams& params) {
  const auto tolerance = [](const GroundTolerance& t) {
    return GroundBlock::Tolerance{t.per_m, t.limit_m, t.slope_limit, 1.0f / t.slope_reach_m};
  };
  return {params.height_m,     tolerance(params.known), tolerance(params.guess),
          params.start_per_m,  params.start_limit_m,    params.level_reach_m,
          params.free_level_m, params.foot_slope,       params.echo_limit_m};
}

// The running ground of a column. Distances from the sensor; `height` over the road surface, `z` in the sensor's axes.
template <class V>
struct GroundState {
  V distance, height, z;                   // the last ground pixel that moved it
  V slope;                                 // against the road surface
  V first_distance;                        // the first ground pixel that moved it
  V from_distance, from_height;            // where the slope is measured from
  V below_distance, below_z, below_above;  // the pixel below; its height over the running ground, kMissing_m: none
};

template <class M>
OVT_INLINE bool any_of(M mask) {
  if constexpr (requires { mask.any(); }) {
    return mask.any();
  } else {
    return true;
  }
}

constexpr float kMissing_m = -1e9f;  // is no foot

template <class V>
OVT_INLINE GroundState<V> start_ground(V road_z) {
  constexpr float kNowhere_m = 1e9f;  // the first ground pixel is not ahead of it, so it does not measure a slope
  const V zero(0.0f);
  return {zero, zero, road_z, zero, V(kNowhere_m), V(kNowhere_m), zero, zero, road_z, V(kMissing_m)};
}

template <class V, class M>
struct GroundPixel {
  V height;         // 0 without a return
  M ground, steep;  // steep: this pixel and the one below it, which is above the road, are a steep pair
};

// The road surface at a pixel's distance, and where its tangent meets the sensor's axis: minus the height of the sensor
// over that tangent.
template <class V>
struct RoadPlace {
  V z, offset;
};

// `exists`: the pixel has a range. `level`: the largest slope of level ground. `known_m`: how far the road is known,
// below 0 without a map.
template <class V, class M>
OVT_INLINE GroundPixel<V, M> walk_ground(const GroundBlock& block, V distance, V z, RoadPlace<V> road, V level,
                                         V known_m, M exists, GroundState<V>& s) {
  constexpr float kLeastReach_m = 0.5f;                               // of the slope
  constexpr float kSteepest = 0.45f, kFall = -0.2f, kDrop_m = -0.2f;  // of what moves the ground,
  constexpr float kKnownFall = -0.01f, kKnownDrop_m = -0.3f;          // where the road is known,
  constexpr float kFarFall = -0.04f, kFarDrop_m = -1.0f;              // and over a long run where it is not
  constexpr float kAny_m = 3e38f;
  constexpr float kShort_m = 2.0f, kShortOfRun = 0.25f;  // measured over less, the slope says nothing about the run
  constexpr float kLeastOver_m = 0.6f;  // a crest between two pieces of the surface is not one of the road
  constexpr float kFoot_m = -0.5f;      // lower pixels are road; a wall may stand a little below it
  const V zero(0.0f);
  const V height = z - road.z, ahead = distance - s.distance, run = max_of(ahead, zero), rise = height - s.height;
  const V above = rise - s.slope * run;
  const M no_slope = s.distance <= s.first_distance + max_of(V(kShort_m), V(kShortOfRun) * run);
  const M known = distance < known_m;
  const auto tolerance = [&](float GroundBlock::Tolerance::*value) {
    return select(known, V(block.known.*value), V(block.guess.*value));
  };
  const V per_m = select(no_slope, V(block.start_per_m), tolerance(&GroundBlock::Tolerance::per_m));
  const V limit_m = select(no_slope, V(block.start_limit_m), tolerance(&GroundBlock::Tolerance::limit_m));
  const V slope_limit = tolerance(&GroundBlock::Tolerance::slope_limit);
  const V per_reach = tolerance(&GroundBlock::Tolerance::per_reach);
  const V allowed = min_of(V(block.height_m) + per_m * run, limit_m);
  const V level_reach = select(known_m < zero, V(block.free_level_m), V(block.level_reach_m));
  const M is_level = (run <= level_reach) & (z - s.z <= level * run + V(block.height_m));
  // An echo gets longer and weaker with range / sin(angle to the surface) = distance^2 / height of the sensor over the
  // tangent: from some length on the road has no returns, and what returns is something else.
  const V over_tangent = max_of(max_of(s.slope * s.distance - s.height, zero) - road.offset, V(kLeastOver_m));
  const M visible = distance * distance <= V(block.echo_limit_m) * over_tangent;
  const M ground = exists & (above <= select(is_level, V(kAny_m), allowed)) & visible;
  const V step_z = z - s.below_z;
  const M steep =
      exists & (s.below_above > V(kFoot_m)) & (step_z > V(block.foot_slope) * abs_of(distance - s.below_distance));

  // What returns from deeper below is a hole, or a ghost: a mirror on a wet road, or the sun.
  const V lowest = select(known, V(kKnownFall) * run + V(kKnownDrop_m),
                          max_of(V(kFall) * run + V(kDrop_m), V(kFarFall) * run + V(kFarDrop_m)));
  const M moves = ground & (ahead > zero) & (rise <= V(kSteepest) * run) & (rise > lowest);
  s.below_distance = distance;
  s.below_z = z;
  s.below_above = select(exists, above, V(kMissing_m));
  const V shown = select(exists, above, zero);
  if (!any_of(moves)) return {shown, ground, steep};
  const V reach = distance - s.from_distance;
  // The road under the sensor is only known by the sensor's mounting: the first ground pixel does not measure a slope.
  const M first = moves & (s.distance <= zero);
  const V weight = max_of(min_of(reach * per_reach, V(1.0f)), zero);
  const V seen = (height - s.from_height) / max_of(reach, V(kLeastReach_m));
  const V turned = s.slope + weight * (seen - s.slope);
  const V limited = max_of(min_of(turned, slope_limit), zero - slope_limit);
  const M renews = moves & (reach * per_reach >= V(1.0f));
  s.slope = select(moves, limited, s.slope);
  s.first_distance = select(first, distance, s.first_distance);
  s.from_distance = select(first, distance, select(renews, s.distance, s.from_distance));
  s.from_height = select(first, height, select(renews, s.height, s.from_height));
  s.distance = select(moves, distance, s.distance);
  s.height = select(moves, height, s.height);
  s.z = select(moves, z, s.z);
  return {shown, ground, steep};
}

}  // namespace overtake
