// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The scans of one sensor on their way to its mailbox, whole or in pieces: the open scan, and what the scans before it
// tell of the next ones (detector_stream.cpp).
#pragma once

#include <atomic>
#include <cstdint>

#include "core/sensor_model.h"
#include "pipeline/early_segment.h"
#include "pipeline/scan_builder.h"
#include "pipeline/sensor_rhythm.h"

namespace overtake {

struct LastStamp {
  bool any = false;
  int64_t last_ns = 0;
};

// Its owner is the sensor's producer, in a call; or, while no such call runs, another thread, which closes a scan that
// was not ended.
struct ScanStream {
  enum Owner : int32_t { kFree, kFreeOpen, kProducer, kCloser };  // kFreeOpen: a scan is open
  std::atomic<int32_t> owner{kFree};
  std::atomic<bool> reported_producers{false};

  // Of the open scan. Other threads read them before they try to become the owner.
  std::atomic<int64_t> stamp_ns{0};
  std::atomic<int64_t> limit_ns{0};                  // the time in which it should end; 0: none
  std::atomic<int64_t> passed_ns[kMaxSensors] = {};  // time that passed since it began, by each sensor's stamps

  // The owner's.
  ScanBuilder builder;
  EarlySegment early;
  EarlyPool early_pool;
  bool is_open = false;
  bool is_refused = false;  // it has too many points
  int64_t load_start_ns = 0, load_ns = 0;
  LastStamp last, last_noted;  // of scans that were closed; of those that count for passed_ns
  SensorRhythm rhythm;         // of the scans that were closed
  static constexpr uint32_t kRecent = 8;
  int64_t recent_ns[kRecent] = {};  // stamps of scans that ended
  uint32_t recent_count = 0;

  void note_recent(int64_t stamp) noexcept { recent_ns[recent_count++ % kRecent] = stamp; }
  bool is_recent(int64_t stamp) const noexcept {
    const uint32_t count = recent_count < kRecent ? recent_count : kRecent;
    for (uint32_t i = 0; i < count; ++i)
      if (recent_ns[i] == stamp) return true;
    return false;
  }
};

}  // namespace overtake
