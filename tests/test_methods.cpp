// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// How a detector selects its method, and its answers for results that the method does not compute.
#include "pipeline/method/methods.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <set>
#include <string>

#include "pipeline/method/frame_rules.h"
#include "tests/support/detector_bench.h"

namespace {

using namespace overtake;
using namespace overtake::test;

// `paper` without its rules about the map.
constexpr FrameRule kWithoutMap[] = {rule::merge_seams, rule::keep_car_sized, rule::keep_nearest,
                                     rule::pose_by_two_headings};
const Method kNoMapRules = [] {
  Method method = *find_method("paper");
  method.name = "no_map_rules";
  method.frame = kWithoutMap;
  return method;
}();
[[maybe_unused]] const bool added = add_method(kNoMapRules);

std::string error_of(const ovt_params& params, ovt_status wanted) {
  DetectorBench bench({});
  bench.def.params = &params;
  char error[256] = "";
  CHECK(ovt_create_detector_verbose(&bench.def, &bench.detector, error, sizeof error) == wanted);
  return error;
}

TEST_CASE("methods: a preset sets its method, and an older or zeroed struct means paper") {
  ovt_params params;
  REQUIRE(ovt_params_init(&params, sizeof params, "plain") == OVT_OK);
  CHECK(std::string(params.method) == "plain");
  CHECK(params.cluster_threshold_rad == 0.1);  // a default of the method
  CHECK(params.gaps_limit_m == 1.0);           // a default that it does not change
  CHECK(std::string(ovt_default_params().method) == "paper");

  const std::size_t older = offsetof(ovt_params, method);
  std::memset(static_cast<void*>(&params), 0xa5, sizeof params);
  REQUIRE(ovt_params_init(&params, older, "paper") == OVT_OK);
  CHECK(params.struct_size == older);
  CHECK(error_of(params, OVT_OK) == "");  // the method is beyond the end of the struct and is not read
  params = ovt_default_params();
  params.method = nullptr;
  CHECK(error_of(params, OVT_OK) == "");
}

TEST_CASE("methods: the error for an unknown method lists the existing ones") {
  ovt_params params = ovt_default_params();
  params.method = "Paper";
  CHECK(error_of(params, OVT_UNKNOWN_NAME) ==
        "params.method \"Paper\" is unknown (there is: " + join_method_names() + ")");
  params.method = "";
  CHECK(error_of(params, OVT_UNKNOWN_NAME) != "");
}

struct Absent {
  const char* preset;
  std::set<int32_t> images, stages;
};
const Absent kAbsent[] = {
    {"paper", {OVT_IMAGE_HEIGHT}, {}},
    {"best", {OVT_IMAGE_ANGLE, OVT_IMAGE_ANGLE_SMOOTH}, {OVT_STAGE_ANGLE, OVT_STAGE_SMOOTH}},
    {"plain",
     {OVT_IMAGE_ANGLE, OVT_IMAGE_ANGLE_SMOOTH, OVT_IMAGE_NONGROUND, OVT_IMAGE_HEIGHT},
     {OVT_STAGE_ANGLE, OVT_STAGE_SMOOTH, OVT_STAGE_REPAIR}},
};

// A reader at the first frame of a detector with the defaults of a preset.
struct FirstFrame {
  explicit FirstFrame(const char* preset, int32_t keep_images = 1) : bench({}) {
    REQUIRE(ovt_params_init(&bench.params, sizeof bench.params, preset) == OVT_OK);
    bench.def.keep_images = keep_images;
    bench.create();
    bench.push_frame(0);
    bench.flush();
    REQUIRE(ovt_create_reader(bench.detector, &reader) == OVT_OK);
    REQUIRE(ovt_next_frame(reader, nullptr) == OVT_OK);
  }
  FirstFrame(const FirstFrame&) = delete;
  ~FirstFrame() { ovt_destroy_reader(reader); }
  DetectorBench bench;
  ovt_reader* reader = nullptr;
};

void check_absent(const Absent& method) {
  for (const int32_t keep_images : {1, 0}) {
    CAPTURE(std::string(method.preset));
    const FirstFrame frame(method.preset, keep_images);
    ovt_reader* const reader = frame.reader;
    for (int32_t id = 0; id < OVT_IMAGE_COUNT; ++id) {
      CAPTURE(id);
      const bool absent = method.images.contains(id);
      const bool kept = keep_images || id == OVT_IMAGE_PIXEL_POINT || id == OVT_IMAGE_HEIGHT;  // rules of best read it
      ovt_image image{};
      CHECK(ovt_read_image(reader, 0, ovt_image_id(id), &image) == (absent ? OVT_NOT_COMPUTED
                                                                    : kept ? OVT_OK
                                                                           : OVT_NOT_KEPT));
      CHECK((image.data != nullptr) == (kept && !absent));
    }
    for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage) {
      CAPTURE(stage);
      const bool absent = method.stages.contains(stage);
      const bool of_frame = stage == OVT_STAGE_FRAME || (stage >= OVT_STAGE_MERGE && stage <= OVT_STAGE_TRACK);
      ovt_span span{};
      int64_t ns = 0;
      CHECK(ovt_read_span(reader, of_frame ? -1 : 0, ovt_stage(stage), &span) == (absent ? OVT_NOT_COMPUTED : OVT_OK));
      CHECK(ovt_read_time(reader, of_frame ? -1 : 0, ovt_stage(stage), &ns) == (absent ? OVT_NOT_COMPUTED : OVT_OK));
      if (!absent && stage != OVT_STAGE_LOAD) CHECK(span.duration_ns >= 0);
    }
  }
}

