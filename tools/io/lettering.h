// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Text on pictures: DejaVu Sans, drawn by FreeType. The font is part of the program. Any thread may call.
#pragma once

#include <cstdint>
#include <string_view>

#include "tools/io/image.h"

namespace overtake::io {

// Pixels from the begin of a text to the begin of what follows it. size: of the font, in pixels; capitals have 0.73 of
// it.
int32_t text_width(std::string_view text, int32_t size);

// Draws UTF-8 text; (x, y) is the upper left corner of its capital letters. A byte that is not UTF-8 becomes U+FFFD.
// What lies outside of the picture is left out.
void draw_text(Picture& picture, int32_t x, int32_t y, std::string_view text, Rgb color, int32_t size);

}  // namespace overtake::io
