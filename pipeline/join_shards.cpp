// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Joins the clusters of one car: a car seen through gaps falls into several clusters.
//
// Two cars stay two. Nose to tail, the same part of both cars is a length and the distance between them apart, which is
// longer than the limit. Side by side, it is a width and the distance apart. A seed that is wider than a car is one car
// across the circuit; the limits are turned for it alone, so two cars side by side never become one of those. A seed
// that is longer than a car is wide, and whose smallest rectangle is clearly smaller than its box along the lane, is of
// a car at an angle: the axes are those of this rectangle. A few points nearer than a body of many are rain or spray in
// front of it, which would move its near end.
#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/math.h"
#include "pipeline/body_look.h"
#include "pipeline/cluster_places.h"
#include "pipeline/own_body.h"

namespace overtake {
namespace {

constexpr int32_t kFree = -1;
constexpr float kApronReach_m = 40.0f;  // farther away few cars on the apron fall into several clusters
constexpr float kInFront_m = 0.3f;      // rain or spray is nearer than a body by as much
constexpr float kRounding_m = 0.01f;
constexpr int32_t kCells = 32;  // to a side; places that many cells apart share a list

struct Group {
  float cos, sin;   // of the axes: psi_REF of the seed, or its smallest rectangle's
  OrientedBox box;  // on the axes
  float low_z, high_z;
  int32_t rows;
};

float gap_of(float low_a, float high_a, float low_b, float high_b) {
  return max_of(max_of(low_b - high_a, low_a - high_b), 0.0f);
}

struct Gaps {
  float along_m, across_m;
  bool is_within(float most_m) const { return along_m <= most_m && across_m <= most_m; }
};
Gaps find_gaps(const Group& group, const OrientedBox& box) {
  return {gap_of(group.box.low_1, group.box.high_1, box.low_1, box.high_1),
          gap_of(group.box.low_2, group.box.high_2, box.low_2, box.high_2)};
}

// The box of a row, whose axes differ by the angle between the headings, on the group's axes.
OrientedBox turn_box(const ClusterPlaceTable& places, int32_t row, const Group& group) {
  const float c = places.cos[row] * group.cos + places.sin[row] * group.sin;
  const float s = places.sin[row] * group.cos - places.cos[row] * group.sin;
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

bool is_inside(const OrientedBox& all, const OrientedBox& box) {
  return box.low_1 >= all.low_1 && box.high_1 <= all.high_1 && box.low_2 >= all.low_2 && box.high_2 <= all.high_2;
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
  // Lists the rows that may be joined, so without walls: in `order` by falling number of points, in `next` by place,
  // and by cells.
  void list_shards() {
    const float given_m = params_.bound_m;  // below 0: neither the circuit nor its apron
    const float bound_m = given_m < 0.0f ? given_m : max_of(given_m, float(find_outside(context_, frame_)));
    const CarLimits& limits = params_.limits;
    const float longest_side_m = kSqrt2F * max_of(limits.length_m, limits.width_m) + kRounding_m;
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
    cells_per_m_ = 1.0f / (longest_side_m + kSqrt2F * kRounding_m);
    std::fill_n(&first_[0][0], kCells * kCells, -1);
    for (int32_t k = 0; k < count_; ++k) {
      const int32_t row = places_.next[k];
      const OrientedBox box = box_of(places_, row);
      const float along = 0.5f * (box.low_1 + box.high_1), across = 0.5f * (box.low_2 + box.high_2);
      const float c = places_.cos[row], s = places_.sin[row];
      places_.next_x_m[k] = along * c - across * s;
      places_.next_y_m[k] = along * s + across * c;
      int32_t& first = first_[cell_of(places_.next_y_m[k])][cell_of(places_.next_x_m[k])];
      places_.next_in_cell[k] = first;
      first = k;
    }
  }

  // The middles of two rows that become one are less than a cell apart (list_near).
  int32_t cell_of(float at_m) const {
    constexpr float kFar = 1e6f;
    return int32_t(std::floor(max_of(min_of(at_m * cells_per_m_, kFar), -kFar))) & (kCells - 1);
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
    Group group = {places_.cos[seed],     places_.sin[seed],     box_of(places_, seed),
                   merged_.min_z_m[seed], merged_.max_z_m[seed], 1};
    const CarLimits& limits = params_.limits;
    const CarLimits across = {limits.width_m, limits.length_m, limits.height_m};
    const CarLimits* most = group.box.width() > limits.width_m ? &across : &limits;
    list_near(seed, group, *most);
    if (may_turn(group.box) && exceeds_with_any(group, *most) && turn_group(seed, group)) most = &limits;
    for (;;) {
      const int32_t near = find_nearest(seed, group, *most);
      if (near < 0) return group.rows - 1;
      const int32_t row = places_.next[places_.near[near]];
      places_.group[row] = seed;
      group.box = unite(group.box, near_box(near));
      group.low_z = min_of(group.low_z, merged_.min_z_m[row]);
      group.high_z = max_of(group.high_z, merged_.max_z_m[row]);
      ++group.rows;
    }
  }

  // Whether a seed is longer than a car is wide, so that it shows how the car stands.
  bool may_turn(const OrientedBox& seed) const { return max_of(seed.length(), seed.width()) > params_.limits.width_m; }

  // Whether the seed, alone in its group, and a listed row within join.gap_m of it exceed the limits together.
  bool exceeds_with_any(const Group& group, const CarLimits& most) const {
    for (int32_t near = 0; near < near_count_; ++near) {
      const OrientedBox box = near_box(near);
      if (!fits(most, unite(group.box, box)) && find_gaps(group, box).is_within(params_.gap_m)) return true;
    }
    return false;
  }

  // Turns the axes of a seed's group, and its list, to the smallest rectangle around the seed, if that is clearly
  // smaller than the box on psi_REF, and within the limits. Returns whether it did.
  bool turn_group(int32_t seed, Group& group) {
    constexpr float kClearly = 0.8f;  // a car at 5 deg
    Group turned = group;
    float smallest_m2 = kClearly * group.box.length() * group.box.width();
    for (int32_t h = 0; h < kCoarseHeadingCount; ++h) {
      const auto [c, s] = coarse_heading(h);
      const OrientedBox box = measure_box(frame_, seed, c, s);
      const float area_m2 = box.length() * box.width();
      if (!(area_m2 < smallest_m2)) continue;
      smallest_m2 = area_m2;
      const bool is_long = box.length() >= box.width();
      turned.cos = is_long ? c : 0.0f - s, turned.sin = is_long ? s : c;
      turned.box = is_long ? box : OrientedBox{box.low_2, box.high_2, 0.0f - box.high_1, 0.0f - box.low_1};
    }
    const bool is_turned = turned.cos != group.cos || turned.sin != group.sin;
    if (!is_turned || !fits(params_.limits, turned.box)) return false;
    group = turned;
    for (int32_t near = 0; near < near_count_; ++near) {
      const int32_t k = places_.near[near];
      put_near(near, k, measure_box(frame_, places_.next[k], group.cos, group.sin));
    }
    return true;
  }

  // Lists the free rows that may be joined to a seed, with their boxes on its axes, in no order. Rows that are no
  // longer free leave the cells.
  void list_near(int32_t seed, const Group& group, const CarLimits& most) {
    near_count_ = 0;
    const OrientedBox& own = group.box;
    const float c = group.cos, s = group.sin;
    const float diagonal_m = std::sqrt(most.length_m * most.length_m + most.width_m * most.width_m);
    const CarLimits reach = may_turn(own) ? CarLimits{diagonal_m, diagonal_m, most.height_m} : most;
    const float middle_1 = 0.5f * (own.low_1 + own.high_1), middle_2 = 0.5f * (own.low_2 + own.high_2);
    const int32_t cell_x = cell_of(middle_1 * c - middle_2 * s), cell_y = cell_of(middle_1 * s + middle_2 * c);
    for (int32_t n = 0; n < 9; ++n) {
      int32_t* link = &first_[(cell_y + n / 3 - 1) & (kCells - 1)][(cell_x + n % 3 - 1) & (kCells - 1)];
      while (*link >= 0) {
        const int32_t k = *link, row = places_.next[k];
        if (places_.group[row] != kFree) {
          *link = places_.next_in_cell[k];
          continue;
        }
        link = &places_.next_in_cell[k];
        if (is_in_front(row, seed)) continue;
        // How far apart the middles are at most: together both boxes are as large as the limits, at any angle if the
        // seed may be turned.
        const float x = places_.next_x_m[k], y = places_.next_y_m[k];
        if (abs_of(x * c + y * s - middle_1) > reach.length_m + kRounding_m ||
            abs_of(y * c - x * s - middle_2) > reach.width_m + kRounding_m)
          continue;
        put_near(near_count_++, k, turn_box(places_, row, group));
      }
    }
  }

  // Whether a row is rain or spray in front of a seed, as their sensor sees them: it has few points, and the seed many
  // times as many.
  bool is_in_front(int32_t row, int32_t seed) const {
    constexpr int32_t kFew = 8, kTimes = 50;
    const int32_t points = merged_.point_count[row];
    return points <= kFew && kTimes * points <= merged_.point_count[seed] &&
           merged_.main_sensor[row] == merged_.main_sensor[seed] &&
           merged_.nearest_m[row] < merged_.nearest_m[seed] - kInFront_m;
  }

  void put_near(int32_t near, int32_t k, const OrientedBox& box) {
    places_.near[near] = k;
    places_.near_low_1_m[near] = box.low_1, places_.near_high_1_m[near] = box.high_1;
    places_.near_low_2_m[near] = box.low_2, places_.near_high_2_m[near] = box.high_2;
  }
  OrientedBox near_box(int32_t near) const {
    return {places_.near_low_1_m[near], places_.near_high_1_m[near], places_.near_low_2_m[near],
            places_.near_high_2_m[near]};
  }

  // The place in the list of the row that is nearest to a group, -1 none. A group only grows, so a row that does not
  // fit leaves the list. Once the group has several rows, a row inside of it is joined at once: the group's box and
  // heights stay as they are.
  int32_t find_nearest(int32_t seed, Group& group, const CarLimits& most) {
    int32_t nearest = -1, left = 0;
    float nearest_m2 = 0.0f;
    for (int32_t n = 0; n < near_count_; ++n) {
      const int32_t k = places_.near[n], row = places_.next[k];
      if (places_.group[row] != kFree) continue;
      const OrientedBox box = near_box(n), both = unite(group.box, box);
      if (!fits(most, both)) continue;
      const float low_z = merged_.min_z_m[row], high_z = merged_.max_z_m[row];
      if (max_of(group.high_z, high_z) - min_of(group.low_z, low_z) > most.height_m) continue;
      if (group.rows > 1 && is_inside(group.box, box) && low_z >= group.low_z && high_z <= group.high_z) {
        places_.group[row] = seed;
        ++group.rows;
        continue;
      }
      const int32_t at = left++;
      put_near(at, k, box);
      const Gaps gaps = find_gaps(group, box);
      if (!gaps.is_within(params_.gap_m)) continue;
      const float gap_m2 = gaps.along_m * gaps.along_m + gaps.across_m * gaps.across_m;
      // Equal: the first by place.
      if (nearest >= 0 && !(gap_m2 < nearest_m2 || (gap_m2 == nearest_m2 && k < places_.near[nearest]))) continue;
      nearest = at;
      nearest_m2 = gap_m2;
    }
    near_count_ = left;
    return nearest;
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
  int32_t count_ = 0, near_count_ = 0;
  float cells_per_m_ = 0.0f;
  int32_t first_[kCells][kCells];  // of each cell's list, by y and x
};

}  // namespace

void join_shards(const StageContext& context, Frame& frame) noexcept { Joiner(context, frame).run(); }

}  // namespace overtake
