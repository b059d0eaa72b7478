// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// HOTA (Luiten et al. 2021): detection and association of a whole run in one number. The similarity of two positions at
// a distance d is 1 - d / zero_m (0 beyond). For thresholds alpha = 0.05, 0.10, ... 0.95:
//     TP   pairs with a similarity of alpha or more; FN objects and FP tracks without a partner
//     A(c) of a TP c: frames in which its object and its track are a pair, over frames in which either exists
//     HOTA = sqrt(DetA AssA),   DetA = TP / (TP + FN + FP),   AssA = mean of A(c) over the TPs
// and the mean over alpha. The pairs of a frame maximise the sum of similarities, each weighted by how well its two ids
// fit over the whole run. LocA is the mean similarity of the pairs, over the thresholds with a pair (TrackEval counts
// one without a pair as 1).
#pragma once

#include <cstdint>
#include <vector>

#include "tools/evaluation/metrics/clear_mot.h"

namespace overtake::metrics {

struct HotaResult {
  double hota = 0, detection = 0, association = 0, localisation = 0;  // means over alpha; NaN: neither object nor track
  std::vector<double> hota_of_alpha;                                  // 19
};

class Hota {
 public:
  explicit Hota(double zero_m = 2.0) : zero_m_(zero_m) {}
  void add_frame(const std::vector<MotPlace>& objects, const std::vector<MotPlace>& tracks) {
    frames_.push_back({objects, tracks});
  }
  HotaResult result() const;

 private:
  struct Frame {
    std::vector<MotPlace> objects, tracks;
  };
  double zero_m_;
  std::vector<Frame> frames_;
};

}  // namespace overtake::metrics
