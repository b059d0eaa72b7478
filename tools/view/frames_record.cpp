// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/view/frames_record.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tools/client/result_files.h"
#include "tools/io/json_text.h"
#include "tools/io/text.h"

namespace overtake::cli {
namespace {

using Json = nlohmann::ordered_json;

// Whole microseconds from 100 us on, else one decimal: short, and never off by more than half a percent or 0.05 us.
Json short_us(double us) {
  if (std::isnan(us)) return nullptr;
  if (us >= 100) return int64_t(us + 0.5);
  return double(int64_t(us * 10 + 0.5)) / 10;
}

}  // namespace

FramesRecord::FramesRecord(const io::Rig& rig) : period_s_(rig.period_s) {
  for (const io::RigSensor& sensor : rig.sensors) sensors_.push_back(sensor.name);
}

void FramesRecord::add(ovt_reader* reader, int64_t number, const ovt_frame_info& info, const ovt_tracks& tracks) {
  const int32_t sensors = int32_t(sensors_.size());
  const int32_t confirmed = int32_t(std::count(tracks.state, tracks.state + tracks.count, OVT_CONFIRMED));
  const int32_t lost = info.flags & OVT_FLAG_EXTERNAL
                           ? 0
                           : sensors - std::popcount(info.sensor_mask) + std::popcount(info.incomplete_mask);
  rows_.push_back({info.stamp_ns, number, info.latency_ns, info.point_count, info.detection_count, tracks.count,
                   confirmed, lost, info.flags, times_us_.size()});
  for (int32_t sensor = -1; sensor < sensors; ++sensor)
    for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage)
      times_us_.push_back(float(read_time_us(reader, sensor, ovt_stage(stage))));
}

std::string FramesRecord::format() const {
  std::vector<Row> rows = rows_;
  std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.stamp_ns < b.stamp_ns; });
  const auto column = [&](auto&& value_of) {
    Json values = Json::array();
    for (const Row& row : rows) values.push_back(value_of(row));
    return values;
  };
  const auto times = [&](std::size_t k) {
    return column([&](const Row& row) { return short_us(double(times_us_[row.times + k])); });
  };
  Json out = {{"version", 1}, {"count", rows.size()}, {"sensors", sensors_}};
  out["period_us"] = int64_t(period_s_ * 1e6 + 0.5);
  out["deadline_us"] = nullptr;  // the command line sets none
  out["stamp_ns"] = column([](const Row& row) { return std::to_string(row.stamp_ns); });
  out["frame"] = column([](const Row& row) { return row.number; });
  out["frame_us"] = times(OVT_STAGE_FRAME);
  out["latency_us"] = column(
      [](const Row& row) { return row.latency_ns < 0 ? Json(nullptr) : short_us(double(row.latency_ns) / 1e3); });
  out["points"] = column([](const Row& row) { return row.points; });
  out["detections"] = column([](const Row& row) { return row.detections; });
  out["tracks"] = column([](const Row& row) { return row.tracks; });
  out["confirmed"] = column([](const Row& row) { return row.confirmed; });
  out["flags"] = column([](const Row& row) { return row.flags; });
  out["lost_scans"] = column([](const Row& row) { return row.lost_scans; });
  out["stages"] = Json::array();
  for (std::size_t k = 0; k < stage_count(); ++k) {
    const bool ran =
        std::any_of(rows.begin(), rows.end(), [&](const Row& row) { return !std::isnan(times_us_[row.times + k]); });
    if (!ran) continue;
    out["stages"].push_back({{"sensor", k < OVT_STAGE_COUNT ? "" : sensors_[k / OVT_STAGE_COUNT - 1]},
                             {"stage", ovt_stage_name(int32_t(k % OVT_STAGE_COUNT))},
                             {"us", times(k)}});
  }
#define OVT_FRAME_FLAG(name) out["flag_names"][std::to_string(OVT_FLAG_##name)] = io::lower_case(#name);
#include "pipeline/stats.def"
  out["reason_names"] = Json::array();
  for (int32_t reason = 0; ovt_reason_name(reason); ++reason) out["reason_names"].push_back(ovt_reason_name(reason));
  return io::dump_json(out);
}

}  // namespace overtake::cli
