// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/client/result_files.h"

#include <cmath>
#include <string_view>
#include <type_traits>

#include "pipeline/columns.h"

namespace overtake::cli {

std::string_view word_of(std::string_view words, int64_t value) {
  for (; value > 0 && words.find(' ') != std::string_view::npos; --value) words.remove_prefix(words.find(' ') + 1);
  return words.substr(0, words.find(' '));
}

namespace {

template <class T>
void write_cell(io::CsvWriter& csv, const char* words, T value) {
  if (*words)
    csv.cell(word_of(words, int64_t(value)));
  else if constexpr (std::is_floating_point_v<T> || std::is_same_v<T, uint64_t>)
    csv.cell(value);
  else
    csv.cell(int64_t(value));
}

// The columns' names, each after a comma. `behind_state`: columns of the frame, whose place is after column `state`.
template <class Table>
std::string names_of_cells(const Table& table, const char* behind_state) {
  std::string names;
  for_each_column(table, [&](const ColumnInfo& column, auto* values, int64_t) {
    if (*column.csv && (values || !column.optional)) names += std::string(",") + column.csv;
    if (std::string_view(column.csv) == "state") names += behind_state;
  });
  return names;
}

}  // namespace

std::string detections_header(const ovt_detections& d) { return "frame" + names_of_cells(d, ""); }

void write_detections(io::CsvWriter& csv, int64_t frame, const ovt_detections& d) {
  for (int32_t i = 0; i < d.count; ++i) {
    csv.cell(frame);
    for_each_column(d, [&](const ColumnInfo& column, const auto* values, int64_t) {
      if (*column.csv && values) write_cell(csv, column.words, values[i]);
    });
    csv.end_row();
  }
}

double vehicle_yaw_rad(const ovt_frame_info& info) { return info.ego_yaw_rad + info.ego_heading_offset_rad; }

Place place_of(const ovt_frame_info& info, const ovt_tracks& tracks, int32_t i) {
  if (info.reference == OVT_REFERENCE_VEHICLE) return {tracks.x_m[i], tracks.y_m[i]};
  if (!info.ego_known) return {std::nan(""), std::nan("")};
  const double dx = tracks.x_m[i] - info.ego_x_m, dy = tracks.y_m[i] - info.ego_y_m;
  const double c = std::cos(vehicle_yaw_rad(info)), s = std::sin(vehicle_yaw_rad(info));
  return {dx * c + dy * s, dy * c - dx * s};
}

std::string track_name(uint64_t id) { return std::to_string(id & 0xffffffff) + ":" + std::to_string(id >> 32); }

std::string tracks_header(const ovt_tracks& t) {
  std::string header = "stamp_ns" + names_of_cells(ovt_tracks{}, ",frame") + ",var_x,var_y,ahead_m,left_m,name";
  for_each_column(t, [&](const ColumnInfo& column, const auto* values, int64_t) {
    if (column.optional && *column.csv && values) header += std::string(",") + column.csv;
  });
  return header;
}

void write_tracks(io::CsvWriter& csv, int64_t frame, const ovt_frame_info& info, const ovt_tracks& t) {
  const auto cell_if_known = [&](double value) {
    if (std::isnan(value))
      csv.cell(std::string_view());
    else
      csv.cell(value);
  };
  for (int32_t i = 0; i < t.count; ++i) {
    csv.cell(t.publish_ns);
    for_each_column(t, [&](const ColumnInfo& column, const auto* values, int64_t) {
      if (*column.csv && !column.optional) write_cell(csv, column.words, values[i]);
      if (std::string_view(column.csv) == "state") csv.cell(frame);
    });
    csv.cell(t.covariance[0][i]).cell(t.covariance[2][i]);  // lower triangle: xx, yx, yy
    const Place place = place_of(info, t, i);
    cell_if_known(place.ahead_m);
    cell_if_known(place.left_m);
    csv.cell(std::string_view(track_name(t.id[i])));
    for_each_column(t, [&](const ColumnInfo& column, const auto* values, int64_t) {
      if (column.optional && *column.csv && values) write_cell(csv, column.words, values[i]);
    });
    csv.end_row();
  }
}

void ResultHash::add(const ovt_frame_info& info, const ovt_detections& detections, const ovt_tracks& tracks) {
  if (!any_) first_ns_ = info.first_stamp_ns;
  any_ = true;
  const auto add_number = [&]<class T>(T value) {
    if constexpr (std::is_same_v<T, int64_t>)  // a stamp
      hash_.add_value(uint64_t(value) - uint64_t(first_ns_));
    else
      hash_.add_value(value);
  };
  const auto add_value = [&](const ValueInfo&, const auto& value) { add_number(value); };
  const auto add_column = [&](const ColumnInfo&, const auto* column, int64_t rows) {
    for (int64_t i = 0; column && i < rows; ++i) add_number(column[i]);
  };
  for_each_value(detections, add_value);
  for_each_column(detections, add_column);
  for_each_value(tracks, add_value);
  for_each_column(tracks, add_column);
}

double read_time_us(ovt_reader* reader, int32_t sensor, ovt_stage stage) {
  int64_t ns = -1;
  return ovt_read_time(reader, sensor, stage, &ns) == OVT_OK && ns >= 0 ? double(ns) / 1000 : std::nan("");
}

void write_times(io::CsvWriter& csv, int64_t frame, int64_t stamp_ns, const io::Rig& rig, ovt_reader* reader) {
  for (int32_t sensor = -1; sensor < int32_t(rig.sensors.size()); ++sensor)
    for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage) {
      const double us = read_time_us(reader, sensor, ovt_stage(stage));
      if (std::isnan(us)) continue;
      csv.cell(frame).cell(stamp_ns);
      csv.cell(sensor < 0 ? std::string_view() : std::string_view(rig.sensors[std::size_t(sensor)].name));
      csv.cell(std::string_view(ovt_stage_name(stage))).cell(us).end_row();
    }
}

}  // namespace overtake::cli
