// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Joins the clusters of one car: a car seen through gaps falls into several clusters.
//
// Two cars stay two. Nose to tail, the same part of both cars is a length and the distance between them apart, which is
// longer than the limit. Side by side, it is a width and the distance apart. A seed that is wider than a car is one car
// across the circuit; the limits are turned for it alone, so two cars side by side never become one of those. Of a car
// that stands at an angle to the lane the box exceeds the limits; where two sensors see it whole, both boxes are the
// same.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>

#include "core/math.h"
#include "pipeline/body_look.h"
#include "pipeline/cluster_places.h"
#include "pipeline/own_body.h"

namespace overtake {
namespace {

constexpr int32_t kFree = -1;
constexpr float kApronReach_m = 40.0f;  // farther away few cars on the apron fall into several clusters
constexpr float kSame_m = 0.3f;         // two sensors do not see the same parts of an end
constexpr float kSqrt2 = 1.41421357f, kRounding_m = 0.01f;

struct Group {
  OrientedBox box;  // along psi_REF of the seed
  float low_z, high_z;
  float min_x, max_x;  // vehicle frame
  int32_t rows;
};

float gap_of(float low_a, float high_a, float low_b, float high_b) {
  return max_of(max_of(low_b - high_a, low_a - high_b), 0.0f);
}

// The box of a row, whose axes differ by the angle between the headings, on the seed's axes.
OrientedBox turn_box(const ClusterPlaceTable& places, int32_t row, int32_t seed) {
  const float c = places.cos[row] * places.cos[seed] + places.sin[row] * places.sin[seed];
  const float s = places.sin[row] * places.cos[seed] - places.cos[row] * places.sin[seed];
  const OrientedBox b = box_of(places, row);
  const float low_1c = min_of(b.low_1 * c, b.high_1 * c), high_1c = max_of(b.low_1 * c, b.high_1 * c);
  const float low_1s = min_of(b.low_1 * s, b.high_1 * s), high_1s = max_of(b.low_1 * s, b.high_1 * s);
  const float low_2c = min_of(b.low_2 * c, b.high_2 * c), high_2c = max_of(b.low_2 * c, b.high_2 * c);
  const float low_2s = min_of(b.low_2 * s, b.high_2 * s), high_2s = max_of(b.low_2 * s, b.high_2 * s);
  return {low_1c - high_2s, high_1c - low_2s, low_2c + low_1s, high_2c + high_1s};
}

OrientedBox unite(const OrientedBox& a, const OrientedBox& b) {
  return {min_of(a.low_1, b.low_1), max_of(a.high_1, b.high_1), min_of(a.low_2, b.low_2), max_of(a.high_2, b.high_2)};
}

class Joiner {
 public:
  Joiner(const StageContext& context, Frame& frame)
      : context_(context),
        params_(context.detect.join_shards),
        frame_(frame),
        merged_(frame.merged),
        places_(frame.places) {}

  void run() {
    list_shards();
    int32_t joins = 0;
    for (int32_t k = 0; k < count_; ++k) joins += grow(places_.order[k]);
    if (joins > 0) rewrite();
  }

 private:
  // Lists the rows that may be joined, so without walls: in `order` by falling number of points, in `next` by min_x.
  void list_shards() {
    const float given_m = params_.bound_m;  // below 0: neither the circuit nor its apron
    const float bound_m = given_m < 0.0f ? given_m : max_of(given_m, float(find_outside(context_, frame_)));
    const CarLimits& limits = params_.limits;
    const float longest_side_m = kSqrt2 * max_of(limits.length_m, limits.width_m) + kRounding_m;
    count_ = 0;
    for (int32_t row = 0; row < merged_.count; ++row) {
      places_.group[row] = row;
      if (!places_.known[row] || is_own_body(context_.detect.gate_cars.own, merged_, row)) continue;
      const float inside_m = measure_inside(places_, row, 0.0f);
      const bool on_apron = bound_m >= 0.0f && inside_m >= -kApron_m && merged_.nearest_m[row] <= kApronReach_m;
      if (inside_m < -bound_m && !on_apron) continue;
      // On axes at any angle, one side of a box is at least its longer side / sqrt 2: these fit into no group.
      const OrientedBox box = box_of(places_, row);
      if (max_of(box.length(), box.width()) > longest_side_m) continue;
      if (inside_m < -bound_m && !may_be_on_apron(row)) continue;
      places_.group[row] = kFree;
      places_.order[count_] = places_.next[count_] = row;
      ++count_;
    }
    std::sort(places_.order, places_.order + count_, [this](int32_t a, int32_t b) {
      const int32_t points_a = merged_.point_count[a], points_b = merged_.point_count[b];
      return points_a != points_b ? points_a > points_b : is_before(a, b);
    });
    std::sort(places_.next, places_.next + count_, [this](int32_t a, int32_t b) { return is_before(a, b); });
    longest_m_ = 0.0f;
    for (int32_t k = 0; k < count_; ++k) {
      const int32_t row = places_.next[k];
      longest_m_ = max_of(longest_m_, merged_.max_x_m[row] - merged_.min_x_m[row]);
      const Circle circle = surround(box_of(places_, row), row);
      places_.next_x_m[k] = circle.x_m;
      places_.next_y_m[k] = circle.y_m;
      places_.next_reach_m[k] = kSqrt2 * (circle.radius_m + params_.gap_m) + kRounding_m;
    }
  }

