// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One source's clock is wrong, and the other sources lose nothing: tests through the C API. Every sensor of the rig
// sees a separate car, which stands straight ahead of it; the pushed detections see one, too. After a good start the
// stamps of one source become wrong. Then all scans of the other sensors must be used, their cars' tracks must keep id
// and state, and the frames must name the faulty source and no other.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "tests/support/detector_bench.h"

using namespace overtake::test;

namespace {

constexpr int64_t kMs = 1'000'000, kPeriodNs = 50 * kMs, kStartNs = 1'000'000 * kMs;
constexpr int32_t kGoodRounds = 24, kRounds = 72;  // 48 rounds with the fault: 2.4 s
constexpr int32_t kDetections = 8, kEgo = 9;       // sources after the sensors, as in suspect_mask
constexpr double kPi = 3.14159265358979323846, kCarAheadM = 12.0, kRadarX = 3.0, kRadarY = -4.0;

// The rear of a car, and the road, in 12 x 40 pixels over +-20 degrees.
struct CarScan {
  CarScan() {
    for (int32_t r = 0; r < 12; ++r)
      for (int32_t c = 0; c < 40; ++c) {
        const double elevation = 0.06 - 0.02 * r, azimuth = (19.5 - c) * kPi / 180, up = std::tan(elevation);
        const double left = std::tan(azimuth);
        const bool on_car = std::fabs(kCarAheadM * left) < 0.95 && std::fabs(kCarAheadM * up / std::cos(azimuth)) < 0.8;
        const double ahead = on_car ? kCarAheadM : up < -0.01 ? -1.2 / up * std::cos(azimuth) : 0;
        if (ahead <= 0 || ahead > 100) continue;
        x.push_back(float(ahead));
        y.push_back(float(ahead * left));
        z.push_back(float(ahead * up / std::cos(azimuth)));
        layer.push_back(uint8_t(r));
      }
  }
  std::vector<float> x, y, z;
  std::vector<uint8_t> layer;
};

enum class Kind { kNone, kConstant, kDrift, kJitter, kOnce, kOneInN };

struct Story {
  int32_t sensors = 3, workers = 1;
  bool ego = false, detections = false;
  int32_t source = 0;  // the faulty source: a sensor, kDetections or kEgo
  Kind kind = Kind::kNone;
  int64_t offset_ns = 0;
  int32_t n = 1;                       // one in n
  int32_t gap_after = -1, gap_ms = 0;  // all sources pause
  uint32_t seed = 1;
  bool every_order = true;                                  // all orders of the sensors in a round
  std::array<int32_t, 8> every = {1, 1, 1, 1, 1, 1, 1, 1};  // a sensor's period, in rounds
  int32_t detections_a_round = 1, detections_from = 0;      // pushes, from this round on
};

struct Outcome {
  ovt_stats stats = ovt_default_stats();
  std::array<int32_t, 8> pushed = {}, used = {};
  int32_t detections_pushed = 0;
  int32_t poses_pushed = 0, poses_wrong = 0;
  std::vector<ovt_frame_info> frames;
  uint32_t named = 0;  // sources named by the frames after the fault
  std::array<int32_t, 9> lost =
      {};  // frames after the start without the confirmed track of sensor s, or of the detections
};

class Run {
 public:
  explicit Run(const Story& story) : story_(story), random_(story.seed) {
    params_ = ovt_default_params();
    params_.tracker_confirm_hits = 3;
    params_.tracker_keep_hits = 2;
    for (int32_t s = 0; s < story.sensors; ++s) {
      ovt_sensor_def& sensor = sensors_[std::size_t(s)];
      sensor = ovt_default_sensor_def();
      sensor.z_m = 1.2;
      sensor.yaw_rad = yaw_of(s);
      sensor.rows = 12, sensor.cols = 40;
      sensor.azimuth_left_rad = 20 * kPi / 180, sensor.azimuth_right_rad = -sensor.azimuth_left_rad;
      sensor.point_capacity = 480;
    }
    ovt_detector_def def = ovt_default_detector_def();
    def.sensors = sensors_.data();
    def.sensor_count = story.sensors;
    def.params = &params_;
    def.worker_count = story.workers;
    def.push_policy = OVT_PUSH_WAIT;
    def.cluster_capacity = def.candidate_capacity = def.track_capacity = 32;
    def.user = this;
    def.on_frame = [](ovt_reader* reader, void* user) { static_cast<Run*>(user)->look(reader); };
    REQUIRE(ovt_create_detector(&def, &detector_) == OVT_OK);
    for (int32_t s = 0; s < 8; ++s) phase_ns_[s] = int64_t(random_() % 25) * kMs;
  }
  Run(const Run&) = delete;
  ~Run() { ovt_destroy_detector(detector_); }

