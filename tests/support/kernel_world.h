// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Everything that the kernels read and write for one sensor, between guards, with seeded contents. Runs each kernel and
// compares two such worlds. For tests that compare two tables of kernels.
#pragma once

#include <cmath>
#include <functional>
#include <random>

#include "pipeline/method/method.h"
#include "pipeline/method/step_parts.h"
#include "tests/support/guarded.h"
#include "tests/support/paper_params.h"

namespace overtake::test {

// The kernels of the manifest.
enum class Kernel : int32_t {
#define OVT_KERNEL(name, form, caller) name,
#include "kernels/kernels.def"
#undef OVT_KERNEL
};

struct Shape {
  int32_t rows, cols, points;
};

class KernelWorld {
 public:
  KernelWorld(Shape shape, uint64_t seed, int32_t cluster_capacity = 1024);

  // Seeded contents. A cloud is the input of the chain from load_points on.
  void fill_cloud();
  // A cloud of the given bytes, 27 per point, repeated; instead of fill_cloud().
  void fill_cloud_from(const unsigned char* bytes, std::size_t size);
  // Random pixels, as inputs of the image kernels.
  void fill_noise();
  // Ranges and elevations from the given bytes, 3 per pixel, repeated; after fill_noise().
  void overlay_noise(const unsigned char* bytes, std::size_t size);
  // Runs one kernel of the table on the contents; a kernel of a segmentation runs through its step.
  void run(const KernelTable& kernels, Kernel kernel);
  void run(const KernelTable& kernels, const Step& step);
  // Runs a step that may be cut in so many parts. `run_all` calls its argument once for each part.
  using RunAll = std::function<void(const std::function<void(int32_t part)>& run_one)>;
  void run_in_parts(const KernelTable& kernels, const Step& step, int32_t count, const RunAll& run_all);
  // Runs the steps before that kernel in the first method that has it; if none has it, paper's whole segmentation.
  void run_before(const KernelTable& kernels, Kernel kernel);
  // The method's segmentation from load_points on, then the kernels behind it.
  void run_all(const KernelTable& kernels, const Method& method);
  // Padding is never meaningful: NaN wherever it may be written.
  void poison_padding();
  // Fills the memory of these columns with ones: NaN, -1, every bit set.
  void poison(Columns which);
  // Describes the first difference of the two worlds in these columns; empty if there is none. Ignores scratch memory
  // and padding, and, unless all columns are compared, layers without a point.
  static std::string difference(KernelWorld& a, KernelWorld& b, Columns which = ~Columns(0));
  // Hashes of the columns' contents.
  std::vector<uint64_t> hash_columns();
  std::string broken() const { return guarded_.broken(); }

  SensorPart part;
  SegmentViews views;
  SensorModel sensor;

 private:
  struct RawPoint {  // 27 bytes: callers' memory may be unaligned
    float x_m, y_m, z_m, intensity;
    uint16_t layer;
    uint32_t time_ns;
    uint8_t other;
  } __attribute__((packed));

  float uniform(float low, float high) { return low + (high - low) * float(random_() % 65536) / 65536.0f; }
  bool chance(int32_t percent) { return int32_t(random_() % 100) < percent; }
  void run_steps(const KernelTable& kernels, std::span<const Step> steps);
  void take_columns(Columns which);
  void take_sums(const std::string& name, LayerSums& sums);
  void take_layers();
  void take_parts();
  void fill_tables();
  void fill_road();
  void fill_path(uint64_t seed);
  std::size_t count_elements(Extent extent) const;
  void load_points(const KernelTable& kernels);

  Shape shape_;
  std::mt19937_64 random_;
  Guarded guarded_;
  std::vector<RawPoint> raw_;
  SegmentParams params_;
  DetectParams frame_params_ = paper_frame_params();
  PartViews parts_[kMaxParts];
  bool has_layers_ = false;  // with a cloud only: a megabyte
  int32_t* kept_;
  MemberTable members_;
  FrameClusterTable merged_, gate_input_;
  SeamScratch seam_;
  SensorModel rig_[3];
  float *fit_x_m_, *fit_y_m_;
  PathCar car_;
  PathCars cars_;
  double* cars_out_[7];
  uint32_t cars_left_ = 0;
  double *path_in_[13], *path_out_[8];
  int32_t path_count_ = 0;
  int32_t kept_count_ = 0, merged_overflow_ = 0, fit_count_ = 0;
  RectangleFit fit_{};
  RoadShape road_shape_;
};

const Step* find_step(Kernel kernel);  // null: no segmentation runs it
const char* kernel_name(Kernel kernel);
// Whether a step reads and writes only images, so that random images are valid inputs.
bool works_on_images(const Step* step);

}  // namespace overtake::test
