// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tests/support/kernel_world.h"

#include <algorithm>
#include <limits>

#include "core/math.h"

namespace overtake::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr int32_t kPlanes = 8;

Plane<float>* planes_of(RangeImages& m, int32_t i) {
  Plane<float>* const planes[kPlanes] = {
      &m.range_m,   &m.elevation_rad,    &m.range_filled_m,   &m.elevation_filled_rad,
      &m.angle_rad, &m.angle_smooth_rad, &m.range_repaired_m, &m.elevation_repaired_rad};
  return planes[i];
}
const char* const kPlaneName[kPlanes] = {"range_m",   "elevation_rad",    "range_filled_m",   "elevation_filled_rad",
                                         "angle_rad", "angle_smooth_rad", "range_repaired_m", "elevation_repaired_rad"};
const char* const kBitsName[4] = {"nonground", "nonground_repaired", "link_right", "link_down"};

template <class T>
std::string compare_values(const std::string& name, const T* a, const T* b, std::size_t count) {
  if (count == 0 || std::memcmp(a, b, count * sizeof(T)) == 0) return "";
  for (std::size_t i = 0; i < count; ++i)
    if (std::memcmp(a + i, b + i, sizeof(T)) != 0)
      return name + "[" + std::to_string(i) + "] is " + std::to_string(a[i]) + " by one, " + std::to_string(b[i]) +
             " by the other";
  return "";
}

template <class T>
std::string compare_planes(const std::string& name, Plane<T> a, Plane<T> b) {
  for (int32_t r = 0; r < a.rows; ++r) {
    const std::string row = name + " row " + std::to_string(r) + " column ";
    const std::string found = compare_values(row, a.row(r), b.row(r), std::size_t(a.cols));
    if (!found.empty()) return found;
  }
  return "";
}

template <class Table>
std::string compare_tables(const std::string& name, Table& a, Table& b) {
  if (a.count != b.count) return name + ".count differs";
  std::string found;
  std::vector<void*> columns;
  for_each_column(b, [&](const char*, auto* column) { columns.push_back(column); });
  std::size_t next = 0;
  for_each_column(a, [&](const char* column_name, auto* column) {
    const auto* other = static_cast<decltype(column)>(columns[next++]);
    if (found.empty()) found = compare_values(name + "." + column_name, column, other, std::size_t(a.count));
  });
  return found;
}

}  // namespace

BitPlane KernelWorld::bits_of(int32_t i) const {
  const BitPlane bits[4] = {images.nonground, images.nonground_repaired, images.link_right, images.link_down};
  return bits[i];
}

KernelWorld::KernelWorld(Shape shape, uint64_t seed, int32_t cluster_capacity) : shape_(shape), random_(seed) {
  const int32_t rows = shape.rows, cols = shape.cols;
  const bool wraps = seed % 2 == 1;
  const double left = wraps ? kPi : kPi / 3, right = wraps ? -kPi : -kPi / 3;
  // A world of no pixels has no sensor either: only its image kernels run.
  for (int32_t s = 0; s < 3; ++s) {
    rig_[s] = make_sensor_model(std::max(rows, 1), std::max(cols, 1), left, right, wraps, 0.5, 300.0);
    rig_[s].T_vehicle_sensor = make_transform(1.5, 0.3 * (s - 1), 0.7, 0.01, -0.02, kTwoPi / 3 * s);
    rig_[s].mounting_yaw_rad = float(wrap_angle(kTwoPi / 3 * s));
  }
  sensor = rig_[0];

  Guarded& g = guarded_;
  g.take_table("scan", scan_, shape.points);
  g.take_table("points", points_, shape.points);
  for (int32_t i = 0; i < kPlanes; ++i) *planes_of(images, i) = g.take_plane<float>(kPlaneName[i], rows, cols);
  images.pixel_point = g.take_plane<int32_t>("pixel_point", rows, cols);
  images.labels = g.take_plane<int32_t>("labels", rows, cols);
  images.nonground = g.take_bits("nonground", rows, cols);
  images.nonground_repaired = g.take_bits("nonground_repaired", rows, cols);
  images.link_right = g.take_bits("link_right", rows, cols);
  images.link_down = g.take_bits("link_down", rows, cols);
  const auto pixels = std::size_t(rows) * std::size_t(cols);
  queue_ = g.take<int32_t>("queue", pixels);
  row_of_label_ = g.take<int32_t>("row_of_label", pixels + 1);
  cursor_ = g.take<int32_t>("cursor", pixels + 1);
  order_ = g.take<int32_t>("order", pixels + 1);
  g.take_table("clusters", clusters_, seed % 3 == 0 ? 16 : cluster_capacity);
  g.take_table("cluster_points", cluster_points_, shape.points);
  g.take_table("members", members_, 3 * cluster_capacity);
  g.take_table("merged", merged_, cluster_capacity);
  g.take_table("gate_input", gate_input_, std::max(shape.points, 1));
  kept_ = g.take<int32_t>("kept", std::size_t(gate_input_.capacity));
  seam_.capacity = rows * std::min(cols, 8);
  for (int32_t side = 0; side < 2; ++side) {
    const auto slots = std::size_t(round_up(seam_.capacity, kRowAlign));
    seam_.x_m[side] = g.take<float>("seam.x_m", slots);
    seam_.y_m[side] = g.take<float>("seam.y_m", slots);
    seam_.z_m[side] = g.take<float>("seam.z_m", slots);
    seam_.member[side] = g.take<int32_t>("seam.member", slots);
  }
  seam_.parent = g.take<int32_t>("seam.parent", std::size_t(members_.capacity));
  seam_.order = g.take<int32_t>("seam.order", std::size_t(members_.capacity));
  fit_x_m_ = g.take<float>("fit_x_m", std::size_t(round_up(shape.points + 1, kRowAlign)) + kRowAlign);
  fit_y_m_ = g.take<float>("fit_y_m", std::size_t(round_up(shape.points + 1, kRowAlign)) + kRowAlign);
  fill_tables();
}

