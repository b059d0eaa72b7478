// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/method/methods.h"

#include <cstring>
#include <string_view>

namespace overtake {

namespace {

constinit const Method* methods[kMaxMethods] = {
#define OVT_PRESET(name, method) &method,
#include "pipeline/method/presets.def"
#undef OVT_PRESET
};
constinit int32_t method_count = 0
#define OVT_PRESET(name, method) +1
#include "pipeline/method/presets.def"
#undef OVT_PRESET
    ;

// Every method reads these: how scans become frames, when tracks are predicted without a frame, and on how many workers
// a scan is segmented.
constexpr const char* kCommonParams = "frame tracker.predict_after segment";

// `list`: groups and names, one space between two.
bool lists_param(std::string_view list, std::string_view name) noexcept {
  while (!list.empty()) {
    const std::string_view entry = list.substr(0, list.find(' '));
    if (name == entry || (name.size() > entry.size() && name.starts_with(entry) && name[entry.size()] == '.'))
      return true;
    list.remove_prefix(entry.size() < list.size() ? entry.size() + 1 : entry.size());
  }
  return false;
}

}  // namespace

const Method* find_method(const char* name) noexcept {
  for (int32_t i = 0; i < method_count; ++i)
    if (std::strcmp(methods[i]->name, name) == 0) return methods[i];
  return nullptr;
}

int32_t list_methods(const Method** out) noexcept {
  for (int32_t i = 0; out && i < method_count; ++i) out[i] = methods[i];
  return method_count;
}

std::string join_method_names() {
  std::string names;
  for (int32_t i = 0; i < method_count; ++i) names += (i > 0 ? ", " : "") + std::string(methods[i]->name);
  return names;
}

bool add_method(const Method& method) noexcept {
  if (method_count == kMaxMethods || find_method(method.name)) return false;
  methods[method_count++] = &method;
  return true;
}

bool has_stage(const Method& method, int32_t stage) noexcept {
  for (const int32_t common : {OVT_STAGE_LOAD, OVT_STAGE_SEGMENT, OVT_STAGE_TRACK, OVT_STAGE_FRAME})
    if (stage == common) return true;
  for (const Step& step : method.segment)
    if (stage == step.stage) return true;
  for (const FrameRule& rule : method.frame)
    if (stage == rule.stage) return true;
  return false;
}

bool reads_column(const Method& method, Column column) noexcept {
  for (const Step& step : method.segment)
    if (has(step.reads, column)) return true;
  return false;
}

bool reads_param(const Method& method, const char* name) noexcept {
  if (lists_param(kCommonParams, name) || lists_param(method.tracker_params, name)) return true;
  for (const Step& step : method.segment)
    if (lists_param(step.params, name)) return true;
  for (const FrameRule& rule : method.frame)
    if (lists_param(rule.params, name)) return true;
  return false;
}

}  // namespace overtake
