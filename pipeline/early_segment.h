// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The part of a segmentation that is done before its scan is complete, in the producer's thread, while pieces arrive:
//
//   project_points   per point: over the points that came
//   rank_layers      at the end: the rows are the order of the layers by mean elevation
//   scatter_points   with rows that are predicted from the sensor's last scan, and compared at the end. Where they were
//                    wrong, the whole scan is scattered again, and the next scans are not predicted
//   row steps        those that follow and have a halo (step.h): over the rows that are complete. Rows complete one by
//                    one if the sensor measures layer after layer, from the top. A step whose halo is a guess runs
//                    again: over the rows so far, once before the last layer, and over the whole image at the end.
//                    The rows that differ are mended
//
// The columns travel with their scan (EarlyColumns) until its segmentation ends: the workers go on with the next step.
// The bytes are those of the whole segmentation.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "core/arena.h"
#include "kernels/project_points.h"
#include "pipeline/frame.h"
#include "pipeline/method/method.h"

namespace overtake {

struct StageContext;

// What a method's segmentation can do early. steps 0: nothing.
struct EarlyPlan {
  int32_t steps = 0;    // the first steps of the method
  Columns columns = 0;  // of points and pixels that they write
};
inline constexpr int32_t kMaxRowSteps = 8;
EarlyPlan plan_early(const Method& method) noexcept;

// What was done of a scan's segmentation before the scan ended.
struct EarlyColumns {
  SegmentViews views;
  Columns columns = 0;    // that `views` has memory for
  int32_t steps = 0;      // first steps of the method that are done
  int32_t row_count = 0;  // layers found
  StageSpans spans;       // of these steps
  class EarlyPool* pool = nullptr;
};

// The columns of one sensor's scans: of the one that grows, those in the mailbox, those that are segmented. The
// producer takes, a worker gives back, without a lock. The lowest free one comes first: it is still in the cache.
class EarlyPool {
 public:
  [[nodiscard]] bool build(Columns columns, const SensorModel& sensor, int32_t point_capacity, int32_t count,
                           const Allocator& allocator);
  EarlyColumns* take() noexcept;  // null: none is free
  void give(EarlyColumns& early) noexcept;

 private:
  static constexpr int32_t kMost = 32;
  Arena arena_;
  EarlyColumns all_[kMost];
  std::atomic<uint32_t> free_{0};  // bits
};

// A frame takes the early work of a scan; columns that the frame keeps are swapped.
void take_early(SensorPart& part, EarlyColumns*& early) noexcept;
void give_early(SensorPart& part) noexcept;

// One sensor's, from scan to scan. Its stream's owner calls it.
class EarlySegment {
 public:
  [[nodiscard]] bool build(const Method& method, const EarlyPlan& plan, const SensorModel& sensor,
                           const SegmentParams& params, const Allocator& allocator);
  bool is_built() const noexcept { return plan_.steps > 0; }

  // A scan begins.
  void begin(EarlyColumns& early) noexcept;
  // Points [0, whole) of the scan are there.
  void add(const StageContext& context, const ScanTable& scan, int32_t whole, EarlyColumns& early) noexcept;
  // All points are there. False if the rows differ from the predicted ones.
  bool finish(const StageContext& context, const ScanTable& scan, EarlyColumns& early) noexcept;
  // Discards the early work: the workers run every step of this scan.
  void drop(EarlyColumns& early) noexcept;

 private:
  void project(const StageContext& context, const ScanTable& scan, int32_t end, EarlyColumns& early) noexcept;
  void look_at_layers(const ScanTable& scan, int32_t begin, int32_t end, const PointTable& points) noexcept;
  void meet_layer(int32_t layer) noexcept;
  bool run_row_steps(const StageContext& context, bool whole, EarlyColumns& early) noexcept;
  void run_rows(const StageContext& context, const Step& step, int32_t first, int32_t last, bool whole,
                EarlyColumns& early) noexcept;
  void mend_guesses(const StageContext& context, bool whole, EarlyColumns& early) noexcept;
  bool find_wrong_rows(const StageContext& context, const Step& step, int32_t given, int32_t done, bool whole,
                       EarlyColumns& early) noexcept;
  bool is_as_predicted() const noexcept;
  void learn() noexcept;

  static constexpr int32_t kUnmet = -1;
  // A wrong prediction is followed by a pause: scans without a prediction, 4 at first. Each wrong one doubles the next
  // pause, each right one shortens it by one scan.
  static constexpr int32_t kFirstPause = 4, kLongestPause = 64;

  Arena arena_;
  EarlyPlan plan_;
  const SensorModel* sensor_ = nullptr;
  const SegmentParams* params_ = nullptr;
  LayerSums sums_;
  int32_t *row_of_layer_ = nullptr, *layer_order_ = nullptr;
  float* kept_rows_ = nullptr;   // of the row steps' columns, above and below a window
  SegmentViews guess_;           // what the steps write whose halo is a guess, of the whole image
  uint8_t* is_wrong_ = nullptr;  // by row: to be computed again
  SensorPart part_;              // row_count only

  // This scan.
  int32_t projected_ = 0;       // points [0, projected_) are done
  int32_t* row_now_ = nullptr;  // by layer; kUnmet
  int32_t* met_ = nullptr;      // layers in their order of arrival, at most one more than rows
  int32_t met_count_ = 0;
  bool predicted_ = false;  // at its begin
  bool predicts_ = false;   // rows of all layers so far are predicted
  bool rows_complete_in_turn_ = false;
  int32_t complete_ = 0;  // rows [0, complete_) get no more points
  int32_t rows_done_[kMaxRowSteps] = {};

  // The scans before.
  int32_t* row_before_ = nullptr;  // by layer; kUnmet
  int32_t* layers_before_ = nullptr;
  int32_t before_count_ = 0;
  bool knows_rows_ = false, in_turn_before_ = false;
  int32_t pause_ = 0, next_pause_ = kFirstPause;
};

}  // namespace overtake
