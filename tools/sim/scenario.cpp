// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/sim/scenario.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "tools/io/text.h"
#include "tools/io/toml_reader.h"
#include "tools/io/words.h"
#include "tools/sim/overtake_plan.h"
#include "tools/sim/scenario_toml.h"

namespace overtake::sim {
namespace {

using io::TomlReader;
constexpr double kMostTime = 36000;

double kmh(double v) { return v / 3.6; }

ScanPattern read_pattern(TomlReader& toml, ScanPattern p) {
  if (toml.has("pattern")) {
    try {
      p.kind = pattern_kind(toml.text("pattern"));
    } catch (const std::invalid_argument& error) {
      toml.fail(toml.line_of("pattern"), error.what());
    }
  }
  p.rate_hz = toml.number_or("rate_hz", 1, 30, p.rate_hz);
  p.lines_per_s = toml.number_or("lines_per_s", 64, 5120, p.lines_per_s);
  constexpr double kMostRows = 1024;  // of an image
  if (p.lines_per_s / p.rate_hz > kMostRows)
    toml.fail(toml.line_of(toml.has("lines_per_s") ? "lines_per_s" : "rate_hz"),
              "more than 1024 lines a scan: lines_per_s / rate_hz");
  p.fov_top_rad = toml.number_or("fov_top_deg", -15, 15, p.fov_top_rad / kDegree) * kDegree;
  p.fov_bottom_rad = toml.number_or("fov_bottom_deg", -15, 15, p.fov_bottom_rad / kDegree) * kDegree;
  p.center_rad = toml.number_or("center_deg", -15, 15, p.center_rad / kDegree) * kDegree;
  p.sigma_rad = toml.number_or("sigma_deg", 0.2, 30, p.sigma_rad / kDegree) * kDegree;
  p.dense_share = toml.number_or("dense_share", 0.05, 1, p.dense_share);
  p.drift_rad = toml.number_or("drift_deg", 0, 5, p.drift_rad / kDegree) * kDegree;
  p.drift_period_s = toml.number_or("drift_period_s", 0.1, kMostTime, p.drift_period_s);
  if (p.fov_top_rad <= p.fov_bottom_rad) toml.fail(toml.line(), "fov_top_deg must be above fov_bottom_deg");
  return p;
}

void read_sensors(Scenario& scenario, TomlReader& toml) {
  SensorErrors& e = scenario.errors;
  scenario.seam_strip_m = toml.number_or("seam_strip_m", 0.2, 0.9, scenario.seam_strip_m);
  e.range_noise_m = toml.number_or("range_noise_m", 0, 1, e.range_noise_m);
  e.beam_rad = toml.number_or("beam_mrad", 0, 10, e.beam_rad * 1e3) * 1e-3;
  e.missing_line_share = toml.number_or("missing_line_share", 0, 1, e.missing_line_share);
  e.clock_jitter_s = toml.number_or("clock_jitter_s", 0, 0.01, e.clock_jitter_s);
  e.mounting_error_m = toml.number_or("mounting_error_m", 0, 0.5, e.mounting_error_m);
  e.mounting_error_rad = toml.number_or("mounting_error_deg", 0, 5, e.mounting_error_rad / kDegree) * kDegree;
  e.head_overlap_rad = toml.number_or("head_overlap_deg", -5, 5, e.head_overlap_rad / kDegree) * kDegree;
  e.head_spread_rad = toml.number_or("head_spread_deg", 0, 5, e.head_spread_rad / kDegree) * kDegree;
  e.head_step_rad = toml.number_or("head_step_deg", 0, 2, e.head_step_rad / kDegree) * kDegree;
  e.own_nose_share = toml.number_or("own_nose_share", 0, 1, e.own_nose_share);
  e.range_min_m = toml.number_or("range_min_m", 0.1, 50, e.range_min_m);
  e.range_max_m = toml.number_or("range_max_m", 10, 300, e.range_max_m);
  if (e.range_min_m >= e.range_max_m)
    toml.fail(toml.line_of(toml.has("range_min_m") ? "range_min_m" : "range_max_m"),
              "range_min_m must be below range_max_m");
  e.second_returns = toml.boolean_or("second_returns", e.second_returns);
  e.report_own_car = toml.boolean_or("report_own_car", e.report_own_car);
  scenario.patterns = {{0, read_pattern(toml, ScanPattern())}};
  for (const toml::table* table : toml.tables("change")) {
    TomlReader change(toml.path(), *table, "sensors.change");
    const double at = change.number("at_s", 0, kMostTime);
    if (at < scenario.patterns.back().at_s) change.fail(change.line_of("at_s"), "changes must be in order of time");
    scenario.patterns.push_back({at, read_pattern(change, scenario.patterns.back().pattern)});
    change.finish();
  }
  toml.finish();
}

void read_localisation(LocalisationErrors& e, TomlReader& toml) {
  e.rate_hz = toml.number_or("rate_hz", 1, 1000, e.rate_hz);
  e.position_noise_m = toml.number_or("position_noise_m", 0, 10, e.position_noise_m);
  e.drift_m = toml.number_or("drift_m", 0, 10, e.drift_m);
  e.drift_time_s = toml.number_or("drift_time_s", 0.1, kMostTime, e.drift_time_s);
  e.heading_noise_rad = toml.number_or("heading_noise_deg", 0, 20, e.heading_noise_rad / kDegree) * kDegree;
  e.heading_offset_rad = toml.number_or("heading_offset_deg", -20, 20, e.heading_offset_rad / kDegree) * kDegree;
  e.speed_noise_mps = toml.number_or("speed_noise_mps", 0, 10, e.speed_noise_mps);
  e.yaw_rate_noise_rps = toml.number_or("yaw_rate_noise_rps", 0, 1, e.yaw_rate_noise_rps);
  e.latency_s = toml.number_or("latency_s", 0, 1, e.latency_s);
  e.in_plane = toml.boolean_or("in_plane", e.in_plane);
  for (const toml::table* table : toml.tables("jump")) {
    TomlReader jump(toml.path(), *table, "localisation.jump");
    e.jumps.push_back({jump.number("at_s", 0, kMostTime), jump.number("x_m", -100, 100), jump.number("y_m", -100, 100),
                       jump.number("over_s", 0, kMostTime)});
    jump.finish();
  }
  for (const toml::table* table : toml.tables("drop_out")) {
    TomlReader out(toml.path(), *table, "localisation.drop_out");
    e.drop_outs.push_back({out.number("at_s", 0, kMostTime), out.number("over_s", 0, kMostTime)});
    out.finish();
  }
  toml.finish();
}

Rain read_rain(TomlReader& toml) {
  Rain rain;
  rain.mm_per_h = toml.number("mm_per_h", 0.1, 200);
  rain.drop_reflectivity = toml.number_or("drop_reflectivity", 0.001, 1, rain.drop_reflectivity);
  rain.wet_floor = toml.number_or("wet_floor", 0.05, 1, rain.wet_floor);
  toml.finish();
  return rain;
}

CarPlan read_car(TomlReader& toml) {
  CarPlan car;
  car.name = toml.text("name");
  if (car.name.empty() || car.name.find_first_of("\"\\,\n\t") != std::string::npos)
    toml.fail(toml.line_of("name"), "a name is not empty and holds no quotes, backslashes, commas or new lines");
  toml.name_it("car '" + car.name + "'");
  car.start_s_m = toml.number_or("start_s_m", -1e5, 1e5, 0);
  car.start_d_m = toml.number_or("start_d_m", -30, 30, 0);
  car.start_speed_mps = kmh(toml.number_or("speed_kmh", 0, kMostSpeed_kmh, 200));
  for (const toml::table* table : toml.tables("speed")) {
    TomlReader change(toml.path(), *table, toml.where() + ".speed");
    car.speed.push_back({change.number("at_s", 0, kMostTime), kmh(change.number("kmh", 0, kMostSpeed_kmh)),
                         change.number("over_s", 0.01, kMostTime)});
    change.finish();
  }
  for (const toml::table* table : toml.tables("lane")) {
    TomlReader change(toml.path(), *table, toml.where() + ".lane");
    car.lane.push_back(
        {change.number("at_s", 0, kMostTime), change.number("d_m", -30, 30), change.number("over_s", 0.01, kMostTime)});
    change.finish();
  }
  for (const toml::table* table : toml.tables("spin")) {
    TomlReader spin(toml.path(), *table, toml.where() + ".spin");
    car.spin.push_back(
        {spin.number("at_s", 0, kMostTime), spin.number("turns", -10, 10), spin.number("over_s", 0.1, kMostTime)});
    spin.finish();
  }
  toml.finish();
  return car;
}

std::vector<int64_t> read_seeds(TomlReader& toml, const toml::table& table, const std::string& key) {
  std::vector<int64_t> seeds;
  toml.mark_read(key);
  if (!table.contains(key)) return seeds;
  const toml::array* array = table[key].as_array();
  if (!array) toml.fail(toml.line_of(key), key + " is a list of integers");
  for (const auto& element : *array) {
    const auto value = element.value<int64_t>();
    if (!value || *value < 0) toml.fail(toml.line_of(key), key + " is a list of integers of at least 0");
    seeds.push_back(*value);
  }
  return seeds;
}

void read_without(Scenario& scenario, TomlReader& toml, const toml::table& table) {
  toml.mark_read("without");
  if (!table.contains("without")) return;
  const toml::array* array = table["without"].as_array();
  if (!array) toml.fail(toml.line_of("without"), "without is a list of map and poses");
  for (const auto& element : *array) {
    const std::string what = element.value_or(std::string());
    if (what != "map" && what != "poses") toml.fail(toml.line_of("without"), "without is a list of map and poses");
    (what == "map" ? scenario.without_map : scenario.without_poses) = true;
  }
}

Puffs read_puffs(const Scenario& scenario, TomlReader& toml) {
  Puffs puffs{toml.text("car"),
              toml.number("from_s", 0, kMostTime),
              toml.number("to_s", 0, kMostTime),
              toml.number_or("per_s", 1, 200, 40),
              toml.number_or("density_pm", 0.001, 10, 0.1),
              toml.number_or("life_s", 0.1, 60, 3)};
  if (scenario.find_car(puffs.car) < 0) toml.fail(toml.line_of("car"), "no car is named '" + puffs.car + "'");
  if (puffs.to_s <= puffs.from_s) toml.fail(toml.line_of("to_s"), "to_s must be above from_s");
  toml.finish();
  return puffs;
}

Debris read_debris(TomlReader& toml) {
  Debris piece{};
  piece.s_m = toml.number("s_m", -1e5, 1e5), piece.d_m = toml.number("d_m", -30, 30);
  piece.size_m = toml.number_or("size_m", 0.02, 3, 0.4);
  piece.height_m = toml.number_or("height_m", 0.01, 3, piece.size_m / 4);
  const std::string shape = toml.text_or("shape", "box");
  if (shape != "box" && shape != "tyre") toml.fail(toml.line_of("shape"), "shape is box or tyre");
  piece.tyre = shape == "tyre";
  toml.finish();
  return piece;
}

Reflectors read_reflectors(TomlReader& toml) {
  Reflectors row{};
  row.s_m = toml.number("s_m", -1e5, 1e5), row.d_m = toml.number("d_m", -30, 30);
  row.height_m = toml.number_or("height_m", 0.1, 10, 0.8), row.size_m = toml.number_or("size_m", 0.02, 3, 0.12);
  row.count = int32_t(toml.integer_or("count", 1, 1000, 1));
  row.every_m = toml.number_or("every_m", 0.1, 1000, 25);
  toml.finish();
  return row;
}

Dirt read_dirt(TomlReader& toml) {
  Dirt dirt{};
  const std::string sensor = toml.text("sensor");
  dirt.sensor = int32_t(std::find(kSensorName, kSensorName + kSensors, sensor) - kSensorName);
  if (dirt.sensor == kSensors) toml.fail(toml.line_of("sensor"), "sensor is front, left or right");
  dirt.azimuth_rad = toml.number("azimuth_deg", -180, 180) * kDegree;
  dirt.width_rad = toml.number("width_deg", 0.01, 180) * kDegree;
  dirt.from_s = toml.number_or("from_s", 0, 36000, 0), dirt.to_s = toml.number_or("to_s", 0, 36000, 36000);
  if (dirt.to_s < dirt.from_s) toml.fail(toml.line_of("to_s"), "to_s is before from_s");
  toml.finish();
  return dirt;
}

void read_overtakes(Scenario& scenario, TomlReader& toml) {
  std::vector<Overtake> list;
  for (const toml::table* table : toml.tables("overtake")) {
    if (scenario.cars.size() != 2) toml.fail(toml.line_of("overtake"), "overtakes need two cars, ego and another");
    TomlReader reader(toml.path(), *table, "overtake");
    Overtake o;
    const std::string passer = reader.text("passer");
    if (scenario.find_car(passer) < 0) reader.fail(reader.line_of("passer"), "no car is named '" + passer + "'");
    o.ego_passes = passer == scenario.ego;
    o.passer_mps = kmh(reader.number("passer_kmh", 50, kMostSpeed_kmh));
    o.passed_mps = kmh(reader.number("passed_kmh", 50, kMostSpeed_kmh));
    const std::string side = reader.text("side");
    if (side != "left" && side != "right") reader.fail(reader.line_of("side"), "side is left or right");
    o.on_left = side == "left";
    o.defends = reader.boolean_or("defends", false);
    if (o.passer_mps <= o.passed_mps) reader.fail(reader.line_of("passer_kmh"), "the passer must be the faster one");
    if (!list.empty() && list.back().ego_passes == o.ego_passes)
      reader.fail(reader.line(), "overtakes alternate: who was passed is next to pass");
    reader.finish();
    list.push_back(o);
  }
  if (list.empty()) return;
  const std::size_t ego = std::size_t(scenario.find_car(scenario.ego));
  plan_overtakes(list, scenario.cars[ego], scenario.cars[1 - ego], scenario.seconds);
}

const BuiltinScenario* find_builtin(const std::string& name) {
  for (int32_t i = 0; i < kBuiltinScenarioCount; ++i)
    if (name == kBuiltinScenarios[i].name) return &kBuiltinScenarios[i];
  return nullptr;
}

}  // namespace

int32_t Scenario::find_car(const std::string& car) const {
  for (std::size_t i = 0; i < cars.size(); ++i)
    if (cars[i].name == car) return int32_t(i);
  return -1;
}

const ScanPattern& Scenario::pattern_at(double time_s) const {
  std::size_t i = patterns.size() - 1;
  while (i > 0 && patterns[i].at_s > time_s + 1e-9) --i;
  return patterns[i].pattern;
}

Scenario parse_scenario(const std::string& path, std::string_view text) {
  const toml::table root = io::parse_toml(path, text);
  TomlReader toml(path, root);
  Scenario scenario;
  scenario.name = toml.text_or("name", std::filesystem::path(path).stem().string());
  scenario.track = toml.text_or("track", "oval");
  if (scenario.track != "oval" && scenario.track != "road") toml.fail(toml.line_of("track"), "track is oval or road");
  scenario.ego = toml.text_or("ego", "ego");
  scenario.seconds = toml.number_or("seconds", 0.05, kMostTime, 20);
  scenario.map_error_m = toml.number_or("map_error_m", 0, 5, scenario.map_error_m);
  scenario.map_wave_m = toml.number_or("map_wave_m", 10, 5000, scenario.map_wave_m);
  scenario.map_shift_m = toml.number_or("map_shift_m", -20, 20, scenario.map_shift_m);
  scenario.verge.kerb_m = toml.number_or("kerb_m", 0, 0.5, scenario.verge.kerb_m);
  scenario.verge.grass_m = toml.number_or("grass_m", 0, 1, scenario.verge.grass_m);
  read_without(scenario, toml, root);
  scenario.tune_seeds = read_seeds(toml, root, "tune_seeds");
  scenario.test_seeds = read_seeds(toml, root, "test_seeds");
  for (const int64_t seed : scenario.test_seeds)
    if (std::count(scenario.tune_seeds.begin(), scenario.tune_seeds.end(), seed))
      toml.fail(toml.line_of("test_seeds"), "seed " + std::to_string(seed) + " is in both lists");
  scenario.patterns = {{0, ScanPattern()}};
  const auto for_each = [&](const char* name, auto&& read) {
    for (const toml::table* table : toml.tables(name)) {
      TomlReader reader(path, *table, name);
      read(reader);
    }
  };
  if (const toml::table* table = toml.only_table("sensors")) {
    TomlReader reader(path, *table, "sensors");
    read_sensors(scenario, reader);
  }
  if (const toml::table* table = toml.only_table("localisation")) {
    TomlReader reader(path, *table, "localisation");
    read_localisation(scenario.localisation, reader);
  }
  if (const toml::table* table = toml.only_table("rain")) {
    TomlReader reader(path, *table, "rain");
    scenario.rain = read_rain(reader);
  }
  for_each("car", [&](TomlReader& reader) {
    scenario.cars.push_back(read_car(reader));
    if (scenario.find_car(scenario.cars.back().name) != int32_t(scenario.cars.size()) - 1)
      reader.fail(reader.line(), "two cars have this name");
  });
  if (scenario.find_car(scenario.ego) < 0) toml.fail(toml.line(), "no car is named '" + scenario.ego + "', the ego");
  read_overtakes(scenario, toml);
  for_each("smoke", [&](TomlReader& reader) { scenario.puffs.push_back(read_puffs(scenario, reader)); });
  for_each("debris", [&](TomlReader& reader) { scenario.debris.push_back(read_debris(reader)); });
  for_each("dirt", [&](TomlReader& reader) { scenario.dirt.push_back(read_dirt(reader)); });
  for_each("reflector", [&](TomlReader& reader) { scenario.reflectors.push_back(read_reflectors(reader)); });
  toml.finish();
  return scenario;
}

Scenario load_scenario(const std::string& file_or_name) {
  // Before the file: a log or a folder is often named after its scenario.
  if (const BuiltinScenario* builtin = find_builtin(file_or_name)) return parse_scenario(file_or_name, builtin->text);
  if (!std::filesystem::exists(file_or_name))
    throw io::Error(file_or_name, 0,
                    "is neither a file nor a built-in scenario; built in are " +
                        io::join(builtin_scenario_names(), ", ") +
                        io::did_you_mean(file_or_name, builtin_scenario_names()));
  return parse_scenario(file_or_name, io::read_whole_file(file_or_name, io::kMostToml));
}

std::vector<std::string> builtin_scenario_names() {
  std::vector<std::string> names;
  for (int32_t i = 0; i < kBuiltinScenarioCount; ++i) names.push_back(kBuiltinScenarios[i].name);
  return names;
}

bool is_builtin_scenario(const std::string& name) { return find_builtin(name) != nullptr; }

}  // namespace overtake::sim
