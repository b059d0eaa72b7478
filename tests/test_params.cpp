// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Parameters: the paper's values, the text form with its errors, and consistency.
#include "pipeline/params.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <map>
#include <string>

using namespace overtake;

namespace {

// The paper's table, in the unit of the text form.
const std::map<std::string, double> kPaper = {
    {"smooth.window", 5},        {"ground.threshold_deg", 20.0}, {"cluster.threshold_deg", 2.5},
    {"repair.window", 9},        {"repair.range_limit_m", 5.0},  {"merge.distance_m", 1.80},
    {"tracker.q_x", 0.005},      {"tracker.q_y", 0.005},         {"tracker.q_speed", 0.5},
    {"tracker.q_course", 0.005}, {"tracker.q_yaw_rate", 0.0005}, {"tracker.r_x", 5.0},
    {"tracker.r_y", 5.0},        {"tracker.window", 20},         {"tracker.confirm_hits", 6},
    {"tracker.keep_hits", 5}};

// Further values from the paper's text and from the method.
const std::map<std::string, double> kMethod = {{"frame.period_s", 0.05},
                                               {"frame.tolerance_s", 0.025},
                                               {"frame.scan_limit", 3},
                                               {"segment.parts", 1},
                                               {"gaps.limit_m", 1.0},
                                               {"gaps.limit_share", 0.03},
                                               {"angle.skip_deg", 0.05},
                                               {"smooth.order", 2},
                                               {"label.own_limit_m", 0.5},
                                               {"label.loser_limit_m", 0.5},
                                               {"merge.columns", 1},
                                               {"gate.min_points", 3},
                                               {"gate.slack", 0.1},
                                               {"gate.map_margin_m", 0},
                                               {"gate.ego_margin_m", 2},
                                               {"vehicle.length_m", 4.921},
                                               {"vehicle.width_m", 1.886},
                                               {"pose.margin_m", 0.1},
                                               {"pose.min_var_points", 5},
                                               {"tracker.birth_sigma_speed", 20},
                                               {"tracker.birth_sigma_course_deg", 0.2 * 180.0 / 3.14159265358979323846},
                                               {"tracker.birth_sigma_yaw_rate", 0.1},
                                               {"tracker.birth_speed_share", 0.8},
                                               {"tracker.gate_d2", 9.21},
                                               {"tracker.gate_m", 8},
                                               {"tracker.max_silence_s", 4},
                                               {"tracker.predict_after", 1.5},
                                               {"tracker.horizon_s", 3},
                                               {"tracker.horizon_step_s", 0.1},
                                               {"tracker.work_limit", 1e7},
                                               // of preset best
                                               {"running_ground.height_m", 0.1},
                                               {"running_ground.known_per_m", 0.004},
                                               {"running_ground.known_limit_m", 0.25},
                                               {"running_ground.known_slope", 0.02},
                                               {"running_ground.known_reach_m", 20},
                                               {"running_ground.guess_per_m", 0.008},
                                               {"running_ground.guess_limit_m", 0.25},
                                               {"running_ground.guess_slope", 0.45},
                                               {"running_ground.guess_reach_m", 4},
                                               {"running_ground.level_reach_m", 3},
                                               {"running_ground.free_level_m", 10},
                                               {"running_ground.level_slack", 0.03},
                                               {"running_ground.foot_deg", 45},
                                               {"running_ground.fade_m", 55},
                                               {"running_ground.start_per_m", 0.012},
                                               {"running_ground.start_limit_m", 0.5},
                                               {"smoke.dark_share", 0.1},
                                               {"smoke.near_share", 0.2},
                                               {"smoke.reach_m", 6},
                                               {"cut.threshold_deg", 6},
                                               {"cut.step_m", 2},
                                               {"cut.from", 1.15},
                                               {"cut.to", 2.6},
                                               {"cut.in_line_from", 0.6},
                                               {"cut.in_line_width", 1.1},
                                               {"cut.in_line_step_m", 3},
                                               {"cut.abreast_from", 2},
                                               {"cut.abreast_step_m", 1.2},
                                               {"cut.strip_m", 0.25},
                                               {"cut.wall_m", 0.5},
                                               {"join.gap_m", 2.5},
                                               {"join.slack_m", 0.5},
                                               {"join.bound_m", 1},
                                               {"gate.height_m", 1.6},
                                               {"gate.width_slack_m", 0.3},
                                               {"gate.inside_m", 0.6},
                                               {"gate.range_m", 250},
                                               {"gate.free_range_m", 160},
                                               {"gate.lowest_m", 1},
                                               {"gate.top_m", 2},
                                               {"gate.wall_m", 0.5},
                                               {"gate.own_back_m", 1.5},
                                               {"gate.own_front_m", 4.5},
                                               {"gate.own_side_m", 1.2},
                                               {"pose.front_length_m", 4.2},
                                               {"pose.profile_points", 3},
                                               {"pose.angle_sigma_deg", 0.05},
                                               {"class.debris_m", 1},
                                               {"ego_heading.wall_length_m", 12},
                                               {"ego_heading.wall_reach_m", 100},
                                               {"ego_heading.wall_scatter_m", 0.08},
                                               {"ego_heading.wall_sigma_deg", 0.06},
                                               {"ego_heading.wall_memory_s", 1},
                                               {"ego_heading.constant_sigma_deg", 1},
                                               {"ego_heading.mounting_sigma_deg", 0.2},
                                               {"ego_heading.slip_sigma_deg", 0.1},
                                               {"ego_heading.lever_sigma_m", 0.5},
                                               {"lane_tracker.q_along", 0.02},
                                               {"lane_tracker.q_across", 0.006},
                                               {"lane_tracker.q_speed", 0.5},
                                               {"lane_tracker.q_course", 0.0002},
                                               {"lane_tracker.q_yaw_rate", 0.008},
                                               {"lane_tracker.lane_s", 0.08},
                                               {"lane_tracker.stand_mps", 3},
                                               {"lane_tracker.part_share", 3},
                                               {"lane_tracker.steady_lag", 3},
                                               {"lane_tracker.manoeuvre_gain", 20},
                                               {"lane_tracker.birth_speed_share", 0.6},
                                               {"lane_tracker.birth_sigma_share", 0.4},
                                               {"lane_tracker.birth_sigma_course_deg", 5.7295779513082321},
                                               {"lane_tracker.birth_sigma_yaw_rate", 0.05},
                                               {"lane_tracker.p_detect", 0.5},
                                               {"lane_tracker.half_m", 110},
                                               {"lane_tracker.p_hidden", 0.1},
                                               {"lane_tracker.p_wing", 0.1},
                                               {"lane_tracker.clutter_per_m2", 1e-05},
                                               {"lane_tracker.clutter_reach_m", 10},
                                               {"lane_tracker.clutter_area_m2", 100},
                                               {"lane_tracker.hit_score", 3},
                                               {"lane_tracker.unknown_score", -3},
                                               {"lane_tracker.low_m", 0.3},
                                               {"lane_tracker.low_score", -3},
                                               {"lane_tracker.car_points", 80000},
                                               {"lane_tracker.sparse_score", -3},
                                               {"lane_tracker.thin_score", -1.5},
                                               {"lane_tracker.confirm_score", 4},
                                               {"lane_tracker.confirm_hits", 3},
                                               {"lane_tracker.drop_score", -2},
                                               {"lane_tracker.most_score", 8},
                                               {"lane_tracker.tentative_misses", 8},
                                               {"lane_tracker.coast_s", 4},
                                               {"lane_tracker.coast_sigma_m", 20},
                                               {"lane_tracker.path_turn_s", 0.3},
                                               {"lane_tracker.path_speed", 10},
                                               {"lane_tracker.path_across", 0.4}};

}  // namespace

