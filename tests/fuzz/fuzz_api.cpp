// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The whole C API in any order: a detector with any small def; any pushes, times and readers; then destroy. Reads every
// public output of every frame, which must satisfy tests/support/frame_rules.h; the sums of the counters must match.
// Images of 4 x 16 pixels and short runs, so that many fit in a second.
#include <cmath>

#include "tests/fuzz/small_detector.h"

using namespace overtake::fuzz;

namespace {

constexpr double kPlaces[] = {0.0,  1e-310, -1e-30, 1e3,    1e6,     1e8,      -1e8,      1.00001e8,
                              1e15, 1e38,   1e300,  -1e300, 1.7e308, HUGE_VAL, -HUGE_VAL, NAN};
// Mostly a multiple of `unit` from -128 to 127, else any number.
double draw_number(Bytes& in, double unit, bool wild) {
  const auto small = int8_t(in.byte());
  if (!wild || small % 4 != 0) return unit * small;
  const uint8_t which = in.byte();
  return which < 64 ? in.raw<double>() : kPlaces[which % std::size(kPlaces)];
}

struct Story {
  explicit Story(Bytes& bytes) : in(bytes) {}

  void draw_sensor(int32_t s) {
    ovt_sensor_def& sensor = sensors[s] = ovt_default_sensor_def();
    const uint8_t shape = in.byte();
    sensor.rows = 1 + shape % 4, sensor.cols = 1 + shape / 4 % 16;
    sensor.wraps = shape >= 192;
    sensor.yaw_rad = 2.0943951023931953 * s;
    sensor.z_m = 1.0;
    sensor.point_capacity = 40;
    if (!in.chance(12)) return;
    double* const fields[] = {&sensor.x_m,
                              &sensor.y_m,
                              &sensor.z_m,
                              &sensor.roll_rad,
                              &sensor.pitch_rad,
                              &sensor.yaw_rad,
                              &sensor.azimuth_left_rad,
                              &sensor.azimuth_right_rad,
                              &sensor.range_min_m,
                              &sensor.range_max_m};
    *fields[in.byte() % std::size(fields)] = draw_number(in, 0.1, true);
    if (in.chance(64)) sensor.layer_first = in.raw<int32_t>();
  }

  void draw_map() {
    const uint8_t kind = in.byte();
    if (kind < 100) return;
    map = ovt_default_map_def();
    map.closed = kind & 1;
    map.count = 4;
    static constexpr double kX[2][4] = {{-200, 0, 60, 300}, {-40, 40, 40, -40}};
    static constexpr double kY[2][4] = {{0, 0, 0, 10}, {-40, -40, 40, 40}};
    for (int32_t i = 0; i < 4; ++i) {
      map_x[i] = kX[map.closed][i], map_y[i] = kY[map.closed][i];
      map_left[i] = map_right[i] = kind % 16;
    }
    if (kind >= 250) (kind & 2 ? map_x : map_left)[kind % 4] = draw_number(in, 1.0, true);
    map.x_m = map_x, map.y_m = map_y, map.width_left_m = map_left, map.width_right_m = map_right;
    def.map = &map;
  }

  bool create() {
    def = ovt_default_detector_def();
    ovt_params_init(&params, sizeof params, draw_preset(in));
    params.tracker_confirm_hits = 2, params.tracker_keep_hits = 1;
    params.tracker_horizon_s = 0.2;
    const uint8_t head = in.byte();
    def.sensor_count = head % 4;
    for (int32_t s = 0; s < def.sensor_count; ++s) draw_sensor(s);
    def.sensors = sensors;
    draw_map();
    if (head & 4) {
      params.tracker_max_silence_s = 0.3;
      params.gate_min_points = 2;
      params.gate_ego_margin_m = in.byte();
      params.gate_map_margin_m = int8_t(in.byte());
    }
    if (head >= 240) {  // a parameter anywhere within its limits
      ovt_param_info info;
      ovt_describe_param(in.byte() % ovt_param_count(), &info);
      const double share = in.byte() / 255.0, value = info.value_min + share * (info.value_max - info.value_min);
      char text[32];
      std::snprintf(text, sizeof text, info.is_integer ? "%.0f" : "%.9g", value);
      if (std::strstr(info.name, "horizon") == nullptr) ovt_set_param(&params, info.name, text);
    }
    def.params = &params;
    static const char* const kIsas[] = {"ref", "sse2", "avx2", nullptr};
    def.isa = kIsas[head / 8 % 4];
    def.push_policy = head / 32 % 2;
    def.keep_images = head / 64 % 2;
    const uint8_t sizes = in.byte();
    static constexpr int32_t kCapacity[] = {1, 2, 6, 17};
    def.cluster_capacity = kCapacity[sizes % 4];
    def.candidate_capacity = kCapacity[sizes / 4 % 4];
    def.track_capacity = kCapacity[sizes / 16 % 4];
    def.frames_in_flight = 1;
    def.reader_capacity = sizes / 64 % 2;
    def.ego_pose_capacity = 1;
    push_rows = sizes / 16 % 4;
    def.deadline_ns = sizes / 128;
    def.alloc = BlockPool::take;
    def.free = BlockPool::give;
    def.user = this;
    def.on_frame = [](ovt_reader* lent, void* user) { static_cast<Story*>(user)->see(lent); };
    const ovt_status status = ovt_create_detector(&def, &detector);
    OVT_FUZZ_REQUIRE((status == OVT_OK) == (detector != nullptr));
    return detector != nullptr;
  }

