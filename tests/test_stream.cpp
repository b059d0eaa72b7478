// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Scans in pieces give the bytes of whole scans, for any cut, order, ISA and number of workers. Lost, doubled and late
// pieces, and scans that do not end, are counted and flagged, and what they do not show is not free.
#include <doctest/doctest.h>

#include <atomic>
#include <cmath>
#include <map>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>

#include "kernels/kernel_table.h"
#include "pipeline/detector.h"
#include "tests/support/detector_bench.h"
#include "tests/support/frame_rules.h"
#include "tests/support/one_sensor_detector.h"
#include "tests/support/pieces.h"
#include "tests/support/small_scene.h"

using namespace overtake::test;

namespace {

constexpr int64_t kMs = 1'000'000;
constexpr std::size_t kFrames = 5;

// Every eighth point of the demo scene, ring by ring or column by column.
const overtake::SceneScan& thin_scan(std::size_t frame, int32_t sensor, bool by_column = false) {
  static const auto all = [] {
    std::vector<overtake::SceneScan> scans;
    for (std::size_t k = 0; k < kFrames; ++k)
      for (std::size_t s = 0; s < 3; ++s)
        for (const bool columns : {false, true}) {
          const overtake::SceneScan& whole = demo_frame(k).scan[s];
          std::vector<std::size_t> order;
          for (std::size_t i = 0; i < whole.x_m.size(); i += 8) order.push_back(i);
          if (columns)
            std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
              return std::atan2(whole.y_m[a], whole.x_m[a]) > std::atan2(whole.y_m[b], whole.x_m[b]);
            });
          overtake::SceneScan thin;
          for (const std::size_t i : order) {
            thin.x_m.push_back(whole.x_m[i]);
            thin.y_m.push_back(whole.y_m[i]);
            thin.z_m.push_back(whole.z_m[i]);
            thin.layer.push_back(whole.layer[i]);
            thin.intensity.push_back(whole.intensity[i]);
            thin.time_offset_s.push_back(whole.time_offset_s[i]);
          }
          scans.push_back(std::move(thin));
        }
    return scans;
  }();
  return all[(frame * 3 + std::size_t(sensor)) * 2 + by_column];
}

struct Thin : DetectorBench {
  explicit Thin(const Options& options, bool columns = false) : DetectorBench(options), by_column(columns) {
    for (ovt_sensor_def& sensor : sensors) sensor.cols = 107, sensor.point_capacity = 6000;
  }
  ovt_points points(std::size_t frame, int32_t sensor) const {
    return points_of(thin_scan(frame, sensor, by_column), sensor, demo_frame(frame).stamp_ns);
  }
  ovt_status push_piece(const ovt_points& scan, const Range& range) {
    const ovt_points piece = piece_of(scan, range.first, range.last);
    return ovt_push_points(detector, &piece);
  }
  ovt_status end(const ovt_points& scan, int32_t count = -1) {
    return ovt_end_scan(detector, scan.sensor, scan.stamp_ns, count);
  }
  bool by_column;
};

std::vector<FrameRecord> run_whole(const char* isa = nullptr, bool by_column = false, bool keep_images = true) {
  Thin bench({.workers = 1}, by_column);
  bench.def.isa = isa;
  bench.def.keep_images = keep_images;
  bench.create();
  for (std::size_t k = 0; k < kFrames; ++k) {
    bench.push_ego(k);
    for (int32_t s = 0; s < 3; ++s) {
      const ovt_points points = bench.points(k, s);
      REQUIRE(ovt_push_scan(bench.detector, &points) == OVT_OK);
    }
  }
  bench.flush();
  return bench.records;
}

struct Manner {
  int32_t workers = 1;
  const char* isa = nullptr;
  bool by_column = false;  // the points come column by column
  bool keep_images = true;
  bool with_index = true;    // each piece has the index of its first point
  bool shuffled = false;     // the pieces of a scan come in any order
  bool interleaved = false;  // the sensors' pieces come in turn
  bool early = true;         // ovt_detector_def.stream
};

// Every scan in pieces, at random cuts.
std::vector<FrameRecord> run_pieces(const Manner& manner, uint64_t seed) {
  std::mt19937_64 random(seed);
  Thin bench({.workers = manner.workers}, manner.by_column);
  bench.def.isa = manner.isa;
  bench.def.stream = manner.early;
  bench.def.keep_images = manner.keep_images;
  bench.create();
  int64_t pieces = 0;
  for (std::size_t k = 0; k < kFrames; ++k) {
    bench.push_ego(k);
    std::vector<std::pair<int32_t, Range>> order;
    for (int32_t s = 0; s < 3; ++s) {
      std::vector<Range> ranges = cut_randomly(bench.points(k, s).count, random);
      if (manner.shuffled) std::shuffle(ranges.begin(), ranges.end(), random);
      for (const Range& range : ranges) order.push_back({s, range});
    }
    if (manner.interleaved) {
      std::stable_sort(order.begin(), order.end(),
                       [](const auto& a, const auto& b) { return a.second.first < b.second.first; });
    }
    for (const auto& [s, range] : order) {
      ovt_points piece = piece_of(bench.points(k, s), range.first, range.last);
      if (!manner.with_index) piece.first = -1;
      REQUIRE(ovt_push_points(bench.detector, &piece) == OVT_OK);
      ++pieces;
    }
    for (int32_t s = 0; s < 3; ++s) {
      const ovt_points points = bench.points(k, s);
      REQUIRE(bench.end(points, random() % 2 ? points.count : -1) == OVT_OK);
    }
  }
  bench.flush();
  const ovt_stats stats = bench.stats();
  CHECK(adds_up(stats));
  CHECK(stats.used == int64_t(3 * kFrames));
  CHECK(stats.pieces == pieces);
  CHECK(stats.pieces_used == pieces);
  CHECK(stats.scans_incomplete == 0);
  return bench.records;
}

