// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The detector behind the C API: owns all parts and decides which thread may call what.
//
//   producers --> mailboxes --> intake --> frames --> runner (inline or graph) --> finish --> pool --> readers
//
// With worker_count 1 the producer's thread is also the intake. Else the intake is a separate thread: producers only
// copy, post and signal; they never allocate, never call TBB, and wait only with OVT_PUSH_WAIT, or for a thread that
// closes their open scan in pieces (detector_stream.cpp).
#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "pipeline/detector_graph.h"
#include "pipeline/event.h"
#include "pipeline/frame_assembler.h"
#include "pipeline/frame_pool.h"
#include "pipeline/mailbox.h"
#include "pipeline/memory.h"
#include "pipeline/pose_repair.h"
#include "pipeline/road/bank_attitude.h"
#include "pipeline/scan_stream.h"
#include "pipeline/shared_words.h"
#include "pipeline/stages.h"

namespace overtake {

// stats.def: one a line.
struct Counters {
#define OVT_COUNTER(name, ...) std::atomic<int64_t> name{0};
#define OVT_COUNTERS(name, size, ...) std::atomic<int64_t> name[size] = {};
#include "pipeline/stats.def"
};

// A reader's state: the frame that it holds, and the memory that ovt_read_tracks writes its predictions to.
struct Reader {
  class Detector* detector = nullptr;
  bool is_callback_reader = false;  // the reader of on_frame: destroyed with the detector
  Frame* frame = nullptr;
  int64_t seen_sequence = -1;
  Arena arena;
  TrackTable tracks;
  OptionalTrackTable optional;  // no memory unless the method's tracker writes it
  PathTable paths;
};

class Detector {
 public:
  // Null, with a status and a sentence, if the def is wrong or a resource is missing.
  static std::unique_ptr<Detector> create(const ovt_detector_def& def, ovt_status& status, std::string& error);
  // Finishes the frames of all that was pushed and stops the detector. The last reader frees the memory.
  static void destroy(Detector* detector);
  ~Detector();

  // Counts a call with a bad argument. The first one goes to the log with the argument's name.
  ovt_status refuse_push(const char* function, const char* argument) noexcept;
  ovt_status push_scan(const ovt_points& points);
  ovt_status push_points(const ovt_points& piece);
  ovt_status end_scan(int32_t sensor, int64_t stamp_ns, int32_t point_count);  // point_count -1: unknown
  ovt_status push_ego_pose(const ovt_ego_pose& pose);
  ovt_status push_detections(const ovt_external_detections& detections);
  ovt_status advance(int64_t now_ns);
  ovt_status flush();

  ovt_status create_reader(Reader** out);
  void destroy_reader(Reader* reader);
  ovt_status next_frame(Reader& reader);
  ovt_status set_path_horizon(Reader& reader, double horizon_s);
  int64_t publish_tracks(Reader& reader, int64_t publish_ns);  // returns the time that the tracks are predicted to

  void read_stats(ovt_stats& out) const;
  ovt_runtime_info runtime_info() const;
  int32_t sensor_count() const { return context_.sensor_count; }
  std::span<const SensorModel> sensors() const { return {context_.sensors, std::size_t(context_.sensor_count)}; }
  const Method& method() const { return *context_.method; }
  double path_step_s() const { return track_stage_->tracker().path_step_s(); }
  Counters& counters() { return counters_; }
  // Tests only; call before the first push.
  void set_hook(const TestHook& hook) { context_.hook = hook; }
  // Tests only: runs on the intake, which looks already, each time after it has looked into every mailbox.
  void set_gather_hook(void (*call)(void* user), void* user) {
    gather_user_ = user;
    gather_hook_.store(call, std::memory_order_release);
  }
  uint64_t flushes_asked() const { return flush_wanted_.load(std::memory_order_acquire); }

 private:
  Detector() = default;
  ovt_status build(const ovt_detector_def& def, std::string& error);
  ovt_status build_context(const ovt_detector_def& def, const ovt_params& params, std::string& error);
  ovt_status build_map(const ovt_map_def& given, std::string& error);
  ovt_status build_tables(const ovt_detector_def& def, const ovt_params& params, std::string& error);
  ovt_status build_runner(const ovt_detector_def& def, const ovt_params& params, std::string& error);
  void log_granted(const ovt_detector_def& def) const;
  ovt_status build_reader(Reader& reader);
  void finish(Frame& frame);
  bool count_results(const Frame& frame);
  void call_on_frame(Frame& frame);
  void log(ovt_log_level level, const char* text) const noexcept;
  void stop();
  void drop_owner();
  void tell_intake();
  void finish_pushed();
  void wait_for_poses();
  bool enter();
  // With worker_count 1 the caller runs everything, one call at a time: a Turn is refused while another call runs. A
  // call from on_frame is always refused: it might wait for on_frame's own frame.
  class Turn {
   public:
    explicit Turn(Detector& detector) : detector_(detector), mine_(detector.enter()) {}
    ~Turn() {
      if (mine_) detector_.inside_.store(false, std::memory_order_release);
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    explicit operator bool() const noexcept { return mine_; }

   private:
    Detector& detector_;
    const bool mine_;
  };
  // scans, whole or in pieces (detector_stream.cpp)
  ovt_status refuse_producer(ScanStream& stream) noexcept;
  bool begin_scan(ScanStream& stream, int32_t sensor, int64_t stamp_ns);
  void close_scan(ScanStream& stream, int32_t sensor, bool ended, int32_t point_count);
  bool stepped_ahead(const ScanStream& stream, int64_t stamp_ns) const noexcept;
  void give_up_scan(ScanStream& stream, int32_t sensor);
  void note_closed(ScanStream& stream, int64_t stamp_ns) noexcept;
  void post_scan(int32_t sensor, int64_t stamp_ns);
  template <class IsOver>
  void close_open_scans(IsOver&& is_over);
  void close_late_scans(int64_t now_ns);  // ovt_advance's time
  void close_all_scans();
  void note_stamp(int32_t sensor, int64_t stamp_ns);
  // intake
  void run_intake();
  bool step_intake();
  void gather();
  void read_poses_of(int64_t count) noexcept;
  bool is_pending_before(uint64_t ticket) noexcept;
  int32_t find_next();
  bool place_pending_scan(int32_t sensor);
  bool place_pending_detections();
  void count_settled();
  void watch_frames();

