// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The known position of the opponent: FRAME_box.txt beside the scans, one line "x y z length width height yaw" (centre,
// metres, radians, vehicle frame). Only shown to users, never read by the method.
#pragma once

#include <optional>

#include "tools/io/recording.h"

namespace overtake::io {

// Nothing if the file does not exist. Throws Error if it is not a box.
std::optional<Box> read_box_beside(const FrameScans& frame);

}  // namespace overtake::io