TEST_CASE("methods: images and stages that a method does not compute return NOT_COMPUTED, all others exist") {
  for (const Absent& method : kAbsent) check_absent(method);
}

TEST_CASE("methods: the height image of best has a height for each pixel with a range, and 0 for the others") {
  const FirstFrame frame("best");
  ovt_reader* const reader = frame.reader;
  CHECK(std::string(ovt_image_name(OVT_IMAGE_HEIGHT)) == "height");
  ovt_image height, range, nonground;
  REQUIRE(ovt_read_image(reader, 0, OVT_IMAGE_HEIGHT, &height) == OVT_OK);
  REQUIRE(ovt_read_image(reader, 0, OVT_IMAGE_RANGE_FILLED, &range) == OVT_OK);
  REQUIRE(ovt_read_image(reader, 0, OVT_IMAGE_NONGROUND, &nonground) == OVT_OK);
  REQUIRE(height.type == OVT_IMAGE_F32);
  REQUIRE(height.rows == range.rows);
  REQUIRE(height.cols == range.cols);
  const auto row = [](const ovt_image& image, int32_t r) {
    return static_cast<const char*>(image.data) + std::size_t(r) * image.stride_bytes;
  };
  int32_t empty = 0, empty_with_height = 0, ground = 0, low_ground = 0, high = 0, high_ground = 0;
  for (int32_t r = 0; r < height.rows; ++r) {
    const auto* h = reinterpret_cast<const float*>(row(height, r));
    const auto* m = reinterpret_cast<const float*>(row(range, r));
    const auto* bits = reinterpret_cast<const uint64_t*>(row(nonground, r));
    for (int32_t c = 0; c < height.cols; ++c) {
      const bool is_ground = m[c] > 0 && (bits[c / 64] >> (c % 64) & 1) == 0;
      empty += m[c] == 0;
      empty_with_height += m[c] == 0 && h[c] != 0;
      ground += is_ground;
      low_ground += is_ground && std::fabs(h[c]) < 0.3f;
      high += h[c] > 1.0f && h[c] < 2.0f;
      high_ground += is_ground && h[c] > 1.0f;
    }
  }
  CHECK(empty > 100);
  CHECK(empty_with_height == 0);
  CHECK(ground > 1000);
  CHECK(low_ground > ground * 9 / 10);
  CHECK(high > 100);
  CHECK(high_ground == 0);
}

TEST_CASE("methods: a method that does not compare the ego pose with the map says nothing about its place") {
  for (const std::string preset : {"paper", "no_map_rules"})
    for (const double shift_m : {0.0, 1e4}) {
      CAPTURE(preset);
      CAPTURE(shift_m);
      DetectorBench bench({});
      REQUIRE(ovt_params_init(&bench.params, sizeof bench.params, preset.c_str()) == OVT_OK);
      bench.create();
      ovt_ego_pose pose;
      ovt_ego_pose_init(&pose, sizeof pose);
      const ScenePose place = demo_scene().ego_at(0.0);
      pose.x_m = place.x_m + shift_m, pose.y_m = place.y_m, pose.yaw_rad = place.yaw_rad;
      for (std::size_t k = 0; k < 3; ++k) {
        for (int64_t i = 0; i < 5; ++i) {
          pose.stamp_ns = demo_frame(k).stamp_ns + i * 10'000'000;
          REQUIRE(ovt_push_ego_pose(bench.detector, &pose) == OVT_OK);
        }
        bench.push_frame(k, {0, 1, 2}, false);
      }
      bench.flush();
      REQUIRE(bench.records.size() == 3);
      const bool off_map = preset == "paper" && shift_m > 0;
      int64_t detections = 0;
      for (const FrameRecord& record : bench.records) {
        CHECK((record.info.flags & (OVT_FLAG_NO_MAP | OVT_FLAG_NO_EGO)) == 0);
        CHECK(((record.info.flags & OVT_FLAG_EGO_OFF_MAP) != 0) == off_map);
        CHECK((record.info.ego_off_map_m > 0) == off_map);
        detections += record.info.detection_count;
      }
      CHECK(detections > 0);
    }
}