TEST_CASE("params: preset paper has the values of the paper's table, and no name is left over") {
  const ovt_params params = ovt_default_params();
  std::map<std::string, double> expected = kPaper;
  expected.insert(kMethod.begin(), kMethod.end());
  for (const auto& [key, value] : expected) {
    const std::string& name = key;
    CAPTURE(name);
    double got = -1;
    REQUIRE(ovt_get_param(&params, name.c_str(), &got) == OVT_OK);
    CHECK(got == doctest::Approx(value).epsilon(1e-14));
  }
  REQUIRE(ovt_param_count() == int32_t(expected.size()));
  for (int32_t i = 0; i < ovt_param_count(); ++i) {
    ovt_param_info info;
    REQUIRE(ovt_describe_param(i, &info) == OVT_OK);
    CAPTURE(info.name);
    CHECK(expected.count(info.name) == 1);
    // Configuration files have these keys beside the groups (tools/client/config.h).
    const std::string name = info.name, group = name.substr(0, name.find('.'));
    for (const char* key : {"preset", "rig", "map", "ego", "workers", "isa", "capacities"}) CHECK(group != key);
    CHECK(info.value_default == doctest::Approx(expected[info.name]).epsilon(1e-14));
    CHECK(info.value_min <= info.value_default);
    CHECK(info.value_default <= info.value_max);
    CHECK(std::strlen(info.text) > 0);
  }
  const ovt_sensor_def sensor = ovt_default_sensor_def();
  CHECK(sensor.rows == 32);
  CHECK(sensor.cols == 857);
  CHECK(sensor.azimuth_left_rad - sensor.azimuth_right_rad == doctest::Approx(120 * 3.14159265358979323846 / 180));
}

