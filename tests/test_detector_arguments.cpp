// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Inputs of the C API: bad arguments and their messages, capacities, allocators, callbacks.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/overtake.hpp"
#include "tests/support/one_sensor_detector.h"

using namespace overtake::test;

namespace {

constexpr int64_t kMs = 1'000'000;

}  // namespace

TEST_CASE("detector: the def limits the number of readers, and destroying one makes room") {
  Small small;
  small.def.reader_capacity = 2;
  small.create();
  ovt_reader *a = nullptr, *b = nullptr, *c = nullptr;
  CHECK(ovt_create_reader(small.detector, &a) == OVT_OK);
  CHECK(ovt_create_reader(small.detector, &b) == OVT_OK);
  CHECK(ovt_create_reader(small.detector, &c) == OVT_TOO_MANY);
  CHECK(c == nullptr);
  ovt_destroy_reader(a);
  CHECK(ovt_create_reader(small.detector, &c) == OVT_OK);
  ovt_destroy_reader(b);
  ovt_destroy_reader(c);
  ovt_destroy_reader(nullptr);
}

TEST_CASE("detector: a reader computes as much of the paths as it asks for") {
  const Posts posts(50);
  const ovt_points points = posts.points(0);
  Small small;
  small.create();
  ovt_reader *reader = nullptr, *other = nullptr;
  REQUIRE(ovt_create_reader(small.detector, &reader) == OVT_OK);
  REQUIRE(ovt_create_reader(small.detector, &other) == OVT_OK);
  CHECK(ovt_set_path_horizon(nullptr, 1.0) == OVT_BAD_ARGUMENT);
  CHECK(ovt_set_path_horizon(reader, 1.24) == OVT_OK);  // before the first frame
  REQUIRE(ovt_push_scan(small.detector, &points) == OVT_OK);
  REQUIRE(ovt_next_frame(reader, nullptr) == OVT_OK);
  REQUIRE(ovt_next_frame(other, nullptr) == OVT_OK);
  ovt_tracks whole, part;
  REQUIRE(ovt_read_tracks(other, OVT_AT_FRAME_STAMP, &whole) == OVT_OK);
  CHECK(whole.path_points == 30);  // the default: 3 s, 0.1 s apart
  REQUIRE(whole.count > 2);
  const auto compare = [&](int32_t point_count) {
    REQUIRE(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &part) == OVT_OK);
    CHECK(part.path_points == point_count);
    CHECK(part.path_step_s == 0.1);
    REQUIRE(part.count == whole.count);
    bool same = true;
    for (int32_t i = 0; i < part.count; ++i) {
      same &= part.x_m[i] == whole.x_m[i] && part.id[i] == whole.id[i];
      for (int32_t k = 0; k < point_count; ++k) {
        const auto a = std::size_t(i * point_count + k), b = std::size_t(i * 30 + k);
        same &= part.path_x_m[a] == whole.path_x_m[b] && part.path_var_y[a] == whole.path_var_y[b];
      }
    }
    CHECK(same);
  };
  compare(12);
  for (const double bad : {-1e-9, -1.0, 3.0000001, 1e300, double(INFINITY), double(NAN)})
    CHECK(ovt_set_path_horizon(reader, bad) == OVT_BAD_ARGUMENT);
  compare(12);  // as before
  for (const auto& [horizon_s, point_count] :
       std::map<double, int32_t>{{0.0, 0}, {0.04, 0}, {0.06, 1}, {2.5, 25}, {3.0, 30}}) {
    CAPTURE(horizon_s);
    CHECK(ovt_set_path_horizon(reader, horizon_s) == OVT_OK);
    compare(point_count);
  }
  ovt_destroy_reader(reader);
  ovt_destroy_reader(other);
}

TEST_CASE("detector: the reader of on_frame keeps its path horizon for the next frames") {
  const Posts posts(50);
  ovt_points points = posts.points(0);
  static std::vector<int32_t> path_points;
  path_points.clear();
  Small small;
  small.def.on_frame = [](ovt_reader* reader, void*) {
    ovt_tracks tracks;
    if (ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks) == OVT_OK) path_points.push_back(tracks.path_points);
    if (path_points.size() == 2) ovt_set_path_horizon(reader, 0.5);
  };
  small.create();
  for (int k = 0; k < 4; ++k) {
    points.stamp_ns = 100 * kMs * (k + 1);
    REQUIRE(ovt_push_scan(small.detector, &points) == OVT_OK);
  }
  CHECK(path_points == std::vector<int32_t>{30, 30, 5, 5});
}

