// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Where the opponent is known to be: FRAME_box.txt beside the scans, one line "x y z length width height yaw" (centre,
// metres, radians, vehicle frame). Only shown to people, never read by the method.
#pragma once

#include <optional>

#include "tools/io/recording.h"

namespace overtake::io {

// Nothing where there is no such file. Throws Error where it is no box.
std::optional<Box> read_box_beside(const FrameScans& frame);

}  // namespace overtake::io
