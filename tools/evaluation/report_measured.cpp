// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Results that are measured once, independent of the runs: times over sensors and workers, recorded data.
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tools/client/console.h"
#include "tools/evaluation/recorded.h"
#include "tools/evaluation/report_html.h"
#include "tools/evaluation/svg_plot.h"
#include "tools/io/error.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::evaluation {
namespace {

using Json = nlohmann::json;

Json read_json(const std::string& path) {
  if (!std::filesystem::exists(path)) return {};
  try {
    return Json::parse(io::read_whole_file(path));
  } catch (const Json::exception& error) {
    throw io::Error(path, 0, error.what());
  }
}

std::string cell_text(const Json& value) {
  if (value.is_number_integer()) return std::to_string(value.get<int64_t>());
  if (value.is_number()) return cli::fixed(value.get<double>(), 3);
  if (value.is_string()) return value.get<std::string>();
  return value.is_null() ? "-" : value.dump();
}

std::string words_of(std::string name) {
  for (char& c : name)
    if (c == '_') c = ' ';
  return name;
}

// Objects as rows; leaves out members that are not single values. `name` heads the first column if rows have names.
std::string objects_table(const std::string& name, const std::vector<std::pair<std::string, Json>>& objects) {
  std::vector<std::string> keys;
  for (const auto& [label, object] : objects)
    for (const auto& [key, value] : object.items())
      if (value.is_primitive() && std::find(keys.begin(), keys.end(), key) == keys.end()) keys.push_back(key);
  Rows rows(1);
  if (!name.empty()) rows[0].push_back(name);
  for (const std::string& key : keys) rows[0].push_back(words_of(key));
  for (const auto& [label, object] : objects) {
    rows.emplace_back();
    if (!name.empty()) rows.back().push_back(label);
    for (const std::string& key : keys) rows.back().push_back(object.contains(key) ? cell_text(object[key]) : "-");
  }
  return table_html(rows);
}

std::vector<std::pair<std::string, Json>> rows_of(const Json& list) {
  std::vector<std::pair<std::string, Json>> rows;
  for (const auto& [key, value] : list.items())
    if (value.is_object()) rows.emplace_back(key, value);
  return rows;
}

}  // namespace

std::string scaling_section(const std::string& out) {
  const std::string path = out + "/scaling.json";
  const Json json = read_json(path);
  if (!json.contains("cells")) return "";
  try {
    std::map<int32_t, Series> latency, rate;  // by workers
    const char* colors[] = {kBlue, kOrange, kGreen, kPurple};
    for (const Json& cell : json.at("cells")) {
      const int32_t workers = cell.at("workers");
      for (auto* of : {&latency, &rate}) {
        Series& s = (*of)[workers];
        s.name = io::counted(workers, "worker");
        s.color = colors[std::size_t(workers - 1) % 4], s.dots = true;
        s.x.push_back(cell.at("sensors"));
        s.y.push_back(cell.at(of == &latency ? "median_ms" : "frames_per_second"));
      }
    }
    const auto plot = [](const char* title, const char* y, const std::map<int32_t, Series>& of) {
      std::vector<Series> series;
      double high = 0;
      for (const auto& [workers, s] : of) {
        series.push_back(s);
        for (const double v : s.y) high = std::max(high, v);
      }
      return line_plot({title, "sensors", y, 0, 8.5, 0, 1.4 * high, 484, 290}, series);
    };
    return "<h3 id=\"scaling\">Against sensors and workers</h3>\n" +
           paragraph(
               "One frame at a time, from the push of its first scan to its tracks; frames a second where frames "
               "may overlap. On " +
               (json.contains("cpu") ? cell_text(json["cpu"]) : "this CPU") + ", load average at the start " +
               (json.contains("load_average_at_start") ? cell_text(json["load_average_at_start"]) : "not known") +
               ".") +
           plot("Time of a frame", "median [ms]", latency) + plot("Frames a second", "1/s", rate);
  } catch (const Json::exception& error) {
    throw io::Error(path, 0, error.what());
  }
}

std::string recordings_section(const std::string& out) {
  const Json json = read_json(out + "/recordings.json");
  if (!json.is_object()) return "";
  std::string html =
      heading("recordings", "Recorded data") + paragraph("Not simulated: recorded scans and labels.") +
      table_html(recording_rows(json)) +
      paragraph("Preset " + (json.contains("preset") ? cell_text(json["preset"]) : "paper") + " in detail:");
  if (json.contains("racecar") && json["racecar"].contains("frames"))
    html += "<h3>AV-21 frames: detections at the opponent's GNSS box</h3>\n" +
            objects_table("", rows_of(json["racecar"]["frames"]));
  for (const auto& [key, title] : {std::pair("av2_sweep", "Argoverse 2 sweep: boxes of vehicle size, by range"),
                                   std::pair("nuscenes_sweep", "nuScenes frame: boxes of vehicle size, by range")})
    if (json.contains(key) && json[key].contains("by_range"))
      html += std::string("<h3>") + title + "</h3>\n" + objects_table("", rows_of(json[key]["by_range"]));
  for (const auto& [key, title] : {std::pair("kitti_tracks", "KITTI: the tracker alone on label centres"),
                                   std::pair("av2_tracks", "Argoverse 2: the tracker alone on label centres")})
    if (json.contains(key))
      html += std::string("<h3>") + title + "</h3>\n" + objects_table("sequence", rows_of(json[key]));
  return html;
}

}  // namespace overtake::evaluation
