// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/method/step.h"

namespace overtake {

const char* column_name(Column column) noexcept {
  constexpr const char* kName[] = {
#define OVT_SEGMENT_COLUMN(name, view, extent) #name,
#include "pipeline/method/segment_columns.def"
#undef OVT_SEGMENT_COLUMN
  };
  return kName[int32_t(column)];
}

}  // namespace overtake
