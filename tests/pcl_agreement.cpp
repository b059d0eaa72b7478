// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Compares the Euclidean baseline with PCL, if PCL is installed: the same clusters on clouds of many kinds.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>

#include <cstdint>
#include <cstdio>
#include <map>
#include <random>
#include <vector>

#include "tools/evaluation/baselines/euclidean_clusters.h"

namespace {

std::vector<int32_t> cluster_with_pcl(const std::vector<float>& x, const std::vector<float>& y,
                                      const std::vector<float>& z, double radius) {
  const pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  for (std::size_t i = 0; i < x.size(); ++i) cloud->push_back(pcl::PointXYZ(x[i], y[i], z[i]));
  const pcl::search::KdTree<pcl::PointXYZ>::Ptr tree(new pcl::search::KdTree<pcl::PointXYZ>);
  pcl::EuclideanClusterExtraction<pcl::PointXYZ> extraction;
  extraction.setClusterTolerance(radius);
  extraction.setMinClusterSize(1);
  extraction.setMaxClusterSize(1 << 30);
  extraction.setSearchMethod(tree);
  extraction.setInputCloud(cloud);
  std::vector<pcl::PointIndices> clusters;
  extraction.extract(clusters);
  std::vector<int32_t> out(x.size(), -1);
  for (std::size_t c = 0; c < clusters.size(); ++c)
    for (const int i : clusters[c].indices) out[std::size_t(i)] = int32_t(c);
  return out;
}

// The numbering of the clusters may differ.
bool are_the_same(const std::vector<int32_t>& a, const std::vector<int32_t>& b) {
  std::map<int32_t, int32_t> to_b, to_a;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (to_b.emplace(a[i], b[i]).first->second != b[i] || to_a.emplace(b[i], a[i]).first->second != a[i]) return false;
  return true;
}

}  // namespace

int main() {
  std::mt19937 random(5);
  int32_t compared = 0, different = 0;
  for (int32_t round = 0; round < 24; ++round) {
    // Blobs like cars and lines like walls, on a field of 120 m.
    std::vector<float> x, y, z;
    std::normal_distribution<float> blob(0, 0.8f);
    std::uniform_real_distribution<float> place(-60, 60);
    for (int32_t k = 0; k < 12; ++k) {
      const float cx = place(random), cy = place(random);
      for (int32_t i = 0; i < 60; ++i)
        x.push_back(cx + blob(random)), y.push_back(cy + blob(random)), z.push_back(0.3f * blob(random));
    }
    for (int32_t i = 0; i < 800; ++i)
      x.push_back(place(random)), y.push_back(8 + 0.05f * blob(random)), z.push_back(0.5f + 0.3f * blob(random));
    for (const double radius : {0.2, 0.5, 1.0, 1.5, 3.0}) {
      const bool same =
          are_the_same(overtake::baselines::cluster_points(x, y, z, radius), cluster_with_pcl(x, y, z, radius));
      ++compared, different += !same;
      if (!same) std::printf("FAILED: round %d, radius %g\n", round, radius);
    }
  }
  std::printf("%d clouds and radii compared with PCL, %d differ\n", compared, different);
  return different == 0 ? 0 : 1;
}
