// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tests/support/kernel_world.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "core/hash.h"
#include "core/math.h"
#include "core/table.h"
#include "pipeline/method/methods.h"
#include "pipeline/method/steps.h"

namespace overtake::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// Consecutive pairs of these have the same content: the first of ranges, the second of angles.
constexpr int32_t kPlanes = 8;
Plane<float> plane_of(const RangeImages& m, int32_t i) {
  const Plane<float> planes[kPlanes] = {m.range_m,   m.elevation_rad,    m.range_filled_m,   m.elevation_filled_rad,
                                        m.angle_rad, m.angle_smooth_rad, m.range_repaired_m, m.elevation_repaired_rad};
  return planes[i];
}

constexpr Columns kRoad = columns_of(Extent::rays) | columns_of(Extent::nodes);
constexpr Columns kImages = columns_of(Extent::pixels) | columns(Column::row_count) | kRoad;
constexpr Columns kLayers = columns_of(Extent::layers) | columns(Column::layer_sums);
constexpr Columns kScratch = columns(Column::layer_order, Column::queue, Column::cursor, Column::order,
                                     Column::label_extent, Column::steep, Column::considered);

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

KernelWorld::KernelWorld(Shape shape, uint64_t seed, int32_t cluster_capacity) : shape_(shape), random_(seed) {
  const int32_t rows = shape.rows, cols = shape.cols;
  const bool wraps = seed % 2 == 1;
  const double left = wraps ? kPi : kPi / 3, right = wraps ? -kPi : -kPi / 3;
  // A world without pixels has no sensor: only image kernels run in it.
  for (int32_t s = 0; s < 3; ++s) {
    rig_[s] = make_sensor_model(std::max(rows, 1), std::max(cols, 1), left, right, wraps, 0.5, 300.0);
    rig_[s].T_vehicle_sensor = make_transform(1.5, 0.3 * (s - 1), 0.7, 0.01, -0.02, kTwoPi / 3 * s);
    rig_[s].mounting_yaw_rad = float(wrap_angle(kTwoPi / 3 * s));
  }
  sensor = rig_[0];
  params_ = paper_params(sensor);

  Guarded& g = guarded_;
  g.take_table("scan", part.scan, shape.points + kRowAlign);  // more rows than the results have, as in a frame
  views.points.capacity = round_up(shape.points, kRowAlign);
  take_columns(~kLayers);
  const auto pixels = std::size_t(rows) * std::size_t(cols);
  part.row_of_label = g.take<int32_t>("row_of_label", pixels + 1);
  g.take_table("clusters", part.clusters, seed % 3 == 0 ? 16 : cluster_capacity);
  g.take_table("cluster_points", part.cluster_points, shape.points + kRowAlign);  // build_clusters.h
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
  make_smooth_sg(cols % 3 == 0 ? 9 : 5, 2, &params_.smooth_sg);
  params_.repair_range.half_window = cols % 3 == 0 ? kMaxRepairHalfWindow : 4;
  path_count_ = shape.points % (kPathBlock + 1);
  for (double*& column : path_in_) column = g.take<double>("path_in", std::size_t(round_up(path_count_, 8)));
  for (double*& column : path_out_) column = g.take<double>("path_out", std::size_t(round_up(path_count_, 8)));
  for (double*& column : cars_out_) column = g.take<double>("cars_out", std::size_t(path_count_ % 9 * 3));
  fill_tables();
  fill_road();
  fill_path(seed);
}

