// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Everything the kernels read and write for one sensor, behind fences, with seeded contents; each kernel run on it; and
// the comparison of two such worlds. For tests that ask whether two tables of kernels do the same.
#pragma once

#include <cmath>
#include <random>

#include "pipeline/method/method.h"
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

  // Seeded contents. A cloud feeds the chain from load_points on.
  void fill_cloud();
  // A cloud of the given bytes, 27 a point, over and over; instead of fill_cloud().
  void fill_cloud_from(const unsigned char* bytes, std::size_t size);
  // Pixels without any order, as inputs of the image kernels.
  void fill_noise();
  // Its ranges and elevations from the given bytes, 3 a pixel, over and over; after fill_noise().
  void overlay_noise(const unsigned char* bytes, std::size_t size);
  // Runs one kernel of the table on what the world holds, a kernel of a segmentation through its step.
  void run(const KernelTable& kernels, Kernel kernel);
  void run(const KernelTable& kernels, const Step& step);
  // What runs before that kernel in the first method that has it; where none has, the whole of paper's segmentation.
  void run_before(const KernelTable& kernels, Kernel kernel);
  // The method's segmentation from load_points on, then the kernels behind it.
  void run_all(const KernelTable& kernels, const Method& method);
  // Padding is never meaningful: NaN wherever it may be written.
  void poison_padding();
  // Fills the memory of these columns with ones: NaN, -1, every bit set.
  void poison(Columns which);
  // Where the two differ first in these columns, in words; empty: nowhere. Scratch memory and padding do not count, of
  // fewer than all columns neither do layers that no point has.
  static std::string difference(KernelWorld& a, KernelWorld& b, Columns which = ~Columns(0));
  // A hash of what each column holds, by column.
  std::vector<uint64_t> hash_columns();
  std::string broken() const { return guarded_.broken(); }

  SensorPart part;
  SegmentViews views;
  SensorModel sensor;

 private:
  struct RawPoint {  // 27 bytes: nothing is aligned in a caller's memory
    float x_m, y_m, z_m, intensity;
    uint16_t layer;
    uint32_t time_ns;
    uint8_t other;
  } __attribute__((packed));

  float uniform(float low, float high) { return low + (high - low) * float(random_() % 65536) / 65536.0f; }
  bool chance(int32_t percent) { return int32_t(random_() % 100) < percent; }
  void run_steps(const KernelTable& kernels, std::span<const Step> steps);
  void take_columns(Columns which);
  void take_layers();
  void fill_tables();
  void load_points(const KernelTable& kernels);

  Shape shape_;
  std::mt19937_64 random_;
  Guarded guarded_;
  std::vector<RawPoint> raw_;
  SegmentParams params_;
  DetectParams frame_params_ = paper_frame_params();
  bool has_layers_ = false;  // with a cloud only: a megabyte
  int32_t* kept_;
  MemberTable members_;
  MergedTable merged_, gate_input_;
  SeamScratch seam_;
  SensorModel rig_[3];
  float *fit_x_m_, *fit_y_m_;
  int32_t kept_count_ = 0, merged_overflow_ = 0, fit_count_ = 0;
  RectangleFit fit_{};
};

const Step* find_step(Kernel kernel);  // null: no segmentation runs it
const char* kernel_name(Kernel kernel);
// Whether a step reads and writes images alone, so that images without any order are an input of it.
bool works_on_images(const Step* step);

}  // namespace overtake::test