  // The circle around a box on the axes of a row's psi_REF, in the vehicle frame.
  struct Circle {
    float x_m, y_m, radius_m;
  };
  Circle surround(const OrientedBox& box, int32_t row) const {
    const float along = 0.5f * (box.low_1 + box.high_1), across = 0.5f * (box.low_2 + box.high_2);
    const float c = places_.cos[row], s = places_.sin[row];
    return {along * c - across * s, along * s + across * c,
            0.5f * std::sqrt(box.length() * box.length() + box.width() * box.width())};
  }

  // Of a car on the apron: as low as a car, and no smoke.
  bool may_be_on_apron(int32_t row) {
    const ClusterHeights heights = measure_heights(frame_, row);
    return heights.low_m <= context_.detect.gate_cars.lowest_m && heights.high_m <= context_.detect.gate_cars.top_m &&
           is_lit(context_, frame_, row);
  }

  // By place, so that the numbering of the sensors does not matter; the row decides only between equal places.
  bool is_before(int32_t a, int32_t b) const {
    return std::tie(merged_.min_x_m[a], merged_.min_y_m[a], merged_.min_z_m[a], a) <
           std::tie(merged_.min_x_m[b], merged_.min_y_m[b], merged_.min_z_m[b], b);
  }

  // Joins the nearest free rows to a free seed, one after the other. Returns how many.
  int32_t grow(int32_t seed) {
    if (places_.group[seed] != kFree) return 0;
    places_.group[seed] = seed;
    Group group = {box_of(places_, seed), merged_.min_z_m[seed], merged_.max_z_m[seed],
                   merged_.min_x_m[seed], merged_.max_x_m[seed], 1};
    const bool across = group.box.width() > params_.limits.width_m;
    int32_t joined = 0;
    for (;; ++joined) {
      const int32_t row = find_nearest(seed, group, across);
      if (row < 0) return joined;
      places_.group[row] = seed;
      group.box = unite(group.box, turn_box(places_, row, seed));
      group.low_z = min_of(group.low_z, merged_.min_z_m[row]);
      group.high_z = max_of(group.high_z, merged_.max_z_m[row]);
      group.min_x = min_of(group.min_x, merged_.min_x_m[row]);
      group.max_x = max_of(group.max_x, merged_.max_x_m[row]);
      ++group.rows;
    }
  }

  int32_t find_nearest(int32_t seed, const Group& group, bool across) const {
    const CarLimits& limits = params_.limits;
    const CarLimits turned = {limits.width_m, limits.length_m, limits.height_m}, &most = across ? turned : limits;
    // The gap of two turned boxes, of which the nearest points may lie up to a car's width inside.
    const float width_m = min_of(limits.width_m, limits.length_m);
    const float reach = max_of(1.5f * params_.gap_m, std::sqrt(params_.gap_m * params_.gap_m + width_m * width_m));
    const float first_x = group.min_x - reach - longest_m_, last_x = group.max_x + reach;
    const int32_t* const end = places_.next + count_;
    const int32_t* it = std::lower_bound<const int32_t*>(
        places_.next, end, first_x, [this](int32_t row, float x) { return merged_.min_x_m[row] < x; });
    // Most rows of this strip are far to one side. On each axis of the seed, a row's turned box ends a radius from its
    // middle at most. So where both gaps are small enough, the middles are no farther apart than half the diagonal of
    // the group and sqrt 2 times radius and gap.
    const Circle around = surround(group.box, seed);
    int32_t nearest = -1;
    float nearest_m2 = 0.0f;
    for (; it != end && merged_.min_x_m[*it] <= last_x; ++it) {
      const int32_t row = *it;
      const std::ptrdiff_t k = it - places_.next;
      const float dx = places_.next_x_m[k] - around.x_m, dy = places_.next_y_m[k] - around.y_m;
      const float most_m = places_.next_reach_m[k] + around.radius_m;
      if (dx * dx + dy * dy > most_m * most_m || places_.group[row] != kFree) continue;
      const OrientedBox box = turn_box(places_, row, seed);
      const float gap_1 = gap_of(group.box.low_1, group.box.high_1, box.low_1, box.high_1);
      const float gap_2 = gap_of(group.box.low_2, group.box.high_2, box.low_2, box.high_2);
      if (gap_1 > params_.gap_m || gap_2 > params_.gap_m) continue;
      if (max_of(group.high_z, merged_.max_z_m[row]) - min_of(group.low_z, merged_.min_z_m[row]) > limits.height_m)
        continue;
      const OrientedBox both = unite(group.box, box);
      const bool exceeds = !fits(most, group.box) || !fits(most, box);  // one of them alone
      if (!fits(most, both) && !(exceeds && group.rows == 1 && is_same(seed, row, box, both))) continue;
      const float gap_m2 = gap_1 * gap_1 + gap_2 * gap_2;
      if (nearest < 0 || gap_m2 < nearest_m2) {  // equal: the first by place
        nearest = row;
        nearest_m2 = gap_m2;
      }
    }
    return nearest;
  }

