// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/truth_sink.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "tools/client/console.h"
#include "tools/client/result_files.h"
#include "tools/io/csv.h"

namespace overtake::cli {
namespace {

constexpr double kDetectionReach_m = 3, kTrackReach_m = 5;
constexpr std::size_t kMostFrames = 24;

}  // namespace

std::map<int64_t, std::vector<TrueCar>> read_truth(const std::string& path) {
  const io::Csv csv = io::Csv::read(path);
  const int32_t frame = csv.need({"frame"}), ahead = csv.need({"ego_x_m"}), left = csv.need({"ego_y_m"});
  const int32_t name = csv.find({"name"}), is_ego = csv.find({"is_ego"}), speed = csv.find({"speed_mps"});
  const int32_t x = csv.find({"x_m"}), y = csv.find({"y_m"});
  const auto number_or_nan = [&](std::size_t row, int32_t column) {
    return column < 0 ? std::nan("") : csv.number(row, column);
  };
  std::map<int64_t, std::vector<TrueCar>> truth;
  for (std::size_t i = 0; i < csv.row_count(); ++i)
    if (is_ego < 0 || csv.integer(i, is_ego) == 0)
      truth[csv.integer(i, frame)].push_back({name < 0 ? "" : std::string(csv.text(i, name)), csv.number(i, ahead),
                                              csv.number(i, left), number_or_nan(i, x), number_or_nan(i, y),
                                              number_or_nan(i, speed)});
  return truth;
}

TruthSink::TruthSink(const std::string& source) : own_(source == kOwnTruth) {
  if (!own_) truth_ = read_truth(source);
}

TruthSink::Row TruthSink::match(const FinishedFrame& frame, const TrueCar& car) const {
  Row row{frame.number, car, NAN, NAN, NAN, 0, "", NAN, NAN};
  const ovt_detections& d = frame.detections;
  double best_m = kDetectionReach_m;
  for (int32_t i = 0; i < d.count; ++i) {
    const double off_m = std::hypot(double(d.x_m[i]) - car.ahead_m, double(d.y_m[i]) - car.left_m);
    if (off_m >= best_m) continue;
    best_m = row.detection_off_m = off_m;
    row.detection_x_m = d.x_m[i], row.detection_y_m = d.y_m[i];
    row.points = d.point_count ? d.point_count[i] : 0;
  }
  const ovt_tracks& t = frame.tracks;
  if (frame.info.reference != OVT_REFERENCE_MAP || std::isnan(car.x_m)) return row;
  best_m = kTrackReach_m;
  for (int32_t i = 0; i < t.count; ++i) {
    const double off_m = std::hypot(t.x_m[i] - car.x_m, t.y_m[i] - car.y_m);
    if (t.state[i] != OVT_CONFIRMED || off_m >= best_m) continue;
    best_m = row.track_off_m = off_m;
    row.track = track_name(t.id[i]);
    row.track_speed_mps = t.speed_mps[i];
  }
  return row;
}

void TruthSink::add(const FinishedFrame& frame) {
  std::vector<TrueCar> cars;
  if (const auto known = truth_.find(frame.number); known != truth_.end()) cars = known->second;
  if (own_ && frame.opponent) cars.push_back({"", frame.opponent->x_m, frame.opponent->y_m, NAN, NAN, NAN});
  for (const TrueCar& car : cars) {
    rows_.push_back(match(frame, car));
    any_in_map_ |= frame.info.reference == OVT_REFERENCE_MAP && !std::isnan(car.x_m);
  }
  frame_count_ += !cars.empty();
}

std::string TruthSink::format() const {
  std::set<int64_t> frames;
  std::set<std::string> names;
  std::vector<double> off_m;
  for (const Row& row : rows_) {
    frames.insert(row.frame);
    names.insert(row.car.name);
    if (!std::isnan(row.detection_off_m)) off_m.push_back(row.detection_off_m);
  }
  int64_t step = 1;
  const auto is_shown = [&step](int64_t frame) { return frame % step == 0; };
  while (std::size_t(std::count_if(frames.begin(), frames.end(), is_shown)) > kMostFrames) step *= 10;
  const auto make_row = [&](const Row& row, std::vector<std::string> cells) {
    cells.insert(cells.begin(), std::to_string(row.frame));
    if (names.size() > 1) cells.insert(cells.begin() + 1, row.car.name);
    return cells;
  };
  const auto make_table = [&](std::vector<std::string> header) {
    header.insert(header.begin(), "frame");
    if (names.size() > 1) header.insert(header.begin() + 1, "car");
    return TextTable(header);
  };

  TextTable detections = make_table({"truth x m", "truth y m", "found x m", "found y m", "off m", "points"});
  TextTable tracks = make_table({"truth ahead m", "track", "off m", "truth speed m/s", "track speed m/s"});
  for (const Row& row : rows_) {
    if (!is_shown(row.frame)) continue;
    const bool found = !std::isnan(row.detection_off_m), tracked = !row.track.empty();
    detections.add(make_row(
        row, {fixed(row.car.ahead_m, 2), fixed(row.car.left_m, 2), fixed(row.detection_x_m, 2),
              fixed(row.detection_y_m, 2), fixed(row.detection_off_m, 2), found ? std::to_string(row.points) : "-"}));
    tracks.add(make_row(row, {fixed(row.car.ahead_m, 2), tracked ? row.track : "-", fixed(row.track_off_m, 2),
                              fixed(row.car.speed_mps, 2), fixed(row.track_speed_mps, 2)}));
  }
  std::sort(off_m.begin(), off_m.end());
  std::string text = "Against the truth: the detection nearest to where each other car was when the scan began.\n" +
                     detections.format() + "Found " + std::to_string(off_m.size()) + " of " +
                     std::to_string(rows_.size());
  if (!off_m.empty()) text += ", off by " + fixed(off_m[off_m.size() / 2], 2) + " m at the median";
  text += ".\n";
  if (any_in_map_)
    text += "\nThe tracks against the truth: the confirmed track nearest to each other car, in the map.\n" +
            tracks.format();
  return text;
}

}  // namespace overtake::cli