TEST_CASE("params: fields hold radians, the text form degrees") {
  ovt_params params = ovt_default_params();
  CHECK(params.ground_threshold_rad == doctest::Approx(0.3490658503988659));
  CHECK(params.cluster_threshold_rad == doctest::Approx(0.04363323129985824));
  CHECK(params.tracker_birth_sigma_course_rad == doctest::Approx(0.2).epsilon(1e-14));
  REQUIRE(ovt_set_param(&params, "ground.threshold_deg", "90") == OVT_OK);
  CHECK(params.ground_threshold_rad == doctest::Approx(1.5707963267948966));
  CHECK(find_bad_param(params) == "");  // the limit itself, converted to radians and back
}

TEST_CASE("params: every parameter can be set to both of its limits and read back, and only itself changes") {
  for (int32_t i = 0; i < ovt_param_count(); ++i) {
    ovt_param_info info;
    REQUIRE(ovt_describe_param(i, &info) == OVT_OK);
    CAPTURE(info.name);
    for (const double value : {info.value_min, info.value_max}) {
      ovt_params params = ovt_default_params();
      char text[64];
      std::snprintf(text, sizeof text, "%.17g", value);
      REQUIRE(ovt_set_param(&params, info.name, text) == OVT_OK);
      double got = 0;
      REQUIRE(ovt_get_param(&params, info.name, &got) == OVT_OK);
      CHECK(got == doctest::Approx(value).epsilon(1e-14));
      for (int32_t j = 0; j < ovt_param_count(); ++j) {
        ovt_param_info other;
        REQUIRE(ovt_describe_param(j, &other) == OVT_OK);
        double kept = 0;
        REQUIRE(ovt_get_param(&params, other.name, &kept) == OVT_OK);
        if (j != i) CHECK(kept == doctest::Approx(other.value_default).epsilon(1e-14));
      }
    }
  }
}

