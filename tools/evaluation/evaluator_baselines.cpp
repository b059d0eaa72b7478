// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Results of other methods on the same points of the same frame.
#include <cmath>
#include <map>

#include "tools/evaluation/baselines/euclidean_clusters.h"
#include "tools/evaluation/baselines/grid_ground.h"
#include "tools/evaluation/baselines/label_ground.h"
#include "tools/evaluation/evaluator.h"

namespace overtake::evaluation {

void Evaluator::evaluate_baselines() {
  if (!is_due_) return;
  is_due_ = false;
  add_ground_baselines(due_);
  add_euclid(due_);
  due_ = CloudPoints();
}

// The grid gets all sensors' points at once, as in its paper; the automatic labels, like our method, each scan alone.
void Evaluator::add_ground_baselines(const CloudPoints& cloud) {
  const std::size_t count = cloud.x_m.size();
  const std::vector<bool> grid = baselines::mark_nonground(cloud.x_m, cloud.y_m, cloud.z_m);
  std::vector<bool> labelled(count, false);
  for (int32_t sensor = 0; sensor < int32_t(log_.rig().sensors.size()); ++sensor) {
    std::vector<float> x, y, z;
    std::vector<std::size_t> row;
    for (std::size_t i = 0; i < count; ++i)
      if (cloud.sensor[i] == sensor)
        x.push_back(cloud.x_m[i]), y.push_back(cloud.y_m[i]), z.push_back(cloud.z_m[i]), row.push_back(i);
    if (row.empty()) continue;
    const std::vector<bool> nonground = baselines::label_nonground(x, y, z);
    for (std::size_t i = 0; i < row.size(); ++i) labelled[row[i]] = nonground[i];
  }
  std::vector<bool> truth(cloud.surface.size());
  for (std::size_t i = 0; i < truth.size(); ++i) truth[i] = is_positive(kind_of(cloud.surface[i]));
  const auto compare = [&](const char* table, const std::vector<bool>& found, const std::vector<bool>& positive) {
    std::map<int32_t, std::array<double, 4>> of_sensor;  // tp fp fn tn
    for (std::size_t i = 0; i < positive.size(); ++i)
      of_sensor[cloud.sensor[i]][found[i] ? (positive[i] ? 0 : 1) : (positive[i] ? 2 : 3)] += 1;
    for (const auto& [sensor, n] : of_sensor)
      tables_[table].add({frame_number_, double(sensor), n[0], n[1], n[2], n[3]});
  };
  compare("grid", grid, truth);
  compare("auto_label", labelled, truth);
  compare("scans_auto", cloud.found, labelled);
  compare("grid_auto", grid, labelled);
}

void Evaluator::add_euclid(const CloudPoints& cloud) {
  const double frame = frame_number_;
  std::vector<float> x, y, z;
  std::vector<std::size_t> row;
  bool any_car = false;
  for (std::size_t i = 0; i < cloud.found.size(); ++i) {
    if (!cloud.found[i]) continue;
    x.push_back(cloud.x_m[i]), y.push_back(cloud.y_m[i]), z.push_back(cloud.z_m[i]), row.push_back(i);
    any_car = any_car || (cloud.surface.empty() ? !cloud.cars.empty() : car_of(cloud.surface[i]) >= 0);
  }
  if (!any_car) return;
  const auto by_truth = [&](double count) { return cloud.surface.empty() ? NAN : count; };
  for (const double radius : {0.2, 0.3, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0}) {
    const std::vector<int32_t> cluster = baselines::cluster_points(x, y, z, radius);
    ClusterTally tally(cloud.cars);
    for (std::size_t i = 0; i < row.size(); ++i) {
      const bool known = !cloud.surface.empty();
      const uint16_t surface = known ? cloud.surface[row[i]] : uint16_t(0);
      tally.add(cluster[i], {double(x[i]), double(y[i]), double(z[i])}, known ? kind_of(surface) : Kind::kGround,
                known ? car_of(surface) : -1);
    }
    for (const auto& [car, of] : tally.of_car())
      tables_["euclid"].add({frame, radius, double(car), by_truth(double(of.clusters)), double(of.inside)});
    const ClusterTally::Mixed mixed = tally.mixed();
    tables_["euclid_mixed"].add(
        {frame, radius, by_truth(double(mixed.other)), by_truth(double(mixed.cars)), double(mixed.by_size)});
  }
}

}  // namespace overtake::evaluation
