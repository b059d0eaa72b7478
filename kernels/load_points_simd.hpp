// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Copies the caller's layout to columns. Handles the types that sensors and PointCloud2 use, without a
// conversion to double (all their values are exact either way). A scan with any other type goes to the reference.
//
//   columns    read in place
//   records    | x y z i | r - t - |   one or two windows of 16 bytes per record, transposed to columns, kSize records
//                                      at a time. A window may reach into the next record: the last one is read alone
//   others     gathered value by value
#pragma once

#include <cfloat>
#include <cstring>
#include <limits>

#include "kernels/load_points.h"
#include "kernels/simd.h"

namespace overtake::simd {

// How a field's bits are converted.
enum class FieldKind : int32_t {
  kAbsentFloat,
  kAbsentInt,
  kCoordinate,
  kIntensityFloat,
  kIntensityInteger,
  kLayerFloat,
  kLayerInteger,
  kLayerNarrow,
  kTimeFloat,
  kTimeInt32,
  kTimeUint32
};
enum class FieldUse : int32_t { kCoordinate, kIntensity, kLayer, kTime };

struct FieldPlan {
  const char* data = nullptr;
  std::ptrdiff_t stride = 0;
  int32_t bytes = 0;  // of a value; 0: field absent
  FieldKind kind = FieldKind::kAbsentFloat;
  float* out_float = nullptr;
  int32_t* out_int = nullptr;
  int32_t word = -1, shift = 0;  // place of the value in a window