  void see(ovt_reader* lent) {
    OVT_FUZZ_REQUIRE(ovt_read_info(lent, &last) == OVT_OK);
    OVT_FUZZ_REQUIRE(last.sequence == frames++);
    check_frame(lent, def.sensor_count, def.map != nullptr, publish_ns);
    OVT_FUZZ_REQUIRE(ovt_next_frame(lent, nullptr) == OVT_NO_FRAME);
  }

  void push_scan() {
    const uint8_t kind = in.byte();
    const bool wild = kind & 8;
    const int32_t sensor = kind % 4;
    static constexpr int32_t kCounts[] = {0, 8, 24, 40};
    const int32_t count = kind >= 248 ? 41 : kCounts[kind / 16 % 4], cols = sensors[sensor].cols;
    const double half = sensors[sensor].wraps ? 3.1415 : 1.047;
    const int32_t post = 1 + in.byte() % 8, near = 4 + in.byte() % 32;
    for (int32_t i = 0; i < count; ++i) {
      const int32_t column = i / 4 % std::max(cols, 1);
      const double azimuth = half - 2 * half * (column + 0.5) / std::max(cols, 1);
      const double range = near + (column / post % 2 ? 9.0 : 0.0);
      const double up = range * (0.1 - 0.03 * (i % 4));
      point[i] = {{float(range * std::cos(azimuth)), float(range * std::sin(azimuth)), float(up), 0.02f * float(i % 3)},
                  uint16_t(i % 4)};
      if (wild && i % 4 == 0) point[i].value[in.byte() % 4] = float(draw_number(in, 0.5, true));
    }
    ovt_points scan;
    ovt_points_init(&scan, sizeof scan);
    scan.sensor = sensor, scan.count = count, scan.stamp_ns = stamp_ns;
    const auto field = [&](const void* at, int32_t type) {
      const auto offset = std::size_t(static_cast<const char*>(at) - reinterpret_cast<const char*>(point));
      return ovt_column{at, sizeof point - offset, sizeof point[0], type};
    };
    const float* const value = point[0].value;
    scan.x = field(value, OVT_F32), scan.y = field(value + 1, OVT_F32), scan.z = field(value + 2, OVT_F32);
    scan.layer = field(&point[0].layer, OVT_U16);
    if (kind & 128) scan.time = scan.intensity = field(value + 3, OVT_F32);
    scan.time_unit_ns = wild ? draw_number(in, 1e8, true) : 1e9;
    const int64_t before = stats_of(detector).pushed;
    const ovt_status status = ovt_push_scan(detector, &scan);
    const int64_t counted = stats_of(detector).pushed - before;
    OVT_FUZZ_REQUIRE(counted == (status == OVT_OK || status == OVT_DUPLICATE) ||
                     (counted == 1 && status == OVT_TOO_MANY));
    scans += counted;
  }

  void push_pose() {
    const bool wild = in.chance(96);
    ovt_ego_pose pose;
    ovt_ego_pose_init(&pose, sizeof pose);
    pose.stamp_ns = stamp_ns;
    pose.x_m = draw_number(in, 1.0, wild);
    pose.y_m = draw_number(in, 0.25, wild);
    pose.yaw_rad = draw_number(in, 0.025, wild);
    pose.speed_mps = draw_number(in, 1.0, wild);
    if (wild)
      for (double* field : {&pose.z_m, &pose.roll_rad, &pose.pitch_rad, &pose.yaw_rate_rps})
        *field = draw_number(in, 0.01, true);
    const ovt_status status = ovt_push_ego_pose(detector, &pose);
    poses += status == OVT_OK || status == OVT_DUPLICATE || status == OVT_LATE;
  }

