// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The C++ wrapper: it releases what it owns, and shows the C API's memory.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "pipeline/overtake.hpp"
#include "tests/support/detector_bench.h"

using namespace overtake::test;

namespace {

ovt_points wrapped_scan(const overtake::SceneScan& from, int32_t sensor, int64_t stamp_ns) {
  ovt_points scan = ovt::scan(sensor, stamp_ns, from.x_m.size());
  scan.x = ovt::column(from.x_m);
  scan.y = ovt::column(from.y_m);
  scan.z = ovt::column(from.z_m);
  scan.layer = ovt::column(from.layer);
  scan.intensity = ovt::column(from.intensity);
  scan.time = ovt::column(from.time_offset_s);
  scan.time_unit_ns = 1e9;
  return scan;
}

void push_frame(ovt::Detector& detector, std::size_t index) {
  const overtake::SceneFrame& frame = demo_frame(index);
  for (int32_t s = 0; s < 3; ++s) REQUIRE(detector.push(wrapped_scan(frame.scan[s], s, frame.stamp_ns)) == OVT_OK);
}

// Counts the bytes a detector holds.
struct Heap {
  int64_t bytes = 0, calls = 0;
  void* allocate(std::size_t size, std::size_t alignment) noexcept {
    bytes += int64_t(size), ++calls;
    return std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  }
  void release(void* block, std::size_t size) noexcept {
    bytes -= int64_t(size);
    std::free(block);
  }
};

struct Listener {
  std::vector<int64_t> sequences;
  std::vector<int32_t> detection_counts;
  std::vector<std::thread::id> threads;
  std::vector<std::string> sentences;
  void on_frame(ovt::FrameView frame) noexcept {
    sequences.push_back(frame.info()->sequence);
    detection_counts.push_back(int32_t(frame.detections()->size()));
    threads.push_back(std::this_thread::get_id());
  }
  void log(ovt_log_level, std::string_view text) noexcept { sentences.emplace_back(text); }
};

}  // namespace

TEST_CASE("OVT_FIELD: covers a member from the first record to the end of the last record") {
  struct Record {
    float x;
    uint16_t layer, unused;
    double time_s;
  };
  const std::array<Record, 5> records = {};
  const Record* const first = records.data();
  const ovt_column layer = OVT_FIELD(first, records.size(), layer, OVT_U16);
  CHECK(layer.data == &first->layer);
  CHECK(layer.size_bytes == sizeof records - offsetof(Record, layer));
  CHECK(layer.stride == sizeof(Record));
  CHECK(layer.type == OVT_U16);
  const Record array[3] = {};
  const ovt_column time = OVT_FIELD(array, 3, time_s, OVT_F64);
  CHECK(time.data == &array[0].time_s);
  CHECK(static_cast<const char*>(time.data) + time.size_bytes == reinterpret_cast<const char*>(array + 3));
  for (const int32_t none : {0, -1}) CHECK(OVT_FIELD(array, none, x, OVT_F32).size_bytes == 0);
  const ovt_column span = ovt::column(records, &Record::x), field = OVT_FIELD(first, 5, x, OVT_F32);
  CHECK((span.data == field.data && span.stride == field.stride && span.type == field.type));
}

TEST_CASE("wrapper: spans are the C API's columns, not copies") {
  const std::array<ovt_sensor_def, 3> sensors = demo_sensors();
  ovt::Detector detector(ovt::definition(sensors));
  ovt::Reader reader(detector);
  CHECK(reader.info().status() == OVT_NO_FRAME);
  push_frame(detector, 0);
  const auto info = reader.next_frame();
  REQUIRE(info);
  CHECK(info->sequence == 0);
  CHECK(info->sensor_mask == 7);
  CHECK(reader.next_frame().status() == OVT_NO_FRAME);

  ovt_detections detections;
  REQUIRE(ovt_read_detections(reader.get(), &detections) == OVT_OK);
  const auto found = reader.detections();
  REQUIRE(found);
  CHECK(found->size() == std::size_t(info->detection_count));
  CHECK(found->size() > 0);
  CHECK(found->x_m().data() == detections.x_m);
  CHECK(found->x_m().size() == found->size());
  CHECK(found->track().data() == detections.track);

  ovt_tracks tracks;
  REQUIRE(ovt_read_tracks(reader.get(), OVT_AT_FRAME_STAMP, &tracks) == OVT_OK);
  const auto tracked = reader.tracks();
  REQUIRE(tracked);
  CHECK(tracked->size() == std::size_t(info->track_count));
  CHECK(tracked->size() > 1);
  CHECK(tracked->id().data() == tracks.id);
  CHECK(tracked->covariance(14).data() == tracks.covariance[14]);
  CHECK(tracked->path_x_m(1).data() == tracks.path_x_m + tracks.path_points);
  CHECK(tracked->path_x_m(1).size() == std::size_t(tracks.path_points));
  CHECK(tracked->path_x_m(tracked->size()).empty());
  CHECK(reader.set_path_horizon(0.0) == OVT_OK);
  CHECK(reader.tracks()->path_x_m(1).empty());
  CHECK(reader.tracks()->x_m().size() == tracked->size());
  CHECK(reader.set_path_horizon(-1.0) == OVT_BAD_ARGUMENT);
  CHECK(reader.set_path_horizon(3.0) == OVT_OK);
  CHECK(reader.tracks(demo_frame(0).stamp_ns + 100'000'000)->c.publish_ns == demo_frame(0).stamp_ns + 100'000'000);

  const auto clusters = reader.clusters();
  CHECK(clusters->size() == std::size_t(info->cluster_count));
  ovt_labels labels;
  REQUIRE(ovt_read_labels(reader.get(), 1, &labels) == OVT_OK);
  const auto labelled = reader.labels(1);
  CHECK(labelled->label().data() == labels.label);
  CHECK(labelled->size() == demo_frame(0).scan[1].x_m.size());
  CHECK(labelled->cluster_of_label().size() == std::size_t(labels.label_count) + 1);
  CHECK(reader.labels(3).status() == OVT_BAD_ARGUMENT);
  CHECK(reader.span(OVT_STAGE_TRACK)->duration_ns >= 0);
  CHECK(reader.span(OVT_STAGE_SEGMENT, 2)->duration_ns > 0);
}