  Outcome go() {
    for (int32_t k = 0; k < kRounds; ++k) {
      round_ = k;
      const int64_t gap_ns = story_.gap_after >= 0 && k > story_.gap_after ? story_.gap_ms * kMs : 0;
      push_round(k, kStartNs + k * kPeriodNs + gap_ns);
    }
    REQUIRE(ovt_flush(detector_) == OVT_OK);
    REQUIRE(ovt_read_stats(detector_, &out_.stats) == OVT_OK);
    return out_;
  }

 private:
  double yaw_of(int32_t s) const { return 2 * kPi * s / story_.sensors; }
  double uniform() { return double(random_() % 20001) / 10000 - 1; }  // -1 to 1

  // Error of the faulty source's stamps in a round.
  int64_t wrong_by(int32_t source, int32_t k) {
    if (source != story_.source || k < kGoodRounds) return 0;
    const int32_t i = k - kGoodRounds;
    switch (story_.kind) {
      case Kind::kNone: return 0;
      case Kind::kConstant: return story_.offset_ns;
      case Kind::kDrift: return story_.offset_ns * (i + 1) / (kRounds - kGoodRounds);
      case Kind::kJitter: return int64_t(uniform() * double(story_.offset_ns));
      case Kind::kOnce: return i == 0 ? story_.offset_ns : 0;
      case Kind::kOneInN: return i % story_.n == 0 ? story_.offset_ns : 0;
    }
    return 0;
  }
  void push_round(int32_t k, int64_t stamp_ns) {
    if (story_.ego)
      for (int64_t i = 0; i < 5; ++i) {
        // kOnce means one pose, kOneInN one pose of every n-th round.
        const bool single = story_.kind == Kind::kOnce || story_.kind == Kind::kOneInN;
        push_pose(stamp_ns + i * 10 * kMs, single && i > 0 ? 0 : wrong_by(kEgo, k));
      }
    std::vector<int32_t> order;
    for (int32_t s = 0; s < story_.sensors; ++s)
      if (k % story_.every[std::size_t(s)] == 0) order.push_back(s);
    if (story_.every_order) std::shuffle(order.begin(), order.end(), random_);
    for (const int32_t s : order) {
      ovt_points p;
      ovt_points_init(&p, sizeof p);
      p.sensor = s;
      p.count = int32_t(scan_.x.size());
      p.stamp_ns = stamp_ns + phase_ns_[s] + wrong_by(s, k);
      p.x = column_of(scan_.x, OVT_F32);
      p.y = column_of(scan_.y, OVT_F32);
      p.z = column_of(scan_.z, OVT_F32);
      p.layer = column_of(scan_.layer, OVT_U8);
      const ovt_status status = ovt_push_scan(detector_, &p);
      REQUIRE((status == OVT_OK || (status == OVT_DUPLICATE && s == story_.source)));
      ++out_.pushed[std::size_t(s)];
    }
    if (!story_.detections || k < story_.detections_from) return;
    for (int32_t i = 0; i < story_.detections_a_round; ++i) {
      ovt_external_detections d;
      ovt_external_detections_init(&d, sizeof d);
      d.stamp_ns = stamp_ns + 26 * kMs + i * kPeriodNs / story_.detections_a_round + wrong_by(kDetections, k);
      d.count = 1;
      d.reference = OVT_REFERENCE_VEHICLE;
      d.x_m = &kRadarX, d.y_m = &kRadarY;
      REQUIRE(ovt_push_detections(detector_, &d) == OVT_OK);
      ++out_.detections_pushed;
    }
  }
  void push_pose(int64_t stamp_ns, int64_t wrong_ns) {
    ovt_ego_pose pose;
    ovt_ego_pose_init(&pose, sizeof pose);
    pose.stamp_ns = stamp_ns + wrong_ns;
    const ovt_status status = ovt_push_ego_pose(detector_, &pose);
    CHECK((status == OVT_OK || status == OVT_LATE || status == OVT_DUPLICATE));
    ++out_.poses_pushed;
    out_.poses_wrong += wrong_ns != 0;
  }
  void look(ovt_reader* reader) {
    ovt_frame_info info;
    ovt_tracks t;
    REQUIRE(ovt_read_info(reader, &info) == OVT_OK);
    REQUIRE(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &t) == OVT_OK);
    out_.frames.push_back(info);
    for (int32_t s = 0; s < story_.sensors; ++s) out_.used[std::size_t(s)] += int32_t(info.sensor_mask >> s & 1u);
    out_.named |= info.suspect_mask;
    // The car of a sensor, or of the detections: its first confirmed track.
    for (int32_t s = 0; s < 9; ++s) {
      if (s < 8 ? s >= story_.sensors : !story_.detections) continue;
      const double x = s < 8 ? kCarAheadM * std::cos(yaw_of(s)) : kRadarX;
      const double y = s < 8 ? kCarAheadM * std::sin(yaw_of(s)) : kRadarY;
      bool there = false;
      for (int32_t i = 0; i < t.count; ++i) {
        if (t.state[i] != OVT_CONFIRMED) continue;
        const bool near = std::hypot(t.x_m[i] - x, t.y_m[i] - y) < 4;  // to the middle of a whole car
        if (id_[s] == 0 && near) id_[s] = t.id[i];
        there |= t.id[i] == id_[s] && near;
      }
      if (info.stamp_ns > kStartNs + (kGoodRounds - 4) * kPeriodNs && !there) ++out_.lost[std::size_t(s)];
    }
  }