// Its own random numbers: those of the other inputs stay what they are.
void KernelWorld::fill_path(uint64_t seed) {
  std::mt19937_64 random(seed + 12);
  const auto draw = [&](double low, double high) { return low + (high - low) * double(random() % 65537) / 65536.0; };
  car_ = {.speed_mps = draw(0, 90)};
  car_.steady_along = draw(0, 2), car_.steady_across = draw(0, 2);
  for (double* p : {&car_.p_ss, &car_.p_dd, &car_.p_vv, &car_.p_cc, &car_.p_ww}) *p = draw(0, 2);
  for (double* p : {&car_.p_sd, &car_.p_sv, &car_.p_dv, &car_.p_sc, &car_.p_dc, &car_.p_vc, &car_.p_sw, &car_.p_dw,
                    &car_.p_vw, &car_.p_cw})
    *p = draw(-1, 1);
  for (int32_t i = 0; i < kPathCars; ++i) {
    cars_.x_m[i] = draw(-1e3, 1e3), cars_.y_m[i] = draw(-1e3, 1e3), cars_.speed_mps[i] = draw(0, 90);
    cars_.course_rad[i] = draw(-kPi, kPi), cars_.yaw_rate_rps[i] = draw(-5, 5);
    for (auto& column : cars_.covariance) column[i] = draw(-1, 1);
    for (const int32_t diagonal : {0, 2, 5, 9, 14}) cars_.covariance[diagonal][i] = draw(0, 2);
  }
  for (int32_t c = 0; c < 13; ++c)
    for (int32_t i = 0; i < path_count_; ++i)
      path_in_[c][i] = c == 7            ? draw(-kPi, kPi)
                       : c < 5 || c > 10 ? draw(0, 3)
                       : c < 10          ? draw(-1e3, 1e3)
                                         : draw(-0.4, 0.4);
}

void KernelWorld::take_columns(Columns which) {
  for_each_segment_column(part, views, [&](Column column, auto extent, auto& view) {
    if (!has(which, column)) return;
    const std::string name = column_name(column);
    if constexpr (extent == Extent::pixels) {
      if constexpr (std::is_same_v<decltype(view), BitPlane&>)
        view = guarded_.take_bits(name, shape_.rows, shape_.cols);
      else
        view = guarded_.take_plane<std::remove_reference_t<decltype(*view.data)>>(name, shape_.rows, shape_.cols);
    } else if constexpr (extent != Extent::own) {
      view = guarded_.take<std::remove_reference_t<decltype(*view)>>(name, count_elements(extent));
    }
  });
}

// Elements of a column that is neither an image nor in separate memory.
std::size_t KernelWorld::count_elements(Extent extent) const {
  const auto pixels = std::size_t(shape_.rows) * std::size_t(shape_.cols), rays = std::size_t(count_rays(shape_.cols));
  switch (extent) {
    case Extent::points: return std::size_t(views.points.capacity);
    case Extent::layers: return std::size_t(kLayerIds);
    case Extent::labels: return pixels + 1;
    case Extent::rays: return rays;
    case Extent::nodes: return rays * kNodes;
    default: return pixels;
  }
}

// A pose, banked to either side, without a map; and a surface for kernels that run without the step that samples it.
void KernelWorld::fill_road() {
  EgoState& ego = part.road.ego;
  part.road.has_pose = chance(70);
  ego.pose.roll_rad = double(uniform(-0.4f, 0.4f));
  ego.pose.speed_mps = double(uniform(0.0f, 80.0f));
  ego.pose.yaw_rate_rps = double(uniform(-0.4f, 0.4f));
  ego.r[4] = ego.r[8] = std::cos(ego.pose.roll_rad);
  ego.r[7] = std::sin(ego.pose.roll_rad);
  ego.r[5] = -ego.r[7];
  const RoadSurface& road = views.road_surface;
  for (int32_t k = 0; k < count_rays(shape_.cols); ++k) {
    road.level_slope[k] = uniform(-0.4f, 0.4f);
    road.known_m[k] = chance(30) ? 0.0f : chance(15) ? -1.0f : chance(50) ? 1e9f : uniform(0.0f, 60.0f);
    road.bound_per_m[k] = chance(30) ? 0.0f : 1.0f / uniform(2.0f, 120.0f);
    road.last_bound_per_m[k] = chance(70) ? road.bound_per_m[k] : 1.0f / uniform(2.0f, 120.0f);
    for (int32_t i = k * kNodes; i < (k + 1) * kNodes; ++i) {
      road.offset_m[i] = uniform(-1.0f, 0.0f);
      road.slope[i] = uniform(-0.05f, 0.05f);
    }
  }
}