void check_cuts(int32_t cuts, uint64_t seed) {
  const overtake::KernelTable* tables[16] = {};
  const int32_t table_count = overtake::list_kernels(tables);
  std::vector<FrameRecord> expected[2][2];
  for (const bool by_column : {false, true})
    for (const bool images : {false, true}) expected[by_column][images] = run_whole(nullptr, by_column, images);
  for (int32_t i = 0; i < cuts; ++i) {
    std::mt19937_64 random(seed + uint64_t(i));
    Manner manner;
    manner.workers = 1 << i % 3;
    manner.isa = tables[random() % uint64_t(table_count)]->isa;
    manner.by_column = random() % 2;
    manner.keep_images = random() % 2;
    manner.shuffled = random() % 3 == 0;
    manner.interleaved = random() % 2;
    manner.early = random() % 4 != 0;
    manner.with_index = manner.shuffled || manner.interleaved || random() % 2;
    CAPTURE(i);
    CAPTURE(manner.workers);
    CAPTURE(std::string(manner.isa));
    CAPTURE(manner.by_column);
    CAPTURE(manner.shuffled);
    CAPTURE(manner.early);
    const bool same = run_pieces(manner, seed + uint64_t(i)) == expected[manner.by_column][manner.keep_images];
    CHECK(same);
  }
}

// One sensor of the thin demo scene; each scan may lack points.
struct OneSensor : Thin {
  explicit OneSensor(int32_t workers = 1) : Thin({.workers = workers}) {
    def.sensor_count = 1;
    def.stream = 1;
  }
  // A scan without the points of `lost`, as one push.
  void push_without(std::size_t frame, const Range& lost) {
    const overtake::SceneScan& all = thin_scan(frame, 0);
    overtake::SceneScan rest;
    for (std::size_t i = 0; i < all.x_m.size(); ++i) {
      if (int32_t(i) >= lost.first && int32_t(i) < lost.last) continue;
      rest.x_m.push_back(all.x_m[i]);
      rest.y_m.push_back(all.y_m[i]);
      rest.z_m.push_back(all.z_m[i]);
      rest.layer.push_back(all.layer[i]);
      rest.intensity.push_back(all.intensity[i]);
      rest.time_offset_s.push_back(all.time_offset_s[i]);
    }
    const ovt_points points = points_of(rest, 0, demo_frame(frame).stamp_ns);
    REQUIRE(ovt_push_scan(detector, &points) == OVT_OK);
  }
};

bool same_segmentation(const FrameRecord& a, const FrameRecord& b) {
  return a.labels == b.labels && a.images == b.images && a.info.cluster_count == b.info.cluster_count;
}

// Scan k of one sensor, with its points in an order, and layers that change from scan to scan.
enum class Pattern {
  kTopDown,
  kBottomUp,
  kTopMissing,
  kShuffled,
  kLateReturn,
  kManyLayers,
  kNewIds,
  kHeads,
  kShuffledIds,
  kTurning,
  kCount
};
overtake::SceneScan make_pattern(Pattern pattern, std::size_t k) {
  const overtake::SceneScan& from = thin_scan(k % kFrames, 0);
  const auto layer_of = [&](std::size_t i) { return int32_t(from.layer[i]); };
  // Layers by mean elevation.
  std::map<int32_t, std::pair<double, int32_t>> sums;
  for (std::size_t i = 0; i < from.x_m.size(); ++i) {
    auto& [sum, count] = sums[layer_of(i)];
    sum += std::atan2(from.z_m[i], std::hypot(from.x_m[i], from.y_m[i]));
    ++count;
  }
  std::vector<std::pair<double, int32_t>> ranked;
  for (const auto& [layer, sum] : sums) ranked.push_back({-sum.first / sum.second, layer});
  std::sort(ranked.begin(), ranked.end());
  std::map<int32_t, int32_t> rank;
  for (std::size_t r = 0; r < ranked.size(); ++r) rank[ranked[r].second] = int32_t(r);
  std::mt19937 random(uint32_t(k) * 7 + 1);
  std::vector<int32_t> place(ranked.size());
  for (std::size_t r = 0; r < place.size(); ++r) place[r] = int32_t(r);
  if (pattern == Pattern::kBottomUp || (pattern == Pattern::kTurning && k % 2 == 1))
    std::reverse(place.begin(), place.end());
  if (pattern == Pattern::kShuffled || pattern == Pattern::kShuffledIds)
    std::shuffle(place.begin(), place.end(), random);
  if (pattern == Pattern::kHeads)  // two heads measure the upper and the lower half at the same time
    for (std::size_t r = 0; r < place.size(); ++r) place[r] = int32_t(r % (place.size() / 2));
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < from.x_m.size(); ++i)
    if (pattern != Pattern::kTopMissing || k % 2 == 0 || rank[layer_of(i)] > 0) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return place[std::size_t(rank[layer_of(a)])] < place[std::size_t(rank[layer_of(b)])];
  });
  if (pattern == Pattern::kLateReturn && k % 3 == 2) std::rotate(order.begin(), order.begin() + 1, order.end());
  overtake::SceneScan out;
  for (const std::size_t i : order) {
    out.x_m.push_back(from.x_m[i]);
    out.y_m.push_back(from.y_m[i]);
    out.z_m.push_back(from.z_m[i]);
    const bool new_ids = pattern == Pattern::kNewIds || pattern == Pattern::kShuffledIds;
    out.layer.push_back(uint16_t(new_ids ? (layer_of(i) * 37 + int32_t(k) * 11) % 64 : layer_of(i)));
    out.intensity.push_back(from.intensity[i]);
    out.time_offset_s.push_back(from.time_offset_s[i]);
  }
  return out;
}

