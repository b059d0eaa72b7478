// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/sim/simulator.h"

#include <algorithm>
#include <stdexcept>

#include "tools/io/error.h"

namespace overtake::sim {
namespace {

enum Stream : uint64_t {
  kMountingStream = 1,
  kScanStream,
  kClockStream,
  kEgoStream,
  kMapStream,
  kPuffStream,
  kTrackStream,
  kHeadStream
};

}  // namespace

Simulator::Simulator(const Scenario& scenario, uint64_t seed, double seconds, int32_t worker_count)
    : scenario_(scenario),
      random_(seed),
      seconds_(seconds > 0 ? std::min(seconds, scenario.seconds) : scenario.seconds),
      world_(std::make_unique<World>(scenario, random_.branch(kTrackStream))),
      workers_(std::make_unique<Workers>(worker_count)),
      rig_(io::load_rig("av21")) {
  world_->puff_random = random_.branch(kPuffStream);
  // Moves the side sensors forward or back until the strip between the fields of view has the given width.
  io::RigSensor &front = rig_.sensors[0], &left = rig_.sensors[1], &right = rig_.sensors[2];
  const SinCos edge = sin_cos(60 * kDegree);
  left.x_m = right.x_m = front.x_m - (scenario.seam_strip_m - left.y_m * edge.cos) / edge.sin;
  double fastest = 0;
  for (const PatternChange& change : scenario_.patterns) fastest = std::max(fastest, double(change.pattern.lines()));
  rig_.period_s = 1 / scenario_.patterns.front().pattern.rate_hz;
  for (int32_t s = 0; s < kSensors; ++s) {
    io::RigSensor& sensor = rig_.sensors[std::size_t(s)];
    sensor.rows = int32_t(fastest);
    // Beams of the overlapping heads are in the image's columns, too; up to two returns of each.
    sensor.point_capacity = std::max(sensor.point_capacity, 2 * sensor.rows * sensor.cols);
    sensor.range_max_m = scenario_.errors.range_max_m;
    sensor.range_min_m = scenario_.errors.range_min_m;
    Mounting& m = mounting_[s];
    m.nominal = {rotation_of(sensor.roll_deg * kDegree, sensor.pitch_deg * kDegree, sensor.yaw_deg * kDegree),
                 {sensor.x_m, sensor.y_m, sensor.z_m}};
    Random dice = random_.branch(kMountingStream).branch(uint64_t(s));
    const double size = scenario_.errors.mounting_error_m, turn = scenario_.errors.mounting_error_rad;
    double draw[6];  // drawn one by one: the order of evaluating arguments is unspecified
    for (double& d : draw) d = dice.normal();
    const Rigid error{rotation_of(turn * draw[0], turn * draw[1], turn * draw[2]),
                      {size * draw[3], size * draw[4], size * draw[5]}};
    m.real = m.nominal * error;
    Random head = random_.branch(kHeadStream).branch(uint64_t(s));
    heads_[s].overlap_rad =
        scenario_.errors.head_overlap_rad + scenario_.errors.head_spread_rad * clamp(head.normal(), -2, 2);
    heads_[s].step_rad = scenario_.errors.head_step_rad * clamp(head.normal(), -2, 2);
    own_car_[s] = OwnCarMask(*world_, m.real);
  }
  for (int64_t ns = 0; double(ns) * 1e-9 < seconds_ - 1e-9;) {
    begin_s_.push_back(double(ns) * 1e-9);
    ns += int64_t(1e9 / scenario_.pattern_at(double(ns) * 1e-9).rate_hz + 0.5);
  }
}

SimFrame Simulator::frame(int32_t index) {
  SimFrame frame;
  const double begin = begin_s_[std::size_t(index)];
  frame.begin_ns = int64_t(begin * 1e9 + 0.5);
  std::vector<ScanJob> jobs;
  for (int32_t s = 0; s < kSensors; ++s) {
    Random clock = random_.branch(kClockStream).branch(uint64_t(index)).branch(uint64_t(s));
    const double off = scenario_.errors.clock_jitter_s * clamp(clock.normal(), -4, 4);
    frame.stamp_ns[s] = std::max<int64_t>(0, frame.begin_ns + int64_t(std::floor(off * 1e9 + 0.5)));
    jobs.push_back({world_.get(), &scenario_.pattern_at(begin), &scenario_.errors, &scenario_.rain, mounting_[s],
                    heads_[s], &own_car_[s], scenario_.dirt, begin, s,
                    random_.branch(kScanStream).branch(uint64_t(index)).branch(uint64_t(s))});
  }
  frame.scans = take_scans(jobs, *workers_);
  return frame;
}

std::vector<EgoPose> Simulator::ego_poses() const {
  return localise(*world_->motions[std::size_t(world_->ego)], scenario_.localisation, seconds_ + 0.2,
                  random_.branch(kEgoStream));
}

// Survey error: a smooth random wave across the line and in both widths, made of harmonics longer than map_wave_m.
SurveyedMap Simulator::map() const {
  const Track& track = world_->track;
  const int32_t harmonics = std::max(1, int32_t(track.length_m() / scenario_.map_wave_m));
  struct Wave {
    std::vector<double> sine, cosine;
  };
  Wave waves[3];
  for (int32_t w = 0; w < 3; ++w) {
    Random dice = random_.branch(kMapStream).branch(uint64_t(w));
    for (int32_t h = 0; h < harmonics; ++h) {
      waves[w].sine.push_back(dice.normal() / std::sqrt(double(harmonics)));
      waves[w].cosine.push_back(dice.normal() / std::sqrt(double(harmonics)));
    }
  }
  const auto error = [&](int32_t w, double s) {
    double sum = 0;
    for (int32_t h = 0; h < harmonics; ++h) {
      const SinCos a = sin_cos(2 * kPi * (h + 1) * s / track.length_m());
      sum += waves[w].sine[std::size_t(h)] * a.sin + waves[w].cosine[std::size_t(h)] * a.cos;
    }
    return scenario_.map_error_m * sum;
  };
  SurveyedMap map;
  const int32_t count = int32_t(track.length_m() / 2);
  for (int32_t i = 0; i < count; ++i) {
    const double s = track.length_m() * i / count;
    const TrackPoint p = track.at(s);
    const SinCos h = sin_cos(p.heading_rad);
    const double off = scenario_.map_shift_m + error(0, s);
    map.x_m.push_back(p.x - off * h.sin);
    map.y_m.push_back(p.y + off * h.cos);
    map.width_left_m.push_back(p.width_left_m + error(1, s));
    map.width_right_m.push_back(p.width_right_m + error(2, s));
    map.banking_rad.push_back(p.banking_rad);
  }
  return map;
}

std::unique_ptr<Simulator> make_simulator(const std::string& file_or_name, const std::string& ego,
                                          const std::string& pattern, uint64_t seed, double seconds,
                                          int32_t worker_count) {
  Scenario scenario = load_scenario(file_or_name);
  if (!ego.empty()) {
    if (scenario.find_car(ego) < 0) throw io::Error(file_or_name, 0, "no car is named '" + ego + "'");
    scenario.ego = ego;
  }
  try {
    if (!pattern.empty())
      for (PatternChange& change : scenario.patterns) change.pattern.kind = pattern_kind(pattern);
    return std::make_unique<Simulator>(scenario, seed, seconds, worker_count);
  } catch (const std::invalid_argument& error) {
    throw io::Error(file_or_name, 0, error.what());
  }
}

}  // namespace overtake::sim