// Inputs that no earlier kernel writes: sizes of clusters, and one cluster's points along two sides of a car.
void KernelWorld::fill_tables() {
  gate_input_.count = std::min(shape_.points, gate_input_.capacity);
  for (int32_t i = 0; i < gate_input_.count; ++i) {
    gate_input_.point_count[i] = int32_t(random_() % 8);
    const float extent = chance(20) ? 4.921f * 1.1f : uniform(0.0f, 8.0f);
    float* const low[3] = {gate_input_.min_x_m, gate_input_.min_y_m, gate_input_.min_z_m};
    float* const high[3] = {gate_input_.max_x_m, gate_input_.max_y_m, gate_input_.max_z_m};
    for (int32_t axis = 0; axis < 3; ++axis) {
      low[axis][i] = uniform(-90.0f, 90.0f);
      high[axis][i] = low[axis][i] + (chance(60) ? extent : 0.5f * extent);
    }
  }
  fit_count_ = std::min(shape_.points, 2000);
  const float heading = uniform(-3.0f, 3.0f), c = std::cos(heading), s = std::sin(heading);
  const bool extreme = chance(10);
  for (int32_t i = 0; i < fit_count_; ++i) {
    const bool side = chance(60);
    const float u = side ? uniform(0.0f, 4.8f) : uniform(-0.02f, 0.02f);
    const float v = side ? uniform(-0.02f, 0.02f) : uniform(0.0f, 1.8f);
    fit_x_m_[i] = 20.0f + c * u - s * v;
    fit_y_m_[i] = -5.0f + s * u + c * v;
    if (extreme && chance(5)) fit_x_m_[i] = uniform(-1e30f, 1e30f);
  }
}

void KernelWorld::take_layers() {
  sums_.touched = guarded_.take<int32_t>("touched", kLayerIds);
  sums_.point_count = guarded_.take<int32_t>("point_count", kLayerIds);
  sums_.elevation_sum = guarded_.take<int64_t>("elevation_sum", kLayerIds);
  std::fill_n(sums_.point_count, kLayerIds, 0);
  std::fill_n(sums_.elevation_sum, kLayerIds, int64_t(0));
  row_of_layer_ = guarded_.take<int32_t>("row_of_layer", kLayerIds);
  layer_order_ = guarded_.take<int32_t>("layer_order", kLayerIds);
}

void KernelWorld::fill_cloud_from(const unsigned char* bytes, std::size_t size) {
  take_layers();
  raw_.resize(std::size_t(shape_.points));
  auto* out = reinterpret_cast<unsigned char*>(raw_.data());
  for (std::size_t i = 0; i < raw_.size() * sizeof(RawPoint); ++i) out[i] = size ? bytes[i % size] : 0;
}

