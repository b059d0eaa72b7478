// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Reads a fuzzer's input as decisions. After its end every decision is zero, so any input is a complete test.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

namespace overtake::fuzz {

class Bytes {
 public:
  Bytes(const uint8_t* data, std::size_t size) : at_(data), end_(data + size) {}

  bool empty() const { return at_ == end_; }
  std::size_t left() const { return std::size_t(end_ - at_); }

  template <class T>
  T raw() {
    T value{};
    const std::size_t n = left() < sizeof value ? left() : sizeof value;
    if (n > 0) std::memcpy(&value, at_, n);
    at_ += n;
    return value;
  }
  uint8_t byte() { return raw<uint8_t>(); }
  // A number from low to high, both included; uses one byte if that is enough.
  int32_t in(int32_t low, int32_t high) {
    const auto choices = uint32_t(high - low + 1);
    return low + int32_t((choices <= 256 ? byte() : raw<uint32_t>()) % choices);
  }
  bool chance(int32_t of_256) { return byte() < of_256; }

  std::string_view rest() const { return {reinterpret_cast<const char*>(at_), left()}; }

 private:
  const uint8_t *at_, *end_;
};

// A stamp: mostly a few ms later, sometimes the same again, far away, or at an end of int64.
inline int64_t next_stamp(Bytes& in, int64_t stamp_ns) {
  constexpr int64_t kMs = 1'000'000;
  const auto add = [&](int64_t delta) {
    int64_t out;
    return __builtin_add_overflow(stamp_ns, delta, &out) ? (delta > 0 ? INT64_MAX : INT64_MIN) : out;
  };
  switch (in.byte() % 16) {
    case 0: return stamp_ns;
    case 1: return add(-in.in(1, 255) * kMs);
    case 2: return add(in.in(200, 1000) * kMs);
    case 3: return add(-in.in(400, 3000) * kMs);
    case 4: return in.raw<int64_t>();
    case 5: return in.chance(128) ? INT64_MAX - in.byte() : INT64_MIN + in.byte();
    case 6: return add(in.in(-2, 2));
    case 7: return 0;
    default: return add(in.in(0, 60) * kMs);
  }
}

// A property that a target must have. If it fails, the run ends with the condition, and the fuzzer keeps the input.
#define OVT_FUZZ_REQUIRE(condition)                                                \
  do {                                                                             \
    if (!(condition)) {                                                            \
      std::fprintf(stderr, "%s:%d: broken: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                \
    }                                                                              \
  } while (0)

}  // namespace overtake::fuzz
