// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/method/mark_smoke.h"

#include <bit>
#include <cstring>

namespace overtake {
namespace {

// Bit k is byte k, of 64 bytes that are 0 or 1.
uint64_t pack_bytes(const uint8_t* at) {
  static_assert(std::endian::native == std::endian::little);
  uint64_t bits = 0;
  for (int32_t k = 0; k < 64; k += 8) {
    uint64_t bytes;
    std::memcpy(&bytes, at + k, sizeof bytes);
    bits |= (bytes * 0x0102040810204080u >> 56) << k;
  }
  return bits;
}

}  // namespace

void mark_smoke(ConstBitPlane smoke, Plane<const int32_t> pixel_point, PointTable& points) noexcept {
  const auto mark = [&](int32_t i) {
    if (Reason(points.reason[i]) != Reason::kLabelled) return;
    points.label[i] = kLabelNone;
    points.reason[i] = uint8_t(Reason::kSmoke);
  };
  bool any = false;
  for (int32_t r = 0; r < smoke.rows; ++r)
    for (int32_t w = 0; w < smoke.words_per_row; ++w)
      for (uint64_t left = smoke.row(r)[w]; left != 0; left &= left - 1) {
        const int32_t point = pixel_point.row(r)[64 * w + std::countr_zero(left)];
        any = true;
        if (point != kNoPoint) mark(point);
      }
  if (!any) return;
  const auto mark_loser = [&](int32_t i) {
    if (points.pixel[i] < 0) return;
    const int32_t winner = pixel_point.data[points.pixel[i]];  // always labelled, so it has a new reason now
    if (winner != kNoPoint && Reason(points.reason[winner]) == Reason::kSmoke) mark(i);
  };
  int32_t i = 0;
  for (; i + 64 <= points.count; i += 64)  // a few percent lost their pixels
    for (uint64_t left = pack_bytes(points.lost + i); left != 0; left &= left - 1)
      mark_loser(i + std::countr_zero(left));
  for (; i < points.count; ++i)
    if (points.lost[i] != 0) mark_loser(i);
}

}  // namespace overtake