TEST_CASE("wrapper: columns that the method does not compute are empty spans") {
  const std::array<ovt_sensor_def, 3> sensors = demo_sensors();
  for (const char* preset : {"paper", "best"}) {
    CAPTURE(preset);
    const ovt_params params = ovt::params(preset);
    ovt_detector_def def = ovt::definition(sensors);
    def.params = &params;
    ovt::Detector detector(def);
    ovt::Reader reader(detector);
    for (int32_t frame = 0; frame < 3; ++frame) push_frame(detector, frame);
    REQUIRE(reader.next_frame());
    const auto tracks = reader.tracks();
    REQUIRE(tracks);
    REQUIRE(tracks->size() > 0);
    const std::size_t rows = std::string(preset) == "best" ? tracks->size() : 0;
    CHECK(tracks->existence().size() == rows);
    CHECK(tracks->object_class().size() == rows);
    CHECK(tracks->visibility().size() == rows);
    CHECK(tracks->unseen_s().size() == rows);
    CHECK(tracks->heading_sigma_rad().size() == rows);
    CHECK((tracks->c.existence == nullptr) == (rows == 0));
    for (const double existence : tracks->existence()) CHECK((existence > 0 && existence < 1));
  }
}

TEST_CASE("wrapper: an image's rows are spans of its type, and empty for any other type") {
  const std::array<ovt_sensor_def, 3> sensors = demo_sensors();
  ovt::Detector detector(ovt::definition(sensors));
  ovt::Reader reader(detector);
  push_frame(detector, 0);
  REQUIRE(reader.next_frame());
  const auto range = reader.image(0, OVT_IMAGE_RANGE);
  REQUIRE(range);
  CHECK(range->row<float>(0).size() == 857);
  CHECK(static_cast<const void*>(range->row<float>(3).data()) ==
        static_cast<const char*>(range->c.data) + 3 * range->c.stride_bytes);
  CHECK(range->row<int32_t>(0).empty());
  CHECK(range->row<float>(-1).empty());
  CHECK(range->row<float>(32).empty());
  CHECK(reader.image(0, OVT_IMAGE_LABELS)->row<int32_t>(31).size() == 857);
  CHECK(reader.image(0, OVT_IMAGE_NONGROUND)->row<uint64_t>(0).size() == 14);
}

TEST_CASE("wrapper: an invalid def throws an exception with the sentence that names the field") {
  std::array<ovt_sensor_def, 3> sensors = demo_sensors();
  sensors[1].rows = -4;
  try {
    ovt::Detector detector(ovt::definition(sensors));
    FAIL("it was created");
  } catch (const ovt::Error& error) {
    CHECK(error.status() == OVT_BAD_ARGUMENT);
    CHECK(std::string(error.what()).find("rows") != std::string::npos);
  }
  CHECK_THROWS_AS(ovt::params("fast"), ovt::Error);
  ovt_params params = ovt::params();
  ovt::set(params, "tracker.confirm_hits", "3");
  CHECK(ovt::get(params, "tracker.confirm_hits") == 3);
  CHECK_THROWS_WITH_AS(ovt::set(params, "tracker.confirm_hits", "none"),
                       doctest::Contains("tracker.confirm_hits = none"), ovt::Error);
  CHECK_THROWS_AS((void)ovt::scan(0, 0, std::size_t(1) << 40), ovt::Error);
  CHECK(ovt::build_info().version == OVT_VERSION);
}

