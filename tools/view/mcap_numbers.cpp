// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/view/mcap_numbers.h"

#include <nlohmann/json.hpp>

#include "tools/client/result_files.h"

namespace overtake::cli {
namespace {

using Json = nlohmann::ordered_json;

Json schema_object(const Json& properties) {
  Json required = Json::array();
  for (const auto& [key, value] : properties.items()) required.push_back(key);
  return {{"type", "object"}, {"properties", properties}, {"required", required}, {"additionalProperties", false}};
}

Json number_or_null() { return {{"type", {"number", "null"}}}; }
Json integer() { return {{"type", "integer"}}; }
Json text() { return {{"type", "string"}}; }
Json list(const Json& items) { return {{"type", "array"}, {"items", items}}; }

// `keys` are numbers; the others are named.
Json rows(std::initializer_list<const char*> keys, Json properties) {
  for (const char* key : keys) properties[key] = number_or_null();
  return list(schema_object(properties));
}

Json point_counts() { return list(integer()); }

Json make_schema(const std::string& name) {
  Json stamped = {{"stamp_ns", text()}};
  if (name == "overtake.Detections") {
    stamped["detections"] = rows({"x_m", "y_m", "z_m", "heading_rad", "heading_ref_rad", "heading_var_rad", "ref_x_m",
                                  "ref_y_m", "var_x_m", "var_y_m", "length_m", "width_m", "map_s_m", "map_d_m"},
                                 {{"stamp_ns", text()},
                                  {"heading_source", {{"enum", {"ref", "var"}}}},
                                  {"points", integer()},
                                  {"inliers_ref", integer()},
                                  {"inliers_var", integer()},
                                  {"sensor_mask", integer()},
                                  {"track", text()}});
  } else if (name == "overtake.Tracks") {
    stamped["frame"] = {{"enum", {"map", "vehicle"}}};
    stamped["path_step_s"] = number_or_null();
    Json path = schema_object({{"x_m", list(number_or_null())},
                               {"y_m", list(number_or_null())},
                               {"var_x", list(number_or_null())},
                               {"var_y", list(number_or_null())},
                               {"cov_xy", list(number_or_null())}});
    stamped["tracks"] =
        rows({"x_m", "y_m", "speed_mps", "course_rad", "yaw_rate_rps", "heading_rad", "length_m", "width_m"},
             {{"id", text()},
              {"state", {{"enum", {"tentative", "confirmed"}}}},
              {"measured_ns", text()},
              {"age", integer()},
              {"hits", integer()},
              {"covariance", list(number_or_null())},
              {"path", path}});
  } else if (name == "overtake.Times") {
    stamped["stages"] = rows({"us"}, {{"sensor", text()}, {"stage", text()}});
  } else {
    stamped = Json::object();
    // clang-format off
    for (const char* key :
         {"pushed", "used", "dropped", "late", "dup", "frames", "points", "overflow_clusters", "overflow_candidates",
          "overflow_tracks", "exceptions", "deadline_missed", "clock_jumps", "ego_poses", "ego_dropped", "external",
          "external_dropped", "points_clustered", "clusters", "gated_points", "gated_size", "gated_map", "detections",
          "measurements", "measurements_used", "measurements_unborn", "measurements_rejected", "measurements_late",
          "measurements_lost", "tracks_born", "tracks_missed", "tracks_silent", "tracks_displaced", "tracks_unsound",
          "tracks_forgotten"})
      // clang-format on
      stamped[key] = integer();
    stamped["points_bad"] = point_counts();
  }
  Json schema = schema_object(stamped);
  schema["title"] = name;
  schema["$schema"] = "https://json-schema.org/draft/2020-12/schema";
  return schema;
}

}  // namespace

std::string number_schema(const std::string& name) { return make_schema(name).dump(); }

std::string format_detections(const ovt_frame_info& info, const ovt_detections& d) {
  Json list = Json::array();
  for (int32_t i = 0; i < d.count; ++i)
    list.push_back({{"stamp_ns", std::to_string(d.stamp_ns[i])},
                    {"heading_source", d.heading_source[i] == 0 ? "ref" : "var"},
                    {"points", d.point_count[i]},
                    {"inliers_ref", d.inliers_ref[i]},
                    {"inliers_var", d.inliers_var[i]},
                    {"sensor_mask", d.sensor_mask[i]},
                    {"track", std::to_string(d.track[i])},
                    {"x_m", d.x_m[i]},
                    {"y_m", d.y_m[i]},
                    {"z_m", d.z_m[i]},
                    {"heading_rad", d.heading_rad[i]},
                    {"heading_ref_rad", d.heading_ref_rad[i]},
                    {"heading_var_rad", d.heading_var_rad[i]},
                    {"ref_x_m", d.ref_x_m[i]},
                    {"ref_y_m", d.ref_y_m[i]},
                    {"var_x_m", d.var_x_m[i]},
                    {"var_y_m", d.var_y_m[i]},
                    {"length_m", d.length_m[i]},
                    {"width_m", d.width_m[i]},
                    {"map_s_m", d.map_s_m[i]},
                    {"map_d_m", d.map_d_m[i]}});
  return Json{{"stamp_ns", std::to_string(info.stamp_ns)}, {"detections", list}}.dump();
}

std::string format_tracks(const ovt_frame_info& info, const ovt_tracks& t) {
  Json list = Json::array();
  for (int32_t i = 0; i < t.count; ++i) {
    Json covariance = Json::array();
    for (const double* column : t.covariance) covariance.push_back(column[i]);
    const auto path = [&](const double* column) {
      const double* first = column + std::ptrdiff_t(i) * t.path_points;
      return Json(std::vector<double>(first, first + t.path_points));
    };
    list.push_back({{"id", std::to_string(t.id[i])},
                    {"state", t.state[i] == OVT_CONFIRMED ? "confirmed" : "tentative"},
                    {"measured_ns", std::to_string(t.measured_ns[i])},
                    {"age", t.age[i]},
                    {"hits", t.hits[i]},
                    {"covariance", covariance},
                    {"path",
                     {{"x_m", path(t.path_x_m)},
                      {"y_m", path(t.path_y_m)},
                      {"var_x", path(t.path_var_x)},
                      {"var_y", path(t.path_var_y)},
                      {"cov_xy", path(t.path_cov_xy)}}},
                    {"x_m", t.x_m[i]},
                    {"y_m", t.y_m[i]},
                    {"speed_mps", t.speed_mps[i]},
                    {"course_rad", t.course_rad[i]},
                    {"yaw_rate_rps", t.yaw_rate_rps[i]},
                    {"heading_rad", t.heading_rad[i]},
                    {"length_m", t.length_m[i]},
                    {"width_m", t.width_m[i]}});
  }
  return Json{{"stamp_ns", std::to_string(info.stamp_ns)},
              {"frame", info.reference == OVT_REFERENCE_MAP ? "map" : "vehicle"},
              {"path_step_s", t.path_step_s},
              {"tracks", list}}
      .dump();
}

std::string format_times(ovt_reader* reader, const ovt_frame_info& info, const io::Rig& rig) {
  Json list = Json::array();
  for (int32_t sensor = -1; sensor < int32_t(rig.sensors.size()); ++sensor)
    for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage) {
      const double us = read_time_us(reader, sensor, ovt_stage(stage));
      if (us != us) continue;  // did not run
      list.push_back({{"sensor", sensor < 0 ? "" : rig.sensors[std::size_t(sensor)].name},
                      {"stage", ovt_stage_name(stage)},
                      {"us", us}});
    }
  return Json{{"stamp_ns", std::to_string(info.stamp_ns)}, {"stages", list}}.dump();
}

