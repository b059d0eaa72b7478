// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/rig.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "tools/io/bag_reader.h"
#include "tools/io/rig_toml.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::io {
namespace {

constexpr const char* kTimeUnits[] = {"auto", "s", "ms", "us", "ns"};

TimeUnit read_time_unit(TomlReader& reader) {
  const std::string unit = reader.text_or("time_unit", "auto");
  for (int32_t i = 0; i < 5; ++i)
    if (unit == kTimeUnits[i]) return TimeUnit(i);
  reader.fail(reader.line_of("time_unit"), "'time_unit' is \"" + unit + "\", not auto, s, ms, us or ns");
}

std::vector<std::string> read_topics(TomlReader& reader, const std::string& key) {
  const auto topics = reader.texts(key);
  for (const std::string& topic : topics)
    if (topic.empty() || topic[0] != '/' || std::count(topic.begin(), topic.end(), '*') > 1)
      reader.fail(reader.line_of(key), "topic '" + topic + "' must start with / and hold one * at most");
  return topics;
}

RigSensor read_sensor(TomlReader& reader) {
  RigSensor sensor;
  sensor.name = reader.text("name");
  const char* letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  if (sensor.name.empty() || sensor.name.find_first_not_of(letters) != std::string::npos)
    reader.fail(reader.line_of("name"), "a sensor's name is made of letters, digits, - and _");
  reader.name_it("sensor '" + sensor.name + "'");
  sensor.x_m = reader.number("x_m", -100, 100);
  sensor.y_m = reader.number("y_m", -100, 100);
  sensor.z_m = reader.number("z_m", -100, 100);
  sensor.roll_deg = reader.number_or("roll_deg", -180, 180, 0);
  sensor.pitch_deg = reader.number_or("pitch_deg", -180, 180, 0);
  sensor.yaw_deg = reader.number_or("yaw_deg", -360, 360, 0);
  sensor.rows = int32_t(reader.integer("rows", 1, 1024));
  sensor.cols = int32_t(reader.integer("cols", 2, 16384));
  sensor.wraps = reader.boolean_or("wraps", false);
  if (sensor.wraps) {
    sensor.azimuth_left_deg = reader.number_or("azimuth_left_deg", -360, 360, 180);
    if (reader.has("azimuth_right_deg"))
      reader.fail(reader.line_of("azimuth_right_deg"), "a sensor that wraps has no right edge");
    sensor.azimuth_right_deg = sensor.azimuth_left_deg - 360;
  } else {
    sensor.azimuth_left_deg = reader.number("azimuth_left_deg", -360, 360);
    sensor.azimuth_right_deg = reader.number("azimuth_right_deg", -360, 360);
    const double width = sensor.azimuth_left_deg - sensor.azimuth_right_deg;
    if (!(width > 0 && width <= 360))
      reader.fail(reader.line_of("azimuth_right_deg"),
                  "the right edge must lie right of the left one, at most a turn away (angles grow to the left)");
  }
  sensor.range_min_m = reader.number_or("range_min_m", 0, 10000, sensor.range_min_m);
  sensor.range_max_m = reader.number_or("range_max_m", 0, 10000, sensor.range_max_m);
  if (sensor.range_min_m >= sensor.range_max_m)
    reader.fail(reader.line_of("range_max_m"), "'range_max_m' must be larger than 'range_min_m'");
  sensor.layer_first = int32_t(reader.integer_or("layer_first", 0, 65535, 0));
  sensor.layer_last = int32_t(reader.integer_or("layer_last", 0, 65535, 65535));
  if (sensor.layer_first > sensor.layer_last)
    reader.fail(reader.line_of("layer_last"), "'layer_last' must not be smaller than 'layer_first'");
  if (reader.has("compensated_to_s")) sensor.compensated_to_s = reader.number("compensated_to_s", -1, 1);
  sensor.point_capacity = int32_t(reader.integer_or("point_capacity", 1, kMostPoints, sensor.point_capacity));
  sensor.topics = read_topics(reader, "topics");
  sensor.frame_id = reader.text_or("frame_id", "");
  reader.finish();
  return sensor;
}

}  // namespace

Capacities read_capacities(TomlReader& reader) {
  Capacities capacities;
  const toml::table* table = reader.only_table("capacities");
  if (!table) return capacities;
  TomlReader part(reader.path(), *table, "capacities");
  for (const CapacityKey& key : kCapacityKeys)
    if (part.has(key.name)) capacities.*key.rows = int32_t(part.integer(key.name, 1, key.most));
  part.finish();
  return capacities;
}

std::string format_capacities(const Capacities& capacities, const std::string& prefix) {
  std::string text;
  for (const CapacityKey& key : kCapacityKeys)
    if (capacities.*key.rows > 0) text += std::string(key.name) + " = " + std::to_string(capacities.*key.rows) + '\n';
  return text.empty() ? text : "\n[" + prefix + "capacities]\n" + text;
}

