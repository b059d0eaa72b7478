// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// USDT probes of provider "overtake", for perf, bpftrace and SystemTap: a note in the ELF file and one nop in the code,
// which a tracer turns into a trap while it looks. Without sys/sdt.h at build time they are nothing at all.
//
//   stage_begin, stage_end (sequence, sensor, stage, stamp_ns)   stage: ovt_stage. Stages of a sensor: sequence -1 (a
//                                    frame gets its number when its last scan is in), the scan's stamp. Stages of the
//                                    whole frame: sensor -1, the last scan's stamp
//   drop (sensor, stamp_ns)          a scan was replaced before anybody used it; sensor -1: pushed detections
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

// Hides that a value is a constant. perf leaves constants out of a probe's arguments, and the kernel then refuses the
// other places of the same probe because their arguments differ.
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
