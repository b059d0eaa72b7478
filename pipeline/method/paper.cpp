// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The method of the paper, from a scan to tracks. kernels/README.md says which equation each kernel is.
#include "pipeline/method/frame_rules.h"
#include "pipeline/method/method.h"
#include "pipeline/method/steps.h"
#include "pipeline/track/cvtr_tracker.h"

namespace overtake {
namespace {

// Run for each scan.
constexpr Step kSegment[] = {
    step::project_points, step::rank_layers,   step::scatter_points,  // 1   range and elevation image
    step::fill_gaps,                                                  // 2   gaps of one pixel
    step::angle_image,                                                // 3   slope between two rows (eq. 1)
    step::smooth_sg,                                                  // 4   Savitzky-Golay
    step::mark_ground,                                                // 5   ground: slopes up to ground.threshold_deg
    step::repair_range,                                               // 6   NGRIR (eq. 3)
    step::link_pixels,                                                // 7a  which neighbours belong together (eq. 2)
    step::label_bfs,      step::label_points,                         // 7b  connected components
    step::build_clusters, step::count_reasons,                        // 8a  table of clusters in the vehicle frame
};
static_assert(is_chain(kSegment, kGivenColumns));

// Run once per frame, after the segmentation of all its scans.
constexpr FrameRule kFrame[] = {
    rule::merge_seams,           // 8b  clusters across the seams of two sensors (eq. 4)
    rule::find_ego_on_map,       //     whether this frame may use the map
    rule::keep_car_sized,        // 9   at most as long as a car
    rule::keep_on_circuit,       // 9   and on the circuit
    rule::keep_nearest,          //     the nearest, up to the capacity
    rule::pose_by_two_headings,  // 10  the rectangle that holds the most points (eq. 5)
};

}  // namespace

constinit const Method kPaper = {.name = "paper",
                                 .segment = kSegment,
                                 .frame = kFrame,
                                 .make_tracker = make_cvtr_tracker,  // 11  CVTR, Munkres, M of N (eqs. 6 and 7)
                                 .tracker_params = "tracker",
                                 .set_defaults = nullptr};

}  // namespace overtake