struct PatternRun {
  std::vector<FrameRecord> records;
  ovt_stats stats;
  std::vector<std::vector<int32_t>> early_stages;  // of each frame: stages that ran in the pushing thread
};
PatternRun run_pattern(Pattern pattern, std::size_t scans, bool pieces, int32_t workers = 1) {
  OneSensor bench(workers);
  if (pattern == Pattern::kManyLayers) bench.sensors[0].rows = 20;
  PatternRun run;
  bench.def.user = &run;
  bench.def.on_frame = [](ovt_reader* reader, void* user) {
    auto& r = *static_cast<PatternRun*>(user);
    r.records.push_back(record_of(reader, 1));
    std::vector<int32_t> early;
    for (int32_t stage = OVT_STAGE_PROJECT; stage < OVT_STAGE_SEGMENT; ++stage) {
      ovt_span span;
      if (ovt_read_span(reader, 0, ovt_stage(stage), &span) == OVT_OK && span.duration_ns >= 0 && span.worker == -1)
        early.push_back(stage);
    }
    r.early_stages.push_back(early);
  };
  bench.create();
  std::mt19937_64 random(5);
  for (std::size_t k = 0; k < scans; ++k) {
    const overtake::SceneScan scan = make_pattern(pattern, k);
    const ovt_points points = points_of(scan, 0, int64_t(1000 + 50 * k) * kMs);
    if (!pieces) {
      REQUIRE(ovt_push_scan(bench.detector, &points) == OVT_OK);
      continue;
    }
    for (const Range& range : cut_randomly(points.count, random)) REQUIRE(bench.push_piece(points, range) == OVT_OK);
    REQUIRE(bench.end(points) == OVT_OK);
  }
  bench.flush();
  run.stats = bench.stats();
  return run;
}

int64_t sum_of_pieces(const ovt_stats& s) { return s.pieces_used + s.pieces_dup + s.pieces_late + s.pieces_dropped; }

}  // namespace

TEST_CASE("stream: scans in pieces, at any cut, give the bytes of whole scans") { check_cuts(16, 1); }

TEST_SUITE("long") {
  TEST_CASE("stream: 700 runs of 15 scans, each cut at random, give the bytes of whole scans") {
    check_cuts(700, 1000);
  }
}

TEST_CASE("stream: any order of layers, and layers that change from scan to scan, give the bytes of whole scans") {
  constexpr std::size_t kScans = 24;
  for (int32_t p = 0; p < int32_t(Pattern::kCount); ++p) {
    CAPTURE(p);
    const auto pattern = Pattern(p);
    const PatternRun whole = run_pattern(pattern, kScans, false), pieces = run_pattern(pattern, kScans, true);
    REQUIRE(whole.records.size() == kScans);
    CHECK(pieces.records == whole.records);
    CHECK(whole.stats.row_orders_wrong == 0);
    // Layers from the top to the bottom take their rows in turn, also without the top layer and with new ids; in any
    // other order a layer has the row it had before. With new ids in another order each time no row is right: after a
    // wrong scan the next 4 are not predicted, then 8, 16, ...
    const bool changes = pattern == Pattern::kShuffledIds || pattern == Pattern::kTurning;
    CHECK(pieces.stats.row_orders_wrong == (changes ? 3 : 0));
  }
}

TEST_CASE("stream: with layers from the top to the bottom, the first steps run while the pieces arrive") {
  const auto stages_of = [](Pattern pattern) { return run_pattern(pattern, 6, true, 2).early_stages; };
  const std::vector<int32_t> points = {OVT_STAGE_PROJECT};
  std::vector<int32_t> rows = {OVT_STAGE_PROJECT, OVT_STAGE_GAPS};
  if (tests_paper()) rows.insert(rows.end(), {OVT_STAGE_ANGLE, OVT_STAGE_SMOOTH});
  const std::vector<std::vector<int32_t>> top_down = stages_of(Pattern::kTopDown);
  REQUIRE(top_down.size() == 6);
  if (!tests_paper() && !tests_best()) return;  // another chain of steps
  CHECK(top_down[0] == points);                 // nothing is known of the rows
  for (std::size_t k = 1; k < 6; ++k) CHECK(top_down[k] == rows);
  for (const std::vector<int32_t>& stages : stages_of(Pattern::kHeads)) CHECK(stages == points);
  // A point of the top row at the end of scans 2 and 5.
  const std::vector<std::vector<int32_t>> late = stages_of(Pattern::kLateReturn);
  for (std::size_t k = 1; k < 6; ++k) CHECK(late[k] == (k % 3 == 2 ? points : rows));
}

TEST_CASE("stream: the pool of early columns gives the lowest free ones, and none when all are taken") {
  const overtake::EarlyPlan plan = overtake::plan_early(overtake::kPaper);
  CHECK(plan.steps == 6);  // up to smooth_sg
  overtake::EarlyPool pool;
  const overtake::SensorModel sensor = overtake::make_sensor_model(4, 8, 1, -1, false, 0.5, 100);
  REQUIRE(pool.build(plan.columns, sensor, 100, 3, overtake::default_allocator()));
  overtake::EarlyColumns *a = pool.take(), *b = pool.take(), *c = pool.take();
  REQUIRE((a && b && c));
  CHECK((a != b && b != c && a != c));
  CHECK(pool.take() == nullptr);
  pool.give(*c);
  pool.give(*a);
  CHECK(pool.take() == a);
  CHECK(pool.take() == c);
  CHECK(pool.take() == nullptr);
}

