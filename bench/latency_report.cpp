// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Intervals between the library's stages, on the path of the scan that is segmented last:
//
//   due |wake_driver| load |hand_over| segment |gather| merge gate pose track |publish| on_frame
//
// wake_driver: from the scheduled arrival to the start of the copy, per scan (in the closed loop, and where one thread
// pushes all scans because the library has none, the sensors before it are in it).
// hand_over: from the end of a scan's copy to the start of its segmentation. gather: from the end of the last
// segmentation to the merge. publish: from the tracks to on_frame. Of scans in pieces, last_piece goes from the
// scheduled arrival to the start of the segmentation, instead of the first three.
#include "bench/latency_report.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace overtake::bench {
namespace {

using Json = nlohmann::ordered_json;

int64_t end_of(const ovt_span& span) { return span.start_ns + span.duration_ns; }

Json to_json(const Histogram& h) {
  const auto us = [](double ns) { return ns / 1000; };
  return {{"count", h.count()},
          {"min_us", us(double(h.min()))},
          {"mean_us", us(h.mean())},
          {"p50_us", us(double(h.percentile(50)))},
          {"p90_us", us(double(h.percentile(90)))},
          {"p99_us", us(double(h.percentile(99)))},
          {"p999_us", us(double(h.percentile(99.9)))},
          {"max_us", us(double(h.max()))}};
}

void append_row(std::string& text, const std::string& name, const Histogram& h) {
  const auto us = [&](double percent) { return double(h.percentile(percent)) / 1000; };
  char line[160];
  std::snprintf(line, sizeof line, "  %-14s %8lld %10.1f %10.1f %10.1f %10.1f %10.1f\n", name.c_str(),
                static_cast<long long>(h.count()), us(50), us(90), us(99), us(99.9), double(h.max()) / 1000);
  text += line;
}

std::string cpus_text(const std::vector<int32_t>& cpus) {
  std::string text;
  for (int32_t cpu : cpus) text += (text.empty() ? "" : ",") + std::to_string(cpu);
  return text.empty() ? "any" : text;
}

// For example "SCHED_FIFO 20: 3 of 3 library threads, ...": the policy that the system granted.
std::string policy_text(const LatencyRun& run, const LatencyRunDef& def) {
  if (def.fifo_priority == 0) return "as started";
  return "SCHED_FIFO " + std::to_string(def.fifo_priority) + " asked for: " + std::to_string(run.runtime.fifo) +
         " library threads and " + std::to_string(run.measuring_fifo) + " of " + std::to_string(run.measuring_threads) +
         " measuring ones have it";
}

double floors_of(const LatencyReport& report) {
  return double(report.end_to_end.percentile(50)) / double(report.floor.percentile(50));
}

}  // namespace

