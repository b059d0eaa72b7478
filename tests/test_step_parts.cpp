// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Steps in parts write the bytes of the same steps in one piece.
#include "pipeline/method/step_parts.h"

#include <doctest/doctest.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "pipeline/method/methods.h"
#include "pipeline/method/segment_memory.h"
#include "pipeline/method/steps.h"
#include "pipeline/spare_workers.h"
#include "tests/support/kernel_world.h"

namespace overtake::test {
namespace {

// Widths of less than a word, of whole words, and with a rest; fewer words than parts; no point.
constexpr Shape kShapes[] = {{1, 1, 3},    {2, 8, 0},      {3, 63, 40},     {4, 64, 500},
                             {9, 65, 400}, {5, 129, 2000}, {16, 200, 2500}, {11, 321, 4000}};
constexpr Shape kFull = {32, 857, 27424};

KernelWorld make_world_before(const Method& method, const Step& last, Shape shape, uint64_t seed) {
  KernelWorld world(shape, seed);
  world.fill_cloud();
  world.run(*find_kernels(nullptr), Kernel::load_points);
  for (const Step& step : method.segment) {
    if (&step == &last) break;
    world.run(*find_kernels(nullptr), step);
  }
  return world;
}

void for_each_cut_step(const std::function<void(const Method& method, const Step& step)>& check) {
  const Method* methods[kMaxMethods] = {};
  const int32_t count = list_methods(methods);
  for (int32_t m = 0; m < count; ++m)
    for (const Step& step : methods[m]->segment)
      if (step.cut.by != Cut::kNone) check(*methods[m], step);
}

// Backwards: a part that writes into the one before it does so too early, and forwards into the one behind it.
KernelWorld::RunAll in_order(int32_t count, bool backwards) {
  return [=](const std::function<void(int32_t)>& run_one) {
    for (int32_t k = 0; k < count; ++k) run_one(backwards ? count - 1 - k : k);
  };
}

void check_parts(const Method& method, const Step& step, const KernelTable& table, Shape shape, uint64_t seed) {
  KernelWorld whole = make_world_before(method, step, shape, seed);
  whole.run(table, step);
  for (int32_t count = 2; count <= kMaxParts; ++count)
    for (const bool backwards : {false, true}) {
      KernelWorld parts = make_world_before(method, step, shape, seed);
      parts.run_in_parts(table, step, count, in_order(count, backwards));
      const std::string difference = KernelWorld::difference(whole, parts, step.writes), broken = parts.broken();
      if (difference.empty() && broken.empty()) continue;
      FAIL_CHECK(std::string(method.name) << ": " << std::string(step.name) << "/" << std::string(table.isa) << " in "
                                          << count << " parts" << std::string(backwards ? ", backwards" : "") << ", "
                                          << shape.rows << "x" << shape.cols << " seed " << seed << ": " << difference
                                          << std::string(broken.empty() ? "" : "; wrote past the ends of ") << broken);
    }
}

TEST_CASE("step parts: every step that may be cut writes the same bytes in any number of parts") {
  const KernelTable* tables[16] = {};
  const int32_t table_count = list_kernels(tables);
  int32_t steps = 0;
  for_each_cut_step([&](const Method& method, const Step& step) {
    ++steps;
    for (int32_t t = 0; t < table_count; ++t) {
      for (const Shape& shape : kShapes)
        check_parts(method, step, *tables[t], shape, uint64_t(1 + (&shape - kShapes) % 2));
    }
    check_parts(method, step, *tables[table_count - 1], kFull, 3);
  });
  CHECK(steps >= 14);
}

// All steps in parts, one after the other, for two scans in the same memory.
KernelWorld segment_in_parts(const KernelTable& table, const Method& method, Shape shape, uint64_t seed,
                             int32_t count) {
  KernelWorld world(shape, seed);
  world.fill_cloud();
  world.run(table, Kernel::load_points);
  for (int32_t scan = 0; scan < 2; ++scan)
    for (const Step& step : method.segment) {
      if (step.cut.by == Cut::kNone)
        world.run(table, step);
      else
        world.run_in_parts(table, step, count, in_order(count, seed % 2 == 0));
    }
  return world;
}

TEST_CASE("step parts: a segmentation in parts gives the same clusters, also where a seam lies within one") {
  const KernelTable& table = *find_kernels(nullptr);
  const Method* methods[kMaxMethods] = {};
  const int32_t method_count = list_methods(methods);
  int32_t links_across = 0;
  for (int32_t m = 0; m < method_count; ++m)
    for (uint64_t seed = 1; seed <= 6; ++seed) {
      KernelWorld whole = segment_in_parts(table, *methods[m], kFull, seed, 1);
      CHECK(whole.part.clusters.count > 3);
      for (int32_t count = 2; count <= kMaxParts; ++count) {
        KernelWorld parts = segment_in_parts(table, *methods[m], kFull, seed, count);
        CHECK(KernelWorld::difference(whole, parts, find_columns(*methods[m])) == "");
        CHECK(parts.broken() == "");
      }
      for (int32_t r = 0; r < kFull.rows; ++r)  // two parts of 7 words each
        links_across += whole.views.images.link_right.test(r, 447);
    }
  CHECK(links_across > 10);
}

TEST_CASE("step parts: a segmentation in parts on several threads gives the same bytes") {
  const KernelTable& table = *find_kernels(nullptr);
  constexpr int32_t kHelpers = 2;
  for_each_cut_step([&](const Method& method, const Step& step) {
    KernelWorld whole = make_world_before(method, step, kFull, 1);
    whole.run(table, step);
    SpareWorkers workers(1, kMaxParts);
    std::atomic<bool> ends{false};
    std::vector<std::thread> helpers;
    for (int32_t h = 0; h < kHelpers; ++h)
      helpers.emplace_back([&] {
        SpareWorkers::Visit visit(workers);
        while (!ends.load())
          if (!visit.take_part()) std::this_thread::yield();
      });
    for (int32_t round = 0; round < 3; ++round) {
      KernelWorld parts = make_world_before(method, step, kFull, 1);
      parts.run_in_parts(table, step, kMaxParts, [&](const std::function<void(int32_t)>& run_one) {
        std::atomic<int32_t> begun{0};
        workers.run(0, kMaxParts, [&](int32_t part) {
          begun.fetch_add(1);
          while (begun.load() < 2) std::this_thread::yield();  // two at the same time
          run_one(part);
        });
      });
      CHECK(KernelWorld::difference(whole, parts, step.writes) == "");
    }
    ends.store(true);
    for (std::thread& helper : helpers) helper.join();
  });
}

}  // namespace
}  // namespace overtake::test
