// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The header of a PCD file, line by line.
#pragma once

#include <string>

#include "tools/io/pcd.h"

namespace overtake::io {

// Reads up to and with the DATA line. The sizes it declares are only checked against each other here, not against the
// file: nothing may be allocated from them yet.
PcdHeader parse_pcd_header(const std::string& path_in_errors, const std::string& bytes);

}  // namespace overtake::io
