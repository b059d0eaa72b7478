// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/trace_file.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "tools/client/session.h"
#include "tools/io/error.h"
#include "tools/io/json_text.h"
#include "tools/io/output.h"
#include "tools/io/text.h"

namespace overtake::cli {
namespace {

constexpr std::size_t kWriteBytes = 1 << 16;
constexpr int32_t kFirstLane = 1;  // tid of worker -1, the pushing thread

// The order of spans that start at the same nanosecond: the segmentation comes before its first stage.
constexpr int32_t kOrder[] = {OVT_STAGE_LOAD,  OVT_STAGE_SEGMENT, OVT_STAGE_PROJECT,  OVT_STAGE_GAPS,
                              OVT_STAGE_ANGLE, OVT_STAGE_SMOOTH,  OVT_STAGE_GROUND,   OVT_STAGE_REPAIR,
                              OVT_STAGE_LINK,  OVT_STAGE_LABEL,   OVT_STAGE_CLUSTERS, OVT_STAGE_MERGE,
                              OVT_STAGE_GATE,  OVT_STAGE_POSE,    OVT_STAGE_TRACK,    OVT_STAGE_FRAME};
static_assert(sizeof kOrder / sizeof *kOrder == OVT_STAGE_COUNT);

// Names come from files: replaces bytes that are not UTF-8.
std::string quoted(const std::string& text) { return io::dump_json(nlohmann::json(text)); }

}  // namespace

TraceFile::TraceFile(std::string path, const io::Rig& rig) : path_(std::move(path)) {
  for (const io::RigSensor& sensor : rig.sensors) sensor_names_.push_back(quoted(sensor.name));
  file_ = std::fopen(io::begin_output(path_).c_str(), "wb");
  if (!file_) io::fail_write(path_, errno);
  pending_ = "{\"otherData\":{\"writer\":\"overtake\"},\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n";
}

TraceFile::~TraceFile() {
  try {
    finish();
  } catch (const io::Error&) {  // call finish() to get the error
  }
}

// Counts times from the first load, so that none is negative: a sensor's spans may start before the frame's.
void TraceFile::add(int64_t frame, ovt_reader* reader) {
  ovt_frame_info info;
  check(ovt_read_info(reader, &info), "frame");
  const auto sensors = int32_t(sensor_names_.size());
  std::vector<ovt_span> spans(std::size_t(sensors + 1) * OVT_STAGE_COUNT, ovt_span{0, -1, -1});
  const auto span_of = [&](int32_t sensor, int32_t stage) -> ovt_span& {
    return spans[std::size_t(sensor + 1) * OVT_STAGE_COUNT + std::size_t(stage)];
  };
  for (int32_t s = -1; s < sensors; ++s)
    for (int32_t i = 0; i < OVT_STAGE_COUNT; ++i)
      if (const ovt_status status = ovt_read_span(reader, s, ovt_stage(i), &span_of(s, i)); status != OVT_NOT_COMPUTED)
        check(status, "stage times");
  if (!any_) {
    first_ns_ = INT64_MAX;
    for (const ovt_span& span : spans)
      if (span.duration_ns >= 0) first_ns_ = std::min(first_ns_, span.start_ns);
    if (first_ns_ == INT64_MAX) return;  // nothing ran
  }
  for (int32_t s = -1; s < sensors; ++s)
    for (const int32_t i : kOrder) {
      const ovt_span& span = span_of(s, i);
      if (span.duration_ns < 0) continue;
      if (i == OVT_STAGE_FRAME)
        add_frame(span, info.sequence, frame);
      else
        add_span(ovt_stage_name(i), span, info.sequence, frame,
                 s < 0 ? nullptr : sensor_names_[std::size_t(s)].c_str());
    }
  if (pending_.size() >= kWriteBytes) write(false);
}

void TraceFile::append_time(int64_t ns) {
  char text[40];
  const int64_t size = ns < 0 ? -ns : ns;
  std::snprintf(text, sizeof text, "%s%lld.%03d", ns < 0 ? "-" : "", static_cast<long long>(size / 1000),
                int(size % 1000));
  pending_ += text;
}

void TraceFile::add_span(const char* name, const ovt_span& span, int64_t sequence, int64_t frame, const char* sensor) {
  worker_count_ = std::max(worker_count_, span.worker + 1);
  if (any_) pending_ += ",\n";
  any_ = true;
  pending_ += "{\"ph\":\"X\",\"pid\":1,\"cat\":\"stage\",\"tid\":";
  io::append_number(pending_, span.worker + 1 + kFirstLane);
  pending_ += ",\"name\":\"";
  pending_ += name;
  pending_ += "\",\"ts\":";
  append_time(span.start_ns - first_ns_);
  pending_ += ",\"dur\":";
  append_time(span.duration_ns);
  pending_ += ",\"args\":{\"sequence\":";
  io::append_number(pending_, sequence);
  pending_ += ",\"frame\":";
  io::append_number(pending_, frame);
  if (sensor) {
    pending_ += ",\"sensor\":";
    pending_ += sensor;
  }
  pending_ += "}}";
}

void TraceFile::add_frame(const ovt_span& span, int64_t sequence, int64_t frame) {
  for (const bool begin : {true, false}) {
    if (any_) pending_ += ",\n";
    any_ = true;
    pending_ += begin ? "{\"ph\":\"b\"" : "{\"ph\":\"e\"";
    pending_ += ",\"pid\":1,\"tid\":0,\"cat\":\"frame\",\"name\":\"frame\",\"id\":";
    io::append_number(pending_, sequence);
    pending_ += ",\"ts\":";
    append_time(span.start_ns + (begin ? 0 : span.duration_ns) - first_ns_);
    pending_ += ",\"args\":{\"sequence\":";
    io::append_number(pending_, sequence);
    pending_ += ",\"frame\":";
    io::append_number(pending_, frame);
    pending_ += "}}";
  }
}

void TraceFile::write(bool last) {
  auto* file = static_cast<std::FILE*>(file_);
  int reason = std::fwrite(pending_.data(), 1, pending_.size(), file) == pending_.size() ? 0 : errno;
  pending_.clear();
  if (last) {
    file_ = nullptr;
    if (std::fclose(file) != 0 && reason == 0) reason = errno;
  }
  if (reason != 0) io::fail_write(path_, reason);
}

void TraceFile::finish() {
  if (!file_) return;
  const auto name = [&](const char* what, int32_t lane, const std::string& text) {
    if (any_) pending_ += ",\n";
    any_ = true;
    pending_ += "{\"ph\":\"M\",\"pid\":1,\"tid\":" + std::to_string(lane) + ",\"name\":\"" + what +
                "\",\"args\":{\"name\":\"" + text + "\"}}";
  };
  name("process_name", 0, "overtake run");
  name("thread_name", kFirstLane, worker_count_ > 0 ? "pushing thread" : "pushing thread (no workers)");
  for (int32_t worker = 0; worker < worker_count_; ++worker)
    name("thread_name", worker + 1 + kFirstLane, "worker " + std::to_string(worker));
  pending_ += "\n]}\n";
  write(true);
}

}  // namespace overtake::cli