LatencyReport make_report(const LatencyRun& run, const LatencyRunDef& def) {
  LatencyReport report;
  Histogram stage[OVT_STAGE_COUNT], wake, last_piece, hand_over, gather, publish;
  for (std::size_t k = 0; k < run.frames.size(); ++k) {
    const FrameSample& frame = run.frames[k];
    const bool is_warmup = int64_t(k) < def.warmup;
    if (frame.published_ns == 0) {
      if (!is_warmup) ++report.missing;
      continue;
    }
    const int64_t latency_ns = frame.published_ns - frame.due_ns;
    if (is_warmup) {
      if (k == 0) report.warmup_first_ns = latency_ns;
      report.warmup.record(latency_ns);
      continue;
    }
    report.end_to_end.record(latency_ns);
    if (frame.sensor_mask != frame.expected_mask || frame.parts > 1) ++report.incomplete;
    if (frame.flags & OVT_FLAG_DEADLINE_MISSED) ++report.deadline_missed;
    int64_t segmented_ns = 0;
    for (int32_t s = -1; s < run.sensor_count; ++s)
      for (int32_t i = 0; i < OVT_STAGE_COUNT; ++i)
        if (const ovt_span& span = run.span(k, s, ovt_stage(i)); span.duration_ns >= 0)
          stage[i].record(span.duration_ns);
    for (int32_t s = 0; s < run.sensor_count; ++s) {
      const ovt_span& load = run.span(k, s, OVT_STAGE_LOAD);
      const ovt_span& segment = run.span(k, s, OVT_STAGE_SEGMENT);
      if (load.duration_ns < 0 || segment.duration_ns < 0) continue;
      int64_t due_ns = frame.due_ns;  // of the frame's last scan
      if (!def.closed_loop) {
        int32_t last = s;
        while (frame.expected_mask >> (last + 1)) ++last;
        due_ns -= int64_t(last - s) * def.stagger_us * 1000;
      }
      if (def.pieces > 0) {  // a load is the sum over the pieces
        last_piece.record(segment.start_ns - due_ns);
      } else {
        wake.record(load.start_ns - due_ns);
        hand_over.record(segment.start_ns - end_of(load));
      }
      segmented_ns = std::max(segmented_ns, end_of(segment));
    }
    if (const ovt_span& merge = run.span(k, -1, OVT_STAGE_MERGE); merge.duration_ns >= 0 && segmented_ns > 0)
      gather.record(merge.start_ns - segmented_ns);
    if (const ovt_span& track = run.span(k, -1, OVT_STAGE_TRACK); track.duration_ns >= 0)
      publish.record(frame.published_ns - end_of(track));
  }
  const auto add = [&](const char* name, const Histogram& histogram) {
    if (histogram.count() > 0) report.stages.push_back({name, histogram});
  };
  add("wake_driver", wake);
  add("last_piece", last_piece);
  add(ovt_stage_name(OVT_STAGE_LOAD), stage[OVT_STAGE_LOAD]);
  add("hand_over", hand_over);
  for (int32_t i = OVT_STAGE_PROJECT; i <= OVT_STAGE_SEGMENT; ++i) add(ovt_stage_name(i), stage[i]);
  add("gather", gather);
  for (int32_t i = OVT_STAGE_MERGE; i <= OVT_STAGE_TRACK; ++i) add(ovt_stage_name(i), stage[i]);
  add("publish", publish);
  add(ovt_stage_name(OVT_STAGE_FRAME), stage[OVT_STAGE_FRAME]);

  for (std::size_t k = std::size_t(def.warmup); k < run.floor_ns.size(); ++k) report.floor.record(run.floor_ns[k]);
  for (std::size_t k = std::size_t(def.warmup); k < run.noise.size(); ++k) {
    const NoiseSample& sample = run.noise[k];
    if (sample.stolen_ns < 0) continue;
    report.stolen.record(sample.stolen_ns);
    if (sample.late_ns >= 0) report.late.record(sample.late_ns);
    report.noise.record(std::max<int64_t>(sample.late_ns, 0) + sample.stolen_ns);
  }
  return report;
}

std::string format_text(const LatencyReport& report, const LatencyRun& run, const LatencyRunDef& def,
                        const std::string& source, const EnvironmentSheet& environment) {
  std::string text;
  for (const auto& [name, value] : environment) text += name + ": " + value + "\n";
  char line[400], loop[64] = "closed loop";
  if (!def.closed_loop) std::snprintf(loop, sizeof loop, "open loop, %.6g Hz", run.rate_hz);
  std::snprintf(line, sizeof line,
                "input: %s\nrun: %s, %d frames after %d of warm-up, CPUs %s%s\nlibrary: isa %s, %d "
                "workers, %d threads pinned, spin %d us, images %s, %.1f MiB (%.1f locked, %.1f huge)\npolicy: %s\n",
                source.c_str(), loop, def.frames, def.warmup, cpus_text(def.cpus).c_str(),
                def.cold ? ", caches emptied between frames" : "", run.isa.c_str(), run.runtime.worker_count,
                run.runtime.pinned, def.spin_us, def.keep_images ? "kept" : "not kept",
                double(run.runtime.memory_bytes) / 1048576, double(run.runtime.locked_bytes) / 1048576,
                double(run.runtime.huge_bytes) / 1048576, policy_text(run, def).c_str());
  text += line;
  std::snprintf(line, sizeof line, "\n  %-14s %8s %10s %10s %10s %10s %10s\n", "us", "count", "p50", "p90", "p99",
                "p99.9", "max");
  text += line;
  append_row(text, "end to end", report.end_to_end);
  for (const StageHistogram& stage : report.stages) append_row(text, stage.name, stage.histogram);
  if (report.floor.count() > 0) {
    append_row(text, "segment_floor", report.floor);
    std::snprintf(line, sizeof line, "  end to end, p50: %.2f floors\n", floors_of(report));
    text += line;
  }
  text += "machine's noise\n";
  append_row(text, "late", report.late);
  append_row(text, "stolen", report.stolen);
  append_row(text, "late + stolen", report.noise);
  if (report.warmup.count() > 0) {
    text += "warm-up\n";
    append_row(text, "end to end", report.warmup);
    std::snprintf(line, sizeof line, "  the very first frame: %.1f us\n", double(report.warmup_first_ns) / 1000);
    text += line;
  }
  std::snprintf(line, sizeof line, "%lld frames missing, %lld incomplete, %lld scans dropped, %lld deadlines missed\n",
                static_cast<long long>(report.missing), static_cast<long long>(report.incomplete),
                static_cast<long long>(run.stats.dropped), static_cast<long long>(report.deadline_missed));
  text += line;
  if (def.closed_loop) {
    std::snprintf(line, sizeof line, "%.1f frames a second\n", double(def.frames) * 1e9 / double(run.wall_ns));
    text += line;
  }
  return text;
}

