// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
#include "tools/sim/bvh.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace overtake::sim {
namespace {

constexpr int kBins = 16, kLeaf = 3, kDepthMost = 60;
constexpr double kGrow = 2e-3;  // metres: covers what float loses up to a few kilometres from the origin
constexpr double kRimTolerance = 1e-12;

double component(Vec3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

// Four floats that are computed with together (a vector type of g++ and clang; every machine of ours has one).
using Four = float __attribute__((vector_size(16)));
Four load(const float* p) { return Four{p[0], p[1], p[2], p[3]}; }

struct Box {
  Vec3 low{1e30, 1e30, 1e30}, high{-1e30, -1e30, -1e30};
  void add(Vec3 p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  void add(const Box& o) { add(o.low), add(o.high); }
  double area() const {
    const Vec3 e = high - low;
    return e.x < 0 ? 0 : e.x * e.y + e.y * e.z + e.z * e.x;
  }
};

Box box_of(const Triangle& t) {
  Box box;
  box.add(t.a), box.add(t.b), box.add(t.c);
  return box;
}

}  // namespace

Bvh::Bvh(const Mesh& mesh) : triangles_(mesh.triangles) {
  if (triangles_.empty()) return;
  Box all;
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const Triangle& t = triangles_[i];
    const Vec3 n = cross(t.b - t.a, t.c - t.a);
    const double size = length(n);
    normal_.push_back(size > 0 ? n * (1 / size) : Vec3{0, 0, 1});
    order_.push_back(int32_t(i));
    all.add(box_of(t));
  }
  center_ = (all.low + all.high) * 0.5;
  for (const Triangle& t : triangles_)
    for (const Vec3 p : {t.a, t.b, t.c}) radius_ = std::max(radius_, length(p - center_));
  branches_.reserve(2 * triangles_.size());
  branches_.emplace_back();
  split(0, 0, int32_t(triangles_.size()), 0);
  widen(0);
  branches_ = {};
  place_.resize(triangles_.size());
  for (const int32_t i : order_) {
    place_[std::size_t(i)] = int32_t(edges_.size());
    const Triangle& t = triangles_[std::size_t(i)];
    edges_.push_back({t.a, t.b - t.a, t.c - t.a, i});
  }
  order_.clear();
  order_.shrink_to_fit();
}

void Bvh::split(std::size_t branch, int32_t begin, int32_t end, int depth) {
  Box box, centers;
  for (int32_t i = begin; i < end; ++i) {
    const Box b = box_of(triangles_[std::size_t(order_[std::size_t(i)])]);
    box.add(b);
    centers.add((b.low + b.high) * 0.5);
  }
  for (int k = 0; k < 3; ++k) {
    branches_[branch].low[k] = float(component(box.low, k) - kGrow);
    branches_[branch].high[k] = float(component(box.high, k) + kGrow);
  }
  branches_[branch].first = begin;
  branches_[branch].count = end - begin;
  if (end - begin <= kLeaf || depth >= kDepthMost) return;

  double best = std::numeric_limits<double>::max();
  int best_axis = -1, best_bin = 0;
  const auto bin_of = [&](int32_t i, int axis) {
    const Box b = box_of(triangles_[std::size_t(i)]);
    const double low = component(centers.low, axis), size = component(centers.high, axis) - low;
    return std::min(kBins - 1, int((component((b.low + b.high) * 0.5, axis) - low) / size * kBins));
  };
  for (int axis = 0; axis < 3; ++axis) {
    if (component(centers.high, axis) - component(centers.low, axis) < 1e-9) continue;
    Box bins[kBins];
    int counts[kBins] = {};
    for (int32_t i = begin; i < end; ++i) {
      const int32_t t = order_[std::size_t(i)];
      const int b = bin_of(t, axis);
      bins[b].add(box_of(triangles_[std::size_t(t)]));
      ++counts[b];
    }
    double right_cost[kBins] = {};
    Box right;
    int right_count = 0;
    for (int b = kBins - 1; b > 0; --b) {
      if (counts[b]) right.add(bins[b]);
      right_count += counts[b];
      right_cost[b] = right.area() * right_count;
    }
    Box left;
    int left_count = 0;
    for (int b = 0; b + 1 < kBins; ++b) {
      if (counts[b]) left.add(bins[b]);
      left_count += counts[b];
      const double cost = left.area() * left_count + right_cost[b + 1];
      if (left_count > 0 && left_count < end - begin && cost < best) best = cost, best_axis = axis, best_bin = b;
    }
  }
  if (best_axis < 0) return;
  const auto middle = std::stable_partition(order_.begin() + begin, order_.begin() + end,
                                            [&](int32_t i) { return bin_of(i, best_axis) <= best_bin; });
  const int32_t cut = int32_t(middle - order_.begin());
  const std::size_t child = branches_.size();
  branches_.emplace_back();
  branches_.emplace_back();
  branches_[branch].first = int32_t(child);
  branches_[branch].count = 0;
  split(child, begin, cut, depth + 1);
  split(child + 1, cut, end, depth + 1);
}

// A node of four boxes: the branch's children, the largest of them replaced by theirs.
int32_t Bvh::widen(int32_t branch) {
  std::vector<int32_t> children{branch};
  while (children.size() < 4) {
    int32_t best = -1;
    float best_area = -1;
    for (std::size_t i = 0; i < children.size(); ++i) {
      const Branch& b = branches_[std::size_t(children[i])];
      const float x = b.high[0] - b.low[0], y = b.high[1] - b.low[1], z = b.high[2] - b.low[2];
      if (b.count == 0 && x * y + y * z + z * x > best_area) best = int32_t(i), best_area = x * y + y * z + z * x;
    }
    if (best < 0) break;
    const int32_t first = branches_[std::size_t(children[std::size_t(best)])].first;
    children[std::size_t(best)] = first;
    children.push_back(first + 1);
  }
  const std::size_t self = nodes_.size();
  nodes_.emplace_back();
  for (std::size_t i = 0; i < 4; ++i) {
    const bool used = i < children.size();
    const Branch b = branches_[std::size_t(used ? children[i] : branch)];
    for (int k = 0; k < 3; ++k) {
      nodes_[self].low[k][i] = used ? b.low[k] : 3e38f;  // met by no ray
      nodes_[self].high[k][i] = used ? b.high[k] : 3e38f;
    }
    nodes_[self].count[i] = used ? b.count : -1;
    const int32_t child = !used || b.count > 0 ? b.first : widen(children[i]);
    nodes_[self].child[i] = child;
  }
  return int32_t(self);
}

Hit Bvh::cast(Vec3 origin, Vec3 direction, double near_m, double far_m, int32_t likely) const {
  Hit hit;
  if (nodes_.empty()) return hit;
  double far = far_m;
  const float o[3] = {float(origin.x), float(origin.y), float(origin.z)};
  float inverse[3];
  for (int k = 0; k < 3; ++k) {
    const double d = component(direction, k);
    inverse[k] = float(1 / (std::fabs(d) > 1e-12 ? d : d < 0 ? -1e-12 : 1e-12));
  }
  float far_f = float(far * (1 + 1e-6));
  const auto meet = [&](const Edges& e) {
    const Vec3 p = cross(direction, e.ac);
    const double det = dot(e.ab, p);
    if (det == 0) return;
    const double inv = 1 / det;
    const Vec3 to = origin - e.a;
    const double u = dot(to, p) * inv;
    if (u < -kRimTolerance || u > 1 + kRimTolerance) return;
    const Vec3 q = cross(to, e.ab);
    const double v = dot(direction, q) * inv;
    if (v < -kRimTolerance || u + v > 1 + kRimTolerance) return;
    const double t = dot(e.ac, q) * inv;
    if (t <= near_m || t >= far_m) return;
    if (t < far || (t == far && e.index < hit.triangle)) {
      far = t;
      far_f = float(far * (1 + 1e-6));
      hit = {t, e.index};
    }
  };
  if (likely >= 0) meet(edges_[std::size_t(place_[std::size_t(likely)])]);
  struct Waiting {
    int32_t child, count;
    float entry;
  };
  Waiting stack[3 * kDepthMost + 8];
  int depth = 0;
  stack[depth++] = {0, 0, 0};
  while (depth > 0) {
    const Waiting top = stack[--depth];
    if (top.entry > far_f) continue;
    if (top.count == 0) {
      const Node& node = nodes_[std::size_t(top.child)];
      Four low{0, 0, 0, 0}, high{far_f, far_f, far_f, far_f};
      for (int k = 0; k < 3; ++k) {
        const Four u = (load(node.low[k]) - o[k]) * inverse[k], v = (load(node.high[k]) - o[k]) * inverse[k];
        const Four enter = u < v ? u : v, leave = u < v ? v : u;
        low = low < enter ? enter : low;
        high = high < leave ? high : leave;
      }
      const auto met = low <= high * 1.000001f;
      // The nearest on top of the stack.
      const int begin = depth;
      for (int i = 0; i < 4; ++i) {
        if (!met[i] || node.count[i] < 0) continue;
        int j = depth++;
        for (; j > begin && stack[j - 1].entry < low[i]; --j) stack[j] = stack[j - 1];
        stack[j] = {node.child[i], node.count[i], low[i]};
      }
      continue;
    }
    for (int32_t i = top.child; i < top.child + top.count; ++i) {
      meet(edges_[std::size_t(i)]);
    }
  }
  return hit;
}

Hit Bvh::cast_brute_force(Vec3 origin, Vec3 direction, double near_m, double far_m) const {
  Hit hit;
  double far = far_m;
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const Triangle& t = triangles_[i];
    const Vec3 n = cross(t.b - t.a, t.c - t.a);
    const double speed = dot(n, direction);
    if (speed == 0) continue;
    const double range = dot(n, t.a - origin) / speed;
    if (range <= near_m || range >= far) continue;
    const Vec3 p = origin + direction * range;
    const double slack = -1e-12 * dot(n, n);
    if (dot(n, cross(t.b - t.a, p - t.a)) < slack || dot(n, cross(t.c - t.b, p - t.b)) < slack ||
        dot(n, cross(t.a - t.c, p - t.c)) < slack)
      continue;
    far = range;
    hit = {range, int32_t(i)};
  }
  return hit;
}

}  // namespace overtake::sim
