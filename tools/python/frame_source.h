// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Where a frame's tables are. A live source is a reader of the detector: its tables are the library's own memory, and
// the reader goes back to the detector when the last array is gone. A copied source owns its tables: frames that are
// queued while the detector goes on.
//
//   Frame, Detections, ... --> FrameHold --> FrameSource <-- arrays (their base)
//
// Frame.release() empties the hold, so the frame and its tables raise from then on; arrays keep the source.
#pragma once

#include <cstring>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "tools/python/errors.h"

namespace overtake::python {

// Copies of columns, freed together.
class Columns {
 public:
  template <class T>
  const T* copy(const T* from, std::size_t count) {
    if (!from) return nullptr;
    T* to = make<T>(count);
    if (count > 0) std::memcpy(to, from, count * sizeof(T));
    return to;
  }
  template <class T>
  T* make(std::size_t count) {
    blocks_.emplace_back(new char[count * sizeof(T) + 1]);
    return reinterpret_cast<T*>(blocks_.back().get());
  }

 private:
  std::vector<std::unique_ptr<char[]>> blocks_;
};

// A copy of ovt_tracks: a reader has room for the tracks at one time only, so those of Frame.tracks would change with
// Frame.tracks_at. covariance: [count][5][5], symmetric.
struct TracksCopy {
  explicit TracksCopy(const ovt_tracks& from);
  Columns columns;
  ovt_tracks rows;
  const double* covariance;
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;
  virtual bool is_live() const = 0;  // its tables are in a reader, and arrays of it hold the reader's frame
  virtual ovt_status read_detections(ovt_detections& out) = 0;
  virtual ovt_status read_tracks(int64_t publish_ns, std::shared_ptr<const TracksCopy>& out) = 0;
  virtual ovt_status read_clusters(ovt_clusters& out) = 0;
  virtual ovt_status read_labels(int32_t sensor, ovt_labels& out) = 0;
  virtual ovt_status read_image(int32_t sensor, ovt_image_id image, ovt_image& out) = 0;
  virtual ovt_status read_span(int32_t sensor, ovt_stage stage, ovt_span& out) = 0;
};

// The readers of a detector that no frame holds.
class ReaderPool {
 public:
  explicit ReaderPool(ovt_detector* detector) : detector_(detector) {}
  ~ReaderPool();
  // Null: no frame is newer than the last one taken. Throws StatusError if every reader is held.
  std::unique_ptr<FrameSource> take(const std::shared_ptr<ReaderPool>& self, ovt_frame_info& info, int32_t capacity,
                                    double path_horizon_s);
  void close();  // the last reader gives the detector's memory back
  void give_back(ovt_reader* reader);

 private:
  ovt_detector* detector_;  // null: closed
  std::vector<ovt_reader*> free_;
  int32_t made_ = 0;
  int64_t last_sequence_ = -1;
};

struct CopyOptions {
  int32_t sensor_count = 0;
  bool labels = false, images = false;
  double path_horizon_s = -1;  // below 0: that of the parameters
};

struct CopiedFrame {
  ovt_frame_info info;
  std::unique_ptr<FrameSource> source;
};

// Copies of every finished frame, in their order.
class FrameQueue {
 public:
  explicit FrameQueue(const CopyOptions& options) : options_(options) {}
  static void on_frame(ovt_reader* reader, void* self);  // an ovt_frame_fn
  bool pop(CopiedFrame& out);                            // false: empty. Throws what went wrong in on_frame

 private:
  CopiedFrame copy(ovt_reader* reader) const;

  const CopyOptions options_;
  std::mutex mutex_;
  std::deque<CopiedFrame> frames_;
  std::exception_ptr failure_;
};

}  // namespace overtake::python
