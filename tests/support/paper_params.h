// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What the preset `paper` gives the kernels, for cases that are about its values: a kernel has no defaults of its own.
#pragma once

#include "pipeline/params.h"

namespace overtake::test {

inline SegmentParams paper_params(const SensorModel& sensor = {}) {
  return make_segment_params(ovt_default_params(), sensor);
}
inline DetectParams paper_frame_params() { return make_detect_params(ovt_default_params()); }

}  // namespace overtake::test
