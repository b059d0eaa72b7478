// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/differences.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "tools/client/config.h"
#include "tools/evaluation/evaluator.h"
#include "tools/evaluation/figures_parts.h"
#include "tools/evaluation/numbers.h"
#include "tools/io/json_text.h"
#include "tools/io/text.h"

namespace overtake::evaluation {
namespace {

constexpr double kSeenPoints = 3;
constexpr double kAloneS = 20;       // frames without a car: a group is as long
constexpr double kSameTruth = 1e-3;  // m, m/s: another machine may round otherwise; no two races agree so well

using Parts = std::array<metrics::RatioPart, kMeasureCount>;
using Draws = std::array<std::vector<double>, kMeasureCount>;  // as GroupDraws::ratios gives them

// The group of each frame of a log: the overtaking event of the car that is nearest along the way, by the truth.
std::map<double, int64_t> groups_of(const Run& run) {
  struct Nearest {
    double away_m;
    int64_t group;
  };
  const Table& cars = run.tables.at("cars");
  const auto frame = column_of(cars, "frame"), ahead = column_of(cars, "ahead_m");
  std::map<double, Nearest> nearest;
  int64_t next = 0;
  for (const auto& [number, rows, events] : rows_by_car(cars)) {
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const std::size_t r = rows[k];
      if (bin_of(ahead[r]) < 0) continue;
      const auto [at, is_new] = nearest.try_emplace(frame[r], Nearest{kNan, 0});
      if (is_new || std::fabs(ahead[r]) < at->second.away_m) at->second = {std::fabs(ahead[r]), next + events[k]};
    }
    next += events.empty() ? 0 : *std::max_element(events.begin(), events.end()) + 1;
  }
  std::map<double, int64_t> out;
  for (const auto& [number, near] : nearest) out[number] = near.group;
  const Table& ego = run.tables.at("ego");
  const auto ego_frame = column_of(ego, "frame"), time = column_of(ego, "time_s");
  for (std::size_t i = 0; i < ego_frame.size(); ++i)
    out.try_emplace(ego_frame[i], next + int64_t(std::max(0.0, time[i]) / kAloneS));
  return out;
}

// The sums of one run, by group.
std::map<int64_t, Parts> sum_run(const Run& run, const std::map<double, int64_t>& groups) {
  std::map<int64_t, Parts> out;
  const auto parts = [&](double frame) -> Parts& {
    const auto group = groups.find(frame);
    return out[group == groups.end() ? -1 : group->second];
  };
  const auto count = [&](double frame, std::size_t measure, double value) {
    if (!std::isfinite(value)) return;
    metrics::RatioPart& part = parts(frame)[measure];
    part.sum += value, ++part.count;
  };
  enum : std::size_t { kDetected, kFalse, kAlong, kAcross, kConfirmed, kFalseTracks, kPosition, kSpeed };

  const Table& cars = run.tables.at("cars");
  const auto at = column_of(cars, "frame"), ahead = column_of(cars, "ahead_m"), points = column_of(cars, "points"),
             detections = column_of(cars, "detections"), confirmed = column_of(cars, "confirmed");
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (bin_of(ahead[i]) < 0 || !(points[i] >= kSeenPoints)) continue;
    count(at[i], kDetected, detections[i] > 0);
    count(at[i], kConfirmed, confirmed[i] > 0);
  }
  for (const double frame : column_of(run.tables.at("clusters"), "frame")) {
    ++parts(frame)[kFalse].count;
    ++parts(frame)[kFalseTracks].count;
  }
  const Table& wrong = run.tables.at("false_detections");
  const auto wrong_at = column_of(wrong, "frame"), wrong_ahead = column_of(wrong, "ahead_m");
  for (std::size_t i = 0; i < wrong_at.size(); ++i) parts(wrong_at[i])[kFalse].sum += bin_of(wrong_ahead[i]) >= 0;
  const Table& centres = run.tables.at("centres");
  const auto centre_at = column_of(centres, "frame"), along = column_of(centres, "along_m"),
             across = column_of(centres, "across_m");
  for (std::size_t i = 0; i < centre_at.size(); ++i) {
    count(centre_at[i], kAlong, std::fabs(along[i]));
    count(centre_at[i], kAcross, std::fabs(across[i]));
  }
  const Table& tracks = run.tables.at("tracks");
  const auto track_at = column_of(tracks, "frame"), is_confirmed = column_of(tracks, "confirmed"),
             car = column_of(tracks, "car"), track_ahead = column_of(tracks, "ahead_m"),
             x = column_of(tracks, "x_map_m"), y = column_of(tracks, "y_map_m"), speed = column_of(tracks, "speed_mps");
  for (std::size_t i = 0; i < track_at.size(); ++i) {
    if (!(is_confirmed[i] > 0)) continue;
    if (car[i] < 0) {
      parts(track_at[i])[kFalseTracks].sum += bin_of(track_ahead[i]) >= 0;
    } else {
      count(track_at[i], kPosition, std::hypot(x[i], y[i]));
      count(track_at[i], kSpeed, std::fabs(speed[i]));
    }
  }
  return out;
}

