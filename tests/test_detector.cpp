// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The whole detector through the C API: same bytes whatever the threads do, frames in order, lifetimes, flags,
// counters.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <thread>

#include "tests/support/detector_bench.h"

using namespace overtake_test;

namespace {

constexpr int64_t kMs = 1'000'000;
constexpr float kNanF = std::numeric_limits<float>::quiet_NaN();

std::vector<FrameRecord> run(int32_t workers, std::size_t frames, const std::vector<std::vector<int32_t>>& orders) {
  DetectorBench bench({.workers = workers});
  bench.create();
  for (std::size_t k = 0; k < frames; ++k) bench.push_frame(k, orders[k % orders.size()]);
  bench.flush();
  CHECK(adds_up(bench.stats()));
  CHECK(bench.stats().used == int64_t(3 * frames));
  return bench.records;
}

// Posts of 8 layers, 3 columns wide, farther and farther from right to left: each is one small cluster.
struct Posts {
  explicit Posts(int32_t count) {
    for (int32_t p = 0; p < count; ++p)
      for (int32_t c = 0; c < 3; ++c)
        for (int32_t l = 0; l < 8; ++l) {
          const double azimuth = (-59.0 + 2.2 * p + 0.14 * c) * 3.14159265358979323846 / 180.0;
          const double range = 10.0 + p;
          x.push_back(float(range * std::cos(azimuth)));
          y.push_back(float(range * std::sin(azimuth)));
          z.push_back(float(range * std::tan((4.0 - l) * 3.14159265358979323846 / 180.0)));
          layer.push_back(uint8_t(l));
        }
  }
  ovt_points points(int64_t stamp_ns) const {
    ovt_points out;
    ovt_points_init(&out, sizeof out);
    out.count = int32_t(x.size());
    out.stamp_ns = stamp_ns;
    out.x = column_of(x, OVT_F32);
    out.y = column_of(y, OVT_F32);
    out.z = column_of(z, OVT_F32);
    out.layer = column_of(layer, OVT_U8);
    return out;
  }
  std::vector<float> x, y, z;
  std::vector<uint8_t> layer;
};

struct Latest {
  ovt_frame_info info{};
  int32_t calls = 0;
};
void keep_latest(ovt_reader* reader, void* user) {
  auto* latest = static_cast<Latest*>(user);
  ovt_read_info(reader, &latest->info);
  ++latest->calls;
}

// One sensor or none, no map.
struct Small {
  explicit Small(int32_t sensor_count = 1, int32_t workers = 1) {
    sensor = ovt_default_sensor_def();
    def = ovt_default_detector_def();
    def.sensors = sensor_count ? &sensor : nullptr;
    def.sensor_count = sensor_count;
    def.worker_count = workers;
    def.push_policy = OVT_PUSH_WAIT;
    def.on_frame = keep_latest;
    def.user = &latest;
  }
  Small(const Small&) = delete;
  ~Small() { ovt_destroy_detector(detector); }
  void create() { REQUIRE(ovt_create_detector(&def, &detector) == OVT_OK); }
  ovt_stats stats() const {
    ovt_stats out{};
    out.struct_size = sizeof out;
    REQUIRE(ovt_read_stats(detector, &out) == OVT_OK);
    return out;
  }
  ovt_sensor_def sensor;
  ovt_detector_def def;
  ovt_detector* detector = nullptr;
  Latest latest;
};

}  // namespace

