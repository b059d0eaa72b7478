// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/early_segment.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "core/table.h"
#include "kernels/scatter_more.h"
#include "pipeline/method/segment_memory.h"
#include "pipeline/method/steps.h"
#include "pipeline/stages.h"

namespace overtake {
namespace {

constexpr int32_t kPointSteps = 3;    // project_points, rank_layers, scatter_points
constexpr int32_t kBlock = 64;        // points that are projected at a time, at least: whole vectors, whole cache lines
constexpr int32_t kRowsTogether = 4;  // a row step computes its halo, too, so it waits for a few rows

// `span`: the sum of a stage's times.
void add_time(StageSpan& span, int64_t start_ns) noexcept {
  const int64_t ns = steady_now_ns() - start_ns;
  if (span.duration_ns < 0) span = {start_ns, 0, this_worker()};
  span.duration_ns += ns;
}

template <class T>
void cut_rows(Plane<T>& plane, int32_t first, int32_t last) noexcept {
  plane = {plane.row(first), last - first, plane.cols, plane.stride};
}
void cut_rows(BitPlane& bits, int32_t first, int32_t last) noexcept {
  bits = {bits.row(first), last - first, bits.cols, bits.words_per_row};
}

// The images' rows [first, last) as images.
SegmentViews cut_rows(SensorPart& part, const SegmentViews& views, Columns which, int32_t first,
                      int32_t last) noexcept {
  SegmentViews window = views;
  for_each_segment_column(part, window, [&](Column column, auto extent, auto& view) {
    if constexpr (extent == Extent::pixels)
      if (has(which, column)) cut_rows(view, first, last);
  });
  return window;
}

template <class T>
std::size_t row_bytes(const Plane<T>& plane) noexcept {
  return std::size_t(plane.stride) * sizeof(T);
}
std::size_t row_bytes(const BitPlane& bits) noexcept { return std::size_t(bits.words_per_row) * sizeof(uint64_t); }

// Copies rows [first, last) of the columns to or from memory.
template <class Copy>
void for_each_rows(SensorPart& part, SegmentViews& views, Columns which, int32_t first, int32_t last,
                   Copy&& copy) noexcept {
  if (first >= last) return;
  for_each_segment_column(part, views, [&](Column column, auto extent, auto& view) {
    if constexpr (extent == Extent::pixels)
      if (has(which, column)) copy(view.row(first), std::size_t(last - first) * row_bytes(view));
  });
}

}  // namespace

EarlyPlan plan_early(const Method& method) noexcept {
  const auto is = [&](std::size_t i, const Step& step) {
    return i < method.segment.size() && method.segment[i].run == step.run;
  };
  EarlyPlan plan;
  if (!is(0, step::project_points) || !is(1, step::rank_layers) || !is(2, step::scatter_points)) return plan;
  constexpr Columns kTravel = columns_of(Extent::points) | columns_of(Extent::pixels);
  Columns given = columns(Column::row_count);
  for (const Step& step : method.segment) {
    const bool is_row_step = step.halo && step.scratch == 0 && !(step.reads & ~given);
    if (plan.steps >= kPointSteps && (!is_row_step || plan.steps == kPointSteps + kMaxRowSteps)) break;
    ++plan.steps;
    plan.columns |= step.writes & kTravel;
    given |= step.writes;
  }
  return plan;
}

bool EarlyPool::build(Columns columns, const SensorModel& sensor, int32_t point_capacity, int32_t count,
                      const Allocator& allocator) {
  count = std::min(count, kMost);
  const bool built = arena_.build(allocator, [&](Carver& carver) {
    for (int32_t i = 0; i < count; ++i) {
      EarlyColumns& early = all_[i];
      early.pool = this;
      early.columns = columns;
      early.views.points.capacity = round_up(point_capacity, kRowAlign);
      carve_columns(carver, columns, sensor, point_capacity, early.views);
    }
  });
  if (built) free_.store(uint32_t((uint64_t(1) << count) - 1), std::memory_order_relaxed);
  return built;
}

EarlyColumns* EarlyPool::take() noexcept {
  uint32_t free = free_.load(std::memory_order_acquire);
  while (free != 0)
    if (free_.compare_exchange_weak(free, free & (free - 1), std::memory_order_acq_rel, std::memory_order_acquire))
      return &all_[std::countr_zero(free)];
  return nullptr;
}

void EarlyPool::give(EarlyColumns& early) noexcept {
  free_.fetch_or(uint32_t(1) << (&early - all_), std::memory_order_acq_rel);
}

void take_early(SensorPart& part, EarlyColumns*& early) noexcept {
  if (!early || early->steps == 0) return;
  part.early = std::exchange(early, nullptr);
  swap_columns(part.early->columns & part.kept_columns, part.kept, part.early->views);
  part.row_count = part.early->row_count;
  for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage)
    if (part.early->spans[stage].duration_ns >= 0) part.spans[stage] = part.early->spans[stage];
}