Rig read_rig(TomlReader& reader) {
  Rig rig;
  rig.name = reader.text_or("name", std::filesystem::path(reader.path()).stem().string());
  rig.period_s = reader.number("period_s", 0.001, 10);
  const std::string frame = reader.text_or("cloud_frame", "sensor");
  if (frame != "sensor" && frame != "vehicle")
    reader.fail(reader.line_of("cloud_frame"), "'cloud_frame' is \"" + frame + "\", not sensor or vehicle");
  rig.cloud_in_vehicle_frame = frame == "vehicle";
  rig.shared_cloud = reader.boolean_or("shared_cloud", false);
  rig.time_unit = read_time_unit(reader);
  if (const toml::table* table = reader.only_table("topics")) {
    TomlReader topics(reader.path(), *table, "topics");
    rig.ego_topics = read_topics(topics, "ego");
    rig.opponent_topics = read_topics(topics, "opponent");
    topics.finish();
  }

  rig.capacities = read_capacities(reader);

  const auto tables = reader.tables("sensor");
  if (tables.empty()) reader.fail(reader.line(), "no [[sensor]]");
  if (tables.size() > 8) reader.fail(int64_t(tables[8]->source().begin.line), "more than 8 sensors");
  for (const toml::table* table : tables) {
    TomlReader part(reader.path(), *table, "sensor " + std::to_string(rig.sensors.size() + 1));
    const RigSensor sensor = read_sensor(part);
    if (rig.find(sensor.name) >= 0) part.fail(part.line_of("name"), "the name is given to two sensors");
    if (rig.cloud_in_vehicle_frame && (sensor.roll_deg != 0 || sensor.pitch_deg != 0 || sensor.yaw_deg != 0))
      part.fail(part.line(), "with cloud_frame = \"vehicle\" roll, pitch and yaw must be 0");
    if (rig.shared_cloud)
      for (const RigSensor& other : rig.sensors)
        if (sensor.layer_first <= other.layer_last && other.layer_first <= sensor.layer_last)
          part.fail(part.line(), "with shared_cloud its layers must not be those of sensor '" + other.name + "'");
    rig.sensors.push_back(sensor);
  }
  reader.finish();
  return rig;
}

int32_t Rig::find(std::string_view sensor_name) const {
  for (std::size_t i = 0; i < sensors.size(); ++i)
    if (sensors[i].name == sensor_name) return int32_t(i);
  return -1;
}

std::string Rig::sensor_names() const {
  std::vector<std::string> names;
  for (const RigSensor& sensor : sensors) names.push_back(sensor.name);
  return join(names, ", ");
}

Rig parse_rig(const std::string& path_in_errors, std::string_view text) {
  const toml::table table = parse_toml(path_in_errors, text);
  TomlReader reader(path_in_errors, table);
  return read_rig(reader);
}

std::vector<std::string> builtin_rig_names() {
  std::vector<std::string> names;
  for (int32_t i = 0; i < kBuiltinRigCount; ++i) names.emplace_back(kBuiltinRigs[i].name);
  return names;
}

Rig load_rig(const std::string& file_or_name) {
  for (int32_t i = 0; i < kBuiltinRigCount; ++i)
    if (file_or_name == kBuiltinRigs[i].name) return parse_rig(file_or_name, kBuiltinRigs[i].text);
  std::error_code code;
  if (!std::filesystem::exists(file_or_name, code))
    throw Error(file_or_name, 0,
                "neither a file nor one of the built-in rigs " + join(builtin_rig_names(), ", ") +
                    did_you_mean(file_or_name, builtin_rig_names()));
  refuse_special_file(file_or_name);
  if (const auto own = read_attached(file_or_name, "rig.toml")) return parse_rig(file_or_name + ": rig.toml", *own);
  if (is_bag(file_or_name)) throw Error(file_or_name, 0, "a log that holds no rig.toml: give a rig's file or name");
  return parse_rig(file_or_name, read_whole_file(file_or_name, kMostToml));
}

std::string format_rig(const Rig& rig, const std::string& prefix) {
  const auto number = [](const char* key, double value) {
    return std::string(key) + " = " + toml_number(value) + '\n';
  };
  const auto integer = [](const char* key, int64_t value) {
    return std::string(key) + " = " + std::to_string(value) + '\n';
  };
  std::string text = "name = " + toml_string(rig.name) + '\n' + number("period_s", rig.period_s) + "cloud_frame = \"" +
                     (rig.cloud_in_vehicle_frame ? "vehicle" : "sensor") +
                     "\"\nshared_cloud = " + (rig.shared_cloud ? "true" : "false") + "\ntime_unit = \"" +
                     kTimeUnits[int32_t(rig.time_unit)] + "\"\n";
  const auto texts = [](const char* key, const std::vector<std::string>& values) {
    std::string out;
    for (const std::string& value : values) out += (out.empty() ? "" : ", ") + toml_string(value);
    return values.empty() ? out : std::string(key) + " = [" + out + "]\n";
  };
  if (!rig.ego_topics.empty() || !rig.opponent_topics.empty())
    text += "\n[" + prefix + "topics]\n" + texts("ego", rig.ego_topics) + texts("opponent", rig.opponent_topics);
  text += format_capacities(rig.capacities, prefix);
  for (const RigSensor& s : rig.sensors) {
    text += "\n[[" + prefix + "sensor]]\nname = " + toml_string(s.name) + '\n';
    text += number("x_m", s.x_m) + number("y_m", s.y_m) + number("z_m", s.z_m);
    text += number("roll_deg", s.roll_deg) + number("pitch_deg", s.pitch_deg) + number("yaw_deg", s.yaw_deg);
    text += integer("rows", s.rows) + integer("cols", s.cols) + number("azimuth_left_deg", s.azimuth_left_deg);
    text += s.wraps ? "wraps = true\n" : number("azimuth_right_deg", s.azimuth_right_deg);
    text += number("range_min_m", s.range_min_m) + number("range_max_m", s.range_max_m);
    text += integer("layer_first", s.layer_first) + integer("layer_last", s.layer_last);
    text += integer("point_capacity", s.point_capacity) + texts("topics", s.topics);
    if (s.compensated_to_s) text += number("compensated_to_s", *s.compensated_to_s);
    if (!s.frame_id.empty()) text += "frame_id = " + toml_string(s.frame_id) + '\n';
  }
  return text;
}

}  // namespace overtake::io