TEST_CASE("detector: the same bytes for every worker count and every arrival order within a frame") {
  constexpr std::size_t kFrames = 6;
  const std::vector<FrameRecord> expected = run(1, kFrames, {{0, 1, 2}});
  REQUIRE(expected.size() == kFrames);
  int32_t detections = 0;
  for (std::size_t k = 0; k < kFrames; ++k) {
    CHECK(expected[k].info.sequence == int64_t(k));
    CHECK(expected[k].info.sensor_mask == 7);
    CHECK(expected[k].info.reference == OVT_REFERENCE_MAP);
    CHECK(expected[k].info.flags == 0);
    detections += expected[k].info.detection_count;
  }
  CHECK(detections > 0);
  CHECK(std::count(expected.back().track_state.begin(), expected.back().track_state.end(), OVT_CONFIRMED) > 0);
  for (const int32_t workers : {2, 3, 4, 8}) {
    CAPTURE(workers);
    CHECK(run(workers, kFrames, {{0, 1, 2}}) == expected);
  }
  const std::vector<std::vector<int32_t>> orders = {{0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (const int32_t workers : {1, 3}) {
    CAPTURE(workers);
    CHECK(run(workers, kFrames, orders) == expected);
    CHECK(run(workers, kFrames, {{2, 1, 0}}) == expected);
  }
}

TEST_CASE("detector: two detectors at once do not meet") {
  const std::vector<FrameRecord> expected = run(1, 3, {{0, 1, 2}});
  DetectorBench a({.workers = 2}), b({.workers = 3});
  a.create();
  b.create();
  for (std::size_t k = 0; k < 3; ++k) {
    a.push_frame(k);
    b.push_frame(k, {2, 0, 1});
  }
  b.flush();
  a.flush();
  CHECK(a.records == expected);
  CHECK(b.records == expected);
}

TEST_CASE("detector: worker_count 0 takes what the machine has") {
  DetectorBench bench({.workers = 0});
  bench.create();
  bench.push_frame(0);
  bench.flush();
  CHECK(bench.records.size() == 1);
}

TEST_CASE("detector: what a reader holds stays as it is while frames go on, and outlives the detector") {
  for (const int32_t workers : {1, 3}) {
    CAPTURE(workers);
    DetectorBench bench({.workers = workers});
    bench.create();
    ovt_reader *held = nullptr, *other = nullptr;
    ovt_frame_info info;
    REQUIRE(ovt_create_reader(bench.detector, &held) == OVT_OK);
    REQUIRE(ovt_create_reader(bench.detector, &other) == OVT_OK);
    CHECK(ovt_next_frame(held, &info) == OVT_NO_FRAME);
    CHECK(ovt_read_info(held, &info) == OVT_NO_FRAME);
    bench.push_frame(0);
    bench.flush();
    REQUIRE(ovt_next_frame(held, &info) == OVT_OK);
    CHECK(info.sequence == 0);
    CHECK(ovt_next_frame(held, &info) == OVT_NO_FRAME);
    const FrameRecord first = record_of(held, 3);
    CHECK(first == bench.records[0]);
    for (std::size_t k = 1; k < 8; ++k) {
      bench.push_frame(k);
      if (ovt_next_frame(other, nullptr) == OVT_OK) CHECK(ovt_read_info(other, &info) == OVT_OK);
    }
    bench.flush();
    CHECK(record_of(held, 3) == first);
    REQUIRE(ovt_next_frame(held, &info) == OVT_OK);
    CHECK(info.sequence == 7);
    CHECK(record_of(held, 3) == bench.records[7]);
    bench.destroy();
    CHECK(record_of(held, 3) == bench.records[7]);
    CHECK(ovt_next_frame(held, &info) == OVT_NO_FRAME);
    CHECK(ovt_next_frame(other, &info) == OVT_NO_FRAME);
    ovt_destroy_reader(held);
    ovt_destroy_reader(other);
  }
}

TEST_CASE("detector: as many readers as the def says, and a destroyed one makes room") {
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

TEST_CASE("detector: a sensor that dies leaves the frames going and the others' detections as if it never was") {
  constexpr std::size_t kFrames = 7, kLast = 3;
  for (const int32_t workers : {1, 3}) {
    CAPTURE(workers);
    DetectorBench dies({.workers = workers}), never({.workers = workers});
    dies.create();
    never.create();
    for (std::size_t k = 0; k < kFrames; ++k) {
      dies.push_frame(k, k < kLast ? std::vector<int32_t>{0, 1, 2} : std::vector<int32_t>{0, 1});
      never.push_frame(k, {0, 1});
    }
    dies.flush();
    never.flush();
    REQUIRE(dies.records.size() == kFrames);
    REQUIRE(never.records.size() == kFrames);
    for (std::size_t k = kLast; k < kFrames; ++k) {
      CHECK(dies.records[k].info.sensor_mask == 3);
      CHECK((dies.records[k].info.flags & OVT_FLAG_SENSOR_MISSING) != 0);
      CHECK(dies.records[k].detections == never.records[k].detections);
      CHECK(dies.records[k].labels == never.records[k].labels);
    }
    CHECK((dies.records[kLast].info.flags & OVT_FLAG_SENSOR_STALE) == 0);
    CHECK((dies.records[kLast + 1].info.flags & OVT_FLAG_SENSOR_STALE) != 0);
  }
}

TEST_CASE("detector: without ego poses the tracks are in the vehicle frame, and without a map it says so") {
  for (const bool map : {false, true}) {
    DetectorBench bench({.map = map});
    bench.create();
    for (std::size_t k = 0; k < 2; ++k) bench.push_frame(k, {0, 1, 2}, false);
    const ovt_frame_info& info = bench.records.back().info;
    CHECK(info.reference == OVT_REFERENCE_VEHICLE);
    CHECK(info.ego_known == 0);
    CHECK(info.flags == (OVT_FLAG_NO_EGO | (map ? 0 : OVT_FLAG_NO_MAP)));
    bench.push_frame(2);  // the first pose: from now on the map
    CHECK(bench.records.back().info.reference == OVT_REFERENCE_MAP);
    CHECK(bench.records.back().info.ego_known == 1);
    CHECK((bench.records.back().info.flags & OVT_FLAG_NO_EGO) == 0);
  }
}

TEST_CASE("detector: when the ego poses stop for long the tracks only predict and no detection has a track") {
  DetectorBench bench({});
  bench.create();
  ovt_reader* reader = nullptr;
  REQUIRE(ovt_create_reader(bench.detector, &reader) == OVT_OK);
  for (std::size_t k = 0; k < 4; ++k) bench.push_frame(k);
  bool lost = false;
  for (std::size_t k = 4; k < 17; ++k) {
    bench.push_frame(k, {0, 1, 2}, false);
    REQUIRE(ovt_next_frame(reader, nullptr) == OVT_OK);
    ovt_frame_info info;
    ovt_detections d;
    REQUIRE(ovt_read_info(reader, &info) == OVT_OK);
    REQUIRE(ovt_read_detections(reader, &d) == OVT_OK);
    if (k > 6) CHECK((info.flags & OVT_FLAG_EGO_STALE) != 0);
    if (info.ego_known) continue;
    lost = true;
    CHECK(info.reference == OVT_REFERENCE_MAP);
    for (int32_t i = 0; i < d.count; ++i) CHECK(d.track[i] == 0);
  }
  CHECK(lost);
  ovt_destroy_reader(reader);
}

TEST_CASE("detector: an empty scan is a scan; no valid point is no data, mostly bad points are degraded") {
  for (const int32_t workers : {1, 2}) {
    Small small(1, workers);
    small.create();
    Posts posts(20);
    ovt_points empty;
    ovt_points_init(&empty, sizeof empty);
    empty.x.type = empty.y.type = empty.z.type = OVT_F32;
    empty.layer.type = OVT_U8;
    CHECK(ovt_push_scan(small.detector, &empty) == OVT_OK);
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK(small.latest.info.point_count == 0);
    CHECK((small.latest.info.flags & OVT_FLAG_NO_DATA) != 0);
    CHECK((small.latest.info.flags & OVT_FLAG_CLOUD_DEGRADED) == 0);

    ovt_points good = posts.points(50 * kMs);
    CHECK(ovt_push_scan(small.detector, &good) == OVT_OK);
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK((small.latest.info.flags & (OVT_FLAG_NO_DATA | OVT_FLAG_CLOUD_DEGRADED)) == 0);
    CHECK(small.latest.info.cluster_count == 20);

    const std::size_t half = posts.x.size() / 2;
    for (std::size_t i = 0; i < half; ++i) posts.x[i] = kNanF;
    good = posts.points(100 * kMs);
    CHECK(ovt_push_scan(small.detector, &good) == OVT_OK);
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK((small.latest.info.flags & (OVT_FLAG_NO_DATA | OVT_FLAG_CLOUD_DEGRADED)) == 0);  // half is not more than half
    posts.x[half] = std::numeric_limits<float>::infinity();
    good = posts.points(150 * kMs);
    CHECK(ovt_push_scan(small.detector, &good) == OVT_OK);
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK((small.latest.info.flags & OVT_FLAG_CLOUD_DEGRADED) != 0);
    CHECK((small.latest.info.flags & OVT_FLAG_NO_DATA) == 0);
    std::fill(posts.y.begin(), posts.y.end(), kNanF);
    good = posts.points(200 * kMs);
    CHECK(ovt_push_scan(small.detector, &good) == OVT_OK);
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK((small.latest.info.flags & OVT_FLAG_CLOUD_DEGRADED) != 0);
    CHECK((small.latest.info.flags & OVT_FLAG_NO_DATA) != 0);
    CHECK(small.latest.info.cluster_count == 0);
    CHECK(small.stats().points_bad[1] == int64_t(half + half + 1 + posts.x.size()));
    CHECK(small.stats().frames == 5);
  }
}

TEST_CASE("detector: a stamp that comes again is a duplicate, an older one is used at its place, one too old is late") {
  Small small;
  small.create();
  const Posts posts(2);
  ovt_points points = posts.points(100 * kMs);
  CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);
  CHECK(ovt_push_scan(small.detector, &points) == OVT_DUPLICATE);
  points.stamp_ns -= 1;
  CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);
  points.stamp_ns -= 500 * kMs;
  CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);
  const ovt_stats stats = small.stats();
  CHECK(stats.pushed == 4);
  CHECK(stats.used == 2);
  CHECK(stats.dup == 1);
  CHECK(stats.late == 1);
}