// Range: 0 a hole, else up to 128 m; elevation: of the row, or anywhere.
void KernelWorld::overlay_noise(const unsigned char* bytes, std::size_t size) {
  std::size_t next = 0;
  const auto byte = [&] { return size ? bytes[next++ % size] : uint8_t(0); };
  for (int32_t i = 0; i < kPlanes; i += 2)
    for (int32_t r = 0; r < shape_.rows; ++r)
      for (int32_t c = 0; c < shape_.cols; ++c) {
        const int32_t coarse = byte(), fine = byte(), tilt = byte();
        planes_of(images, i)->row(r)[c] = coarse < 64 ? kNoReturn : 0.5f * float(coarse) + 0.001f * float(fine);
        planes_of(images, i + 1)->row(r)[c] =
            tilt < 8 ? 0.19f * float(tilt * 2 - 8) : 0.3f - 0.02f * float(r) + 0.0001f * float(tilt);
      }
}

void KernelWorld::fill_cloud() {
  take_layers();
  const int32_t rows = std::max(shape_.rows, 1), cols = std::max(shape_.cols, 1);
  const bool scan_order = chance(50);
  const int32_t layers = rows + int32_t(random_() % 3);  // some have no row
  const float fov = sensor.wraps ? kTwoPiF : kTwoPiF / 3;
  const float boxes = uniform(5.0f, 40.0f);
  constexpr float kExtreme[] = {
      kNan, std::numeric_limits<float>::infinity(), 0.0f, -0.0f, 1e-40f, -1e-13f, 3e38f, -1e18f, 301.0f, 0.1f};
  for (int32_t i = 0; i < shape_.points; ++i) {
    const int32_t place = scan_order ? i : int32_t(random_() >> 33);
    const int32_t layer = place / cols % layers;
    const float azimuth = 0.5f * fov - fov * (float(place % cols) + uniform(0.0f, 1.0f)) / float(cols);
    const int32_t height = layer % 5 == 4 ? layer - 1 : layer;  // some layers almost touch
    const float elevation = 0.2f - 0.6f * float(height) / float(layers) + uniform(-0.002f, 0.002f);
    const float to_ground = elevation < -0.01f ? 1.8f / -std::sin(elevation) : 500.0f;
    const float to_thing = boxes + 10.0f * std::floor(3.0f * std::sin(azimuth * 9.0f));
    const float range = std::min(to_ground, to_thing) + uniform(-0.03f, 0.03f);
    RawPoint p;
    p.x_m = range * std::cos(elevation) * std::cos(azimuth);
    p.y_m = range * std::cos(elevation) * std::sin(azimuth);
    p.z_m = range * std::sin(elevation);
    p.intensity = chance(2) ? kNan : float(random_() % 16);
    p.layer = uint16_t(layer * 401 % 65536);
    p.time_ns = uint32_t(random_());
    p.other = 0;
    if (chance(3)) p.x_m = kExtreme[random_() % std::size(kExtreme)];
    if (chance(2)) p.y_m = kExtreme[random_() % std::size(kExtreme)];
    if (chance(2)) p.z_m = kExtreme[random_() % std::size(kExtreme)];
    if (chance(1)) p.x_m = p.y_m = p.z_m = 0.0f;
    raw_.push_back(p);
  }
}

void KernelWorld::fill_noise() {
  const int32_t hole = int32_t(random_() % 5) * 20, jump = 1 + int32_t(random_() % 30);
  row_count = std::max(0, shape_.rows - int32_t(random_() % 3));
  constexpr float kExtreme[] = {1e18f, 1e-6f, 300.0f, 0.5f, 1.17549435e-38f};
  for (int32_t i = 0; i < kPlanes; i += 2)
    for (int32_t r = 0; r < shape_.rows; ++r) {
      float range = 20.0f;
      for (int32_t c = 0; c < shape_.cols; ++c) {
        if (chance(jump)) range = uniform(1.0f, 60.0f);
        range += uniform(-0.05f, 0.05f);
        planes_of(images, i)->row(r)[c] = chance(hole) ? kNoReturn : chance(1) ? kExtreme[random_() % 5] : range;
        planes_of(images, i + 1)->row(r)[c] =
            chance(5) ? uniform(-kHalfPiF, kHalfPiF) : 0.3f - 0.004f * float(r) + uniform(-0.0008f, 0.0008f);
      }
    }
  for (int32_t r = 0; r < shape_.rows; ++r)
    for (int32_t c = 0; c < shape_.cols; ++c) {
      const float marker = chance(60) ? kAngleUndefined : kAngleSkipped;
      images.angle_rad.row(r)[c] = chance(hole) ? marker : chance(3) ? 0.0f : uniform(0.0f, kHalfPiF);
      images.angle_smooth_rad.row(r)[c] = chance(hole) ? kAngleUndefined : uniform(-0.2f, 1.7f);
      images.pixel_point.row(r)[c] = chance(hole) ? kNoPoint : c;
    }
  // Bits in runs; links only between pixels that are set.
  const int32_t density = int32_t(random_() % 6) * 20, change = 1 + int32_t(random_() % 60);
  for (int32_t i = 0; i < 2; ++i)
    for (int32_t r = 0; r < shape_.rows; ++r) {
      bits_of(i).clear_row(r);
      bool on = chance(density);
      for (int32_t c = 0; c < shape_.cols; ++c) {
        if (chance(change)) on = chance(density);
        if (on) bits_of(i).set(r, c);
      }
    }
  const int32_t joined = int32_t(random_() % 5) * 25;
  const BitPlane set = images.nonground_repaired;
  for (int32_t r = 0; r < shape_.rows; ++r) {
    images.link_right.clear_row(r);
    images.link_down.clear_row(r);
    for (int32_t c = 0; c < shape_.cols; ++c) {
      const int32_t right = c + 1 < shape_.cols ? c + 1 : sensor.wraps && c > 0 ? 0 : -1;
      if (right >= 0 && set.test(r, c) && set.test(r, right) && chance(joined)) images.link_right.set(r, c);
      if (r + 1 < shape_.rows && set.test(r, c) && set.test(r + 1, c) && chance(joined)) images.link_down.set(r, c);
    }
  }
}

