// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Groups scans into frames by their stamps. Runs on one thread (the intake). A frame opens with its first scan. It
// closes when it has every sensor that is due and not silent, when a scan arrives that does not belong to it, or when
// ovt_advance reports a time that is too late for it. The segmentation starts with each scan, before the frame is
// complete.
//
// A sensor is slow if its interval is over 1.5 times that of the fastest sensor (sensor_rhythm.h). A slow sensor is due
// from its interval after its last scan on, and silent after 1.5 intervals; every other sensor is always due, and
// silent after 1.5 periods.
//
// A scan older than a closed frame of scans, or than the open frame, becomes a separate frame; the tracker inserts it
// at its stamp. Frames get their sequence numbers when they close.
//
// The assembler keeps one held scan per sensor (held: see clock_watch.h). The next held scan of the sensor replaces it.
#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <utility>

#include "pipeline/clock_watch.h"
#include "pipeline/ego_buffer.h"
#include "pipeline/frame_pool.h"
#include "pipeline/mailbox.h"
#include "pipeline/road/height_profile.h"
#include "pipeline/sensor_rhythm.h"

namespace overtake {

// Runs the stages: inline, or in the graph.
class FrameRunner {
 public:
  virtual ~FrameRunner() = default;
  // Runs the intake's loop, which calls start_segment and close, in the thread or arena that the runner needs.
  virtual void host(const std::function<void()>& loop) { loop(); }
  // Called in that loop before the first frame. May allocate memory and start threads.
  virtual void warm_up() {}
  virtual int32_t workers() const noexcept { return 1; }         // workers that came in the warm-up
  virtual void start_segment(Frame& frame, int32_t sensor) = 0;  // sensors[sensor].scan is ready
  virtual void close(Frame& frame) = 0;                          // the frame is complete
};

struct AssemblerParams {
  int32_t sensor_count = 0;
  int64_t period_ns = 50'000'000, tolerance_ns = 25'000'000;
  int64_t wait_ns = 75'000'000;  // ovt_advance closes a frame this long after its first stamp
  int64_t predict_after_ns = 75'000'000;
  bool drops_repeats = false;  // scans with the points of the sensor's scan before, while the ego vehicle moves
};

// Pushed detections on their way to a frame.
struct ExternalScan {
  ExternalTable table;
  int64_t stamp_ns = 0;
  uint64_t ticket = 0;  // like Scan::ticket
  EgoRange ego;
  int32_t reference = OVT_REFERENCE_MAP;
};

// Result of offering a scan or pushed detections. kDuplicate: a stamp that was there. kRepeat: a new stamp, but the
// points of the scan before. kNoSlot: offer it again. kHeld: take_settled() returns the final result later.
enum class IntakeResult { kUsed, kLate, kDuplicate, kRepeat, kNoSlot, kHeld };

// Results of scans and pushed detections that were kHeld, or kLate before a clock jump.
struct Settled {
  int32_t used = 0, late = 0;
  int32_t late_before_jump = 0;  // scans of the new clock that were late: they count as dropped
  int32_t external_used = 0, external_dropped = 0;
};

// Compares ego poses with the sensors' time, frame by frame. Lead: the newest pose minus the sensors' newest stamp. It
// also grows when scans come later than before, so poses are refused only if a step of their own stamps explains it.
// Poses that stepped ahead (a run of the buffer) are trusted when their lead is no larger than that of earlier poses.
struct EgoWatch {
  static constexpr int32_t kLearnFrames = 16;
  static constexpr int32_t kDriftFrames = 8;  // a single frame may have been processed out of order
  static constexpr int32_t kSinkFrames = 32;  // a lead that was seen is forgotten in this time for each near_ns of it
  int32_t frames = 0;                         // frames used to learn the usual lead
  int64_t usual_lead_ns = 0;                  // largest value of the first frames; at least 0: late poses teach nothing
  int64_t last_lead_ns = INT64_MIN;           // of the last frame with trusted poses
  int64_t seen_lead_ns = 0;                   // that two frames in a row had; sinks from frame to frame
  int64_t believed_run = -1;                  // runs up to this one are trusted
  int32_t ahead = 0;                          // frames in a row with a larger lead than usual
  int32_t doubts = 0;                         // frames in a row that refuse poses although little was learned
  bool was_late = false;                      // in all of the first frames the poses were stale
  int64_t refused = 0;                        // poses that the buffer had refused by the last frame
  int64_t count = 0;                          // poses up to the last frame
  int32_t named = 0;                          // frames until the poses are no longer suspect