// The variant without the folder that read_results writes before it.
std::string variant_of(const Run& run) { return run.variant.substr(run.variant.rfind('/') + 1); }

// What a configuration changes: about.json's "config", one "name = value" a line, the first one "preset = NAME".
struct Changes {
  std::string preset;
  std::map<std::string, double> values;
};
// Sizes of tables are no parameters: every result's config.toml has them.
Changes changes_of(const Run& run) {
  Changes out = {variant_of(run), {}};
  const auto config = run.about.find("config");
  if (config == run.about.end()) return out;
  for (std::string_view rest = config->second; !rest.empty();) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
    const std::size_t equals = line.find(" = ");
    if (equals == std::string_view::npos) continue;
    const std::string name(line.substr(0, equals));
    const std::string_view text = line.substr(equals + 3);
    double value = 0;
    if (name == "preset")
      out.preset = text;
    else if (!name.starts_with("capacities.") && io::parse_number(text, value))
      out.values[name] = value;
  }
  return out;
}

// Whether two runs saw the same frames of the same race. The ego tells races without another car apart.
bool is_same_truth(const Run& a, const Run& b) {
  const std::pair<const char*, std::vector<const char*>> truths[] = {{"cars", {"frame", "car", "x_m", "y_m"}},
                                                                     {"ego", {"frame", "speed_mps"}}};
  const auto near = [](double x, double y) { return std::fabs(x - y) <= kSameTruth; };
  for (const auto& [table, columns] : truths)
    for (const char* column : columns) {
      const auto x = column_of(a.tables.at(table), column), y = column_of(b.tables.at(table), column);
      if (!std::equal(x.begin(), x.end(), y.begin(), y.end(), near)) return false;
    }
  return true;
}

bool is_compared(const Run& run) { return variant_of(run).find_first_of("@:") == std::string::npos; }

bool is_plain(const Run& run) {
  const auto config = run.about.find("config");
  return config == run.about.end() || config->second.empty();
}

double default_of(const std::string& preset, const std::string& parameter) {
  for (const cli::PresetParam& param : cli::describe_preset(preset))
    if (param.info.name == parameter) return param.info.value_default;
  return kNan;
}

Estimates estimates_of(const Draws& draws) {
  Estimates out;
  for (std::size_t m = 0; m < kMeasureCount; ++m) out[m] = metrics::estimate_of(draws[m]);
  return out;
}

Draws difference(const Draws& a, const Draws& b) {
  Draws out;
  for (std::size_t m = 0; m < kMeasureCount; ++m) out[m] = metrics::subtract(a[m], b[m]);
  return out;
}

// Of the grid's configurations of one preset.
void add_parameters(const std::string& preset, const std::map<std::string, Changes>& changes,
                    const std::map<std::string, Draws>& draws, std::vector<ParameterValue>& out) {
  std::map<std::string, std::set<double>> values;  // by parameter
  for (const auto& [name, change] : changes)
    if (change.preset == preset)
      for (const auto& [parameter, value] : change.values) values[parameter].insert(value);
  using Point = std::map<std::string, double>;
  std::map<Point, const Draws*> at;
  for (const auto& [name, change] : changes) {
    if (change.preset != preset) continue;
    Point point;
    for (const auto& [parameter, all] : values) {
      const auto given = change.values.find(parameter);
      point[parameter] = given == change.values.end() ? default_of(preset, parameter) : given->second;
    }
    at.try_emplace(point, &draws.at(name));
  }
  for (const auto& [parameter, given] : values) {
    std::set<double> all;
    for (const auto& [point, unused] : at) all.insert(point.at(parameter));
    if (all.size() < 2) continue;
    const double usual = default_of(preset, parameter), reference = all.count(usual) ? usual : *all.begin();
    for (const double value : all) {
      ParameterValue row = {preset, parameter, value, value == reference, 0, {}};
      Draws sum;
      for (const auto& [point, here] : at) {
        if (point.at(parameter) != value) continue;
        Point other = point;
        other[parameter] = reference;
        const auto there = at.find(other);
        if (there == at.end()) continue;
        const Draws change = difference(*here, *there->second);
        for (std::size_t m = 0; m < kMeasureCount; ++m) {
          sum[m].resize(change[m].size(), 0.0);
          for (std::size_t d = 0; d < change[m].size(); ++d) sum[m][d] += change[m][d];
        }
        ++row.configurations;
      }
      for (auto& of_measure : sum)
        for (double& v : of_measure) v /= row.configurations;
      row.differences = estimates_of(sum);
      out.push_back(row);
    }
  }
}

}  // namespace

