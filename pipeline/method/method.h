// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A method, which the C API calls a preset: the steps of a sensor's segmentation, the rules over a whole frame, the
// tracker, and the defaults of the parameters. One file each (pipeline/method/paper.cpp).
#pragma once

#include <span>

#include "pipeline/method/step.h"
#include "pipeline/track/frame_tracker.h"

namespace overtake {

struct StageContext;

// A rule over all sensors of a frame.
struct FrameRule {
  const char* name;
  int32_t stage;       // ovt_stage: rules of one stage stand together, and share its time
  Columns reads;       // of each sensor's segmentation, which keeps them for it
  const char* params;  // what it reads of ovt_params: groups and text names, one space between two
  void (*run)(const StageContext& context, Frame& frame) noexcept;
  bool without_scans = false;  // runs for predictions and pushed detections, too
};

struct Method {
  const char* name;  // as ovt_params_init takes it
  std::span<const Step> segment;
  std::span<const FrameRule> frame;
  MakeTracker* make_tracker;
  const char* tracker_params;  // what that reads of ovt_params
  // Changes defaults that are not those of params.def. Null: none.
  void (*set_defaults)(ovt_params& params) noexcept;
};

}  // namespace overtake
