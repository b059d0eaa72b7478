// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Clusters across sensors. Scenes are placed in the vehicle frame and seen through the sensors' true places; what the
// kernel is told of those places may differ.
#include "kernels/merge_seams.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/arena.h"
#include "core/table.h"
#include "kernels/build_clusters.h"

using namespace overtake;

namespace {

constexpr double kDegree = M_PI / 180;
constexpr int32_t kRows = 32;
using Ints = std::vector<int32_t>;

struct Place {
  double x, y, z, yaw_deg;
};

Transform transform_of(const Place& p) {
  Transform T;
  const double c = std::cos(p.yaw_deg * kDegree), s = std::sin(p.yaw_deg * kDegree);
  const double r[9] = {c, -s, 0, s, c, 0, 0, 0, 1}, t[3] = {p.x, p.y, p.z};
  for (int i = 0; i < 9; ++i) T.r[i] = float(r[i]);
  for (int i = 0; i < 3; ++i) T.t[i] = float(t[i]);
  return T;
}

SensorModel model_of(const Place& p, int32_t cols = 857, double fov_deg = 120) {
  SensorModel m;
  m.rows = kRows, m.cols = cols;
  m.azimuth_left_rad = float(fov_deg / 2 * kDegree);
  m.pitch_rad = float(fov_deg * kDegree / cols);
  m.wraps = fov_deg == 360;
  m.T_vehicle_sensor = transform_of(p);
  m.mounting_yaw_rad = float(p.yaw_deg * kDegree);
  return m;
}

struct Point {
  float x, y, z;  // sensor frame
  int32_t label, row, column;
  bool wins;
  int32_t time_offset_ns;
};

struct Sensor {
  Place place;  // the true one
  SensorModel model;
  bool present = true;
  int64_t stamp_ns = 0;
  int32_t cluster_capacity = 64;
  std::vector<Point> input;

  // A point of the sensor frame on a pixel. `wins` false: another point has the pixel.
  void put(int32_t row, int32_t column, float x, float y, float z, int32_t label, int32_t time_offset_ns = 0,
           bool wins = true) {
    input.push_back({x, y, z, label, row, column, wins, time_offset_ns});
  }
  // A point of the vehicle frame, if the sensor can see it. The first point on a pixel keeps it.
  bool see(double vx, double vy, double vz, int32_t row, int32_t label) {
    const double c = std::cos(place.yaw_deg * kDegree), s = std::sin(place.yaw_deg * kDegree);
    const double dx = vx - place.x, dy = vy - place.y;
    const double x = dx * c + dy * s, y = dy * c - dx * s;
    const double from_left = double(model.azimuth_left_rad) - std::atan2(y, x);
    const int32_t column = int32_t(std::floor(from_left / double(model.pitch_rad)));
    if (from_left < 0 || column >= model.cols) return false;
    for (const Point& p : input)
      if (p.row == row && p.column == column) return true;
    put(row, column, float(x), float(y), float(vz - place.z), label);
    return true;
  }
};

// The tables of a frame, filled by build_clusters and merge_seams.
struct Frame {
  std::vector<char> block;
  std::vector<RangeImages> images;
  std::vector<ScanTable> scan;
  std::vector<PointTable> points;
  std::vector<ClusterTable> clusters;
  std::vector<ClusterPointTable> cluster_points;
  std::vector<Ints> row_of_label;
  MemberTable members;
  MergedTable merged;
  SeamScratch scratch;
  int32_t overflow = -1;

