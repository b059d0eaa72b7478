// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The code that all trackers share, with a policy of this test: its state is larger than its published row, and its
// path needs the whole state.
#include <doctest/doctest.h>

#include <vector>

#include "pipeline/track/replay_tracker.h"

namespace {

using namespace overtake;

constexpr int64_t kMs = 1'000'000;
constexpr int32_t kModels = 40;

// Tracks one car at most. Each model has a different speed; the measurement's width selects the model.
struct ManyModels {
  double x_m;
  double speed_mps[kModels];
  int32_t model, hits;
};

class ManyModelsPolicy {
 public:
  using State = ManyModels;
  ManyModelsPolicy(const TrackerParams& params, const CircuitMap*, const Allocator&) : step_s_(params.horizon_step_s) {}

  void predict(State& s, double dt_s) const { s.x_m += s.speed_mps[s.model] * dt_s; }
  Place place(const State& s) const { return {s.x_m, 0}; }
  bool is_sound(const State&) const { return true; }
  Effort associate(const TrackView<State>& tracks, const Iteration& it, int32_t* measurement_of_slot) {
    for (int32_t slot = 0; slot < tracks.slot_count; ++slot)
      measurement_of_slot[slot] = slot == 0 && tracks.head[0].alive && it.count > 0 ? 0 : -1;
    return {.work = it.count, .limited = false};
  }
  void update(int32_t, State& s, double, const Measurement& z) const {
    s.x_m = z.x_m;
    s.model = int32_t(z.width_m);
    ++s.hits;
  }
  State initiate(const Measurement& z, const Iteration&) const {
    State s{};
    for (int32_t k = 0; k < kModels; ++k) s.speed_mps[k] = k;
    update(0, s, 0, z);
    return s;
  }
  bool record(int32_t, State&, bool) const { return true; }
  bool is_confirmed(const State&) const { return true; }
  State publishable(const State& s, bool) const { return s; }
  void write(const State& s, TrackTable& t, std::size_t i) const {
    t.x_m[i] = s.x_m;
    t.hits[i] = s.hits;
  }
  void write_paths(std::span<const State> states, PathTable& t) const {
    for (State s : states)
      for (int32_t k = 0; k < t.points_per_track; ++k) {
        predict(s, step_s_);
        t.x_m[t.count++] = s.x_m;
      }
  }

 private:
  double step_s_;
};

struct Bench {
  ReplayTracker<ManyModelsPolicy> tracker{params(), nullptr};
  Arena arena;
  TrackTable rows, tracks;
  PathTable paths;
  std::byte* states = nullptr;

  Bench() {
    REQUIRE(arena.build(default_allocator(), [this](Carver& carver) {
      carve_table(carver, rows, 4);
      carve_table(carver, tracks, 4);
      carve_table(carver, paths, 4 * tracker.path_points());
      paths.points_per_track = tracker.path_points();
      states = carver.take<std::byte>(4 * tracker.state_bytes());
    }));
  }
  static TrackerParams params() {
    TrackerParams p;
    p.track_capacity = p.detection_capacity = 4;
    p.horizon_s = 1.0;
    p.horizon_step_s = 0.25;
    return p;
  }
  TrackId step(int64_t stamp_ns, double x_m, int32_t model) {
    const Measurement z = {.x_m = x_m, .y_m = 0, .width_m = double(model), .stamp_ns = stamp_ns};
    TrackerFrame frame;
    frame.stamp_ns = stamp_ns;
    frame.measurements = {&z, 1};
    TrackId id = kNobody;
    tracker.step(frame, &id);
    return id;
  }
};

}  // namespace

TEST_CASE("track policy: a published path starts from the tracker's whole state at the snapshot") {
  Bench bench;
  CHECK(bench.tracker.state_bytes() == sizeof(ManyModels));
  bench.step(0, 10, 7);
  bench.tracker.snapshot(bench.rows, bench.states);
  bench.step(100 * kMs, 500, 39);  // another model since
  bench.tracker.publish(bench.rows, bench.states, 1000 * kMs, bench.tracks, nullptr, &bench.paths);
  REQUIRE(bench.tracks.count == 1);
  CHECK(bench.tracks.x_m[0] == 17);
  REQUIRE(bench.paths.count == 4);
  for (int32_t k = 0; k < 4; ++k) CHECK(bench.paths.x_m[k] == doctest::Approx(17 + 7 * 0.25 * (k + 1)));

  bench.tracker.predict(1100 * kMs, bench.rows, bench.states);
  CHECK(bench.rows.x_m[0] == doctest::Approx(500 + 39));
  bench.tracker.publish(bench.rows, bench.states, 1100 * kMs, bench.tracks, nullptr, &bench.paths);
  CHECK(bench.paths.x_m[3] == doctest::Approx(500 + 2 * 39));
}

TEST_CASE("track policy: a frame out of sequence restores the whole state, and the id stays") {
  Bench late, sorted;
  const TrackId id = late.step(0, 10, 7);
  late.step(200 * kMs, 20, 9);
  CHECK(late.step(100 * kMs, 15, 8) == id);
  CHECK(late.tracker.counts().refiltered == 1);
  sorted.step(0, 10, 7);
  sorted.step(100 * kMs, 15, 8);
  sorted.step(200 * kMs, 20, 9);
  for (Bench* bench : {&late, &sorted}) {
    bench->tracker.snapshot(bench->rows, bench->states);
    REQUIRE(bench->rows.count == 1);
    CHECK(bench->rows.hits[0] == 3);
    CHECK(bench->rows.id[0] == id);
  }
  CHECK(std::memcmp(late.states, sorted.states, sizeof(ManyModels)) == 0);
}