  // The value's bits, zero-extended.
  OVT_INLINE int32_t bits_at(int32_t i) const {
    if (bytes == 0) return 0;  // data may be null
    const char* at = data + std::ptrdiff_t(i) * stride;
    uint32_t value = 0;
    if (bytes == 4) {
      std::memcpy(&value, at, 4);
    } else if (bytes == 2) {
      std::memcpy(&value, at, 2);
    } else {
      std::memcpy(&value, at, 1);
    }
    return int32_t(value);
  }
};

// False if the field has none of the types below.
OVT_INLINE bool plan_field(const PointField& field, FieldUse use, double unit_ns, float* out_float, int32_t* out_int,
                           FieldPlan& plan) {
  plan.data = static_cast<const char*>(field.data);
  plan.stride = field.stride;
  plan.out_float = out_float;
  plan.out_int = out_int;
  plan.kind = out_float ? FieldKind::kAbsentFloat : FieldKind::kAbsentInt;
  switch (field.type) {
    case FieldType::kNone: return true;
    case FieldType::kFloat32:
      plan.bytes = 4;
      plan.kind = use == FieldUse::kCoordinate  ? FieldKind::kCoordinate
                  : use == FieldUse::kIntensity ? FieldKind::kIntensityFloat
                  : use == FieldUse::kLayer     ? FieldKind::kLayerFloat
                                                : FieldKind::kTimeFloat;
      return true;
    case FieldType::kUint8:
    case FieldType::kUint16:
      plan.bytes = field.type == FieldType::kUint8 ? 1 : 2;
      plan.kind = use == FieldUse::kIntensity ? FieldKind::kIntensityInteger : FieldKind::kLayerNarrow;
      return use == FieldUse::kIntensity || use == FieldUse::kLayer;
    case FieldType::kInt32:
    case FieldType::kUint32:
      plan.bytes = 4;
      plan.kind = use == FieldUse::kLayer           ? FieldKind::kLayerInteger
                  : field.type == FieldType::kInt32 ? FieldKind::kTimeInt32
                                                    : FieldKind::kTimeUint32;
      return use == FieldUse::kLayer || (use == FieldUse::kTime && unit_ns == 1.0);
    default: return false;
  }
}

// kSize values of one field, as zero-extended bits, to rows i, i + 1, ... The rules are those of the reference.
template <FieldKind kKind, class A>
OVT_INLINE void store_field(const FieldPlan& plan, Int<A> bits, double unit_ns, int32_t i) {
  constexpr int32_t kLimit = std::numeric_limits<int32_t>::max();
  const Float<A> value = float_of_bits(bits);
  const Mask<A> number = value == value;
  // Subnormal, -0 and NaN to +0.
  const Float<A> plain = keep(abs_of(value) >= Float<A>(FLT_MIN), value);
  if constexpr (kKind == FieldKind::kAbsentFloat) {
    Float<A>(0.0f).store(plan.out_float + i);
  } else if constexpr (kKind == FieldKind::kCoordinate) {
    select(number, plain, Float<A>(std::numeric_limits<float>::quiet_NaN())).store(plan.out_float + i);
  } else if constexpr (kKind == FieldKind::kIntensityFloat) {
    plain.store(plan.out_float + i);
  } else if constexpr (kKind == FieldKind::kIntensityInteger) {
    to_float(bits).store(plan.out_float + i);
  } else if constexpr (kKind == FieldKind::kLayerFloat) {
    const Mask<A> fits = (value >= Float<A>(0.0f)) & (value <= Float<A>(65535.0f));
    const Int<A> layer = to_int(keep(fits, value));
    select(fits & (to_float(layer) == value), layer, Int<A>(kNoLayer)).store(plan.out_int + i);
  } else if constexpr (kKind == FieldKind::kLayerInteger) {
    select((bits > Int<A>(-1)) & (bits < Int<A>(65536)), bits, Int<A>(kNoLayer)).store(plan.out_int + i);
  } else if constexpr (kKind == FieldKind::kTimeFloat) {
    const Int<A> offset = scale_to_int(value, unit_ns);
    select(number & (offset > Int<A>(-kLimit)) & (offset < Int<A>(kLimit)), offset, Int<A>(0)).store(plan.out_int + i);
  } else if constexpr (kKind == FieldKind::kTimeInt32) {
    select((bits > Int<A>(-kLimit)) & (bits < Int<A>(kLimit)), bits, Int<A>(0)).store(plan.out_int + i);
  } else if constexpr (kKind == FieldKind::kTimeUint32) {
    select((bits > Int<A>(-1)) & (bits < Int<A>(kLimit)), bits, Int<A>(0)).store(plan.out_int + i);
  } else {  // kLayerNarrow, kAbsentInt
    bits.store(plan.out_int + i);
  }
}

// Rows [begin, end), whole vectors, from read(row). Tests the kind once, outside the loop.
template <class A, class Read>
OVT_INLINE void store_rows(const FieldPlan& plan, double unit_ns, int32_t begin, int32_t end, Read&& read) {
  const FieldPlan own = plan;  // a local copy: the compiler then knows that no store changes it
  switch (own.kind) {
#define OVT_STORE(name)                                                                                     \
  case FieldKind::name:                                                                                     \
    for (int32_t i = begin; i < end; i += kSize<A>) store_field<FieldKind::name>(own, read(i), unit_ns, i); \
    return;
    OVT_STORE(kAbsentFloat)
    OVT_STORE(kAbsentInt)
    OVT_STORE(kCoordinate)
    OVT_STORE(kIntensityFloat)
    OVT_STORE(kIntensityInteger)
    OVT_STORE(kLayerFloat)
    OVT_STORE(kLayerInteger)
    OVT_STORE(kLayerNarrow)
    OVT_STORE(kTimeFloat)
    OVT_STORE(kTimeInt32)
    OVT_STORE(kTimeUint32)
#undef OVT_STORE
  }
}

// Rows [begin, count) value by value.
template <class A>
OVT_INLINE void load_gathered(const FieldPlan& plan, double unit_ns, int32_t begin, int32_t count) {
  store_rows<A>(plan, unit_ns, begin, count, [&](int32_t i) OVT_INLINED {
    int32_t bits[kSize<A>] = {};
    for (int32_t l = 0; l < kSize<A> && i + l < count; ++l) bits[l] = plan.bits_at(i + l);
    return Int<A>::load(bits);
  });
}

// A field stored as a separate column; returns the first row not loaded.
template <class A>
OVT_INLINE int32_t load_column(const FieldPlan& plan, double unit_ns, int32_t count) {
  if (plan.stride != plan.bytes) return 0;
  const int32_t end = count / kSize<A> * kSize<A>;
  const char* data = plan.data;
  if (plan.bytes == 4)
    store_rows<A>(plan, unit_ns, 0, end,
                  [=](int32_t i) OVT_INLINED { return Int<A>::load(reinterpret_cast<const int32_t*>(data) + i); });
  else if (plan.bytes == 2)
    store_rows<A>(plan, unit_ns, 0, end,
                  [=](int32_t i) OVT_INLINED { return load_words<A>(reinterpret_cast<const uint16_t*>(data) + i); });
  else
    store_rows<A>(plan, unit_ns, 0, end,
                  [=](int32_t i) OVT_INLINED { return load_bytes<A>(reinterpret_cast<const uint8_t*>(data) + i); });
  return end;
}

inline constexpr int32_t kFieldCount = 6, kWindowBytes = 16;

// The plans whose value lies within one word of `window`.
OVT_INLINE int32_t find_in_window(FieldPlan* plans, const char* window, std::ptrdiff_t stride, FieldPlan** found) {
  int32_t count = 0;
  for (int32_t f = 0; f < kFieldCount; ++f) {
    FieldPlan& plan = plans[f];
    if (plan.bytes == 0 || plan.stride != stride || plan.word >= 0 || plan.data < window) continue;
    const std::ptrdiff_t offset = plan.data - window;
    if (offset >= kWindowBytes || offset % 4 + plan.bytes > 4) continue;
    plan.word = int32_t(offset / 4);
    plan.shift = int32_t(offset % 4) * 8;
    found[count++] = &plan;
  }
  return count;
}

// True for the window of nearly every sensor: x, y, z and intensity in this order.
OVT_INLINE bool is_xyzi(FieldPlan* const* found, int32_t found_count) {
  if (found_count != 4) return false;
  for (int32_t f = 0; f < 4; ++f)
    if (found[f]->word != f || found[f]->kind != (f < 3 ? FieldKind::kCoordinate : FieldKind::kIntensityFloat))
      return false;
  return true;
}

// One window of a record, and the fields in the window.
struct RecordWindow {
  const char* data = nullptr;  // address in record 0
  FieldPlan* found[kFieldCount] = {};
  int32_t found_count = 0;
};

// Records [begin, end), whole vectors, at most kRecordBlock. Writes the columns directly, or copies the window's words
// to a buffer in L1 and converts from there field by field.
inline constexpr int32_t kRecordBlock = 512;

template <class A>
OVT_INLINE void load_window(const RecordWindow& window, std::ptrdiff_t stride, double unit_ns, int32_t begin,
                            int32_t end) {
  FieldPlan* const* found = window.found;
  const char* data = window.data;
  if (is_xyzi(found, window.found_count)) {
    const FieldPlan x = *found[0], y = *found[1], z = *found[2], intensity = *found[3];
    for (int32_t i = begin; i < end; i += kSize<A>) {
      Int<A> word[4];
      load_records(data + std::ptrdiff_t(i) * stride, stride, word[0], word[1], word[2], word[3]);
      store_field<FieldKind::kCoordinate>(x, word[0], unit_ns, i);
      store_field<FieldKind::kCoordinate>(y, word[1], unit_ns, i);
      store_field<FieldKind::kCoordinate>(z, word[2], unit_ns, i);
      store_field<FieldKind::kIntensityFloat>(intensity, word[3], unit_ns, i);
    }
    return;
  }
  alignas(64) int32_t words[4][kRecordBlock];
  int32_t used = 0;
  for (int32_t f = 0; f < window.found_count; ++f) used |= 1 << found[f]->word;
  for (int32_t i = begin; i < end; i += kSize<A>) {
    Int<A> word[4];
    load_records(data + std::ptrdiff_t(i) * stride, stride, word[0], word[1], word[2], word[3]);
    for (int32_t w = 0; w < 4; ++w)
      if (used >> w & 1) word[w].store(words[w] + (i - begin));
  }
  for (int32_t f = 0; f < window.found_count; ++f) {
    const int32_t* word = words[found[f]->word];
    const int32_t shift = found[f]->shift;
    const Int<A> own(found[f]->bytes == 4 ? -1 : found[f]->bytes == 2 ? 0xffff : 0xff);
    store_rows<A>(*found[f], unit_ns, begin, end,
                  [=](int32_t i) OVT_INLINED { return (Int<A>::load(word + (i - begin)) >> shift) & own; });
  }
}

// The fields that share x's stride as records, block by block, so that the second window finds the records in L1. Reads
// nothing before the first value and nothing after the first word of the last record's first value.
template <class A>
OVT_INLINE void load_windows(FieldPlan* plans, double unit_ns, int32_t count) {
  const std::ptrdiff_t stride = plans[0].stride;
  if (plans[0].bytes == 0 || stride < kWindowBytes - 4) return;
  const char* first = plans[0].data;
  for (int32_t round = 0; round < kFieldCount; ++round)
    for (int32_t f = 0; f < kFieldCount; ++f)
      if (plans[f].bytes == 4 && plans[f].stride == stride && plans[f].data < first && first - plans[f].data < stride)
        first = plans[f].data;
  const char* const last = first + (stride - (kWindowBytes - 4));  // the last address where a window may begin
  RecordWindow windows[2];
  int32_t window_count = 0;
  for (; window_count < 2; ++window_count) {
    const char* window = nullptr;  // the first value of this record that is not yet loaded
    for (int32_t f = 0; f < kFieldCount; ++f) {
      const FieldPlan& plan = plans[f];
      const bool left = plan.bytes > 0 && plan.stride == stride && plan.word < 0 && plan.data >= first;
      if (left && plan.data - first < stride && (!window || plan.data < window)) window = plan.data;
    }
    if (!window) break;
    if (window > last) window = last;
    RecordWindow& own = windows[window_count];
    own.data = window;
    own.found_count = find_in_window(plans, window, stride, own.found);
  }
  const int32_t whole = (count - 1) / kSize<A> * kSize<A>;  // all whole vectors before the last record
  for (int32_t begin = 0; begin < whole; begin += kRecordBlock) {
    const int32_t end = begin + kRecordBlock < whole ? begin + kRecordBlock : whole;
    for (int32_t w = 0; w < window_count; ++w) load_window<A>(windows[w], stride, unit_ns, begin, end);
  }
  for (int32_t w = 0; w < window_count; ++w)
    for (int32_t f = 0; f < windows[w].found_count; ++f) load_gathered<A>(*windows[w].found[f], unit_ns, whole, count);
}

template <class A>
void load_points(const PointFields& fields, int32_t count, ScanTable& scan) noexcept {
  OVT_CHECK(count >= 0 && count <= scan.capacity);
  const double unit_ns = fields.time_unit_ns;
  FieldPlan plans[kFieldCount];
  bool known = plan_field(fields.x, FieldUse::kCoordinate, unit_ns, scan.x_m, nullptr, plans[0]);
  known &= plan_field(fields.y, FieldUse::kCoordinate, unit_ns, scan.y_m, nullptr, plans[1]);
  known &= plan_field(fields.z, FieldUse::kCoordinate, unit_ns, scan.z_m, nullptr, plans[2]);
  known &= plan_field(fields.intensity, FieldUse::kIntensity, unit_ns, scan.intensity, nullptr, plans[3]);
  known &= plan_field(fields.layer, FieldUse::kLayer, unit_ns, nullptr, scan.layer, plans[4]);
  known &= plan_field(fields.time, FieldUse::kTime, unit_ns, nullptr, scan.time_offset_ns, plans[5]);
  if (!known) return ref::load_points(fields, count, scan);

  scan.count = count;
  if (count == 0) return;

  load_windows<A>(plans, unit_ns, count);
  for (const FieldPlan& plan : plans)
    if (plan.word < 0)
      load_gathered<A>(plan, unit_ns, plan.bytes > 0 ? load_column<A>(plan, unit_ns, count) : 0, count);
}

}  // namespace overtake::simd
