// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The results of info, doctor, params and --version as JSON: one object and a line end, with the facts of the text.
// tools/README.md lists the keys; new versions only add keys. Replaces bytes that are not UTF-8.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/cli/compare_runs.h"
#include "tools/cli/doctor.h"

namespace overtake::cli {

struct RecordingInfo {
  std::string path, kind, damage, partial;  // partial: why it ends early, "" if it is complete
  int64_t first_ns = 0, last_ns = -1;       // of the log; last before first: no message, or a folder of scans
  struct Topic {
    std::string name, type, frame, layout;
    int64_t messages = 0, points = 0, undecoded = 0;  // points: of all clouds
    double rate_hz = 0;                               // NaN: of fewer than two messages
    uint64_t bytes = 0;
  };
  std::vector<Topic> topics;
  struct Scans {  // of one sensor in a folder
    std::string name, first_file, fields;
    int64_t files = 0, points = 0;  // points: of the first file
  };
  std::vector<Scans> scans;
};

std::string info_json(const RecordingInfo& info);
std::string doctor_json(const std::string& input, const std::string& rig, const std::vector<Finding>& findings);
std::string version_json(const ovt_build_info& build);  // without a line end
std::string params_json(const std::string& preset);
std::string compare_json(const std::string& a, const std::string& b, const RunComparison& comparison);

}  // namespace overtake::cli