TEST_CASE("methods: the API lists every name that ovt_params_init takes, paper first") {
  REQUIRE(ovt_preset_name(0) != nullptr);
  CHECK(std::string(ovt_preset_name(0)) == "paper");
  int32_t count = 0;
  bool has_plain = false;
  for (; ovt_preset_name(count); ++count) {
    ovt_params params;
    CHECK(ovt_params_init(&params, sizeof params, ovt_preset_name(count)) == OVT_OK);
    has_plain = has_plain || std::string(ovt_preset_name(count)) == "plain";
  }
  CHECK(has_plain);
  CHECK(ovt_preset_name(-1) == nullptr);
  CHECK(ovt_preset_name(INT32_MAX) == nullptr);
}

TEST_CASE("methods: parameters belong to the steps, rules and trackers that read them") {
  ovt_params plain = ovt_default_params(), unknown = ovt_default_params();
  plain.method = "plain";
  unknown.method = "none";
  int32_t read = 0;
  for (int32_t i = 0; i < ovt_param_count(); ++i) {
    ovt_param_info info;
    REQUIRE(ovt_describe_param(i, &info) == OVT_OK);
    const std::string name = info.name, group = name.substr(0, name.find('.'));
    CAPTURE(name);
    const std::set<std::string> of_best = {
        "gate.height_m", "gate.width_slack_m",  "gate.inside_m",       "gate.range_m",        "gate.free_range_m",
        "gate.lowest_m", "gate.top_m",          "gate.own_back_m",     "gate.own_front_m",    "gate.own_side_m",
        "gate.wall_m",   "pose.front_length_m", "pose.profile_points", "pose.angle_sigma_deg"};
    const bool only_best = group == "join" || group == "cut" || group == "class" || group == "running_ground" ||
                           group == "smoke" || group == "ego_heading" || group == "lane_tracker" ||
                           of_best.count(name) > 0;
    const bool absent = (only_best && group != "ego_heading") || group == "angle" || group == "smooth" ||
                        group == "ground" || group == "repair";
    bool is_read = false;  // by one preset at least
    for (int32_t k = 0; ovt_preset_name(k); ++k) {
      ovt_params of_preset;
      REQUIRE(ovt_params_init(&of_preset, sizeof of_preset, ovt_preset_name(k)) == OVT_OK);
      is_read = is_read || ovt_reads_param(&of_preset, i) != 0;
    }
    CHECK(is_read);
    CHECK((ovt_reads_param(nullptr, i) != 0) == !only_best);  // paper
    ovt_params best = ovt_default_params();
    best.method = "best";
    if (only_best) CHECK(ovt_reads_param(&best, i) != 0);
    CHECK((ovt_reads_param(&plain, i) != 0) == !absent);
    CHECK(ovt_reads_param(&unknown, i) == 0);
    read += !absent;
  }
  CHECK(read < ovt_param_count());
  CHECK(ovt_reads_param(nullptr, -1) == 0);
  CHECK(ovt_reads_param(nullptr, ovt_param_count()) == 0);
}

TEST_CASE("methods: every column that a step or a rule reads is written before it") {
  const Method* all[kMaxMethods] = {};
  const int32_t count = list_methods(all);
  for (int32_t m = 0; m < count; ++m) {
    CAPTURE(std::string(all[m]->name));
    CHECK(is_chain(all[m]->segment, kGivenColumns));
    Columns written = kGivenColumns;
    for (const Step& step : all[m]->segment) written |= step.writes;
    for (const FrameRule& rule : all[m]->frame) {
      CAPTURE(std::string(rule.name));
      CHECK((rule.reads & ~written) == 0);
    }
  }
}

TEST_CASE("methods: every method has a unique, non-empty name") {
  CHECK_FALSE(add_method(kPaper));
  CHECK(find_method("paper") == &kPaper);
  CHECK(find_method("") == nullptr);
  const Method* all[kMaxMethods] = {};
  const int32_t count = list_methods(all);
  REQUIRE(count >= 2);
  CHECK(all[0] == &kPaper);
  CHECK(list_methods(nullptr) == count);
}

}  // namespace
