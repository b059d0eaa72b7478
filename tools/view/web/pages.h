// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The viewer's pages, embedded.
#pragma once

#include <cstddef>
#include <span>

namespace overtake::cli {

struct Page {
  const char* path;           // "/index.html"
  const char* mime;           // "text/html; charset=utf-8"
  const unsigned char* gzip;  // its bytes, compressed
  std::size_t size;
};
// Empty: built without node.
std::span<const Page> pages();

}  // namespace overtake::cli
