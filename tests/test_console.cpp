// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/client/console.h"

#include <doctest/doctest.h>

using overtake::cli::printable;
using overtake::cli::TextTable;

TEST_CASE("printable: control sequences become text, other characters stay") {
  for (const char* text : {"", "/front/points", "a b\"c\\d", "M\xc3\xbcnchen", "\xe2\x82\xac 5", "\xf0\x9f\x8f\x8e"})
    CHECK(printable(text) == text);
  CHECK(printable("\x1b[2J") == "\\x1b[2J");
  CHECK(printable("a\nb\r\tc\x7f") == "a\\x0ab\\x0d\\x09c\\x7f");
  CHECK(printable(std::string_view("a\0b", 3)) == "a\\x00b");
  CHECK(printable("\xc2\x9b"
                  "31m") == "\\x9b31m");  // C1: the sequence introducer as one character
  CHECK(printable("\x9b"
                  "31m") == "\\x9b31m");                        // and as a byte
  CHECK(printable("\xe2\x80\xaegnp.exe") == "\\u202egnp.exe");  // right to left
  CHECK(printable("\xc3") == "\\xc3");                          // truncated
  CHECK(printable("\xc0\x9b") == "\\xc0\\x9b");                 // an overlong form
  CHECK(printable("\xe0\x80\x9b") == "\\xe0\\x80\\x9b");
  CHECK(printable("\xed\xa0\x80") == "\\xed\\xa0\\x80");  // half of a surrogate pair
  CHECK(printable("\xf5\x80\x80\x80") == "\\xf5\\x80\\x80\\x80");
}

TEST_CASE("printable: no sequence of three bytes lets a control character through") {
  for (uint32_t code = 0; code < 1u << 24; code += 7) {  // 7 and 2^24 share no factor: every byte occurs at every place
    const char bytes[] = {char(code >> 16), char(code >> 8), char(code)};
    const std::string out = printable(std::string_view(bytes, 3));
    bool fine = true;
    for (std::size_t i = 0; i < out.size(); ++i) {
      const auto c = static_cast<unsigned char>(out[i]);
      fine = fine && c >= 0x20 && c != 0x7f && !(c == 0xc2 && static_cast<unsigned char>(out[i + 1]) < 0xa0);
    }
    if (!fine) FAIL(code);
  }
}

TEST_CASE("table: cells are printable and as wide as their printed text") {
  TextTable table({"topic", "type"});
  table.add({"/a\x1b[2J", "b"});
  CHECK(table.format() == "  topic      type\n  /a\\x1b[2J  b\n");
}