  // Looks at the newest pose of a frame in sequence. gaps_ns: the gaps of the stamps since the believed run. Returns
  // whether the poses after that run stepped ahead.
  bool look(int64_t lead_ns, int64_t run, int64_t gaps_ns, int64_t near_ns) noexcept;
  // The same, without learning from it: of a prediction, or of a frame out of sequence.
  bool is_step(int64_t lead_ns, int64_t gaps_ns, int64_t near_ns) const noexcept;

 private:
  void learn(int64_t lead_ns) noexcept {
    was_late = (was_late || frames == 0) && lead_ns < -kEgoFreshNs;
    usual_lead_ns = std::max(usual_lead_ns, lead_ns);
    ++frames;
  }
  void learn_again(int64_t lead_ns) noexcept {
    frames = 0;
    usual_lead_ns = 0;
    learn(lead_ns);
  }
  void see(int64_t lead_ns, int64_t sink_ns) noexcept {
    seen_lead_ns = std::max({std::min(lead_ns, last_lead_ns), seen_lead_ns - sink_ns, int64_t(0)});
    last_lead_ns = lead_ns;
  }
  bool is_unsure() const noexcept { return frames < kLearnFrames || was_late; }
  int64_t known_lead_ns() const noexcept { return std::max(usual_lead_ns, seen_lead_ns); }
};

class FrameAssembler {
 public:
  // `profile` describes the road for each scan; null: no step reads it.
  FrameAssembler(const AssemblerParams& params, FramePool& pool, EgoBuffer& ego, FrameRunner& runner,
                 HeightProfile* profile = nullptr)
      : params_(params),
        pool_(pool),
        ego_(ego),
        runner_(runner),
        profile_(profile),
        clock_(params.sensor_count, params.period_ns, params.tolerance_ns) {}
  // Allocates memory for held scans. False without memory.
  [[nodiscard]] bool build(const int32_t* point_capacity, int32_t external_capacity, const Allocator& allocator);

  // Swaps the scan's table with the frame's.
  IntakeResult take_scan(int32_t sensor, Scan& scan) noexcept;
  // Pushed detections become a separate frame, before the open one unless they are 2 wait_ns newer.
  IntakeResult take_external(ExternalScan& scan) noexcept;
  // A prediction uses the first `pose_count` poses that were pushed. False if a frame slot was needed and none is free:
  // try again.
  bool advance(int64_t now_ns, int64_t pose_count = INT64_MAX) noexcept;
  // Rejects everything that is held, and closes the open frame. False if a frame slot was needed and none is free.
  bool flush() noexcept;
  int64_t closed_count() const noexcept { return next_sequence_; }         // frames closed so far
  bool has_open() const noexcept { return open_ != nullptr; }              // a frame waits for scans
  Settled take_settled() noexcept { return std::exchange(settled_, {}); }  // results since the last call
  int64_t clock_jumps() const noexcept { return clock_jumps_; }
  int64_t near_ns() const noexcept { return clock_.near_ns(); }

 private:
  // Of the points of a sensor's last scan that was offered.
  struct Print {
    uint64_t some = 0, all = 0;       // hashes, of 64 points and of all; 0: not known
    std::optional<int64_t> stamp_ns;  // of that scan
    bool changes = false;             // the sensor has seen other points: it is not a test with one scan
  };
  // A scan, or pushed detections, of a source.
  struct Source {
    int32_t number;
    int64_t stamp_ns;
    bool operator==(const Source&) const = default;
  };

  // The used stamps of a source, those of the last kLateNs at least, to recognise repeated ones. Older ones are
  // forgotten only when room is needed, so at 20 Hz a look-up compares with 32 stamps at most.
  class Recent {
   public:
    bool holds(int64_t stamp_ns) const noexcept {
      return std::find(stamps_ns_, stamps_ns_ + count_, stamp_ns) != stamps_ns_ + count_;
    }
    bool is_last(int64_t stamp_ns) const noexcept { return count_ > 0 && stamps_ns_[count_ - 1] == stamp_ns; }
    void add(int64_t stamp_ns, int64_t newest_ns) noexcept {
      if (count_ == room_) forget_late(newest_ns);
      stamps_ns_[count_++] = stamp_ns;
    }