void KernelWorld::run(const KernelTable& k, Step step) {
  RangeImages& m = images;
  switch (step) {
    case Step::load_points: {
      const RawPoint* first = raw_.data();
      const auto field = [&](const void* at, FieldType type) {
        return PointField{at, std::ptrdiff_t(sizeof(RawPoint)), type};
      };
      PointFields fields;
      if (first) {
        const char* base = reinterpret_cast<const char*>(first);
        fields.x = field(base, FieldType::kFloat32);
        fields.y = field(base + 4, FieldType::kFloat32);
        fields.z = field(base + 8, FieldType::kFloat32);
        fields.intensity = field(base + 12, FieldType::kFloat32);
        fields.layer = field(base + 16, FieldType::kUint16);
        fields.time = field(base + 18, FieldType::kUint32);
      }
      k.load_points(fields, int32_t(raw_.size()), scan_);
      break;
    }
    case Step::project_points: k.project_points(sensor, scan_, points_, sums_); break;
    case Step::rank_layers: row_count = k.rank_layers(sensor.rows, sums_, row_of_layer_, layer_order_); break;
    case Step::scatter_points: k.scatter_points(scan_, row_of_layer_, points_, m); break;
    case Step::fill_gaps:
      k.fill_gaps(FillGapsParams(), m.range_m, m.elevation_rad, m.range_filled_m, m.elevation_filled_rad);
      break;
    case Step::angle_image:
      k.angle_image(AngleImageParams(), m.range_filled_m, m.elevation_filled_rad, m.angle_rad);
      break;
    case Step::smooth_sg: {
      SmoothSgParams params;
      make_smooth_sg(shape_.cols % 3 == 0 ? 9 : 5, 2, &params);
      k.smooth_sg(params, std::max(row_count - 1, 0), m.angle_rad, m.angle_smooth_rad);
      break;
    }
    case Step::mark_ground:
      k.mark_ground(MarkGroundParams(), row_count, m.angle_smooth_rad, m.range_filled_m, m.pixel_point, m.nonground);
      break;
    case Step::repair_range: {
      RepairRangeParams params;
      params.wraps = sensor.wraps;
      params.half_window = shape_.cols % 3 == 0 ? kMaxRepairHalfWindow : 4;
      k.repair_range(params, m.range_filled_m, m.elevation_filled_rad, m.nonground, m.range_repaired_m,
                     m.elevation_repaired_rad, m.nonground_repaired);
      break;
    }
    case Step::link_pixels: {
      LinkPixelsParams params;
      params.sin_pitch = sensor.sin_pitch;
      params.cos_pitch = sensor.cos_pitch;
      params.wraps = sensor.wraps;
      k.link_pixels(params, m.range_repaired_m, m.elevation_repaired_rad, m.nonground_repaired, m.link_right,
                    m.link_down);
      break;
    }
    case Step::label_bfs:
      cluster_count = k.label_bfs(sensor.wraps, m.range_filled_m, m.nonground_repaired, m.link_right, m.link_down,
                                  m.labels, queue_);
      break;
    case Step::label_points: k.label_points(LabelPointsParams(), m, points_); break;
    case Step::build_clusters:
      cluster_overflow_ = k.build_clusters(sensor.T_vehicle_sensor, scan_, points_, cluster_count, clusters_,
                                           cluster_points_, row_of_label_, cursor_, order_);
      break;
    case Step::merge_seams: {
      // The same scan in all three places, so there is something on both sides of each seam.
      MergeSeamsParams params;
      params.columns = shape_.cols % 2 == 0 ? std::min(shape_.cols, 8) : 1;
      SeamSide sides[3];
      for (int32_t s = 0; s < 3; ++s)
        sides[s] = {true, &rig_[s], &images, &scan_, &points_, &clusters_, row_of_label_, 1000 * s};
      merged_overflow_ = k.merge_seams(params, sides, 3, members_, merged_, seam_);
      break;
    }
    case Step::gate_clusters: kept_count_ = k.gate_clusters(GateClustersParams(), gate_input_, kept_); break;
    case Step::fit_rectangle:
      if (fit_count_ > 0)
        fit_ = k.fit_rectangle(FitRectangleParams(), fit_x_m_, fit_y_m_, fit_count_, 0.3f, 1.0f, -0.5f);
      break;
  }
}

