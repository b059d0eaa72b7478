// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "core/circuit_map.h"

#include <cmath>
#include <limits>
#include <utility>

#include "core/math.h"
#include "core/mix.h"

namespace overtake {

namespace {

constexpr int32_t kLeafSegments = 8;
constexpr int32_t kHintSteps = 8;
constexpr double kCoincident_m = 1e-6;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNarrow_m = 1.0;  // a map that is nowhere wider has one bound twice, or no widths

// `i`: the wrong point, -1 none.
const char* find_fault(const double* x, const double* y, const double* left, const double* right, const double* banking,
                       int32_t count, int32_t& i) {
  if (count < 3) return "a track map needs at least 3 points";
  if (!x || !y || !left || !right) return "a track map needs columns x, y, width left and width right";
  double widest_m = 0.0;
  for (i = 0; i < count; ++i) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i]) || !std::isfinite(left[i]) || !std::isfinite(right[i]) ||
        (banking && !std::isfinite(banking[i])))
      return "a track map's value is not a finite number";
    if (std::fabs(x[i]) > kMaxMapCoordinate || std::fabs(y[i]) > kMaxMapCoordinate)
      return "a track map's point lies more than 1e8 m from the origin";
    if (banking && std::fabs(banking[i]) > kMaxMapBanking_rad)
      return "a track map's banking_rad is beyond 1 rad (degrees?)";
    if (left[i] < 0 || right[i] < 0) return "a track map's width is negative";
    if (left[i] > kMaxMapWidth || right[i] > kMaxMapWidth) return "a track map's width is over 4e8 m";
    if (i > 0 && hypot_f64(x[i] - x[i - 1], y[i] - y[i - 1]) < kCoincident_m)
      return "two neighbouring points of a track map are the same";
    widest_m = std::max(widest_m, left[i] + right[i]);
  }
  i = -1;
  if (widest_m < kNarrow_m) return "a track map is nowhere 1 m wide: no car fits between its bounds";
  return nullptr;
}

}  // namespace

std::string describe_fault(const char* sentence, const MapPoint& point) {
  if (point.index < 0) return std::string(sentence) + (*point.line ? std::string(" (") + point.line + ")" : "");
  return std::string(sentence) + " (" + (*point.line ? std::string(point.line) + ", " : "") + "point " +
         std::to_string(point.index) + ", from 0)";
}

bool CircuitMap::build(const double* x_m, const double* y_m, const double* width_left_m, const double* width_right_m,
                       const double* banking_rad, int32_t count, bool closed, const char** error, MapPoint* point) {
  const auto fail = [&](const char* sentence) {
    if (error) *error = sentence;
    return false;
  };
  int32_t wrong = -1;
  if (point) point->index = -1;
  if (const char* fault = find_fault(x_m, y_m, width_left_m, width_right_m, banking_rad, count, wrong)) {
    if (point) point->index = wrong;
    return fail(fault);
  }
  if (closed && hypot_f64(x_m[count - 1] - x_m[0], y_m[count - 1] - y_m[0]) < kCoincident_m && --count < 3)
    return fail("a track map needs at least 3 points");

  CircuitMap map;
  map.closed_ = closed;
  const auto copy = [&](const double* column, std::vector<double>& to) {
    to.assign(column, column + count);
    if (closed) to.push_back(column[0]);
  };
  copy(x_m, map.x_);
  copy(y_m, map.y_);
  copy(width_left_m, map.width_left_);
  copy(width_right_m, map.width_right_);
  if (banking_rad) {
    copy(banking_rad, map.banking_);
    map.has_banking_ = std::any_of(map.banking_.begin(), map.banking_.end(), [](double b) { return b != 0.0; });
  } else {
    map.banking_.assign(map.x_.size(), 0.0);
  }
  map.s_.assign(map.x_.size(), 0.0);
  for (std::size_t i = 1; i < map.x_.size(); ++i)
    map.s_[i] = map.s_[i - 1] + hypot_f64(map.x_[i] - map.x_[i - 1], map.y_[i] - map.y_[i - 1]);
  map.compute_headings();
  map.compute_boxes();
  *this = std::move(map);
  return true;
}

