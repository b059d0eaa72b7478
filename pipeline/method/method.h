// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A method, which the C API calls a preset: the steps of a sensor's segmentation, the rules over a whole frame, the
// tracker, and the defaults of the parameters. Each method has one file (pipeline/method/paper.cpp).
#pragma once

#include <span>

#include "pipeline/method/step.h"
#include "pipeline/track/frame_tracker.h"

namespace overtake {

struct StageContext;

// A rule over all sensors of a frame.
struct FrameRule {
  const char* name;
  int32_t stage;       // ovt_stage: rules of one stage are neighbours and share its time
  Columns reads;       // of each sensor's segmentation: these columns lie in the frame
  const char* params;  // of ovt_params that it reads: groups and text names, separated by one space
  void (*run)(const StageContext& context, Frame& frame) noexcept;
  bool without_scans = false;  // also runs for predictions and pushed detections
  bool uses_places = false;    // of the frame: places, views
};

struct Method {
  const char* name;  // preset name of ovt_params_init
  std::span<const Step> segment;
  std::span<const FrameRule> frame;
  MakeTracker* make_tracker;
  const char* tracker_params;  // that the tracker reads, as FrameRule::params
  // Sets the defaults that differ from params.def. Null: none.
  void (*set_defaults)(ovt_params& params) noexcept;
};

#define OVT_PRESET(name, method) extern const Method method;
#include "pipeline/method/presets.def"
#undef OVT_PRESET

}  // namespace overtake