TEST_CASE("params: ovt_set_param refuses invalid values and changes nothing") {
  struct Row {
    const char *name, *value;
    ovt_status status;
  };
  const Row rows[] = {
      {"tracker.confirm_hit", "3", OVT_UNKNOWN_NAME},
      {"confirm_hits", "3", OVT_UNKNOWN_NAME},
      {"", "3", OVT_UNKNOWN_NAME},
      {"Tracker.confirm_hits", "3", OVT_UNKNOWN_NAME},
      {"tracker.confirm_hits", "", OVT_BAD_ARGUMENT},
      {"tracker.confirm_hits", "three", OVT_BAD_ARGUMENT},
      {"tracker.confirm_hits", "3 ", OVT_BAD_ARGUMENT},
      {"tracker.confirm_hits", " 3", OVT_BAD_ARGUMENT},
      {"tracker.confirm_hits", "3x", OVT_BAD_ARGUMENT},
      {"tracker.confirm_hits", "0x3", OVT_BAD_ARGUMENT},
      {"tracker.confirm_hits", "3,0", OVT_BAD_ARGUMENT},
      {"tracker.confirm_hits", "3.5", OVT_BAD_ARGUMENT},
      {"tracker.confirm_hits", "0", OVT_OUT_OF_RANGE},
      {"tracker.confirm_hits", "65", OVT_OUT_OF_RANGE},
      {"tracker.confirm_hits", "-3", OVT_OUT_OF_RANGE},
      {"tracker.confirm_hits", "1e300", OVT_OUT_OF_RANGE},
      {"tracker.gate_m", "nan", OVT_OUT_OF_RANGE},
      {"tracker.gate_m", "inf", OVT_OUT_OF_RANGE},
      {"tracker.gate_m", "-inf", OVT_OUT_OF_RANGE},
      {"tracker.gate_m", "1e400", OVT_OUT_OF_RANGE},
      {"tracker.gate_m", "-1e400", OVT_OUT_OF_RANGE},
      {"tracker.r_x", "1e-400", OVT_OUT_OF_RANGE},
      {"tracker.gate_m", "-0.001", OVT_OUT_OF_RANGE},
      {"ground.threshold_deg", "90.001", OVT_OUT_OF_RANGE},
  };
  const ovt_params before = ovt_default_params();
  for (const Row& row : rows) {
    CAPTURE(row.name);
    CAPTURE(row.value);
    ovt_params params = before;
    CHECK(ovt_set_param(&params, row.name, row.value) == row.status);
    CHECK(std::memcmp(&params, &before, sizeof params) == 0);
  }
  ovt_params params = before;
  double value = 0;
  CHECK(ovt_set_param(nullptr, "tracker.gate_m", "1") == OVT_BAD_ARGUMENT);
  CHECK(ovt_set_param(&params, nullptr, "1") == OVT_BAD_ARGUMENT);
  CHECK(ovt_set_param(&params, "tracker.gate_m", nullptr) == OVT_BAD_ARGUMENT);
  CHECK(ovt_get_param(&params, "tracker.gate", &value) == OVT_UNKNOWN_NAME);
  CHECK(ovt_get_param(&params, "tracker.gate_m", nullptr) == OVT_BAD_ARGUMENT);
  CHECK(ovt_get_param(nullptr, "tracker.gate_m", &value) == OVT_BAD_ARGUMENT);
  params.struct_size = offsetof(ovt_params, tracker_horizon_step_s);  // the first version's struct had more fields
  CHECK(ovt_set_param(&params, "tracker.gate_m", "1") == OVT_BAD_VERSION);
  CHECK(ovt_get_param(&params, "tracker.gate_m", &value) == OVT_BAD_VERSION);
  ovt_param_info info;
  CHECK(ovt_describe_param(-1, &info) == OVT_BAD_ARGUMENT);
  CHECK(ovt_describe_param(ovt_param_count(), &info) == OVT_BAD_ARGUMENT);
  CHECK(ovt_describe_param(0, nullptr) == OVT_BAD_ARGUMENT);
}

TEST_CASE("params: a number too small for a double is 0, or subnormal") {
  ovt_params params = ovt_default_params();
  for (const char* number : {"1e-400", "0.01e-330", "0"}) {
    params.gate_slack = 1;
    CHECK(ovt_set_param(&params, "gate.slack", number) == OVT_OK);
    CHECK(params.gate_slack == 0);
  }
  CHECK(ovt_set_param(&params, "gate.slack", "1e-310") == OVT_OK);
  CHECK(params.gate_slack == 1e-310);
}

