// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Writes and reads little-endian values in byte strings. For little-endian machines.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace overtake::io {

template <class T>
void append_value(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

// uint32 length, then the bytes.
inline void append_text(std::string& bytes, std::string_view text) {
  append_value(bytes, uint32_t(text.size()));
  bytes.append(text);
}

// Reads values from the front of a view. Beyond the end, values are 0 and ok() is false: check ok() once, after the
// last value of a record.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

  template <class T>
  T value() {
    T out{};
    const std::string_view raw = take(sizeof(T));
    if (raw.size() == sizeof(T)) std::memcpy(&out, raw.data(), sizeof(T));
    return out;
  }
  std::string_view take(uint64_t size) {
    if (size > rest_.size()) {
      ok_ = false;
      rest_ = {};
      return {};
    }
    const std::string_view out = rest_.substr(0, std::size_t(size));
    rest_.remove_prefix(std::size_t(size));
    return out;
  }
  std::string_view text() { return take(value<uint32_t>()); }
  std::string_view rest() const { return rest_; }
  bool empty() const { return rest_.empty(); }
  bool ok() const { return ok_; }

 private:
  std::string_view rest_;
  bool ok_ = true;
};

}  // namespace overtake::io