  // Whether another sensor than the seed's sees the same car in a row: the union of the two boxes is no larger than one
  // of them, and there is a heading along which it is one car.
  bool is_same(int32_t seed, int32_t row, const OrientedBox& box, const OrientedBox& both) const {
    const OrientedBox own = box_of(places_, seed);
    if ((merged_.sensor_mask[seed] & merged_.sensor_mask[row]) != 0 ||
        both.length() > max_of(own.length(), box.length()) + kSame_m ||
        both.width() > max_of(own.width(), box.width()) + kSame_m)
      return false;
    return fits_at_any_heading(params_.limits, [&](float c, float s) {
      return unite(measure_box(frame_, seed, c, s), measure_box(frame_, row, c, s));
    });
  }

  // Makes one row of each group, in the place of its first row.
  void rewrite() {
    int32_t* const first_row = places_.next;  // of each seed's group
    int32_t* const new_row = places_.order;
    std::fill_n(first_row, merged_.count, -1);
    int32_t rows = 0;
    for (int32_t row = 0; row < merged_.count; ++row) {
      const int32_t seed = places_.group[row];
      const bool is_first = first_row[seed] < 0;
      if (is_first) first_row[seed] = row;
      new_row[row] = is_first ? rows++ : new_row[first_row[seed]];
      if (is_first)
        move_row(row, new_row[row]);
      else
        places_.known[new_row[row]] = kJoined;
    }
    merged_.count = places_.count = rows;
    std::fill_n(merged_.first_member, rows, -1);
    MemberTable& members = frame_.members;
    for (int32_t m = members.count - 1; m >= 0; --m) {
      if (members.merged[m] < 0) continue;
      const int32_t row = members.merged[m] = new_row[members.merged[m]];
      members.next_member[m] = merged_.first_member[row];
      merged_.first_member[row] = m;
    }
    SeamSide sides[kMaxSensors];
    list_sides(context_, frame_, sides);
    int32_t hint = -1;
    for (int32_t row = 0; row < rows; ++row) {
      if (places_.known[row] != kJoined) continue;
      sum_up_members(sides, members, merged_, row);
      locate_cluster(context_, frame_, row, hint);
    }
    number_labels(context_, frame_);
  }

  void move_row(int32_t from, int32_t to) {
    if (from == to) return;
    for_each_column(merged_, [&](const char*, auto* column) { column[to] = column[from]; });
    // All but the scratch of this rule, whose rows are still those of before.
    const auto move = [&](auto*... column) { ((column[to] = column[from]), ...); };
    move(places_.known, places_.heading_rad, places_.s_m, places_.d_m, places_.width_left_m, places_.width_right_m,
         places_.cos, places_.sin, places_.low_1_m, places_.high_1_m, places_.low_2_m, places_.high_2_m);
  }

  static constexpr uint8_t kJoined = 2;  // of places.known, until the row is summed up

  const StageContext& context_;
  const JoinShardsParams& params_;
  Frame& frame_;
  FrameClusterTable& merged_;
  ClusterPlaceTable& places_;
  int32_t count_ = 0;
  float longest_m_ = 0.0f;  // along x
};

}  // namespace

void join_shards(const StageContext& context, Frame& frame) noexcept { Joiner(context, frame).run(); }

}  // namespace overtake
