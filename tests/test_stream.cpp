// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Scans in pieces give the bytes of whole scans, for any cut, order, ISA and number of workers, and their first steps
// run while the pieces arrive.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "kernels/kernel_table.h"
#include "pipeline/detector.h"
#include "pipeline/method/steps.h"
#include "tests/support/frame_rules.h"
#include "tests/support/one_sensor_detector.h"
#include "tests/support/stream_bench.h"

using namespace overtake::test;

namespace {

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
  int32_t workers = 1, parts = 1;  // parts: of a segmentation
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
  bench.params.segment_parts = manner.parts;
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
    manner.parts = 1 + i / 3 % 4;
    manner.with_index = manner.shuffled || manner.interleaved || random() % 2;
    CAPTURE(i);
    CAPTURE(manner.workers);
    CAPTURE(manner.parts);
    CAPTURE(std::string(manner.isa));
    CAPTURE(manner.by_column);
    CAPTURE(manner.shuffled);
    CAPTURE(manner.early);
    const bool same = run_pieces(manner, seed + uint64_t(i)) == expected[manner.by_column][manner.keep_images];
    CHECK(same);
  }
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
  if (tests_paper())
    rows.insert(rows.end(), {OVT_STAGE_ANGLE, OVT_STAGE_SMOOTH, OVT_STAGE_GROUND, OVT_STAGE_REPAIR, OVT_STAGE_LINK});
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

// Of the runs of count_layers at the end of a scan.
struct LayerCounts {
  int32_t runs, fewest_rows, most_more;  // more layers than rows
};
LayerCounts layer_counts;

TEST_CASE("stream: a step that runs again over some rows is told of one layer more than these rows, not of all") {
  using namespace overtake;
  const Step count_layers = {"count_layers",
                             OVT_STAGE_REPAIR,
                             columns(Column::row_count, Column::nonground),
                             columns(Column::range_repaired_m),
                             0,
                             "",
                             [](const KernelTable&, Segment& s) noexcept {
                               const Plane<float>& out = s.views.images.range_repaired_m;
                               for (int32_t r = 0; r < out.rows; ++r) std::fill_n(out.row(r), out.cols, 0.0f);
                               ++layer_counts.runs;
                               layer_counts.fewest_rows = std::min(layer_counts.fewest_rows, out.rows);
                               layer_counts.most_more = std::max(layer_counts.most_more, s.part.row_count - out.rows);
                             },
                             rows_around<0, 0>};
  std::vector<Step> steps(kPaper.segment.begin(), kPaper.segment.begin() + 7);  // up to mark_ground
  steps.push_back(count_layers);
  Method method = kPaper;
  method.segment = steps;
  const EarlyPlan plan = plan_early(method);
  REQUIRE(plan.steps == 8);

  // Columns 20 to 29 have returns in rows 0 to 3 and in the last one: mark_ground guesses wrong in row 3.
  constexpr int32_t kRows = 16, kCols = 64;
  std::vector<float> x, y, z, intensity;
  std::vector<int32_t> layer, time;
  for (int32_t r = 0; r < kRows; ++r)
    for (int32_t c = 0; c < kCols; ++c) {
      if (c >= 20 && c < 30 && r > 3 && r + 1 < kRows) continue;
      const double azimuth = 0.5 - (c + 0.5) / kCols, elevation = 0.01 - 0.02 * r;
      x.push_back(float(10 * std::cos(azimuth)));
      y.push_back(float(10 * std::sin(azimuth)));
      z.push_back(float(10 * std::tan(elevation)));
      layer.push_back(r);
    }
  const auto count = int32_t(x.size()), capacity = round_up(count, kRowAlign);
  for (std::vector<float>* column : {&x, &y, &z, &intensity}) column->resize(std::size_t(capacity));
  for (std::vector<int32_t>* column : {&layer, &time}) column->resize(std::size_t(capacity));
  const ScanTable scan = {count, capacity, x.data(), y.data(), z.data(), intensity.data(), layer.data(), time.data()};

  ovt_params params;
  REQUIRE(ovt_params_init(&params, sizeof params, "paper") == OVT_OK);
  StageContext context;
  context.method = &method;
  context.kernels = find_kernels("ref");
  context.sensor_count = 1;
  context.sensors[0] = make_sensor_model(kRows, kCols, 0.5, -0.5, false, 0.5, 100);
  context.segment[0] = make_segment_params(params, context.sensors[0]);
  EarlyPool pool;
  EarlySegment segment;
  REQUIRE(pool.build(plan.columns, context.sensors[0], capacity, 1, default_allocator()));
  REQUIRE(segment.build(method, plan, context.sensors[0], context.segment[0], default_allocator()));
  for (int32_t k = 0; k < 2; ++k) {  // the second scan has the rows of the first one
    EarlyColumns* const early = pool.take();
    segment.begin(*early);
    for (int32_t whole = 0; whole < count; whole += kCols) segment.add(context, scan, whole, *early);
    layer_counts = {0, kRows, -kRows};
    CHECK(segment.finish(context, scan, *early));
    CHECK(early->row_count == kRows);
    CHECK(early->steps == (k == 0 ? 3 : 8));
    pool.give(*early);
  }
  CHECK(layer_counts.runs >= 2);  // the last rows, and row 3 again
  CHECK(layer_counts.fewest_rows == 1);
  CHECK(layer_counts.most_more == 1);
}

TEST_CASE("stream: the pool of early columns gives the lowest free ones, and none when all are taken") {
  const overtake::EarlyPlan plan = overtake::plan_early(overtake::kPaper);
  CHECK(plan.steps == 9);  // up to link_pixels
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
