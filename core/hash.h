// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// 64-bit FNV-1a over bytes: for golden hashes of outputs, not for security. Same value on every little-endian machine.
#pragma once

#include <cstddef>
#include <cstdint>

namespace overtake {

class Hash {
 public:
  explicit Hash(uint64_t seed = 0xcbf29ce484222325u) : state_(seed) {}
  void add_bytes(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) state_ = (state_ ^ bytes[i]) * 0x100000001b3u;
  }
  template <class T>
  void add_value(T value) {
    add_bytes(&value, sizeof value);
  }
  void add_text(const char* text) {
    for (; *text; ++text) add_value(*text);
  }
  uint64_t value() const { return state_; }

 private:
  uint64_t state_;
};

}  // namespace overtake
