// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
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
using FourInts = int32_t __attribute__((vector_size(16)));
using Two = double __attribute__((vector_size(16)));
using TwoWords = int64_t __attribute__((vector_size(16)));
Four load(const float* p) { return Four{p[0], p[1], p[2], p[3]}; }
Four all_of(float v) { return Four{v, v, v, v}; }
Two both_of(double v) { return Two{v, v}; }
Four least(Four a, Four b) { return a < b ? a : b; }
Four greatest(Four a, Four b) { return a > b ? a : b; }
float least_of(Four v) {
  const float a = v[0] < v[1] ? v[0] : v[1], b = v[2] < v[3] ? v[2] : v[3];
  return a < b ? a : b;
}
// Bit 0: one of the first two lanes, bit 1: one of the last two.
int32_t halves_of(FourInts mask) {
  const TwoWords words = TwoWords(mask);
  return int32_t(words[0] != 0) | int32_t(words[1] != 0) << 1;
}

// Two rays' vectors, and their products by the same steps as Vec3's.
struct TwoVec {
  Two x, y, z;
  TwoVec operator-(Vec3 o) const { return {x - both_of(o.x), y - both_of(o.y), z - both_of(o.z)}; }
};
Two dot(Vec3 a, const TwoVec& b) { return both_of(a.x) * b.x + both_of(a.y) * b.y + both_of(a.z) * b.z; }
Two dot(const TwoVec& a, const TwoVec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
TwoVec cross(const TwoVec& a, Vec3 v) {
  const TwoVec b{both_of(v.x), both_of(v.y), both_of(v.z)};
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

float inverse_of(double d) { return float(1 / (std::fabs(d) > 1e-12 ? d : d < 0 ? -1e-12 : 1e-12)); }

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
  for (int k = 0; k < 3; ++k) inverse[k] = inverse_of(component(direction, k));
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

void Bvh::cast_pack(const Vec3* origin, const Vec3* direction, const double* near_m, const double* far_m,
                    int32_t likely, Hit* out) const {
  static_assert(kPack == 4);
  double far[kPack];
  Four o[3], inverse[3], far_f;
  TwoVec from[2], along[2];
  Two begin[2], end[2];
  float farthest = -1;
  for (int i = 0; i < kPack; ++i) {
    out[i] = Hit();
    far[i] = far_m[i];
    far_f[i] = float(far[i] * (1 + 1e-6));
    farthest = std::max(farthest, far_f[i]);
    for (int k = 0; k < 3; ++k) {
      o[k][i] = float(component(origin[i], k));
      inverse[k][i] = inverse_of(component(direction[i], k));
    }
    const int half = i / 2, lane = i % 2;
    from[half].x[lane] = origin[i].x, from[half].y[lane] = origin[i].y, from[half].z[lane] = origin[i].z;
    along[half].x[lane] = direction[i].x, along[half].y[lane] = direction[i].y, along[half].z[lane] = direction[i].z;
    begin[half][lane] = near_m[i], end[half][lane] = far_m[i];
  }
  if (nodes_.empty() || farthest <= 0) return;
  bool back[3], alike = true;  // whether the rays go backwards along an axis
  for (int k = 0; k < 3; ++k) {
    back[k] = inverse[k][0] < 0;
    for (int i = 1; i < kPack; ++i) alike = alike && (inverse[k][i] < 0) == back[k];
  }
  if (!alike) {  // rare: they do not enter boxes by the same sides
    for (int i = 0; i < kPack; ++i)
      if (far_m[i] > 0) out[i] = cast(origin[i], direction[i], near_m[i], far_m[i], likely);
    return;
  }
  const auto meet = [&](const Edges& e, int32_t halves) {
    for (int half = 0; half < 2; ++half) {
      if ((halves >> half & 1) == 0) continue;
      const TwoVec p = cross(along[half], e.ac);
      const Two inv = 1 / dot(e.ab, p);  // of a ray in the triangle's plane: infinite, and no comparison holds
      const TwoVec to = from[half] - e.a;
      const Two u = dot(to, p) * inv;
      const TwoVec q = cross(to, e.ab);
      const Two v = dot(along[half], q) * inv, t = dot(e.ac, q) * inv;
      const auto met = (u >= -kRimTolerance) & (u <= 1 + kRimTolerance) & (v >= -kRimTolerance) &
                       (u + v <= 1 + kRimTolerance) & (t > begin[half]) & (t < end[half]);
      if ((met[0] | met[1]) == 0) continue;
      for (int lane = 0; lane < 2; ++lane) {
        const int i = 2 * half + lane;
        if (met[lane] == 0 || !(t[lane] < far[i] || (t[lane] == far[i] && e.index < out[i].triangle))) continue;
        far[i] = t[lane];
        far_f[i] = float(far[i] * (1 + 1e-6));
        out[i] = {t[lane], e.index};
      }
    }
    farthest = std::max(std::max(far_f[0], far_f[1]), std::max(far_f[2], far_f[3]));
  };
  if (likely >= 0) meet(edges_[std::size_t(place_[std::size_t(likely)])], 3);
  struct Waiting {
    int32_t child, count;
    float entry;
    int32_t halves;
  };
  Waiting stack[3 * kDepthMost + 8];
  int depth = 0;
  stack[depth++] = {0, 0, 0, 3};
  while (depth > 0) {
    const Waiting top = stack[--depth];
    if (top.entry > farthest) continue;
    if (top.count > 0) {
      for (int32_t i = top.child; i < top.child + top.count; ++i) meet(edges_[std::size_t(i)], top.halves);
      continue;
    }
    const Node& node = nodes_[std::size_t(top.child)];
    const int first = depth;
    for (int c = 0; c < 4 && node.count[c] >= 0; ++c) {
      Four low = all_of(0), high = far_f;
      for (int k = 0; k < 3; ++k) {
        const float(*planes)[4] = back[k] ? node.high : node.low;
        const float(*others)[4] = back[k] ? node.low : node.high;
        low = greatest(low, (all_of(planes[k][c]) - o[k]) * inverse[k]);
        high = least(high, (all_of(others[k][c]) - o[k]) * inverse[k]);
      }
      const FourInts met = low <= high * 1.000001f;
      const int32_t halves = halves_of(met);
      if (halves == 0) continue;
      const float entry = least_of(met ? low : all_of(3e38f));
      int j = depth++;
      for (; j > first && stack[j - 1].entry < entry; --j) stack[j] = stack[j - 1];
      stack[j] = {node.child[c], node.count[c], entry, halves};
    }
  }
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