void KernelWorld::poison_padding() {
  const auto poison = [&](auto plane, auto value) {
    for (int32_t i = -kRowPad; i < 0; ++i) plane.data[i] = value;
    for (int32_t r = 0; r < plane.rows; ++r) std::fill(plane.row(r) + plane.cols, plane.row(r) + plane.stride, value);
  };
  for (int32_t i = 0; i < kPlanes; ++i) poison(*planes_of(images, i), kNan);
  poison(images.pixel_point, int32_t(0x5a5a5a5a));
  poison(images.labels, int32_t(0x5a5a5a5a));
}

std::string KernelWorld::difference(KernelWorld& a, KernelWorld& b) {
  const auto numbers = [](KernelWorld& w) {
    return std::vector<int32_t>{w.row_count,   w.cluster_count,    w.cluster_overflow_,
                                w.kept_count_, w.merged_overflow_, w.sums_.touched_count};
  };
  if (numbers(a) != numbers(b)) return "a count that the kernel returns";
  std::string found;
  const auto look = [&](const std::string& what) {
    if (found.empty()) found = what;
  };
  look(compare_tables("scan", a.scan_, b.scan_));
  look(compare_tables("points", a.points_, b.points_));
  look(compare_tables("clusters", a.clusters_, b.clusters_));
  look(compare_tables("cluster_points", a.cluster_points_, b.cluster_points_));
  look(compare_tables("members", a.members_, b.members_));
  look(compare_tables("merged", a.merged_, b.merged_));
  for (int32_t i = 0; i < kPlanes; ++i)
    look(compare_planes(kPlaneName[i], *planes_of(a.images, i), *planes_of(b.images, i)));
  look(compare_planes("pixel_point", a.images.pixel_point, b.images.pixel_point));
  look(compare_planes("labels", a.images.labels, b.images.labels));
  for (int32_t i = 0; i < 4; ++i)
    look(compare_values(std::string(kBitsName[i]) + " word ", a.bits_of(i).words, b.bits_of(i).words,
                        std::size_t(a.bits_of(i).rows) * std::size_t(a.bits_of(i).words_per_row)));
  if (a.row_of_layer_) {
    look(compare_values("layer point_count", a.sums_.point_count, b.sums_.point_count, kLayerIds));
    look(compare_values("layer elevation_sum", a.sums_.elevation_sum, b.sums_.elevation_sum, kLayerIds));
    look(compare_values("row_of_layer", a.row_of_layer_, b.row_of_layer_, kLayerIds));
  }
  if (a.clusters_.count + b.clusters_.count > 0)
    look(compare_values("row_of_label", a.row_of_label_, b.row_of_label_, std::size_t(a.cluster_count) + 1));
  look(compare_values("kept", a.kept_, b.kept_, std::size_t(a.kept_count_)));
  const RectangleFit &f = a.fit_, &g = b.fit_;
  const float floats_a[] = {f.heading_ref_rad, f.heading_var_rad, f.heading_rad,   f.center_x_m,
                            f.center_y_m,      f.ref_x_m,         f.ref_y_m,       f.var_x_m,
                            f.var_y_m,         f.extent_length_m, f.extent_width_m};
  const float floats_b[] = {g.heading_ref_rad, g.heading_var_rad, g.heading_rad,   g.center_x_m,
                            g.center_y_m,      g.ref_x_m,         g.ref_y_m,       g.var_x_m,
                            g.var_y_m,         g.extent_length_m, g.extent_width_m};
  look(compare_values("fit", floats_a, floats_b, std::size(floats_a)));
  if (f.inliers_ref != g.inliers_ref || f.inliers_var != g.inliers_var || f.from_var != g.from_var) look("fit inliers");
  return found;
}

}  // namespace overtake::test