TEST_CASE("wrapper: a dropped scan is a status, and an exception only on request") {
  const std::array<ovt_sensor_def, 3> sensors = demo_sensors();
  ovt::Detector detector(ovt::definition(sensors));
  ovt::Reader reader(detector);
  const ovt_points scan = wrapped_scan(demo_frame(0).scan[0], 0, 5);
  CHECK(detector.push(scan) == OVT_OK);
  CHECK(detector.push(scan) == OVT_DUPLICATE);
  CHECK(detector.stats().dup == 1);
  CHECK_THROWS_AS(ovt::check(detector.push(scan)), ovt::Error);
  CHECK_NOTHROW(ovt::check(detector.flush()));
  CHECK(reader.tracks().status() == OVT_NO_FRAME);
  CHECK_THROWS_AS((void)reader.tracks().value(), ovt::Error);
  CHECK(reader.next_frame().value().sequence == 0);
  CHECK(reader.tracks().value().size() == reader.tracks()->size());
}

TEST_CASE("wrapper: a moved owner is empty, and everything is released once") {
  const std::array<ovt_sensor_def, 3> sensors = demo_sensors();
  ovt_detector_def def = ovt::definition(sensors);
  Heap heap;
  ovt::bind(def, heap);
  {
    ovt::Detector first(def);
    const int64_t of_one = heap.bytes;
    CHECK(of_one > 0);
    ovt::Detector second(std::move(first));
    CHECK(first.get() == nullptr);
    CHECK(first.push(ovt::ego_pose()) == OVT_BAD_ARGUMENT);
    ovt::Detector third(def);
    CHECK(heap.bytes == 2 * of_one);
    third = std::move(second);
    CHECK(heap.bytes == of_one);
    ovt::Reader reader(third);
    ovt::Reader other(std::move(reader));
    CHECK(reader.get() == nullptr);
    CHECK(reader.next_frame().status() == OVT_BAD_ARGUMENT);
    push_frame(third, 0);
    CHECK(other.next_frame());
    reader = std::move(other);
    CHECK(reader.info());
  }
  CHECK(heap.calls > 0);
  CHECK(heap.bytes == 0);
}

TEST_CASE("wrapper: a reader may outlive its detector") {
  const std::array<ovt_sensor_def, 3> sensors = demo_sensors();
  Heap heap;
  ovt_detector_def def = ovt::definition(sensors);
  ovt::bind(def, heap);
  {
    ovt::Detector detector(def);
    ovt::Reader reader(detector);
    push_frame(detector, 0);
    REQUIRE(reader.next_frame());
    push_frame(detector, 1);
    { ovt::Detector gone(std::move(detector)); }
    CHECK(reader.next_frame().status() == OVT_NO_FRAME);
    CHECK(reader.info()->sequence == 0);
    CHECK(reader.detections()->x_m()[0] == reader.detections()->c.x_m[0]);
  }
  CHECK(heap.bytes == 0);
}

TEST_CASE("wrapper: a column of records ends with its last value, not with the last record") {
  struct Point {
    float x, y, z;
    uint16_t layer;
    int8_t gain;
  };
  std::vector<Point> points(10);
  const ovt_column y = ovt::column(points, &Point::y);
  CHECK(y.data == &points[0].y);
  CHECK(y.stride == sizeof(Point));
  CHECK(y.type == OVT_F32);
  CHECK(static_cast<const char*>(y.data) + y.size_bytes == reinterpret_cast<const char*>(&points[9].y + 1));
  CHECK(ovt::column(points, &Point::layer).type == OVT_U16);
  CHECK(ovt::column(points, &Point::gain).type == OVT_I8);
  points.clear();
  CHECK(ovt::column(points, &Point::layer).size_bytes == 0);
  CHECK(ovt::column(points, &Point::layer).data == nullptr);

  const double numbers[3] = {1, 2, 3};
  CHECK(ovt::column(numbers).size_bytes == sizeof numbers);
  CHECK(ovt::column(std::span(numbers).first(2)).size_bytes == 2 * sizeof(double));
  CHECK(ovt::column(numbers).type == OVT_F64);
  CHECK(ovt::column(std::span<const uint32_t>()).type == OVT_U32);
  CHECK(ovt::Borrowed<std::vector<float>&>);
  CHECK_FALSE(ovt::Borrowed<std::vector<float>>);  // a temporary's points would be destroyed before the push
}

TEST_CASE("wrapper: a handler gets every frame in order: on the pushing thread with one worker, else on another") {
  const std::array<ovt_sensor_def, 3> sensors = demo_sensors();
  for (const int32_t workers : {1, 2}) {
    CAPTURE(workers);
    Listener listener;
    ovt_detector_def def = ovt::definition(sensors);
    def.worker_count = workers;
    def.push_policy = OVT_PUSH_WAIT;
    ovt::bind(def, listener);
    {
      ovt::Detector detector(def);
      for (std::size_t k = 0; k < 4; ++k) push_frame(detector, k);
      REQUIRE(detector.flush() == OVT_OK);
      CHECK(detector.stats().frames == 4);
    }
    CHECK(listener.sequences == std::vector<int64_t>{0, 1, 2, 3});
    CHECK(std::ranges::all_of(listener.detection_counts, [](int32_t n) { return n > 0; }));
    CHECK(std::ranges::all_of(listener.threads, [workers](std::thread::id id) {
      return (id == std::this_thread::get_id()) == (workers == 1);
    }));
    CHECK_FALSE(listener.sentences.empty());
  }
}