std::string format_counters(const ovt_stats& s) {
  return Json{{"pushed", s.pushed},
              {"used", s.used},
              {"dropped", s.dropped},
              {"late", s.late},
              {"dup", s.dup},
              {"frames", s.frames},
              {"points", s.points},
              {"overflow_clusters", s.overflow_clusters},
              {"overflow_candidates", s.overflow_candidates},
              {"overflow_tracks", s.overflow_tracks},
              {"exceptions", s.exceptions},
              {"deadline_missed", s.deadline_missed},
              {"clock_jumps", s.clock_jumps},
              {"ego_poses", s.ego_poses},
              {"ego_dropped", s.ego_dropped},
              {"external", s.external},
              {"external_dropped", s.external_dropped},
              {"points_clustered", s.points_clustered},
              {"clusters", s.clusters},
              {"gated_points", s.gated_points},
              {"gated_size", s.gated_size},
              {"gated_map", s.gated_map},
              {"detections", s.detections},
              {"measurements", s.measurements},
              {"measurements_used", s.measurements_used},
              {"measurements_unborn", s.measurements_unborn},
              {"measurements_rejected", s.measurements_rejected},
              {"measurements_late", s.measurements_late},
              {"measurements_lost", s.measurements_lost},
              {"tracks_born", s.tracks_born},
              {"tracks_missed", s.tracks_missed},
              {"tracks_silent", s.tracks_silent},
              {"tracks_displaced", s.tracks_displaced},
              {"tracks_unsound", s.tracks_unsound},
              {"tracks_forgotten", s.tracks_forgotten},
              {"points_bad", std::vector<int64_t>(std::begin(s.points_bad), std::end(s.points_bad))}}
      .dump();
}

}  // namespace overtake::cli