  Story story_;
  std::mt19937 random_;
  CarScan scan_;
  std::array<ovt_sensor_def, 8> sensors_;
  ovt_params params_;
  ovt_detector* detector_ = nullptr;
  int64_t phase_ns_[8] = {};
  int32_t round_ = 0;
  uint64_t id_[9] = {};
  Outcome out_;
};

std::string text_of(const Story& s) {
  static const char* const kKinds[] = {"none", "constant", "drift", "jitter", "once", "one in n"};
  return "seed " + std::to_string(s.seed) + ": " + std::to_string(s.sensors) + " sensors, " +
         std::to_string(s.workers) + " workers" + (s.ego ? ", ego" : "") + (s.detections ? ", detections" : "") +
         ", source " + std::to_string(s.source) + " " + kKinds[int32_t(s.kind)] + " " +
         std::to_string(double(s.offset_ns) * 1e-9) + " s, n " + std::to_string(s.n);
}

// Must hold in every run: everything of the other sources is used, and no other source is named.
void check_others(const Story& story, const Outcome& out) {
  CHECK(adds_up(out.stats));
  CHECK(out.stats.clock_jumps == 0);
  for (int32_t s = 0; s < story.sensors; ++s) {
    if (s == story.source) continue;
    CAPTURE(s);
    CHECK(out.used[std::size_t(s)] == out.pushed[std::size_t(s)]);
    // Ego poses that are ahead for long are not used, like poses that stopped: then tracks are predicted, and deleted.
    const bool poses_fail = story.source == kEgo && story.kind != Kind::kOnce && story.kind != Kind::kOneInN;
    if (!poses_fail) CHECK(out.lost[std::size_t(s)] == 0);
  }
  if (story.detections && story.source != kDetections) {
    CHECK(out.stats.external == out.detections_pushed);
    if (story.source != kEgo) CHECK(out.lost[8] == 0);
  }
  CHECK((out.named & ~(1u << story.source)) == 0);
  for (const ovt_frame_info& info : out.frames)
    CHECK((info.suspect_mask != 0) == ((info.flags & OVT_FLAG_CLOCK_SUSPECT) != 0));
}

// Whether the stamp is certainly wrong, at any phase and position in the round.
bool is_plain(const Story& story) {
  const int64_t ahead = story.offset_ns;
  if (story.kind == Kind::kJitter) return std::abs(ahead) > 1500 * kMs;  // some of the 48 are
  if (story.kind == Kind::kDrift) return ahead > 700 * kMs || ahead < -800 * kMs;
  return ahead > 160 * kMs || ahead < -700 * kMs;
}

