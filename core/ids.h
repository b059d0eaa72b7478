// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ids of objects that live longer than a frame (tracks): slot in the low 32 bits, generation in the high 32. A slot's
// generation starts at 1 and grows with each use of the slot, so 0 means "none" and no id is used twice.
#pragma once

#include <cstdint>

namespace overtake {

using TrackId = uint64_t;
inline constexpr TrackId kNobody = 0;

constexpr TrackId make_track_id(uint32_t slot, uint32_t generation) { return uint64_t(generation) << 32 | slot; }
constexpr uint32_t slot_of(TrackId id) { return uint32_t(id); }
constexpr uint32_t generation_of(TrackId id) { return uint32_t(id >> 32); }

}  // namespace overtake
