// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/python/frame_source.h"

#include <algorithm>
#include <map>
#include <utility>

namespace overtake::python {
namespace {

class LiveSource : public FrameSource {
 public:
  LiveSource(std::shared_ptr<ReaderPool> pool, ovt_reader* reader) : pool_(std::move(pool)), reader_(reader) {}
  ~LiveSource() override { pool_->give_back(reader_); }
  bool is_live() const override { return true; }

  ovt_status read_detections(ovt_detections& out) override { return ovt_read_detections(reader_, &out); }
  ovt_status read_clusters(ovt_clusters& out) override { return ovt_read_clusters(reader_, &out); }
  // Copied, because the next call writes to the same memory of the reader. Those at the frame's stamp are kept.
  ovt_status read_tracks(int64_t publish_ns, std::shared_ptr<const TracksCopy>& out) override {
    if (publish_ns == OVT_AT_FRAME_STAMP && (out = at_stamp_)) return OVT_OK;
    ovt_tracks rows;
    const ovt_status status = ovt_read_tracks(reader_, publish_ns, &rows);
    if (status != OVT_OK) return status;
    out = std::make_shared<const TracksCopy>(rows);
    if (publish_ns == OVT_AT_FRAME_STAMP) at_stamp_ = out;
    return OVT_OK;
  }
  ovt_status read_labels(int32_t sensor, ovt_labels& out) override { return ovt_read_labels(reader_, sensor, &out); }
  ovt_status read_image(int32_t sensor, ovt_image_id image, ovt_image& out) override {
    return ovt_read_image(reader_, sensor, image, &out);
  }
  ovt_status read_span(int32_t sensor, ovt_stage stage, ovt_span& out) override {
    return ovt_read_span(reader_, sensor, stage, &out);
  }

 private:
  const std::shared_ptr<ReaderPool> pool_;
  ovt_reader* const reader_;
  std::shared_ptr<const TracksCopy> at_stamp_;
};

class CopiedSource : public FrameSource {
 public:
  CopiedSource(ovt_reader* reader, const CopyOptions& options) {
    copy_detections(reader);
    copy_clusters(reader);
    ovt_tracks rows;
    check(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &rows), "tracks");
    tracks_ = std::make_shared<const TracksCopy>(rows);
    for (int32_t sensor = -1; sensor < options.sensor_count; ++sensor) {
      for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage) {
        Span& span = spans_[{sensor, stage}];
        span.status = ovt_read_span(reader, sensor, ovt_stage(stage), &span.value);
      }
      if (sensor < 0) continue;
      copy_labels(reader, sensor, options.labels);
      for (int32_t image = 0; image < OVT_IMAGE_COUNT; ++image) copy_image(reader, sensor, image, options.images);
    }
  }

  bool is_live() const override { return false; }
  ovt_status read_detections(ovt_detections& out) override { return out = detections_, OVT_OK; }
  ovt_status read_clusters(ovt_clusters& out) override { return out = clusters_, OVT_OK; }
  ovt_status read_tracks(int64_t publish_ns, std::shared_ptr<const TracksCopy>& out) override {
    if (publish_ns != OVT_AT_FRAME_STAMP && publish_ns != tracks_->rows.publish_ns) return OVT_NOT_KEPT;
    out = tracks_;
    return OVT_OK;
  }
  ovt_status read_labels(int32_t sensor, ovt_labels& out) override { return find(labels_, sensor, out); }
  ovt_status read_image(int32_t sensor, ovt_image_id image, ovt_image& out) override {
    return find(images_, std::pair(sensor, int32_t(image)), out);
  }
  ovt_status read_span(int32_t sensor, ovt_stage stage, ovt_span& out) override {
    return find(spans_, std::pair(sensor, int32_t(stage)), out);
  }

 private:
  template <class T>
  struct Kept {
    T value{};
    ovt_status status = OVT_BAD_ARGUMENT;
  };
  using Span = Kept<ovt_span>;

  template <class Map, class Key, class T>
  static ovt_status find(const Map& map, const Key& key, T& out) {
    const auto found = map.find(key);
    if (found == map.end()) return OVT_BAD_ARGUMENT;
    out = found->second.value;
    return found->second.status;
  }

  void copy_detections(ovt_reader* reader) {
    ovt_detections& rows = detections_;
    check(ovt_read_detections(reader, &rows), "detections");
#define OVT_DETECTION(type, name, ...) rows.name = columns_.copy(rows.name, std::size_t(rows.count));
#define OVT_DETECTION_TRACK OVT_DETECTION
#define OVT_DETECTION_VIEW OVT_DETECTION
#include "core/columns.def"
  }

  void copy_clusters(ovt_reader* reader) {
    ovt_clusters& rows = clusters_;
    check(ovt_read_clusters(reader, &rows), "clusters");
#define OVT_CLUSTER(type, name, ...) rows.name = columns_.copy(rows.name, std::size_t(rows.count));
#include "core/columns.def"
  }