TEST_CASE("detector: flush with nothing to flush, twice, and pushes after it") {
  for (const int32_t workers : {1, 2}) {
    Small small(1, workers);
    small.create();
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK(small.latest.calls == 0);
    const Posts posts(2);
    for (int64_t k = 0; k < 3; ++k) {
      const ovt_points points = posts.points(k * 50 * kMs);
      CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);
      CHECK(ovt_flush(small.detector) == OVT_OK);
      CHECK(small.latest.calls == int32_t(k + 1));
      CHECK(ovt_flush(small.detector) == OVT_OK);
      CHECK(small.latest.calls == int32_t(k + 1));
    }
  }
}

TEST_CASE("detector: after flush everything pushed before it is finished, a thousand times over") {
  Small small(1, 2);
  small.create();
  ovt_points empty;
  ovt_points_init(&empty, sizeof empty);
  empty.x.type = empty.y.type = empty.z.type = OVT_F32;
  empty.layer.type = OVT_U8;
  int64_t missed = 0;
  for (int64_t k = 1; k <= 1000; ++k) {
    empty.stamp_ns = k * 50 * kMs;
    REQUIRE(ovt_push_scan(small.detector, &empty) == OVT_OK);
    REQUIRE(ovt_flush(small.detector) == OVT_OK);
    missed += small.stats().frames != k;
  }
  CHECK(missed == 0);
}

