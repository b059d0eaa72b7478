// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake_soak: many frames with random faults through the C API. The same seed gives the same run. In the pushing
// thread and on graphs the run must give the same hash. Memory must stay constant, and the counters must add up.
//
//   overtake_soak [--frames N] [--seed N] [--workers A,B,...]
//
// A run: three sensors, ego poses, pushed detections, readers. Sometimes a sensor is silent for a while, points are
// NaN, stamps jump, repeat or come in the wrong order, poses stop, a cloud is huge or empty, a reader is created again,
// the caller calls ovt_advance, or a scan comes in pieces of which some are lost. After the runs three threads flood a
// detector that drops scans: only counters are checked.
#include <malloc.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/frame_hash.h"
#include "tests/support/golden_scene.h"
#include "tests/support/pieces.h"
#include "tests/support/test_method.h"

using namespace overtake::test;

namespace {

constexpr int64_t kMs = 1'000'000;
constexpr int32_t kSensors = kGoldenSensors, kScene = 16, kCapacity = 4096;

struct Options {
  int64_t frames = 2000;
  uint64_t seed = 1;
  std::vector<int32_t> workers = {1, 2};
};

int32_t failures = 0;
void require(bool good, const std::string& sentence) {
  if (good) return;
  std::printf("FAILED %s\n", sentence.c_str());
  ++failures;
}

int64_t resident_kib() {
  FILE* file = std::fopen("/proc/self/statm", "r");
  long long size = 0, resident = 0;
  if (file) {
    if (std::fscanf(file, "%lld %lld", &size, &resident) != 2) resident = 0;
    std::fclose(file);
  }
  return resident * sysconf(_SC_PAGESIZE) / 1024;
}
int64_t heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return int64_t(info.uordblks) + int64_t(info.hblkhd);
}

const std::vector<GoldenPoint>& thin_cloud(std::size_t frame, int32_t sensor) {
  static std::vector<GoldenPoint> clouds[kScene][kSensors];
  std::vector<GoldenPoint>& cloud = clouds[frame % kScene][sensor];
  if (cloud.empty()) {
    const std::vector<GoldenPoint> all = golden_cloud(int32_t(frame % kScene), sensor);
    for (std::size_t i = 0; i < all.size(); i += 16) cloud.push_back(all[i]);
  }
  return cloud;
}

ovt_points points_of(const std::vector<GoldenPoint>& cloud, int32_t sensor, int64_t stamp_ns) {
  ovt_points points;
  ovt_points_init(&points, sizeof points);
  points.sensor = sensor;
  points.count = int32_t(cloud.size());
  points.stamp_ns = stamp_ns;
  const std::size_t bytes = cloud.size() * sizeof(GoldenPoint), stride = sizeof(GoldenPoint);
  const auto* p = cloud.data();
  points.x = {p ? &p->x_m : nullptr, bytes, stride, OVT_F32};
  points.y = {p ? &p->y_m : nullptr, bytes - 4, stride, OVT_F32};
  points.z = {p ? &p->z_m : nullptr, bytes - 8, stride, OVT_F32};
  points.intensity = {p ? &p->intensity : nullptr, bytes - 12, stride, OVT_F32};
  points.layer = {p ? &p->layer : nullptr, bytes - 16, stride, OVT_U16};
  points.time = {p ? &p->time_ns : nullptr, bytes - 20, stride, OVT_U32};
  return points;
}

struct Counts {
  int64_t frames = 0, next_sequence = 0, holes = 0, not_finite = 0, tracks = 0, detections = 0;
  int64_t alive = 0;  // tracks of the last frame
  uint64_t hash = 0;
};

void check_frame(ovt_reader* reader, void* user) {
  auto& counts = *static_cast<Counts*>(user);
  ovt_frame_info info;
  ovt_tracks t;
  if (ovt_read_info(reader, &info) != OVT_OK || ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &t) != OVT_OK) {
    ++counts.holes;
    return;
  }
  counts.holes += info.sequence != counts.next_sequence++;
  for (int32_t i = 0; i < t.count; ++i)
    for (const double* c : {t.x_m, t.y_m, t.speed_mps, t.course_rad, t.yaw_rate_rps, t.heading_rad, t.covariance[0],
                            t.covariance[14], t.existence, t.unseen_s, t.heading_sigma_rad})
      counts.not_finite += c && !std::isfinite(c[i]);  // null: a column that the preset does not have
  const FrameHash hash(reader, kSensors);
  counts.hash = (counts.hash ^ hash.value()) * 0x9e3779b97f4a7c15u;
  counts.hash ^= counts.hash >> 29;
  ++counts.frames;
  counts.tracks += t.count;
  counts.alive = t.count;
  counts.detections += info.detection_count;
}