TEST_CASE("detector: capacities keep the nearest, count the rest and set the flag") {
  const Posts posts(50);
  const ovt_points points = posts.points(0);
  for (const int32_t kind : {0, 1, 2}) {
    CAPTURE(kind);
    Small small;
    if (kind == 0) small.def.cluster_capacity = 16;
    if (kind == 1) small.def.candidate_capacity = 16;
    if (kind == 2) small.def.track_capacity = 16;
    small.create();
    REQUIRE(ovt_push_scan(small.detector, &points) == OVT_OK);
    const ovt_stats stats = small.stats();
    CHECK((small.latest.info.flags & OVT_FLAG_OVERFLOW) != 0);
    CHECK((stats.overflow_clusters > 0) == (kind == 0));
    CHECK(stats.overflow_candidates == (kind == 1 ? small.latest.info.candidate_count - 16 : 0));
    CHECK(stats.overflow_tracks == (kind == 2 ? small.latest.info.candidate_count - 16 : 0));
    CHECK((kind == 0 || small.latest.info.candidate_count > 32));
    CHECK(small.latest.info.track_count == 16);
    const ovt_tracks tracks = small.next_tracks();
    for (int32_t i = 0; i < tracks.count; ++i) CHECK(std::hypot(tracks.x_m[i], tracks.y_m[i]) < 29);
  }
}

TEST_CASE("detector: capacities that are not multiples of 16 hold exactly") {
  const Posts posts(50);
  const ovt_points points = posts.points(0);
  Small small;
  small.def.candidate_capacity = 5;
  small.create();
  REQUIRE(ovt_push_scan(small.detector, &points) == OVT_OK);
  CHECK(small.latest.info.detection_count == 5);
  CHECK(small.stats().overflow_candidates == small.latest.info.candidate_count - 5);
  CHECK(small.stats().overflow_tracks == 0);  // every detection finds a track
  CHECK(small.latest.info.track_count == 5);
}

TEST_CASE("detector: merged clusters beyond the capacity are counted, also when each sensor's clusters fit") {
  const Posts posts(12);
  const auto run = [&](int32_t capacity, int32_t& clusters) {
    Small small;
    ovt_sensor_def sensors[2] = {small.sensor, small.sensor};
    sensors[1].yaw_rad = 3.14159265358979323846;
    small.def.sensors = sensors;
    small.def.sensor_count = 2;
    small.def.cluster_capacity = capacity;
    small.create();
    for (int32_t s = 0; s < 2; ++s) {
      ovt_points points = posts.points(0);
      points.sensor = s;
      REQUIRE(ovt_push_scan(small.detector, &points) == OVT_OK);
    }
    REQUIRE(small.latest.calls == 1);
    clusters = small.latest.info.cluster_count;
    CHECK(((small.latest.info.flags & OVT_FLAG_OVERFLOW) != 0) == (small.stats().overflow_clusters > 0));
    return small.stats().overflow_clusters;
  };
  int32_t all = 0, kept = 0;
  CHECK(run(64, all) == 0);
  REQUIRE(all > 16);  // of both sensors
  REQUIRE(all / 2 <= 16);
  CHECK(run(16, kept) == all - 16);
  CHECK(kept == 16);
}

TEST_CASE("detector: a scan with one point too many is refused, and counted as pushed and dropped") {
  const Posts posts(4);
  const ovt_points points = posts.points(50);
  for (const int32_t workers : {1, 2}) {
    Small small(1, workers);
    small.sensor.point_capacity = points.count - 1;
    small.create();
    CHECK(ovt_push_scan(small.detector, &points) == OVT_TOO_MANY);
    ovt_stats stats = small.stats();
    CHECK(stats.pushed == 1);
    CHECK(stats.dropped == 1);
    ovt_points fits = points;
    fits.count -= 1;
    CHECK(ovt_push_scan(small.detector, &fits) == OVT_OK);  // the refused scan's stamp is not used up
    CHECK(ovt_flush(small.detector) == OVT_OK);
    stats = small.stats();
    CHECK(stats.used == 1);
    CHECK(adds_up(stats));
  }
}

TEST_CASE("detector: every status has a unique text, and the build describes itself") {
  std::set<std::string> texts;
  for (int32_t status = OVT_OK; status <= OVT_NOT_KEPT; ++status) texts.insert(ovt_status_text(ovt_status(status)));
  CHECK(texts.size() == OVT_NOT_KEPT + 1);
  REQUIRE(ovt_status_text(ovt_status(15)));
  CHECK(texts.count(ovt_status_text(ovt_status(15))) == 0);

  ovt_build_info build{};
  ovt_read_build_info(&build);
  CHECK(build.version == OVT_VERSION);
  CHECK(std::string(build.version_text) == std::to_string(OVT_VERSION_MAJOR) + "." + std::to_string(OVT_VERSION_MINOR) +
                                               "." + std::to_string(OVT_VERSION_PATCH));
  CHECK(std::string(build.commit) != "");
  CHECK(std::string(build.compiler) != "");
  CHECK(std::string(build.isas).rfind("ref", 0) == 0);
  // A program that was built with a newer header: what the library does not know is 0.
  struct {
    ovt_build_info known;
    const char* later;
  } newer;
  std::memset(&newer, 0xff, sizeof newer);
  ovt_read_build_info_sized(&newer.known, sizeof newer);
  CHECK(newer.known.version == OVT_VERSION);
  CHECK(newer.known.version_text == build.version_text);
  CHECK(newer.later == nullptr);
}

