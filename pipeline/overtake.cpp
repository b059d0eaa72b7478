// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The C API functions: each checks every argument before any state changes, and lets no exception reach the caller.
#include "pipeline/overtake.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <string>

#include "core/float_mode.h"
#include "core/math.h"
#include "pipeline/abi.h"
#include "pipeline/build_info.h"
#include "pipeline/detector.h"
#include "pipeline/method/methods.h"

using namespace overtake;

namespace {

Detector& cpp(ovt_detector* detector) { return *reinterpret_cast<Detector*>(detector); }
Reader& cpp(ovt_reader* reader) { return *reinterpret_cast<Reader*>(reader); }

// Runs a call in the usual floating-point mode and turns an exception into a status.
template <class Body>
ovt_status guard(ovt_detector* detector, Body&& body) noexcept {
  const FloatMode usual;
  try {
    return body();
  } catch (const std::bad_alloc&) {
    return OVT_NO_MEMORY;
  } catch (...) {
    if (detector) cpp(detector).counters().exceptions.fetch_add(1, std::memory_order_relaxed);
    return OVT_INTERNAL;
  }
}

ovt_detector_def default_detector_def() {
  ovt_detector_def def{};
  def.struct_size = sizeof def;
  def.worker_count = 1;
  def.cluster_capacity = 4096;
  def.candidate_capacity = 256;
  def.track_capacity = 256;
  def.frames_in_flight = 3;
  def.reader_capacity = 4;
  def.ego_pose_capacity = 1024;
  def.watchdog_ns = 1'000'000'000;
  def.memory = OVT_MEMORY_HUGE;
  def.keep_images = 1;
  return def;
}

size_t size_of_type(int32_t type) {
  // clang-format off
  switch (type) {
    case OVT_I8: case OVT_U8: return 1;
    case OVT_I16: case OVT_U16: return 2;
    case OVT_F32: case OVT_I32: case OVT_U32: return 4;
    case OVT_F64: return 8;
    default: return 0;
  }
  // clang-format on
}

// Whether the column holds `count` values of an allowed type within its declared bytes.
bool good_column(const ovt_column& c, int32_t count, bool required, bool floating_only) {
  if (c.type == OVT_NONE) return !required;
  const size_t size = size_of_type(c.type);
  if (size == 0) return false;
  if (floating_only && c.type != OVT_F32 && c.type != OVT_F64) return false;
  if (count == 0) return true;
  if (!c.data || c.stride < size || c.stride > (size_t(1) << 31)) return false;
  return c.size_bytes >= size && (c.size_bytes - size) / c.stride >= size_t(count - 1);
}

// The argument that is wrong, null if none is.
const char* find_bad_points(const ovt_points& p, int32_t sensor_count) {
  if (p.sensor < 0 || p.sensor >= sensor_count) return "sensor";
  if (p.count < 0) return "count";
  const int32_t n = p.count;
  if (!good_column(p.x, n, true, true)) return "x (its type, stride, size_bytes or data)";
  if (!good_column(p.y, n, true, true)) return "y (its type, stride, size_bytes or data)";
  if (!good_column(p.z, n, true, true)) return "z (its type, stride, size_bytes or data)";
  if (!good_column(p.layer, n, true, false)) return "layer (its type, stride, size_bytes or data)";
  if (!good_column(p.intensity, n, false, false)) return "intensity (its type, stride, size_bytes or data)";
  if (!good_column(p.time, n, false, false)) return "time (its type, stride, size_bytes or data)";
  return std::isfinite(p.time_unit_ns) ? nullptr : "time_unit_ns";
}

const char* find_bad_pose(const ovt_ego_pose& p) {
  const auto is_beyond = [](double value, double limit) { return !(std::fabs(value) <= limit); };  // true for NaN
  if (is_beyond(p.x_m, kMaxPlace_m)) return "x_m";
  if (is_beyond(p.y_m, kMaxPlace_m)) return "y_m";
  if (is_beyond(p.z_m, kMaxPlace_m)) return "z_m";
  if (is_beyond(p.roll_rad, kMaxAngle_rad)) return "roll_rad";
  if (is_beyond(p.pitch_rad, kMaxAngle_rad)) return "pitch_rad";
  if (is_beyond(p.yaw_rad, kMaxAngle_rad)) return "yaw_rad";
  if (is_beyond(p.speed_mps, kMaxSpeed_mps)) return "speed_mps";
  return is_beyond(p.yaw_rate_rps, kMaxYawRate_rps) ? "yaw_rate_rps" : nullptr;
}

const char* find_bad_detections(const ovt_external_detections& d) {
  if (d.count < 0) return "count";
  if (d.count > 0 && (!d.x_m || !d.y_m)) return "x_m or y_m (null)";
  if (d.reference != OVT_REFERENCE_VEHICLE && d.reference != OVT_REFERENCE_MAP) return "reference";
  if ((d.var_x == nullptr) != (d.var_y == nullptr)) return "var_x or var_y (one without the other)";
  for (const double* column :
       {d.x_m, d.y_m, d.heading_rad, d.var_x, d.var_y, d.cov_xy, d.length_m, d.width_m, d.height_m, d.score})
    if (d.count > 0 && reinterpret_cast<uintptr_t>(column) % alignof(double) != 0)
      return "a column (not at the address of a double)";
  return nullptr;
}

// Checks the arguments of ovt_push_scan and ovt_push_points.
ovt_status check_points(ovt_detector* detector, const ovt_points* scan, const char* function) {
  if (!detector) return OVT_BAD_ARGUMENT;
  if (!scan) return cpp(detector).refuse_push(function, "a null pointer");
  if (!is_known_size<ovt_points>(scan->struct_size)) return OVT_BAD_VERSION;
  const char* bad = find_bad_points(*scan, cpp(detector).sensor_count());
  return bad ? cpp(detector).refuse_push(function, bad) : OVT_OK;
}

const char* const kStatusText[] = {
    "ok",
    "bad argument: a null pointer, or a count, stride, type or value out of bounds",
    "bad version: the header and the library do not match",
    "unknown name of a preset, parameter or ISA",
    "out of range: a parameter's value is outside its limits",
    "no memory",
    "the system refused a thread",
    "no (new) finished frame",
    "duplicate: the stamp, or a point of the piece, came before",
    "late: the stamp is older than one already used, or the scan ended already",
    "too many: more than the capacity set at create",
    "internal error: an exception was caught",
    "not kept: keep_images was 0 at create",
    "wrong thread: called from on_frame, or while another thread is in a call that excludes this one",
    "not computed: the detector's method has no such image or stage",
};

const char* const kImageName[OVT_IMAGE_COUNT] = {
    "range",        "elevation", "pixel_point",    "range_filled",       "elevation_filled",   "angle",
    "angle_smooth", "nonground", "range_repaired", "elevation_repaired", "nonground_repaired", "labels",
    "height"};

constexpr Column kImageColumn[OVT_IMAGE_COUNT] = {Column::range_m,
                                                  Column::elevation_rad,
                                                  Column::pixel_point,
                                                  Column::range_filled_m,
                                                  Column::elevation_filled_rad,
                                                  Column::angle_rad,
                                                  Column::angle_smooth_rad,
                                                  Column::nonground,
                                                  Column::range_repaired_m,
                                                  Column::elevation_repaired_rad,
                                                  Column::nonground_repaired,
                                                  Column::labels,
                                                  Column::height_m};

const char* const kStageName[OVT_STAGE_COUNT] = {"load",   "project", "gaps",  "angle",    "smooth",  "ground",
                                                 "repair", "link",    "label", "clusters", "segment", "merge",
                                                 "gate",   "pose",    "track", "frame"};

// Whether the reader is positioned at a frame.
bool standing(ovt_reader* reader) { return reader && cpp(reader).frame; }

const SensorPart* part_of(ovt_reader* reader, int32_t sensor) {
  Reader& r = cpp(reader);
  if (sensor < 0 || sensor >= r.detector->sensor_count()) return nullptr;
  return &r.frame->sensors[sensor];
}

void fill_info(const Frame& frame, std::span<const SensorModel> sensors, ovt_frame_info* out) {
  *out = {};
  out->sequence = frame.sequence;
  out->first_stamp_ns = frame.first_stamp_ns;
  out->stamp_ns = frame.stamp_ns;
  out->sensor_mask = frame.sensor_mask;
  out->flags = frame.flags;
  out->reference = frame.reference;
  out->ego_known = frame.ego_known ? 1 : 0;
  if (frame.ego_known) {
    out->ego_x_m = frame.ego_state.pose.x_m;
    out->ego_y_m = frame.ego_state.pose.y_m;
    out->ego_yaw_rad = frame.ego_state.pose.yaw_rad;
    out->ego_speed_mps = frame.ego_state.pose.speed_mps;
  }
  for (std::size_t s = 0; s < sensors.size(); ++s)
    if (frame.sensors[s].present) out->point_count += frame.sensors[s].kept.points.count;
  out->cluster_count = frame.merged.count;
  out->candidate_count = frame.candidate_count;
  out->detection_count = frame.detections.count;
  out->track_count = frame.tracks.count;
  out->stale_mask = frame.stale_mask;
  out->refiltered = frame.refiltered;
  out->latency_ns = frame.latency_ns;
  out->tracks_stamp_ns = frame.tracks_ns;
  out->ego_off_map_m = frame.ego_off_map_m;
  out->gated_points = frame.gated_points;
  out->gated_size = frame.gated_size;
  out->gated_map = frame.gated_map;
  out->gated_own = frame.gated_own;
  out->gated_range = frame.gated_range;
  out->overflow_candidates = frame.candidate_overflow;
  out->suspect_mask = frame.suspect_mask;
  out->ego_heading_offset_rad = frame.ego_heading.offset_rad;
  out->ego_heading_sigma_rad = frame.ego_heading.sigma_rad;
  out->ego_wall_points = frame.ego_heading.wall_points;
  out->incomplete_mask = frame.incomplete_mask;
  for (std::size_t s = 0; s < sensors.size(); ++s)
    for (int32_t i = 0; i < frame.blocked[s].count; ++i) {
      const ViewGap& gap = frame.blocked[s].gap[i];
      const float wide_rad = width_of(sensors[s], gap);
      out->blocked_mask |= 1u << s;
      if (wide_rad <= out->blocked_rad) continue;
      out->blocked_rad = wide_rad;
      out->blocked_left_rad = float(wrap_angle(double(left_of(sensors[s], gap))));
      out->blocked_sensor = int32_t(s);
    }
}

}  // namespace