Story draw(uint32_t seed) {
  std::mt19937 random(seed);
  const auto in = [&](int32_t low, int32_t high) { return low + int32_t(random() % uint32_t(high - low + 1)); };
  Story s;
  s.seed = seed;
  s.sensors = in(1, 8);
  s.workers = in(1, 2);
  s.ego = in(0, 1) != 0;
  s.detections = in(0, 1) != 0;
  std::vector<int32_t> sources;
  if (s.sensors > 1)  // a single sensor has no others that could lose scans
    for (int32_t i = 0; i < s.sensors; ++i) sources.push_back(i);
  if (s.detections || s.sensors == 1) sources.push_back(kDetections), s.detections = true;
  if (s.ego) sources.push_back(kEgo);
  s.source = sources[std::size_t(in(0, int32_t(sources.size()) - 1))];
  s.kind = Kind(in(1, 5));
  s.offset_ns = int64_t(in(-2000, 2000)) * kMs + 1234;  // never equal to another scan's stamp of that sensor
  s.n = in(2, 8);
  // Of two sensors that drift apart, either may be right: the one ahead is the suspect.
  if (s.sensors == 2 && s.source < 2 && s.kind == Kind::kDrift) s.offset_ns = std::abs(s.offset_ns);
  return s;
}

void check_seeds(uint32_t first, uint32_t count) {
  for (uint32_t seed = first; seed < first + count; ++seed) {
    const Story story = draw(seed);
    const Outcome out = Run(story).go();
    const std::string text = text_of(story);
    CAPTURE(text);
    check_others(story, out);
    if (is_plain(story)) CHECK((out.named >> story.source & 1u) == 1);
  }
}

}  // namespace

TEST_CASE("clock: if one source is wrong by up to 2 s in any way, the others lose nothing") { check_seeds(1, 60); }

TEST_SUITE("long") {
  TEST_CASE("clock: if one source is wrong by up to 2 s in any way, the others lose nothing (many seeds)") {
    check_seeds(1000, 3000);
  }
}