TEST_CASE("stream: a segmentation that throws gives the early columns back") {
  OneSensor bench;
  static int32_t early_frames;
  early_frames = 0;
  bench.def.on_frame = [](ovt_reader* reader, void*) {
    ovt_span span;
    if (ovt_read_span(reader, 0, OVT_STAGE_GAPS, &span) == OVT_OK && span.duration_ns >= 0) {
      ovt_span segment;
      ovt_read_span(reader, 0, OVT_STAGE_SEGMENT, &segment);
      early_frames += span.start_ns < segment.start_ns;
    }
  };
  bench.create();
  reinterpret_cast<overtake::Detector*>(bench.detector)
      ->set_hook(overtake::TestHook{[](void*, overtake::HookPoint at, overtake::Frame& frame, int32_t) {
                                      if (at == overtake::HookPoint::kSegment && frame.stamp_ns < 2000 * kMs)
                                        throw std::runtime_error("a test");
                                    },
                                    nullptr});
  for (int64_t k = 0; k < 24; ++k) {
    const overtake::SceneScan scan = make_pattern(Pattern::kTopDown, 0);
    const ovt_points points = points_of(scan, 0, (1000 + 50 * k) * kMs);
    REQUIRE(bench.push_piece(points, {0, points.count}) == OVT_OK);
    REQUIRE(bench.end(points) == OVT_OK);
  }
  bench.flush();
  CHECK(bench.stats().exceptions == 20);
  CHECK(early_frames == 4);
}

TEST_CASE("stream: a lost piece leaves a scan of the other points, flagged and counted") {
  const Range lost[] = {{0, 40}, {1000, 1300}, {1, 2}};
  for (const Range& gone : lost) {
    OneSensor whole, streamed;
    whole.create();
    streamed.create();
    const ovt_points points = streamed.points(0, 0);
    for (const Range& range : {Range{0, gone.first}, Range{gone.last, points.count}})
      REQUIRE(streamed.push_piece(points, range) == OVT_OK);
    REQUIRE(streamed.end(points) == OVT_OK);
    whole.push_without(0, gone);
    whole.flush();
    streamed.flush();
    REQUIRE(streamed.records.size() == 1);
    const ovt_frame_info& info = streamed.records[0].info;
    CHECK(same_segmentation(streamed.records[0], whole.records[0]));
    CHECK(info.point_count == points.count - (gone.last - gone.first));
    CHECK((info.flags & OVT_FLAG_SCAN_INCOMPLETE) != 0);
    CHECK(info.incomplete_mask == 1);
    CHECK(whole.records[0].info.incomplete_mask == 0);
    CHECK((whole.records[0].info.flags & OVT_FLAG_SCAN_INCOMPLETE) == 0);
    CHECK(streamed.stats().points_missing == gone.last - gone.first);
    CHECK(streamed.stats().scans_incomplete == 1);
    CHECK(streamed.stats().scans_unended == 0);
  }
}

TEST_CASE("stream: a scan that lacks points, or was dropped, leaves nothing behind for the next one") {
  for (const bool too_many : {false, true}) {
    OneSensor whole, streamed;
    whole.create();
    streamed.create();
    const overtake::SceneScan first = make_pattern(Pattern::kShuffled, 0), second = make_pattern(Pattern::kShuffled, 1);
    const ovt_points a = points_of(first, 0, 1000 * kMs), b = points_of(second, 0, 1050 * kMs);
    REQUIRE(streamed.push_piece(a, {0, 1000}) == OVT_OK);
    ovt_points last = piece_of(a, 1100, a.count);
    if (too_many) last.first = 6000;
    CHECK(ovt_push_points(streamed.detector, &last) == (too_many ? OVT_TOO_MANY : OVT_OK));
    CHECK(streamed.end(a) == (too_many ? OVT_TOO_MANY : OVT_OK));
    for (const Range& range : {Range{0, 700}, Range{700, b.count}}) REQUIRE(streamed.push_piece(b, range) == OVT_OK);
    REQUIRE(streamed.end(b) == OVT_OK);
    REQUIRE(ovt_push_scan(whole.detector, &b) == OVT_OK);
    whole.flush();
    streamed.flush();
    REQUIRE(streamed.records.size() == (too_many ? 1 : 2));
    CHECK(same_segmentation(streamed.records.back(), whole.records[0]));
  }
}

TEST_CASE("stream: a lost last piece is noticed by the scan's number of points") {
  for (const bool with_count : {false, true}) {
    OneSensor bench;
    bench.create();
    const ovt_points points = bench.points(0, 0);
    REQUIRE(bench.push_piece(points, {0, points.count - 10}) == OVT_OK);
    CHECK(bench.end(points, points.count - 11) == OVT_BAD_ARGUMENT);  // a point beyond it came
    REQUIRE(bench.end(points, with_count ? points.count : -1) == OVT_OK);
    bench.flush();
    REQUIRE(bench.records.size() == 1);
    CHECK(((bench.records[0].info.flags & OVT_FLAG_SCAN_INCOMPLETE) != 0) == with_count);
    CHECK(bench.stats().points_missing == (with_count ? 10 : 0));
  }
}