TEST_CASE("detector: a flood from three threads with a reader beside it adds up") {
  DetectorBench bench({.workers = 2, .push_policy = OVT_PUSH_REPLACE, .record = false});
  bench.create();
  const Posts posts(10);
  constexpr int64_t kScans = 300;
  std::vector<std::thread> threads;
  for (int32_t s = 0; s < 3; ++s)
    threads.emplace_back([&, s] {
      for (int64_t k = 1; k <= kScans; ++k) {
        ovt_points points = posts.points(k * 50 * kMs + s);
        points.sensor = s;
        ovt_push_scan(bench.detector, &points);
        if (k % 50 == 0) ovt_push_scan(bench.detector, &points);
      }
    });
  ovt_reader* reader = nullptr;
  REQUIRE(ovt_create_reader(bench.detector, &reader) == OVT_OK);
  int64_t last = -1, backwards = 0;
  threads.emplace_back([&] {
    ovt_frame_info info;
    ovt_tracks tracks;
    for (int32_t i = 0; i < 3000; ++i) {
      if (ovt_next_frame(reader, &info) != OVT_OK) {
        std::this_thread::yield();
        continue;
      }
      backwards += info.sequence <= last;
      last = info.sequence;
      ovt_read_tracks(reader, info.stamp_ns + 50 * kMs, &tracks);
    }
  });
  for (int64_t k = 0; k < 50; ++k) ovt_advance(bench.detector, k * 300 * kMs);
  for (std::thread& thread : threads) thread.join();
  bench.flush();
  const ovt_stats stats = bench.stats();
  CHECK(backwards == 0);
  CHECK(stats.pushed == 3 * (kScans + kScans / 50));
  CHECK(stats.dup == 3 * kScans / 50);
  CHECK(adds_up(stats));
  CHECK(stats.used > 0);
  CHECK(stats.exceptions == 0);
  ovt_destroy_reader(reader);
}