struct Pushed {
  int64_t scans = 0, poses = 0, externals = 0;
};

class Story {
 public:
  Story(const Options& options, int32_t workers) : random_(options.seed), sensors_(golden_sensors()) {
    for (ovt_sensor_def& sensor : sensors_) sensor.cols = 107, sensor.point_capacity = kCapacity;
    cloud_.reserve(3 * kCapacity);  // reserved: it must not grow while the test watches the heap
    params_ = overtake::test::test_params();
    params_.tracker_confirm_hits = 3, params_.tracker_keep_hits = 2;
    def_ = ovt_default_detector_def();
    def_.sensors = sensors_.data();
    def_.sensor_count = kSensors;
    def_.params = &params_;
    def_.map = &map_.def;
    def_.worker_count = workers;
    def_.keep_images = options.seed % 2 == 0 ? 0 : 1;
    def_.push_policy = OVT_PUSH_WAIT;
    def_.stream = 1;
    def_.cluster_capacity = 200, def_.candidate_capacity = 60, def_.track_capacity = 40;
    def_.on_frame = check_frame;
    def_.user = &counts;
  }
  Story(const Story&) = delete;

  bool tell(const Options& options) {
    if (ovt_create_detector(&def_, &detector_) != OVT_OK) return false;
    require(ovt_create_reader(detector_, &reader_) == OVT_OK, "no reader");
    int64_t rss_start = 0, heap_start = 0, rss_most = 0;
    const int64_t warm = options.frames / 10;
    for (int64_t k = 0; k < options.frames; ++k) {
      step(k);
      if (k == warm) rss_start = resident_kib(), heap_start = heap_bytes();
      if (k >= warm && k % 512 == 0) rss_most = std::max(rss_most, resident_kib());
    }
    require(ovt_flush(detector_) == OVT_OK, "flush");
    const int64_t heap_end = heap_bytes();
    rss_most = std::max(rss_most, resident_kib());
    ovt_stats stats = ovt_default_stats();
    ovt_read_stats(detector_, &stats);
    std::printf(
        "%d workers: %lld frames, %lld detections, %lld tracks; scans %lld = %lld used + %lld dropped + %lld late "
        "+ %lld twice; exceptions %lld; memory +%lld KiB, heap +%lld bytes; hash %016llx\n",
        def_.worker_count, (long long)counts.frames, (long long)counts.detections, (long long)counts.tracks,
        (long long)stats.pushed, (long long)stats.used, (long long)stats.dropped, (long long)stats.late,
        (long long)stats.dup, (long long)stats.exceptions, (long long)(rss_most - rss_start),
        (long long)(heap_end - heap_start), (unsigned long long)counts.hash);
    require(stats.pushed == pushed.scans, "a push was not counted, or counted twice");
    require(stats.pushed == stats.used + stats.dropped + stats.late + stats.dup, "the scans do not add up");
    require(stats.dropped == 0 || stats.clock_jumps > 0, "a scan was dropped though pushes wait");
    require(stats.ego_poses + stats.ego_dropped == pushed.poses, "the poses do not add up");
    require(stats.external + stats.external_dropped == pushed.externals, "the pushed detections do not add up");
    require(stats.frames == counts.frames && counts.holes == 0, "frames are missing or out of order");
    require(stats.exceptions == 0, "exceptions were caught");
    require(counts.not_finite == 0, "a track's number is not finite");
    const int64_t alive = stats.tracks_born - stats.tracks_missed - stats.tracks_silent - stats.tracks_displaced -
                          stats.tracks_unsound - stats.tracks_forgotten - stats.tracks_joined;
    require(alive >= counts.alive && alive <= def_.track_capacity, "the tracks do not add up");
    require(counts.tracks > counts.frames / 10 && counts.detections > counts.frames / 10, "hardly a track: no story");
    require(rss_most - rss_start < 2048, "resident memory grew");
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    require(heap_end - heap_start < 4096, "the heap grew");
#endif
    ovt_destroy_detector(detector_);  // the reader must outlive the detector
    require(ovt_next_frame(reader_, nullptr) == OVT_NO_FRAME, "a frame after the end");
    ovt_destroy_reader(reader_);
    return true;
  }