TEST_CASE("stream: a doubled piece is refused as a whole and changes nothing") {
  OneSensor whole, streamed;
  whole.create();
  streamed.create();
  const ovt_points points = streamed.points(0, 0);
  REQUIRE(streamed.push_piece(points, {0, 500}) == OVT_OK);
  REQUIRE(streamed.push_piece(points, {700, 900}) == OVT_OK);
  for (const Range& again : {Range{0, 500}, Range{499, 600}, Range{600, 701}, Range{899, 950}, Range{600, 1000}})
    CHECK(streamed.push_piece(points, again) == OVT_DUPLICATE);
  REQUIRE(streamed.push_piece(points, {500, 700}) == OVT_OK);
  REQUIRE(streamed.push_piece(points, {900, points.count}) == OVT_OK);
  REQUIRE(streamed.end(points, points.count) == OVT_OK);
  whole.push_without(0, {0, 0});
  whole.flush();
  streamed.flush();
  CHECK(streamed.records == whole.records);
  const ovt_stats stats = streamed.stats();
  CHECK(stats.pieces_dup == 5);
  CHECK(stats.pieces_used == 4);
  CHECK(stats.pieces == sum_of_pieces(stats));
}

TEST_CASE("stream: a piece of a scan that ended is late and changes nothing") {
  OneSensor whole, streamed;
  whole.create();
  streamed.create();
  int64_t late = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const ovt_points points = streamed.points(k, 0);
    REQUIRE(streamed.push_piece(points, {0, 1000}) == OVT_OK);
    for (std::size_t earlier = 0; earlier < k; ++earlier, ++late)
      CHECK(streamed.push_piece(streamed.points(earlier, 0), {0, 100}) == OVT_LATE);
    ovt_points lost = points;  // of a scan whose other pieces are all lost
    lost.stamp_ns -= 7 * kMs;
    CHECK(streamed.push_piece(lost, {0, 100}) == OVT_LATE);
    CHECK(streamed.end(lost) == OVT_LATE);
    ++late;
    REQUIRE(streamed.push_piece(points, {1000, points.count}) == OVT_OK);
    REQUIRE(streamed.end(points) == OVT_OK);
    CHECK(streamed.push_piece(points, {0, 1000}) == OVT_LATE);
    CHECK(streamed.end(points) == OVT_LATE);
    ++late;
    whole.push_without(k, {0, 0});
  }
  whole.flush();
  streamed.flush();
  CHECK(streamed.records == whole.records);
  CHECK(streamed.stats().pieces_late == late);
  CHECK(streamed.stats().pieces == sum_of_pieces(streamed.stats()));
  CHECK(streamed.stats().pushed == 3);
}

TEST_CASE("stream: a scan that starts before the last one ended closes it as incomplete") {
  for (const bool by_piece : {true, false}) {
    OneSensor bench;
    bench.create();
    const ovt_points first = bench.points(0, 0), second = bench.points(1, 0);
    REQUIRE(bench.push_piece(first, {0, 2000}) == OVT_OK);
    CHECK(bench.stats().pushed == 0);
    if (by_piece) {
      REQUIRE(bench.push_piece(second, {0, second.count}) == OVT_OK);
      CHECK(bench.stats().pushed == 1);
      REQUIRE(bench.end(second) == OVT_OK);
    } else {
      REQUIRE(ovt_push_scan(bench.detector, &second) == OVT_OK);
    }
    CHECK(bench.push_piece(first, {2000, 2100}) == OVT_LATE);
    bench.flush();
    REQUIRE(bench.records.size() == 2);
    CHECK(bench.records[0].info.incomplete_mask == 1);
    CHECK(bench.records[0].info.point_count == 2000);
    CHECK(bench.records[1].info.incomplete_mask == 0);
    CHECK(bench.records[1].info.point_count == second.count);
    CHECK(bench.stats().scans_unended == 1);
    CHECK(adds_up(bench.stats()));
  }
}

TEST_CASE("stream: a clock that went back over a second opens a new scan") {
  OneSensor bench;
  bench.create();
  ovt_points points = bench.points(0, 0);
  points.stamp_ns = 10'000 * kMs;
  REQUIRE(bench.push_piece(points, {0, 100}) == OVT_OK);
  points.stamp_ns = 9'000 * kMs;
  CHECK(bench.push_piece(points, {0, 100}) == OVT_LATE);
  points.stamp_ns -= 1;
  CHECK(bench.push_piece(points, {0, 100}) == OVT_OK);
  CHECK(bench.stats().scans_unended == 1);
}

TEST_CASE("stream: ovt_advance closes a scan that does not end, by its stamp") {
  for (const int32_t workers : {1, 2}) {
    for (const double limit_s : {0.15, 0.05, 0.0}) {
      OneSensor bench(workers);
      bench.params.frame_scan_limit = limit_s / bench.params.frame_period_s;
      bench.create();
      const ovt_points points = bench.points(0, 0);
      REQUIRE(bench.push_piece(points, {0, 3000}) == OVT_OK);
      const int64_t limit_ns = int64_t(limit_s * 1e9);
      REQUIRE(ovt_advance(bench.detector, points.stamp_ns + limit_ns - 1) == OVT_OK);
      CHECK(bench.stats().scans_unended == 0);
      REQUIRE(ovt_advance(bench.detector, points.stamp_ns + (limit_ns > 0 ? limit_ns : 5000 * kMs)) == OVT_OK);
      CHECK(bench.stats().scans_unended == (limit_ns > 0));
      CHECK(bench.push_piece(points, {3000, 3100}) == (limit_ns > 0 ? OVT_LATE : OVT_OK));
      bench.flush();
      REQUIRE(!bench.records.empty());
      CHECK(bench.records[0].info.incomplete_mask == 1);  // ovt_flush closes a scan without a limit
      CHECK(bench.records[0].info.point_count == (limit_ns > 0 ? 3000 : 3100));
      CHECK(bench.stats().scans_unended == 1);
      CHECK(adds_up(bench.stats()));
    }
  }
}

