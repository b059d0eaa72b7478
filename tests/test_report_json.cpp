// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// --json: the keys of tools/README.md, with the values of the text.
#include "tools/cli/report_json.h"

#include <doctest/doctest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "pipeline/overtake.h"

using namespace overtake;
using Json = nlohmann::json;

TEST_CASE("info_json: lists topics and scans; unknown values are null, invalid UTF-8 is replaced") {
  cli::RecordingInfo info;
  info.path = "race.db3", info.kind = "rosbag2", info.first_ns = INT64_C(1700000000123456789), info.last_ns = INT64_MAX;
  info.topics = {{"/front/points", "sensor_msgs/msg/PointCloud2", "front", "x float32 at 0", 7, 700, 1, 20.5, 4096},
                 {"/\xff\x1b[31m", "", "", "", 1, 0, 0, NAN, 0}};
  info.scans = {{"FRAME_left.pcd", "000001_left.pcd", "x float32", 3, 21000}};
  const std::string text = cli::info_json(info);
  const Json json = Json::parse(text);
  CHECK(json.at("path") == "race.db3");
  CHECK(json.at("kind") == "rosbag2");
  CHECK(json.at("damage") == "");
  CHECK(json.at("partial") == "");
  CHECK(json.at("first_ns") == INT64_C(1700000000123456789));
  CHECK(json.at("last_ns") == INT64_MAX);
  const Json& topic = json.at("topics").at(0);
  CHECK(topic.at("name") == "/front/points");
  CHECK(topic.at("type") == "sensor_msgs/msg/PointCloud2");
  CHECK(topic.at("frame") == "front");
  CHECK(topic.at("layout") == "x float32 at 0");
  CHECK(topic.at("messages") == 7);
  CHECK(topic.at("points") == 700);
  CHECK(topic.at("undecoded") == 1);
  CHECK(topic.at("rate_hz") == 20.5);
  CHECK(topic.at("bytes") == 4096);
  CHECK(json.at("topics").at(1).at("rate_hz").is_null());
  CHECK(text.find('\x1b') == std::string::npos);
  CHECK(text.find('\xff') == std::string::npos);
  const Json& scans = json.at("scans").at(0);
  CHECK(scans.at("name") == "FRAME_left.pcd");
  CHECK(scans.at("files") == 3);
  CHECK(scans.at("first_file") == "000001_left.pcd");
  CHECK(scans.at("points_of_first") == 21000);
  CHECK(scans.at("fields") == "x float32");
  const Json empty = Json::parse(cli::info_json({}));
  CHECK(empty.at("first_ns").is_null());
  CHECK(empty.at("topics").empty());
}

TEST_CASE("doctor_json: lists every finding and the number of WRONG ones") {
  const Json json = Json::parse(cli::doctor_json(
      "race", "av21", {{true, "sensor 'left'", "its \"sentence\"", "do this"}, {false, "ego", "there are none", ""}}));
  CHECK(json.at("input") == "race");
  CHECK(json.at("rig") == "av21");
  CHECK(json.at("wrong") == 1);
  REQUIRE(json.at("findings").size() == 2);
  CHECK(json.at("findings").at(0) == Json({{"severity", "wrong"},
                                           {"about", "sensor 'left'"},
                                           {"sentence", "its \"sentence\""},
                                           {"advice", "do this"}}));
  CHECK(json.at("findings").at(1).at("severity") == "note");
}

TEST_CASE("params_json: lists every parameter of the library, integers as integers") {
  const Json json = Json::parse(cli::params_json("paper")).at("parameters");
  REQUIRE(int32_t(json.size()) == ovt_param_count());
  for (int32_t i = 0; i < ovt_param_count(); ++i) {
    ovt_param_info info;
    REQUIRE(ovt_describe_param(i, &info) == OVT_OK);
    const Json& param = json.at(std::size_t(i));
    CHECK(param.at("name") == info.name);
    CHECK(param.at("unit") == info.unit);
    CHECK(param.at("text") == info.text);
    CHECK(param.at("default") == info.value_default);
    CHECK(param.at("min") == info.value_min);
    CHECK(param.at("max") == info.value_max);
    CHECK(param.at("integer") == (info.is_integer != 0));
    CHECK(param.at("default").is_number_integer() == (info.is_integer != 0));
  }
}