  Counts counts;
  Pushed pushed;

 private:
  int32_t in(int32_t low, int32_t high) { return low + int32_t(random_() % uint32_t(high - low + 1)); }
  bool chance(int32_t of_1000) { return int32_t(random_() % 1000) < of_1000; }

  // A stamp that does not grow has a fixed order only if its neighbours are finished.
  void settle() { require(ovt_flush(detector_) == OVT_OK, "flush"); }

  void push_scan(int64_t k, int32_t sensor, int64_t stamp_ns) {
    cloud_ = thin_cloud(std::size_t(k), sensor);
    if (chance(5)) cloud_.clear();
    if (chance(5))
      while (cloud_.size() < std::size_t(kCapacity))
        cloud_.push_back(cloud_.empty() ? GoldenPoint{} : cloud_[cloud_.size() / 2]);
    if (chance(30)) {
      const int32_t bad = in(1, 999);
      for (GoldenPoint& point : cloud_)
        if (chance(bad)) point.x_m = chance(500) ? std::numeric_limits<float>::quiet_NaN() : 1e30f;
    }
    const ovt_points points = points_of(cloud_, sensor, stamp_ns);
    if (chance(300)) return push_pieces(points);
    const ovt_status status = ovt_push_scan(detector_, &points);
    require(status == OVT_OK || status == OVT_DUPLICATE || status == OVT_LATE, ovt_status_text(status));
    ++pushed.scans;
    if (chance(10)) {  // a repeated scan
      ovt_push_scan(detector_, &points);
      ++pushed.scans;
    }
  }

  // Some pieces are lost or doubled. A stamp that is repeated makes all of them late.
  void push_pieces(const ovt_points& points) {
    bool late = false;
    for (int32_t first = 0; first < points.count && !late;) {
      const int32_t last = std::min(points.count, first + in(1, 300));
      const ovt_points piece = piece_of(points, first, last);
      first = last;
      if (chance(20)) continue;
      const ovt_status status = ovt_push_points(detector_, &piece);
      require(status == OVT_OK || status == OVT_LATE, ovt_status_text(status));
      late = status == OVT_LATE;
      if (!late && chance(20)) require(ovt_push_points(detector_, &piece) == OVT_DUPLICATE, "a doubled piece was used");
    }
    const ovt_status status = ovt_end_scan(detector_, points.sensor, points.stamp_ns, points.count);
    require(status == OVT_OK || status == OVT_LATE, ovt_status_text(status));
    pushed.scans += status == OVT_OK;
  }

  void step(int64_t k) {
    now_ns_ += 50 * kMs;
    if (chance(2)) {  // the clock jumps
      settle();
      now_ns_ += (chance(500) ? 1 : -1) * in(100, 4000) * kMs;
      if (chance(100)) now_ns_ = chance(500) ? 0 : int64_t(random_());
    }
    if (chance(4)) silent_until_[in(0, kSensors - 1)] = k + in(1, 60);
    if (chance(2)) ego_silent_until_ = k + in(1, 30);
    if (k >= ego_silent_until_)
      for (int32_t i = 0; i < 3; ++i) {
        ovt_ego_pose pose = golden_ego(now_ns_ % (8000 * kMs) + i * 20 * kMs);
        pose.stamp_ns = now_ns_ + i * 20 * kMs;
        ovt_push_ego_pose(detector_, &pose);
        ++pushed.poses;
      }
    for (int32_t s = 0; s < kSensors; ++s) {
      if (k < silent_until_[s]) continue;
      if (chance(3)) {  // a scan that should have come earlier
        settle();
        push_scan(k, s, now_ns_ - in(1, 700) * kMs);
        settle();
      }
      push_scan(k, s, now_ns_ + s * kMs);
    }
    if (chance(50)) {
      double x[3], y[3];
      for (int32_t i = 0; i < 3; ++i) x[i] = in(-300, 600) * 0.1, y[i] = in(-60, 80) * 0.1;
      ovt_external_detections d;
      ovt_external_detections_init(&d, sizeof d);
      d.stamp_ns = now_ns_ + 10 * kMs;
      d.count = in(0, 3);
      d.x_m = x, d.y_m = y;
      ovt_push_detections(detector_, &d);
      ++pushed.externals;
    }
    if (chance(100)) ovt_advance(detector_, now_ns_ + in(0, 45) * kMs);
    if (chance(20)) {
      settle();
      if (ovt_next_frame(reader_, nullptr) == OVT_OK) {
        ovt_tracks tracks;
        require(ovt_read_tracks(reader_, now_ns_ + in(-500, 500) * kMs, &tracks) == OVT_OK, "no tracks");
      }
    }
    if (chance(20)) {
      ovt_destroy_reader(reader_);
      reader_ = nullptr;
      require(ovt_create_reader(detector_, &reader_) == OVT_OK, "no reader");
    }
  }

