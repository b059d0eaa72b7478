// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A method for tests, `plain`: every pixel less than 30 cm above the road is ground; no angles, no smoothing, no
// repair, no map gate, the ego heading by walls, and another tracker. It shows that a method needs only its own files
// and one line in tests/CMakeLists.txt, and that the guarantees of a detector do not depend on the method.
#include "pipeline/method/frame_rules.h"
#include "pipeline/method/methods.h"
#include "pipeline/method/steps.h"
#include "tests/support/plain_tracker.h"

namespace overtake {
namespace {

constexpr Step kSegment[] = {
    // Range and elevation image.
    step::project_points,
    step::rank_layers,
    step::scatter_points,
    step::fill_gaps,
    // Replaces angle, smoothing, ground and repair.
    step::keep_above_road,
    // Clusters.
    step::link_pixels,
    step::label_bfs,
    step::label_points,
    step::build_clusters,
    step::count_reasons,
};
static_assert(is_chain(kSegment, kGivenColumns));

constexpr FrameRule kFrame[] = {rule::merge_seams,    rule::find_ego_on_map, rule::measure_walls,
                                rule::keep_car_sized, rule::keep_nearest,    rule::pose_by_two_headings};

constinit const Method kPlain = {
    .name = "plain",
    .segment = kSegment,
    .frame = kFrame,
    .make_tracker = [](const TrackerParams& params, const CircuitMap* map,
                       const Allocator& allocator) -> std::unique_ptr<FrameTracker> {
      return std::make_unique<ReplayTracker<test::PlainPolicy>>(params, map, allocator);
    },
    .tracker_params = "tracker",
    .set_defaults = [](ovt_params& params) noexcept { params.cluster_threshold_rad = 0.1; },
};
[[maybe_unused]] const bool added = add_method(kPlain);

}  // namespace
}  // namespace overtake
