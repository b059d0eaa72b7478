// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// USDT probes of provider "overtake", for perf, bpftrace and SystemTap. A probe is a note in the ELF file and one nop
// in the code, which a tracer replaces by a trap while it runs. Built without sys/sdt.h, the probes are empty.
//
//   stage_begin, stage_end (sequence, sensor, stage, stamp_ns)   stage: ovt_stage
//                                    stages of a sensor: sequence -1 (a frame gets its number with its last scan), and
//                                    the scan's stamp
//                                    stages of the whole frame: sensor -1, and the last scan's stamp
//   drop (sensor, stamp_ns)          a newer scan replaced this one before it was used; sensor -1: pushed detections
//   deadline (sequence, latency_ns)  a frame was published later than the def's deadline
#pragma once

#include <cstdint>

#if defined(OVT_PROBES)
#include <sys/sdt.h>
#define OVT_PROBE2(name, a, b) DTRACE_PROBE2(overtake, name, a, b)
#define OVT_PROBE4(name, a, b, c, d) DTRACE_PROBE4(overtake, name, a, b, c, d)
#else
#define OVT_PROBE2(name, a, b) (void(a), void(b))
#define OVT_PROBE4(name, a, b, c, d) (void(a), void(b), void(c), void(d))
#endif

namespace overtake {

// Hides from the compiler that a value is a constant. perf omits constants from a probe's arguments; the kernel then
// refuses the other places of the same probe, because their arguments differ.
template <class T>
inline T seen_by_probe(T value) noexcept {
#if defined(OVT_PROBES)
  asm("" : "+r"(value));
#endif
  return value;
}

inline void probe_stage_begin(int64_t sequence, int32_t sensor, int32_t stage, int64_t stamp_ns) noexcept {
  OVT_PROBE4(stage_begin, seen_by_probe(sequence), seen_by_probe(sensor), seen_by_probe(stage),
             seen_by_probe(stamp_ns));
}
inline void probe_stage_end(int64_t sequence, int32_t sensor, int32_t stage, int64_t stamp_ns) noexcept {
  OVT_PROBE4(stage_end, seen_by_probe(sequence), seen_by_probe(sensor), seen_by_probe(stage), seen_by_probe(stamp_ns));
}
inline void probe_drop(int32_t sensor, int64_t stamp_ns) noexcept {
  OVT_PROBE2(drop, seen_by_probe(sensor), seen_by_probe(stamp_ns));
}
inline void probe_deadline(int64_t sequence, int64_t latency_ns) noexcept {
  OVT_PROBE2(deadline, seen_by_probe(sequence), seen_by_probe(latency_ns));
}

}  // namespace overtake
