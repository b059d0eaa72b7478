// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/kept_runs.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/hash.h"
#include "tools/io/error.h"
#include "tools/io/json_text.h"
#include "tools/io/text.h"

namespace overtake::evaluation {
namespace {

namespace fs = std::filesystem;

// Of a file larger than kBlockCount blocks, as many at even distances: the first, the last, and others between.
void add_file(const fs::path& path, Hash& hash) {
  constexpr std::streamoff kBlock = 1 << 20, kBlockCount = 64;
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = file.tellg();
  if (!file || size < 0) throw io::Error(path.string(), 0, "cannot be read");
  hash.add_value(int64_t(size));
  std::vector<char> bytes(std::size_t(std::min(size, kBlock)));
  const std::streamoff step =
      size <= kBlockCount * kBlock ? kBlock : (size - kBlock + kBlockCount - 2) / (kBlockCount - 1);
  for (std::streamoff begin = 0; begin < size; begin += step) {
    file.seekg(begin);
    file.read(bytes.data(), std::streamsize(std::min(size - begin, kBlock)));
    hash.add_bytes(bytes.data(), std::size_t(file.gcount()));
  }
}

}  // namespace

About read_about(const std::string& folder) {
  const std::string file = folder + "/about.json";
  try {
    return nlohmann::json::parse(io::read_whole_file(file)).get<About>();
  } catch (const nlohmann::json::exception& error) {
    throw io::Error(file, 0, error.what());
  }
}

void write_about(const std::string& folder, const About& about) {
  io::write_whole_file(folder + "/about.json", io::dump_json(nlohmann::json(about), 1) + "\n");
}

About portable(About about) {
  about.erase("input"), about.erase("cpu");
  return about;
}

std::string log_file_name(const std::string& log) {
  fs::path path = log.empty() ? fs::path() : fs::absolute(log).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();  // "bag/"
  const std::string stem = path.stem().string();
  if (stem.empty() || stem == "." || stem == "..")
    throw io::Error(log, 0, "has no name, and results lie in a folder of the log's name");
  return path.filename().string();
}

std::string log_stem(const std::string& log) { return fs::path(log_file_name(log)).stem().string(); }

std::string hash_input(const std::string& log, const std::string& more) {
  if (!fs::exists(log)) throw io::Error(log, 0, "no such file");
  std::vector<fs::path> files = {log};
  if (fs::is_directory(log)) {
    files.clear();
    for (const auto& entry : fs::recursive_directory_iterator(log))
      if (entry.is_regular_file()) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
  }
  Hash hash;
  for (const fs::path& file : files) add_file(file, hash);
  hash.add_bytes(more.data(), more.size());
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash.value()));
  return text;
}

std::string why_not_kept(const std::string& folder, const About& wanted) {
  if (!fs::exists(folder + "/about.json")) return kNotThere;
  About found;
  try {
    found = read_about(folder);
  } catch (const io::Error&) {
    return "a damaged about.json";
  }
  const About words = {{"commit", "build"},
                       {"every", "--every"},
                       {"frame_limit", "--frames"},
                       {"input", "log, rig or map"},
                       {"compared", "--compare-every"},
                       {"extent", "--only-figures"},
                       {"config", "--config"},
                       {"to_s", "--to"},
                       {"warm_up_s", "--warm-up"}};
  std::vector<std::string> differ;
  for (const auto& [key, value] : wanted)
    if (found[key] != value) differ.push_back(words.count(key) ? words.at(key) : key);
  return differ.empty() ? "" : "another " + io::join(differ, ", another ");
}

}  // namespace overtake::evaluation
