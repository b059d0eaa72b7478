// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The arguments of a kernel's call, as its step lists them (pipeline/method/steps.h). One list generates the call and
// the columns that the step declares, so they cannot disagree. For a column that it reads, the kernel gets a view of
// constant elements.
#pragma once

#include "pipeline/method/step.h"

namespace overtake::argument {

// The view of a column, as segment_columns.def names it.
template <Column kColumn>
OVT_INLINE auto& view_of(const Segment& s) {
  [[maybe_unused]] SensorPart& part = s.part;
  [[maybe_unused]] SegmentViews& views = s.views;
#define OVT_SEGMENT_COLUMN(name, view, extent) \
  if constexpr (kColumn == Column::name) {     \
    return (view);                             \
  } else
#include "pipeline/method/segment_columns.def"
#undef OVT_SEGMENT_COLUMN
  static_assert(kColumn == Column::kCount);
}

template <class T>
OVT_INLINE Plane<const T> to_const(const Plane<T>& view) {
  return view;
}
OVT_INLINE ConstBitPlane to_const(const BitPlane& view) { return view; }
template <class T>
OVT_INLINE const T* to_const(T* view) {
  return view;
}
template <class T>
OVT_INLINE const T& to_const(const T& view) {  // a table or a number
  return view;
}

struct Nothing {
  static constexpr Columns kReads = 0, kWrites = 0, kScratch = 0;
  static constexpr bool kByColumns = false;
};
template <Column kColumn>
struct In : Nothing {
  static constexpr Columns kReads = columns(kColumn);
  static OVT_INLINE decltype(auto) get(Segment& s) { return to_const(view_of<kColumn>(s)); }
};
template <Column kColumn>
struct Out : Nothing {
  static constexpr Columns kWrites = columns(kColumn);
  static OVT_INLINE auto& get(Segment& s) { return view_of<kColumn>(s); }
};
template <Column kColumn>
struct InOut : Out<kColumn> {
  static constexpr Columns kReads = columns(kColumn);
};
template <Column kColumn>
struct Scratch : Nothing {
  static constexpr Columns kScratch = columns(kColumn);
  static OVT_INLINE auto& get(Segment& s) { return view_of<kColumn>(s); }
};
template <Column kColumn>
struct Result : Nothing {
  static constexpr Columns kWrites = columns(kColumn);
};
template <auto kMember>
struct OfParams : Nothing {
  static OVT_INLINE const auto& get(Segment& s) { return s.params.*kMember; }
};
template <auto kMember>
struct OfSensor : Nothing {
  static OVT_INLINE const auto& get(Segment& s) { return s.sensor.*kMember; }
};
struct OfPart : Nothing {
  static constexpr bool kByColumns = true;
  static OVT_INLINE ColumnSpan get(Segment& s) { return s.columns; }
};

template <Column kColumn>
inline constexpr In<kColumn> in;  // the kernel reads it
template <Column kColumn>
inline constexpr Out<kColumn> out;  // the kernel writes all of it
template <Column kColumn>
inline constexpr InOut<kColumn> inout;
template <Column kColumn>
inline constexpr Scratch<kColumn> scratch;  // written; the contents are meaningless after the call
template <Column kColumn>
inline constexpr Result<kColumn> result;  // return value of the kernel; first in the list
template <auto kMember>
inline constexpr OfParams<kMember> params;  // a member of SegmentParams
template <auto kMember>
inline constexpr OfSensor<kMember> sensor;  // a member of SensorModel
inline constexpr OfPart by_columns;         // the columns to compute: the step may be cut by them

template <class... A>
constexpr Columns reads_of(A...) {
  return (Columns(0) | ... | A::kReads);
}
template <class... A>
constexpr Columns writes_of(A...) {
  return (Columns(0) | ... | A::kWrites);
}
template <class... A>
constexpr Columns scratch_of(A...) {
  return (Columns(0) | ... | A::kScratch);
}
template <class... A>
constexpr Cut cut_of(A...) {
  return (A::kByColumns || ...) ? kByColumns : kWhole;
}

template <class Kernel, class... A>
OVT_INLINE void call(Kernel* kernel, Segment& s, A...) noexcept {
  kernel(A::get(s)...);
}
template <class Kernel, Column kColumn, class... A>
OVT_INLINE void call(Kernel* kernel, Segment& s, Result<kColumn>, A...) noexcept {
  view_of<kColumn>(s) = kernel(A::get(s)...);
}

}  // namespace overtake::argument