void give_early(SensorPart& part) noexcept {
  EarlyColumns* const early = std::exchange(part.early, nullptr);
  if (early) early->pool->give(*early);
}

bool EarlySegment::build(const Method& method, const EarlyPlan& plan, const SensorModel& sensor,
                         const SegmentParams& params, const Allocator& allocator) {
  plan_ = plan;
  sensor_ = &sensor;
  params_ = &params;
  if (!is_built()) return true;
  const std::size_t layers = std::size_t(std::clamp(sensor.layer_last + 1, 1, kLayerIds));
  const std::size_t rows = std::size_t(sensor.rows);
  std::size_t kept_rows = 0;
  Columns guessed = 0;
  for (const Step& step : method.segment.subspan(kPointSteps, std::size_t(plan.steps - kPointSteps))) {
    const Columns written = step.writes & columns_of(Extent::pixels);
    const Halo halo = step.halo(params);
    kept_rows = std::max(kept_rows, std::size_t(std::popcount(written)) * std::size_t(halo.above + halo.below));
    if (halo.is_guess) guessed |= written;
  }
  const bool built = arena_.build(allocator, [&](Carver& carver) {
    for (int32_t** by_layer : {&sums_.touched, &sums_.point_count, &layer_order_, &row_now_, &row_before_})
      *by_layer = carver.take<int32_t>(layers);
    sums_.elevation_sum = carver.take<int64_t>(layers);
    row_of_layer_ = carver.take<int32_t>(kLayerIds);  // scatter_points reads it at the layers of other sensors, too
    met_ = carver.take<int32_t>(rows + 1);
    layers_before_ = carver.take<int32_t>(rows + 1);
    kept_rows_ = carver.take<float>(kept_rows * std::size_t(plane_stride(sensor.cols)));
    is_wrong_ = carver.take<uint8_t>(rows);
    carve_columns(carver, guessed, sensor, 0, guess_);
  });
  if (!built) return false;
  std::fill_n(row_now_, layers, kUnmet);
  std::fill_n(row_before_, layers, kUnmet);
  return true;
}

void EarlySegment::begin(EarlyColumns& early) noexcept {
  early.steps = early.row_count = 0;
  for (int32_t i = 0; i < met_count_; ++i) row_now_[met_[i]] = kUnmet;
  met_count_ = 0;
  sums_.touched_count = 0;
  projected_ = complete_ = 0;
  std::fill_n(rows_done_, kMaxRowSteps, 0);
  predicts_ = predicted_ = knows_rows_ && pause_ == 0;
  pause_ = std::max(pause_ - 1, 0);
  rows_complete_in_turn_ = predicts_ && in_turn_before_;
  early.spans.reset();
  if (predicts_) clear_pixels(early.views.images);
}

// A layer is met for the first time. If the layers came in the order of their rows before, they do so again: a layer
// takes the next row, so that a layer without points, or a new one, does not shift the rows of the others.
void EarlySegment::meet_layer(int32_t layer) noexcept {
  if (met_count_ > sensor_->rows) return;  // more layers than rows: nothing is predicted
  const int32_t row = in_turn_before_ ? met_count_ : row_before_[layer];
  met_[met_count_++] = layer;
  row_now_[layer] = std::max(row, 0);
  predicts_ = predicts_ && row >= 0 && row < sensor_->rows;
  // The last row but one may still get points: the heads of a sensor end a line one after the other.
  if (rows_complete_in_turn_) complete_ = std::max(met_count_ - 2, 0);
}

void EarlySegment::look_at_layers(const ScanTable& scan, int32_t begin, int32_t end,
                                  const PointTable& points) noexcept {
  constexpr int32_t kGroup = 16;
  int32_t last = kNoLayer;
  for (int32_t i = begin; i < end; ++i) {
    if (last != kNoLayer && i + kGroup <= end) {  // most points have the layer of the one before
      int32_t others = 0;
      for (int32_t k = 0; k < kGroup; ++k) others |= scan.layer[i + k] ^ last;
      if (others == 0) {
        i += kGroup - 1;
        continue;
      }
    }
    const int32_t layer = scan.layer[i];
    if (points.column[i] < 0 || layer == last) continue;
    last = layer;
    if (row_now_[layer] == kUnmet)
      meet_layer(layer);
    else if (row_now_[layer] < complete_)
      rows_complete_in_turn_ = false;  // the row was not complete
  }
}