void CircuitMap::compute_boxes() {
  const int32_t n = segment_count(), leaves = (n + kLeafSegments - 1) / kLeafSegments;
  leaf_begin_ = 1;
  while (leaf_begin_ < leaves) leaf_begin_ *= 2;
  boxes_.assign(std::size_t(leaf_begin_) * 2, Box{kInfinity, kInfinity, -kInfinity, -kInfinity});  // empty: far away
  for (int32_t leaf = 0; leaf < leaves; ++leaf) {
    Box& box = boxes_[std::size_t(leaf_begin_ + leaf)];
    for (int32_t i = leaf * kLeafSegments; i <= std::min((leaf + 1) * kLeafSegments, n); ++i) {
      const std::size_t v = std::size_t(i);
      box = {std::min(box.min_x, x_[v]), std::min(box.min_y, y_[v]), std::max(box.max_x, x_[v]),
             std::max(box.max_y, y_[v])};
    }
  }
  for (std::size_t node = std::size_t(leaf_begin_) - 1; node > 0; --node) {
    const Box &a = boxes_[2 * node], &b = boxes_[2 * node + 1];
    boxes_[node] = {std::min(a.min_x, b.min_x), std::min(a.min_y, b.min_y), std::max(a.max_x, b.max_x),
                    std::max(a.max_y, b.max_y)};
  }
}

// The best segment so far. The distance to a box uses the operations of find_foot. Rounding is monotonic and a foot
// never leaves its segment's box, so no box is ever computed farther than a foot inside: pruning is exact.
struct CircuitMap::Nearest {
  const CircuitMap& map;
  double px, py;
  SegmentFoot foot{0.0, 0.0, 0.0, kInfinity};
  int32_t segment = -1;

  OVT_INLINE bool consider(int32_t i) {
    const double *x = map.x_.data() + i, *y = map.y_.data() + i;
    const SegmentFoot f = find_foot(x[0], y[0], x[1], y[1], px, py);
    if (f.distance2 > foot.distance2 || (f.distance2 == foot.distance2 && i >= segment)) return false;
    foot = f;
    segment = i;
    return true;
  }

  OVT_INLINE double box_distance2(int32_t node) const {
    const Box& b = map.boxes_[std::size_t(node)];
    const double dx = std::max(std::max(b.min_x - px, px - b.max_x), 0.0);
    const double dy = std::max(std::max(b.min_y - py, py - b.max_y), 0.0);
    return dx * dx + dy * dy;
  }

  // Walks downhill from the segment of an earlier answer, to both sides. This only tightens the bound before the
  // search.
  void follow_hint(int32_t hint) {
    const int32_t n = map.segment_count();
    if (hint < 0 || hint >= n) return;
    consider(hint);
    for (const int32_t step : {1, n - 1}) {
      int32_t i = hint;
      for (int32_t k = 0; k < kHintSteps; ++k) {
        i += step;
        if (i >= n) i -= n;
        if (!consider(i)) break;
      }
    }
  }

  void search_boxes() {
    struct Waiting {
      int32_t node;
      double distance2;
    } waiting[32];  // one per level
    int32_t waiting_count = 0, node = 1;
    const int32_t n = map.segment_count();
    for (;;) {
      while (node < map.leaf_begin_) {  // visits the nearer child, queues the other
        const Waiting left{2 * node, box_distance2(2 * node)}, right{2 * node + 1, box_distance2(2 * node + 1)};
        const bool right_first = right.distance2 < left.distance2;
        const Waiting nearer = right_first ? right : left, farther = right_first ? left : right;
        if (farther.distance2 <= foot.distance2) waiting[waiting_count++] = farther;
        node = nearer.node;
        if (nearer.distance2 > foot.distance2) break;
      }
      if (node >= map.leaf_begin_) {
        const int32_t begin = (node - map.leaf_begin_) * kLeafSegments;
        for (int32_t i = begin; i < std::min(begin + kLeafSegments, n); ++i) consider(i);
      }
      do {
        if (waiting_count == 0) return;
        --waiting_count;
      } while (waiting[waiting_count].distance2 > foot.distance2);
      node = waiting[waiting_count].node;
    }
  }

  // +1 left of the line, -1 right. At a corner both segments count: one alone is wrong behind a sharp corner.
  double side() const {
    const int32_t n = map.segment_count();
    const auto cross = [&](int32_t i) {
      const std::size_t a = std::size_t(i), b = a + 1;
      const double ux = map.x_[b] - map.x_[a], uy = map.y_[b] - map.y_[a];
      return (ux * (py - foot.y_m) - uy * (px - foot.x_m)) / hypot_f64(ux, uy);
    };
    double sum = cross(segment);
    if (foot.t == 1.0 && (map.closed_ || segment + 1 < n)) sum += cross(segment + 1 < n ? segment + 1 : 0);
    if (foot.t == 0.0 && (map.closed_ || segment > 0)) sum += cross(segment > 0 ? segment - 1 : n - 1);
    return sum < 0.0 ? -1.0 : 1.0;
  }

  bool beyond_the_ends() const {
    if (map.closed_) return false;
    const std::size_t last = std::size_t(map.segment_count());
    const auto along = [&](std::size_t a, std::size_t b, std::size_t from) {
      return (px - map.x_[from]) * (map.x_[b] - map.x_[a]) + (py - map.y_[from]) * (map.y_[b] - map.y_[a]);
    };
    return (segment == 0 && foot.t == 0.0 && along(0, 1, 0) < 0.0) ||
           (segment + 1 == int32_t(last) && foot.t == 1.0 && along(last - 1, last, last) > 0.0);
  }
};

