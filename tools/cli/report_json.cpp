// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/report_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "pipeline/overtake.h"

namespace overtake::cli {
namespace {

using Json = nlohmann::ordered_json;

std::string dump(const Json& json) { return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n"; }

Json finite_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

}  // namespace

std::string info_json(const RecordingInfo& info) {
  const bool timed = info.first_ns <= info.last_ns;
  Json json = {{"path", info.path},
               {"kind", info.kind},
               {"first_ns", timed ? Json(info.first_ns) : Json(nullptr)},
               {"last_ns", timed ? Json(info.last_ns) : Json(nullptr)},
               {"damage", info.damage},
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

std::string params_json() {
  Json json = {{"parameters", Json::array()}};
  for (int32_t i = 0; i < ovt_param_count(); ++i) {
    ovt_param_info info;
    if (ovt_describe_param(i, &info) != OVT_OK) continue;
    const auto value = [&](double number) {
      return info.is_integer ? Json(std::llround(number)) : finite_or_null(number);
    };
    json["parameters"].push_back({{"name", info.name},
                                  {"unit", info.unit},
                                  {"default", value(info.value_default)},
                                  {"min", value(info.value_min)},
                                  {"max", value(info.value_max)},
                                  {"integer", info.is_integer != 0},
                                  {"text", info.text}});
  }
  return dump(json);
}

}  // namespace overtake::cli
