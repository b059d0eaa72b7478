// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/tracker_params.h"

#include <algorithm>

#include "pipeline/track/life_cycle.h"

namespace overtake {

TrackerParams make_sane(TrackerParams p) noexcept {
  p.window = std::clamp(p.window, 1, kMaxWindow);
  p.track_capacity = std::clamp(p.track_capacity, 1, 4096);
  p.detection_capacity = std::clamp(p.detection_capacity, 1, 4096);
  p.history_iterations = std::clamp(p.history_iterations, 1, 256);
  p.history_s = p.history_s >= 0.0 ? std::min(p.history_s, kMaxPredict_s) : 0.0;
  p.max_silence_s = p.max_silence_s >= 0.0 ? std::min(p.max_silence_s, kMaxPredict_s) : kMaxPredict_s;
  p.predict_step_s = p.predict_step_s >= 1e-3 ? p.predict_step_s : 1e-3;
  p.horizon_step_s = p.horizon_step_s >= 1e-3 ? std::min(p.horizon_step_s, kMaxPredict_s) : 1e-3;
  p.horizon_s = p.horizon_s >= 0.0 ? std::min(p.horizon_s, kMaxPredict_s) : 0.0;
  p.work_limit = p.work_limit >= 1e4 ? std::min(p.work_limit, 1e15) : 1e4;
  return p;
}

}  // namespace overtake