  Frame(const std::vector<Sensor>& rig, const MergeSeamsParams& params, int32_t merged_capacity = 64)
      : images(rig.size()),
        scan(rig.size()),
        points(rig.size()),
        clusters(rig.size()),
        cluster_points(rig.size()),
        row_of_label(rig.size()) {
    const auto carve = [&](Carver& carver) {
      for (size_t s = 0; s < rig.size(); ++s) {
        const int32_t n = int32_t(rig[s].input.size());
        carve_range_images(carver, images[s], kRows, rig[s].model.cols);
        carve_table(carver, scan[s], n);
        carve_table(carver, points[s], n);
        carve_table(carver, clusters[s], 256);
        carve_table(carver, cluster_points[s], n);
      }
      carve_table(carver, members, 256 * int32_t(rig.size()));
      carve_table(carver, merged, merged_capacity);
      scratch.capacity = kRows * params.columns;
      for (int k = 0; k < 2; ++k) {
        for (float** v : {&scratch.x_m[k], &scratch.y_m[k], &scratch.z_m[k]})
          *v = carver.take<float>(size_t(scratch.capacity));
        scratch.member[k] = carver.take<int32_t>(size_t(scratch.capacity));
      }
      scratch.parent = carver.take<int32_t>(size_t(members.capacity));
      scratch.order = carver.take<int32_t>(size_t(merged_capacity));
    };
    Carver measure;
    carve(measure);
    block.assign(measure.bytes() + 64, 0x5a);
    Carver hand_out(reinterpret_cast<void*>((reinterpret_cast<uintptr_t>(block.data()) + 63) / 64 * 64));
    carve(hand_out);
    merged.capacity = merged_capacity;

    std::vector<SeamSide> sides(rig.size());
    for (size_t s = 0; s < rig.size(); ++s) {
      sides[s].sensor = &rig[s].model;
      if (!rig[s].present) continue;  // all else of an absent sensor is null
      fill(rig[s], s);
      sides[s] = {true,         &rig[s].model,          &images[s],     &scan[s], &points[s],
                  &clusters[s], row_of_label[s].data(), rig[s].stamp_ns};
    }
    overflow = ref::merge_seams(params, sides.data(), int32_t(rig.size()), members, merged, scratch);
  }

  void fill(const Sensor& sensor, size_t s) {
    for (int32_t r = 0; r < kRows; ++r)
      for (int32_t c = 0; c < sensor.model.cols; ++c) images[s].pixel_point.at(r, c) = kNoPoint;
    int32_t label_count = 0;
    for (const Point& p : sensor.input) {
      const int32_t i = scan[s].count++;
      scan[s].x_m[i] = p.x, scan[s].y_m[i] = p.y, scan[s].z_m[i] = p.z;
      scan[s].time_offset_ns[i] = p.time_offset_ns;
      points[s].range_m[i] = std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
      points[s].label[i] = p.label;
      if (p.wins) images[s].pixel_point.at(p.row, p.column) = i;
      label_count = std::max(label_count, p.label);
    }
    points[s].count = scan[s].count;
    clusters[s].capacity = sensor.cluster_capacity;
    row_of_label[s].resize(size_t(label_count) + 1);
    Ints cursor(row_of_label[s].size()), order(row_of_label[s].size());
    ref::build_clusters(sensor.model.T_vehicle_sensor, scan[s], points[s], label_count, clusters[s], cluster_points[s],
                        row_of_label[s].data(), cursor.data(), order.data());
  }

  Ints row_members(int32_t row) const {
    Ints list;
    for (int32_t m = merged.first_member[row]; m >= 0; m = members.next_member[m]) list.push_back(m);
    return list;
  }
};

// Front, left and right sensor of the AV-21, x y z yaw.
const Place kAv21[3] = {{2.342, 0, 0.646, 0}, {1.549, 0.267, 0.741, 120}, {1.549, -0.267, 0.741, -120}};
// The same with parallel edges 0.40 m apart at each of the three seams.
const Place kPaper[3] = {{0, 0, 0.7, 0}, {-0.34641, 0.2, 0.7, 120}, {-0.34641, -0.2, 0.7, -120}};

std::vector<Sensor> rig_of(const Place* places, int count = 3) {
  std::vector<Sensor> rig;
  for (int s = 0; s < count; ++s) rig.push_back({places[s], model_of(places[s]), true, 0, 64, {}});
  return rig;
}

// A wall straight across the seam between two sensors, `distance` along the seam's direction from the origin; every
// sensor labels what it sees of it 1.
void see_wall_across(std::vector<Sensor>& rig, double seam_deg, double distance) {
  const double c = std::cos(seam_deg * kDegree), s = std::sin(seam_deg * kDegree);
  for (double t = -2.5; t <= 2.5; t += 0.002)
    for (Sensor& sensor : rig) sensor.see(distance * c - t * s, distance * s + t * c, 0.7, 5, 1);
}

// An arc of radius 6 m round (1.8, 0), counter-clockwise.
void see_arc(std::vector<Sensor>& rig, double from_deg, double to_deg, int32_t label) {
  for (double a = from_deg; a <= to_deg; a += 0.05)
    for (Sensor& sensor : rig) sensor.see(1.8 + 6 * std::cos(a * kDegree), 6 * std::sin(a * kDegree), 0.7, 9, label);
}

MergeSeamsParams closer_than(float distance_m, int32_t columns = 1) { return {distance_m, columns}; }

// Two sensors facing apart, both with the vehicle's frame: what is put on edge pixels is where it says.
std::vector<Sensor> plain_rig(int32_t cols = 20, int sensors = 2) {
  std::vector<Sensor> rig;
  for (int s = 0; s < sensors; ++s) {
    const Place place{0, 0, 0, 90.0 - 360.0 / sensors * s};
    Sensor sensor{place, model_of(place, cols, 360.0 / sensors), true, 0, 64, {}};
    sensor.model.wraps = false;
    sensor.model.T_vehicle_sensor = Transform{};
    rig.push_back(sensor);
  }
  return rig;
}

}  // namespace

