// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/view/mcap_numbers.h"

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string_view>
#include <type_traits>

#include "tools/client/result_files.h"
#include "tools/io/text.h"

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
Json numbers(const char* meaning) { return {{"type", "array"}, {"items", number_or_null()}, {"description", meaning}}; }

// The schema of a table value: stamps and ids are text; an enum value is written as its name.
template <class T>
Json value_schema(const char* words, const char* meaning) {
  Json schema = std::is_floating_point_v<T> ? number_or_null() : sizeof(T) == 8 ? text() : integer();
  if (*words) {
    schema = {{"enum", Json::array()}};
    for (const std::string_view name : io::split_words(words)) schema["enum"].push_back(std::string(name));
  }
  schema["description"] = meaning;
  return schema;
}
template <class T>
Json value_of(const char* words, T value) {
  if (*words) return std::string(word_of(words, int64_t(value)));
  if constexpr (!std::is_floating_point_v<T> && sizeof(T) == 8)
    return std::to_string(value);
  else
    return value;
}

Json detection_schema() {
  Json row;
#define OVT_DETECTION(type, name, csv, json, words, meaning) row[json] = value_schema<type>(words, meaning);
#define OVT_DETECTION_TRACK OVT_DETECTION
#include "core/columns.def"
  Json schema = schema_object(row);  // the columns below are not required: some methods do not compute them
#define OVT_DETECTION_VIEW(type, name, csv, json, words, meaning) \
  schema["properties"][json] = value_schema<type>(words, meaning);
#include "core/columns.def"
  return schema;
}
Json detection_row(const ovt_detections& d, int32_t i) {
  Json row;
#define OVT_DETECTION(type, name, csv, json, words, meaning) row[json] = value_of(words, d.name[i]);
#define OVT_DETECTION_TRACK OVT_DETECTION
#define OVT_DETECTION_VIEW(type, name, csv, json, words, meaning) \
  if (d.name) row[json] = value_of(words, d.name[i]);
#include "core/columns.def"
  return row;
}

Json track_schema() {
  Json row, path;
#define OVT_TRACK(type, name, csv, json, words, meaning) row[json] = value_schema<type>(words, meaning);
#define OVT_TRACK_COVARIANCE(type, name, json, meaning) row[json] = numbers(meaning);
#define OVT_PATH(type, name, json, meaning) path[json] = numbers(meaning);
#include "core/columns.def"
  row["path"] = schema_object(path);
  Json schema = schema_object(row);  // as above
#define OVT_TRACK_OPTIONAL(type, name, csv, json, words, meaning) \
  schema["properties"][json] = value_schema<type>(words, meaning);
#define OVT_PATH_OPTIONAL(type, name, json, meaning) \
  schema["properties"]["path"]["properties"][json] = numbers(meaning);
#include "core/columns.def"
  return schema;
}
Json track_row(const ovt_tracks& t, int32_t i) {
  const std::ptrdiff_t begin = std::ptrdiff_t(i) * t.path_points, end = begin + t.path_points;
  Json row, path;
#define OVT_TRACK(type, name, csv, json, words, meaning) row[json] = value_of(words, t.name[i]);
#define OVT_TRACK_COVARIANCE(type, name, json, meaning) \
  for (const type* column : t.name) row[json].push_back(column[i]);
#define OVT_PATH(type, name, json, meaning) path[json] = std::vector<type>(t.path_##name + begin, t.path_##name + end);
#define OVT_PATH_OPTIONAL(type, name, json, meaning) \
  if (t.path_##name) path[json] = std::vector<type>(t.path_##name + begin, t.path_##name + end);
#include "core/columns.def"
  row["path"] = path;
#define OVT_TRACK_OPTIONAL(type, name, csv, json, words, meaning) \
  if (t.name) row[json] = value_of(words, t.name[i]);
#include "core/columns.def"
  return row;
}

Json truth_schema() {
  return schema_object({{"id", integer()},
                        {"name", text()},
                        {"x_m", number_or_null()},
                        {"y_m", number_or_null()},
                        {"z_m", number_or_null()},
                        {"heading_rad", number_or_null()},
                        {"speed_mps", number_or_null()},
                        {"length_m", number_or_null()},
                        {"width_m", number_or_null()}});
}

Json make_schema(const std::string& name) {
  Json keys = {{"stamp_ns", text()}};
  if (name == "overtake.Detections") {
    keys["detections"] = list(detection_schema());
  } else if (name == "overtake.Tracks") {
    keys["frame"] = {{"enum", {"map", "vehicle"}}};
    keys["tracks"] = list(track_schema());
#define OVT_TRACKS_VALUE(type, name, json, meaning) keys[json] = value_schema<type>("", meaning);
#include "core/columns.def"
  } else if (name == "overtake.Truth") {
    keys["frame"] = {{"enum", {"map", "vehicle"}}};
    keys["cars"] = list(truth_schema());
  } else if (name == "overtake.Times") {
    keys["stages"] = list(schema_object({{"sensor", text()}, {"stage", text()}, {"us", number_or_null()}}));
  } else {
    keys = Json::object();
#define OVT_COUNTER(name, meaning) keys[#name] = {{"type", "integer"}, {"description", meaning}};
#define OVT_COUNTERS(name, size, meaning) \
  keys[#name] = {{"type", "array"}, {"items", integer()}, {"description", meaning}};
#define OVT_GAUGE OVT_COUNTER
#include "pipeline/stats.def"
  }
  Json schema = schema_object(keys);
  schema["title"] = name;
  schema["$schema"] = "https://json-schema.org/draft/2020-12/schema";
  return schema;
}

}  // namespace

std::string number_schema(const std::string& name) { return make_schema(name).dump(); }

std::string format_detections(const ovt_frame_info& info, const ovt_detections& d) {
  Json rows = Json::array();
  for (int32_t i = 0; i < d.count; ++i) rows.push_back(detection_row(d, i));
  return Json{{"stamp_ns", std::to_string(info.stamp_ns)}, {"detections", rows}}.dump();
}

std::string format_tracks(const ovt_frame_info& info, const ovt_tracks& t) {
  Json rows = Json::array();
  for (int32_t i = 0; i < t.count; ++i) rows.push_back(track_row(t, i));
  Json all = {{"stamp_ns", std::to_string(info.stamp_ns)},
              {"frame", info.reference == OVT_REFERENCE_MAP ? "map" : "vehicle"},
              {"tracks", rows}};
#define OVT_TRACKS_VALUE(type, name, json, meaning) all[json] = value_of("", t.name);
#include "core/columns.def"
  return all.dump();
}

std::string format_truth(int64_t stamp_ns, bool in_map, const std::vector<io::KnownCar>& cars) {
  Json rows = Json::array();
  for (const io::KnownCar& car : cars)
    rows.push_back({{"id", car.id},
                    {"name", car.name},
                    {"x_m", car.x_m},
                    {"y_m", car.y_m},
                    {"z_m", car.z_m},
                    {"heading_rad", car.heading_rad},
                    {"speed_mps", car.speed_mps},
                    {"length_m", car.length_m},
                    {"width_m", car.width_m}});
  return Json{{"stamp_ns", std::to_string(stamp_ns)}, {"frame", in_map ? "map" : "vehicle"}, {"cars", rows}}.dump();
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

std::string format_counters(const ovt_stats& stats) {
  Json counters;
#define OVT_COUNTER(name, meaning) counters[#name] = stats.name;
#define OVT_COUNTERS(name, size, meaning) counters[#name] = stats.name;
#define OVT_GAUGE OVT_COUNTER
#include "pipeline/stats.def"
  return counters.dump();
}

}  // namespace overtake::cli