TEST_CASE("params: an unknown preset and a struct of an unknown size are refused") {
  ovt_params params;
  CHECK(ovt_params_init(&params, sizeof params, "paper") == OVT_OK);
  CHECK(ovt_params_init(&params, sizeof params, "worst") == OVT_UNKNOWN_NAME);
  CHECK(ovt_params_init(&params, sizeof params, "") == OVT_UNKNOWN_NAME);
  CHECK(ovt_params_init(&params, sizeof params, nullptr) == OVT_BAD_ARGUMENT);
  CHECK(ovt_params_init(nullptr, sizeof params, "paper") == OVT_BAD_ARGUMENT);
  CHECK(ovt_params_init(&params, sizeof params - 1, "paper") == OVT_BAD_VERSION);
  // The first version's struct ends before the preset's name.
  constexpr size_t kFirst = offsetof(ovt_params, tracker_horizon_step_s) + sizeof(double);
  static_assert(kFirst <= offsetof(ovt_params, method));
  CHECK(ovt_params_init(&params, kFirst, "paper") == OVT_OK);
  CHECK(ovt_params_init(&params, kFirst, "best") == OVT_BAD_VERSION);
}

TEST_CASE("params: find_bad_param names the wrong parameter") {
  struct Row {
    void (*spoil)(ovt_params&);
    const char* sentence;
  };
  const Row rows[] = {
      {[](ovt_params&) {}, ""},
      {[](ovt_params& p) { p.tracker_gate_m = std::nan(""); }, "tracker.gate_m is nan, outside of 0 to 1e+06"},
      {[](ovt_params& p) { p.tracker_r_x = 0; }, "tracker.r_x is 0, outside of 1e-06 to 1e+06"},
      {[](ovt_params& p) { p.frame_period_s = -1; }, "frame.period_s is -1, outside of 0.001 to 10"},
      {[](ovt_params& p) { p.smooth_window = 4; }, "smooth.window is 4 and must be odd"},
      {[](ovt_params& p) { p.smooth_order = 5; }, "smooth.order is 5 and must be below smooth.window (5)"},
      {[](ovt_params& p) { p.repair_window = 8; }, "repair.window is 8 and must be odd"},
      {[](ovt_params& p) { p.cut_to = 1; }, "cut.from is 1.15 and must not exceed cut.to (1)"},
      {[](ovt_params& p) { p.cut_from = p.cut_to = 0; }, ""},  // nothing is cut
      {[](ovt_params& p) { p.gate_lowest_m = 2.5; }, "gate.lowest_m is 2.5 and must not exceed gate.top_m (2)"},
      {[](ovt_params& p) { p.gate_lowest_m = p.gate_top_m; }, ""},
      {[](ovt_params& p) { p.tracker_confirm_hits = 21; },
       "tracker.confirm_hits is 21 and must not exceed tracker.window (20)"},
      {[](ovt_params& p) { p.tracker_keep_hits = 21; },
       "tracker.keep_hits is 21 and must not exceed tracker.window (20)"},
      {[](ovt_params& p) { p.tracker_horizon_step_s = 0.001; },
       "tracker.horizon_step_s is 0.001 and must be a thousandth of tracker.horizon_s at least (3)"},
  };
  for (const Row& row : rows) {
    ovt_params params = ovt_default_params();
    row.spoil(params);
    CHECK(find_bad_param(params) == row.sentence);
  }
}

TEST_CASE("params: the stages receive half windows, tangents and the gate's length") {
  const ovt_params params = ovt_default_params();
  const SensorModel sensor = make_sensor_model(32, 857, 1.0471975511965977, -1.0471975511965977, false, 0.5, 300);
  const SegmentParams segment = make_segment_params(params, sensor);
  CHECK(segment.repair_range.half_window == 4);
  CHECK(double(segment.link_pixels.tan_threshold) == doctest::Approx(std::tan(2.5 * 3.14159265358979323846 / 180)));
  CHECK(double(make_detect_params(params).gate_clusters.max_extent_m) == doctest::Approx(4.921 * 1.1));
}

TEST_CASE("params: the tracker of best starts with the defaults of its own parameters") {
  ovt_params best;
  REQUIRE(ovt_params_init(&best, sizeof best, "best") == OVT_OK);
  const TrackerParams params = make_tracker_params(best, 8, 8);
  const LaneTrackerParams own;
  static_assert(sizeof own == 39 * sizeof(double));  // no padding
  CHECK(std::memcmp(&params.lane, &own, sizeof own) == 0);
  CHECK(params.gate_d2 == 25);
  CHECK(params.max_silence_s == 12);
}