TEST_CASE("find_seams: three sensors of 120 deg have three seams, the rear one included") {
  SensorModel sensors[3];
  for (int s = 0; s < 3; ++s) sensors[s] = model_of(kAv21[s]);
  int32_t left[kMaxSensors], right[kMaxSensors];
  REQUIRE(find_seams(sensors, 3, left, right) == 3);
  // Each pair once: (left, front), (front, right), (right, left).
  CHECK(Ints(left, left + 3) == Ints{1, 0, 2});
  CHECK(Ints(right, right + 3) == Ints{0, 2, 1});
}

TEST_CASE("find_seams follows the azimuth, not the order of the sensors, and the middle of the image, not its x axis") {
  int32_t left[kMaxSensors], right[kMaxSensors];
  SensorModel sensors[4];
  const double yaw[4] = {180, 0, -90, 90};
  for (int s = 0; s < 4; ++s) sensors[s] = model_of({0, 0, 0, yaw[s]}, 100, 90);
  // The same view of the rear one by a sensor mounted ahead with its image from 225 to 135 deg.
  for (int turned : {0, 1}) {
    CAPTURE(turned);
    if (turned) sensors[0].mounting_yaw_rad = 0, sensors[0].azimuth_left_rad = float(225 * kDegree);
    REQUIRE(find_seams(sensors, 4, left, right) == 4);
    for (int i = 0; i < 4; ++i) {
      const int32_t want[4] = {3, 2, 0, 1};  // clockwise neighbour: rear -> left -> front -> right -> rear
      CHECK(right[i] == want[left[i]]);
    }
  }
}

TEST_CASE("find_seams: one sensor has no seam, two have both directions, wrapping ones have no edge") {
  SensorModel sensors[3] = {model_of({0, 0, 0, 0}), model_of({0, 0, 0, 170}), model_of({0, 0, 0, 90}, 857, 360)};
  int32_t left[kMaxSensors], right[kMaxSensors];
  CHECK(find_seams(sensors, 0, left, right) == 0);
  CHECK(find_seams(sensors, 1, left, right) == 0);
  CHECK(find_seams(sensors + 2, 1, left, right) == 0);
  for (int count : {2, 3}) {
    CAPTURE(count);
    REQUIRE(find_seams(sensors, count, left, right) == 2);
    CHECK(left[0] == right[1]);
    CHECK(left[1] == right[0]);
    CHECK(left[0] + left[1] == 1);
  }
  CHECK(find_seams(sensors + 1, 2, left, right) == 0);
}

TEST_CASE("the blind strips of the AV-21's mounting, 0.82 m in front and 0.53 m behind, are bridged by 1.80 m") {
  struct Strip {
    double seam_deg, distance, width;
    int32_t mask;
  };
  for (const Strip& strip : {Strip{60, 12, 0.8203, 3}, Strip{-60, 12, 0.8203, 5}, Strip{180, 10, 0.534, 6}}) {
    CAPTURE(strip.seam_deg);
    std::vector<Sensor> rig = rig_of(kAv21);
    see_wall_across(rig, strip.seam_deg, strip.distance);
    const Frame one(rig, closer_than(1.80f));
    REQUIRE(one.merged.count == 1);
    CHECK(one.merged.sensor_mask[0] == strip.mask);
    CHECK(one.members.count == 2);
    // The strip is as wide as it is said to be: an edge column is 3 cm wide out there.
    CHECK(Frame(rig, closer_than(float(strip.width) - 0.01f)).merged.count == 2);
    CHECK(Frame(rig, closer_than(float(strip.width) + 0.07f)).merged.count == 1);
  }
}