extern "C" {

const char* ovt_status_text(ovt_status status) {
  const auto index = size_t(status);
  return index < std::size(kStatusText) ? kStatusText[index] : "unknown status";
}

void ovt_read_build_info_sized(ovt_build_info* out, size_t out_size) {
  if (!out) return;
  std::memset(out, 0, out_size);  // a newer header has later fields
  give({uint32_t(OVT_VERSION), kVersionText, kCommit, kCompiler, list_isas()}, out,
       std::min(out_size, sizeof(ovt_build_info)));
}

ovt_status ovt_sensor_def_init(ovt_sensor_def* out, size_t struct_size) {
  constexpr double kSixtyDegrees = 1.0471975511965977, kNotCompensated = std::numeric_limits<double>::quiet_NaN();
  ovt_sensor_def def{};
  def.rows = 32;
  def.cols = 857;
  def.azimuth_left_rad = kSixtyDegrees;
  def.azimuth_right_rad = -kSixtyDegrees;
  def.range_min_m = 0.5;
  def.range_max_m = 300.0;
  def.layer_last = 65535;
  def.compensated_to_s = kNotCompensated;
  def.point_capacity = 65536;
  return init(out, struct_size, def);
}

ovt_status ovt_map_def_init(ovt_map_def* out, size_t struct_size) { return init(out, struct_size, {}); }

ovt_status ovt_detector_def_init(ovt_detector_def* out, size_t struct_size) {
  return init(out, struct_size, default_detector_def());
}

ovt_status ovt_points_init(ovt_points* out, size_t struct_size) {
  ovt_points points{};
  points.time_unit_ns = 1.0;
  points.first = -1;
  return init(out, struct_size, points);
}
ovt_status ovt_ego_pose_init(ovt_ego_pose* out, size_t struct_size) { return init(out, struct_size, {}); }
ovt_status ovt_external_detections_init(ovt_external_detections* out, size_t struct_size) {
  return init(out, struct_size, {});
}

ovt_status ovt_create_detector(const ovt_detector_def* def, ovt_detector** out) {
  return ovt_create_detector_verbose(def, out, nullptr, 0);
}

ovt_status ovt_create_detector_verbose(const ovt_detector_def* def, ovt_detector** out, char* error,
                                       size_t error_size) {
  const auto say = [&](const char* text) {
    if (error && error_size > 0) std::snprintf(error, error_size, "%s", text);
  };
  say("");
  if (!out) {
    say("out is null");
    return OVT_BAD_ARGUMENT;
  }
  *out = nullptr;
  if (!def) {
    say("def is null");
    return OVT_BAD_ARGUMENT;
  }
  ovt_detector_def whole = default_detector_def();
  if (!take(*def, whole) || def->version == 0 || def->version / 10000 != OVT_VERSION_MAJOR) {
    say("the header and the library do not match: start from ovt_default_detector_def()");
    return OVT_BAD_VERSION;
  }
  ovt_status status = OVT_INTERNAL;
  std::string sentence;
  status = guard(nullptr, [&] {
    ovt_status built = OVT_INTERNAL;
    *out = reinterpret_cast<ovt_detector*>(Detector::create(whole, built, sentence).release());
    return built;
  });
  const char* const text = sentence.empty() ? ovt_status_text(status) : sentence.c_str();
  say(status == OVT_OK ? "" : text);
  if (status != OVT_OK && whole.log) guard(nullptr, [&] { return whole.log(OVT_LOG_ERROR, text, whole.user), OVT_OK; });
  return status;
}

void ovt_destroy_detector(ovt_detector* detector) {
  if (!detector) return;
  const FloatMode usual;
  Detector::destroy(&cpp(detector));
}

ovt_status ovt_push_scan(ovt_detector* detector, const ovt_points* scan) {
  const ovt_status status = check_points(detector, scan, "ovt_push_scan");
  return status == OVT_OK ? guard(detector, [&] { return cpp(detector).push_scan(*scan); }) : status;
}

ovt_status ovt_push_points(ovt_detector* detector, const ovt_points* piece) {
  if (const ovt_status status = check_points(detector, piece, "ovt_push_points"); status != OVT_OK) return status;
  ovt_points with_first{};  // of a caller whose struct has no `first`
  with_first.first = -1;
  if (!take(*piece, with_first)) return OVT_BAD_VERSION;
  if (with_first.first < -1) return cpp(detector).refuse_push("ovt_push_points", "first");
  return guard(detector, [&] { return cpp(detector).push_points(with_first); });
}

ovt_status ovt_end_scan(ovt_detector* detector, int32_t sensor, int64_t stamp_ns, int32_t point_count) {
  if (!detector) return OVT_BAD_ARGUMENT;
  if (sensor < 0 || sensor >= cpp(detector).sensor_count()) return cpp(detector).refuse_push("ovt_end_scan", "sensor");
  if (point_count < -1) return cpp(detector).refuse_push("ovt_end_scan", "point_count");
  const ovt_status status = guard(detector, [&] { return cpp(detector).end_scan(sensor, stamp_ns, point_count); });
  return status == OVT_BAD_ARGUMENT ? cpp(detector).refuse_push("ovt_end_scan", "point_count") : status;
}

ovt_status ovt_push_ego_pose(ovt_detector* detector, const ovt_ego_pose* pose) {
  if (!detector) return OVT_BAD_ARGUMENT;
  if (!pose) return cpp(detector).refuse_push("ovt_push_ego_pose", "a null pointer");
  const FloatMode usual;  // also where a value is compared
  if (!is_known_size<ovt_ego_pose>(pose->struct_size)) return OVT_BAD_VERSION;
  if (const char* bad = find_bad_pose(*pose)) return cpp(detector).refuse_push("ovt_push_ego_pose", bad);
  return guard(detector, [&] { return cpp(detector).push_ego_pose(*pose); });
}

ovt_status ovt_push_detections(ovt_detector* detector, const ovt_external_detections* detections) {
  if (!detector) return OVT_BAD_ARGUMENT;
  if (!detections) return cpp(detector).refuse_push("ovt_push_detections", "a null pointer");
  ovt_external_detections d{};
  if (!take(*detections, d)) return OVT_BAD_VERSION;
  if (const char* bad = find_bad_detections(d)) return cpp(detector).refuse_push("ovt_push_detections", bad);
  return guard(detector, [&] { return cpp(detector).push_detections(d); });
}

ovt_status ovt_advance(ovt_detector* detector, int64_t now_ns) {
  if (!detector) return OVT_BAD_ARGUMENT;
  return guard(detector, [&] { return cpp(detector).advance(now_ns); });
}

ovt_status ovt_flush(ovt_detector* detector) {
  if (!detector) return OVT_BAD_ARGUMENT;
  return guard(detector, [&] { return cpp(detector).flush(); });
}

ovt_status ovt_create_reader(ovt_detector* detector, ovt_reader** out) {
  if (!detector || !out) return OVT_BAD_ARGUMENT;
  *out = nullptr;
  return guard(detector, [&] {
    Reader* reader = nullptr;
    const ovt_status status = cpp(detector).create_reader(&reader);
    *out = reinterpret_cast<ovt_reader*>(reader);
    return status;
  });
}

void ovt_destroy_reader(ovt_reader* reader) {
  if (reader && !cpp(reader).is_callback_reader) cpp(reader).detector->destroy_reader(&cpp(reader));
}

ovt_status ovt_next_frame_sized(ovt_reader* reader, ovt_frame_info* out, size_t out_size) {
  if (!reader) return OVT_BAD_ARGUMENT;
  if (out && !is_known_size<ovt_frame_info>(out_size)) return OVT_BAD_VERSION;
  const ovt_status status = cpp(reader).detector->next_frame(cpp(reader));
  if (status == OVT_OK && out) return ovt_read_info_sized(reader, out, out_size);
  return status;
}

ovt_status ovt_read_info_sized(ovt_reader* reader, ovt_frame_info* out, size_t out_size) {
  if (!reader || !out) return OVT_BAD_ARGUMENT;
  if (!standing(reader)) return OVT_NO_FRAME;
  ovt_frame_info info;
  fill_info(*cpp(reader).frame, cpp(reader).detector->sensors(), &info);
  return give(info, out, out_size);
}

ovt_status ovt_read_detections_sized(ovt_reader* reader, ovt_detections* out, size_t out_size) {
  if (!reader || !out) return OVT_BAD_ARGUMENT;
  if (!standing(reader)) return OVT_NO_FRAME;
  const Frame& frame = *cpp(reader).frame;
  ovt_detections rows{};
  rows.count = frame.detections.count;
#define OVT_DETECTION(type, name, ...) rows.name = frame.detections.name;
#define OVT_DETECTION_TRACK(type, name, ...) rows.name = frame.measurements.name;
#define OVT_DETECTION_VIEW(type, name, ...) rows.name = frame.views.name;
#include "core/columns.def"
  return give(rows, out, out_size);
}

ovt_status ovt_set_path_horizon(ovt_reader* reader, double horizon_s) {
  if (!reader) return OVT_BAD_ARGUMENT;
  const FloatMode usual;
  return cpp(reader).detector->set_path_horizon(cpp(reader), horizon_s);
}

ovt_status ovt_read_tracks_sized(ovt_reader* reader, int64_t publish_ns, ovt_tracks* out, size_t out_size) {
  if (!reader || !out) return OVT_BAD_ARGUMENT;
  if (!standing(reader)) return OVT_NO_FRAME;
  if (!is_known_size<ovt_tracks>(out_size)) return OVT_BAD_VERSION;
  Reader& r = cpp(reader);
  const FloatMode usual;
  if (publish_ns == OVT_AT_FRAME_STAMP) publish_ns = r.frame->tracks_ns;
  publish_ns = r.detector->publish_tracks(r, publish_ns);
  ovt_tracks rows{};
  rows.count = r.tracks.count;
  rows.publish_ns = publish_ns;
  rows.path_points = r.paths.points_per_track;
  rows.path_step_s = r.detector->path_step_s();
#define OVT_TRACK(type, name, ...) rows.name = r.tracks.name;
#define OVT_TRACK_COVARIANCE(type, name, ...) \
  std::copy(std::begin(r.tracks.name), std::end(r.tracks.name), std::begin(rows.name));
#define OVT_TRACK_OPTIONAL(type, name, ...) rows.name = r.optional.name;
#define OVT_PATH(type, name, ...) rows.path_##name = r.paths.name;
#define OVT_PATH_OPTIONAL(type, name, ...) rows.path_##name = r.optional.existence ? r.paths.name : nullptr;
#include "core/columns.def"
  return give(rows, out, out_size);
}

ovt_status ovt_read_clusters_sized(ovt_reader* reader, ovt_clusters* out, size_t out_size) {
  if (!reader || !out) return OVT_BAD_ARGUMENT;
  if (!standing(reader)) return OVT_NO_FRAME;
  const FrameClusterTable& merged = cpp(reader).frame->merged;
  ovt_clusters rows{};
  rows.count = merged.count;
#define OVT_CLUSTER(type, name, ...) rows.name = merged.name;
#include "core/columns.def"
  return give(rows, out, out_size);
}

ovt_status ovt_read_labels_sized(ovt_reader* reader, int32_t sensor, ovt_labels* out, size_t out_size) {
  if (!reader || !out) return OVT_BAD_ARGUMENT;
  if (!standing(reader)) return OVT_NO_FRAME;
  const SensorPart* part = part_of(reader, sensor);
  if (!part) return OVT_BAD_ARGUMENT;
  if (!part->present) return OVT_NO_FRAME;
  ovt_labels rows{};
  rows.count = part->kept.points.count;
  rows.stamp_ns = part->stamp_ns;
  rows.label_count = part->label_count;
#define OVT_LABEL(type, name, table, ...) rows.name = part->table.name;
#define OVT_LABEL_CLUSTER(type, name, ...) rows.name = part->name;
#include "core/columns.def"
  return give(rows, out, out_size);
}

const char* ovt_reason_name(int32_t reason) {
  return reason >= 0 && reason < kReasonCount ? reason_name(Reason(reason)) : nullptr;
}

ovt_status ovt_read_image_sized(ovt_reader* reader, int32_t sensor, ovt_image_id image, ovt_image* out,
                                size_t out_size) {
  if (!reader || !out) return OVT_BAD_ARGUMENT;
  if (!standing(reader)) return OVT_NO_FRAME;
  const SensorPart* part = part_of(reader, sensor);
  if (!part) return OVT_BAD_ARGUMENT;
  if (!part->present) return OVT_NO_FRAME;
  if (image < 0 || image >= OVT_IMAGE_COUNT) return OVT_BAD_ARGUMENT;
  if (!has(find_columns(cpp(reader).detector->method()), kImageColumn[image])) return OVT_NOT_COMPUTED;
  const RangeImages& m = part->kept.images;
  const auto show = [&](const void* data, int32_t type, int32_t rows, int32_t cols, size_t stride_bytes) {
    return data ? give<ovt_image>({data, type, rows, cols, stride_bytes}, out, out_size) : OVT_NOT_KEPT;
  };
  const auto floats = [&](const Plane<float>& p) {
    return show(p.data, OVT_IMAGE_F32, p.rows, p.cols, size_t(p.stride) * sizeof(float));
  };
  const auto pairs = [&](const Plane<float>& p) {  // of rows
    return show(p.data, OVT_IMAGE_F32, p.rows - 1, p.cols, size_t(p.stride) * sizeof(float));
  };
  const auto integers = [&](const Plane<int32_t>& p) {
    return show(p.data, OVT_IMAGE_I32, p.rows, p.cols, size_t(p.stride) * sizeof(int32_t));
  };
  const auto bits = [&](const BitPlane& p) {
    return show(p.words, OVT_IMAGE_BITS, p.rows, p.cols, size_t(p.words_per_row) * sizeof(uint64_t));
  };
  // clang-format off
  switch (image) {
    case OVT_IMAGE_RANGE: return floats(m.range_m);
    case OVT_IMAGE_ELEVATION: return floats(m.elevation_rad);
    case OVT_IMAGE_PIXEL_POINT: return integers(m.pixel_point);
    case OVT_IMAGE_RANGE_FILLED: return floats(m.range_filled_m);
    case OVT_IMAGE_ELEVATION_FILLED: return floats(m.elevation_filled_rad);
    case OVT_IMAGE_ANGLE: return pairs(m.angle_rad);
    case OVT_IMAGE_ANGLE_SMOOTH: return pairs(m.angle_smooth_rad);
    case OVT_IMAGE_NONGROUND: return bits(m.nonground);
    case OVT_IMAGE_RANGE_REPAIRED: return floats(m.range_repaired_m);
    case OVT_IMAGE_ELEVATION_REPAIRED: return floats(m.elevation_repaired_rad);
    case OVT_IMAGE_NONGROUND_REPAIRED: return bits(m.nonground_repaired);
    case OVT_IMAGE_LABELS: return integers(m.labels);
    case OVT_IMAGE_HEIGHT: return floats(m.height_m);
    case OVT_IMAGE_COUNT: break;
  }
  // clang-format on
  return OVT_BAD_ARGUMENT;
}

const char* ovt_image_name(int32_t image) {
  return image >= 0 && image < OVT_IMAGE_COUNT ? kImageName[image] : nullptr;
}

const char* ovt_stage_name(int32_t stage) {
  return stage >= 0 && stage < OVT_STAGE_COUNT ? kStageName[stage] : nullptr;
}

ovt_status ovt_read_time(ovt_reader* reader, int32_t sensor, ovt_stage stage, int64_t* ns) {
  ovt_span span;
  if (!ns) return OVT_BAD_ARGUMENT;
  const ovt_status status = ovt_read_span_sized(reader, sensor, stage, &span, sizeof span);
  if (status == OVT_OK) *ns = span.duration_ns;
  return status;
}

ovt_status ovt_read_span_sized(ovt_reader* reader, int32_t sensor, ovt_stage stage, ovt_span* out, size_t out_size) {
  if (!reader || !out || stage < 0 || stage >= OVT_STAGE_COUNT) return OVT_BAD_ARGUMENT;
  if (!standing(reader)) return OVT_NO_FRAME;
  const Frame& frame = *cpp(reader).frame;
  const SensorPart* part = sensor == -1 ? nullptr : part_of(reader, sensor);
  if (sensor != -1 && !part) return OVT_BAD_ARGUMENT;
  if (!has_stage(cpp(reader).detector->method(), stage)) return OVT_NOT_COMPUTED;
  const StageSpan& span = (part ? part->spans : frame.spans)[stage];
  return give<ovt_span>({span.start_ns, span.duration_ns, span.worker}, out, out_size);
}

ovt_status ovt_read_runtime_info_sized(ovt_detector* detector, ovt_runtime_info* out, size_t out_size) {
  if (!detector || !out) return OVT_BAD_ARGUMENT;
  return give(cpp(detector).runtime_info(), out, out_size);
}

ovt_status ovt_stats_init(ovt_stats* out, size_t struct_size) { return init(out, struct_size, {}); }

ovt_status ovt_read_stats(ovt_detector* detector, ovt_stats* out) {
  if (!detector || !out) return OVT_BAD_ARGUMENT;
  const size_t size = out->struct_size;
  if (!is_known_size<ovt_stats>(size)) return OVT_BAD_VERSION;
  ovt_stats stats{};
  cpp(detector).read_stats(stats);
  stats.struct_size = size;
  return give(stats, out, size);
}

}  // extern "C"
