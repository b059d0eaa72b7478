// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/rig.h"

#include <doctest/doctest.h>

#include "tests/support/temp_folder.h"
#include "tools/client/session.h"
#include "tools/io/toml_reader.h"

using namespace overtake;
using io::Rig;

namespace {

const std::string kGood =
    "period_s = 0.05\n"  // line 1
    "\n"
    "[[sensor]]\n"                // 3
    "name = \"front\"\n"          // 4
    "x_m = 1\n"                   // 5
    "y_m = 2\n"                   // 6
    "z_m = 3\n"                   // 7
    "rows = 32\n"                 // 8
    "cols = 857\n"                // 9
    "azimuth_left_deg = 60\n"     // 10
    "azimuth_right_deg = -60\n";  // 11

std::string replaced(const std::string& from, const std::string& to) {
  std::string text = kGood;
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

}  // namespace

TEST_CASE("rig: the built-in rigs have their makers' values") {
  const Rig av21 = io::load_rig("av21");
  REQUIRE(av21.sensors.size() == 3);
  CHECK(av21.period_ns() == 50'000'000);
  CHECK(av21.sensor_names() == "front, left, right");
  const double place[3][4] = {{2.342, 0, 0.646, 0}, {1.549, 0.267, 0.741, 120}, {1.549, -0.267, 0.741, -120}};
  for (std::size_t s = 0; s < 3; ++s) {
    const io::RigSensor& sensor = av21.sensors[s];
    CHECK(sensor.x_m == place[s][0]);
    CHECK(sensor.y_m == place[s][1]);
    CHECK(sensor.z_m == place[s][2]);
    CHECK(sensor.yaw_deg == place[s][3]);
    CHECK(sensor.rows == 32);
    CHECK(sensor.cols == 857);
    CHECK(sensor.azimuth_left_deg - sensor.azimuth_right_deg == 120);
    CHECK_FALSE(sensor.wraps);
  }
  struct Row {
    const char* name;
    int32_t rows, cols;
  };
  for (const Row& row :
       {Row{"hdl64", 64, 2048}, Row{"hdl32", 32, 1084}, Row{"nuscenes", 32, 1084}, Row{"av2", 32, 1800}}) {
    const io::RigSensor sensor = io::load_rig(row.name).sensors[0];
    CHECK(sensor.rows == row.rows);
    CHECK(sensor.cols == row.cols);
    CHECK(sensor.wraps);
    CHECK(sensor.azimuth_left_deg - sensor.azimuth_right_deg == 360);
  }
  CHECK(io::load_rig("av2").shared_cloud);
  CHECK(io::load_rig("av2").sensors[1].layer_first == 32);
}

TEST_CASE("rig: whether a driver compensates for the motion of the vehicle") {
  const auto rig_of = [](const std::string& more) { return io::parse_rig("rig.toml", kGood + more); };
  CHECK_FALSE(rig_of("").sensors[0].compensated_to_s);
  for (const double to_s : {0.0, -0.1, 0.05}) {
    const io::Rig rig = rig_of("compensated_to_s = " + std::to_string(to_s) + "\n");
    REQUIRE(rig.sensors[0].compensated_to_s);
    CHECK(*rig.sensors[0].compensated_to_s == to_s);
    CHECK(io::parse_rig("again.toml", io::format_rig(rig)).sensors[0].compensated_to_s ==
          rig.sensors[0].compensated_to_s);
  }
  CHECK_THROWS(rig_of("compensated_to_s = 2\n"));
}

TEST_CASE("rig: point_capacity has the library's limit") {
  const auto rig_of = [](const char* points) {
    return io::parse_rig("rig.toml", kGood + std::string("point_capacity = ") + points + "\n");
  };
  CHECK(rig_of("16000000").sensors[0].point_capacity == 16'000'000);
  const std::string said = error_of([&] { rig_of("16000001"); });
  CHECK_MESSAGE(said.rfind("rig.toml:12: sensor 'front': 'point_capacity'", 0) == 0, said);
  ovt_sensor_def sensor = cli::to_sensor_def(rig_of("16000000").sensors[0]);
  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = &sensor, def.sensor_count = 1;
  sensor.point_capacity = 16'000'001;
  ovt_detector* detector = nullptr;
  CHECK(ovt_create_detector(&def, &detector) == OVT_BAD_ARGUMENT);
}

TEST_CASE("rig: writing and reading gives the same rig") {
  for (const std::string& name : io::builtin_rig_names()) {
    CAPTURE(name);
    const Rig rig = io::load_rig(name);
    const std::string text = io::format_rig(rig);
    CHECK(io::format_rig(io::parse_rig("f", text)) == text);
  }
  const Rig from_file = io::parse_rig("/somewhere/mine.toml", kGood);
  CHECK(from_file.name == "mine");
  CHECK(from_file.sensors[0].z_m == 3);
}

TEST_CASE("rig: each kind of bad file gets its error with the line") {
  REQUIRE(io::parse_rig("f", kGood).sensors.size() == 1);
  struct Row {
    std::string text, sentence;
  };
  std::string nine = "period_s = 1\n";
  for (int32_t i = 0; i < 9; ++i) {
    std::string sensor = kGood.substr(kGood.find("[["));
    nine += sensor.replace(sensor.find("front"), 5, "s" + std::to_string(i));
  }
  const std::string second = kGood.substr(kGood.find("[["));
  const Row rows[] = {
      {"period_s = \n", "f:1:"},
      {"period_s = 0.05\nperiod_s = 1\n", "f:2:"},
      {replaced("period_s = 0.05", "period = 0.05"), "f:1: 'period_s' is missing"},
      {replaced("period_s = 0.05", "period_s = 0"), "f:1: 'period_s' is 0.0, its limits are 0.001 to 10.0"},
      {replaced("period_s = 0.05", "period_s = nan"), "f:1: 'period_s' is nan, its limits are"},
      {replaced("period_s = 0.05", "period_s = \"fast\""), "f:1: 'period_s' is not a number"},
      {"colour = 1\n" + kGood, "f:1: unknown key 'colour'"},
      {"cloud_frame = \"map\"\n" + kGood, "f:1: 'cloud_frame' is \"map\", not sensor or vehicle"},
      {"shared_cloud = 1\n" + kGood, "f:1: 'shared_cloud' is neither true nor false"},
      {"time_unit = \"h\"\n" + kGood, "f:1: 'time_unit' is \"h\", not auto, s, ms, us or ns"},
      {"name = 5\n" + kGood, "f:1: 'name' is not text in quotes"},
      {"period_s = 1\n", "f:1: no [[sensor]]"},
      {"period_s = 1\nsensor = 3\n", "f:2: 'sensor' is not a table"},
      {nine, "f:74: more than 8 sensors"},
      {replaced("name = \"front\"\n", ""), "f:3: sensor 1: 'name' is missing"},
      {replaced("\"front\"", "\"a b\""), "f:4: sensor 1: a sensor's name is made of letters, digits, - and _"},
      {replaced("x_m = 1\n", ""), "f:3: sensor 'front': 'x_m' is missing"},
      {replaced("rows = 32", "rows = 0"), "f:8: sensor 'front': 'rows' is 0, its limits are 1 to 1024"},
      {replaced("rows = 32", "rows = 32.5"), "f:8: sensor 'front': 'rows' is not a whole number"},
      {replaced("cols = 857", "colums = 857"), "f:3: sensor 'front': 'cols' is missing"},
      {kGood + "pitch = 1\n", "f:12: sensor 'front': unknown key 'pitch'"},
      {replaced("azimuth_right_deg = -60", "azimuth_right_deg = 70"),
       "f:11: sensor 'front': the right edge must lie right of the left one"},
      {kGood + "wraps = true\n", "f:11: sensor 'front': a sensor that wraps has no right edge"},
      {kGood + "range_min_m = 10\nrange_max_m = 5\n", "f:13: sensor 'front': 'range_max_m' must be larger"},
      {kGood + "layer_first = 9\nlayer_last = 5\n", "f:13: sensor 'front': 'layer_last' must not be smaller"},
      {kGood + second, "f:13: sensor 'front': the name is given to two sensors"},
      {kGood + "[[topics]]\nego = \"/a\"\n[[topics]]\nego = \"/b\"\n",
       "f:14: a second table [[topics]]: only one is read"},
      {kGood + "[[capacities]]\ntracks = 5\n[[capacities]]\n", "f:14: a second table [[capacities]]: only one is"},
      {"cloud_frame = \"vehicle\"\n" + kGood + "yaw_deg = 1\n",
       "f:4: sensor 'front': with cloud_frame = \"vehicle\" roll, pitch and yaw must be 0"},
      {"shared_cloud = true\n" + kGood + std::string(second).replace(second.find("front"), 5, "rear"),
       "f:13: sensor 'rear': with shared_cloud"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.sentence);
    const std::string error = error_of([&] { io::parse_rig("f", row.text); });
    CHECK_MESSAGE(error.rfind(row.sentence, 0) == 0, error);
  }
  const TempFolder folder;
  folder.write("empty.mcap", "no magic, but its name says what it should be");
  const std::string log = error_of([&] { io::load_rig(folder.path("empty.mcap")); });
  CHECK(log.find("empty.mcap") != std::string::npos);
  CHECK(log.find("holds no rig.toml") != std::string::npos);
  const std::string error = error_of([] { io::load_rig("av22"); });
  CHECK(error ==
        "av22: neither a file nor one of the built-in rigs av21, racecar, hdl64, hdl32, nuscenes, av2; did you mean "
        "'av21'?");
}

TEST_CASE("toml: other characters than ASCII are allowed only in strings and comments, and bad texts give an error") {
  const auto error = [](const char* text) { return error_of([&] { io::parse_toml("t.toml", text); }); };
  CHECK(error("\xef\xbb\xbf# M\xc3\xbcller\nname = \"B\xc3\xa4r \\\" \xc3\xa4\" # \xc3\xa4 \"\nx = '\xc3\xb6'\n")
            .empty());
  CHECK(error("y = \"\"\"\n\xc3\xbc \"quoted\" \xc3\xbc\n\"\"\"\nz = '''\n\xc3\xbc '\n'''\n").empty());
  CHECK(error("roll_de\xca\xae = 1\n").find("t.toml:1") != std::string::npos);
  CHECK(error("a = 1\n\nb = \"\xc3\xa4\"\nb\xc3\xa4 = 2\n").find("t.toml:4") != std::string::npos);
  CHECK(error("a = \"open\nb\xc3\xa4 = 1\n").find("t.toml:2") != std::string::npos);
  CHECK(error("a = 1\nme = \"\"\"\"race\\\\\\\xcf\x8fp\n").find("t.toml:2") !=
        std::string::npos);  // a Unicode escape of such a letter
  CHECK(error("a = 1\nb = 18'\xc3\xa4'\n").find("t.toml:2") != std::string::npos);
  CHECK(error("a = 1\nb = 18\x01\n").find("t.toml:2") != std::string::npos);
  CHECK(error("a = [\"x\",\"y\"]\nb.\"c\" = {d=\"e\"}\n\"f\" = 'g'\n").empty());
  CHECK(error("a = \"\"\"two of its own\"\"\"\"\"\nb = '''one''''\nc = \"\"\"\"\"\"\n").empty());
  CHECK_FALSE(error("[!]\n").empty());
}
