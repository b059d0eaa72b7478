// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Inputs of the C API: bad arguments and their messages.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/one_sensor_detector.h"

using namespace overtake::test;

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