Differences find_differences(const std::vector<Run>& runs, const std::string& base) {
  Differences out;
  out.base = base;
  std::map<std::string, std::map<std::string, const Run*>> by_log;  // log, variant
  std::map<std::string, Changes> changes;                           // by variant
  for (const Run& run : runs) {
    if (!is_compared(run)) continue;
    by_log[run.log][run.variant] = &run;
    changes.try_emplace(run.variant, changes_of(run));
    if (base.empty() && is_plain(run) && (out.base.empty() || run.variant < out.base)) out.base = run.variant;
  }
  if (changes.size() < 2) return {};
  if (out.base.empty()) out.base = changes.begin()->first;

  // The sums of each variant, by log and group.
  std::map<std::string, std::vector<Parts>> sums;
  for (const auto& [log, variants] : by_log) {
    const auto& of_log = variants;  // a lambda cannot capture a structured binding in clang 14
    const auto differs = [&](const auto& entry) { return !is_same_truth(*of_log.at(out.base), *entry.second); };
    if (variants.size() < changes.size() || std::any_of(variants.begin(), variants.end(), differs)) {
      ++out.logs_left_out;
      continue;
    }
    ++out.logs;
    const auto groups = groups_of(*variants.at(out.base));
    std::map<std::string, std::map<int64_t, Parts>> of_variant;
    std::set<int64_t> used;
    for (const auto& [variant, run] : variants) {
      of_variant[variant] = sum_run(*run, groups);
      for (const auto& [group, parts] : of_variant[variant]) used.insert(group);
    }
    for (auto& [variant, parts] : of_variant)
      for (const int64_t group : used) sums[variant].push_back(parts[group]);
    out.events += int64_t(used.size());
  }
  const metrics::GroupDraws groups{std::size_t(out.events)};
  std::map<std::string, Draws> draws;
  for (const auto& [variant, parts] : sums)
    for (std::size_t m = 0; m < kMeasureCount; ++m) {
      std::vector<metrics::RatioPart> of_measure;
      for (const Parts& p : parts) of_measure.push_back(p[m]);
      draws[variant][m] = groups.ratios(of_measure);
    }
  if (draws.empty()) return out;
  for (const auto& [variant, of_variant] : draws)
    out.contestants.push_back(
        {variant, estimates_of(of_variant), estimates_of(difference(of_variant, draws.at(out.base)))});
  std::set<std::string> presets;
  for (const auto& [variant, change] : changes) presets.insert(change.preset);
  for (const std::string& preset : presets) add_parameters(preset, changes, draws, out.parameters);
  return out;
}

std::vector<Run> read_results(const std::vector<std::string>& folders) {
  const auto name_of = [](const std::string& folder) {
    return std::filesystem::path(folder + "/").lexically_normal().parent_path().filename().string();
  };
  std::set<std::string> names;
  for (const std::string& folder : folders) names.insert(name_of(folder));
  std::vector<Run> out;
  for (const std::string& folder : folders)
    for (Run& run : read_runs(folder)) {
      if (!is_compared(run)) continue;
      run.variant = (names.size() == folders.size() ? name_of(folder) : folder) + "/" + run.variant;
      out.push_back(std::move(run));
    }
  return out;
}

nlohmann::json json_of(const Differences& d) {
  using Json = nlohmann::json;
  const auto estimates = [](const Estimates& all) {
    Json j = Json::object();
    for (std::size_t m = 0; m < kMeasureCount; ++m)
      j[kMeasures[m].key] = {{"value", all[m].value}, {"low", all[m].low}, {"high", all[m].high}};
    return j;
  };
  Json j = {{"base", d.base},
            {"logs", d.logs},
            {"events", d.events},
            {"logs_left_out", d.logs_left_out},
            {"contestants", Json::array()},
            {"parameters", Json::array()}};
  for (const ContestantDifference& c : d.contestants)
    j["contestants"].push_back(
        {{"contestant", c.contestant}, {"values", estimates(c.values)}, {"differences", estimates(c.differences)}});
  for (const ParameterValue& p : d.parameters)
    j["parameters"].push_back({{"preset", p.preset},
                               {"parameter", p.parameter},
                               {"value", p.value},
                               {"is_reference", p.is_reference},
                               {"configurations", p.configurations},
                               {"differences", estimates(p.differences)}});
  return j;
}

std::string json_text(const Differences& d) { return io::dump_json(json_of(d), 1); }

}  // namespace overtake::evaluation
