// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/formats.h"

#include <cstdio>
#include <filesystem>

#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

constexpr Format kFormats[] = {
#define OVT_CLOUD_FORMAT(id, name, extension, text) {name, extension, text, &id##_format, nullptr},
#define OVT_BAG_FORMAT(id, name, extension, text) {name, extension, text, nullptr, &id##_format},
#include "tools/io/formats.def"
#undef OVT_CLOUD_FORMAT
#undef OVT_BAG_FORMAT
};

const CloudFormat& cloud_format_of(const std::string& path, const std::string& bytes) {
  if (bytes.empty()) throw Error(path, 0, "is empty (0 bytes)");
  const Format* format = find_format_by_mark(bytes);
  if (!format) format = find_format_by_name(path);
  if (!format) throw Error(path, 0, "has no supported format (" + list_extensions() + ")");
  if (!format->cloud) throw Error(path, 0, "is a recording, " + std::string(format->name) + ", not one cloud");
  return *format->cloud;
}

}  // namespace

bool Format::looks_like(std::string_view head) const {
  const auto mark = cloud ? cloud->looks_like : bag->looks_like;
  return mark && mark(head);
}

std::span<const Format> formats() { return kFormats; }

std::string read_head(const std::string& path) {
  std::string bytes(kHeadBytes, '\0');
  std::error_code code;
  if (!std::filesystem::is_regular_file(path, code)) return "";
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (!file) return "";
  bytes.resize(std::fread(bytes.data(), 1, bytes.size(), file));
  std::fclose(file);
  return bytes;
}

const Format* find_format_by_mark(std::string_view head) {
  for (const Format& format : kFormats)
    if (format.looks_like(head.substr(0, kHeadBytes))) return &format;
  return nullptr;
}

const Format* find_format_by_name(const std::string& path) {
  const std::string name = lower_case(std::filesystem::path(path).filename().string());
  for (const Format& format : kFormats)
    if (name.size() > std::string_view(format.extension).size() && name.ends_with(format.extension)) return &format;
  return nullptr;
}

const Format* find_format(const std::string& path) {
  const Format* format = find_format_by_mark(read_head(path));
  return format ? format : find_format_by_name(path);
}

std::string stem_of(const std::string& path) {
  const std::filesystem::path file(path);
  const Format* format = find_format_by_name(path);
  if (!format) return file.stem().string();
  const std::string name = file.filename().string();
  return name.substr(0, name.size() - std::string_view(format->extension).size());
}

Cloud read_cloud(const std::string& path) {
  const std::string bytes = read_whole_file(path);
  return cloud_format_of(path, bytes).parse(path, bytes);
}

Cloud read_cloud_header(const std::string& path) {
  const std::string bytes = read_whole_file(path);
  return cloud_format_of(path, bytes).parse_header(path, bytes);
}

std::string list_extensions() {
  std::string out;
  for (const Format& format : kFormats) {
    if (!out.empty()) out += &format == &kFormats[std::size(kFormats) - 1] ? " or " : ", ";
    out += format.extension;
  }
  return out;
}

std::string describe_inputs() {
  std::string clouds, bags;
  for (const Format& format : kFormats) {
    std::string& list = format.cloud ? clouds : bags;
    list += (list.empty() ? "" : ", ") + std::string(format.name) + " (" + format.extension + ")";
  }
  return "folder of scans FRAME_SENSOR.EXT or FRAME.EXT, or one such file: " + clouds +
         "; recording with topics, or its folder: " + bags;
}

std::string list_formats() {
  std::string out;
  for (const Format& format : kFormats)
    out += std::string(format.name) + " (" + format.extension + "): " + format.text + "\n";
  return out;
}

}  // namespace overtake::io