  Allocator callers_;  // the def's alloc and free
  Memory memory_;      // before all other members: every block is returned to it
  StageContext context_;
  std::unique_ptr<SegmentScratch[]> scratch_;  // one per thread of the arena; one with worker_count 1
  std::unique_ptr<SpareWorkers> spare_;        // null: no scan is segmented in parts
  int32_t worker_count_ = 1, max_frames_ = 1;
  bool process_locked_ = false;
  CircuitMap map_;
  int32_t point_capacity_[kMaxSensors] = {};
  TrackerParams tracker_params_;
  bool push_waits_ = false;
  ovt_frame_fn* on_frame_ = nullptr;
  ovt_log_fn* log_ = nullptr;
  void* user_ = nullptr;
  int64_t deadline_ns_ = 0, watchdog_ns_ = 0, spin_ns_ = 0;

  Counters counters_;
  FramePool pool_;
  Mailbox<Scan> mailboxes_[kMaxSensors];
  Mailbox<ExternalScan> external_;
  std::unique_ptr<EgoBuffer> ego_;
  HeightProfile profile_;
  PoseRepair pose_repair_;
  BankAttitude bank_attitude_;
  std::unique_ptr<TrackStage> track_stage_;
  std::unique_ptr<ThreadSetup> thread_setup_;
  std::unique_ptr<FrameRunner> runner_;
  std::unique_ptr<FrameAssembler> assembler_;
  Reader callback_reader_;
  int32_t reader_capacity_ = 0;
  std::atomic<int32_t> reader_count_{0};
  std::atomic<int32_t> owners_{1};  // the caller's handle and all readers
  const pid_t process_ = getpid();  // a forked child has neither the threads nor the blocks
  std::atomic<bool> closed_{false};

  // used by producers
  LastStamp last_external_;
  int64_t placed_poses_ = 0;  // replay: all that was pushed before this pose is in frames
  int64_t period_ns_ = 0;
  double scan_limit_ = 0;        // periods; 0: none
  int64_t longest_step_ns_ = 0;  // of a sensor's stamps; a longer one is a gap, or a jump of its clock
  ScanStream streams_[kMaxSensors];
  std::atomic<uint64_t> tickets_{0};

  // shared by callers and the intake thread
  bool inline_ = true;
  std::atomic<bool> inside_{false}, reported_wrong_thread_{false};  // inline
  std::atomic<bool> reported_bad_argument_{false};
  bool reported_wrong_rate_ = false, reported_held_ = false;  // of the producer of the poses
  bool reported_repeat_ = false;                              // of the intake
  Event event_;
  std::atomic<bool> stop_{false};
  enum StartState : int32_t { kStarting, kRunning, kFailed, kNoThread };
  std::atomic<StartState> start_state_{kStarting};
  // What ovt_advance asks for. A later call may replace it while the intake reads it.
  struct Advance {
    int64_t now_ns;
    int64_t poses;    // pushed before
    uint64_t before;  // it waits for what was pushed before this ticket
  };
  SharedWords<Advance> advance_;
  std::atomic<uint64_t> advance_version_{0};  // odd while a call stores it; else twice the number of calls
  std::atomic<uint64_t> advance_done_{0};     // the version that was handled last
  std::atomic<uint64_t> flush_wanted_{0}, flush_done_{0};
  std::atomic<uint64_t> flush_before_{0};                                    // as Advance::before
  std::atomic<int64_t> flush_poses_{0};                                      // as Advance::poses
  std::atomic<uint64_t> poses_wanted_{0}, poses_done_{0}, poses_before_{0};  // of ovt_push_ego_pose in a replay
  uint64_t flushed_ = 0;        // intake: the last flush that closed its frames
  int64_t flushed_frames_ = 0;  // ... and waits for so many
  std::thread intake_;
  std::atomic<void (*)(void* user)> gather_hook_{nullptr};
  void* gather_user_ = nullptr;
};

}  // namespace overtake