TEST_CASE("stream: the stamps of other sensors close a scan that does not end, the same with any workers") {
  std::vector<FrameRecord> expected;
  for (const int32_t workers : {1, 2, 4}) {
    Thin bench({.workers = workers});
    bench.create();
    const ovt_points dead = bench.points(0, 1);
    for (int32_t s : {0, 2}) {
      const ovt_points points = bench.points(0, s);
      REQUIRE(ovt_push_scan(bench.detector, &points) == OVT_OK);
    }
    REQUIRE(bench.push_piece(dead, {0, 2500}) == OVT_OK);
    for (std::size_t k = 1; k < kFrames; ++k) {
      bench.push_ego(k);
      for (int32_t s : {0, 2}) {
        const ovt_points points = bench.points(k, s);
        REQUIRE(ovt_push_scan(bench.detector, &points) == OVT_OK);
        // Scans come every 50 ms: 150 ms have passed with the third of them.
        CHECK(bench.stats().scans_unended == (k >= 3));
      }
    }
    CHECK(bench.push_piece(dead, {2500, 2600}) == OVT_LATE);
    bench.flush();
    if (workers == 1) expected = bench.records;
    CHECK(bench.records == expected);
    int32_t incomplete = 0;
    for (const FrameRecord& record : bench.records)
      if (record.info.incomplete_mask == 2) {
        ++incomplete;
        CHECK(record.info.point_count == 2500);
        CHECK(record.info.stamp_ns == dead.stamp_ns);
      }
    CHECK(incomplete == 1);
    CHECK(adds_up(bench.stats()));
  }
}

