// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The floating-point mode of the thread under way: rounding, traps, and what becomes of subnormal numbers.
#pragma once

#include <cstdint>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace overtake {

// As long as it exists, the thread computes as every program does at its start: it rounds to nearest, keeps subnormals
// and traps nothing. A caller may have chosen otherwise; its mode comes back at the end.
class FloatMode {
 public:
  FloatMode() : before_(read()) {
    if (control(before_) != kUsual) write(kUsual);
  }
  ~FloatMode() {
    if (control(before_) != control(read())) write(before_);
  }
  FloatMode(const FloatMode&) = delete;
  FloatMode& operator=(const FloatMode&) = delete;

 private:
#if defined(__x86_64__)  // MXCSR; the data path does not use the x87
  using Word = uint32_t;
  static constexpr Word kUsual = 0x1f80, kFlags = 0x3f;  // the flags tell what has happened, and change nothing
  static Word read() { return _mm_getcsr(); }
  static void write(Word word) { _mm_setcsr(word); }
  static Word control(Word word) { return word & ~kFlags; }
#elif defined(__aarch64__)  // FPCR; its flags are in another register
  using Word = uint64_t;
  static constexpr Word kUsual = 0;
  static Word read() {
    Word word;
    __asm__ volatile("mrs %0, fpcr" : "=r"(word)::"memory");
    return word;
  }
  static void write(Word word) { __asm__ volatile("msr fpcr, %0" ::"r"(word) : "memory"); }
  static Word control(Word word) { return word; }
#else
#error "the floating-point mode of this processor is not known"
#endif

  const Word before_;
};

}  // namespace overtake