TEST_CASE("the blind strip of 0.40 m of the paper is bridged by 1.80 m at every seam") {
  for (double seam_deg : {60.0, -60.0, 180.0}) {
    CAPTURE(seam_deg);
    std::vector<Sensor> rig = rig_of(kPaper);
    see_wall_across(rig, seam_deg, 12);
    CHECK(Frame(rig, closer_than(1.80f)).merged.count == 1);
    CHECK(Frame(rig, closer_than(0.39f)).merged.count == 2);
    CHECK(Frame(rig, closer_than(0.47f)).merged.count == 1);
  }
}

TEST_CASE("merging is transitive: one object seen by three sensors over the front and the rear seam") {
  std::vector<Sensor> rig = rig_of(kAv21);
  see_arc(rig, 30, 215, 1);
  const Frame f(rig, {});
  REQUIRE(f.merged.count == 1);
  CHECK(f.merged.sensor_mask[0] == 7);
  CHECK(f.merged.main_sensor[0] == 1);
  CHECK(f.row_members(0) == Ints{0, 1, 2});
  CHECK(f.merged.point_count[0] ==
        f.clusters[0].point_count[0] + f.clusters[1].point_count[0] + f.clusters[2].point_count[0]);
  CHECK(f.merged.max_y_m[0] == doctest::Approx(6).epsilon(1e-3));
  CHECK(f.merged.min_x_m[0] == doctest::Approx(-4.194).epsilon(1e-3));  // the strip hides what lies due west
  // All round: over all three seams, one object still.
  std::vector<Sensor> ring = rig_of(kAv21);
  see_arc(ring, 0, 360, 1);
  CHECK(Frame(ring, {}).merged.count == 1);
}

TEST_CASE("objects at different seams stay apart") {
  std::vector<Sensor> rig = rig_of(kAv21);
  see_arc(rig, 55, 80, 1);
  see_arc(rig, 170, 190, 2);
  see_arc(rig, -80, -55, 3);
  const Frame f(rig, {});
  REQUIRE(f.merged.count == 3);
  // By first member: front's clusters are 1 (left seam) and 3 (right seam), the rear one begins with the left sensor.
  CHECK(f.merged.sensor_mask[0] == 3);
  CHECK(f.merged.sensor_mask[1] == 5);
  CHECK(f.merged.sensor_mask[2] == 6);
}

TEST_CASE("a missing sensor breaks nothing and joins nothing") {
  for (int missing = 0; missing < 3; ++missing) {
    CAPTURE(missing);
    std::vector<Sensor> rig = rig_of(kAv21);
    see_arc(rig, 0, 360, 1);
    rig[size_t(missing)].present = false;
    const Frame f(rig, {});
    // The two that are left have their own seam.
    CHECK(f.members.count == 2);
    REQUIRE(f.merged.count == 1);
    CHECK(f.merged.sensor_mask[0] == (7 & ~(1 << missing)));
  }
  // Without the left sensor its two neighbours are not neighbours of each other, however close their edges' points are.
  std::vector<Sensor> rig = plain_rig(20, 3);
  rig[0].put(0, 19, 10, 0, 0, 1);
  rig[2].put(0, 0, 10, 1, 0, 1);
  rig[1].present = false;
  CHECK(Frame(rig, {}).merged.count == 2);
  std::vector<Sensor> none = plain_rig(20, 3);
  for (Sensor& s : none) s.present = false;
  CHECK(Frame(none, {}).merged.count == 0);
}

TEST_CASE("small errors of the extrinsics, 0.2 deg and 2 cm, still merge") {
  for (double seam_deg : {60.0, -60.0, 180.0})
    for (int signs = 0; signs < 64; ++signs) {
      CAPTURE(seam_deg);
      CAPTURE(signs);
      std::vector<Sensor> rig = rig_of(kAv21);
      see_wall_across(rig, seam_deg, 25);
      for (size_t s = 0; s < 3; ++s) {
        Place wrong = rig[s].place;
        wrong.yaw_deg += signs >> (2 * s) & 1 ? 0.2 : -0.2;
        wrong.x += signs >> (2 * s + 1) & 1 ? 0.02 : -0.02;
        wrong.y += signs >> (2 * s) & 1 ? -0.02 : 0.02;
        wrong.z += 0.02;
        rig[s].model.T_vehicle_sensor = transform_of(wrong);
        rig[s].model.mounting_yaw_rad = float(wrong.yaw_deg * kDegree);
      }
      CHECK(Frame(rig, {}).merged.count == 1);
    }
}

