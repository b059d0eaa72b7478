// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/view/web/pages.h"

namespace overtake::cli {

std::span<const Page> pages() { return {}; }

}  // namespace overtake::cli