TEST_CASE("detector: an exception from the callback is counted, and the next frame works") {
  struct Thrower {
    static void throws(ovt_reader*, void*) { throw std::runtime_error("from the callback"); }
  };
  for (const int32_t workers : {1, 2}) {
    Small small(1, workers);
    small.def.on_frame = Thrower::throws;
    small.create();
    const Posts posts(2);
    for (int64_t k = 0; k < 10; ++k) {
      const ovt_points points = posts.points(k * 50 * kMs);
      CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);
    }
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK(small.stats().frames == 10);
    CHECK(small.stats().exceptions == 10);
  }
}

TEST_CASE("detector: the log contains the choices of create, missing inputs, and every caught exception") {
  struct Listener {
    std::vector<std::string> lines;
    static void hear(ovt_log_level level, const char* text, void* user) {
      static_cast<Listener*>(user)->lines.push_back(std::to_string(level) + " " + text);
    }
    static void throws_log(ovt_log_level, const char*, void*) { throw std::runtime_error("from the log"); }
    static void throws(ovt_reader*, void*) { throw std::runtime_error("from the callback"); }
  };
  for (const bool log_throws : {false, true}) {
    Listener listener;
    Small small(1, 1);
    small.def.isa = "ref";
    small.def.user = &listener;
    small.def.log = log_throws ? Listener::throws_log : Listener::hear;
    small.def.on_frame = Listener::throws;
    small.create();
    const Posts posts(2);
    const ovt_points points = posts.points(0);
    CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK(small.stats().exceptions == 1);
    if (log_throws) continue;
    CHECK(listener.lines == std::vector<std::string>{"2 isa ref, 1 worker",
                                                     "1 no map: no map gate, psi_REF is the ego heading",
                                                     "0 on_frame threw an exception"});
  }
}

TEST_CASE("detector: a create that fails tells the log why, with the point of a map that is wrong") {
  for (const bool log_throws : {false, true}) {
    std::vector<std::string> lines;
    Small small(1, 1);
    const double x[] = {0, 50, 50, 0}, y[] = {0, 0, 50, 50}, left[] = {5, 5, -5, 5}, right[] = {5, 5, 5, 5};
    ovt_map_def map = ovt_default_map_def();
    map.x_m = x, map.y_m = y, map.width_left_m = left, map.width_right_m = right, map.count = 4, map.closed = 1;
    small.def.map = &map;
    small.def.user = &lines;
    small.def.log = [](ovt_log_level level, const char* text, void* user) {
      static_cast<std::vector<std::string>*>(user)->push_back(std::to_string(level) + " " + text);
    };
    if (log_throws) small.def.log = [](ovt_log_level, const char*, void*) { throw std::runtime_error("from the log"); };
    ovt_detector* detector = nullptr;
    char error[200] = "";
    CHECK(ovt_create_detector_verbose(&small.def, &detector, error, sizeof error) == OVT_BAD_ARGUMENT);
    CHECK(detector == nullptr);
    CHECK(std::string(error) == "map: a track map's width is negative (point 2, from 0)");
    if (!log_throws) CHECK(lines == std::vector<std::string>{std::string("0 ") + error});
  }
}

TEST_CASE("detector: many creates and destroys, with any refused block, free all memory") {
  struct Heap {
    int64_t bytes = 0;
    int32_t left = 0;
    static void* take(size_t size, size_t alignment, void* user) {
      auto* heap = static_cast<Heap*>(user);
      if (heap->left-- <= 0) return nullptr;
      heap->bytes += int64_t(size);
      return std::aligned_alloc(alignment, size);
    }
    static void give(void* block, size_t size, void* user) {
      static_cast<Heap*>(user)->bytes -= int64_t(size);
      std::free(block);
    }
  };
  int32_t created = 0, refused = 0;
  for (int32_t allowed = 0; allowed < 100; ++allowed) {
    Heap heap;
    heap.left = allowed;
    ovt_sensor_def sensor = ovt_default_sensor_def();
    sensor.rows = 8, sensor.cols = 64, sensor.point_capacity = 512;
    ovt_detector_def def = ovt_default_detector_def();
    def.sensors = &sensor;
    def.sensor_count = 1;
    def.worker_count = allowed % 2 ? 2 : 1;
    def.cluster_capacity = def.candidate_capacity = def.track_capacity = 16;
    def.alloc = Heap::take;
    def.free = Heap::give;
    def.user = &heap;
    ovt_detector* detector = nullptr;
    const ovt_status status = ovt_create_detector(&def, &detector);
    CHECK((status == OVT_OK || status == OVT_NO_MEMORY));
    CHECK((status == OVT_OK) == (detector != nullptr));
    (status == OVT_OK ? created : refused) += 1;
    if (detector) {
      ovt_points empty;
      ovt_points_init(&empty, sizeof empty);
      empty.x.type = empty.y.type = empty.z.type = OVT_F32;
      empty.layer.type = OVT_U8;
      ovt_push_scan(detector, &empty);
      ovt_reader* reader = nullptr;
      const ovt_status got = ovt_create_reader(detector, &reader);
      CHECK((got == OVT_OK || got == OVT_NO_MEMORY));
      ovt_destroy_reader(reader);
    }
    ovt_destroy_detector(detector);
    CHECK(heap.bytes == 0);
  }
  CHECK(refused > 3);
  CHECK(created > 50);
  ovt_destroy_detector(nullptr);
}

