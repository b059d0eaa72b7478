// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Preset `best`, from a scan to tracks: the paper's chain with another ground removal, and rules that know what a car
// looks like and where the road is. The numbers are the sections of kernels/README.md.
#include "core/math.h"
#include "pipeline/method/frame_rules.h"
#include "pipeline/method/method.h"
#include "pipeline/method/steps.h"
#include "pipeline/track/lane_tracker.h"

namespace overtake {
namespace {

// Run for each scan.
constexpr Step kSegment[] = {
    step::project_points,    step::rank_layers, step::scatter_points,  // 1   range and elevation image
    step::fill_gaps,                                                   // 2   gaps of one pixel
    step::sample_road,                                                 // 5b  where the road should be
    step::running_ground,                                              // 5b  ground: height over the running ground
    step::mark_islands,                                                // 5b  nor is a car of which one row is seen
    step::find_ground_light,                                           // 5c  how bright the road is
    step::drop_smoke,                                                  // 5c  smoke and dust are not obstacles
    step::repair_range,                                                // 6   NGRIR (eq. 3)
    step::link_pixels,                                                 // 7a  which neighbours belong together (eq. 2)
    step::cut_steps,                                                   // 7a  not a car and what stands behind it
    step::label_cut,                                                   // 7b  connected components; two cars are not one
    step::label_points,                                                // 7b
    step::mark_smoke,                                                  //     points of smoke have no label
    step::build_clusters,                                              // 8a  table of clusters in the vehicle frame
    step::split_clusters,                                              // 8a  not two cars, nor a wall and a car
    step::mark_own_body,                                               //     points of the own car have no label
    step::count_reasons,
};
static_assert(is_chain(kSegment, kGivenColumns));

// Run once per frame, after the segmentation of all its scans.
constexpr FrameRule kFrame[] = {
    rule::merge_seams,            // 8b  clusters across the seams of two sensors (eq. 4)
    rule::find_view_gaps,         //     where no row of a sensor has a return
    rule::find_ego_on_map_first,  //     whether this frame may use the map
    rule::locate_clusters,        //     psi_REF and the place on the circuit
    rule::join_shards,            //     clusters of one car
    rule::measure_walls,          //     the ego heading, against the bounds of the circuit
    rule::keep_car_shaped,        // 9   not of the own car, and at most as large as a car
    rule::keep_inside_bounds,     // 9   and with its centre on the circuit
    rule::keep_off_walls,         //     without a map: and not at or behind a wall
    rule::keep_in_range,          //     and near
    rule::keep_solid,             //     and no smoke, road or sign
    rule::keep_nearest,           //     the nearest, up to the capacity
    rule::list_faint,             //     a few points that a known car may show, for the tracker only
    rule::pose_by_view,           // 10  pose and covariance by the side that is seen
};

}  // namespace

constinit const Method kBest = {.name = "best",
                                .segment = kSegment,
                                .frame = kFrame,
                                .make_tracker = make_lane_tracker,  // 11  CVTR on a lane, Munkres, existence score
                                .tracker_params = kLaneTrackerParams,
                                .set_defaults = [](ovt_params& params) noexcept {
                                  params.merge_distance_m = 1.4;                  // two cars side by side are not one
                                  params.tracker_r_x = params.tracker_r_y = 0.3;  // of pushed rows
                                  params.tracker_gate_d2 = 25;                    // a manoeuvre is still the same car
                                  params.tracker_max_silence_s = 12;              // a lost car keeps its id for so long
                                  params.cluster_threshold_rad = 2.8 * kPi / 180;  // two cars are not one
                                  params.repair_range_limit_m = 3;  // nor a car and what stands behind it
                                }};

}  // namespace overtake
