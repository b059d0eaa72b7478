// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Recorded data for tests: $OVERTAKE_DATA, else ./recordings beside the sources (tests run in the source folder).
//
//   TEST_CASE("...") {
//     OVT_NEED_RECORDED("lvms/lvms_inner_bound.csv");       // or the case says "skipped: ... is not there" and ends
//     read(recorded("lvms/lvms_inner_bound.csv"));
#pragma once

#include <doctest/doctest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace overtake {

inline const char* recorded_dir() {
  const char* from_user = std::getenv("OVERTAKE_DATA");
  return from_user && *from_user ? from_user : "recordings";
}

inline std::string recorded(const std::string& file) { return std::string(recorded_dir()) + "/" + file; }

inline bool is_recorded(const std::string& file) {
  std::error_code code;
  return std::filesystem::exists(recorded(file), code);
}

}  // namespace overtake

#define OVT_WHERE_TO_GET " (tools/README.md, \"Recorded data\", says where to get it)"

// Put it at the start of a case, once per file or folder; it ends the case if the file is missing.
#define OVT_NEED_RECORDED(file)                                                         \
  do {                                                                                  \
    if (!overtake::is_recorded(file)) {                                                 \
      MESSAGE("skipped: " << std::string(file) << " is not there" << OVT_WHERE_TO_GET); \
      return;                                                                           \
    }                                                                                   \
  } while (false)