  void copy_labels(ovt_reader* reader, int32_t sensor, bool wanted) {
    Kept<ovt_labels>& kept = labels_[sensor];
    ovt_labels& rows = kept.value;
    kept.status = ovt_read_labels(reader, sensor, &rows);
    if (kept.status != OVT_OK) return;
    if (!wanted) {
      kept.status = OVT_NOT_KEPT;
      return;
    }
#define OVT_LABEL(type, name, ...) rows.name = columns_.copy(rows.name, std::size_t(rows.count));
#define OVT_LABEL_CLUSTER(type, name, ...) rows.name = columns_.copy(rows.name, std::size_t(rows.label_count + 1));
#include "core/columns.def"
  }

  void copy_image(ovt_reader* reader, int32_t sensor, int32_t id, bool wanted) {
    Kept<ovt_image>& kept = images_[{sensor, id}];
    ovt_image& image = kept.value;
    kept.status = ovt_read_image(reader, sensor, ovt_image_id(id), &image);
    if (kept.status != OVT_OK) return;
    if (!wanted) {
      kept.status = OVT_NOT_KEPT;
      return;
    }
    image.data = columns_.copy(static_cast<const char*>(image.data), std::size_t(image.rows) * image.stride_bytes);
  }

  Columns columns_;
  ovt_detections detections_;
  ovt_clusters clusters_;
  std::shared_ptr<const TracksCopy> tracks_;
  std::map<int32_t, Kept<ovt_labels>> labels_;
  std::map<std::pair<int32_t, int32_t>, Kept<ovt_image>> images_;
  std::map<std::pair<int32_t, int32_t>, Span> spans_;
};

void set_horizon(ovt_reader* reader, double path_horizon_s) {
  if (path_horizon_s >= 0) check(ovt_set_path_horizon(reader, path_horizon_s), "path_horizon_s");
}

}  // namespace

TracksCopy::TracksCopy(const ovt_tracks& from) : rows(from) {
  const auto count = std::size_t(rows.count), path_count = count * std::size_t(rows.path_points);
#define OVT_TRACK(type, name, ...) rows.name = columns.copy(rows.name, count);
#define OVT_TRACK_OPTIONAL OVT_TRACK
#define OVT_TRACK_COVARIANCE(type, name, ...) \
  for (const type*& column : rows.name) column = columns.copy(column, count);
#define OVT_PATH(type, name, ...) rows.path_##name = columns.copy(rows.path_##name, path_count);
#define OVT_PATH_OPTIONAL OVT_PATH
#include "core/columns.def"
  double* full = columns.make<double>(count * 25);
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t column = 0;
    for (std::size_t r = 0; r < 5; ++r)
      for (std::size_t c = 0; c <= r; ++c) {
        const double value = rows.covariance[column++][i];
        full[i * 25 + r * 5 + c] = value;
        full[i * 25 + c * 5 + r] = value;
      }
  }
  covariance = full;
}

ReaderPool::~ReaderPool() { close(); }

void ReaderPool::close() {
  detector_ = nullptr;
  for (ovt_reader* reader : free_) ovt_destroy_reader(reader);
  free_.clear();
}

void ReaderPool::give_back(ovt_reader* reader) {
  if (detector_)
    free_.push_back(reader);
  else
    ovt_destroy_reader(reader);
}

std::unique_ptr<FrameSource> ReaderPool::take(const std::shared_ptr<ReaderPool>& self, ovt_frame_info& info,
                                              int32_t capacity, double path_horizon_s) {
  if (!detector_) return nullptr;
  if (free_.empty()) {
    if (made_ >= capacity)
      throw StatusError(OVT_TOO_MANY,
                        "all " + std::to_string(capacity) +
                            " frames of frame_capacity are held by frames, tables or arrays: copy what you keep "
                            "(to_dict(), numpy.array), or call release()");
    ovt_reader* reader = nullptr;
    check(ovt_create_reader(detector_, &reader), "reader");
    ++made_;
    free_.push_back(reader);
    set_horizon(reader, path_horizon_s);
  }
  ovt_reader* reader = free_.back();  // the one used last: its frame is the newest
  const ovt_status status = ovt_next_frame(reader, &info);
  if (status == OVT_NO_FRAME) return nullptr;
  check(status, "next_frame");
  if (info.sequence <= last_sequence_) return nullptr;  // another reader had it
  last_sequence_ = info.sequence;
  auto source = std::make_unique<LiveSource>(self, reader);
  free_.pop_back();
  return source;
}

void FrameQueue::on_frame(ovt_reader* reader, void* self) {
  auto& queue = *static_cast<FrameQueue*>(self);
  try {
    CopiedFrame frame = queue.copy(reader);  // several MB: without the lock, for which pop() waits with the GIL
    const std::lock_guard lock(queue.mutex_);
    queue.frames_.push_back(std::move(frame));
  } catch (...) {
    const std::lock_guard lock(queue.mutex_);
    if (!queue.failure_) queue.failure_ = std::current_exception();
  }
}

CopiedFrame FrameQueue::copy(ovt_reader* reader) const {
  CopiedFrame frame;
  check(ovt_read_info(reader, &frame.info), "frame");
  set_horizon(reader, options_.path_horizon_s);
  frame.source = std::make_unique<CopiedSource>(reader, options_);
  return frame;
}

bool FrameQueue::pop(CopiedFrame& out) {
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  if (frames_.empty()) return false;
  out = std::move(frames_.front());
  frames_.pop_front();
  return true;
}

}  // namespace overtake::python