TEST_CASE("stream: another sensor's wrong clock does not close a scan") {
  Thin bench({.workers = 1});
  bench.create();
  const ovt_points open = bench.points(0, 0);
  ovt_points other = bench.points(0, 1);
  REQUIRE(bench.push_piece(open, {0, 1000}) == OVT_OK);
  // Wrong stamps; then late scans, which are no progress of time.
  for (const int64_t stamp_ms : {100'000, 500'000, 20, 400'000, 10, 70, 15, 75, 20, 80, 25, 85, 30, 90}) {
    other.stamp_ns = stamp_ms * kMs;
    REQUIRE(ovt_push_scan(bench.detector, &other) == OVT_OK);
  }
  CHECK(bench.stats().scans_unended == 0);
  CHECK(bench.push_piece(open, {1000, open.count}) == OVT_OK);
}

TEST_CASE("stream: a scan beyond the capacity is dropped as a whole, as one push of it") {
  OneSensor bench;
  bench.sensors[0].point_capacity = 1000;
  bench.create();
  const ovt_points points = bench.points(0, 0), next = bench.points(1, 0);
  REQUIRE(bench.push_piece(points, {0, 999}) == OVT_OK);
  CHECK(bench.push_piece(points, {999, 1001}) == OVT_TOO_MANY);
  CHECK(bench.push_piece(points, {999, 1000}) == OVT_TOO_MANY);
  CHECK(bench.end(points) == OVT_TOO_MANY);
  CHECK(bench.push_piece(points, {0, 1}) == OVT_LATE);
  REQUIRE(bench.push_piece(next, {0, 1000}) == OVT_OK);
  REQUIRE(bench.end(next) == OVT_OK);
  bench.flush();
  REQUIRE(bench.records.size() == 1);
  CHECK(bench.records[0].info.point_count == 1000);
  const ovt_stats stats = bench.stats();
  CHECK(stats.pieces_dropped == 2);
  CHECK(stats.dropped == 1);
  CHECK(stats.pushed == 2);
  CHECK(stats.scans_incomplete == 0);
  CHECK(stats.pieces == sum_of_pieces(stats));
}

TEST_CASE("stream: an end without pieces is an empty scan, and incomplete if points were sent") {
  OneSensor bench;
  bench.create();
  const ovt_points a = bench.points(0, 0), b = bench.points(1, 0);
  REQUIRE(bench.end(a, 0) == OVT_OK);
  REQUIRE(bench.end(b, 77) == OVT_OK);
  bench.flush();
  REQUIRE(bench.records.size() == 2);
  CHECK(bench.records[0].info.incomplete_mask == 0);
  CHECK((bench.records[0].info.flags & OVT_FLAG_NO_DATA) != 0);
  CHECK(bench.records[1].info.incomplete_mask == 1);
  CHECK(bench.stats().points_missing == 77);
}

TEST_CASE("stream: a whole scan of the stamp that is open is a duplicate, and the open scan goes on") {
  OneSensor whole, streamed;
  whole.create();
  streamed.create();
  const ovt_points points = streamed.points(0, 0);
  REQUIRE(streamed.push_piece(points, {0, 1000}) == OVT_OK);
  CHECK(ovt_push_scan(streamed.detector, &points) == OVT_DUPLICATE);
  REQUIRE(streamed.push_piece(points, {1000, points.count}) == OVT_OK);
  REQUIRE(streamed.end(points) == OVT_OK);
  CHECK(ovt_push_scan(streamed.detector, &points) == OVT_DUPLICATE);
  whole.push_without(0, {0, 0});
  whole.flush();
  streamed.flush();
  CHECK(streamed.records == whole.records);
  CHECK(streamed.stats().dup == 2);
  CHECK(adds_up(streamed.stats()));
}

TEST_CASE("stream: bad arguments change nothing") {
  OneSensor bench;
  bench.create();
  const ovt_points points = bench.points(0, 0);
  const auto push = [&](auto change) {
    ovt_points piece = piece_of(points, 0, 100);
    change(piece);
    return ovt_push_points(bench.detector, &piece);
  };
  CHECK(ovt_push_points(nullptr, &points) == OVT_BAD_ARGUMENT);
  CHECK(ovt_push_points(bench.detector, nullptr) == OVT_BAD_ARGUMENT);
  CHECK(push([](ovt_points& p) { p.first = -2; }) == OVT_BAD_ARGUMENT);
  CHECK(push([](ovt_points& p) { p.sensor = 1; }) == OVT_BAD_ARGUMENT);
  CHECK(push([](ovt_points& p) { p.count = -1; }) == OVT_BAD_ARGUMENT);
  CHECK(push([](ovt_points& p) { p.x.type = OVT_NONE; }) == OVT_BAD_ARGUMENT);
  CHECK(push([](ovt_points& p) { p.z.size_bytes = 4 * 100 - 1; }) == OVT_BAD_ARGUMENT);
  CHECK(push([](ovt_points& p) { p.struct_size = 8; }) == OVT_BAD_VERSION);
  CHECK(ovt_end_scan(nullptr, 0, 0, -1) == OVT_BAD_ARGUMENT);
  CHECK(ovt_end_scan(bench.detector, 1, 0, -1) == OVT_BAD_ARGUMENT);
  CHECK(ovt_end_scan(bench.detector, -1, 0, -1) == OVT_BAD_ARGUMENT);
  CHECK(ovt_end_scan(bench.detector, 0, 0, -2) == OVT_BAD_ARGUMENT);
  CHECK(bench.stats().pieces == 0);
  CHECK(bench.stats().pushed == 0);
  // Of a caller's header without `first`: its pieces follow one another.
  CHECK(push([](ovt_points& p) { p.first = 5, p.struct_size = offsetof(ovt_points, first); }) == OVT_OK);
  REQUIRE(bench.end(points) == OVT_OK);
  bench.flush();
  REQUIRE(bench.records.size() == 1);
  CHECK(bench.records[0].info.point_count == 100);
  CHECK(bench.records[0].info.incomplete_mask == 0);
}

TEST_CASE("stream: pieces may differ in the types of their fields") {
  OneSensor whole, streamed;
  whole.create();
  streamed.create();
  const ovt_points points = streamed.points(0, 0);
  std::vector<double> x;
  std::vector<int32_t> layer;
  for (const float v : thin_scan(0, 0).x_m) x.push_back(double(v));
  for (const uint16_t v : thin_scan(0, 0).layer) layer.push_back(v);
  ovt_points other = points;
  other.x = column_of(x, OVT_F64);
  other.layer = column_of(layer, OVT_I32);
  for (int32_t first = 0; first < points.count; first += 333) {
    const Range range = {first, std::min(first + 333, points.count)};
    REQUIRE(streamed.push_piece(first % 2 ? other : points, range) == OVT_OK);
  }
  REQUIRE(streamed.end(points) == OVT_OK);
  whole.push_without(0, {0, 0});
  whole.flush();
  streamed.flush();
  CHECK(streamed.records == whole.records);
}

TEST_CASE("stream: the newest scan wins, and an open scan replaces nothing") {
  struct Block {
    std::atomic<bool> inside{false}, go{false};
  } block;
  Thin bench({.workers = 2, .push_policy = OVT_PUSH_REPLACE, .record = false});
  bench.def.sensor_count = 1;
  bench.def.frames_in_flight = 1;
  bench.create();
  reinterpret_cast<overtake::Detector*>(bench.detector)
      ->set_hook(overtake::TestHook{[](void* user, overtake::HookPoint at, overtake::Frame&, int32_t) {
                                      auto& b = *static_cast<Block*>(user);
                                      if (at != overtake::HookPoint::kTrack) return;
                                      b.inside.store(true);
                                      while (!b.go.load()) std::this_thread::yield();
                                    },
                                    &block});
  const auto stream_scan = [&](std::size_t k, bool ends) {
    const ovt_points points = bench.points(k, 0);
    REQUIRE(bench.push_piece(points, {0, 1000}) == OVT_OK);
    REQUIRE(bench.push_piece(points, {1000, points.count}) == OVT_OK);
    if (ends) REQUIRE(bench.end(points) == OVT_OK);
  };
  stream_scan(0, true);
  while (!block.inside.load()) std::this_thread::yield();
  // Both frame slots are taken with scan 1; scan 2 waits in the mailbox.
  stream_scan(1, true);
  while (bench.stats().used < 2) std::this_thread::yield();
  stream_scan(2, true);
  const int64_t dropped = bench.stats().dropped;
  stream_scan(3, false);
  CHECK(bench.stats().dropped == dropped);
  REQUIRE(bench.end(bench.points(3, 0)) == OVT_OK);
  block.go.store(true);
  bench.flush();
  CHECK(bench.stats().dropped == dropped + 1);
  CHECK(bench.stats().used == 3);
  CHECK(adds_up(bench.stats()));
}

TEST_CASE("stream: three producers in pieces, with other threads that close their scans, lose no scan") {
  Thin bench({.workers = 2, .push_policy = OVT_PUSH_WAIT, .record = false});
  bench.params.frame_scan_limit = 1;
  bench.create();
  std::atomic<int64_t> scans{0}, ends_late{0};
  std::atomic<bool> stop{false};
  std::vector<std::thread> producers;
  for (int32_t s = 0; s < 3; ++s)
    producers.emplace_back([&, s] {
      std::mt19937_64 random(uint64_t(s) + 1);
      for (int64_t k = 0; k < 60; ++k) {
        ovt_points points = bench.points(std::size_t(k) % kFrames, s);
        points.stamp_ns = 1000 * kMs + k * 50 * kMs + s;
        for (const Range& range : cut_randomly(points.count, random)) {
          const ovt_status status = bench.push_piece(points, range);
          if (status != OVT_OK && status != OVT_LATE) std::abort();
        }
        scans.fetch_add(1);
        if (bench.end(points) == OVT_LATE) ends_late.fetch_add(1);
      }
    });
  std::thread clock([&] {
    for (int64_t now = 1000 * kMs; !stop.load(); now += 5 * kMs) ovt_advance(bench.detector, now);
  });
  for (std::thread& producer : producers) producer.join();
  stop.store(true);
  clock.join();
  bench.flush();
  const ovt_stats stats = bench.stats();
  CHECK(stats.pushed == scans.load());
  CHECK(stats.scans_unended == ends_late.load());
  CHECK(stats.pieces == sum_of_pieces(stats));
  CHECK(adds_up(stats));
}

TEST_CASE("stream: two threads that push scans of one sensor at the same time are told") {
  Thin bench({.workers = 2, .record = false});
  bench.create();
  const ovt_points points = bench.points(0, 0);
  // One thread stays in its call: its mailbox is full, and the intake waits in a hook.
  struct Block {
    std::atomic<bool> go{false};
  } block;
  reinterpret_cast<overtake::Detector*>(bench.detector)
      ->set_gather_hook(
          [](void* user) {
            while (!static_cast<Block*>(user)->go.load()) std::this_thread::yield();
          },
          &block);
  std::atomic<int32_t> pushed{0};
  std::thread producer([&] {
    ovt_points scan = points;
    for (int32_t k = 0; k < 4; ++k, ++scan.stamp_ns) {
      ovt_push_scan(bench.detector, &scan);
      pushed.fetch_add(1);
    }
  });
  ovt_status status = OVT_OK;
  ovt_points other = points;
  other.stamp_ns += 100;
  for (int64_t until = overtake::steady_now_ns() + 5'000 * kMs; overtake::steady_now_ns() < until;) {
    if (pushed.load() < 1) continue;
    status = bench.push_piece(other, {0, 0});
    if (status == OVT_WRONG_THREAD) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  CHECK(status == OVT_WRONG_THREAD);
  block.go.store(true);
  producer.join();
}

TEST_CASE("stream: what an incomplete scan does not show is not free: no track misses there") {
  for (int32_t i = 0; i < 4; ++i) {
    const bool incomplete = i % 2;
    const char* const preset = i < 2 ? "paper" : "best";
    CAPTURE(incomplete);
    CAPTURE(std::string(preset));
    ovt_params params;
    REQUIRE(ovt_params_init(&params, sizeof params, preset) == OVT_OK);
    params.tracker_confirm_hits = 3;
    params.tracker_keep_hits = 2;
    Small small;
    small.sensor.z_m = 1.2;
    small.def.params = &params;
    struct Seen {
      std::vector<uint32_t> flags;
      std::vector<int32_t> state;
      ovt_frame_info info{};
      const char* broken = nullptr;
    } seen;
    small.def.user = &seen;
    small.def.on_frame = [](ovt_reader* reader, void* user) {
      auto& s = *static_cast<Seen*>(user);
      ovt_tracks t;
      ovt_read_info(reader, &s.info);
      ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &t);
      s.flags.assign(t.flags, t.flags + t.count);
      s.state.assign(t.state, t.state + t.count);
      if (const char* broken = find_broken_rule(reader, 1, false, {OVT_AT_FRAME_STAMP})) s.broken = broken;
    };
    small.create();
    const int32_t count = look(20.0);
    for (int32_t k = 0; k < 12; ++k) {
      ovt_points points;
      ovt_points_init(&points, sizeof points);
      points.stamp_ns = 50 * kMs * k;
      points.count = count;
      points.x = OVT_FIELD(cloud, count, x, OVT_F32);
      points.y = OVT_FIELD(cloud, count, y, OVT_F32);
      points.z = OVT_FIELD(cloud, count, z, OVT_F32);
      points.layer = OVT_FIELD(cloud, count, layer, OVT_U16);
      // The last scans end, or not, after the first hundred points.
      const ovt_points piece = piece_of(points, 0, k < 8 ? count : 100);
      REQUIRE(ovt_push_points(small.detector, &piece) == OVT_OK);
      REQUIRE(ovt_end_scan(small.detector, 0, points.stamp_ns, incomplete ? count : -1) == OVT_OK);
    }
    REQUIRE(ovt_flush(small.detector) == OVT_OK);
    CHECK(seen.broken == nullptr);
    REQUIRE(!seen.flags.empty());
    for (const uint32_t flags : seen.flags) {
      CHECK((flags & OVT_TRACK_COASTING) != 0);
      CHECK(((flags & OVT_TRACK_UNOBSERVED) != 0) == incomplete);
    }
    CHECK(((seen.info.flags & OVT_FLAG_SCAN_INCOMPLETE) != 0) == incomplete);
  }
}
