// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Rows of cars and tracks made by hand, for the tests of their figures.
#pragma once

#include <doctest/doctest.h>

#include <vector>

#include "tools/evaluation/figures.h"
#include "tools/evaluation/track_quality.h"

namespace overtake::test {

using evaluation::Run, evaluation::TrackQuality;

inline Run empty_run() {
  return {"best", "log", {{"scenario", "hand"}, {"period_s", "0.05"}}, evaluation::make_tables()};
}

inline TrackQuality quality_of_tracks(const Run& run) {
  const std::vector<TrackQuality> all = evaluation::find_track_quality({run});
  REQUIRE(all.size() == 1);
  return all[0];
}

inline void add_car_row(Run& run, double frame, double car, double ahead_m, double points, double confirmed) {
  run.tables["cars"].add({frame, 0.05 * frame, car, ahead_m, 0, ahead_m, 0, points, 1, 1, 1, 0, confirmed});
}
inline void add_track_row(Run& run, double frame, double id, double car, double ahead_m, double along, double across,
                          double speed = 0, double heading = 0, double course = 0, double nees = 5) {
  run.tables["tracks"].add({frame, 0.05 * frame, id, 1, car, ahead_m, ahead_m, 0, 0, 0, along, across, speed, heading,
                            course, 0, nees, 0.05});
}

}  // namespace overtake::test