TEST_CASE("detector: advance closes a frame that waits for a sensor, and predicts the tracks when none comes") {
  for (const int32_t workers : {1, 2}) {
    DetectorBench bench({.workers = workers});
    bench.create();
    for (std::size_t k = 0; k < 3; ++k) bench.push_frame(k);
    bench.push_frame(3, {0, 1});
    REQUIRE(ovt_advance(bench.detector, 224 * kMs) == OVT_OK);
    REQUIRE(ovt_advance(bench.detector, 225 * kMs) == OVT_OK);  // 75 ms after its first stamp
    REQUIRE(ovt_advance(bench.detector, 300 * kMs) == OVT_OK);
    bench.flush();
    REQUIRE(bench.records.size() == 5);
    CHECK(bench.records[3].info.sensor_mask == 3);
    CHECK(bench.records[4].info.sensor_mask == 0);
    CHECK(bench.records[4].info.stamp_ns == 300 * kMs);
    CHECK(bench.records[4].info.track_count == bench.records[3].info.track_count);
    CHECK((bench.records[4].info.flags & OVT_FLAG_NO_DATA) == 0);
  }
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
    ovt_reader* reader = nullptr;
    ovt_tracks tracks;
    REQUIRE(ovt_create_reader(small.detector, &reader) == OVT_OK);
    REQUIRE(ovt_next_frame(reader, nullptr) == OVT_OK);
    REQUIRE(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks) == OVT_OK);
    for (int32_t i = 0; i < tracks.count; ++i) CHECK(std::hypot(tracks.x_m[i], tracks.y_m[i]) < 29);
    ovt_destroy_reader(reader);
  }
}

TEST_CASE("detector: point labels lead to clusters whose counts and bounds are those of their points") {
  const Posts posts(5);
  const ovt_points points = posts.points(7 * kMs);
  Small small;
  small.create();
  REQUIRE(ovt_push_scan(small.detector, &points) == OVT_OK);
  ovt_reader* reader = nullptr;
  ovt_labels labels;
  ovt_clusters clusters;
  REQUIRE(ovt_create_reader(small.detector, &reader) == OVT_OK);
  CHECK(ovt_read_clusters(reader, &clusters) == OVT_NO_FRAME);
  REQUIRE(ovt_next_frame(reader, nullptr) == OVT_OK);
  REQUIRE(ovt_read_labels(reader, 0, &labels) == OVT_OK);
  REQUIRE(ovt_read_clusters(reader, &clusters) == OVT_OK);
  CHECK(ovt_read_clusters(reader, nullptr) == OVT_BAD_ARGUMENT);
  REQUIRE(clusters.count == 5);
  for (int32_t c = 0; c < clusters.count; ++c) {
    int32_t count = 0;
    float low_x = 1e9f, high_z = -1e9f;
    for (int32_t i = 0; i < labels.count; ++i) {
      if (labels.label[i] < 1 || labels.cluster_of_label[labels.label[i]] != c) continue;
      ++count;
      low_x = std::min(low_x, labels.x_m[i]);
      high_z = std::max(high_z, labels.z_m[i]);
    }
    CHECK(count > 0);
    CHECK(clusters.point_count[c] == count);
    CHECK(clusters.min_x_m[c] == low_x);
    CHECK(clusters.max_z_m[c] == high_z);
    CHECK(clusters.stamp_ns[c] == 7 * kMs);
    CHECK(clusters.sensor_mask[c] == 1);
  }
  ovt_destroy_reader(reader);
}

TEST_CASE("detector: every status has a text of its own, and the build says what it is") {
  std::set<std::string> texts;
  for (int32_t status = OVT_OK; status <= OVT_INTERNAL; ++status) texts.insert(ovt_status_text(ovt_status(status)));
  CHECK(texts.size() == OVT_INTERNAL + 1);
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
}

