// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Every kernel on every ISA this CPU has, against the scalar reference: on clouds of any bytes from the first kernel of
// paper's chain to the last, and each image kernel on images of any content. Same bytes, and nothing beside the
// outputs.
#include <vector>

#include "tests/fuzz/bytes.h"
#include "tests/support/kernel_world.h"

using namespace overtake;
using test::Kernel;
using test::KernelWorld;

namespace {

constexpr Kernel kKernels[] = {
#define OVT_KERNEL(name, form, caller) Kernel::name,
#include "kernels/kernels.def"
#undef OVT_KERNEL
};

// Kernels that read and write only images.
std::vector<Kernel> image_kernels() {
  std::vector<Kernel> found;
  for (const Kernel kernel : kKernels)
    if (test::works_on_images(test::find_step(kernel))) found.push_back(kernel);
  return found;
}

// The tables of the point kernels have an entry per layer id, a megabyte per world: image runs are a hundred times
// faster.
enum class Input { image, cloud };

struct Case {
  Input input;
  test::Shape shape;
  uint64_t seed;
  std::string_view bytes;
};

KernelWorld make_world(const Case& c) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(c.bytes.data());
  KernelWorld world(c.shape, c.seed, 48);
  if (c.input == Input::cloud) {
    world.fill_cloud_from(bytes, c.bytes.size());
  } else {
    world.fill_noise();
    world.overlay_noise(bytes, c.bytes.size());
  }
  return world;
}

void compare(KernelWorld& truth, KernelWorld& world, const char* kernel, const char* isa) {
  const std::string difference = KernelWorld::difference(truth, world), broken = world.broken();
  if (difference.empty() && broken.empty()) return;
  std::fprintf(stderr, "%s/%s: %s; wrote past the ends of: %s\n", kernel, isa, difference.c_str(), broken.c_str());
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  fuzz::Bytes in(data, size);
  Case c;
  c.input = in.chance(2) ? Input::cloud : Input::image;
  c.shape = {in.in(1, 6), in.in(1, 40), in.in(0, 60)};
  if (in.chance(16)) c.shape.cols = in.in(60, 130);
  c.seed = in.byte();
  static const std::vector<Kernel> images = image_kernels();
  const Kernel kernel = images[std::size_t(in.in(0, int32_t(images.size()) - 1))];
  c.bytes = in.rest();

  const KernelTable* tables[16] = {};
  const int32_t table_count = list_kernels(tables);
  if (c.input == Input::cloud) {
    KernelWorld truth = make_world(c);
    truth.run_all(*tables[0], kPaper);
    for (int32_t t = 1; t < table_count; ++t) {
      KernelWorld world = make_world(c);
      world.poison_padding();
      world.run_all(*tables[t], kPaper);
      compare(truth, world, "one of the chain's kernels", tables[t]->isa);
    }
    return 0;
  }
  // One kernel on images that no chain makes, so that no kernel depends on properties of the previous one's output.
  KernelWorld truth = make_world(c);
  truth.run(*tables[0], kernel);
  for (int32_t t = 1; t < table_count; ++t) {
    KernelWorld world = make_world(c);
    world.poison_padding();
    world.run(*tables[t], kernel);
    compare(truth, world, test::kernel_name(kernel), tables[t]->isa);
  }
  return 0;
}
