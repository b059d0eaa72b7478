// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The table of recording formats (formats.def). A file's first bytes determine its format; if no format recognises
// them, the extension does. To add a cloud format, write X.h, X.cpp with `const CloudFormat X_format`, its test, and
// one line in formats.def.
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
  bool (*looks_like)(std::string_view head);  // null: no mark; only the extension identifies files
  Cloud (*parse_header)(const std::string& path_in_errors, const std::string& bytes);  // no columns
  Cloud (*parse)(const std::string& path_in_errors, const std::string& bytes);
  // Writes the cloud in each encoding of the format: seeds of fuzzers, and files that tests damage.
  std::vector<CloudExample> (*write_examples)(const Cloud& cloud);
};

// A file that holds a recording with topics.
struct BagFormat {
  bool (*looks_like)(std::string_view head);
  std::unique_ptr<BagReader> (*open)(const std::string& path);
  // Null: the format has no attachments.
  std::optional<std::string> (*read_attached)(const std::string& path, const std::string& name);
};

struct Format {
  const char* name;       // "PCD"
  const char* extension;  // ".pcd"
  const char* text;       // supported content
  const CloudFormat* cloud;
  const BagFormat* bag;  // either this or cloud is null

  bool looks_like(std::string_view head) const;
};

#define OVT_CLOUD_FORMAT(id, name, extension, text) extern const CloudFormat id##_format;
#define OVT_BAG_FORMAT(id, name, extension, text) extern const BagFormat id##_format;
#include "tools/io/formats.def"
#undef OVT_CLOUD_FORMAT
#undef OVT_BAG_FORMAT

// In the order of formats.def; the search tries them in this order.
std::span<const Format> formats();

inline constexpr std::size_t kHeadBytes = 512;  // most bytes that looks_like gets

std::string read_head(const std::string& path);  // "" if the file is missing or unreadable

// Null: none.
const Format* find_format_by_mark(std::string_view head);
const Format* find_format_by_name(const std::string& path);
const Format* find_format(const std::string& path);  // by the file's mark, else by its name
std::string stem_of(const std::string& path);        // the file's name without folder and extension of its format

// Reads a file with one cloud in any format of the table. Both throw Error.
Cloud read_cloud(const std::string& path);
Cloud read_cloud_header(const std::string& path);  // fields and number of points; no columns

// For error texts and help, from the table:
std::string list_extensions();  // ".pcd, .pcd.bin, .bin, .ply, .db3 or .mcap"
std::string describe_inputs();  // the accepted kinds of recordings, in one line
std::string list_formats();     // one line per format: name, extension, supported content

}  // namespace overtake::io
