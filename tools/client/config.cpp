// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/client/config.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "tools/io/bag_reader.h"
#include "tools/io/error.h"
#include "tools/io/rig_toml.h"
#include "tools/io/text.h"
#include "tools/io/urdf.h"
#include "tools/io/words.h"

namespace overtake::cli {
namespace {

namespace fs = std::filesystem;
using io::Error;

std::vector<ovt_param_info> describe_params() {
  std::vector<ovt_param_info> all(std::size_t(std::max(ovt_param_count(), 0)));
  for (std::size_t i = 0; i < all.size(); ++i) ovt_describe_param(int32_t(i), &all[i]);
  return all;
}

std::string group_of(const std::string& name) { return name.substr(0, name.find('.')); }

// Pads the text to at least `width` characters; the last one is a space.
std::string padded(std::string text, std::size_t width) {
  text.resize(std::max(text.size() + 1, width), ' ');
  return text;
}

// "64" where the parameter is an integer, else "64.0".
std::string limit_text(const ovt_param_info& info, double value) {
  return info.is_integer ? std::to_string(std::llround(value)) : io::toml_number(value);
}

// Sets `name` to `value`. Returns the error message, or "" after success.
std::string set_param(ovt_params& params, const std::string& name, const std::string& value) {
  const ovt_status status = ovt_set_param(&params, name.c_str(), value.c_str());
  if (status == OVT_OK) return "";
  for (const ovt_param_info& info : describe_params()) {
    if (name != info.name) continue;
    const std::string kind = info.is_integer ? "a whole number" : "a number";
    return name + " is '" + value + "', it takes " + kind + " from " + limit_text(info, info.value_min) + " to " +
           limit_text(info, info.value_max) + (*info.unit ? " " + std::string(info.unit) : "");
  }
  std::vector<std::string> names;
  for (const ovt_param_info& info : describe_params()) names.emplace_back(info.name);
  return "there is no parameter '" + name + "' (overtake params lists them)" + io::did_you_mean(name, names);
}

void init_params(Config& config, const std::string& file, int64_t line) {
  if (ovt_params_init(&config.params, sizeof config.params, config.preset.c_str()) == OVT_OK) return;
  std::vector<std::string> names;
  for (int32_t i = 0; ovt_preset_name(i); ++i) names.emplace_back(ovt_preset_name(i));
  throw Error(file, line, "there is no preset '" + config.preset + "' (there is: " + io::join(names, ", ") + ")");
}

// Whether TOML can hold the text: its strings are UTF-8, a path may be any bytes.
bool fits_toml(const std::string& text) {
  try {
    io::parse_toml("", "text = " + io::toml_string(text));
    return true;
  } catch (const Error&) {
    return false;
  }
}

// Applies `change` to each path of "FILE" or "FILE1,FILE2".
template <class F>
std::string each_path(const std::string& text, F&& change) {
  const auto comma = text.find(',');
  if (text.empty() || text == "none") return text;
  if (comma == std::string::npos || fs::exists(text)) return change(text);
  return change(text.substr(0, comma)) + "," + change(text.substr(comma + 1));
}

std::string absolute_paths(const std::string& text) {
  return each_path(text, [](const std::string& path) { return fs::absolute(path).lexically_normal().string(); });
}

// Paths in a config file are relative to its folder.
std::string paths_beside(const std::string& config_file, const std::string& text) {
  return each_path(text, [&](const std::string& path) {
    return (fs::path(config_file).parent_path() / path).lexically_normal().string();
  });
}

void read_rig_key(Config& config, io::TomlReader& reader) {
  if (!reader.has("rig")) return;
  config.has_rig = true;
  if (reader.is_text("rig")) {
    const std::string rig = reader.text("rig");
    const auto names = io::builtin_rig_names();
    const bool builtin = std::find(names.begin(), names.end(), rig) != names.end();
    config.rig = io::load_rig(builtin ? rig : paths_beside(reader.path(), rig));
    return;
  }
  io::TomlReader part(reader.path(), *reader.only_table("rig"), "rig");
  config.rig = io::read_rig(part);
}

// Returns whether frame.period_s was set.
bool read_params(Config& config, io::TomlReader& reader) {
  const auto all = describe_params();
  bool period_set = false;
  for (const std::string& group : reader.unread()) {
    const bool known =
        std::any_of(all.begin(), all.end(), [&](const auto& info) { return group_of(info.name) == group; });
    if (!known) continue;  // finish() reports it
    io::TomlReader part(reader.path(), *reader.only_table(group), group);
    for (const std::string& key : part.unread()) {
      const std::string name = group + "." + key;
      if (std::none_of(all.begin(), all.end(), [&](const auto& info) { return name == info.name; })) continue;
      std::string value;
      const double number = part.any_number(key);
      if (number == std::floor(number) && std::fabs(number) < 1e15)
        value = std::to_string(int64_t(number));
      else
        io::append_number(value, number);
      const std::string wrong = set_param(config.params, name, value);
      if (!wrong.empty()) part.fail(part.line_of(key), wrong);
      period_set = period_set || name == "frame.period_s";
    }
    for (const ovt_param_info& info : all)  // the names that finish() may propose
      if (group_of(info.name) == group) part.mark_read(std::string(info.name).substr(group.size() + 1));
    part.finish();
  }
  return period_set;
}

// Returns whether frame.period_s was set.
bool read_config_file(Config& config, const Options& options) {
  const std::string text = io::read_whole_file(options.config, io::kMostToml);
  const toml::table table = io::parse_toml(options.config, text);
  io::TomlReader reader(options.config, table);
  reader.mark_read("command");  // information for people; the reader ignores it
  reader.mark_read("input");
  reader.mark_read("node");  // tools/ros2 reads it
  if (options.preset.empty())
    config.preset = reader.text_or("preset", config.preset);
  else
    reader.mark_read("preset");
  init_params(config, options.config, reader.line_of("preset"));
  config.map = paths_beside(options.config, reader.text_or("map", ""));
  config.ego = paths_beside(options.config, reader.text_or("ego", ""));
  config.isa = reader.text_or("isa", "");
  config.workers = int32_t(reader.integer_or("workers", 0, 256, config.workers));
  if (options.rig.empty())
    read_rig_key(config, reader);
  else
    reader.mark_read("rig");
  config.capacities = io::read_capacities(reader);
  const bool period_set = read_params(config, reader);
  reader.finish();
  return period_set;
}

// Sets NAME=ROWS. `points` applies to every sensor of the rig.
void set_capacity(Config& config, const std::string& pair) {
  const auto equals = std::min(pair.find('='), pair.size());
  const std::string name(io::trim(std::string_view(pair).substr(0, equals)));
  const std::string_view value = io::trim(std::string_view(pair).substr(std::min(equals + 1, pair.size())));
  const auto rows_of = [&](int32_t most) {
    int64_t rows = 0;
    if (!io::parse_integer(value, rows) || rows < 1 || rows > most)
      throw Error("--capacity " + pair, 0, "a whole number from 1 to " + std::to_string(most) + " is needed");
    return int32_t(rows);
  };
  if (name == "points") {
    const int32_t rows = rows_of(io::kMostPoints);
    if (!config.has_rig) throw Error("--capacity " + pair, 0, "needs a rig: points are of its sensors");
    for (io::RigSensor& sensor : config.rig.sensors) sensor.point_capacity = rows;
    return;
  }
  for (const io::CapacityKey& key : io::kCapacityKeys)
    if (name == key.name) {
      config.capacities.*key.rows = rows_of(key.most);
      return;
    }
  throw Error("--capacity " + pair, 0, "there is no capacity '" + name + "' (there are: " + capacity_names() + ")");
}

// A file of a folder that overtake simulate wrote (recognised by its rig file); "" where it has none.
std::string own_file(const std::string& folder, const char* name) {
  std::error_code code;
  if (!fs::is_regular_file(fs::path(folder) / "rig.toml", code)) return "";
  const fs::path path = fs::path(folder) / name;
  return fs::symlink_status(path, code).type() == fs::file_type::not_found ? "" : path.string();
}

// Uses the log's own rig, map and ego poses if the options name none.
void take_what_the_log_holds(Config& config, const Options& options) {
  if (options.command == "track" || options.input.empty()) return;
  if (const std::string rig = own_file(options.input, "rig.toml"); !config.has_rig && !rig.empty()) {
    config.rig = io::load_rig(rig);
    config.has_rig = config.own_rig = true;
  }
  const bool uses_place = options.command == "run" || options.command == "doctor";  // map and ego poses
  if (uses_place && config.map.empty()) {
    config.map = own_file(options.input, "map.csv");
    config.own_map = !config.map.empty();
  }
  if (uses_place && config.ego.empty()) {
    config.ego = own_file(options.input, "ego.csv");
    config.own_ego = !config.ego.empty();
  }
  if (!config.has_rig && io::read_attached(options.input, "rig.toml")) {
    config.rig = io::load_rig(options.input);
    config.has_rig = config.own_rig = true;
  }
  if (uses_place && config.map.empty() && io::read_attached(options.input, "map.csv")) {
    config.map = options.input;
    config.own_map = true;
  }
}

// "; REASON" where the recording is partial: its rig may be missing for that reason.
std::string say_partial(const std::string& input) {
  const std::string partial = io::why_partial(input);
  return partial.empty() ? "" : "; " + partial;
}

}  // namespace

bool reads_param(const ovt_params& params, std::string_view name) {
  const auto all = describe_params();
  for (std::size_t i = 0; i < all.size(); ++i)
    if (name == all[i].name) return ovt_reads_param(&params, int32_t(i)) != 0;
  return false;
}

Config load_config(const Options& options) {
  Config config;
  config.command = options.command;
  config.input = options.input;
  if (!options.preset.empty()) config.preset = options.preset;
  bool period_set = false;
  if (options.config.empty())
    init_params(config, "--preset", 0);
  else
    period_set = read_config_file(config, options);

  if (!options.rig.empty()) {
    config.rig = io::load_rig(options.rig);
    config.has_rig = true;
  }
  if (!options.map.empty()) config.map = options.map;
  if (!options.ego.empty()) config.ego = options.ego;
  take_what_the_log_holds(config, options);
  if (config.map == "none") config.map.clear();
  if (config.ego == "none") config.ego.clear(), config.no_ego = true;
  if (!options.urdf.empty()) {
    if (!config.has_rig) throw Error("--urdf " + options.urdf, 0, "needs a rig: it says which sensors there are");
    io::mount_by_urdf(config.rig, options.urdf);
  }
  if (!options.isa.empty()) config.isa = options.isa;
  if (options.workers >= 0) config.workers = options.workers;
  if (config.has_rig && !period_set) {
    std::string period;
    io::append_number(period, config.rig.period_s);
    const std::string wrong = set_param(config.params, "frame.period_s", period);
    if (!wrong.empty()) throw Error("rig " + config.rig.name, 0, wrong);
  }
  for (const std::string& pair : options.capacity) set_capacity(config, pair);
  for (const std::string& pair : options.set) {
    const auto equals = pair.find('=');
    if (equals == std::string::npos || equals == 0) throw Error("--set " + pair, 0, "key=value is needed");
    const std::string key(io::trim(std::string_view(pair).substr(0, equals)));
    const std::string value(io::trim(std::string_view(pair).substr(equals + 1)));
    const std::string wrong = set_param(config.params, key, value);
    if (!wrong.empty()) throw Error("--set " + pair, 0, wrong);
    if (!reads_param(config.params, key))
      throw Error("--set " + pair, 0,
                  "has no effect: preset " + config.preset + " does not read it (overtake params --preset " +
                      config.preset + " tells which it reads)");
  }
  return config;
}

Config load_config_with_rig(const Options& options) {
  Config config = load_config(options);
  if (!config.has_rig && !std::filesystem::exists(options.input)) throw Error(options.input, 0, "no such file");
  if (config.has_rig) return config;
  std::string damage;
  if (io::is_bag(options.input)) {
    const auto bag = io::open_bag(options.input);  // throws what is wrong with the file
    damage = bag->damage_of_search().empty() ? bag->damage() : bag->damage_of_search();
  }
  throw Error("", 0,
              "--rig is needed (the recording holds none" + (damage.empty() ? "" : ": " + damage) +
                  "): a TOML file, or " + io::join(io::builtin_rig_names(), ", ") + say_partial(options.input));
}

io::Capacities effective_capacities(const Config& config) {
  const ovt_detector_def def = ovt_default_detector_def();
  io::Capacities out{def.cluster_capacity, def.candidate_capacity, def.track_capacity, def.ego_pose_capacity};
  for (const io::CapacityKey& key : io::kCapacityKeys)
    for (const io::Capacities& given : {config.has_rig ? config.rig.capacities : io::Capacities(), config.capacities})
      if (given.*key.rows > 0) out.*key.rows = given.*key.rows;
  return out;
}

std::string capacity_names() {
  std::vector<std::string> names = {"points"};
  for (const io::CapacityKey& key : io::kCapacityKeys) names.emplace_back(key.name);
  return io::join(names, ", ");
}

std::string format_config(const Config& config) {
  ovt_build_info build;
  ovt_read_build_info(&build);
  std::string text = "# What this result was made with, by overtake " + std::string(build.version_text) + " (commit " +
                     build.commit + ", " + build.compiler + "). Can be given to --config.\n";
  const auto line = [&](const char* key, const std::string& value) {
    if (value.empty()) return;
    if (!fits_toml(value)) throw Error(value, 0, "its path is not UTF-8: config.toml cannot name it");
    text += std::string(key) + " = " + io::toml_string(value) + '\n';
  };
  line("command", config.command);
  if (const std::string input = absolute_paths(config.input); fits_toml(input))  // the reader ignores it
    line("input", input);
  line("preset", config.preset);
  // Of an input whose name does not fit, the next run takes map and ego poses from its own input.
  if (const std::string map = absolute_paths(config.map); !config.own_map || fits_toml(map))
    line("map", map.empty() ? "none" : map);  // else a log's own would be taken next time
  if (const std::string ego = absolute_paths(config.ego); !config.own_ego || fits_toml(ego))
    line("ego", config.no_ego ? "none" : ego);
  line("isa", config.isa);
  text += "workers = " + std::to_string(config.workers) + '\n';
  text += io::format_capacities(effective_capacities(config));
  std::string group;
  for (const ovt_param_info& info : describe_params()) {
    const std::string name = info.name;
    if (group_of(name) != group) {
      group = group_of(name);
      text += "\n[" + group + "]\n";
    }
    double value = 0;
    ovt_get_param(&config.params, info.name, &value);
    text += name.substr(group.size() + 1) + " = " +
            (info.is_integer ? std::to_string(std::llround(value)) : io::toml_number(value)) + '\n';
  }
  if (config.has_rig) text += "\n[rig]\n" + io::format_rig(config.rig, "rig.");
  return text;
}

void add_inputs(io::OutputGuard& guard, const Options& options, const Config& config) {
  for (const std::string& path : {config.input, config.map, config.ego, options.config, options.rig, options.urdf})
    guard.add_input(path);
}

std::vector<PresetParam> describe_preset(const std::string& preset) {
  Config config;
  config.preset = preset;
  init_params(config, "--preset", 0);
  std::vector<PresetParam> all;
  for (const ovt_param_info& info : describe_params()) {
    all.push_back({info, ovt_reads_param(&config.params, int32_t(all.size())) != 0});
    double value;
    ovt_get_param(&config.params, info.name, &value);
    // Angles are kept in radians, and come back some bits off their degrees.
    double& shown = all.back().info.value_default;
    if (std::abs(value - shown) > 1e-5 * std::abs(shown)) shown = std::round(value * 1e9) / 1e9;
  }
  return all;
}

std::string list_params(const std::string& preset) {
  std::string text;
  for (const auto& [info, has_effect] : describe_preset(preset)) {
    std::string value, limits;
    io::append_number(value, info.value_default);
    if (*info.unit) value += " " + std::string(info.unit);
    io::append_number(limits, info.value_min);
    limits += " to ";
    io::append_number(limits, info.value_max);
    text += padded(info.name, 34) + padded(value, 23) + padded(limits, 16) + info.text;
    text += has_effect ? "\n" : " [no effect in " + preset + "]\n";
  }
  return text;
}

}  // namespace overtake::cli