  std::mt19937_64 random_;
  std::vector<ovt_sensor_def> sensors_;
  GoldenMap map_;
  ovt_params params_;
  ovt_detector_def def_;
  ovt_detector* detector_ = nullptr;
  ovt_reader* reader_ = nullptr;
  std::vector<GoldenPoint> cloud_;
  int64_t now_ns_ = 1000 * kMs, silent_until_[kSensors] = {}, ego_silent_until_ = 0;
};

// Three threads push as fast as they can; scans without room are dropped and counted.
void flood(const Options& options) {
  std::vector<ovt_sensor_def> sensors = golden_sensors();
  for (ovt_sensor_def& sensor : sensors) sensor.cols = 107, sensor.point_capacity = kCapacity;
  Counts counts;
  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = sensors.data();
  def.sensor_count = kSensors;
  def.worker_count = 2;
  def.on_frame = check_frame;
  def.user = &counts;
  ovt_detector* detector = nullptr;
  if (ovt_create_detector(&def, &detector) != OVT_OK) return require(false, "no detector for the flood");
  const int64_t scans = options.frames;
  for (std::size_t k = 0; k < kScene; ++k)
    for (int32_t s = 0; s < kSensors; ++s) thin_cloud(k, s);
  const int64_t rss_start = resident_kib();
  std::vector<std::thread> threads;
  for (int32_t s = 0; s < kSensors; ++s)
    threads.emplace_back([=] {
      for (int64_t k = 0; k < scans; ++k) {
        const ovt_points points = points_of(thin_cloud(std::size_t(k), s), s, k * 5 * kMs + s);
        ovt_push_scan(detector, &points);
      }
    });
  for (std::thread& thread : threads) thread.join();
  ovt_flush(detector);
  ovt_stats stats = ovt_default_stats();
  ovt_read_stats(detector, &stats);
  const int64_t grown = resident_kib() - rss_start;
  std::printf("flood: scans %lld = %lld used + %lld dropped + %lld late; %lld frames; memory +%lld KiB\n",
              (long long)stats.pushed, (long long)stats.used, (long long)stats.dropped, (long long)stats.late,
              (long long)stats.frames, (long long)grown);
  require(stats.pushed == kSensors * scans, "the flood: a push was not counted");
  require(stats.pushed == stats.used + stats.dropped + stats.late + stats.dup, "the flood does not add up");
  require(stats.frames == counts.frames && counts.holes == 0, "the flood: frames are missing or out of order");
  require(grown < 8192, "the flood: resident memory grew");
  ovt_destroy_detector(detector);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    const char* value = i + 1 < argc ? argv[i + 1] : nullptr;
    if (value && name == "--frames") {
      options.frames = std::atoll(value), ++i;
    } else if (value && name == "--seed") {
      options.seed = std::strtoull(value, nullptr, 10), ++i;
    } else if (value && name == "--workers") {
      options.workers.clear();
      for (const char* at = value; *at; at += *at == ',') {
        char* end;
        options.workers.push_back(int32_t(std::strtol(at, &end, 10)));
        if (end == at) break;
        at = end;
      }
      ++i;
    } else {
      std::fprintf(stderr, "usage: overtake_soak [--frames N] [--seed N] [--workers A,B,...]\n");
      return 2;
    }
  }
  if (options.frames < 100 || options.workers.empty()) {
    std::fprintf(stderr, "overtake_soak: at least 100 frames and one worker\n");
    return 2;
  }
  std::vector<uint64_t> hashes;
  for (const int32_t workers : options.workers) {
    Story story(options, workers);
    if (!story.tell(options)) {
      require(false, "no detector");
      break;
    }
    hashes.push_back(story.counts.hash);
  }
  for (const uint64_t hash : hashes) require(hash == hashes[0], "the same story has another hash");
  flood(options);
  std::printf("seed %llu: %s\n", (unsigned long long)options.seed, failures ? "FAILED" : "passed");
  return failures ? 1 : 0;
}
