// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The kernel parameters of the preset `paper`, for tests that depend on its values: kernels have no defaults.
#pragma once

#include "pipeline/params.h"

namespace overtake::test {

inline SegmentParams paper_params(const SensorModel& sensor = {}) {
  return make_segment_params(ovt_default_params(), sensor);
}
inline DetectParams paper_frame_params() { return make_detect_params(ovt_default_params()); }

}  // namespace overtake::test
