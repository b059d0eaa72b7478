// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A value that one thread stores while another loads it, without locks. Each word is whole, but the words of a loaded
// value may be of two stored ones. The loading thread learns that from a counter, which it reads after the words: a
// thread that saw any word of a store also sees what the storing thread wrote to the counter before that store.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace overtake {

template <class T>
class SharedWords {
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(uint64_t) == 0);

 public:
  void store(const T& value) noexcept {
    uint64_t words[kCount];
    std::memcpy(words, &value, sizeof words);
    for (std::size_t i = 0; i < kCount; ++i)
      std::atomic_ref<uint64_t>(words_[i]).store(words[i], std::memory_order_release);
  }
  T load() const noexcept {
    std::array<std::byte, sizeof(T)> bytes;
    for (std::size_t i = 0; i < kCount; ++i) {
      const uint64_t word = load_word(i * sizeof(uint64_t));
      std::memcpy(bytes.data() + i * sizeof word, &word, sizeof word);
    }
    return std::bit_cast<T>(bytes);
  }
  // The 8 bytes at this offset of the value.
  uint64_t load_word(std::size_t offset) const noexcept {
    return std::atomic_ref<uint64_t>(words_[offset / sizeof(uint64_t)]).load(std::memory_order_acquire);
  }

 private:
  static constexpr std::size_t kCount = sizeof(T) / sizeof(uint64_t);
  mutable uint64_t words_[kCount] = {};  // mutable: std::atomic_ref takes no const object
};

}  // namespace overtake