TEST_CASE("only the right edge of the left sensor meets the left edge of the right one") {
  // Two sensors: 0 looks left (+90), 1 right (-90). Each is the left neighbour of the other at one seam.
  const auto merged = [](int32_t column_0, int32_t column_1, int32_t columns) {
    std::vector<Sensor> rig = plain_rig();
    rig[0].put(3, column_0, 10, 0.2f, 0, 1);
    rig[1].put(7, column_1, 10, -0.2f, 0, 1);
    return Frame(rig, closer_than(1.8f, columns)).merged.count == 1;
  };
  CHECK(merged(19, 0, 1));         // the front seam
  CHECK(merged(0, 19, 1));         // the rear seam
  CHECK_FALSE(merged(0, 0, 1));    // left edges
  CHECK_FALSE(merged(19, 19, 1));  // right edges
  CHECK_FALSE(merged(18, 0, 1));
  CHECK_FALSE(merged(19, 1, 1));
  // K = 8 columns on either side.
  CHECK(merged(12, 7, 8));
  CHECK_FALSE(merged(11, 7, 8));
  CHECK_FALSE(merged(12, 8, 8));
  CHECK(merged(3, 12, 40));  // more columns than the image has: all of them
}

TEST_CASE("closer than the limit is strict, and measured in three dimensions") {
  const auto merged = [](float dx, float dy, float dz) {
    std::vector<Sensor> rig = plain_rig();
    rig[0].put(0, 19, 10, 1, 2, 1);
    rig[1].put(0, 0, 10 + dx, 1 + dy, 2 + dz, 1);
    return Frame(rig, closer_than(2.0f)).merged.count == 1;
  };
  const float under = 2.0f - 1e-5f;
  for (float sign : {-1.0f, 1.0f}) {
    CHECK_FALSE(merged(sign * 2, 0, 0));
    CHECK_FALSE(merged(0, sign * 2, 0));
    CHECK_FALSE(merged(0, 0, sign * 2));
    CHECK(merged(sign * under, 0, 0));
    CHECK(merged(0, sign * under, 0));
    CHECK(merged(0, 0, sign * under));
  }
  CHECK(merged(1.1f, 1.1f, 1.1f));        // 1.905
  CHECK_FALSE(merged(1.2f, 1.2f, 1.2f));  // 2.078
}

TEST_CASE("a point counts at a seam only as its pixel's winner and with a cluster's label of its own") {
  const auto merged = [](int32_t label, bool wins) {
    std::vector<Sensor> rig = plain_rig();
    rig[0].put(0, 5, 9, 0, 0, 1);  // the rest of the cluster, away from the seam
    rig[0].put(0, 19, 10, 0, 0, label, 0, wins);
    rig[1].put(0, 0, 10, 1, 0, 1);
    return Frame(rig, {}).merged.count == 1;
  };
  CHECK(merged(1, true));
  CHECK_FALSE(merged(1, false));
  CHECK_FALSE(merged(kLabelGround, true));
  CHECK_FALSE(merged(kLabelNone, true));
}

TEST_CASE("a cluster that found no row in its sensor's table takes no part") {
  std::vector<Sensor> rig = plain_rig();
  rig[0].put(0, 19, 10, 0, 0, 1);
  rig[0].put(1, 3, 5, 0, 0, 2);
  rig[1].put(0, 0, 10, 1, 0, 1);
  rig[0].cluster_capacity = 1;  // keeps label 2, the nearer one
  const Frame f(rig, {});
  CHECK(f.members.count == 2);
  CHECK(f.merged.count == 2);
}

TEST_CASE("two clusters of one sensor are not joined by nearness, but are by a neighbour's cluster") {
  std::vector<Sensor> rig = plain_rig();
  rig[0].put(0, 19, 10, 0, 0, 1);
  rig[0].put(1, 19, 10, 0.1f, 0, 2);
  CHECK(Frame(rig, {}).merged.count == 2);
  rig[1].put(0, 0, 10, 1, 0, 1);
  const Frame f(rig, {});
  REQUIRE(f.merged.count == 1);
  CHECK(f.row_members(0) == Ints{0, 1, 2});
}

