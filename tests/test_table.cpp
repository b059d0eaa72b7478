// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "core/table.h"

#include <doctest/doctest.h>

#include <set>
#include <string>

#include "core/cluster_table.h"
#include "core/point_table.h"
#include "core/track_table.h"

namespace overtake {
namespace {

bool is_aligned(const void* p) { return reinterpret_cast<std::uintptr_t>(p) % kCacheLine == 0; }

// Carves `table` for 21 rows; every column must be aligned, with a unique name and separate memory.
template <class Table>
void check_columns() {
  Arena arena;
  Table table;
  REQUIRE(arena.build(default_allocator(), [&](Carver& carver) { carve_table(carver, table, 21); }));
  CHECK(table.count == 0);
  CHECK(table.capacity == 32);
  std::set<std::string> names;
  const char* end = nullptr;
  std::size_t bytes = 0;
  for_each_column(table, [&](const char* name, auto* column) {
    CAPTURE(name);
    CHECK(names.insert(name).second);
    REQUIRE(column != nullptr);
    CHECK(is_aligned(column));
    CHECK(reinterpret_cast<const char*>(column) >= end);  // nullptr first
    end = reinterpret_cast<const char*>(column + table.capacity);
    bytes += std::size_t(round_up(table.capacity * int32_t(sizeof *column), int32_t(kCacheLine)));
  });
  CHECK(arena.bytes() == bytes);  // only the listed columns
}

TEST_CASE("tables: every table carves into aligned, separate columns") {
  check_columns<ScanTable>();
  check_columns<PointTable>();
  check_columns<ClusterTable>();
  check_columns<ClusterPointTable>();
  check_columns<FrameClusterTable>();
  check_columns<MemberTable>();
  check_columns<DetectionTable>();
  check_columns<TrackTable>();
  check_columns<OptionalTrackTable>();
  check_columns<PathTable>();
}

// A table must list all its pointers: the struct contains only count, capacity (and one more int for paths) and
// columns.
template <class Table>
std::size_t count_columns() {
  Table table;
  std::size_t columns = 0;
  for_each_column(table, [&](const char*, auto*&) { ++columns; });
  return columns;
}

TEST_CASE("tables: every table lists all of its columns") {
  const auto pointers = [](std::size_t table_bytes, std::size_t ints) {
    return (table_bytes - (ints + ints % 2) * sizeof(int32_t)) / sizeof(void*);
  };
  CHECK(count_columns<ScanTable>() == pointers(sizeof(ScanTable), 2));
  CHECK(count_columns<PointTable>() == pointers(sizeof(PointTable), 2));
  CHECK(count_columns<ClusterTable>() == pointers(sizeof(ClusterTable), 2));
  CHECK(count_columns<ClusterPointTable>() == pointers(sizeof(ClusterPointTable), 2));
  CHECK(count_columns<FrameClusterTable>() == pointers(sizeof(FrameClusterTable), 2));
  CHECK(count_columns<MemberTable>() == pointers(sizeof(MemberTable), 2));
  CHECK(count_columns<DetectionTable>() == pointers(sizeof(DetectionTable), 2));
  CHECK(count_columns<TrackTable>() == pointers(sizeof(TrackTable), 2));
  CHECK(count_columns<OptionalTrackTable>() == pointers(sizeof(OptionalTrackTable), 2));
  CHECK(count_columns<PathTable>() == pointers(sizeof(PathTable), 3));
}

TEST_CASE("tables: a hash depends on the rows, not on the padding") {
  Arena arena;
  ClusterPointTable table;
  REQUIRE(arena.build(default_allocator(), [&](Carver& carver) { carve_table(carver, table, 10); }));
  table.count = 3;
  const uint64_t hash = hash_table(table, 1);
  CHECK(hash_table(table, 1) == hash);
  CHECK(hash_table(table, 2) != hash);
  CHECK(hash_table(ScanTable{}, 1) != hash_table(PointTable{}, 1));  // the columns' names count, even without rows
  for (int32_t i = table.count; i < table.capacity; ++i) table.y_m[i] = 1.0f, table.point[i] = -5;
  CHECK(hash_table(table, 1) == hash);
  table.y_m[2] = 1.0f;
  CHECK(hash_table(table, 1) != hash);
  table.y_m[2] = 0.0f;
  CHECK(hash_table(table, 1) == hash);
  table.point[0] = 1;
  CHECK(hash_table(table, 1) != hash);
  table.point[0] = 0;
  table.x_m[1] = 2.0f;
  const uint64_t in_x = hash_table(table, 1);
  table.x_m[1] = 0.0f;
  table.y_m[1] = 2.0f;
  CHECK(hash_table(table, 1) != in_x);  // the same value in another column
  table.y_m[1] = 0.0f;
  table.count = 4;
  table.y_m[3] = 0.0f;
  table.point[3] = 0;
  CHECK(hash_table(table, 1) != hash);
}

TEST_CASE("hash: is FNV-1a") {
  Hash hash;
  CHECK(hash.value() == 0xcbf29ce484222325u);
  hash.add_text("foobar");
  CHECK(hash.value() == 0x85944171f73967e8u);
}

TEST_CASE("track id: holds slot and generation, and means none only if both are zero") {
  const TrackId id = make_track_id(7, 3);
  CHECK(slot_of(id) == 7);
  CHECK(generation_of(id) == 3);
  CHECK(id == 0x0000000300000007u);
  CHECK(make_track_id(0, 1) != kNobody);
  CHECK(make_track_id(0xffffffffu, 0xffffffffu) == 0xffffffffffffffffu);
  CHECK(make_track_id(0, 0) == kNobody);
}

TEST_CASE("reasons: every reason has a unique name") {
  std::set<std::string> names;
  for (int32_t i = 0; i < int32_t(Reason::kCount); ++i) {
    const std::string name = reason_name(Reason(i));
    CAPTURE(name);
    CHECK(names.insert(name).second);
    CHECK(name != "unknown");
  }
  CHECK(names.count("labelled") == 1);
  CHECK(std::string(reason_name(Reason::kLabelled)) == "labelled");
  CHECK(std::string(reason_name(Reason::kNotFinite)) == "not_finite");
  CHECK(std::string(reason_name(Reason::kSecondReturn)) == "second_return");
  CHECK(std::string(reason_name(Reason::kSmoke)) == "smoke");
  CHECK(std::string(reason_name(Reason::kOwnBody)) == "own_body");
  CHECK(std::string(reason_name(Reason::kCount)) == "unknown");
}

}  // namespace
}  // namespace overtake
