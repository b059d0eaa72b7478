// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The C API for C++20: owning classes, spans, and a status as an exception or as a value. Header only. It copies and
// allocates nothing, uses the C API's structs, and keeps every rule of overtake.h about threads and lifetimes. The
// namespace is not the library's internal one, so this header also works with the static library.
//
//   ovt_sensor_def sensor = ovt_default_sensor_def();
//   ovt::Detector detector(ovt::definition(std::span(&sensor, 1)));       throws ovt::Error
//   ovt::Reader reader(detector);
//   ovt_points scan = ovt::scan(0, stamp_ns, points.size());
//   scan.x = ovt::column(points, &Point::x);  ...
//   if (detector.push(scan) != OVT_OK) ...                                a dropped scan is a status, not an exception
//   if (reader.next_frame())
//     if (const auto tracks = reader.tracks())
//       for (double x_m : tracks->x_m()) ...
#pragma once

#include <cstddef>
#include <cstdint>
#include <ranges>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "overtake.h"  // in the same folder, in the source tree and installed
#if __has_include("columns.def")
#define OVT_COLUMNS_DEF "columns.def"  // installed in the same folder
#else
#define OVT_COLUMNS_DEF "../core/columns.def"  // in the source tree
#endif

namespace ovt {

// ---- status ---------------------------------------------------------------------------------------------------------

class Error : public std::runtime_error {
 public:
  explicit Error(ovt_status status, const std::string& sentence = {})
      : std::runtime_error(sentence.empty() ? ovt_status_text(status) : sentence), status_(status) {}
  ovt_status status() const noexcept { return status_; }

 private:
  ovt_status status_;
};

inline void check(ovt_status status) {
  if (status != OVT_OK) throw Error(status);
}

// A value, or the status that tells why there is none.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(ovt_status status, const T& value) noexcept : status_(status), value_(value) {}
  explicit operator bool() const noexcept { return status_ == OVT_OK; }
  ovt_status status() const noexcept { return status_; }
  const T& operator*() const noexcept { return value_; }  // zeros unless OVT_OK
  const T* operator->() const noexcept { return &value_; }
  const T& value() const { return check(status_), value_; }  // throws Error

 private:
  ovt_status status_;
  T value_;
};

// ---- input ----------------------------------------------------------------------------------------------------------

template <class T>
constexpr int32_t kTypeOf = [] {
  static_assert(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>, "a column holds numbers");
  static_assert(std::is_floating_point_v<T> ? sizeof(T) == 4 || sizeof(T) == 8 : sizeof(T) <= 4,
                "a column holds float, double, or integers of up to 32 bits");
  if constexpr (std::is_floating_point_v<T>)
    return sizeof(T) == 4 ? OVT_F32 : OVT_F64;
  else if constexpr (sizeof(T) == 1)
    return std::is_signed_v<T> ? OVT_I8 : OVT_U8;
  else if constexpr (sizeof(T) == 2)
    return std::is_signed_v<T> ? OVT_I16 : OVT_U16;
  else
    return std::is_signed_v<T> ? OVT_I32 : OVT_U32;
}();

// Ranges that a column may point into: an array, a vector, a span, but no temporary that owns its elements.
template <class R>
concept Borrowed = std::ranges::contiguous_range<R> && std::ranges::sized_range<R> && std::ranges::borrowed_range<R>;

// One field of a scan: a range of numbers, or one member of a range of records.
template <Borrowed R>
constexpr ovt_column column(R&& numbers) noexcept {
  using T = std::ranges::range_value_t<R>;
  return {std::ranges::data(numbers), std::ranges::size(numbers) * sizeof(T), sizeof(T), kTypeOf<T>};
}
template <Borrowed R, class Record, class T>
constexpr ovt_column column(R&& records, T Record::*member) noexcept {
  constexpr std::size_t stride = sizeof(std::ranges::range_value_t<R>);
  if (std::ranges::empty(records)) return {nullptr, 0, stride, kTypeOf<T>};
  const std::size_t size_bytes = (std::ranges::size(records) - 1) * stride + sizeof(T);
  return {&(std::ranges::data(records)->*member), size_bytes, stride, kTypeOf<T>};
}

