// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A method for tests, `plain`: what is less than 30 cm above the road is ground, by one look at each pixel; no angles,
// no smoothing, no repair, no map gate, a tracker of its own. It shows that a method needs nothing outside its own file
// but its line in tests/CMakeLists.txt, and that what is promised of detectors hangs on no method.
#include "core/math.h"
#include "pipeline/method/frame_rules.h"
#include "pipeline/method/methods.h"
#include "pipeline/method/steps.h"
#include "tests/support/plain_tracker.h"

namespace overtake {
namespace {

constexpr float kRoad_m = 0.3f;

// Keeps the pixels that are higher than kRoad_m in the vehicle frame.
//   reads    range_filled_m elevation_filled_rad     writes  all others, every pixel
void keep_above_road(float sensor_height_m, Plane<const float> range_filled_m, Plane<const float> elevation_filled_rad,
                     Plane<float> range_m, Plane<float> elevation_rad, BitPlane nonground) noexcept {
  for (int32_t r = 0; r < range_m.rows; ++r) {
    nonground.clear_row(r);
    for (int32_t c = 0; c < range_m.cols; ++c) {
      const float range = range_filled_m.row(r)[c];
      float sine, cosine;
      sin_cos_f32(elevation_filled_rad.row(r)[c], sine, cosine);
      const bool keep = range > 0.0f && sensor_height_m + range * sine > kRoad_m;
      range_m.row(r)[c] = keep ? range : 0.0f;
      elevation_rad.row(r)[c] = keep ? elevation_filled_rad.row(r)[c] : 0.0f;
      if (keep) nonground.set(r, c);
    }
  }
}

using enum Column;
void run_above_road(const KernelTable&, Segment& s) noexcept {
  const RangeImages& m = s.part.images;
  keep_above_road(s.sensor.T_vehicle_sensor.t[2], m.range_filled_m, m.elevation_filled_rad, m.range_repaired_m,
                  m.elevation_repaired_rad, m.nonground_repaired);
}
constexpr Step kAboveRoad = {.name = "keep_above_road",
                             .stage = OVT_STAGE_GROUND,
                             .reads = columns(range_filled_m, elevation_filled_rad),
                             .writes = columns(range_repaired_m, elevation_repaired_rad, nonground_repaired),
                             .scratch = columns(),
                             .params = "",
                             .run = &run_above_road};

constexpr Step kSegment[] = {
    // Range and elevation image.
    step::project_points,
    step::rank_layers,
    step::scatter_points,
    step::fill_gaps,
    // In place of angle, smoothing, ground and repair.
    step::keep_above_road,
    // Clusters.
    step::link_pixels,
    step::label_bfs,
    step::label_points,
    step::build_clusters,
    step::count_reasons,
};
static_assert(is_chain(kSegment, kGivenColumns));

constexpr FrameRule kFrame[] = {rule::merge_seams, rule::find_ego_on_map, rule::keep_car_sized, rule::keep_nearest,
                                rule::pose_by_two_headings};

constinit const Method kPlain = {
    .name = "plain",
    .segment = kSegment,
    .frame = kFrame,
    .make_tracker = [](const TrackerParams& params, const TrackMap* map,
                       const Allocator& allocator) -> std::unique_ptr<FrameTracker> {
      return std::make_unique<ReplayTracker<test::PlainPolicy>>(params, map, allocator);
    },
    .tracker_params = "tracker",
    .set_defaults = [](ovt_params& params) noexcept { params.cluster_threshold_rad = 0.1; },
};
[[maybe_unused]] const bool added = add_method(kPlain);

}  // namespace
}  // namespace overtake
