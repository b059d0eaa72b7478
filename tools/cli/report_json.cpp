// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/report_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "pipeline/overtake.h"
#include "tools/client/config.h"
#include "tools/client/result_files.h"
#include "tools/io/json_text.h"
#include "tools/io/text.h"

namespace overtake::cli {
namespace {

using Json = nlohmann::ordered_json;

std::string dump(const Json& json) { return io::dump_json(json, 1) + "\n"; }

Json finite_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json json_of_track(const LoneTrack& t) {
  return {{"id", std::to_string(t.id)},
          {"name", track_name(t.id)},
          {"from_s", t.from_s},
          {"duration_s", t.duration_s},
          {"frames", t.frames},
          {"matched_frames", t.matched},
          {"x_m", t.x_m},
          {"y_m", t.y_m},
          {"ahead_m", finite_or_null(t.ahead_m)},
          {"left_m", finite_or_null(t.left_m)},
          {"map_s_m", finite_or_null(t.s_m)},
          {"map_d_m", finite_or_null(t.d_m)}};
}

Json json_of_run(const std::string& path, const RunCounts& run) {
  const Json reference =
      run.reference == Reference::kUnknown ? Json() : Json(run.reference == Reference::kMap ? "map" : "vehicle");
  Json json = {{"path", path},
               {"reference", reference},
               {"detections", run.detections},
               {"frames_with_detections", run.frames_with_detections},
               {"detections_without_match", run.lone_detections},
               {"tracks", run.tracks},
               {"confirmed_tracks", run.confirmed_tracks},
               {"confirmed_rows", run.confirmed_rows},
               {"confirmed_rows_without_match", run.lone_rows},
               {"only_here", Json::array()}};
  for (const LoneTrack& t : run.lone_tracks) json["only_here"].push_back(json_of_track(t));
  return json;
}

Json json_of_sizes(const metrics::Summary& s) {
  return {{"median", finite_or_null(s.median)}, {"p95", finite_or_null(s.p95)}, {"max", finite_or_null(s.most)}};
}

}  // namespace

std::string info_json(const RecordingInfo& info) {
  const bool timed = info.first_ns <= info.last_ns;
  Json json = {{"path", info.path},
               {"kind", info.kind},
               {"first_ns", timed ? Json(info.first_ns) : Json(nullptr)},
               {"last_ns", timed ? Json(info.last_ns) : Json(nullptr)},
               {"damage", info.damage},
               {"partial", info.partial},
               {"topics", Json::array()},
               {"scans", Json::array()}};
  for (const RecordingInfo::Topic& t : info.topics)
    json["topics"].push_back({{"name", t.name},
                              {"type", t.type},
                              {"messages", t.messages},
                              {"rate_hz", finite_or_null(t.rate_hz)},
                              {"bytes", t.bytes},
                              {"frame", t.frame},
                              {"layout", t.layout},
                              {"points", t.points},
                              {"undecoded", t.undecoded}});
  for (const RecordingInfo::Scans& s : info.scans)
    json["scans"].push_back({{"name", s.name},
                             {"files", s.files},
                             {"first_file", s.first_file},
                             {"points_of_first", s.points},
                             {"fields", s.fields}});
  return dump(json);
}

std::string doctor_json(const std::string& input, const std::string& rig, const std::vector<Finding>& findings) {
  Json json = {{"input", input}, {"rig", rig}, {"wrong", 0}, {"findings", Json::array()}};
  int64_t wrong = 0;
  for (const Finding& finding : findings) {
    wrong += finding.wrong;
    json["findings"].push_back({{"severity", finding.wrong ? "wrong" : "note"},
                                {"about", finding.about},
                                {"sentence", finding.sentence},
                                {"advice", finding.advice}});
  }
  json["wrong"] = wrong;
  return dump(json);
}

std::string compare_json(const std::string& a, const std::string& b, const RunComparison& c) {
  return dump({{"gate_m", kSamePlaceM},
               {"a", json_of_run(a, c.a)},
               {"b", json_of_run(b, c.b)},
               {"matched_detections",
                {{"count", c.detection_distance_m.count},
                 {"distance_m", json_of_sizes(c.detection_distance_m)},
                 {"heading_rad", json_of_sizes(c.detection_turn_rad)}}},
               {"matched_tracks",
                {{"rows", c.track_distance_m.count},
                 {"distance_m", json_of_sizes(c.track_distance_m)},
                 {"speed_mps", json_of_sizes(c.track_speed_mps)}}}});
}

std::string version_json(const ovt_build_info& build) {
  Json json = {
      {"version", build.version_text}, {"commit", build.commit}, {"compiler", build.compiler}, {"isas", Json::array()}};
  for (const std::string_view isa : io::split_words(build.isas)) json["isas"].push_back(std::string(isa));
  std::string text = dump(json);
  text.pop_back();
  return text;
}

std::string params_json(const std::string& preset) {
  Json json = {{"preset", preset}, {"parameters", Json::array()}};
  for (const PresetParam& param : describe_preset(preset)) {
    const ovt_param_info& info = param.info;
    const auto value = [&](double number) {
      return info.is_integer ? Json(std::llround(number)) : finite_or_null(number);
    };
    json["parameters"].push_back({{"name", info.name},
                                  {"unit", info.unit},
                                  {"default", value(info.value_default)},
                                  {"min", value(info.value_min)},
                                  {"max", value(info.value_max)},
                                  {"integer", info.is_integer != 0},
                                  {"has_effect", param.has_effect},
                                  {"text", info.text}});
  }
  return dump(json);
}

}  // namespace overtake::cli
