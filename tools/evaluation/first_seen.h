// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// How long a car is there before it is detected: from its first row within -100 to +150 m of a run to the first
// detection at it, and how far it was when its first track was confirmed.
#pragma once

#include <string>
#include <vector>

#include "tools/evaluation/metrics/summary.h"
#include "tools/evaluation/run_logs.h"

namespace overtake::evaluation {

struct FirstSeen {
  metrics::Summary detected_s, confirmed_m;  // a value a car and run; cars never detected have none
};
FirstSeen first_seen(const std::vector<Run>& runs, const std::string& contestant, const std::string& scenario);

}  // namespace overtake::evaluation