MapProjection CircuitMap::project(double x_m, double y_m, int32_t hint) const noexcept {
  MapProjection out{0.0, kInfinity, 0.0, 0.0, 0.0, 0.0, false, -1};
  if (empty() || !(std::fabs(x_m) <= kMaxMapCoordinate && std::fabs(y_m) <= kMaxMapCoordinate)) return out;
  Nearest nearest{*this, x_m, y_m};
  nearest.follow_hint(hint);
  nearest.search_boxes();

  const std::size_t a = std::size_t(nearest.segment), b = a + 1;
  const double t = nearest.foot.t;
  out.segment = nearest.segment;
  out.s_m = mix(s_[a], s_[b], t);
  if (closed_ && out.s_m >= s_.back()) out.s_m = 0.0;
  out.d_m = nearest.side() * std::sqrt(nearest.foot.distance2);
  out.heading_rad = mix_angle(heading_[a], heading_[b], t);
  out.curvature_per_m = mix(curvature_[a], curvature_[b], t);
  out.width_left_m = mix(width_left_[a], width_left_[b], t);
  out.width_right_m = mix(width_right_[a], width_right_[b], t);
  out.inside = -out.width_right_m <= out.d_m && out.d_m <= out.width_left_m && !nearest.beyond_the_ends();
  return out;
}

double CircuitMap::measure_outside(double x_m, double y_m, int32_t* hint) const noexcept {
  const MapProjection place = project(x_m, y_m, *hint);
  if (place.segment < 0) return kInfinity;
  *hint = place.segment;
  if (place.inside) return 0.0;
  double ahead = 0.0, left = place.d_m;
  if (!closed_) {  // beyond an end, the edges continue straight
    const auto go_on = [&](std::size_t from, std::size_t to) {
      const double ux = x_[to] - x_[from], uy = y_[to] - y_[from], length = hypot_f64(ux, uy);
      const double px = x_m - x_[to], py = y_m - y_[to];
      const double along = (px * ux + py * uy) / length;
      if (along <= 0.0) return;
      ahead = along;
      left = (ux * py - uy * px) / length;
      if (from > to) left = -left;  // the point sees the line from behind
    };
    if (place.s_m <= 0.0) go_on(1, 0);
    if (place.s_m >= s_.back()) go_on(x_.size() - 2, x_.size() - 1);
  }
  const double aside = std::max({left - place.width_left_m, -left - place.width_right_m, 0.0});
  return hypot_f64(ahead, aside);
}

// The last segment that begins at s_m or before it, for s_m from 0 to the length.
int32_t CircuitMap::segment_of(double s_m, int32_t hint) const noexcept {
  const int32_t n = segment_count();
  if (hint >= 0 && hint < n) {
    const double* const s = s_.data();
    int32_t i = hint;
    for (int32_t k = 0; k <= kHintSteps; ++k) {
      if (s[i] > s_m)
        --i;
      else if (i + 1 < n && s[i + 1] <= s_m)
        ++i;
      else
        return i;
    }
  }
  return std::min(int32_t(std::upper_bound(s_.begin(), s_.end(), s_m) - s_.begin()), n) - 1;
}

double MapPose::cross_slope() const noexcept {
  double sine, cosine;
  sin_cos_f64(banking_rad, sine, cosine);
  return cosine > 0.1 ? sine / cosine : 0.0;
}

MapPose CircuitMap::at(double s_m, int32_t* hint) const noexcept {
  if (empty()) return {};
  const double length = s_.back();
  double s = s_m == s_m ? s_m : 0.0;
  if (closed_ && !(s >= 0.0 && s < length)) {  // else nothing to wrap, and no division
    const double turns = std::fabs(s / length) <= 1e15 ? s / length : 0.0;
    int64_t whole = int64_t(turns);
    if (double(whole) > turns) --whole;
    s = turns == 0.0 ? 0.0 : s - double(whole) * length;
  }
  s = std::clamp(s, 0.0, length);
  const int32_t segment = segment_of(s, hint ? *hint : -1);
  if (hint) *hint = segment;
  const std::size_t a = std::size_t(segment), b = a + 1;
  const double t = (s - s_[a]) / (s_[b] - s_[a]);
  return {mix(x_[a], x_[b], t),
          mix(y_[a], y_[b], t),
          mix_angle(heading_[a], heading_[b], t),
          mix(curvature_[a], curvature_[b], t),
          mix(width_left_[a], width_left_[b], t),
          mix(width_right_[a], width_right_[b], t),
          mix(banking_[a], banking_[b], t)};
}

}  // namespace overtake