// A scan without columns; set them next.
inline ovt_points scan(int32_t sensor, int64_t stamp_ns, std::size_t count) {
  ovt_points points;
  check(ovt_points_init(&points, sizeof points));
  points.sensor = sensor;
  points.stamp_ns = stamp_ns;
  points.count = count <= INT32_MAX ? int32_t(count) : throw Error(OVT_TOO_MANY);
  return points;
}
inline ovt_ego_pose ego_pose() {
  ovt_ego_pose pose;
  check(ovt_ego_pose_init(&pose, sizeof pose));
  return pose;
}
inline ovt_external_detections external_detections() {
  ovt_external_detections detections;
  check(ovt_external_detections_init(&detections, sizeof detections));
  return detections;
}

// ---- definitions ----------------------------------------------------------------------------------------------------

// The default def with these sensors, which must exist until the detector is created.
inline ovt_detector_def definition(std::span<const ovt_sensor_def> sensors) noexcept {
  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = sensors.data();
  def.sensor_count = sensors.size() <= INT32_MAX ? int32_t(sensors.size()) : INT32_MAX;
  return def;
}

inline ovt_params params(const char* preset = "paper") {
  ovt_params params;
  check(ovt_params_init(&params, sizeof params, preset));
  return params;
}
inline void set(ovt_params& params, const char* name, const char* value) {
  const ovt_status status = ovt_set_param(&params, name, value);
  if (status != OVT_OK) throw Error(status, std::string(name) + " = " + value + ": " + ovt_status_text(status));
}
inline double get(const ovt_params& params, const char* name) {
  double value;
  check(ovt_get_param(&params, name, &value));
  return value;
}

inline ovt_build_info build_info() noexcept {
  ovt_build_info info;
  ovt_read_build_info(&info);
  return info;
}

// ---- output ---------------------------------------------------------------------------------------------------------

// Tables point into the reader's memory (overtake.h tells how long it is valid). `c` is the C struct. A column is a
// span of `c.count` values, empty if the struct has none. It has the name of its field; columns.def lists them.
#define OVT_COLUMN(type, name, ...) \
  auto name() const noexcept { return column(c.name); }

template <class Columns>
struct Table {
  Columns c{};
  std::size_t size() const noexcept { return std::size_t(c.count); }

 protected:
  template <class T>
  std::span<const T> column(const T* first) const noexcept {
    return {first, first ? size() : 0};
  }
};

struct Detections : Table<ovt_detections> {
#define OVT_DETECTION OVT_COLUMN
#define OVT_DETECTION_TRACK OVT_COLUMN
#define OVT_DETECTION_VIEW OVT_COLUMN
#include OVT_COLUMNS_DEF
};

struct Tracks : Table<ovt_tracks> {
// Element k of the covariance's lower triangle, row by row: 0 <= k < 15. Predicted path of one track: c.path_points
// values, c.path_step_s apart.
#define OVT_TRACK OVT_COLUMN
#define OVT_TRACK_OPTIONAL OVT_COLUMN
#define OVT_TRACK_COVARIANCE(type, name, ...) \
  std::span<const type> name(int32_t k) const noexcept { return column(c.name[k]); }
#define OVT_PATH(type, name, ...) \
  std::span<const type> path_##name(std::size_t track) const noexcept { return path(c.path_##name, track); }
#define OVT_PATH_OPTIONAL OVT_PATH
#include OVT_COLUMNS_DEF

 private:
  template <class T>
  std::span<const T> path(const T* all, std::size_t track) const noexcept {
    const auto points = std::size_t(c.path_points);
    if (!all || track >= size()) return {};
    return {all + track * points, points};
  }
};

struct Clusters : Table<ovt_clusters> {
#define OVT_CLUSTER OVT_COLUMN
#include OVT_COLUMNS_DEF
};

struct Labels : Table<ovt_labels> {
// Index of cluster_of_label: label, 0 to c.label_count.
#define OVT_LABEL OVT_COLUMN
#define OVT_LABEL_CLUSTER(type, name, ...) \
  std::span<const type> name() const noexcept { return {c.name, c.name ? std::size_t(c.label_count) + 1 : 0}; }
#include OVT_COLUMNS_DEF
};
#undef OVT_COLUMN
#undef OVT_COLUMNS_DEF

