// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/params.h"
#include <locale.h>
#include <stdlib.h>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstring>

#include "core/float_mode.h"
#include "core/math.h"
#include "pipeline/abi.h"
#include "pipeline/clock_watch.h"
#include "pipeline/method/methods.h"
#include "pipeline/param_defaults.h"

namespace overtake {
namespace {

struct ParamRow {
  std::size_t offset;
  bool is_integer, in_degrees;
  ovt_param_info info;
};

constexpr ParamRow kParams[] = {
#define OVT_REAL(field, name, unit, value, low, high, text) \
  {offsetof(ovt_params, field), false, ends_in_deg(name), {name, unit, text, 0, value, low, high}},
#define OVT_INTEGER(field, name, unit, value, low, high, text) \
  {offsetof(ovt_params, field), true, false, {name, unit, text, 1, value, low, high}},
#include "pipeline/params.def"
#undef OVT_REAL
#undef OVT_INTEGER
};
constexpr int32_t kParamCount = int32_t(sizeof kParams / sizeof kParams[0]);

double read(const ovt_params& params, const ParamRow& row) noexcept {
  const char* at = reinterpret_cast<const char*>(&params) + row.offset;
  if (row.is_integer) {
    int32_t value;
    std::memcpy(&value, at, sizeof value);
    return double(value);
  }
  double value;
  std::memcpy(&value, at, sizeof value);
  return row.in_degrees ? value / kDegree_rad : value;
}

// A number that std::from_chars reads but cannot represent: infinite, or 0 or subnormal. strtod alone would depend on
// the host's locale.
double read_extreme(const char* number) noexcept {
  static const locale_t c_locale = newlocale(LC_ALL_MASK, "C", nullptr);
  return strtod_l(number, nullptr, c_locale);
}

void write(ovt_params& params, const ParamRow& row, double value) noexcept {
  char* at = reinterpret_cast<char*>(&params) + row.offset;
  if (row.is_integer) {
    const auto integer = int32_t(value);
    std::memcpy(at, &integer, sizeof integer);
  } else {
    const double stored = row.in_degrees ? value * kDegree_rad : value;
    std::memcpy(at, &stored, sizeof stored);
  }
}

const ParamRow* find(const char* name) noexcept {
  for (const ParamRow& row : kParams)
    if (std::strcmp(row.info.name, name) == 0) return &row;
  return nullptr;
}

// Limits in degrees have a rounding error after the conversion from radians: allow for it.
bool within(const ParamRow& row, double value) noexcept {
  const double slack = row.in_degrees ? 1e-9 : 0.0;
  return value >= row.info.value_min - slack && value <= row.info.value_max + slack;
}

// Whether a struct of that size contains the field: the struct of an older caller may end before it.
bool is_within(const ParamRow& row, std::size_t struct_size) noexcept {
  return row.offset + (row.is_integer ? sizeof(int32_t) : sizeof(double)) <= struct_size;
}

OwnBodyParams own_body_of(const ovt_params& params) noexcept {
  return {float(params.gate_own_back_m), float(params.gate_own_front_m), float(params.gate_own_side_m)};
}

}  // namespace

std::string find_bad_param(const ovt_params& params) {
  const auto text = [](double value) {
    char digits[32];
    return std::string(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
  };
  for (const ParamRow& row : kParams) {
    const double value = read(params, row);
    if (!within(row, value))
      return std::string(row.info.name) + " is " + text(value) + ", outside of " + text(row.info.value_min) + " to " +
             text(row.info.value_max);
  }
  const auto must = [&](const char* name, double value, const char* rule, double limit) {
    return std::string(name) + " is " + text(value) + " and must " + rule + " (" + text(limit) + ")";
  };
  if (params.smooth_window % 2 == 0) return "smooth.window is " + text(params.smooth_window) + " and must be odd";
  if (params.smooth_order >= params.smooth_window)
    return must("smooth.order", params.smooth_order, "be below smooth.window", params.smooth_window);
  if (params.repair_window % 2 == 0) return "repair.window is " + text(params.repair_window) + " and must be odd";
  if (params.cut_from > params.cut_to) return must("cut.from", params.cut_from, "not exceed cut.to", params.cut_to);
  if (params.gate_lowest_m > params.gate_top_m)
    return must("gate.lowest_m", params.gate_lowest_m, "not exceed gate.top_m", params.gate_top_m);
  if (params.tracker_confirm_hits > params.tracker_window)
    return must("tracker.confirm_hits", params.tracker_confirm_hits, "not exceed tracker.window",
                params.tracker_window);
  if (params.tracker_keep_hits > params.tracker_window)
    return must("tracker.keep_hits", params.tracker_keep_hits, "not exceed tracker.window", params.tracker_window);
  if (params.tracker_horizon_s / params.tracker_horizon_step_s > 1000.0)
    return must("tracker.horizon_step_s", params.tracker_horizon_step_s,
                "be a thousandth of tracker.horizon_s at least", params.tracker_horizon_s);
  return "";
}

SegmentParams make_segment_params(const ovt_params& params, const SensorModel& sensor) noexcept {
  SegmentParams out;
  double sine, cosine;
  out.fill_gaps = {float(params.gaps_limit_m), float(params.gaps_limit_share)};
  out.angle_image = {float(params.angle_skip_rad)};
  make_smooth_sg(params.smooth_window, params.smooth_order, &out.smooth_sg);
  out.mark_ground = {float(params.ground_threshold_rad)};
  sin_cos_f64(params.running_ground_foot_rad, sine, cosine);
  out.running_ground = {.height_m = float(params.running_ground_height_m),
                        .known = {float(params.running_ground_known_per_m), float(params.running_ground_known_limit_m),
                                  float(params.running_ground_known_slope), float(params.running_ground_known_reach_m)},
                        .guess = {float(params.running_ground_guess_per_m), float(params.running_ground_guess_limit_m),
                                  float(params.running_ground_guess_slope), float(params.running_ground_guess_reach_m)},
                        .start_per_m = float(params.running_ground_start_per_m),
                        .start_limit_m = float(params.running_ground_start_limit_m),
                        .level_reach_m = float(params.running_ground_level_reach_m),
                        .free_level_m = float(params.running_ground_free_level_m),
                        .level_slope_slack = float(params.running_ground_level_slack),
                        .echo_limit_m = float(params.running_ground_fade_m * params.running_ground_fade_m),
                        .foot_slope = float(sine / cosine)};
  out.drop_smoke = {float(params.smoke_dark_share), float(params.smoke_near_share), float(params.smoke_reach_m)};
  out.repair_range = {(params.repair_window - 1) / 2, float(params.repair_range_limit_m), sensor.wraps};
  sin_cos_f64(params.cluster_threshold_rad, sine, cosine);
  out.link_pixels = {float(sine / cosine), sensor.sin_pitch, sensor.cos_pitch, sensor.wraps};
  sin_cos_f64(params.cut_threshold_rad, sine, cosine);
  out.cut_links = {float(sine / cosine),
                   sensor.sin_pitch,
                   sensor.cos_pitch,
                   float(params.cut_step_m),
                   float(params.vehicle_length_m * params.cut_from),
                   float(params.vehicle_length_m * params.cut_to),
                   float(params.vehicle_length_m * params.cut_in_line_from),
                   float(params.vehicle_width_m * params.cut_in_line_width),
                   float(params.cut_in_line_step_m),
                   float(params.vehicle_width_m * params.cut_abreast_from),
                   float(params.cut_abreast_step_m)};
  out.label_points = {float(params.label_own_limit_m), float(params.label_loser_limit_m)};
  out.split_abreast = {float(params.cut_strip_m), float(params.vehicle_length_m), float(params.vehicle_width_m),
                       sensor.pitch_rad};
  out.split_walls = {float(params.cut_wall_m), float(params.vehicle_length_m), float(params.vehicle_width_m),
                     float(params.gate_top_m)};
  out.own_body = own_body_of(params);
  return out;
}

DetectParams make_detect_params(const ovt_params& params) noexcept {
  DetectParams out;
  out.merge_seams = {float(params.merge_distance_m), params.merge_columns};
  out.gate_clusters = {params.gate_min_points, float(params.vehicle_length_m * (1.0 + params.gate_slack))};
  out.fit_rectangle = {float(params.vehicle_length_m), float(params.vehicle_width_m), float(params.pose_margin_m),
                       params.pose_min_var_points};
  out.map_margin_m = params.gate_map_margin_m;
  out.vehicle_width_m = params.vehicle_width_m;
  out.ego_margin_m = std::max(params.gate_ego_margin_m, params.gate_map_margin_m);
  const float height_m = float(params.gate_height_m);
  out.join_shards = {float(params.join_gap_m),
                     float(params.join_bound_m),
                     {float(params.vehicle_length_m + params.join_slack_m),
                      float(params.vehicle_width_m + params.join_slack_m), height_m}};
  out.gate_cars = {{float(params.vehicle_length_m * (1.0 + params.gate_slack)),
                    float(params.vehicle_width_m * (1.0 + params.gate_slack) + params.gate_width_slack_m), height_m},
                   own_body_of(params),
                   float(params.gate_inside_m),
                   float(params.gate_range_m),
                   float(std::min(params.gate_range_m, params.gate_free_range_m)),
                   float(params.gate_lowest_m),
                   float(params.gate_top_m),
                   float(params.gate_wall_m)};
  out.pose_by_view = {float(params.pose_front_length_m), float(params.pose_profile_points), params.pose_angle_sigma_rad,
                      float(params.class_debris_m)};
  out.walls = {float(params.ego_heading_wall_length_m), params.ego_heading_wall_reach_m,
               params.ego_heading_wall_scatter_m};
  out.ego_heading = {params.ego_heading_slip_sigma_rad,     params.ego_heading_lever_sigma_m,
                     params.ego_heading_constant_sigma_rad, params.ego_heading_mounting_sigma_rad,
                     params.ego_heading_wall_sigma_rad,     params.ego_heading_wall_memory_s};
  return out;
}

TrackerParams make_tracker_params(const ovt_params& params, int32_t track_capacity,
                                  int32_t detection_capacity) noexcept {
  TrackerParams out;
  const double q[5] = {params.tracker_q_x, params.tracker_q_y, params.tracker_q_speed, params.tracker_q_course,
                       params.tracker_q_yaw_rate};
  std::memcpy(out.q_diag, q, sizeof q);
  out.r_diag[0] = params.tracker_r_x;
  out.r_diag[1] = params.tracker_r_y;
  out.birth_sigma_v = params.tracker_birth_sigma_speed;
  out.birth_sigma_phi = params.tracker_birth_sigma_course_rad;
  out.birth_sigma_omega = params.tracker_birth_sigma_yaw_rate;
  out.birth_speed_share = params.tracker_birth_speed_share;
  // Pushed detections may be ahead of the scans by this much, and a scan that is late by 0.5 s is used all the same.
  out.lead_s = params.frame_tolerance_s + params.frame_period_s;
  out.history_s = double(kLateNs) * 1e-9 + out.lead_s;
  out.gate_d2 = params.tracker_gate_d2;
  out.gate_m = params.tracker_gate_m;
  out.window = params.tracker_window;
  out.confirm_hits = params.tracker_confirm_hits;
  out.keep_hits = params.tracker_keep_hits;
  out.max_silence_s = params.tracker_max_silence_s;
  out.horizon_s = params.tracker_horizon_s;
  out.horizon_step_s = params.tracker_horizon_step_s;
  out.work_limit = params.tracker_work_limit;
  LaneTrackerParams& lane = out.lane;
  lane.q_along = params.lane_tracker_q_along;
  lane.q_across = params.lane_tracker_q_across;
  lane.q_speed = params.lane_tracker_q_speed;
  lane.q_course = params.lane_tracker_q_course;
  lane.q_yaw_rate = params.lane_tracker_q_yaw_rate;
  lane.lane_s = params.lane_tracker_lane_s;
  lane.stand_mps = params.lane_tracker_stand_mps;
  lane.part_share = params.lane_tracker_part_share;
  lane.steady_lag = params.lane_tracker_steady_lag;
  lane.manoeuvre_gain = params.lane_tracker_manoeuvre_gain;
  lane.birth_speed_share = params.lane_tracker_birth_speed_share;
  lane.birth_sigma_share = params.lane_tracker_birth_sigma_share;
  lane.birth_sigma_course = params.lane_tracker_birth_sigma_course_rad;
  lane.birth_sigma_yaw_rate = params.lane_tracker_birth_sigma_yaw_rate;
  lane.p_detect = params.lane_tracker_p_detect;
  lane.half_m = params.lane_tracker_half_m;
  lane.p_hidden = params.lane_tracker_p_hidden;
  lane.p_wing = params.lane_tracker_p_wing;
  lane.clutter_per_m2 = params.lane_tracker_clutter_per_m2;
  lane.clutter_reach_m = params.lane_tracker_clutter_reach_m;
  lane.clutter_area_m2 = params.lane_tracker_clutter_area_m2;
  lane.hit_score = params.lane_tracker_hit_score;
  lane.unknown_score = params.lane_tracker_unknown_score;
  lane.low_m = params.lane_tracker_low_m;
  lane.low_score = params.lane_tracker_low_score;
  lane.car_points = params.lane_tracker_car_points;
  lane.sparse_score = params.lane_tracker_sparse_score;
  lane.thin_score = params.lane_tracker_thin_score;
  lane.confirm_score = params.lane_tracker_confirm_score;
  lane.drop_score = params.lane_tracker_drop_score;
  lane.most_score = params.lane_tracker_most_score;
  lane.tentative_misses = params.lane_tracker_tentative_misses;
  lane.coast_s = params.lane_tracker_coast_s;
  lane.coast_sigma_m = params.lane_tracker_coast_sigma_m;
  lane.confirm_hits = params.lane_tracker_confirm_hits;
  lane.path_turn_s = params.lane_tracker_path_turn_s;
  lane.path_speed = params.lane_tracker_path_speed;
  lane.path_across = params.lane_tracker_path_across;
  lane.length_m = params.vehicle_length_m;
  lane.width_m = params.vehicle_width_m;
  out.track_capacity = track_capacity;
  out.detection_capacity = detection_capacity;
  return out;
}

}  // namespace overtake

using namespace overtake;

extern "C" {

ovt_status ovt_params_init(ovt_params* params, size_t struct_size, const char* preset) {
  const FloatMode usual;
  if (!params || !preset) return OVT_BAD_ARGUMENT;
  if (!is_known_size<ovt_params>(struct_size)) return OVT_BAD_VERSION;
  const Method* method = find_method(preset);
  if (!method) return OVT_UNKNOWN_NAME;
  // A caller of the first version has no place for the method's name: its detector would run paper.
  const bool names_method = struct_size >= offsetof(ovt_params, method) + sizeof(ovt_params::method);
  if (!names_method && method != &kPaper) return OVT_BAD_VERSION;
  ovt_params defaults{};
  defaults.struct_size = struct_size;
  for (const ParamRow& row : kParams) write(defaults, row, row.info.value_default);
  if (method->set_defaults) method->set_defaults(defaults);
  defaults.method = method->name;
  std::memcpy(static_cast<void*>(params), &defaults, struct_size);
  return OVT_OK;
}

const char* ovt_preset_name(int32_t index) {
  const Method* known[kMaxMethods];
  const int32_t count = list_methods(known);
  return index >= 0 && index < count ? known[index]->name : nullptr;
}

int32_t ovt_param_count(void) { return kParamCount; }

int32_t ovt_reads_param(const ovt_params* params, int32_t index) {
  if (index < 0 || index >= kParamCount) return 0;
  ovt_params given = ovt_default_params();
  if (params && !take(*params, given)) return 0;
  const Method* method = find_method(given.method ? given.method : kPaper.name);
  return method && reads_param(*method, kParams[index].info.name);
}

ovt_status ovt_describe_param_sized(int32_t index, ovt_param_info* out, size_t out_size) {
  if (!out || index < 0 || index >= kParamCount) return OVT_BAD_ARGUMENT;
  return give(kParams[index].info, out, out_size);
}

ovt_status ovt_set_param(ovt_params* params, const char* name, const char* value) {
  const FloatMode usual;
  if (!params || !name || !value) return OVT_BAD_ARGUMENT;
  if (!is_known_size<ovt_params>(params->struct_size)) return OVT_BAD_VERSION;
  const ParamRow* row = find(name);
  if (!row || !is_within(*row, params->struct_size)) return OVT_UNKNOWN_NAME;
  double number = 0;
  const char* end = value + std::strlen(value);
  const auto [at, error] = std::from_chars(value, end, number);
  if (at != end || error == std::errc::invalid_argument) return OVT_BAD_ARGUMENT;
  if (error != std::errc()) number = read_extreme(value);
  if (!within(*row, number)) return OVT_OUT_OF_RANGE;  // also for NaN
  if (row->is_integer && number != double(int32_t(number))) return OVT_BAD_ARGUMENT;
  write(*params, *row, number);
  return OVT_OK;
}

ovt_status ovt_get_param(const ovt_params* params, const char* name, double* value) {
  const FloatMode usual;
  if (!params || !name || !value) return OVT_BAD_ARGUMENT;
  if (!is_known_size<ovt_params>(params->struct_size)) return OVT_BAD_VERSION;
  const ParamRow* row = find(name);
  if (!row || !is_within(*row, params->struct_size)) return OVT_UNKNOWN_NAME;
  *value = read(*params, *row);
  return OVT_OK;
}

}  // extern "C"