TEST_CASE("detector: what the callback throws is counted, and the next frame works") {
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

TEST_CASE("detector: the log hears what create chose, what is missing, and every exception caught") {
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

TEST_CASE("detector: created and destroyed many times, at any number of refused blocks, all memory is given back") {
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

TEST_CASE("detector: pushed detections in the map and in the vehicle frame give the same tracks, without any LiDAR") {
  for (const int32_t workers : {1, 2}) {
    double x[2] = {}, y[2] = {}, speed[2] = {};
    for (const int32_t reference : {OVT_REFERENCE_MAP, OVT_REFERENCE_VEHICLE}) {
      Small small(0, workers);
      small.def.push_policy = OVT_PUSH_WAIT;
      small.create();
      for (int32_t k = 0; k < 30; ++k) {
        const int64_t stamp_ns = 1 + k * 50 * kMs;
        ovt_ego_pose pose;
        ovt_ego_pose_init(&pose, sizeof pose);
        pose.stamp_ns = stamp_ns;
        pose.x_m = 100 + 2.5 * k, pose.y_m = -30, pose.yaw_rad = 0.4, pose.speed_mps = 50;
        REQUIRE(ovt_push_ego_pose(small.detector, &pose) == OVT_OK);
        const double map_x = 120 + 2 * k, map_y = 10 + k;
        const double dx = map_x - pose.x_m, dy = map_y - pose.y_m, c = std::cos(0.4), s = std::sin(0.4);
        const bool in_map = reference == OVT_REFERENCE_MAP;
        const double px = in_map ? map_x : c * dx + s * dy, py = in_map ? map_y : -s * dx + c * dy;
        ovt_external_detections d;
        ovt_external_detections_init(&d, sizeof d);
        d.stamp_ns = stamp_ns;
        d.count = 1;
        d.reference = reference;
        d.x_m = &px;
        d.y_m = &py;
        CHECK(ovt_push_detections(small.detector, &d) == OVT_OK);
        CHECK(ovt_push_detections(small.detector, &d) == OVT_DUPLICATE);
      }
      CHECK(ovt_flush(small.detector) == OVT_OK);
      ovt_reader* reader = nullptr;
      ovt_tracks tracks;
      REQUIRE(ovt_create_reader(small.detector, &reader) == OVT_OK);
      REQUIRE(ovt_next_frame(reader, nullptr) == OVT_OK);
      REQUIRE(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks) == OVT_OK);
      CHECK(small.latest.info.reference == OVT_REFERENCE_MAP);
      CHECK((small.latest.info.flags & OVT_FLAG_EXTERNAL) != 0);
      CHECK(small.latest.calls == 30);
      REQUIRE(tracks.count == 1);
      CHECK(tracks.state[0] == OVT_CONFIRMED);
      x[reference] = tracks.x_m[0], y[reference] = tracks.y_m[0], speed[reference] = tracks.speed_mps[0];
      ovt_destroy_reader(reader);
    }
    CHECK(x[0] == doctest::Approx(x[1]).epsilon(1e-9));
    CHECK(y[0] == doctest::Approx(y[1]).epsilon(1e-9));
    CHECK(x[1] == doctest::Approx(178).epsilon(0.01));
    CHECK(y[1] == doctest::Approx(39).epsilon(0.05));
    CHECK(speed[1] == doctest::Approx(20 * std::sqrt(5.0)).epsilon(0.03));
    CHECK(speed[0] == doctest::Approx(speed[1]).epsilon(1e-9));
  }
}

TEST_CASE("detector: a pushed detection's variances alone are enough, and turn with the vehicle") {
  const double at = 5, var_x = 0.04, var_y = 1.0, quarter = 1.5707963267948966;
  for (const bool turned : {false, true}) {
    Small small(0);
    small.create();
    if (turned) {
      ovt_ego_pose pose;
      ovt_ego_pose_init(&pose, sizeof pose);
      pose.yaw_rad = quarter;
      REQUIRE(ovt_push_ego_pose(small.detector, &pose) == OVT_OK);
    }
    ovt_external_detections d;
    ovt_external_detections_init(&d, sizeof d);
    d.count = 1;
    d.x_m = d.y_m = &at;
    d.var_x = &var_x;
    d.var_y = &var_y;
    REQUIRE(ovt_push_detections(small.detector, &d) == OVT_OK);
    ovt_reader* reader = nullptr;
    ovt_tracks tracks;
    REQUIRE(ovt_create_reader(small.detector, &reader) == OVT_OK);
    REQUIRE(ovt_next_frame(reader, nullptr) == OVT_OK);
    REQUIRE(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks) == OVT_OK);
    REQUIRE(tracks.count == 1);
    CHECK(tracks.covariance[0][0] == doctest::Approx(turned ? var_y : var_x));
    CHECK(tracks.covariance[2][0] == doctest::Approx(turned ? var_x : var_y));
    ovt_destroy_reader(reader);
  }
}

TEST_CASE("detector: every push of detections is counted as used or dropped") {
  Small small;
  small.create();
  const double at = 10.0;
  const auto push = [&](int64_t stamp_ns) {
    ovt_external_detections d;
    ovt_external_detections_init(&d, sizeof d);
    d.stamp_ns = stamp_ns;
    d.count = 1;
    d.x_m = d.y_m = &at;
    return ovt_push_detections(small.detector, &d);
  };
  CHECK(push(100) == OVT_OK);
  CHECK(push(100) == OVT_DUPLICATE);
  CHECK(push(50) == OVT_OK);                 // out of sequence
  CHECK(push(50 - 1000 * kMs) == OVT_OK);    // too old: taken, and dropped
  CHECK(push(200) == OVT_OK);
  ovt_stats stats;
  stats.struct_size = sizeof stats;
  REQUIRE(ovt_read_stats(small.detector, &stats) == OVT_OK);
  CHECK(stats.external == 3);
  CHECK(stats.external_dropped == 2);
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
      {"stride no multiple of the type", [](ovt_points& p) { p.x.stride = 6; }, OVT_BAD_ARGUMENT},
      {"a huge stride", [](ovt_points& p) { p.x.stride = SIZE_MAX - 3; }, OVT_BAD_ARGUMENT},
      {"x misaligned", [](ovt_points& p) { p.x.data = static_cast<const char*>(p.x.data) + 1; }, OVT_BAD_ARGUMENT},
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
    CHECK(ovt_push_scan(small.detector, &points) == row.status);
    CHECK(small.stats().pushed == 0);
  }
  const ovt_points points = posts.points(0);
  CHECK(ovt_push_scan(nullptr, &points) == OVT_BAD_ARGUMENT);
  CHECK(ovt_push_scan(small.detector, nullptr) == OVT_BAD_ARGUMENT);
  CHECK(small.latest.calls == 0);
  CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);  // the same stamp: the bad ones left no trace
  CHECK(small.latest.calls == 1);
}