struct Image {
  ovt_image c{};
  int32_t rows() const noexcept { return c.rows; }
  int32_t cols() const noexcept { return c.cols; }
  // One row: float, int32_t, or uint64_t words of bits. Empty if the image has another type or no such row.
  template <class T>
  std::span<const T> row(int32_t r) const noexcept {
    constexpr bool bits = std::is_same_v<T, uint64_t>;
    static_assert(bits || std::is_same_v<T, float> || std::is_same_v<T, int32_t>, "float, int32_t or words of bits");
    constexpr int32_t type = bits ? OVT_IMAGE_BITS : std::is_same_v<T, float> ? OVT_IMAGE_F32 : OVT_IMAGE_I32;
    if (c.type != type || r < 0 || r >= c.rows) return {};
    const void* first = static_cast<const std::byte*>(c.data) + std::size_t(r) * c.stride_bytes;
    return {static_cast<const T*>(first), std::size_t(bits ? (c.cols + 63) / 64 : c.cols)};
  }
};

// The argument of on_frame: read access to the frame that the reader is positioned at.
class FrameView {
 public:
  explicit FrameView(ovt_reader* reader) noexcept : reader_(reader) {}
  ovt_reader* get() const noexcept { return reader_; }

  Result<ovt_frame_info> info() const noexcept {
    return read<ovt_frame_info>([&](auto* out) { return ovt_read_info(reader_, out); });
  }
  Result<Detections> detections() const noexcept {
    return read<Detections>([&](auto* out) { return ovt_read_detections(reader_, &out->c); });
  }
  // How far tracks() predicts paths, 0: no paths. From on_frame too, whose reader keeps it for the next frames.
  [[nodiscard]] ovt_status set_path_horizon(double horizon_s) const noexcept {
    return ovt_set_path_horizon(reader_, horizon_s);
  }
  Result<Tracks> tracks(int64_t publish_ns = OVT_AT_FRAME_STAMP) const noexcept {
    return read<Tracks>([&](auto* out) { return ovt_read_tracks(reader_, publish_ns, &out->c); });
  }
  Result<Clusters> clusters() const noexcept {
    return read<Clusters>([&](auto* out) { return ovt_read_clusters(reader_, &out->c); });
  }
  Result<Labels> labels(int32_t sensor) const noexcept {
    return read<Labels>([&](auto* out) { return ovt_read_labels(reader_, sensor, &out->c); });
  }
  Result<Image> image(int32_t sensor, ovt_image_id id) const noexcept {
    return read<Image>([&](auto* out) { return ovt_read_image(reader_, sensor, id, &out->c); });
  }
  Result<ovt_span> span(ovt_stage stage, int32_t sensor = -1) const noexcept {
    return read<ovt_span>([&](auto* out) { return ovt_read_span(reader_, sensor, stage, out); });
  }

 protected:
  template <class T, class Read>
  static Result<T> read(Read&& into) noexcept {
    T out{};
    const ovt_status status = into(&out);
    return {status, out};
  }
  ovt_reader* reader_;
};

// ---- owners ---------------------------------------------------------------------------------------------------------

class Detector {
 public:
  // Throws Error with a sentence that names the wrong field.
  explicit Detector(const ovt_detector_def& def) {
    char sentence[256];
    const ovt_status status = ovt_create_detector_verbose(&def, &detector_, sentence, sizeof sentence);
    if (status != OVT_OK) throw Error(status, sentence);
  }
  ~Detector() { ovt_destroy_detector(detector_); }
  Detector(Detector&& from) noexcept : detector_(std::exchange(from.detector_, nullptr)) {}
  Detector& operator=(Detector&& from) noexcept {
    Detector gone(std::move(from));
    std::swap(detector_, gone.detector_);
    return *this;
  }
  ovt_detector* get() const noexcept { return detector_; }

