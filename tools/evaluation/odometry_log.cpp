// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/odometry_log.h"

#include <optional>

#include "tools/evaluation/kept_runs.h"
#include "tools/io/bag_stream.h"
#include "tools/io/error.h"
#include "tools/io/map_file.h"
#include "tools/io/text.h"

namespace overtake::evaluation {
namespace {

// Text of a map file, or of the map in an MCAP log. It is copied to the results, so it must be one file.
std::string read_map_text(const std::string& path) {
  if (io::read_map(path).is_bounds())
    throw io::Error("--map " + path, 0, "two bounds: here a centre line with its widths is needed");
  if (std::optional<std::string> own = io::read_attached(path, "map.csv")) return *own;
  return io::read_whole_file(path);
}

}  // namespace

// Reads the recording twice: first the poses, because a scan needs later poses, too; then the scans.
OdometryLog::OdometryLog(const std::string& path, const io::Rig& rig, const std::string& map_file)
    : path_(path), rig_(rig) {
  const std::unique_ptr<io::BagReader> bag = io::open_bag(path);
  const io::TopicRoles roles = io::find_topic_roles(bag->topics(), rig);
  if (roles.ego < 0 || roles.opponent < 0)
    throw io::Error(path, 0,
                    std::string(roles.ego < 0 ? "no odometry of the ego" : "no odometry of an opponent") +
                        " under the rig's topics; there are " + io::list_topics(bag->topics(), ""));
  io::BagMessage message;
  while (bag->next(message)) {
    if (message.topic != roles.ego && message.topic != roles.opponent) continue;
    io::EgoRow row;
    try {
      row = io::ego_of_odometry(io::decode_odometry(message.data));
    } catch (const std::runtime_error& error) {
      throw io::Error(path + ": message " + std::to_string(message.number), 0, error.what());
    }
    if (!io::is_finite(row)) continue;
    (message.topic == roles.ego ? ego_ : opponent_).add(row);
    if (message.topic == roles.ego && (poses_.empty() || poses_.back().row.stamp_ns < row.stamp_ns))
      poses_.push_back({row, row.stamp_ns});
  }
  if (!map_file.empty()) map_text_ = read_map_text(map_file);
  about_ = {{"scenario", log_stem(path)},
            {"simulated", "false"},
            {"truth", "odometry of the two cars, smoothed"},
            {"recording", log_file_name(path)}};
  stream_ = io::open_scans(path, rig);
}

bool OdometryLog::next(LogFrame& out) {
  out = LogFrame();
  const bool more = stream_->next(out.scans);
  if (stream_->lost_count() > 0) throw io::Error(path_, 0, stream_->first_loss());  // numbers of all frames, or none
  return more;
}

std::vector<CarTruth> OdometryLog::cars_at(int64_t stamp_ns) const {
  std::optional<CarTruth> ego = ego_.at(stamp_ns), opponent = opponent_.at(stamp_ns);
  if (!ego || !opponent) return {};
  ego->is_ego = true;
  opponent->car = 1;
  return {*ego, *opponent};
}

}  // namespace overtake::evaluation
