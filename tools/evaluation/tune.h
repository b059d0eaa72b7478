// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Tunes the parameters of the methods for comparison with the truth of logs of the tune seeds: the 2.5-D grid and the
// automatic labelling.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace overtake::evaluation {

// Tries every value of a small table on every N-th frame and writes OUT/tuning.csv: mean F1, TPR and PPV over the
// scans, by surface truth. `print`: prints the best ones. Throws io::Error. Returns a sentence for each damaged log.
std::vector<std::string> tune_baselines(const std::vector<std::string>& logs, int32_t every, int64_t most_frames,
                                        int32_t workers, const std::string& out, bool print);

}  // namespace overtake::evaluation
