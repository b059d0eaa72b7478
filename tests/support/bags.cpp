// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tests/support/bags.h"

#include <sqlite3.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <stdexcept>

#include "tools/client/result_files.h"
#include "tools/client/session.h"
#include "tools/io/cloud_message.h"
#include "tools/io/scan_stream.h"

namespace overtake::test {
namespace {

template <class T>
io::CloudColumn column(io::ValueType type, const std::vector<T>& values) {
  io::CloudColumn out{type, 1, std::vector<unsigned char>(values.size() * sizeof(T))};
  if (!values.empty()) std::memcpy(out.bytes.data(), values.data(), out.bytes.size());
  return out;
}

}  // namespace

std::string kitti_bytes(const io::Cloud& cloud) {
  std::string bytes;
  for (std::size_t i = 0; i < std::size_t(cloud.points); ++i)
    for (std::size_t c = 0; c < 4; ++c)
      bytes.append(reinterpret_cast<const char*>(cloud.columns[c].bytes.data()) + 4 * i, 4);
  return bytes;
}

io::Cloud swept_cloud(int32_t lines, int32_t shots, double shift_m, bool with_ring) {
  std::vector<float> x, y, z, intensity;
  std::vector<uint16_t> ring;
  for (int32_t line = 0; line < lines; ++line)
    for (int32_t shot = 0; shot < shots; ++shot) {
      if ((line * 31 + shot * 17) % 97 == 0) continue;  // a few holes
      const double elevation = (4.0 - 16.0 * line / lines) / 57.29578;
      const double azimuth = (59.5 - 119.0 * shot / (shots - 1)) / 57.29578;
      const double wall = (20 + shift_m) / std::cos(azimuth), ground = elevation < 0 ? 1.5 / -std::tan(elevation) : 1e9;
      // The rear of a car, 1.9 m wide, 12 m ahead.
      const double car =
          std::fabs(12 * std::tan(azimuth)) < 0.95 && elevation < 0 ? (12 + shift_m) / std::cos(azimuth) : 1e9;
      const double range = std::min({wall, ground, car});
      x.push_back(float(range * std::cos(azimuth)));
      y.push_back(float(range * std::sin(azimuth)));
      z.push_back(float(range * std::tan(elevation)));
      intensity.push_back(float(shot % 100));
      ring.push_back(uint16_t(line));
    }
  io::Cloud cloud;
  cloud.points = int64_t(x.size());
  const auto add = [&](const char* name, io::CloudColumn c) {
    cloud.fields.push_back({name, c.type, 1});
    cloud.columns.push_back(std::move(c));
  };
  add("x", column(io::ValueType::kFloat32, x));
  add("y", column(io::ValueType::kFloat32, y));
  add("z", column(io::ValueType::kFloat32, z));
  add("intensity", column(io::ValueType::kFloat32, intensity));
  if (with_ring) add("ring", column(io::ValueType::kUint16, ring));
  return cloud;
}

io::Rig swept_rig(int32_t lines) {
  return io::parse_rig(
      "swept",
      "name = \"swept\"\nperiod_s = 0.05\n[[sensor]]\nname = \"front\"\nx_m = 0.0\ny_m = 0.0\nz_m = 1.5\n"
      "rows = " +
          std::to_string(lines) + "\ncols = 240\nazimuth_left_deg = 60.0\nazimuth_right_deg = -60.0\n");
}

Recorded cloud_of(const io::Cloud& points, const std::string& topic, int64_t stamp_ns, const std::string& frame_id) {
  io::PointCloud2 cloud;
  const std::string data = io::make_cloud_message(points, {stamp_ns, frame_id}, cloud);
  cloud.data = data;
  return {topic, io::kPointCloud2Name, io::encode_point_cloud2(cloud), stamp_ns};
}

std::vector<Recorded> straight_drive(const std::string& topic, int64_t from_ns, int64_t to_ns) {
  std::vector<Recorded> out;
  for (int64_t stamp_ns = from_ns; stamp_ns <= to_ns; stamp_ns += 10'000'000) {
    io::Odometry odometry;
    odometry.header = {stamp_ns, "map"};
    odometry.pose.x_m = 30 * double(stamp_ns) * 1e-9;
    odometry.vx_mps = 30;
    out.push_back({topic, io::kOdometryName, io::encode_odometry(odometry), stamp_ns});
  }
  return out;
}

void write_mcap(const std::string& path, const std::vector<Recorded>& messages, const io::McapOptions& options) {
  io::McapWriter log(path, options);
  std::map<std::string, uint16_t> channels;
  for (const Recorded& message : messages) {
    if (!channels.contains(message.topic)) {
      const bool cloud = message.type == io::kPointCloud2Name;
      const uint16_t schema =
          log.add_schema(message.type, "ros2msg", cloud ? io::kPointCloud2Schema : io::kOdometrySchema);
      channels[message.topic] = log.add_channel(schema, message.topic, "cdr");
    }
    log.write(channels[message.topic], message.stamp_ns, message.data);
  }
  log.close();
}

void write_db3(const std::string& path, const std::vector<Recorded>& messages) {
  std::remove(path.c_str());
  sqlite3* db = nullptr;
  const auto check = [&](int code) {
    if (code != SQLITE_OK && code != SQLITE_DONE) throw std::runtime_error(sqlite3_errmsg(db));
  };
  check(sqlite3_open(path.c_str(), &db));
  check(sqlite3_exec(
      db,
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
      "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
      "data BLOB NOT NULL); BEGIN",
      nullptr, nullptr, nullptr));
  std::map<std::string, int64_t> topics;
  const auto bind = [&](const char* sql, auto&& f) {
    sqlite3_stmt* statement = nullptr;
    check(sqlite3_prepare_v2(db, sql, -1, &statement, nullptr));
    f(statement);
    check(sqlite3_step(statement));
    sqlite3_finalize(statement);
  };
  for (const Recorded& message : messages) {
    if (!topics.contains(message.topic)) {
      const int64_t id = topics[message.topic] = int64_t(topics.size()) + 1;
      bind("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", [&](sqlite3_stmt* s) {
        sqlite3_bind_int64(s, 1, id);
        sqlite3_bind_text(s, 2, message.topic.c_str(), -1, SQLITE_TRANSIENT);
        sqlite3_bind_text(s, 3, message.type.c_str(), -1, SQLITE_TRANSIENT);
      });
    }
    bind("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", [&](sqlite3_stmt* s) {
      sqlite3_bind_int64(s, 1, topics[message.topic]);
      sqlite3_bind_int64(s, 2, message.stamp_ns);
      sqlite3_bind_blob(s, 3, message.data.data(), int(message.data.size()), SQLITE_TRANSIENT);
    });
  }
  check(sqlite3_exec(db, "COMMIT", nullptr, nullptr, nullptr));
  sqlite3_close(db);
}

namespace {

struct RunHash {
  cli::ResultHash hash;
  int64_t frames = 0, detections = 0;
  static void add(ovt_reader* reader, void* user) {
    auto& self = *static_cast<RunHash*>(user);
    ovt_frame_info info;
    ovt_detections detections;
    ovt_tracks tracks;
    if (ovt_read_info(reader, &info) || ovt_read_detections(reader, &detections) ||
        ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks))
      return;
    self.hash.add(info, detections, tracks);
    ++self.frames;
    self.detections += detections.count;
  }
};

}  // namespace

uint64_t hash_of_run(const std::string& input, const io::Rig& rig, const std::string& ego_csv, int64_t* frames,
                     int64_t* detections) {
  cli::Config config;
  ovt_params_init(&config.params, sizeof config.params, "paper");
  config.rig = rig;
  config.has_rig = true;
  config.ego = ego_csv;
  RunHash run;
  cli::Session session(config, &RunHash::add, &run);
  const auto stream = io::open_scans(input, rig);
  io::FrameScans frame;
  while (stream->next(frame)) {
    if (ego_csv.empty()) session.add_ego(stream->take_ego());
    session.push(frame);
  }
  session.flush();
  if (frames) *frames = run.frames;
  if (detections) *detections = run.detections;
  return run.hash.value();
}

}  // namespace overtake::test
