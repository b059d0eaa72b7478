// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// core/columns.def and pipeline/stats.def list what overtake.h declares, and nothing of it is missing in a hash, in the
// CSV files or in the JSON.
#include "pipeline/columns.h"

#include <doctest/doctest.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/hash.h"
#include "tests/support/detector_bench.h"
#include "tests/support/frame_hash.h"
#include "tools/client/result_files.h"

namespace overtake {
namespace {

// ---- overtake.h is written out by hand, for who reads it: held here, when this file is compiled, to the lists
// ---------

namespace listed {
struct ovt_detections {
  int32_t count;
#define OVT_DETECTION(type, name, ...) const type* name;
#define OVT_DETECTION_TRACK OVT_DETECTION
#include "core/columns.def"
};
struct ovt_tracks {
  int32_t count;
#define OVT_TRACK(type, name, ...) const type* name;
#define OVT_TRACK_COVARIANCE(type, name, ...) const type* name[15];
#define OVT_TRACKS_VALUE(type, name, ...) type name;
#define OVT_PATH(type, name, ...) const type* path_##name;
#include "core/columns.def"
};
struct ovt_clusters {
  int32_t count;
#define OVT_CLUSTER(type, name, ...) const type* name;
#include "core/columns.def"
};
struct ovt_labels {
  int32_t count;
#define OVT_LABEL(type, name, ...) const type* name;
#define OVT_LABEL_CLUSTER(type, name, ...) const type* name;
#define OVT_LABELS_VALUE(type, name, ...) type name;
#include "core/columns.def"
};
struct ovt_frame_info {
#define OVT_FRAME_VALUE(type, name, ...) type name;
#define OVT_FRAME_TIME OVT_FRAME_VALUE
#include "pipeline/stats.def"
};
struct ovt_stats {
  size_t struct_size;
#define OVT_COUNTER(name, ...) int64_t name;
#define OVT_COUNTERS(name, size, ...) int64_t name[size];
#define OVT_GAUGE OVT_COUNTER
#include "pipeline/stats.def"
};
}  // namespace listed

// Same type, same place.
#define OVT_SAME(Struct, name)                                                              \
  static_assert(std::is_same_v<decltype(listed::Struct::name), decltype(::Struct::name)> && \
                    offsetof(listed::Struct, name) == offsetof(::Struct, name),             \
                #Struct "::" #name " of overtake.h is not as its line of columns.def or stats.def");
#define OVT_DETECTION(type, name, ...) OVT_SAME(ovt_detections, name)
#define OVT_DETECTION_TRACK OVT_DETECTION
#define OVT_TRACK(type, name, ...) OVT_SAME(ovt_tracks, name)
#define OVT_TRACK_COVARIANCE OVT_TRACK
#define OVT_TRACKS_VALUE OVT_TRACK
#define OVT_PATH(type, name, ...) OVT_SAME(ovt_tracks, path_##name)
#define OVT_CLUSTER(type, name, ...) OVT_SAME(ovt_clusters, name)
#define OVT_LABEL(type, name, ...) OVT_SAME(ovt_labels, name)
#define OVT_LABEL_CLUSTER OVT_LABEL
#define OVT_LABELS_VALUE OVT_LABEL
#include "core/columns.def"
#define OVT_FRAME_VALUE(type, name, ...) OVT_SAME(ovt_frame_info, name)
#define OVT_FRAME_TIME OVT_FRAME_VALUE
#define OVT_COUNTER(name, ...) OVT_SAME(ovt_stats, name)
#define OVT_COUNTERS OVT_COUNTER
#define OVT_GAUGE OVT_COUNTER
#include "pipeline/stats.def"

// Fields of an aggregate, those of an array apart: one that fills a gap between two others moves nothing.
struct Anything {
  template <class T>
  operator T() const;
};
template <class T, std::size_t... I>
concept TakesThese = requires {
  T{(void(I), Anything{})...};
};
template <class T, std::size_t... I>
constexpr bool takes(std::index_sequence<I...>) {
  return TakesThese<T, I...>;
}
template <class T, std::size_t N = 1>
constexpr std::size_t count_fields() {
  if constexpr (takes<T>(std::make_index_sequence<N + 1>{}))
    return count_fields<T, N + 1>();
  else
    return N;
}
template <class Listed, class Declared>
constexpr bool kSame = sizeof(Listed) == sizeof(Declared) && count_fields<Listed>() == count_fields<Declared>();
static_assert(count_fields<listed::ovt_clusters>() == 13);
static_assert(kSame<listed::ovt_detections, ::ovt_detections>, "a field of ovt_detections has no line in columns.def");
static_assert(kSame<listed::ovt_tracks, ::ovt_tracks>, "a field of ovt_tracks has no line in columns.def");
static_assert(kSame<listed::ovt_clusters, ::ovt_clusters>, "a field of ovt_clusters has no line in columns.def");
static_assert(kSame<listed::ovt_labels, ::ovt_labels>, "a field of ovt_labels has no line in columns.def");
static_assert(kSame<listed::ovt_frame_info, ::ovt_frame_info>, "a field of ovt_frame_info has no line in stats.def");
static_assert(kSame<listed::ovt_stats, ::ovt_stats>, "a field of ovt_stats has no line in stats.def");

}  // namespace
}  // namespace overtake