// Inputs that no earlier kernel writes: sizes of clusters, and one cluster's points along two sides of a car.
void KernelWorld::fill_tables() {
  gate_input_.count = std::min(shape_.points, gate_input_.capacity);
  for (int32_t i = 0; i < gate_input_.count; ++i) {
    gate_input_.point_count[i] = int32_t(random_() % 8);
    const float extent = chance(20) ? frame_params_.gate_clusters.max_extent_m : uniform(0.0f, 8.0f);
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

void KernelWorld::take_sums(const std::string& name, LayerSums& sums) {
  sums.touched = guarded_.take<int32_t>(name + "touched", kLayerIds);
  sums.point_count = guarded_.take<int32_t>(name + "point_count", kLayerIds);
  sums.elevation_sum = guarded_.take<int64_t>(name + "elevation_sum", kLayerIds);
  std::fill_n(sums.point_count, kLayerIds, 0);
  std::fill_n(sums.elevation_sum, kLayerIds, int64_t(0));
}

void KernelWorld::take_layers() {
  take_sums("", views.layer_sums);
  take_columns(kLayers);
  has_layers_ = true;
}

void KernelWorld::take_parts() {
  if (views.parts) return;
  views.parts = parts_;
  for (int32_t p = 1; p < kMaxParts; ++p) {
    const std::string name = "part " + std::to_string(p) + " ";
    take_sums(name, parts_[p].layer_sums);
    RangeImages& images = parts_[p].images;
    images.range_m = guarded_.take_plane<float>(name + "range_m", shape_.rows, shape_.cols);
    images.elevation_rad = guarded_.take_plane<float>(name + "elevation_rad", shape_.rows, shape_.cols);
    images.pixel_point = guarded_.take_plane<int32_t>(name + "pixel_point", shape_.rows, shape_.cols);
  }
}

void KernelWorld::fill_cloud_from(const unsigned char* bytes, std::size_t size) {
  take_layers();
  raw_.resize(std::size_t(shape_.points));
  auto* out = reinterpret_cast<unsigned char*>(raw_.data());
  for (std::size_t i = 0; i < raw_.size() * sizeof(RawPoint); ++i) out[i] = size ? bytes[i % size] : 0;
}

// Range: 0 (a hole), or up to 128 m. Elevation: that of the row, or any.
void KernelWorld::overlay_noise(const unsigned char* bytes, std::size_t size) {
  std::size_t next = 0;
  const auto byte = [&] { return size ? bytes[next++ % size] : uint8_t(0); };
  for (int32_t i = 0; i < kPlanes; i += 2)
    for (int32_t r = 0; r < shape_.rows; ++r)
      for (int32_t c = 0; c < shape_.cols; ++c) {
        const int32_t coarse = byte(), fine = byte(), tilt = byte();
        plane_of(views.images, i).row(r)[c] = coarse < 64 ? kNoReturn : 0.5f * float(coarse) + 0.001f * float(fine);
        plane_of(views.images, i + 1).row(r)[c] =
            tilt < 8 ? 0.19f * float(tilt * 2 - 8) : 0.3f - 0.02f * float(r) + 0.0001f * float(tilt);
      }
}

void KernelWorld::fill_cloud() {
  take_layers();
  const int32_t rows = std::max(shape_.rows, 1), cols = std::max(shape_.cols, 1);
  const bool scan_order = chance(50);
  const int32_t layers = rows + int32_t(random_() % 3);  // some get no row
  const float fov = sensor.wraps ? kTwoPiF : kTwoPiF / 3;
  const float boxes = uniform(5.0f, 40.0f);
  constexpr float kExtreme[] = {
      kNan, std::numeric_limits<float>::infinity(), 0.0f, -0.0f, 1e-40f, -1e-13f, 3e38f, -1e18f, 301.0f, 0.1f};
  for (int32_t i = 0; i < shape_.points; ++i) {
    const int32_t place = scan_order ? i : int32_t(random_() >> 33);
    const int32_t layer = place / cols % layers;
    const float azimuth = 0.5f * fov - fov * (float(place % cols) + uniform(0.0f, 1.0f)) / float(cols);
    const int32_t height = layer % 5 == 4 ? layer - 1 : layer;  // some layers are almost at the same elevation
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
  const RangeImages& m = views.images;
  const int32_t hole = int32_t(random_() % 5) * 20, jump = 1 + int32_t(random_() % 30);
  part.row_count = std::max(0, shape_.rows - int32_t(random_() % 3));
  constexpr float kExtreme[] = {1e18f, 1e-6f, 300.0f, 0.5f, 1.17549435e-38f};
  for (int32_t i = 0; i < kPlanes; i += 2)
    for (int32_t r = 0; r < shape_.rows; ++r) {
      float range = 20.0f;
      for (int32_t c = 0; c < shape_.cols; ++c) {
        if (chance(jump)) range = uniform(1.0f, 60.0f);
        range += uniform(-0.05f, 0.05f);
        plane_of(views.images, i).row(r)[c] = chance(hole) ? kNoReturn : chance(1) ? kExtreme[random_() % 5] : range;
        plane_of(views.images, i + 1).row(r)[c] =
            chance(5) ? uniform(-kHalfPiF, kHalfPiF) : 0.3f - 0.004f * float(r) + uniform(-0.0008f, 0.0008f);
      }
    }
  for (int32_t r = 0; r < shape_.rows; ++r)
    for (int32_t c = 0; c < shape_.cols; ++c) {
      const float marker = chance(60) ? kAngleUndefined : kAngleSkipped;
      m.angle_rad.row(r)[c] = chance(hole) ? marker : chance(3) ? 0.0f : uniform(0.0f, kHalfPiF);
      m.angle_smooth_rad.row(r)[c] = chance(hole) ? kAngleUndefined : uniform(-0.2f, 1.7f);
      m.pixel_point.row(r)[c] = chance(hole) ? kNoPoint : c;
    }
  // Bits in runs; links only between set pixels.
  const int32_t density = int32_t(random_() % 6) * 20, change = 1 + int32_t(random_() % 60);
  for (const BitPlane& bits : {m.nonground, m.nonground_repaired})
    for (int32_t r = 0; r < shape_.rows; ++r) {
      bits.clear_row(r);
      bool on = chance(density);
      for (int32_t c = 0; c < shape_.cols; ++c) {
        if (chance(change)) on = chance(density);
        if (on) bits.set(r, c);
      }
    }
  const int32_t joined = int32_t(random_() % 5) * 25;
  const BitPlane set = m.nonground_repaired;
  for (int32_t r = 0; r < shape_.rows; ++r) {
    m.link_right.clear_row(r);
    m.link_down.clear_row(r);
    for (int32_t c = 0; c < shape_.cols; ++c) {
      const int32_t right = c + 1 < shape_.cols ? c + 1 : sensor.wraps && c > 0 ? 0 : -1;
      if (right >= 0 && set.test(r, c) && set.test(r, right) && chance(joined)) m.link_right.set(r, c);
      if (r + 1 < shape_.rows && set.test(r, c) && set.test(r + 1, c) && chance(joined)) m.link_down.set(r, c);
    }
  }
}

const char* kernel_name(Kernel kernel) {
  constexpr const char* kName[] = {
#define OVT_KERNEL(name, form, caller) #name,
#include "kernels/kernels.def"
#undef OVT_KERNEL
  };
  return kName[int32_t(kernel)];
}

const Step* find_step(Kernel kernel) { return step::kOfKernel[int32_t(kernel)]; }

bool works_on_images(const Step* step) {
  return step && ((step->reads | step->writes) & ~(kImages | columns(Column::label_count))) == 0;
}

void KernelWorld::load_points(const KernelTable& k) {
  PointFields fields;
  if (!raw_.empty()) {
    const char* base = reinterpret_cast<const char*>(raw_.data());
    const auto field = [](const void* at, FieldType type) {
      return PointField{at, std::ptrdiff_t(sizeof(RawPoint)), type};
    };
    fields.x = field(base, FieldType::kFloat32);
    fields.y = field(base + 4, FieldType::kFloat32);
    fields.z = field(base + 8, FieldType::kFloat32);
    fields.intensity = field(base + 12, FieldType::kFloat32);
    fields.layer = field(base + 16, FieldType::kUint16);
    fields.time = field(base + 18, FieldType::kUint32);
  }
  k.load_points(fields, int32_t(raw_.size()), part.scan);
}

void KernelWorld::run(const KernelTable& k, const Step& step) {
  Segment segment = {sensor, params_, part, views};
  step.run(k, segment);
}

void KernelWorld::run_in_parts(const KernelTable& k, const Step& step, int32_t count, const RunAll& run_all) {
  take_parts();
  Segment segment = {sensor, params_, part, views};
  run_all([&](int32_t p) { run_part(k, step, segment, p, count); });
  if (step.cut.join) run_all([&](int32_t p) { step.cut.join(segment, p, count); });
}

void KernelWorld::run(const KernelTable& k, Kernel kernel) {
  if (const Step* step = find_step(kernel)) return run(k, *step);
  switch (kernel) {
    case Kernel::load_points: return load_points(k);
    case Kernel::fit_road:
      road_shape_ = RoadShape();
      return k.fit_road(params_.running_ground, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, sensor.T_vehicle_sensor}, sensor,
                        views.images.range_filled_m, views.images.elevation_filled_rad, road_shape_);
    case Kernel::merge_seams: {
      // The same scan in all three places, so there is something on both sides of each seam.
      MergeSeamsParams params = frame_params_.merge_seams;
      params.columns = shape_.cols % 2 == 0 ? std::min(shape_.cols, 8) : 1;
      SeamSide sides[3];
      for (int32_t s = 0; s < 3; ++s)
        sides[s] = {true,          &rig_[s],       &views.images,     &part.scan,
                    &views.points, &part.clusters, part.row_of_label, 1000 * s};
      merged_overflow_ = k.merge_seams(params, sides, 3, members_, merged_, seam_);
      return;
    }
    case Kernel::gate_clusters: kept_count_ = k.gate_clusters(frame_params_.gate_clusters, gate_input_, kept_); return;
    case Kernel::fit_rectangle:
      if (fit_count_ > 0)
        fit_ = k.fit_rectangle(frame_params_.fit_rectangle, fit_x_m_, fit_y_m_, fit_count_, 0.3f, 1.0f, -0.5f);
      return;
    case Kernel::predict_paths: {
      double* const* out = cars_out_;
      cars_left_ = k.predict_paths({0.05, 2, {0.1, 0.1, 1, 0.1, 0.1}}, cars_, path_count_ % 9, 3,
                                   {out[0], out[1], out[2], out[3], out[4], out[5], out[6]});
      return;
    }
    case Kernel::place_path: {
      double* const* in = path_in_;
      double* const* out = path_out_;
      return k.place_path(car_, {in[0], in[1], in[2], in[3], in[4], in[11], in[12]},
                          {in[5], in[6], in[7], in[8], in[9], in[10]}, path_count_,
                          {out[0], out[1], out[2], out[3], out[4], out[5], out[6], out[7]});
    }
    default: break;
  }
  std::fprintf(stderr, "%s: no step runs it, and KernelWorld does not either\n", kernel_name(kernel));
  std::abort();
}

void KernelWorld::run_before(const KernelTable& k, Kernel kernel) {
  if (kernel == Kernel::load_points) return;
  load_points(k);
  const Method* methods[kMaxMethods] = {};
  const int32_t count = list_methods(methods);
  for (int32_t m = 0; m < count; ++m)
    for (std::size_t i = 0; i < methods[m]->segment.size(); ++i)
      if (std::strcmp(methods[m]->segment[i].name, kernel_name(kernel)) == 0)
        return run_steps(k, methods[m]->segment.first(i));
  run_steps(k, kPaper.segment);
}

void KernelWorld::run_all(const KernelTable& k, const Method& method) {
  run(k, Kernel::load_points);
  run_steps(k, method.segment);
  for (const Kernel kernel : {Kernel::fit_road, Kernel::merge_seams, Kernel::gate_clusters, Kernel::fit_rectangle,
                              Kernel::predict_paths, Kernel::place_path})
    run(k, kernel);
}

void KernelWorld::run_steps(const KernelTable& k, std::span<const Step> steps) {
  for (const Step& step : steps) run(k, step);
}

void KernelWorld::poison_padding() {
  const auto poison = [&](auto plane, auto value) {
    for (int32_t i = -kRowPad; i < 0; ++i) plane.data[i] = value;
    for (int32_t r = 0; r < plane.rows; ++r) std::fill(plane.row(r) + plane.cols, plane.row(r) + plane.stride, value);
  };
  for_each_segment_column(part, views, [&](Column, auto extent, auto& view) {
    if constexpr (extent == Extent::pixels && std::is_same_v<decltype(view), Plane<float>&>) poison(view, kNan);
    if constexpr (extent == Extent::pixels && std::is_same_v<decltype(view), Plane<int32_t>&>)
      poison(view, int32_t(0x5a5a5a5a));
  });
}

void KernelWorld::poison(Columns which) {
  for_each_segment_column(part, views, [&](Column column, auto extent, auto& view) {
    if (!has(which, column) || (has(kLayers, column) && !has_layers_)) return;
    if constexpr (extent == Extent::pixels) {
      if constexpr (std::is_same_v<decltype(view), BitPlane&>)
        std::memset(view.words, 0xff, std::size_t(view.rows) * std::size_t(view.words_per_row) * 8);
      else
        std::memset(view.data - kRowPad, 0xff, plane_elements(view.rows, view.cols) * 4);
    } else if constexpr (extent != Extent::own) {
      std::memset(view, 0xff, count_elements(extent) * sizeof *view);
    }
  });
}

std::vector<uint64_t> KernelWorld::hash_columns() {
  std::vector<uint64_t> hashes;
  for_each_segment_column(part, views, [&](Column column, auto extent, auto& view) {
    Hash hash;
    if constexpr (extent == Extent::pixels) {
      if constexpr (std::is_same_v<decltype(view), BitPlane&>)
        hash.add_bytes(view.words, std::size_t(view.rows) * std::size_t(view.words_per_row) * 8);
      else
        for (int32_t r = 0; r < view.rows; ++r) hash.add_bytes(view.row(r), std::size_t(view.cols) * 4);
    } else if constexpr (extent == Extent::points) {
      hash.add_bytes(view, std::size_t(views.points.count) * sizeof *view);
    } else if constexpr (extent == Extent::rays || extent == Extent::nodes) {
      hash.add_bytes(view, count_elements(extent) * sizeof *view);
    } else if constexpr (extent == Extent::layers) {
      if (has_layers_) hash.add_bytes(view, kLayerIds * sizeof *view);
    } else if constexpr (extent == Extent::own) {
      if (column == Column::scan) hash.add_value(hash_table(part.scan, 0));
      if (column == Column::clusters) hash.add_value(hash_table(part.clusters, 0));
      if (column == Column::cluster_points) hash.add_value(hash_table(part.cluster_points, 0));
      if (column == Column::layer_sums && has_layers_)
        hash.add_bytes(views.layer_sums.point_count, kLayerIds * sizeof(int32_t));
      if constexpr (std::is_same_v<decltype(view), int32_t&>) hash.add_value(view);
    }
    hashes.push_back(hash.value());
  });
  return hashes;
}

std::string KernelWorld::difference(KernelWorld& a, KernelWorld& b, Columns which) {
  const bool all = which == ~Columns(0);
  const auto numbers = [](KernelWorld& w) {
    return std::vector<int32_t>{w.part.row_count, w.part.label_count, w.part.cluster_overflow,
                                w.kept_count_,    w.merged_overflow_, w.views.layer_sums.touched_count};
  };
  if (numbers(a) != numbers(b)) return "a count that the kernel returns";
  std::string found;
  const auto look = [&](const std::string& what) {
    if (found.empty()) found = what;
  };
  if (a.views.points.count != b.views.points.count) look("points.count differs");
  look(compare_tables("scan", a.part.scan, b.part.scan));
  look(compare_tables("clusters", a.part.clusters, b.part.clusters));
  look(compare_tables("cluster_points", a.part.cluster_points, b.part.cluster_points));
  look(compare_tables("members", a.members_, b.members_));
  look(compare_tables("merged", a.merged_, b.merged_));
  std::vector<void*> views;
  for_each_segment_column(b.part, b.views, [&](Column, auto, auto& view) { views.push_back(&view); });
  for_each_segment_column(a.part, a.views, [&](Column column, auto extent, auto& view) {
    if (!has(which & ~kScratch, column) || (has(kLayers, column) && !a.has_layers_)) return;
    const auto& other = *static_cast<std::remove_reference_t<decltype(view)>*>(views[std::size_t(column)]);
    const std::string name = column_name(column);
    if constexpr (extent == Extent::pixels) {
      if constexpr (std::is_same_v<decltype(view), BitPlane&>)
        look(compare_values(name + " word ", view.words, other.words,
                            std::size_t(view.rows) * std::size_t(view.words_per_row)));
      else
        look(compare_planes(name, view, other));
    } else if constexpr (extent == Extent::points) {
      look(compare_values(name, view, other, std::size_t(a.views.points.count)));
    } else if constexpr (extent == Extent::rays || extent == Extent::nodes) {
      look(compare_values(name, view, other, a.count_elements(extent)));
    } else if constexpr (extent == Extent::layers) {
      if (all) look(compare_values(name, view, other, kLayerIds));
      for (int32_t t = 0; !all && t < a.views.layer_sums.touched_count; ++t) {
        const int32_t layer = a.views.layer_sums.touched[t];
        look(compare_values(name + " of " + std::to_string(layer), view + layer, other + layer, 1));
      }
    }
  });
  if (a.has_layers_) {
    const LayerSums &x = a.views.layer_sums, &y = b.views.layer_sums;
    look(compare_values("layer point_count", x.point_count, y.point_count, kLayerIds));
    look(compare_values("layer elevation_sum", x.elevation_sum, y.elevation_sum, kLayerIds));
  }
  if (a.part.clusters.count + b.part.clusters.count > 0)
    look(compare_values("row_of_label", a.part.row_of_label, b.part.row_of_label, std::size_t(a.part.label_count) + 1));
  look(compare_values("reason_count", a.part.reason_count, b.part.reason_count, std::size_t(kReasonCount)));
  look(compare_values("kept", a.kept_, b.kept_, std::size_t(a.kept_count_)));
  const RectangleFit &f = a.fit_, &g = b.fit_;
  const float floats_a[] = {f.heading_ref_rad, f.heading_var_rad, f.heading_rad,   f.center_x_m,
                            f.center_y_m,      f.ref_x_m,         f.ref_y_m,       f.var_x_m,
                            f.var_y_m,         f.extent_length_m, f.extent_width_m};
  const float floats_b[] = {g.heading_ref_rad, g.heading_var_rad, g.heading_rad,   g.center_x_m,
                            g.center_y_m,      g.ref_x_m,         g.ref_y_m,       g.var_x_m,
                            g.var_y_m,         g.extent_length_m, g.extent_width_m};
  look(compare_values("fit", floats_a, floats_b, std::size(floats_a)));
  for (int32_t c = 0; c < 7; ++c)
    look(compare_values("cars_out", a.cars_out_[c], b.cars_out_[c], std::size_t(a.path_count_ % 9 * 3)));
  if (a.cars_left_ != b.cars_left_) look("cars left");
  if (std::memcmp(a.road_shape_.term, b.road_shape_.term, sizeof a.road_shape_.term) != 0) look("shape of the road");
  for (int32_t c = 0; c < 8; ++c)
    look(compare_values("path_out", a.path_out_[c], b.path_out_[c], std::size_t(a.path_count_)));
  if (f.inliers_ref != g.inliers_ref || f.inliers_var != g.inliers_var || f.from_var != g.from_var) look("fit inliers");
  return found;
}

}  // namespace overtake::test
