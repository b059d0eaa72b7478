// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/baselines/label_ground.h"
#include "tools/io/angles.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <stdexcept>

namespace overtake::baselines {
namespace {

struct Cloud {
  std::vector<float> xyz;
  std::size_t kdtree_get_point_count() const { return xyz.size() / 3; }
  float kdtree_get_pt(std::size_t i, std::size_t axis) const { return xyz[3 * i + axis]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>, Cloud, 3, uint32_t>;

enum class Opinion : int8_t { kNone, kGround, kObstacle };

// Opinion from the plane through these points: kNone if they are on a line.
Opinion judge_plane(const Cloud& cloud, const uint32_t* index, std::size_t count, const LabelGroundParams& params) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  const auto at = [&](std::size_t k) {
    const float* p = &cloud.xyz[3 * std::size_t(index[k])];
    return Eigen::Vector3d(double(p[0]), double(p[1]), double(p[2]));
  };
  for (std::size_t k = 0; k < count; ++k) mean += at(k) / double(count);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < count; ++k) scatter += (at(k) - mean) * (at(k) - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);  // ascending
  const Eigen::Vector3d squares = solver.eigenvalues();
  if (!(squares[1] > params.spread * params.spread * squares[2])) return Opinion::kNone;
  const double upright = std::fabs(solver.eigenvectors().col(0)[2]);
  return upright >= std::cos(params.flat_deg * io::kPi / 180) ? Opinion::kGround : Opinion::kObstacle;
}

}  // namespace

std::vector<bool> label_nonground(const std::vector<float>& x_m, const std::vector<float>& y_m,
                                  const std::vector<float>& z_m, const LabelGroundParams& params) {
  if (x_m.size() != y_m.size() || x_m.size() != z_m.size()) throw std::invalid_argument("x, y and z differ in length");
  if (params.neighbours < 3 || params.most < params.neighbours || params.voters < 1)
    throw std::invalid_argument("3 neighbours and 1 voter are the least");
  std::vector<bool> nonground(x_m.size(), false);
  Cloud cloud;
  std::vector<std::size_t> row;
  for (std::size_t i = 0; i < x_m.size(); ++i)
    if (std::isfinite(x_m[i]) && std::isfinite(y_m[i]) && std::isfinite(z_m[i]))
      row.push_back(i), cloud.xyz.insert(cloud.xyz.end(), {x_m[i], y_m[i], z_m[i]});
  if (row.empty()) return nonground;
  const Tree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10));

  std::vector<Opinion> opinion(row.size(), Opinion::kNone);
  std::vector<uint32_t> index(std::size_t(std::max(params.most, params.voters)));
  std::vector<float> square(index.size());
  const std::size_t kept = std::size_t(params.voters);
  std::vector<uint32_t> voters(row.size() * kept);  // found once, together with the neighbours
  std::vector<std::size_t> voter_count(row.size());
  for (std::size_t i = 0; i < row.size(); ++i) {
    std::size_t found = 0;
    for (int32_t k = params.neighbours; opinion[i] == Opinion::kNone; k = std::min(2 * k, params.most)) {
      found = tree.knnSearch(&cloud.xyz[3 * i], std::size_t(std::max(k, params.voters)), index.data(), square.data());
      opinion[i] = judge_plane(cloud, index.data(), std::min(found, std::size_t(k)), params);
      if (k == params.most || found < std::size_t(k)) break;
    }
    voter_count[i] = std::min(found, kept);
    std::copy_n(index.begin(), voter_count[i], voters.begin() + std::ptrdiff_t(i * kept));
  }
  for (std::size_t i = 0; i < row.size(); ++i) {
    int32_t obstacle = 0, ground = 0;
    for (std::size_t v = 0; v < voter_count[i]; ++v) {
      const Opinion o = opinion[voters[i * kept + v]];
      obstacle += o == Opinion::kObstacle, ground += o == Opinion::kGround;
    }
    nonground[row[i]] = obstacle == ground ? opinion[i] != Opinion::kGround : obstacle > ground;
  }
  return nonground;
}

}  // namespace overtake::baselines