TEST_CASE("detector: an exception of alloc counts as no memory, at create and for a reader") {
  struct Heap {
    int32_t left = 0, blocks = 0;
    static void* take(size_t size, size_t alignment, void* user) {
      auto* heap = static_cast<Heap*>(user);
      if (heap->left-- <= 0) throw std::runtime_error("no memory");
      ++heap->blocks;
      return std::aligned_alloc(alignment, size);
    }
    static void give(void* block, size_t, void* user) {
      --static_cast<Heap*>(user)->blocks;
      std::free(block);
    }
  } heap;
  Small small;
  small.def.alloc = Heap::take;
  small.def.free = Heap::give;
  small.def.user = &heap;
  small.def.on_frame = nullptr;
  CHECK(ovt_create_detector(&small.def, &small.detector) == OVT_NO_MEMORY);
  CHECK(small.detector == nullptr);
  heap.left = 1000;
  small.create();
  heap.left = 0;
  ovt_reader* reader = nullptr;
  CHECK(ovt_create_reader(small.detector, &reader) == OVT_NO_MEMORY);
  CHECK(reader == nullptr);
  ovt_destroy_detector(small.detector);
  small.detector = nullptr;
  CHECK(heap.blocks == 0);
}

TEST_CASE("detector: a def that is bound to a second handler calls nothing of the first") {
  struct Everything {
    void on_frame(ovt::FrameView) noexcept {}
    void log(ovt_log_level, std::string_view) noexcept {}
    void* allocate(size_t, size_t) noexcept { return nullptr; }
    void release(void*, size_t) noexcept {}
  } everything;
  struct Frames {
    void on_frame(ovt::FrameView) noexcept {}
  } frames;
  struct Lines {
    void log(ovt_log_level, std::string_view) noexcept {}
  } lines;
  ovt_detector_def def = ovt_default_detector_def();
  ovt::bind(def, everything);
  CHECK((def.on_frame && def.log && def.alloc && def.free && def.user == &everything));
  ovt::bind(def, frames);
  CHECK((def.on_frame && !def.log && !def.alloc && !def.free && def.user == &frames));
  ovt::bind(def, lines);
  CHECK((!def.on_frame && def.log && !def.alloc && !def.free && def.user == &lines));
}

