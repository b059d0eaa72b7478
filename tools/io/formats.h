// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The table of file formats of recordings (formats.def). A file is recognised by its first bytes; where they have no
// mark that a format of the table knows, by the extension of its name. To add a format of clouds: X.h, X.cpp with
// `const CloudFormat X_format`, its test, and one line in formats.def.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/io/cloud.h"

namespace overtake::io {

class BagReader;

struct CloudExample {
  std::string bytes;         // of a whole file
  std::size_t header_bytes;  // where the points begin, or a little before
};

// A file that holds one cloud. Readers throw Error.
struct CloudFormat {
  bool (*looks_like)(std::string_view head);  // null: the bytes have no mark, the name alone tells
  Cloud (*parse_header)(const std::string& path_in_errors, const std::string& bytes);  // no columns
  Cloud (*parse)(const std::string& path_in_errors, const std::string& bytes);
  // The cloud in each encoding of the format: what fuzzers start from and tests break.
  std::vector<CloudExample> (*write_examples)(const Cloud& cloud);
};

// A file that holds a recording with topics.
struct BagFormat {
  bool (*looks_like)(std::string_view head);
  std::unique_ptr<BagReader> (*open)(const std::string& path);
  // Null: such files hold no attachments.
  std::optional<std::string> (*read_attached)(const std::string& path, const std::string& name);
};

struct Format {
  const char* name;       // "PCD"
  const char* extension;  // ".pcd"
  const char* text;       // what of it is read
  const CloudFormat* cloud;
  const BagFormat* bag;  // one of these two

  bool looks_like(std::string_view head) const;
};

#define OVT_CLOUD_FORMAT(id, name, extension, text) extern const CloudFormat id##_format;
#define OVT_BAG_FORMAT(id, name, extension, text) extern const BagFormat id##_format;
#include "tools/io/formats.def"
#undef OVT_CLOUD_FORMAT
#undef OVT_BAG_FORMAT

// In the order of formats.def, which is the order in which they are tried.
std::span<const Format> formats();

inline constexpr std::size_t kHeadBytes = 512;  // what looks_like is given, or the whole of a shorter file

std::string read_head(const std::string& path);  // "" where there is no such file, or it cannot be read

// Null: none.
const Format* find_format_by_mark(std::string_view head);
const Format* find_format_by_name(const std::string& path);
const Format* find_format(const std::string& path);  // of a file: by its mark, else by its name

// A file of one cloud in any format of the table. Throw Error.
Cloud read_cloud(const std::string& path);
Cloud read_cloud_header(const std::string& path);  // fields and number of points; no columns

// For error texts and help, from the table:
std::string list_extensions();  // ".pcd, .bin, .db3 or .mcap"
std::string describe_inputs();  // what a recording may be, in one line
std::string list_formats();     // one line a format: its name, its extension, what of it is read

}  // namespace overtake::io