void EarlySegment::project(const StageContext& context, const ScanTable& scan, int32_t end,
                           EarlyColumns& early) noexcept {
  if (end <= projected_) return;
  const int64_t start_ns = steady_now_ns();
  PointTable& points = early.views.points;
  ScanTable new_scan = rows_from(scan, projected_);
  PointTable new_points = rows_from(points, projected_);
  new_scan.count = end - projected_;
  LayerSums new_sums = sums_;  // the kernel lists the layers that it meets first
  new_sums.touched += sums_.touched_count;
  context.kernels->project_points(*sensor_, new_scan, new_points, new_sums);
  sums_.touched_count += new_sums.touched_count;
  look_at_layers(scan, projected_, end, points);
  if (predicts_) scatter_more(scan, row_now_, projected_, end, points, early.views.images);
  projected_ = end;
  add_time(early.spans[OVT_STAGE_PROJECT], start_ns);
}

void EarlySegment::add(const StageContext& context, const ScanTable& scan, int32_t whole,
                       EarlyColumns& early) noexcept {
  project(context, scan, whole - whole % kBlock, early);
  if (!predicts_ || !rows_complete_in_turn_) return;
  const bool ran = run_row_steps(context, false, early);
  if (ran && met_count_ + 1 == before_count_) mend_guesses(context, false, early);
}

// Runs a row step over rows [first, last). The kernel gets the rows and the halo as an image. It takes the halo's outer
// rows for the image's edge, so what it writes there is wrong and is put back. `whole`: the image has no more layers
// than early.row_count, else more may follow.
void EarlySegment::run_rows(const StageContext& context, const Step& step, int32_t first, int32_t last, bool whole,
                            EarlyColumns& early) noexcept {
  const int64_t start_ns = steady_now_ns();
  const Halo halo = step.halo(*params_);
  const int32_t top = std::max(first - halo.above, 0), bottom = std::min(last + halo.below, sensor_->rows);
  char* kept = reinterpret_cast<char*>(kept_rows_);
  const auto for_each_kept = [&](auto&& copy) {
    for_each_rows(part_, early.views, step.writes, top, first, copy);
    for_each_rows(part_, early.views, step.writes, last, bottom, copy);
  };
  for_each_kept([&](const void* rows, std::size_t bytes) {
    std::memcpy(kept, rows, bytes);
    kept += bytes;
  });
  SegmentViews window = cut_rows(part_, early.views, plan_.columns, top, bottom);
  // More layers than rows: one more (step.h).
  part_.row_count = std::clamp((whole ? early.row_count : bottom + 1) - top, 0, bottom - top + 1);
  Segment segment = {*sensor_, *params_, part_, window};
  step.run(*context.kernels, segment);
  kept = reinterpret_cast<char*>(kept_rows_);
  for_each_kept([&](void* rows, std::size_t bytes) {
    std::memcpy(rows, kept, bytes);
    kept += bytes;
  });
  add_time(early.spans[step.stage], start_ns);
}

// Runs each row step over the rows that it can compute now; `whole`: over all others. False: there were none.
bool EarlySegment::run_row_steps(const StageContext& context, bool whole, EarlyColumns& early) noexcept {
  int32_t given = whole ? sensor_->rows : complete_;
  const bool may_wait = !whole && met_count_ + 1 < before_count_;  // not when the last layers come
  bool any = false;
  for (int32_t k = 0; k + kPointSteps < plan_.steps; ++k) {
    const Step& step = context.method->segment[std::size_t(k + kPointSteps)];
    const int32_t first = rows_done_[k], last = whole ? sensor_->rows : given - step.halo(*params_).below;
    given = last;
    if (last <= first || (may_wait && last < first + kRowsTogether)) {
      given = first;
      continue;
    }
    run_rows(context, step, first, last, whole, early);
    rows_done_[k] = last;
    any = true;
  }
  return any;
}

// Runs a step over rows [0, given) and compares rows [0, done). Takes the rows that differ; is_wrong_ marks them.
bool EarlySegment::find_wrong_rows(const StageContext& context, const Step& step, int32_t given, int32_t done,
                                   bool whole, EarlyColumns& early) noexcept {
  const int64_t start_ns = steady_now_ns();
  SegmentViews again = early.views;
  show_columns(step.writes, guess_, again);
  SegmentViews window = cut_rows(part_, again, plan_.columns, 0, given);
  part_.row_count = whole ? early.row_count : given + 1;
  Segment segment = {*sensor_, *params_, part_, window};
  step.run(*context.kernels, segment);
  bool any = false;
  for (int32_t r = 0; r < done; ++r) {
    const char* right[kColumnCount];
    int32_t count = 0, i = 0;
    for_each_rows(part_, again, step.writes, r, r + 1,
                  [&](const void* row, std::size_t) { right[count++] = static_cast<const char*>(row); });
    for_each_rows(part_, early.views, step.writes, r, r + 1, [&](void* row, std::size_t bytes) {
      const char* const from = right[i++];
      if (std::memcmp(row, from, bytes) == 0) return;
      std::memcpy(row, from, bytes);
      is_wrong_[r] = 1;
      any = true;
    });
  }
  add_time(early.spans[step.stage], start_ns);
  return any;
}