TEST_CASE("detector: every bad scan gets its status, and nothing changes") {
  Small small;
  small.sensor.point_capacity = 100;
  small.create();
  const Posts posts(4);  // 96 points
  using Spoil = void (*)(ovt_points&);
  struct Row {
    const char* what;
    Spoil spoil;
    ovt_status status;
  };
  static char bytes[4096];
  const Row rows[] = {
      {"struct_size 0", [](ovt_points& p) { p.struct_size = 0; }, OVT_BAD_VERSION},
      {"struct_size of another library", [](ovt_points& p) { p.struct_size += 8; }, OVT_BAD_VERSION},
      {"sensor -1", [](ovt_points& p) { p.sensor = -1; }, OVT_BAD_ARGUMENT},
      {"sensor beyond the def", [](ovt_points& p) { p.sensor = 1; }, OVT_BAD_ARGUMENT},
      {"negative count", [](ovt_points& p) { p.count = -1; }, OVT_BAD_ARGUMENT},
      {"one point more than the columns hold", [](ovt_points& p) { p.count = 97; }, OVT_BAD_ARGUMENT},
      {"more points than the sensor's capacity",
       [](ovt_points& p) {
         p.count = 101;
         p.x = p.y = p.z = {bytes, sizeof bytes, 4, OVT_F32};
         p.layer = {bytes, sizeof bytes, 1, OVT_U8};
       },
       OVT_TOO_MANY},
      {"no x", [](ovt_points& p) { p.x.type = OVT_NONE; }, OVT_BAD_ARGUMENT},
      {"no layer", [](ovt_points& p) { p.layer.type = OVT_NONE; }, OVT_BAD_ARGUMENT},
      {"x null", [](ovt_points& p) { p.x.data = nullptr; }, OVT_BAD_ARGUMENT},
      {"y an integer", [](ovt_points& p) { p.y.type = OVT_I32; }, OVT_BAD_ARGUMENT},
      {"z of an unknown type", [](ovt_points& p) { p.z.type = 9; }, OVT_BAD_ARGUMENT},
      {"z of a negative type", [](ovt_points& p) { p.z.type = -1; }, OVT_BAD_ARGUMENT},
      {"intensity of an unknown type", [](ovt_points& p) { p.intensity.type = 99; }, OVT_BAD_ARGUMENT},
      {"intensity null", [](ovt_points& p) { p.intensity.type = OVT_U8; }, OVT_BAD_ARGUMENT},
      {"stride 0", [](ovt_points& p) { p.x.stride = 0; }, OVT_BAD_ARGUMENT},
      {"stride below the type", [](ovt_points& p) { p.x.stride = 2; }, OVT_BAD_ARGUMENT},
      {"a huge stride", [](ovt_points& p) { p.x.stride = SIZE_MAX - 3; }, OVT_BAD_ARGUMENT},
      {"one byte short", [](ovt_points& p) { --p.z.size_bytes; }, OVT_BAD_ARGUMENT},
      {"layer one byte short", [](ovt_points& p) { --p.layer.size_bytes; }, OVT_BAD_ARGUMENT},
      {"no bytes", [](ovt_points& p) { p.x.size_bytes = 0; }, OVT_BAD_ARGUMENT},
      {"time unit not a number", [](ovt_points& p) { p.time_unit_ns = std::nan(""); }, OVT_BAD_ARGUMENT},
      {"time unit infinite", [](ovt_points& p) { p.time_unit_ns = HUGE_VAL; }, OVT_BAD_ARGUMENT},
  };
  for (const Row& row : rows) {
    CAPTURE(row.what);
    ovt_points points = posts.points(0);
    row.spoil(points);
    const ovt_stats before = small.stats();
    CHECK(ovt_push_scan(small.detector, &points) == row.status);
    const int64_t counted = row.status == OVT_TOO_MANY ? 1 : 0;  // this one counts as a scan
    CHECK(small.stats().pushed == before.pushed + counted);
    CHECK(small.stats().dropped == before.dropped + counted);
    CHECK(small.stats().bad_arguments == before.bad_arguments + (row.status == OVT_BAD_ARGUMENT));
  }
  const ovt_points points = posts.points(0);
  CHECK(ovt_push_scan(nullptr, &points) == OVT_BAD_ARGUMENT);
  CHECK(ovt_push_scan(small.detector, nullptr) == OVT_BAD_ARGUMENT);
  CHECK(small.latest.calls == 0);
  CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);  // the same stamp: the bad scans left no trace
  CHECK(small.latest.calls == 1);
}

TEST_CASE("detector: a refused push is counted, and the log has the first one with the name of its argument") {
  const Posts posts(2);
  const auto first_line = [&](auto&& push_wrong) {
    std::vector<std::string> lines;
    Small small;
    small.def.user = &lines;
    small.def.on_frame = nullptr;
    small.def.log = [](ovt_log_level level, const char* text, void* user) {
      if (level == OVT_LOG_ERROR) static_cast<std::vector<std::string>*>(user)->push_back(text);
    };
    small.create();
    for (int32_t i = 1; i <= 3; ++i) {
      CHECK(push_wrong(small.detector) == OVT_BAD_ARGUMENT);
      CHECK(small.stats().bad_arguments == i);
    }
    REQUIRE(lines.size() == 1);
    return lines[0];
  };
  CHECK(first_line([&](ovt_detector* detector) {
          ovt_points points = posts.points(0);
          --points.z.size_bytes;
          return ovt_push_scan(detector, &points);
        }) == "ovt_push_scan: bad argument: z (its type, stride, size_bytes or data)");
  CHECK(first_line([&](ovt_detector* detector) {
          ovt_points points = posts.points(0);
          points.first = -2;
          return ovt_push_points(detector, &points);
        }) == "ovt_push_points: bad argument: first");
  CHECK(first_line([](ovt_detector* detector) { return ovt_end_scan(detector, 7, 0, -1); }) ==
        "ovt_end_scan: bad argument: sensor");
  CHECK(first_line([](ovt_detector* detector) {
          ovt_ego_pose pose;
          ovt_ego_pose_init(&pose, sizeof pose);
          pose.speed_mps = std::nan("");
          return ovt_push_ego_pose(detector, &pose);
        }) == "ovt_push_ego_pose: bad argument: speed_mps");
  CHECK(first_line([](ovt_detector* detector) {
          const double zero = 0;
          ovt_external_detections rows;
          ovt_external_detections_init(&rows, sizeof rows);
          rows.count = 1, rows.x_m = rows.y_m = rows.var_x = &zero;
          return ovt_push_detections(detector, &rows);
        }) == "ovt_push_detections: bad argument: var_x or var_y (one without the other)");
}

