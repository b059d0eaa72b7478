// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Structs of the C API across versions: the library never reads or writes a field that the caller's header lacks.
#pragma once

#include <cstddef>
#include <cstring>

#include "pipeline/overtake.h"

namespace overtake {

// The size of each struct in the first version of this header, the smallest that a caller can pass.
template <class T>
constexpr size_t kFirstSize = sizeof(T);
template <>
inline constexpr size_t kFirstSize<ovt_params> = offsetof(ovt_params, tracker_horizon_step_s) + sizeof(double);
template <>
inline constexpr size_t kFirstSize<ovt_detector_def> = offsetof(ovt_detector_def, cpus);
template <>
inline constexpr size_t kFirstSize<ovt_frame_info> = offsetof(ovt_frame_info, refiltered);  // stale_mask fills padding
template <>
inline constexpr size_t kFirstSize<ovt_sensor_def> = offsetof(ovt_sensor_def, compensated_to_s);
template <>
inline constexpr size_t kFirstSize<ovt_points> = offsetof(ovt_points, first);
template <>
inline constexpr size_t kFirstSize<ovt_tracks> = offsetof(ovt_tracks, flags);
template <>
inline constexpr size_t kFirstSize<ovt_external_detections> = offsetof(ovt_external_detections, length_m);
template <>
inline constexpr size_t kFirstSize<ovt_stats> = offsetof(ovt_stats, in_flight);

template <class T>
constexpr bool is_known_size(size_t struct_size) {
  return struct_size >= kFirstSize<T> && struct_size <= sizeof(T) && struct_size % alignof(T) == 0;
}

// Copies the fields of the caller's header over the defaults. Reads nothing beyond the declared size.
template <class T>
bool take(const T& in, T& with_defaults) {
  const size_t size = in.struct_size;
  if (!is_known_size<T>(size)) return false;
  std::memcpy(static_cast<void*>(&with_defaults), &in, size);
  with_defaults.struct_size = sizeof(T);
  return true;
}

// Copies out the fields of the caller's header. Writes nothing beyond its size.
template <class T>
ovt_status give(const T& value, T* out, size_t out_size) {
  if (!is_known_size<T>(out_size)) return OVT_BAD_VERSION;
  std::memcpy(static_cast<void*>(out), &value, out_size);
  return OVT_OK;
}

// Gives a struct of a known size the defaults, as far as it goes, and its struct_size.
template <class T>
ovt_status init(T* out, size_t struct_size, const T& defaults) {
  if (!out) return OVT_BAD_ARGUMENT;
  if (!is_known_size<T>(struct_size)) return OVT_BAD_VERSION;
  std::memcpy(static_cast<void*>(out), &defaults, struct_size);
  out->struct_size = struct_size;
  return OVT_OK;
}

}  // namespace overtake
