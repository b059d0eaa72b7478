// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Visits all data that a reader returns, by core/columns.def and pipeline/stats.def: each column of a table, each
// single value. A hash, a file or a check that uses these functions also covers columns that are added later.
#pragma once

#include <concepts>
#include <cstdint>
#include <type_traits>

#include "core/hash.h"
#include "pipeline/overtake.h"

namespace overtake {

struct ColumnInfo {
  const char* name;       // field of the C struct
  const char* csv;        // name in the CSV file, "" if the file does not have it
  const char* words;      // names of its values from 0 on, "" for numbers
  bool optional = false;  // null with some methods
};

struct ValueInfo {
  const char* name;
  bool measured;          // a measured time: differs in each run
  bool optional = false;  // always 0 with some methods
};

template <class T, class Struct>
concept OneOf = std::same_as<std::remove_const_t<T>, Struct>;  // const or not

// Calls f(ColumnInfo, column, rows) for each column, in the order of the struct; `column` is the struct's pointer.
template <OneOf<ovt_detections> T, class F>
void for_each_column(T& d, F&& f) {
  const int64_t rows = d.count;
#define OVT_DETECTION(type, name, csv, json, words, meaning) f(ColumnInfo{#name, csv, words}, d.name, rows);
#define OVT_DETECTION_TRACK OVT_DETECTION
#define OVT_DETECTION_VIEW(type, name, csv, json, words, meaning) f(ColumnInfo{#name, csv, words, true}, d.name, rows);
#include "core/columns.def"
}

template <OneOf<ovt_tracks> T, class F>
void for_each_column(T& t, F&& f) {
  const int64_t rows = t.count;
#define OVT_TRACK(type, name, csv, json, words, meaning) f(ColumnInfo{#name, csv, words}, t.name, rows);
#define OVT_TRACK_COVARIANCE(type, name, json, meaning) \
  for (auto& column : t.name) f(ColumnInfo{#name, "", ""}, column, rows);
#define OVT_TRACK_OPTIONAL(type, name, csv, json, words, meaning) f(ColumnInfo{#name, csv, words, true}, t.name, rows);
#define OVT_PATH(type, name, json, meaning) f(ColumnInfo{"path_" #name, "", ""}, t.path_##name, rows* t.path_points);
#define OVT_PATH_OPTIONAL(type, name, json, meaning) \
  f(ColumnInfo{"path_" #name, "", "", true}, t.path_##name, rows* t.path_points);
#include "core/columns.def"
}

template <OneOf<ovt_clusters> T, class F>
void for_each_column(T& c, F&& f) {
  const int64_t rows = c.count;
#define OVT_CLUSTER(type, name, meaning) f(ColumnInfo{#name, "", ""}, c.name, rows);
#include "core/columns.def"
}

template <OneOf<ovt_labels> T, class F>
void for_each_column(T& l, F&& f) {
  const int64_t rows = l.count;
#define OVT_LABEL(type, name, table, meaning) f(ColumnInfo{#name, "", ""}, l.name, rows);
#define OVT_LABEL_CLUSTER(type, name, meaning) f(ColumnInfo{#name, "", ""}, l.name, int64_t(l.label_count) + 1);
#include "core/columns.def"
}

// Calls f(ValueInfo, value) for each field that is not a column, in the order of the struct.
template <OneOf<ovt_detections> T, class F>
void for_each_value(T& d, F&& f) {
  f(ValueInfo{"count", false}, d.count);
}

template <OneOf<ovt_tracks> T, class F>
void for_each_value(T& t, F&& f) {
  f(ValueInfo{"count", false}, t.count);
#define OVT_TRACKS_VALUE(type, name, json, meaning) f(ValueInfo{#name, false}, t.name);
#include "core/columns.def"
}

template <OneOf<ovt_clusters> T, class F>
void for_each_value(T& c, F&& f) {
  f(ValueInfo{"count", false}, c.count);
}

template <OneOf<ovt_labels> T, class F>
void for_each_value(T& l, F&& f) {
  f(ValueInfo{"count", false}, l.count);
#define OVT_LABELS_VALUE(type, name, meaning) f(ValueInfo{#name, false}, l.name);
#include "core/columns.def"
}

template <OneOf<ovt_frame_info> T, class F>
void for_each_value(T& info, F&& f) {
#define OVT_FRAME_VALUE(type, name, meaning) f(ValueInfo{#name, false}, info.name);
#define OVT_FRAME_TIME(type, name, meaning) f(ValueInfo{#name, true}, info.name);
#define OVT_FRAME_OPTIONAL(type, name, meaning) f(ValueInfo{#name, false, true}, info.name);
#include "pipeline/stats.def"
}

// Calls f(name, counter) for each counter, in the order of the struct.
template <OneOf<ovt_stats> T, class F>
void for_each_counter(T& stats, F&& f) {
#define OVT_COUNTER(name, meaning) f(#name, stats.name);
#define OVT_COUNTERS(name, size, meaning) \
  for (auto& counter : stats.name) f(#name, counter);
#define OVT_GAUGE OVT_COUNTER
#include "pipeline/stats.def"
}

// Adds a table, or a frame's numbers, without measured times. A column that the method does not compute is null, and a
// number that it does not compute is 0: neither changes the hash.
template <class Table>
void add_to_hash(Hash& hash, const Table& table) {
  for_each_value(table, [&](const ValueInfo& info, const auto& value) {
    if (info.measured || (info.optional && value == 0)) return;
    if (info.optional) hash.add_text(info.name);
    hash.add_value(value);
  });
  if constexpr (!std::same_as<Table, ovt_frame_info>)
    for_each_column(table, [&](const ColumnInfo&, const auto* column, int64_t rows) {
      if (column) hash.add_bytes(column, std::size_t(rows) * sizeof *column);
    });
}

}  // namespace overtake