TEST_CASE("detector: other bad arguments get their status and change nothing") {
  Small small;
  small.create();
  ovt_detector* detector = small.detector;
  ovt_ego_pose pose;
  ovt_ego_pose_init(&pose, sizeof pose);
  CHECK(ovt_push_ego_pose(nullptr, &pose) == OVT_BAD_ARGUMENT);
  CHECK(ovt_push_ego_pose(detector, nullptr) == OVT_BAD_ARGUMENT);
  for (double ovt_ego_pose::*field :
       {&ovt_ego_pose::x_m, &ovt_ego_pose::y_m, &ovt_ego_pose::z_m, &ovt_ego_pose::roll_rad, &ovt_ego_pose::pitch_rad,
        &ovt_ego_pose::yaw_rad, &ovt_ego_pose::speed_mps, &ovt_ego_pose::yaw_rate_rps}) {
    ovt_ego_pose bad = pose;
    bad.*field = std::nan("");
    CHECK(ovt_push_ego_pose(detector, &bad) == OVT_BAD_ARGUMENT);
  }
  ovt_ego_pose old = pose;
  old.struct_size = 8;
  CHECK(ovt_push_ego_pose(detector, &old) == OVT_BAD_VERSION);
  CHECK(small.stats().ego_poses + small.stats().ego_dropped == 0);

  const double zeros[300] = {};
  ovt_external_detections good;
  ovt_external_detections_init(&good, sizeof good);
  good.count = 1;
  good.x_m = good.y_m = zeros;
  const auto push = [&](auto spoil) {
    ovt_external_detections d = good;
    spoil(d);
    return ovt_push_detections(detector, &d);
  };
  CHECK(ovt_push_detections(nullptr, &good) == OVT_BAD_ARGUMENT);
  CHECK(ovt_push_detections(detector, nullptr) == OVT_BAD_ARGUMENT);
  CHECK(push([](auto& d) { d.struct_size = 0; }) == OVT_BAD_VERSION);
  CHECK(push([](auto& d) { d.count = -1; }) == OVT_BAD_ARGUMENT);
  CHECK(push([](auto& d) { d.count = 300; }) == OVT_TOO_MANY);
  CHECK(push([](auto& d) { d.x_m = nullptr; }) == OVT_BAD_ARGUMENT);
  CHECK(push([](auto& d) { d.y_m = nullptr; }) == OVT_BAD_ARGUMENT);
  CHECK(push([](auto& d) { d.reference = 2; }) == OVT_BAD_ARGUMENT);
  CHECK(push([](auto& d) { d.var_x = d.x_m; }) == OVT_BAD_ARGUMENT);
  for (const double* ovt_external_detections::*column :
       {&ovt_external_detections::x_m, &ovt_external_detections::heading_rad, &ovt_external_detections::score})
    CHECK(push([&](auto& d) {  // not at the address of a double
            d.*column = reinterpret_cast<const double*>(reinterpret_cast<const char*>(zeros) + 4);
          }) == OVT_BAD_ARGUMENT);
  CHECK(small.stats().frames == 0);
  CHECK(push([](auto&) {}) == OVT_OK);
  CHECK(small.stats().frames == 1);

  CHECK(ovt_advance(nullptr, 0) == OVT_BAD_ARGUMENT);
  CHECK(ovt_flush(nullptr) == OVT_BAD_ARGUMENT);
  ovt_stats stats{};
  CHECK(ovt_read_stats(detector, &stats) == OVT_BAD_VERSION);
  CHECK(ovt_read_stats(detector, nullptr) == OVT_BAD_ARGUMENT);
  CHECK(ovt_create_reader(detector, nullptr) == OVT_BAD_ARGUMENT);
  ovt_reader* reader = nullptr;
  CHECK(ovt_create_reader(nullptr, &reader) == OVT_BAD_ARGUMENT);
  REQUIRE(ovt_create_reader(detector, &reader) == OVT_OK);
  ovt_tracks tracks;
  CHECK(ovt_read_tracks(reader, 0, &tracks) == OVT_NO_FRAME);
  REQUIRE(ovt_next_frame(reader, nullptr) == OVT_OK);
  ovt_labels labels;
  ovt_image image;
  int64_t ns = 0;
  CHECK(ovt_read_tracks(nullptr, 0, &tracks) == OVT_BAD_ARGUMENT);
  CHECK(ovt_read_tracks(reader, 0, nullptr) == OVT_BAD_ARGUMENT);
  CHECK(ovt_read_tracks(reader, INT64_MAX, &tracks) == OVT_OK);  // any time is valid
  CHECK(ovt_read_labels(reader, 0, &labels) == OVT_NO_FRAME);    // no scan in this frame
  CHECK(ovt_read_labels(reader, 1, &labels) == OVT_BAD_ARGUMENT);
  CHECK(ovt_read_image(reader, -1, OVT_IMAGE_RANGE, &image) == OVT_BAD_ARGUMENT);
  CHECK(ovt_read_image(reader, 0, OVT_IMAGE_RANGE, &image) == OVT_NO_FRAME);
  CHECK(ovt_read_time(reader, 0, OVT_STAGE_COUNT, &ns) == OVT_BAD_ARGUMENT);
  CHECK(ovt_read_time(reader, 1, OVT_STAGE_LOAD, &ns) == OVT_BAD_ARGUMENT);
  CHECK(ovt_read_time(reader, -1, OVT_STAGE_TRACK, &ns) == OVT_OK);
  CHECK(ns >= 0);
  CHECK(ovt_reason_name(-1) == nullptr);
  CHECK(ovt_image_name(OVT_IMAGE_COUNT) == nullptr);
  CHECK(ovt_stage_name(OVT_STAGE_COUNT) == nullptr);
  ovt_destroy_reader(reader);
}

