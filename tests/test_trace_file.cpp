// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "tests/support/detector_bench.h"
#include "tests/support/temp_folder.h"
#include "tools/cli/trace_file.h"
#include "tools/client/session.h"
#include "tools/io/text.h"

namespace overtake::cli {
namespace {

using Json = nlohmann::json;
constexpr int32_t kFrames = 6;

// The trace of a few frames of the scene, numbered from 100; the last one has no scan of the right sensor.
Json trace_scene(int32_t workers, const io::Rig& rig) {
  const TempFolder folder;
  TraceFile trace(folder.path("trace.json"), rig);
  std::vector<ovt_sensor_def> sensors;
  for (const io::RigSensor& sensor : rig.sensors) sensors.push_back(to_sensor_def(sensor));
  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = sensors.data();
  def.sensor_count = int32_t(sensors.size());
  def.worker_count = workers;
  def.push_policy = OVT_PUSH_WAIT;
  def.user = &trace;
  def.on_frame = [](ovt_reader* reader, void* user) {
    ovt_frame_info info;
    ovt_read_info(reader, &info);
    static_cast<TraceFile*>(user)->add(100 + info.sequence, reader);
  };
  ovt_detector* detector = nullptr;
  REQUIRE(ovt_create_detector(&def, &detector) == OVT_OK);
  for (int32_t k = 0; k < kFrames; ++k) {
    const SceneFrame& frame = overtake::test::demo_frame(std::size_t(k));
    for (int32_t s = 0; s < (k + 1 < kFrames ? 3 : 2); ++s) {
      const ovt_points points = overtake::test::points_of(frame.scan[s], s, frame.stamp_ns);
      REQUIRE(ovt_push_scan(detector, &points) == OVT_OK);
    }
  }
  REQUIRE(ovt_flush(detector) == OVT_OK);
  ovt_destroy_detector(detector);
  trace.finish();
  return Json::parse(io::read_whole_file(folder.path("trace.json")));
}

struct Slice {
  int64_t begin_ns, end_ns;
  std::string name;
};
int64_t ns_of(const Json& us) { return std::llround(us.get<double>() * 1000); }

TEST_CASE("trace: holds every stage of every frame once, a sensor's with its name, on as many lanes as threads") {
  for (const int32_t workers : {1, 3}) {
    CAPTURE(workers);
    const Json json = trace_scene(workers, io::load_rig("av21"));
    std::map<std::string, int32_t> seen;  // "7 front project"
    std::map<int32_t, std::string> lane_name;
    std::set<int32_t> lanes;
    std::map<int64_t, int32_t> begun, ended;
    for (const Json& event : json.at("traceEvents")) {
      const std::string kind = event.at("ph");
      if (kind == "M") {
        if (event.at("name") == "thread_name") lane_name[event.at("tid")] = event.at("args").at("name");
        continue;
      }
      const Json& args = event.at("args");
      const int64_t sequence = args.at("sequence");
      CHECK(args.at("frame") == 100 + sequence);
      CHECK(event.at("ts").get<double>() >= 0);
      if (kind == "b") ++begun[sequence];
      if (kind == "e") ++ended[sequence];
      if (kind != "X") continue;
      lanes.insert(event.at("tid").get<int32_t>());
      const std::string sensor = args.contains("sensor") ? args.at("sensor").get<std::string>() : "-";
      ++seen[std::to_string(sequence) + " " + sensor + " " + event.at("name").get<std::string>()];
    }
    std::map<std::string, int32_t> wanted;
    for (int32_t k = 0; k < kFrames; ++k) {
      const std::string frame = std::to_string(k);
      for (const char* sensor : {"front", "left", "right"})
        for (int32_t i = OVT_STAGE_LOAD; i <= OVT_STAGE_TRACK; ++i)
          if (i <= OVT_STAGE_SEGMENT && (k + 1 < kFrames || std::string(sensor) != "right"))
            wanted[frame + " " + sensor + " " + ovt_stage_name(i)] = 1;
      for (int32_t i = OVT_STAGE_MERGE; i <= OVT_STAGE_TRACK; ++i) wanted[frame + " - " + ovt_stage_name(i)] = 1;
      CHECK(begun[k] == 1);
      CHECK(ended[k] == 1);
    }
    CHECK(seen == wanted);
    for (const int32_t lane : lanes) CHECK(lane_name.count(lane) == 1);
    CHECK(lane_name[1].substr(0, 14) == "pushing thread");
    CHECK(int32_t(lane_name.size()) <= 1 + (workers == 1 ? 0 : workers));
    CHECK((workers == 1) == (lane_name.size() == 1));
  }
}

TEST_CASE("trace: spans on one lane are nested or separate") {
  for (const int32_t workers : {1, 2, 3}) {
    CAPTURE(workers);
    std::map<int32_t, std::vector<Slice>> lanes;
    const Json json = trace_scene(workers, io::load_rig("av21"));
    for (const Json& event : json.at("traceEvents")) {
      if (event.at("ph") != "X") continue;
      const int64_t begin_ns = ns_of(event.at("ts"));
      lanes[event.at("tid")].push_back({begin_ns, begin_ns + ns_of(event.at("dur")), event.at("name")});
    }
    REQUIRE_FALSE(lanes.empty());
    for (auto& [number, slices] : lanes) {
      const int32_t lane = number;  // clang 14 cannot capture a structured binding in CAPTURE's lambda
      CAPTURE(lane);
      std::stable_sort(slices.begin(), slices.end(), [](const Slice& a, const Slice& b) {
        return a.begin_ns != b.begin_ns ? a.begin_ns < b.begin_ns : a.end_ns > b.end_ns;
      });
      std::vector<Slice> open;
      for (const Slice& slice : slices) {
        while (!open.empty() && open.back().end_ns <= slice.begin_ns) open.pop_back();
        if (open.empty()) {
          open.push_back(slice);
          continue;
        }
        CAPTURE(slice.name);
        CAPTURE(open.back().name);
        CHECK(open.back().name == "segment");  // the only stage that contains others
        CHECK(slice.end_ns <= open.back().end_ns);
        CHECK(slice.name != "segment");
        open.push_back(slice);
      }
    }
  }
}

TEST_CASE("trace: is JSON with sensor names that need escapes, and is complete without a frame") {
  io::Rig rig = io::load_rig("av21");
  rig.sensors[0].name = "front \"A\\B\"\n";
  bool found = false;
  const Json json = trace_scene(1, rig);
  for (const Json& event : json.at("traceEvents"))
    found = found || (event.at("args").contains("sensor") && event.at("args").at("sensor") == rig.sensors[0].name);
  CHECK(found);

  const TempFolder folder;
  TraceFile(folder.path("empty.json"), rig).finish();
  CHECK(Json::parse(io::read_whole_file(folder.path("empty.json"))).at("traceEvents").size() == 2);
  CHECK(error_of([&] { TraceFile(folder.path("no/folder.json"), rig); }).find("no/folder.json: cannot be written") !=
        std::string::npos);
}

}  // namespace
}  // namespace overtake::cli