// After the row steps ran; `whole`: over all rows.
void EarlySegment::mend_guesses(const StageContext& context, bool whole, EarlyColumns& early) noexcept {
  const int32_t rows = sensor_->rows;
  int32_t given = whole ? rows : complete_;
  std::fill_n(is_wrong_, rows, uint8_t(0));
  bool any = false;
  for (int32_t k = 0; k + kPointSteps < plan_.steps; ++k) {
    const Step& step = context.method->segment[std::size_t(k + kPointSteps)];
    const Halo halo = step.halo(*params_);
    if (halo.is_guess) {
      any = find_wrong_rows(context, step, given, rows_done_[k], whole, early) || any;
    } else if (any) {
      // Row r reads the rows from r - above to r + below.
      const auto is_touched = [&](int32_t r) {
        const int32_t begin = std::max(r - halo.above, 0), end = std::min(r + halo.below + 1, rows);
        return std::any_of(is_wrong_ + begin, is_wrong_ + end, [](uint8_t wrong) { return wrong == 1; });
      };
      for (int32_t r = 0; r < rows; ++r)
        if (is_wrong_[r] == 0 && is_touched(r)) is_wrong_[r] = 2;
      const int32_t done = rows_done_[k];  // later rows will read what is right
      for (int32_t first = 0, last = 0; first < done; first = last + 1) {
        for (last = first; last < done && is_wrong_[last] != 0; ++last) is_wrong_[last] = 1;
        if (last > first) run_rows(context, step, first, last, whole, early);
      }
    }
    given = rows_done_[k];
  }
}

bool EarlySegment::is_as_predicted() const noexcept {
  if (!predicts_ || sums_.touched_count != met_count_) return false;
  for (int32_t i = 0; i < met_count_; ++i)
    if (row_of_layer_[met_[i]] != row_now_[met_[i]]) return false;
  return true;
}

bool EarlySegment::finish(const StageContext& context, const ScanTable& scan, EarlyColumns& early) noexcept {
  project(context, scan, scan.count, early);
  const int64_t start_ns = steady_now_ns();
  early.row_count = context.kernels->rank_layers(sensor_->rows, sums_, row_of_layer_, layer_order_);
  const bool right = is_as_predicted();
  if (!right) {
    early.views.points.count = scan.count;
    context.kernels->scatter_points(scan, row_of_layer_, early.views.points, early.views.images);
  }
  add_time(early.spans[OVT_STAGE_PROJECT], start_ns);
  early.steps = kPointSteps;
  if (right && rows_complete_in_turn_) {
    run_row_steps(context, true, early);
    mend_guesses(context, true, early);
    early.steps = plan_.steps;
  }
  const bool was_wrong = predicted_ && !right;
  if (was_wrong) pause_ = next_pause_;
  if (predicted_)
    next_pause_ = was_wrong ? std::min(2 * next_pause_, kLongestPause) : std::max(next_pause_ - 1, kFirstPause);
  learn();
  return !was_wrong;
}

// Keeps the rows of this scan for the next one. With more layers than rows the kept ones depend on the points.
void EarlySegment::learn() noexcept {
  for (int32_t i = 0; i < before_count_; ++i) row_before_[layers_before_[i]] = kUnmet;
  before_count_ = 0;
  knows_rows_ = in_turn_before_ = met_count_ > 0 && met_count_ <= sensor_->rows && sums_.touched_count == met_count_;
  if (!knows_rows_) return;
  before_count_ = met_count_;
  for (int32_t i = 0; i < met_count_; ++i) {
    const int32_t layer = met_[i], row = row_of_layer_[layer];
    layers_before_[i] = layer;
    row_before_[layer] = row;
    in_turn_before_ = in_turn_before_ && row == i;
  }
}

void EarlySegment::drop(EarlyColumns& early) noexcept {
  for (int32_t i = 0; i < sums_.touched_count; ++i) {
    sums_.point_count[sums_.touched[i]] = 0;
    sums_.elevation_sum[sums_.touched[i]] = 0;
  }
  early.steps = 0;
}

}  // namespace overtake
