// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/method/count_reasons.h"

#include <algorithm>
#include <cstring>

namespace overtake {

// Sixteen points at a time, with one counter per reason and lane. A plain histogram cost 1/6 of the segmentation;
// testing eight points at once for any reason cost 1/16.
void count_reasons(const PointTable& points, int32_t* count) noexcept {
  static_assert(int32_t(Reason::kLabelled) == 0);
  using Bytes = uint8_t __attribute__((vector_size(16)));
  constexpr int32_t kLanes = 16, kBlock = 255 * kLanes;  // a lane counts to 255
  const int32_t whole = points.count / kLanes * kLanes;
  std::fill_n(count, kReasonCount, 0);
  for (int32_t begin = 0; begin < whole; begin += kBlock) {
    Bytes tally[kReasonCount] = {};
    for (int32_t i = begin; i < std::min(begin + kBlock, whole); i += kLanes) {
      Bytes reasons;
      std::memcpy(&reasons, points.reason + i, sizeof reasons);
      for (int32_t k = 1; k < kReasonCount; ++k) tally[k] -= Bytes(reasons == uint8_t(k));  // true is -1
    }
    for (int32_t k = 1; k < kReasonCount; ++k)
      for (int32_t lane = 0; lane < kLanes; ++lane) count[k] += tally[k][lane];
  }
  for (int32_t i = whole; i < points.count; ++i)
    if (points.reason[i] != 0) ++count[points.reason[i]];
  int32_t without = 0;
  for (int32_t k = 1; k < kReasonCount; ++k) without += count[k];
  count[0] = points.count - without;
}

}  // namespace overtake
