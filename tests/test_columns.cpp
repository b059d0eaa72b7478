// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// core/columns.def and pipeline/stats.def list every field that overtake.h declares, and no field is missing in a hash,
// in the CSV files or in the JSON.
#include "pipeline/columns.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/hash.h"
#include "tests/support/detector_bench.h"
#include "tests/support/frame_hash.h"
#include "tests/support/temp_folder.h"
#include "tools/client/result_files.h"
#include "tools/io/csv.h"
#include "tools/io/text.h"
#include "tools/view/mcap_numbers.h"

namespace overtake {
namespace {

// ---- overtake.h is written by hand, for its readers: the compiler compares it with the lists here -------------------

namespace listed {
struct ovt_detections {
  int32_t count;
#define OVT_DETECTION(type, name, ...) const type* name;
#define OVT_DETECTION_TRACK OVT_DETECTION
#define OVT_DETECTION_VIEW OVT_DETECTION
#include "core/columns.def"
};
struct ovt_tracks {
  int32_t count;
#define OVT_TRACK(type, name, ...) const type* name;
#define OVT_TRACK_COVARIANCE(type, name, ...) const type* name[15];
#define OVT_TRACK_OPTIONAL OVT_TRACK
#define OVT_TRACKS_VALUE(type, name, ...) type name;
#define OVT_PATH(type, name, ...) const type* path_##name;
#define OVT_PATH_OPTIONAL OVT_PATH
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
#define OVT_FRAME_OPTIONAL OVT_FRAME_VALUE
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

// Same type, same offset.
#define OVT_SAME(Struct, name)                                                              \
  static_assert(std::is_same_v<decltype(listed::Struct::name), decltype(::Struct::name)> && \
                    offsetof(listed::Struct, name) == offsetof(::Struct, name),             \
                #Struct "::" #name " of overtake.h is not as its line of columns.def or stats.def");
#define OVT_DETECTION(type, name, ...) OVT_SAME(ovt_detections, name)
#define OVT_DETECTION_TRACK OVT_DETECTION
#define OVT_DETECTION_VIEW OVT_DETECTION
#define OVT_TRACK(type, name, ...) OVT_SAME(ovt_tracks, name)
#define OVT_TRACK_COVARIANCE OVT_TRACK
#define OVT_TRACK_OPTIONAL OVT_TRACK
#define OVT_TRACKS_VALUE OVT_TRACK
#define OVT_PATH(type, name, ...) OVT_SAME(ovt_tracks, path_##name)
#define OVT_PATH_OPTIONAL OVT_PATH
#define OVT_CLUSTER(type, name, ...) OVT_SAME(ovt_clusters, name)
#define OVT_LABEL(type, name, ...) OVT_SAME(ovt_labels, name)
#define OVT_LABEL_CLUSTER OVT_LABEL
#define OVT_LABELS_VALUE OVT_LABEL
#include "core/columns.def"
#define OVT_FRAME_VALUE(type, name, ...) OVT_SAME(ovt_frame_info, name)
#define OVT_FRAME_OPTIONAL OVT_FRAME_VALUE
#define OVT_FRAME_TIME OVT_FRAME_VALUE
#define OVT_COUNTER(name, ...) OVT_SAME(ovt_stats, name)
#define OVT_COUNTERS OVT_COUNTER
#define OVT_GAUGE OVT_COUNTER
#include "pipeline/stats.def"

// Counts the fields of an aggregate, each array element separately: a new field in padding changes no offset.
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

// ---- a table in the test's memory, and a loop that flips one bit of each column -------------------------------------

template <class Table>
struct Filled {
  struct Memory {
    ColumnInfo info;
    std::size_t size_of_row;
    std::vector<unsigned char> bytes;
  };
  Table table{};
  std::vector<Memory> columns;

  Filled() {
    for_each_value(table, [](const ValueInfo&, auto& value) { value = 3; });
    columns.reserve(64);
    for_each_column(table, [&]<class T>(const ColumnInfo& info, const T*& column, int64_t rows) {
      REQUIRE(rows >= 3);
      std::vector<T> values(static_cast<std::size_t>(rows));
      for (std::size_t i = 0; i < values.size(); ++i) values[i] = T(*info.words ? i % 2 : 20 + columns.size() + i);
      Memory& memory = columns.emplace_back(Memory{info, sizeof(T), {}});
      memory.bytes.resize(values.size() * sizeof(T));
      std::memcpy(memory.bytes.data(), values.data(), memory.bytes.size());
      column = reinterpret_cast<const T*>(memory.bytes.data());
    });
  }

  // Calls changed(info) while the lowest bit of one row of one column is flipped: first the first row's, then the last
  // row's.
  template <class Changed>
  void flip_each(Changed&& changed) {
    for (Memory& memory : columns)
      for (const std::size_t at : {std::size_t(0), memory.bytes.size() - memory.size_of_row}) {
        const std::string name = memory.info.name;
        CAPTURE(name);
        CAPTURE(at);
        memory.bytes[at] ^= 1;
        changed(memory.info);
        memory.bytes[at] ^= 1;
      }
  }

  // As a method without the optional columns leaves the table.
  void drop_optional() {
    for_each_column(table, [](const ColumnInfo& info, auto*& values, int64_t) {
      if (info.optional) values = nullptr;
    });
  }
};

// Every column and value of the table is in the hash, except the named column.
template <class Table, class HashOf>
void check_all_are_in(Filled<Table>& filled, HashOf&& hash_of, const std::string& but_for = "") {
  const uint64_t before = hash_of();
  filled.flip_each([&](const ColumnInfo& info) { CHECK((hash_of() == before) == (but_for == info.name)); });
  for_each_value(filled.table, [&](const ValueInfo& info, auto& value) {
    const std::string name = info.name;
    CAPTURE(name);
    value -= 1;
    CHECK(hash_of() != before);
    value += 1;
  });
  CHECK(hash_of() == before);
}

TEST_CASE("columns: the hash of a frame has every column and number, but no duration") {
  const auto check = [](auto filled) {
    check_all_are_in(filled, [&] {
      test::FrameHash hash;
      hash.add(filled.table);
      return hash.value();
    });
  };
  check(Filled<ovt_detections>());
  check(Filled<ovt_tracks>());
  check(Filled<ovt_clusters>());
  check(Filled<ovt_labels>());

  ovt_frame_info info{};
  const auto hash_of_info = [&] {
    test::FrameHash hash;
    hash.add(info);
    return hash.value();
  };
  const uint64_t before = hash_of_info();
  for_each_value(info, [&](const ValueInfo& value_info, auto& value) {
    const std::string name = value_info.name;
    CAPTURE(name);
    value = 1;
    CHECK((hash_of_info() == before) == (name == "latency_ns"));
    value = 0;
  });
}

TEST_CASE("columns: the two hashes of a record have every column of detections and tracks") {
  Filled<ovt_detections> detections;
  Filled<ovt_tracks> tracks;
  check_all_are_in(
      detections, [&] { return overtake::test::hash_detections(detections.table); }, "track");
  check_all_are_in(tracks, [&] { return overtake::test::hash_tracks(tracks.table, detections.table); });
  const uint64_t before = overtake::test::hash_tracks(tracks.table, detections.table);
  detections.flip_each([&](const ColumnInfo& info) {
    CHECK((overtake::test::hash_tracks(tracks.table, detections.table) != before) ==
          (info.name == std::string("track")));
  });
}

TEST_CASE("columns: the hash of a run has every column of detections and tracks; stamps count from the first frame") {
  Filled<ovt_detections> detections;
  Filled<ovt_tracks> tracks;
  ovt_frame_info info{};
  const auto hash_of_run = [&] {
    cli::ResultHash hash;
    hash.add(info, detections.table, tracks.table);
    return hash.value();
  };
  check_all_are_in(detections, hash_of_run);
  check_all_are_in(tracks, hash_of_run);

  const uint64_t before = hash_of_run();
  info.first_stamp_ns += 5;
  CHECK(hash_of_run() != before);
  const auto add_five = [](auto& filled) {
    for_each_value(filled.table, [](const ValueInfo&, auto& value) {
      if constexpr (std::is_same_v<decltype(value), int64_t&>) value += 5;
    });
    for_each_column(filled.table, []<class T>(const ColumnInfo&, const T* column, int64_t rows) {
      for (int64_t i = 0; std::is_same_v<T, int64_t> && i < rows; ++i) const_cast<T*>(column)[i] += 5;
    });
  };
  add_five(detections);
  add_five(tracks);
  CHECK(hash_of_run() == before);
}

// ---- files ----------------------------------------------------------------------------------------------------------

using Json = nlohmann::ordered_json;

std::vector<std::string> keys_of(const Json& object) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : object.items()) keys.push_back(key);
  return keys;
}

TEST_CASE("columns: the JSON has every column and value of detections and tracks, and the schema has the same keys") {
  const ovt_frame_info info{};
  const auto check = [&](auto filled, auto format, const std::string& schema_name, const std::string& rows) {
    const auto text = [&] { return format(info, filled.table); };
    const std::string before = text();
    filled.flip_each([&](const ColumnInfo&) { CHECK(text() != before); });
    for_each_value(filled.table, [&](const ValueInfo& value_info, auto& value) {
      const std::string name = value_info.name;
      CAPTURE(name);
      value -= 1;
      CHECK(text() != before);
      value += 1;
    });
    const Json json = Json::parse(before), schema = Json::parse(cli::number_schema(schema_name)).at("properties");
    CHECK(keys_of(json) == keys_of(schema));
    REQUIRE(json.at(rows).size() == 3);
    const Json& row = json.at(rows).at(0);
    const Json& row_schema = schema.at(rows).at("items").at("properties");
    CHECK(keys_of(row) == keys_of(row_schema));
    for (const auto& item : row.items()) {
      const std::string& key = item.key();
      const Json& value = item.value();
      CAPTURE(key);
      const Json& of = row_schema.at(key);
      if (of.contains("enum"))
        CHECK(std::count(of["enum"].begin(), of["enum"].end(), value) == 1);
      else if (of["type"] == "string")
        CHECK(value.is_string());
      else if (of["type"] == "integer")
        CHECK(value.is_number_integer());
      else
        CHECK((value.is_number_float() || value.is_array() || value.is_object()));
      if (key != "path") CHECK(of.at("description").get<std::string>() != "");
    }
  };
  check(Filled<ovt_detections>(), cli::format_detections, "overtake.Detections", "detections");
  check(Filled<ovt_tracks>(), cli::format_tracks, "overtake.Tracks", "tracks");

  const Filled<ovt_detections> d;
  const Json row = Json::parse(cli::format_detections(info, d.table)).at("detections").at(1);
  CHECK(row.at("heading_source") == "var");
  CHECK(row.at("points") == d.table.point_count[1]);
  CHECK(row.at("track") == std::to_string(d.table.track[1]));
  CHECK(row.at("map_d_m") == d.table.map_d_m[1]);
  const Filled<ovt_tracks> t;
  const Json track = Json::parse(cli::format_tracks(info, t.table)).at("tracks").at(1);
  CHECK(track.at("state") == "confirmed");
  CHECK(track.at("measured_ns") == std::to_string(t.table.measured_ns[1]));
  CHECK(track.at("flags") == t.table.flags[1]);
  CHECK(track.at("existence") == t.table.existence[1]);
  CHECK(track.at("class") == "car");
  CHECK(track.at("visibility") == "missed");
  CHECK(track.at("covariance").at(14) == t.table.covariance[14][1]);
  CHECK(track.at("path").at("cov_xy") == std::vector<double>(t.table.path_cov_xy + 3, t.table.path_cov_xy + 6));
}

TEST_CASE("columns: the JSON and its schema have every counter by its name") {
  ovt_stats stats = ovt_default_stats();
  int64_t n = 100;
  for_each_counter(stats, [&](const char*, int64_t& counter) { counter = n++; });
  const Json json = Json::parse(cli::format_counters(stats));
  CHECK(keys_of(json) == keys_of(Json::parse(cli::number_schema("overtake.Counters")).at("properties")));
  std::size_t bad = 0;
  for_each_counter(stats, [&](const char* name, int64_t counter) {
    CAPTURE(name);
    const Json& value = json.at(name);
    CHECK((value.is_array() ? value.at(bad++) : value) == counter);
  });
  CHECK(bad == std::size(stats.points_bad));
  CHECK(json.size() + bad - 1 == std::size_t(n - 100));
}

TEST_CASE("columns: the CSV files keep their columns; the header names each") {
  const TempFolder folder;
  const ovt_frame_info info{};
  const auto read = [&] {
    std::ifstream file(folder.path("table.csv"));
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  Filled<ovt_detections> detections;
  const auto detections_csv = [&] {
    io::CsvWriter csv(folder.path("table.csv"), cli::detections_header(detections.table));
    cli::write_detections(csv, 7, detections.table);
    csv.flush();
    return read();
  };
  const std::string common =
      "frame,stamp_ns,x_m,y_m,z_m,heading_rad,heading_source,length_m,width_m,points,inliers_ref,inliers_var,"
      "heading_ref_rad,heading_var_rad,sensor_mask";
  CHECK(detections_csv() == common +
                                ",var_x,var_y,cov_xy,view,class,road_z_m,height_m,ego_offset_rad"
                                "\n7,20,21,22,23,24,ref,26,27,28,29,30,31,32,37,42,43,44,rear,unknown,47,48,49"
                                "\n7,21,22,23,24,25,var,27,28,29,30,31,32,33,38,43,44,45,front,car,48,49,50"
                                "\n7,22,23,24,25,26,ref,28,29,30,31,32,33,34,39,44,45,46,rear,unknown,49,50,51\n");
  {  // of a method without the optional columns
    Filled<ovt_detections> fewer;
    fewer.drop_optional();
    io::CsvWriter csv(folder.path("table.csv"), cli::detections_header(fewer.table));
    cli::write_detections(csv, 7, fewer.table);
    csv.flush();
    CHECK(read() == common +
                        "\n7,20,21,22,23,24,ref,26,27,28,29,30,31,32,37"
                        "\n7,21,22,23,24,25,var,27,28,29,30,31,32,33,38"
                        "\n7,22,23,24,25,26,ref,28,29,30,31,32,33,34,39\n");
    const Json few = Json::parse(cli::format_detections(info, fewer.table)).at("detections").at(0);
    CHECK(few.contains("track"));
    CHECK_FALSE(few.contains("view"));
    const Json schema = Json::parse(cli::number_schema("overtake.Detections"));
    const Json& required = schema.at("properties").at("detections").at("items").at("required");
    CHECK(std::count(required.begin(), required.end(), "track") == 1);
    CHECK(std::count(required.begin(), required.end(), "view") == 0);
  }
  const std::string before = detections_csv();
  detections.flip_each([&](const ColumnInfo& column) { CHECK((detections_csv() != before) == (*column.csv != 0)); });

  Filled<ovt_tracks> tracks;
  const auto tracks_csv = [&] {
    io::CsvWriter csv(folder.path("table.csv"), cli::tracks_header(tracks.table));
    cli::write_tracks(csv, 7, info, tracks.table);
    csv.flush();
    return read();
  };
  const std::string of_all =
      "stamp_ns,id,state,frame,x_m,y_m,speed_mps,course_rad,yaw_rate_rps,heading_rad,age,hits,var_x,var_y,ahead_m,"
      "left_m,name";
  CHECK(tracks_csv() == of_all +
                            ",existence,class,visibility,unseen_s,heading_sigma_rad"
                            "\n3,20,tentative,7,23,24,25,26,27,43,46,47,28,30,23,24,20:0,57,unknown,seen,60,61"
                            "\n3,21,confirmed,7,24,25,26,27,28,44,47,48,29,31,24,25,21:0,58,car,missed,61,62"
                            "\n3,22,tentative,7,25,26,27,28,29,45,48,49,30,32,25,26,22:0,59,unknown,seen,62,63\n");
  {  // of a method without the optional columns: the file ends with `name`
    Filled<ovt_tracks> fewer;
    fewer.drop_optional();
    io::CsvWriter csv(folder.path("table.csv"), cli::tracks_header(fewer.table));
    cli::write_tracks(csv, 7, info, fewer.table);
    csv.flush();
    CHECK(read() == of_all +
                        "\n3,20,tentative,7,23,24,25,26,27,43,46,47,28,30,23,24,20:0"
                        "\n3,21,confirmed,7,24,25,26,27,28,44,47,48,29,31,24,25,21:0"
                        "\n3,22,tentative,7,25,26,27,28,29,45,48,49,30,32,25,26,22:0\n");
    const Json few = Json::parse(cli::format_tracks(info, fewer.table)).at("tracks").at(0);
    CHECK(few.contains("flags"));
    CHECK_FALSE(few.contains("existence"));
    const Json schema = Json::parse(cli::number_schema("overtake.Tracks"));
    const Json& required = schema.at("properties").at("tracks").at("items").at("required");
    CHECK(std::count(required.begin(), required.end(), "flags") == 1);
    CHECK(std::count(required.begin(), required.end(), "existence") == 0);
  }
  const std::string tracks_before = tracks_csv();
  std::size_t variances = 0;
  tracks.flip_each([&](const ColumnInfo& column) {
    const bool changed = tracks_csv() != tracks_before;
    if (column.name == std::string("covariance"))
      variances += changed;
    else
      CHECK(changed == (*column.csv != 0));
  });
  CHECK(variances == 4);  // var_x and var_y of the first and the last row
}

TEST_CASE("columns: a track's place is turned by the ego heading that put it on the map") {
  Filled<ovt_tracks> tracks;
  ovt_frame_info info = {};
  info.reference = OVT_REFERENCE_MAP;
  info.ego_known = 1;
  info.ego_x_m = 3, info.ego_y_m = 4;
  info.ego_yaw_rad = 1.0, info.ego_heading_offset_rad = 0.25;
  const cli::Place place = cli::place_of(info, tracks.table, 1);
  const double dx = tracks.table.x_m[1] - 3, dy = tracks.table.y_m[1] - 4;
  CHECK(place.ahead_m == doctest::Approx(dx * std::cos(1.25) + dy * std::sin(1.25)));
  CHECK(place.left_m == doctest::Approx(dy * std::cos(1.25) - dx * std::sin(1.25)));
  info.ego_known = 0;
  CHECK(std::isnan(cli::place_of(info, tracks.table, 1).ahead_m));
}

TEST_CASE("columns: numbers that were read back from tracks.csv are the bits that were written") {
  const TempFolder folder;
  Filled<ovt_tracks> tracks;
  const double existence[] = {1.0 / 3.0, 1e-3, 0.99966464986953363}, unseen_s[] = {0, 0.1, 3.95},
               sigma_rad[] = {0.1, 3.14159265358979312, 5e-324};
  tracks.table.existence = existence, tracks.table.unseen_s = unseen_s, tracks.table.heading_sigma_rad = sigma_rad;
  io::CsvWriter writer(folder.path("tracks.csv"), cli::tracks_header(tracks.table));
  cli::write_tracks(writer, 7, {}, tracks.table);
  writer.flush();
  const io::Csv csv = io::Csv::read(folder.path("tracks.csv"));
  REQUIRE(csv.row_count() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(csv.number(i, csv.need({"existence"})) == existence[i]);
    CHECK(csv.number(i, csv.need({"unseen_s"})) == unseen_s[i]);
    CHECK(csv.number(i, csv.need({"heading_sigma_rad"})) == sigma_rad[i]);
    CHECK(csv.number(i, csv.need({"x_m"})) == tracks.table.x_m[i]);
    CHECK(csv.text(i, csv.need({"class"})) == (i == 1 ? "car" : "unknown"));
    CHECK(csv.text(i, csv.need({"visibility"})) == (i == 1 ? "missed" : "seen"));
  }
}

TEST_CASE("columns: overtake.h, stats.def and the page of overtake view have the same flags of a frame") {
  std::vector<std::string> in_header, in_page, flags, bits;
#define OVT_FRAME_FLAG(name)                                                  \
  flags.push_back("OVT_FLAG_" #name " = " + std::to_string(OVT_FLAG_##name)); \
  bits.push_back(std::to_string(OVT_FLAG_##name));
#include "pipeline/stats.def"
  const auto find_all = [](const std::string& text, const char* pattern, int group, std::vector<std::string>& found) {
    const std::regex regex(pattern);
    for (std::sregex_iterator at(text.begin(), text.end(), regex), end; at != end; ++at)
      found.push_back(at->str(group));
  };
  find_all(io::read_whole_file("pipeline/overtake.h"), R"(\bOVT_FLAG_\w+ = \d+)", 0, in_header);
  const std::string page = io::read_whole_file("tools/view/web/src/timeline.ts");
  const std::size_t begin = page.find("const kFlags"), end = page.find("]];", begin);
  REQUIRE(end != std::string::npos);
  find_all(page.substr(begin, end - begin), R"(\[(\d+), ")", 1, in_page);
  CHECK(io::join(in_header, "\n") == io::join(flags, "\n"));
  CHECK(io::join(in_page, " ") == io::join(bits, " "));
}

}  // namespace
}  // namespace overtake
