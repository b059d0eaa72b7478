// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Every kernel of the manifest writes the bytes of the scalar reference on every ISA of this CPU, and nothing outside
// its outputs. A new line in kernels.def gives a new case here, which runs the kernel through its step.
#include <doctest/doctest.h>

#include "tests/support/kernel_world.h"

namespace overtake::test {
namespace {

// A vector has 4, 8 or 16 lanes; words of bits hold 64 columns.
constexpr Shape kShapes[] = {{0, 0, 0},    {1, 1, 1},      {1, 0, 0},       {2, 2, 2},     {3, 3, 3},     {2, 4, 4},
                             {5, 5, 5},    {3, 7, 7},      {4, 8, 8},       {7, 9, 9},     {2, 15, 15},   {6, 16, 16},
                             {5, 17, 17},  {3, 31, 33},    {9, 47, 200},    {4, 63, 63},   {8, 64, 700},  {5, 65, 65},
                             {7, 127, 31}, {16, 128, 900}, {33, 101, 3000}, {29, 200, 29}, {8, 321, 2000}};
constexpr Shape kFull = {32, 857, 27424}, kLargest = {128, 2048, 262144};

enum class Input { cloud, noise };

KernelWorld make_world(Shape shape, uint64_t seed, Input input, Kernel kernel) {
  KernelWorld world(shape, seed);
  if (input == Input::cloud) {
    world.fill_cloud();
    world.run_before(*find_kernels("ref"), kernel);
  } else {
    world.fill_noise();
  }
  return world;
}

// Runs one kernel on the same inputs with the reference and with each other table, and compares the outputs.
void check_agreement(Kernel kernel, Shape shape, uint64_t seed, Input input) {
  const KernelTable* tables[16] = {};
  const int32_t table_count = list_kernels(tables);
  KernelWorld truth = make_world(shape, seed, input, kernel);
  truth.run(*tables[0], kernel);
  for (int32_t t = 1; t < table_count; ++t) {
    KernelWorld world = make_world(shape, seed, input, kernel);
    world.poison_padding();
    world.run(*tables[t], kernel);
    const std::string difference = KernelWorld::difference(truth, world), broken = world.broken();
    if (difference.empty() && broken.empty()) continue;
    FAIL_CHECK(std::string(kernel_name(kernel))
               << "/" << std::string(tables[t]->isa) << " " << shape.rows << "x" << shape.cols << ", " << shape.points
               << " points, seed " << seed << std::string(input == Input::cloud ? ", cloud" : ", noise") << ": "
               << difference << std::string(broken.empty() ? "" : "; wrote past the ends of ") << broken);
  }
}

void check_shapes(Kernel kernel) {
  const bool images = works_on_images(find_step(kernel));
  for (const Shape& shape : kShapes)
    for (uint64_t seed = 1; seed <= 3; ++seed) {
      if (shape.rows > 0 && shape.cols > 0) check_agreement(kernel, shape, seed, Input::cloud);
      if (images)
        for (uint64_t more = 0; more < 3; ++more) check_agreement(kernel, shape, seed + 100 * more, Input::noise);
    }
  for (uint64_t seed = 1; seed <= 2; ++seed) {
    check_agreement(kernel, kFull, seed, Input::cloud);
    if (images) check_agreement(kernel, kFull, seed, Input::noise);
  }
  CHECK(true);  // counts a check: FAIL_CHECK counts only failures
}

#define OVT_KERNEL(name, form, caller) \
  TEST_CASE(#name " writes the reference's bytes on every ISA and shape") { check_shapes(Kernel::name); }
#include "kernels/kernels.def"
#undef OVT_KERNEL

TEST_CASE("every kernel writes the reference's bytes on 128 x 2048 pixels") {
#define OVT_KERNEL(name, form, caller) check_agreement(Kernel::name, kLargest, 5, Input::cloud);
#include "kernels/kernels.def"
#undef OVT_KERNEL
  CHECK(true);
}

// tools/dev/check_isa_symbols.sh checks the machine code for the instructions of each table.
TEST_CASE("agreement: each table has its own code, and a kernel has a vector form on every ISA or on none") {
  const KernelTable* tables[16] = {};
  const int32_t table_count = list_kernels(tables);
#define OVT_KERNEL(name, form, caller)                                                        \
  for (int32_t a = 1; a < table_count; ++a) {                                                 \
    INFO(std::string(#name) << "/" << std::string(tables[a]->isa));                           \
    const bool has_form = tables[a]->name != tables[0]->name;                                 \
    CHECK(has_form == (tables[1]->name != tables[0]->name));                                  \
    for (int32_t b = 1; b < a; ++b) CHECK((!has_form || tables[a]->name != tables[b]->name)); \
  }
#include "kernels/kernels.def"
#undef OVT_KERNEL
  for (int32_t a = 1; a < table_count; ++a) CHECK((tables[a]->angle_image != tables[0]->angle_image));
#if defined(__x86_64__)
  CHECK(find_kernels("sse2") != nullptr);
  __builtin_cpu_init();
  CHECK((find_kernels("avx2") != nullptr) == (__builtin_cpu_supports("avx2") != 0));
  CHECK((find_kernels("avx512") != nullptr) == (__builtin_cpu_supports("avx512vl") != 0));
#elif defined(__aarch64__)
  CHECK(find_kernels("neon64") != nullptr);
#endif
}

TEST_CASE("agreement: the test clouds and images contain every relevant case") {
  KernelWorld world = make_world(kFull, 1, Input::cloud, Kernel::label_points);
  CHECK(world.part.row_count > 20);
  CHECK(world.part.label_count > 10);
  int32_t filled = 0, repaired = 0, skipped = 0, down = 0;
  const RangeImages& m = world.views.images;
  for (int32_t r = 0; r < kFull.rows; ++r)
    for (int32_t c = 0; c < kFull.cols; ++c) {
      filled += m.range_m.at(r, c) == kNoReturn && m.range_filled_m.at(r, c) > 0.0f;
      repaired += m.nonground_repaired.test(r, c) && !m.nonground.test(r, c);
      skipped += m.angle_rad.at(r, c) == kAngleSkipped;
      down += m.link_down.test(r, c);
    }
  CHECK(filled > 100);
  CHECK(repaired > 100);
  CHECK(skipped > 10);
  CHECK(down > 1000);
}

}  // namespace
}  // namespace overtake::test