TEST_CASE("one sensor, wrapping or not: every cluster is a row, sums and stamp its own") {
  for (bool wraps : {false, true}) {
    CAPTURE(wraps);
    std::vector<Sensor> rig = plain_rig(20, 1);
    rig[0].model.wraps = wraps;
    rig[0].stamp_ns = 1000;
    rig[0].put(0, 0, 10, 0, 0, 1, 10);
    rig[0].put(0, 19, 10, 1, 4, 2, 20);
    rig[0].put(1, 19, 12, 2, 2, 2, 31);
    const Frame f(rig, {});
    REQUIRE(f.merged.count == 2);
    CHECK(f.merged.center_x_m[1] == 11);
    CHECK(f.merged.center_y_m[1] == 1.5f);
    CHECK(f.merged.center_z_m[1] == 3);
    CHECK(f.merged.point_count[1] == 2);
    CHECK(f.merged.stamp_ns[0] == 1010);
    CHECK(f.merged.stamp_ns[1] == 1025);  // 1025.5 rounds down
    CHECK(f.merged.nearest_m[1] == f.points[0].range_m[1]);
    CHECK(f.merged.sensor_mask[1] == 1);
    CHECK(f.members.next_member[0] == -1);
  }
}

TEST_CASE("a merged cluster's stamp is the floor of the mean of its points' stamps, over sensors and for any stamps") {
  constexpr int64_t kLow = std::numeric_limits<int64_t>::min(), kHigh = std::numeric_limits<int64_t>::max();
  const auto stamp = [](int64_t stamp_0, int32_t points_0, int64_t stamp_1, int32_t points_1, int32_t offset) {
    std::vector<Sensor> rig = plain_rig();
    rig[0].stamp_ns = stamp_0, rig[1].stamp_ns = stamp_1;
    for (int32_t i = 0; i < points_0; ++i) rig[0].put(i, 19, 10, 0, 0, 1, offset);
    for (int32_t i = 0; i < points_1; ++i) rig[1].put(i, 0, 10, 1, 0, 1, offset);
    const Frame f(rig, {});
    REQUIRE(f.merged.count == 1);
    return f.merged.stamp_ns[0];
  };
  CHECK(stamp(100, 3, 200, 1, 0) == 125);     // weighed by points
  CHECK(stamp(100, 1, 201, 2, 5) == 172);     // 172.33
  CHECK(stamp(-100, 1, -201, 2, 0) == -168);  // -167.33 rounds toward minus infinity
  CHECK(stamp(-3, 1, 3, 1, 0) == 0);
  const int64_t now = 1767225600123456789;
  CHECK(stamp(now, 20, now + 1, 20, 0) == now);
  CHECK(stamp(now, 1, now + 50000000, 31, -7) == now + 48437500 - 7);
  CHECK(stamp(kHigh, 32, kHigh, 32, 0) == kHigh);
  CHECK(stamp(kLow, 32, kLow, 32, 0) == kLow);
  CHECK(stamp(kLow, 16, kHigh, 16, 0) == -1);
  CHECK(stamp(kHigh, 2, kHigh, 2, 1000) == kHigh);  // saturates
  CHECK(stamp(kLow, 2, kLow, 2, -1000) == kLow);
}

TEST_CASE("the main sensor saw most of the points; ties go to the lower one") {
  for (int extra : {0, 1}) {
    std::vector<Sensor> rig = plain_rig();
    for (int32_t r = 0; r < 4; ++r) rig[0].put(r, 19, 10, 0, 0, 1);
    for (int32_t r = 0; r < 4 + extra; ++r) rig[1].put(r, 0, 10, 1, 0, 1);
    CHECK(Frame(rig, {}).merged.main_sensor[0] == extra);
  }
}

TEST_CASE("with more merged clusters than rows the nearest are kept, in order; ties go to the earlier one") {
  std::vector<Sensor> rig = plain_rig();
  //                                        member  range
  rig[0].put(0, 5, 40, 0, 0, 1);   //  0       40
  rig[0].put(1, 5, 20, 0, 0, 2);   //  1       20
  rig[0].put(2, 19, 60, 0, 0, 3);  //  2       60, with member 5: 59
  rig[0].put(3, 5, 0, 20, 0, 4);   //  3       20
  rig[1].put(0, 5, 10, 0, 0, 1);   //  4       10
  rig[1].put(1, 0, 59, 0, 0, 2);   //  5
  rig[1].put(2, 5, 0, 0, 20, 3);   //  6       20
  const auto rows = [&](int32_t capacity) {
    const Frame f(rig, {}, capacity);
    CHECK(f.overflow == 6 - f.merged.count);
    Ints merged(f.members.merged, f.members.merged + f.members.count);
    for (int32_t row = 0; row < f.merged.count; ++row)
      for (int32_t m : f.row_members(row)) CHECK(merged[size_t(m)] == row);
    for (int32_t m = 0; m < f.members.count; ++m)
      if (merged[size_t(m)] < 0) CHECK(f.members.next_member[m] == -1);
    return merged;
  };
  CHECK(rows(6) == Ints{0, 1, 2, 3, 4, 2, 5});
  CHECK(rows(5) == Ints{0, 1, -1, 2, 3, -1, 4});
  CHECK(rows(4) == Ints{-1, 0, -1, 1, 2, -1, 3});
  CHECK(rows(3) == Ints{-1, 0, -1, 1, 2, -1, -1});
  CHECK(rows(2) == Ints{-1, 0, -1, -1, 1, -1, -1});
  CHECK(rows(1) == Ints{-1, -1, -1, -1, 0, -1, -1});
  CHECK(rows(0) == Ints{-1, -1, -1, -1, -1, -1, -1});
}