  // Late and repeated stamps are normal on a race track: push returns the status. check() throws on it.
  [[nodiscard]] ovt_status push(const ovt_points& scan) noexcept { return ovt_push_scan(detector_, &scan); }
  // A part of a scan; the scan counts when end_scan ends it.
  [[nodiscard]] ovt_status push_piece(const ovt_points& piece) noexcept { return ovt_push_points(detector_, &piece); }
  [[nodiscard]] ovt_status end_scan(int32_t sensor, int64_t stamp_ns, int32_t point_count = -1) noexcept {
    return ovt_end_scan(detector_, sensor, stamp_ns, point_count);
  }
  [[nodiscard]] ovt_status push(const ovt_ego_pose& pose) noexcept { return ovt_push_ego_pose(detector_, &pose); }
  [[nodiscard]] ovt_status push(const ovt_external_detections& rows) noexcept {
    return ovt_push_detections(detector_, &rows);
  }
  [[nodiscard]] ovt_status advance(int64_t now_ns) noexcept { return ovt_advance(detector_, now_ns); }
  [[nodiscard]] ovt_status flush() noexcept { return ovt_flush(detector_); }

  ovt_stats stats() const {
    ovt_stats stats = ovt_default_stats();
    check(ovt_read_stats(detector_, &stats));
    return stats;
  }
  ovt_runtime_info runtime_info() const {
    ovt_runtime_info info{};
    check(ovt_read_runtime_info(detector_, &info));
    return info;
  }

 private:
  ovt_detector* detector_ = nullptr;
};

// May exist longer than its detector; it then gets no newer frame.
class Reader : public FrameView {
 public:
  explicit Reader(const Detector& detector) : FrameView(nullptr) { check(ovt_create_reader(detector.get(), &reader_)); }
  ~Reader() { ovt_destroy_reader(reader_); }
  Reader(Reader&& from) noexcept : FrameView(std::exchange(from.reader_, nullptr)) {}
  Reader& operator=(Reader&& from) noexcept {
    Reader gone(std::move(from));
    std::swap(reader_, gone.reader_);
    return *this;
  }

  Result<ovt_frame_info> next_frame() noexcept {
    return read<ovt_frame_info>([&](auto* out) { return ovt_next_frame(reader_, out); });
  }
};

// ---- callbacks ------------------------------------------------------------------------------------------------------

// Sets the def's callbacks to those of these functions that the handler has, and the others to null: all callbacks of a
// def get the same `user`, so they need one handler. The handler must outlive the detector, with allocate and release
// also the last of its readers. Each must be noexcept: an exception cannot cross the C API. overtake.h tells which
// thread calls which (ovt_frame_fn, ovt_log_fn, ovt_alloc_fn).
//   void on_frame(ovt::FrameView)                    void log(ovt_log_level, std::string_view)
//   void* allocate(size_t bytes, size_t alignment)   void release(void* block, size_t bytes)
template <class Handler>
void bind(ovt_detector_def& def, Handler& handler) noexcept {
  constexpr bool frames = requires(FrameView frame) { handler.on_frame(frame); };
  constexpr bool logs = requires(std::string_view text) { handler.log(OVT_LOG_INFO, text); };
  constexpr bool allocates = requires(std::size_t n, void* p) { handler.allocate(n, n), handler.release(p, n); };
  static_assert(frames || logs || allocates, "the handler has none of the callback functions");
  def.user = &handler;
  def.on_frame = nullptr;
  def.log = nullptr;
  def.alloc = nullptr;
  def.free = nullptr;
  if constexpr (frames) {
    static_assert(noexcept(handler.on_frame(FrameView(nullptr))), "on_frame must be noexcept");
    def.on_frame = [](ovt_reader* reader, void* user) { static_cast<Handler*>(user)->on_frame(FrameView(reader)); };
  }
  if constexpr (logs) {
    static_assert(noexcept(handler.log(OVT_LOG_INFO, std::string_view())), "log must be noexcept");
    def.log = [](ovt_log_level level, const char* text, void* user) { static_cast<Handler*>(user)->log(level, text); };
  }
  if constexpr (allocates) {
    static_assert(noexcept(handler.allocate(1, 1)), "allocate must be noexcept");
    static_assert(noexcept(handler.release(nullptr, 1)), "release must be noexcept");
    def.alloc = [](std::size_t bytes, std::size_t alignment, void* user) {
      return static_cast<void*>(static_cast<Handler*>(user)->allocate(bytes, alignment));
    };
    def.free = [](void* block, std::size_t bytes, void* user) { static_cast<Handler*>(user)->release(block, bytes); };
  }
}

}  // namespace ovt
