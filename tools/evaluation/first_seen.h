// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The time until a car is detected: from its first row within -100 to +150 m of a run to the first detection at the
// car; and its distance when its first track was confirmed.
#pragma once

#include <string>
#include <vector>

#include "tools/evaluation/metrics/summary.h"
#include "tools/evaluation/run_logs.h"

namespace overtake::evaluation {

struct FirstSeen {
  metrics::Summary detected_s, confirmed_m;  // one value per car and run; without cars that were never detected
};
FirstSeen first_seen(const std::vector<Run>& runs, const std::string& variant, const std::string& scenario);

}  // namespace overtake::evaluation