TEST_CASE("merge_seams agrees with a brute-force search on random clouds") {
  for (uint32_t seed = 1; seed <= 300; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    const auto below = [&](uint32_t n) { return int32_t(random() % n); };
    const int sensors = 1 + below(8);
    const int32_t columns = 1 + below(6), labels = 1 + below(6), capacity = below(4) ? 64 : below(6);
    std::vector<Sensor> rig = plain_rig(5 + below(10), sensors);
    std::vector<int> clockwise;  // sensor at each place round the vehicle
    for (int s = 0; s < sensors; ++s) clockwise.push_back(s);
    std::shuffle(clockwise.begin(), clockwise.end(), random);
    for (int i = 0; i < sensors; ++i) {
      Sensor& s = rig[size_t(clockwise[size_t(i)])];
      s.model.mounting_yaw_rad = float((180 - 360.0 / sensors * (i + 0.5)) * kDegree);
      s.model.T_vehicle_sensor = transform_of({double(below(5)), double(below(5)), 0, double(below(360))});
      s.present = below(6) > 0;
      s.stamp_ns = 1700000000000000000 + below(100000000);
      const int n = below(120);
      for (int k = 0; k < n; ++k) {
        const int32_t row = below(kRows), column = below(uint32_t(s.model.cols)),
                      label = below(uint32_t(labels) + 2) - 1;
        const float x = float(below(4000)) / 200, y = float(below(4000)) / 200, z = float(below(800)) / 200;
        const bool taken = std::any_of(s.input.begin(), s.input.end(),
                                       [&](const Point& p) { return p.row == row && p.column == column; });
        s.put(row, column, x, y, z, label, below(50000000), !taken);
      }
    }
    const MergeSeamsParams params = closer_than(0.3f + float(below(200)) / 100, columns);
    const Frame f(rig, params, capacity);

    // Members, and their groups: relabel until nothing changes.
    struct Member {
      int sensor;
      int32_t label;
      Ints points;
      int group;
    };
    std::vector<Member> want;
    for (int s = 0; s < sensors; ++s)
      for (int32_t label = 1; rig[size_t(s)].present && label <= labels; ++label) {
        Member m{s, label, {}, int(want.size())};
        for (size_t i = 0; i < rig[size_t(s)].input.size(); ++i)
          if (rig[size_t(s)].input[i].label == label) m.points.push_back(int32_t(i));
        if (!m.points.empty()) want.push_back(m);
      }
    const auto place = [&](int s, int32_t i, float out[3]) {
      const Point& p = rig[size_t(s)].input[size_t(i)];
      const Transform& T = rig[size_t(s)].model.T_vehicle_sensor;
      for (int a = 0; a < 3; ++a) out[a] = T.r[3 * a] * p.x + T.r[3 * a + 1] * p.y + T.r[3 * a + 2] * p.z + T.t[a];
    };
    const auto touch = [&](const Member& a, const Member& b) {  // a's right edge, b's left edge
      if (a.sensor == b.sensor) return false;
      const auto at = std::find(clockwise.begin(), clockwise.end(), a.sensor) - clockwise.begin();
      if (clockwise[size_t(at + 1) % size_t(sensors)] != b.sensor) return false;
      for (int32_t i : a.points)
        for (int32_t k : b.points) {
          const Point &p = rig[size_t(a.sensor)].input[size_t(i)], &q = rig[size_t(b.sensor)].input[size_t(k)];
          if (!p.wins || !q.wins || p.column < rig[size_t(a.sensor)].model.cols - columns || q.column >= columns)
            continue;
          float u[3], v[3];
          place(a.sensor, i, u), place(b.sensor, k, v);
          const float dx = u[0] - v[0], dy = u[1] - v[1], dz = u[2] - v[2];
          if (dx * dx + dy * dy + dz * dz < params.distance_m * params.distance_m) return true;
        }
      return false;
    };
    for (bool changed = true; changed;) {
      changed = false;
      for (Member& a : want)
        for (Member& b : want)
          if (a.group != b.group && touch(a, b)) {
            const int to = std::min(a.group, b.group), from = std::max(a.group, b.group);
            for (Member& m : want)
              if (m.group == from) m.group = to;
            changed = true;
          }
    }

    // Groups in order of their first member; with too many, the nearest.
    struct Group {
      int first;
      float nearest;
    };
    std::vector<Group> groups;
    for (int i = 0; i < int(want.size()); ++i) {
      if (want[size_t(i)].group != i) continue;
      Group g{i, 1e9f};
      for (const Member& m : want)
        for (int32_t p : m.points)
          if (m.group == i) g.nearest = std::min(g.nearest, f.points[size_t(m.sensor)].range_m[p]);
      groups.push_back(g);
    }
    const int32_t found = int32_t(groups.size());
    std::stable_sort(groups.begin(), groups.end(),
                     [](const Group& a, const Group& b) { return a.nearest < b.nearest; });
    groups.resize(size_t(std::min(found, capacity)));
    std::sort(groups.begin(), groups.end(), [](const Group& a, const Group& b) { return a.first < b.first; });

    CHECK(f.overflow == found - int32_t(groups.size()));
    REQUIRE(f.members.count == int32_t(want.size()));
    REQUIRE(f.merged.count == int32_t(groups.size()));
    for (int32_t m = 0; m < f.members.count; ++m) {
      const Member& w = want[size_t(m)];
      CHECK(f.members.sensor[m] == w.sensor);
      CHECK(f.clusters[size_t(w.sensor)].label[f.members.cluster[m]] == w.label);
      int32_t row = -1;
      for (size_t g = 0; g < groups.size(); ++g)
        if (groups[g].first == w.group) row = int32_t(g);
      CHECK(f.members.merged[m] == row);
    }
    for (int32_t row = 0; row < f.merged.count; ++row) {
      Ints list, points_of(8, 0);
      long double sum[3] = {}, magnitude = 0, stamp = 0;
      float low[3] = {1e9f, 1e9f, 1e9f}, high[3] = {-1e9f, -1e9f, -1e9f};
      int32_t mask = 0, count = 0;
      for (int32_t m = 0; m < f.members.count; ++m) {
        if (f.members.merged[m] != row) continue;
        list.push_back(m);
        const int s = want[size_t(m)].sensor;
        mask |= 1 << s;
        for (int32_t i : want[size_t(m)].points) {
          float p[3];
          place(s, i, p);
          for (int a = 0; a < 3; ++a) {
            sum[a] += p[a], magnitude += std::fabs(p[a]);
            low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
          }
          stamp += (long double)(rig[size_t(s)].stamp_ns - 1700000000000000000) +
                   rig[size_t(s)].input[size_t(i)].time_offset_ns;
          ++points_of[size_t(s)], ++count;
        }
      }
      CHECK(f.row_members(row) == list);
      CHECK(f.merged.point_count[row] == count);
      CHECK(f.merged.sensor_mask[row] == mask);
      CHECK(f.merged.main_sensor[row] == std::max_element(points_of.begin(), points_of.end()) - points_of.begin());
      CHECK(f.merged.stamp_ns[row] == 1700000000000000000 + int64_t(std::floor(stamp / count)));
      const long double bound = 32 * 0x1p-24L * magnitude / count + 1e-9L;
      CHECK(std::fabs((long double)f.merged.center_x_m[row] - sum[0] / count) <= bound);
      CHECK(std::fabs((long double)f.merged.center_y_m[row] - sum[1] / count) <= bound);
      CHECK(std::fabs((long double)f.merged.center_z_m[row] - sum[2] / count) <= bound);
      CHECK(f.merged.min_x_m[row] == low[0]);
      CHECK(f.merged.min_y_m[row] == low[1]);
      CHECK(f.merged.min_z_m[row] == low[2]);
      CHECK(f.merged.max_x_m[row] == high[0]);
      CHECK(f.merged.max_y_m[row] == high[1]);
      CHECK(f.merged.max_z_m[row] == high[2]);
    }
  }
}
