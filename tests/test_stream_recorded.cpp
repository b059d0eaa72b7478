// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Recorded scans of the AV-21 in pieces give the bytes of whole scans, and their first steps run while the pieces
// arrive: each line comes after the one above it.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "kernels/kernel_table.h"
#include "tests/support/frame_hash.h"
#include "tests/support/pieces.h"
#include "tests/support/recorded.h"
#include "tests/support/test_method.h"
#include "tools/client/session.h"

using namespace overtake::test;

namespace {

constexpr int32_t kSensors = 3;

struct Recorded {
  Recorded() {
    const overtake::io::Recording recording(overtake::recorded("racecar"), overtake::io::load_rig("av21"));
    for (const overtake::io::RigSensor& sensor : recording.rig().sensors)
      sensors.push_back(overtake::cli::to_sensor_def(sensor));
    for (std::size_t k = 0; k < recording.frame_count(); ++k) frames.push_back(recording.read(k));
  }
  std::vector<ovt_sensor_def> sensors;
  std::vector<overtake::io::FrameScans> frames;
};

struct Run {
  std::vector<uint64_t> hashes;
  int32_t row_scans = 0;  // of which a row step ran before the segmentation
  ovt_stats stats{};
};

struct Manner {
  const char* isa = nullptr;
  int32_t workers = 1, parts = 1;  // parts: of a segmentation
  bool pieces = false, stream = false, keep_images = true;
  uint64_t seed = 0;
};

// The frames twice: the rows of the first scans are not predicted.
Run run(const Recorded& recorded, const Manner& manner) {
  Run run;
  ovt_params params = test_params();
  params.segment_parts = manner.parts;
  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = recorded.sensors.data();
  def.sensor_count = kSensors;
  def.params = &params;
  def.worker_count = manner.workers;
  def.isa = manner.isa;
  def.stream = manner.stream;
  def.keep_images = manner.keep_images;
  def.push_policy = OVT_PUSH_WAIT;
  def.user = &run;
  def.on_frame = [](ovt_reader* reader, void* user) {
    auto& r = *static_cast<Run*>(user);
    r.hashes.push_back(FrameHash(reader, kSensors).value());
    for (int32_t s = 0; s < kSensors; ++s) {
      ovt_span gaps, segment;
      if (ovt_read_span(reader, s, OVT_STAGE_GAPS, &gaps) != OVT_OK || gaps.duration_ns < 0) continue;
      if (ovt_read_span(reader, s, OVT_STAGE_SEGMENT, &segment) != OVT_OK) continue;
      r.row_scans += gaps.start_ns < segment.start_ns;
    }
  };
  ovt_detector* detector = nullptr;
  REQUIRE(ovt_create_detector(&def, &detector) == OVT_OK);
  std::mt19937_64 random(manner.seed);
  for (std::size_t k = 0; k < 2 * recorded.frames.size(); ++k) {
    std::vector<std::pair<double, std::pair<ovt_points, Range>>> order;  // sensors in turn
    for (const overtake::io::SensorScan& scan : recorded.frames[k % recorded.frames.size()].scans) {
      ovt_points points = overtake::cli::to_points(scan);
      points.stamp_ns = int64_t(k + 20) * 50'000'000;
      if (!manner.pieces) REQUIRE(ovt_push_scan(detector, &points) == OVT_OK);
      if (!manner.pieces) continue;
      for (const Range& range : cut_randomly(points.count, random))
        order.push_back({double(range.last) / double(points.count), {points, range}});
    }
    std::stable_sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [at, part] : order) {
      const auto& [points, range] = part;
      const ovt_points piece = piece_of(points, range.first, range.last);
      REQUIRE(ovt_push_points(detector, &piece) == OVT_OK);
      if (range.last == points.count)
        REQUIRE(ovt_end_scan(detector, points.sensor, points.stamp_ns, points.count) == OVT_OK);
    }
  }
  REQUIRE(ovt_flush(detector) == OVT_OK);
  run.stats = ovt_default_stats();
  REQUIRE(ovt_read_stats(detector, &run.stats) == OVT_OK);
  ovt_destroy_detector(detector);
  return run;
}

}  // namespace

TEST_CASE("stream: recorded scans in pieces, at any cut, give the bytes of whole scans") {
  OVT_NEED_RECORDED("racecar");
  const Recorded recorded;
  const overtake::KernelTable* tables[16] = {};
  const int32_t table_count = overtake::list_kernels(tables);
  for (const bool keep_images : {true, false}) {
    Manner whole;
    whole.keep_images = keep_images;
    const Run expected = run(recorded, whole);
    REQUIRE(expected.hashes.size() == 2 * recorded.frames.size());
    for (int32_t i = 0; i < 8; ++i) {
      Manner manner;
      manner.keep_images = keep_images;
      manner.pieces = true;
      manner.stream = i % 4 != 0;
      manner.workers = 1 << i % 3;
      manner.parts = 1 + i / 2 % 4;
      manner.isa = tables[1 + i % (table_count - 1)]->isa;  // the first is the reference, which is slow
      manner.seed = uint64_t(i + 1);
      CAPTURE(i);
      CAPTURE(keep_images);
      CAPTURE(std::string(manner.isa));
      const Run pieces = run(recorded, manner);
      CHECK(pieces.hashes == expected.hashes);
      CHECK(pieces.stats.scans_incomplete == 0);
      CHECK(pieces.stats.row_orders_wrong == 0);
      if (!tests_paper() && !tests_best()) continue;
      // All but the first scan of each sensor.
      CHECK(pieces.row_scans == (manner.stream ? int32_t(kSensors * (expected.hashes.size() - 1)) : 0));
    }
  }
}