TEST_CASE("detector: other bad arguments get their status, and nothing changes") {
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
  CHECK(ovt_read_tracks(reader, INT64_MAX, &tracks) == OVT_OK);  // any time is a time
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
      {[](Small& s) { static const int32_t none = 1023; s.def.cpus = &none, s.def.cpu_count = 1; }, OVT_BAD_ARGUMENT,
       "CPU 1023"},
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
      {[](Small& s) { s.sensor.struct_size = 0; }, OVT_BAD_VERSION, "sensors[0]"},
      {[](Small& s) { s.sensor.x_m = std::nan(""); }, OVT_BAD_ARGUMENT, "sensors[0].x_m"},
      {[](Small& s) { s.sensor.yaw_rad = 8; }, OVT_BAD_ARGUMENT, "yaw_rad"},
      {[](Small& s) { s.sensor.rows = 0; }, OVT_BAD_ARGUMENT, "rows"},
      {[](Small& s) { s.sensor.cols = 16385; }, OVT_BAD_ARGUMENT, "cols"},
      {[](Small& s) { s.sensor.azimuth_left_rad = -2; }, OVT_BAD_ARGUMENT, "azimuth"},
      {[](Small& s) { s.sensor.range_max_m = 0.1; }, OVT_BAD_ARGUMENT, "range_max_m"},
      {[](Small& s) { s.sensor.layer_first = -1; }, OVT_BAD_ARGUMENT, "layer_first"},
      {[](Small& s) { s.sensor.point_capacity = 0; }, OVT_BAD_ARGUMENT, "point_capacity"},
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
  char tiny[4] = "abc";
  small.def.worker_count = -1;
  CHECK(ovt_create_detector_verbose(&small.def, &out, tiny, sizeof tiny) == OVT_BAD_ARGUMENT);
  CHECK(std::strlen(tiny) == 3);
}
