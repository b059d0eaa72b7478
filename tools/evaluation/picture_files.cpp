// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tools/client/console.h"
#include "tools/evaluation/snapshot_picker.h"
#include "tools/io/error.h"
#include "tools/io/json_text.h"
#include "tools/io/text.h"

namespace overtake::evaluation {
namespace {

namespace fs = std::filesystem;

std::string folder_of(const std::string& run_folder) { return run_folder + "/pictures"; }

}  // namespace

void write_pictures(const std::string& run_folder, const std::vector<NamedPicture>& pictures, const std::string& path) {
  cli::make_folder(folder_of(run_folder));
  nlohmann::json list = nlohmann::json::array();
  for (const NamedPicture& p : pictures) {
    list.push_back({{"name", p.name}, {"caption", p.caption}, {"score", p.score}});
    if (p.stamps_ns.empty()) continue;
    list.back()["path"] = path;
    for (const int64_t stamp_ns : p.stamps_ns) list.back()["stamps_ns"].push_back(std::to_string(stamp_ns));
  }
  for (const NamedPicture& p : pictures) io::write_whole_file(folder_of(run_folder) + "/" + p.name + ".svg", p.svg);
  io::write_whole_file(folder_of(run_folder) + "/pictures.json", io::dump_json(list, 1) + "\n");
}

std::map<std::string, NamedPicture> best_pictures(const std::vector<std::string>& run_folders) {
  std::map<std::string, NamedPicture> best;
  for (const std::string& run_folder : run_folders) {
    const std::string folder = folder_of(run_folder), path = folder + "/pictures.json";
    if (!fs::exists(path)) continue;
    try {
      for (const auto& entry : nlohmann::json::parse(io::read_whole_file(path))) {
        NamedPicture p{entry.at("name"), "", entry.at("caption"), entry.at("score")};
        const auto kept = best.find(p.name);
        if (kept != best.end() && kept->second.score >= p.score) continue;
        p.svg = io::read_whole_file(folder + "/" + p.name + ".svg");
        p.log = fs::path(run_folder).filename().string();
        p.caption = p.log + ", " + p.caption;
        p.path = entry.value("path", "");
        for (const auto& stamp : entry.value("stamps_ns", nlohmann::json::array()))
          p.stamps_ns.push_back(std::stoll(stamp.get<std::string>()));
        best[p.name] = std::move(p);
      }
    } catch (const nlohmann::json::exception& error) {
      throw io::Error(path, 0, error.what());
    } catch (const std::logic_error& error) {  // no number
      throw io::Error(path, 0, error.what());
    }
  }
  return best;
}

void copy_pictures(const std::string& from_run_folder, const std::string& to_run_folder) {
  if (!fs::exists(folder_of(from_run_folder))) return;
  cli::make_folder(folder_of(to_run_folder));
  for (const auto& file : fs::directory_iterator(folder_of(from_run_folder)))
    io::write_whole_file(folder_of(to_run_folder) + "/" + file.path().filename().string(),
                         io::read_whole_file(file.path().string()));
}

}  // namespace overtake::evaluation