  void push_detections() {
    const uint8_t kind = in.byte();
    const bool wild = kind & 8;
    ovt_external_detections d;
    ovt_external_detections_init(&d, sizeof d);
    d.stamp_ns = stamp_ns;
    d.count = push_rows;
    d.reference = kind / 4 % 2;
    const int32_t columns = kind & 16 ? 6 : 2;
    for (int32_t c = 0; c < columns; ++c)
      for (int32_t i = 0; i < d.count; ++i) row[c][i] = draw_number(in, c < 2 ? 0.5 : 0.05, wild);
    d.x_m = row[0], d.y_m = row[1];
    if (columns == 6) {
      if (kind & 32) d.heading_rad = row[2];
      if (kind & 64) d.var_x = row[3], d.var_y = row[4];
      if (kind & 128) d.cov_xy = row[5];
      if (kind & 1) d.length_m = row[3], d.width_m = row[4], d.height_m = row[5], d.score = row[2];
    }
    const ovt_status status = ovt_push_detections(detector, &d);
    externals += status == OVT_OK || status == OVT_DUPLICATE || status == OVT_LATE || status == OVT_TOO_MANY;
  }

  void read() {
    if (!reader && ovt_create_reader(detector, &reader) != OVT_OK) return;
    ovt_frame_info info;
    const ovt_status status = ovt_next_frame(reader, &info);
    if (status == OVT_OK) stands = true;
    OVT_FUZZ_REQUIRE(status == OVT_OK || status == OVT_NO_FRAME);
    OVT_FUZZ_REQUIRE((ovt_read_info(reader, &info) == OVT_OK) == stands);
    if (stands) check_frame(reader, def.sensor_count, def.map != nullptr, publish_ns);
    if (in.chance(40)) {
      ovt_destroy_reader(reader);
      reader = nullptr;
      stands = false;
    }
  }

  void act() {
    const uint8_t what = in.byte();
    if (what % 8 < 5) stamp_ns = next_stamp(in, stamp_ns);
    // Sometimes far in the future, where a prediction costs a thousand steps per track.
    publish_ns = what < 240 ? int64_t(uint64_t(stamp_ns) + 40'000'000u) : int64_t(uint64_t(what) << 55);
    switch (what / 8 % 16) {
      case 9:
      case 10:
      case 11: return push_pose();
      case 12: return push_detections();
      case 13: OVT_FUZZ_REQUIRE(ovt_advance(detector, stamp_ns) == OVT_OK); return;
      case 14: return read();
      case 15:
        if (what < 128) {
          OVT_FUZZ_REQUIRE(ovt_flush(detector) == OVT_OK);
        } else {
          ovt_runtime_info info;
          OVT_FUZZ_REQUIRE(ovt_read_runtime_info(detector, &info) == OVT_OK && info.worker_count == 1);
        }
        return;
      default: return push_scan();
    }
  }

  void end() {
    OVT_FUZZ_REQUIRE(ovt_flush(detector) == OVT_OK);
    const ovt_stats s = stats_of(detector);
    // A prediction does not show tracks that are silent for too long, but they may exist.
    const bool all_shown = frames > 0 && (last.flags & (OVT_FLAG_PREDICTION | OVT_FLAG_EGO_STALE)) == 0;
    const char* broken = overtake::test::find_broken_sum(s,
                                                         frames == 0 ? 0
                                                         : all_shown ? last.track_count
                                                                     : -1,
                                                         s.external * push_rows);
    if (broken) std::fprintf(stderr, "the sum: %s\n", broken);
    OVT_FUZZ_REQUIRE(broken == nullptr);
    OVT_FUZZ_REQUIRE(s.pushed == scans);
    OVT_FUZZ_REQUIRE(s.ego_poses + s.ego_dropped == poses);
    OVT_FUZZ_REQUIRE(s.external + s.external_dropped == externals);
    OVT_FUZZ_REQUIRE(s.frames == frames && s.in_flight == 0);
    OVT_FUZZ_REQUIRE(s.exceptions == 0);
    ovt_destroy_detector(detector);
    if (stands) check_frame(reader, def.sensor_count, def.map != nullptr, publish_ns);
    if (reader) OVT_FUZZ_REQUIRE(ovt_next_frame(reader, nullptr) == OVT_NO_FRAME);
    ovt_destroy_reader(reader);
  }

  Bytes& in;
  ovt_sensor_def sensors[4] = {};
  ovt_map_def map;
  double map_x[4], map_y[4], map_left[4], map_right[4];
  ovt_params params;
  ovt_detector_def def;
  ovt_detector* detector = nullptr;
  ovt_reader* reader = nullptr;
  bool stands = false;  // the reader is positioned at a frame
  ovt_frame_info last{};
  int64_t stamp_ns = 1'000'000'000, publish_ns = 0;
  int64_t frames = 0, scans = 0, poses = 0, externals = 0;
  int32_t push_rows = 0;  // rows per push: one push may still be pending, so only the number of used pushes is known
  struct {
    float value[4];  // x, y, z, time
    uint16_t layer;
  } point[41];
  double row[6][3];
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  Bytes in(data, size);
  Story story(in);
  if (!story.create()) return 0;
  for (int32_t step = 0; step < 64 && !in.empty(); ++step) story.act();
  story.end();
  return 0;
}