std::string format_json(const LatencyReport& report, const LatencyRun& run, const LatencyRunDef& def,
                        const std::string& source, const EnvironmentSheet& environment) {
  Json json;
  json["bench"] = "latency";
  json["loop"] = def.closed_loop ? "closed" : "open";
  json["input"] = source;
  json["end_to_end"] = to_json(report.end_to_end);
  json["warmup"] = to_json(report.warmup);
  json["warmup"]["first_us"] = double(report.warmup_first_ns) / 1000;
  for (const StageHistogram& stage : report.stages) json["stages"][stage.name] = to_json(stage.histogram);
  if (report.floor.count() > 0) {
    json["segment_floor"] = to_json(report.floor);
    json["end_to_end"]["p50_floors"] = floors_of(report);
  }
  json["noise"] = {{"late", to_json(report.late)},
                   {"stolen", to_json(report.stolen)},
                   {"late_and_stolen", to_json(report.noise)},
                   {"window_us", double(def.noise_window_ns) / 1000}};
  json["frames"] = {{"measured", def.frames},
                    {"published", report.end_to_end.count()},
                    {"missing", report.missing},
                    {"incomplete", report.incomplete},
                    {"deadline_missed", report.deadline_missed},
                    {"scans_pushed", run.stats.pushed},
                    {"scans_dropped", run.stats.dropped},
                    {"exceptions", run.stats.exceptions}};
  if (def.closed_loop) json["frames"]["per_second"] = double(def.frames) * 1e9 / double(run.wall_ns);
  json["options"] = {{"rate_hz", run.rate_hz},
                     {"stagger_us", def.stagger_us},
                     {"pieces", def.pieces},
                     {"preset", def.preset},
                     {"cpus", def.cpus},
                     {"workers", def.workers},
                     {"parts", def.parts},
                     {"fifo", def.fifo_priority},
                     {"spin_us", def.spin_us},
                     {"isa", def.isa},
                     {"cold", def.cold},
                     {"memory", def.memory},
                     {"keep_images", def.keep_images},
                     {"deadline_us", double(def.deadline_ns) / 1000},
                     {"frames", def.frames},
                     {"warmup", def.warmup}};
  json["runtime"] = {{"isa", run.isa},
                     {"workers", run.runtime.worker_count},
                     {"pinned_threads", run.runtime.pinned},
                     {"fifo_threads", run.runtime.fifo},
                     {"measuring_threads", run.measuring_threads},
                     {"measuring_fifo_threads", run.measuring_fifo},
                     {"policy", policy_text(run, def)},
                     {"memory_bytes", run.runtime.memory_bytes},
                     {"locked_bytes", run.runtime.locked_bytes},
                     {"huge_bytes", run.runtime.huge_bytes},
                     {"evicted_bytes_per_cpu", run.evicted_bytes}};
  for (const auto& [name, value] : environment) json["environment"][name] = value;
  return json.dump(2) + "\n";
}

}  // namespace overtake::bench