TEST_CASE("detector: every bad def gets its status and a sentence that names the field") {
  using Spoil = void (*)(Small&);
  struct Row {
    Spoil spoil;
    ovt_status status;
    const char* word;
  };
  static ovt_params params;
  static ovt_map_def map;
  const Row rows[] = {
      {[](Small& s) { s.def.struct_size = 0; }, OVT_BAD_VERSION, "header"},
      {[](Small& s) { s.def.version = 0; }, OVT_BAD_VERSION, "header"},
      {[](Small& s) { s.def.version = OVT_VERSION + 10000; }, OVT_BAD_VERSION, "header"},
      {[](Small& s) { s.def.sensor_count = -1; }, OVT_BAD_ARGUMENT, "sensor_count"},
      {[](Small& s) { s.def.sensor_count = 9; }, OVT_BAD_ARGUMENT, "sensor_count"},
      {[](Small& s) { s.def.sensors = nullptr; }, OVT_BAD_ARGUMENT, "sensors"},
      {[](Small& s) { s.def.worker_count = -1; }, OVT_BAD_ARGUMENT, "worker_count"},
      {[](Small& s) { s.def.push_policy = 2; }, OVT_BAD_ARGUMENT, "push_policy"},
      {[](Small& s) { s.def.cluster_capacity = 0; }, OVT_BAD_ARGUMENT, "cluster_capacity"},
      {[](Small& s) { s.def.candidate_capacity = 0; }, OVT_BAD_ARGUMENT, "candidate_capacity"},
      {[](Small& s) { s.def.track_capacity = 0; }, OVT_BAD_ARGUMENT, "track_capacity"},
      {[](Small& s) { s.def.candidate_capacity = 4097; }, OVT_BAD_ARGUMENT, "candidate_capacity"},
      {[](Small& s) { s.def.track_capacity = 4097; }, OVT_BAD_ARGUMENT, "track_capacity"},
      {[](Small& s) { s.def.frames_in_flight = 0; }, OVT_BAD_ARGUMENT, "frames_in_flight"},
      {[](Small& s) { s.def.reader_capacity = -1; }, OVT_BAD_ARGUMENT, "reader_capacity"},
      {[](Small& s) { s.def.ego_pose_capacity = 0; }, OVT_BAD_ARGUMENT, "ego_pose_capacity"},
      {[](Small& s) { s.def.alloc = [](size_t, size_t, void*) -> void* { return nullptr; }; }, OVT_BAD_ARGUMENT,
       "alloc"},
      {[](Small& s) { s.def.cpu_count = 1; }, OVT_BAD_ARGUMENT, "cpus"},
      {[](Small& s) {
         static const int32_t none = 1023;
         s.def.cpus = &none, s.def.cpu_count = 1;
       },
       OVT_BAD_ARGUMENT, "CPU 1023"},
      {[](Small& s) { s.def.fifo_priority = 100; }, OVT_BAD_ARGUMENT, "fifo_priority"},
      {[](Small& s) { s.def.memory = 8; }, OVT_BAD_ARGUMENT, "memory"},
      {[](Small& s) { s.def.spin_us = -1; }, OVT_BAD_ARGUMENT, "spin_us"},
      {[](Small& s) { s.def.deadline_ns = -1; }, OVT_BAD_ARGUMENT, "deadline_ns"},
      {[](Small& s) { s.def.watchdog_ns = -1; }, OVT_BAD_ARGUMENT, "watchdog_ns"},
      {[](Small& s) { s.def.isa = "mmx"; }, OVT_UNKNOWN_NAME, "mmx"},
      {[](Small& s) { s.def.params = &(params = ovt_default_params()), params.struct_size = 1; }, OVT_BAD_VERSION,
       "params"},
      {[](Small& s) { s.def.params = &(params = ovt_default_params()), params.smooth_window = 4; }, OVT_OUT_OF_RANGE,
       "smooth.window"},
      {[](Small& s) { s.def.map = &(map = ovt_default_map_def()); }, OVT_BAD_ARGUMENT, "map"},
      {[](Small& s) { s.def.map = &(map = ovt_default_map_def()), map.struct_size = 3; }, OVT_BAD_VERSION, "map"},
      {[](Small& s) {
         static const double x[] = {0, 100, 0}, y[] = {0, 0, 100}, wide[] = {5, 5, 5}, degrees[] = {0, 8.5, 0};
         s.def.map = &(map = ovt_default_map_def()), map.count = 3, map.x_m = x, map.y_m = y;
         map.width_left_m = map.width_right_m = wide, map.banking_rad = degrees;
       },
       OVT_BAD_ARGUMENT, "banking_rad is beyond 1 rad (degrees?)"},
      {[](Small& s) { s.sensor.struct_size = 0; }, OVT_BAD_VERSION, "sensors[0]"},
      {[](Small& s) { s.sensor.x_m = std::nan(""); }, OVT_BAD_ARGUMENT, "sensors[0].x_m"},
      {[](Small& s) { s.sensor.yaw_rad = 8; }, OVT_BAD_ARGUMENT, "yaw_rad"},
      {[](Small& s) { s.sensor.roll_rad = 3.14; }, OVT_BAD_ARGUMENT, "sensors[0].roll_rad and pitch_rad"},
      {[](Small& s) { s.sensor.pitch_rad = -1.6; }, OVT_BAD_ARGUMENT, "sensors[0].roll_rad and pitch_rad"},
      {[](Small& s) { s.sensor.rows = 0; }, OVT_BAD_ARGUMENT, "rows"},
      {[](Small& s) { s.sensor.cols = 16385; }, OVT_BAD_ARGUMENT, "cols"},
      {[](Small& s) { s.sensor.azimuth_left_rad = -2; }, OVT_BAD_ARGUMENT, "azimuth"},
      {[](Small& s) { s.sensor.azimuth_left_rad = 1e-40, s.sensor.azimuth_right_rad = 0; }, OVT_BAD_ARGUMENT,
       "1e-6 rad for each column"},
      {[](Small& s) { s.sensor.range_max_m = 0.1; }, OVT_BAD_ARGUMENT, "range_max_m"},
      {[](Small& s) { s.sensor.layer_first = -1; }, OVT_BAD_ARGUMENT, "layer_first"},
      {[](Small& s) { s.sensor.point_capacity = 0; }, OVT_BAD_ARGUMENT, "point_capacity"},
      {[](Small& s) { s.sensor.compensated_to_s = -1.01; }, OVT_BAD_ARGUMENT, "compensated_to_s"},
      {[](Small& s) { s.sensor.compensated_to_s = HUGE_VAL; }, OVT_BAD_ARGUMENT, "compensated_to_s"},
  };
  for (const Row& row : rows) {
    Small small;
    row.spoil(small);
    char error[200] = "untouched";
    auto* out = reinterpret_cast<ovt_detector*>(&small);
    CAPTURE(row.word);
    CHECK(ovt_create_detector_verbose(&small.def, &out, error, sizeof error) == row.status);
    CHECK(out == nullptr);
    CAPTURE(error);
    CHECK(std::strstr(error, row.word) != nullptr);
  }
  Small small;
  ovt_detector* out = nullptr;
  CHECK(ovt_create_detector(nullptr, &out) == OVT_BAD_ARGUMENT);
  CHECK(ovt_create_detector(&small.def, nullptr) == OVT_BAD_ARGUMENT);
  char error[200] = "untouched";
  CHECK(ovt_create_detector_verbose(&small.def, nullptr, error, sizeof error) == OVT_BAD_ARGUMENT);
  CHECK(std::string(error) == "out is null");
  CHECK(ovt_create_detector_verbose(nullptr, &out, error, sizeof error) == OVT_BAD_ARGUMENT);
  CHECK(std::string(error) == "def is null");
  char tiny[4] = "abc";
  small.def.worker_count = -1;
  CHECK(ovt_create_detector_verbose(&small.def, &out, tiny, sizeof tiny) == OVT_BAD_ARGUMENT);
  CHECK(std::strlen(tiny) == 3);
}