TEST_CASE("clock: a sensor that stays 0.1 to 10 s ahead loses only its own scans") {
  for (const int64_t ms : {105, 115, 125, 150, 300, 490, 550, 700, 900, 990, 1200, 10'000}) {
    CAPTURE(ms);
    const Story story{.source = 1, .kind = Kind::kConstant, .offset_ns = ms * kMs};
    const Outcome out = Run(story).go();
    check_others(story, out);
    // The other two share a frame in each round.
    const auto together = std::count_if(out.frames.begin(), out.frames.end(),
                                        [](const ovt_frame_info& info) { return (info.sensor_mask & 5u) == 5u; });
    CHECK(together == kRounds);
    CHECK(out.named == 2u);
    CHECK(out.used[1] == kGoodRounds);
    CHECK(out.stats.late == kRounds - kGoodRounds);
    CHECK(out.stats.dropped == 0);
  }
}

TEST_CASE("clock: a single scan ahead, or one in n, loses only itself") {
  for (const int32_t sensors : {2, 3, 8})
    for (const int64_t ms : {110, 200, 600, 900, 1500})
      for (const int32_t n : {0, 8}) {
        CAPTURE(sensors);
        CAPTURE(ms);
        const Story story{.sensors = sensors,
                          .source = 1,
                          .kind = n ? Kind::kOneInN : Kind::kOnce,
                          .offset_ns = ms * kMs,
                          .n = std::max(n, 1)};
        const Outcome out = Run(story).go();
        check_others(story, out);
        CHECK(out.named == 2u);
        CHECK(out.stats.late == (n ? 6 : 1));
        CHECK(out.stats.used == out.stats.pushed - out.stats.late);
        CHECK(out.lost[1] == 0);
        CHECK(out.frames.back().suspect_mask == 0);  // a source that is good again is no longer named
      }
}

TEST_CASE("clock: pushed detections that are ahead never move the sensors' clock") {
  for (const int32_t sensors : {1, 3})
    for (const int64_t ms : {200, 450, 900, 2000})
      for (const int32_t n : {0, 1, 8}) {
        CAPTURE(ms);
        const Story story{.sensors = sensors,
                          .detections = true,
                          .source = kDetections,
                          .kind = n ? Kind::kOneInN : Kind::kOnce,
                          .offset_ns = ms * kMs,
                          .n = std::max(n, 1)};
        const Outcome out = Run(story).go();
        check_others(story, out);
        CHECK(out.stats.used == out.stats.pushed);
        CHECK(out.stats.external_dropped == (n == 1 ? kRounds - kGoodRounds : n == 8 ? 6 : 1));
        CHECK(out.named == OVT_SUSPECT_DETECTIONS);
      }
}

TEST_CASE("clock: detections of a wrong clock that begin late, several in each scan's period, move no clock") {
  for (const int32_t sensors : {1, 3})
    for (const int32_t a_round : {3, 5, 10})
      for (const int64_t ms : {37'000, 700, -1000}) {
        CAPTURE(sensors);
        CAPTURE(a_round);
        CAPTURE(ms);
        const Story story{.sensors = sensors,
                          .detections = true,
                          .source = kDetections,
                          .kind = Kind::kConstant,
                          .offset_ns = ms * kMs,
                          .detections_a_round = a_round,
                          .detections_from = kGoodRounds};
        const Outcome out = Run(story).go();
        check_others(story, out);
        CHECK(out.stats.used == out.stats.pushed);
        CHECK(out.stats.tracks_forgotten == 0);
        CHECK(out.stats.external_dropped == out.detections_pushed);
        CHECK(out.named == OVT_SUSPECT_DETECTIONS);
      }
}

TEST_CASE("clock: an ego pose that is ahead costs no other pose") {
  for (const int64_t ms : {100, 450, 2000})
    for (const int32_t n : {0, 4}) {
      CAPTURE(ms);
      const Story story{.ego = true,
                        .source = kEgo,
                        .kind = n ? Kind::kOneInN : Kind::kOnce,
                        .offset_ns = ms * kMs,
                        .n = std::max(n, 1)};
      const Outcome out = Run(story).go();
      check_others(story, out);
      CHECK(out.poses_wrong == (n ? 12 : 1));
      CHECK(out.stats.ego_dropped == out.poses_wrong);
      CHECK(out.stats.ego_poses == out.poses_pushed - out.poses_wrong);
      CHECK(out.named == OVT_SUSPECT_EGO);
    }
}

TEST_CASE("clock: ego poses that stay ahead are not used but named, as if they had stopped") {
  for (const int64_t ms : {200, 700}) {
    CAPTURE(ms);
    const Story story{.ego = true, .source = kEgo, .kind = Kind::kConstant, .offset_ns = ms * kMs};
    const Outcome out = Run(story).go();
    check_others(story, out);
    CHECK(out.named == OVT_SUSPECT_EGO);
    CHECK(out.frames.back().suspect_mask == OVT_SUSPECT_EGO);
    CHECK(out.frames.back().ego_known == 0);
    CHECK((out.frames.back().flags & OVT_FLAG_EGO_STALE) != 0);
  }
}

TEST_CASE("clock: a pause of all sources loses nothing, in any order of return and with any number of sensors") {
  for (int32_t sensors = 1; sensors <= 8; ++sensors)
    for (const int32_t gap_ms : {100, 300, 600, 940})
      for (const int32_t workers : {1, 2}) {
        CAPTURE(sensors);
        CAPTURE(gap_ms);
        const Story story{.sensors = sensors,
                          .workers = workers,
                          .ego = sensors % 2 == 0,
                          .source = -1,
                          .gap_after = kGoodRounds,
                          .gap_ms = gap_ms,
                          .seed = uint32_t(sensors * 100 + gap_ms)};
        const Outcome out = Run(story).go();
        CHECK(out.stats.used == out.stats.pushed);
        CHECK(out.stats.clock_jumps == 0);
        CHECK(out.named == 0);
        for (int32_t s = 0; s < sensors; ++s) CHECK(out.lost[std::size_t(s)] == 0);
      }
}

TEST_CASE("clock: a sensor that delivers one scan in n costs the others nothing") {
  for (const int32_t sensors : {2, 3})
    for (int32_t n = 2; n <= 20; ++n) {
      CAPTURE(sensors);
      CAPTURE(n);
      Story story{.sensors = sensors, .source = -1};
      story.every.fill(1);
      for (int32_t i = 1; i < sensors; ++i) story.every[std::size_t(i)] = n;
      const Outcome out = Run(story).go();
      CHECK(out.stats.used == out.stats.pushed);
      CHECK(out.named == 0);
    }
}

TEST_CASE("clock: sensors with half the rate are classified by their own interval") {
  for (uint32_t seed = 1; seed <= 6; ++seed) {
    CAPTURE(seed);
    Story story{.sensors = 4, .detections = true, .source = -1, .seed = seed};
    story.every = {1, 2, 2, 2, 1, 1, 1, 1};
    const Outcome none = Run(story).go();
    CHECK(none.stats.used == none.stats.pushed);
    CHECK(none.named == 0);
    story.source = int32_t(seed % 4);
    story.kind = Kind::kConstant;
    story.offset_ns = 700 * kMs;
    const Outcome out = Run(story).go();
    check_others(story, out);
    CHECK(out.named == 1u << story.source);
  }
}
