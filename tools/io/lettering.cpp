// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/lettering.h"

#include <ft2build.h>
#include FT_FREETYPE_H

#include <algorithm>
#include <bit>
#include <map>
#include <mutex>
#include <stdexcept>
#include <utility>
#include <vector>

// The font's bytes (OVT_FONT_FILE, from CMake), in the read-only data of the program.
asm(".pushsection .rodata\n"
    ".balign 16\n"
    ".local ovt_font_begin\n"
    "ovt_font_begin: .incbin \"" OVT_FONT_FILE
    "\"\n"
    ".local ovt_font_end\n"
    "ovt_font_end:\n"
    ".popsection\n");
extern "C" {
extern const unsigned char ovt_font_begin[], ovt_font_end[];
}

namespace overtake::io {
namespace {

constexpr char32_t kReplacement = 0xFFFD;

struct Glyph {
  int32_t left = 0, above = 0;  // of the bitmap: right of the pen, above the base line
  int32_t width = 0, height = 0;
  int32_t advance = 0;  // of the pen, in pixels
  std::vector<uint8_t> cover;
};

class Font {
 public:
  Font() {
    if (FT_Init_FreeType(&library_) != 0 ||
        FT_New_Memory_Face(library_, ovt_font_begin, FT_Long(ovt_font_end - ovt_font_begin), 0, &face_) != 0)
      throw std::runtime_error("FreeType does not read the built-in font");
  }
  const Glyph& glyph(char32_t letter, int32_t size) {
    const auto [at, is_new] = glyphs_.try_emplace({size, letter});
    if (is_new) at->second = render(letter, size);
    return at->second;
  }
  std::mutex mutex;

 private:
  Glyph render(char32_t letter, int32_t size) {
    Glyph out;
    if (FT_Set_Pixel_Sizes(face_, 0, FT_UInt(size)) != 0 || FT_Load_Char(face_, letter, FT_LOAD_RENDER) != 0)
      return out;
    const FT_GlyphSlot slot = face_->glyph;
    out.left = slot->bitmap_left, out.above = slot->bitmap_top;
    out.width = int32_t(slot->bitmap.width), out.height = int32_t(slot->bitmap.rows);
    out.advance = int32_t(slot->advance.x / 64);
    for (int32_t row = 0; row < out.height; ++row) {
      const unsigned char* from = slot->bitmap.buffer + std::ptrdiff_t(row) * slot->bitmap.pitch;
      out.cover.insert(out.cover.end(), from, from + out.width);
    }
    return out;
  }
  FT_Library library_ = nullptr;  // lives as long as the program
  FT_Face face_ = nullptr;
  std::map<std::pair<int32_t, char32_t>, Glyph> glyphs_;
};

Font& font() {
  static Font& font = *new Font;  // not destroyed: a thread may still draw when the program ends
  return font;
}

// Takes the first character off a text.
char32_t take_letter(std::string_view& text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? uint8_t(text[i]) : uint8_t(0); };
  const std::size_t length = std::size_t(std::countl_one(byte(0)));  // 0: ASCII
  char32_t letter = length == 0 ? byte(0) : byte(0) & (0x7F >> length);
  bool is_whole = length == 0 || (length >= 2 && length <= 4);
  for (std::size_t i = 1; is_whole && i < length; ++i) {
    is_whole = (byte(i) & 0xC0) == 0x80;
    letter = letter << 6 | (byte(i) & 0x3F);
  }
  text.remove_prefix(is_whole && length > 0 ? length : 1);
  return is_whole ? letter : kReplacement;
}

template <class Visit>
int32_t walk(std::string_view text, int32_t size, Visit&& visit) {
  int32_t pen = 0;
  while (!text.empty()) {
    const Glyph& glyph = font().glyph(take_letter(text), size);
    visit(glyph, pen);
    pen += glyph.advance;
  }
  return pen;
}

}  // namespace

int32_t text_width(std::string_view text, int32_t size) {
  const std::lock_guard lock(font().mutex);
  return walk(text, size, [](const Glyph&, int32_t) {});
}

void draw_text(Picture& picture, int32_t x, int32_t y, std::string_view text, Rgb color, int32_t size) {
  const std::lock_guard lock(font().mutex);
  const int32_t base = y + font().glyph(U'H', size).above;
  walk(text, size, [&](const Glyph& glyph, int32_t pen) {
    const int32_t left = x + pen + glyph.left, top = base - glyph.above;
    for (int32_t row = std::max(0, -top); row < std::min(glyph.height, picture.height - top); ++row)
      for (int32_t col = std::max(0, -left); col < std::min(glyph.width, picture.width - left); ++col) {
        const int32_t cover = glyph.cover[std::size_t(row * glyph.width + col)];
        Rgb& pixel = picture.at(left + col, top + row);
        for (std::size_t c = 0; c < 3; ++c)
          pixel[c] = uint8_t((pixel[c] * (255 - cover) + color[c] * cover + 127) / 255);
      }
  });
}

}  // namespace overtake::io
