// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A temporary folder for a test case's files, removed at the end of the case.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <string>

#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake {

class TempFolder {
 public:
  TempFolder() {
    static int32_t made = 0;
    folder_ = std::filesystem::temp_directory_path() /
              ("overtake_" + std::to_string(getpid()) + "_" + std::to_string(made++));
    std::filesystem::create_directories(folder_);
  }
  ~TempFolder() {
    std::error_code code;
    std::filesystem::remove_all(folder_, code);
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;

  std::string path(const std::string& name = "") const {
    return name.empty() ? folder_.string() : (folder_ / name).string();
  }
  std::string write(const std::string& name, std::string_view text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    io::write_whole_file(path(name), text);
    return path(name);
  }

 private:
  std::filesystem::path folder_;
};

// what() of the io::Error that f throws; "" if it throws none. Other exceptions pass through.
template <class F>
std::string error_of(F&& f) {
  try {
    f();
  } catch (const io::Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace overtake
