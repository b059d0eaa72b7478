// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "core/point_table.h"

namespace overtake {

const char* reason_name(Reason reason) noexcept {
  switch (reason) {  // no default: the compiler then reports a reason without a name
    case Reason::kLabelled: return "labelled";
    case Reason::kNotFinite: return "not_finite";
    case Reason::kZeroRange: return "zero_range";
    case Reason::kRangeLimit: return "range_limit";
    case Reason::kBadLayer: return "bad_layer";
    case Reason::kOutsideAzimuth: return "outside_azimuth";
    case Reason::kLayerDropped: return "layer_dropped";
    case Reason::kDust: return "dust";
    case Reason::kSecondReturn: return "second_return";
    case Reason::kSmoke: return "smoke";
    case Reason::kOwnBody: return "own_body";
    case Reason::kCount: break;
  }
  return "unknown";
}

}  // namespace overtake