   private:
    static constexpr int32_t kFew = 32, kCapacity = 512;  // of kLateNs at the shortest frame.period, 1 ms
    void forget_late(int64_t newest_ns) noexcept {
      int64_t* end = std::remove_if(stamps_ns_, stamps_ns_ + count_, [newest_ns](int64_t stamp_ns) {
        return difference_ns(newest_ns, stamp_ns) > kLateNs;
      });
      if (end == stamps_ns_ + kCapacity) end = std::move(stamps_ns_ + 1, end, stamps_ns_);
      count_ = int32_t(end - stamps_ns_);
      room_ = std::clamp(2 * count_, kFew, kCapacity);
    }

    int64_t stamps_ns_[kCapacity] = {};  // in the order of their use
    int32_t count_ = 0, room_ = kFew;
  };

  // Pushed detections that wait for the sensors.
  struct HeldExternal {
    ExternalScan scan;
    int64_t base_ns = 0;  // the sensors' newest stamp when the detections came
  };
  static constexpr int32_t kHeldExternals = 8;

  // The final result, or kNoSlot if the stamp is accepted.
  IntakeResult check_stamp(int32_t source, int64_t stamp_ns) noexcept;
  void settle() noexcept;
  // False if an accepted scan finds no free slot.
  bool place_accepted() noexcept;
  bool place_scan(int32_t sensor, Scan& scan) noexcept;
  bool place_external(ExternalScan& scan) noexcept;
  bool joins(int32_t sensor, int64_t stamp_ns) const noexcept;
  void hold_external(ExternalScan& scan) noexcept;
  void drop_external(int32_t index) noexcept;
  bool settle_externals() noexcept;
  EgoRange watch_ego(const EgoRange& range, Frame& frame) noexcept;
  Frame* open(int64_t stamp_ns, FrameKind kind) noexcept;
  void put_scan(Frame& frame, int32_t sensor, Scan& scan) noexcept;
  bool is_repeat(int32_t sensor, const Scan& scan) noexcept;
  void forget_classified(const Source& source) noexcept {
    if (classified_ == source) classified_.reset();
  }
  void close(Frame& frame, const EgoRange& range) noexcept;
  void close_open() noexcept;
  int64_t slow_interval_ns(int32_t sensor) const noexcept;
  int64_t patience_ns(int32_t sensor) const noexcept;
  bool is_due(int32_t sensor) const noexcept;
  bool complete() const noexcept;
  bool belongs_before(int64_t stamp_ns) const noexcept;

  AssemblerParams params_;
  FramePool& pool_;
  EgoBuffer& ego_;
  FrameRunner& runner_;
  HeightProfile* profile_;
  ClockWatch clock_;
  Recent recent_[ClockWatch::kSources];
  Print print_[kMaxSensors];
  Frame* open_ = nullptr;
  EgoRange open_range_;
  int64_t next_sequence_ = 0;
  bool started_ = false;       // a scan was used
  bool restart_next_ = false;  // the next frame is the first of a new clock
  Settled settled_;
  int64_t clock_jumps_ = 0;
  Arena held_arena_;
  Scan held_[kMaxSensors];
  uint32_t accepted_ = 0;  // bits of accepted held scans that need a frame
  HeldExternal held_external_[kHeldExternals];
  int32_t held_externals_ = 0;
  EgoWatch ego_watch_;
  std::optional<int64_t> closed_ns_;        // newest stamp of the closed frames, without predictions
  std::optional<int64_t> closed_scans_ns_;  // newest stamp of the closed frames of scans
  std::optional<Source> opens_next_;        // the scan that closed the open frame, and found no free slot for its own
  int64_t seen_ns_[kMaxSensors] = {};  // newest scan of each sensor; before its first scan: the first frame's stamp
  SensorRhythm rhythm_[kMaxSensors];
  // Each stamp is classified once, also when no slot was free and the scan is offered again.
  std::optional<Source> classified_;
};

}  // namespace overtake
