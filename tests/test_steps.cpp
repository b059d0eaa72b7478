// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Each step does what it declares: the memory plan and the order of a method depend on it.
#include "pipeline/method/steps.h"

#include <doctest/doctest.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <type_traits>
#include <vector>

#include "pipeline/method/methods.h"
#include "tests/support/kernel_world.h"

namespace overtake::test {
namespace {

constexpr Shape kShapes[] = {{1, 1, 3}, {3, 17, 40}, {9, 47, 400}, {16, 128, 2500}};

KernelWorld make_world_before(const Method& method, const Step& last, Shape shape, uint64_t seed) {
  KernelWorld world(shape, seed);
  world.fill_cloud();
  world.run(*find_kernels("ref"), Kernel::load_points);
  for (const Step& step : method.segment) {
    if (&step == &last) break;
    world.run(*find_kernels("ref"), step);
  }
  return world;
}

// Each step of each method on each ISA.
template <class Check>
void for_each_case(Check&& check) {
  const KernelTable* tables[16] = {};
  const int32_t table_count = list_kernels(tables);
  const Method* methods[kMaxMethods] = {};
  const int32_t method_count = list_methods(methods);
  for (int32_t m = 0; m < method_count; ++m)
    for (const Step& step : methods[m]->segment)
      for (int32_t t = 0; t < table_count; ++t)
        for (const Shape& shape : kShapes)
          for (uint64_t seed = 1; seed <= 3; ++seed) {
            INFO(std::string(methods[m]->name) << ": " << std::string(step.name) << "/" << std::string(tables[t]->isa)
                                               << " " << shape.rows << "x" << shape.cols << " seed " << seed);
            check(*methods[m], step, *tables[t], shape, seed);
          }
}

TEST_CASE("steps: a step reads only the columns that it declares") {
  for_each_case([](const Method& method, const Step& step, const KernelTable& table, Shape shape, uint64_t seed) {
    KernelWorld clean = make_world_before(method, step, shape, seed);
    KernelWorld poisoned = make_world_before(method, step, shape, seed);
    poisoned.poison(~step.reads);
    clean.run(table, step);
    poisoned.run(table, step);
    CHECK(KernelWorld::difference(clean, poisoned, step.writes) == "");
  });
}

TEST_CASE("steps: a step changes only the columns that it declares") {
  for_each_case([](const Method& method, const Step& step, const KernelTable& table, Shape shape, uint64_t seed) {
    KernelWorld world = make_world_before(method, step, shape, seed);
    world.views.points.count = world.part.scan.count;  // as the first step says
    const std::vector<uint64_t> before = world.hash_columns();
    world.run(table, step);
    const std::vector<uint64_t> after = world.hash_columns();
    for (int32_t c = 0; c < kColumnCount; ++c)
      if (!has(step.writes | step.scratch, Column(c)) && before[std::size_t(c)] != after[std::size_t(c)])
        FAIL_CHECK(std::string(step.name) << " changes " << std::string(column_name(Column(c))));
  });
  CHECK(true);  // counts a check: FAIL_CHECK counts only failures
}

// Rows [0, first) and [last, rows) of the image columns take the contents of other rows.
void shuffle_rows(KernelWorld& world, Columns which, int32_t first, int32_t last) {
  const auto mix = [&](auto& image, std::size_t row_bytes) {
    std::vector<char> rows;
    for (int32_t r = 0; r < image.rows; ++r) {
      const char* at = reinterpret_cast<const char*>(image.row(r));
      rows.insert(rows.end(), at, at + row_bytes);
    }
    for (int32_t r = 0; r < image.rows; ++r)
      if (r < first || r >= last)
        std::memcpy(image.row(r), rows.data() + std::size_t((r * 7 + 3) % image.rows) * row_bytes, row_bytes);
  };
  for_each_segment_column(world.part, world.views, [&](Column column, auto extent, auto& view) {
    if constexpr (extent == Extent::pixels) {
      if (!has(which, column)) return;
      if constexpr (std::is_same_v<decltype(view), BitPlane&>)
        mix(view, std::size_t(view.words_per_row) * 8);
      else
        mix(view, std::size_t(view.cols) * 4);
    }
  });
}

std::vector<std::string> hash_rows(KernelWorld& world, Columns which, int32_t first, int32_t last) {
  std::vector<std::string> rows;
  for_each_segment_column(world.part, world.views, [&](Column column, auto extent, auto& view) {
    if constexpr (extent == Extent::pixels)
      if (has(which, column))
        for (int32_t r = first; r < last; ++r) {
          std::size_t bytes = 0;
          if constexpr (std::is_same_v<decltype(view), BitPlane&>)
            bytes = std::size_t(view.words_per_row) * 8;
          else
            bytes = std::size_t(view.cols) * 4;
          rows.emplace_back(reinterpret_cast<const char*>(view.row(r)), bytes);
        }
  });
  return rows;
}

TEST_CASE("steps: rows outside of a step's halo change nothing") {
  int32_t halos = 0;
  for_each_case([&](const Method& method, const Step& step, const KernelTable& table, Shape shape, uint64_t seed) {
    if (!step.halo || seed != 1) return;
    KernelWorld clean = make_world_before(method, step, shape, seed);
    clean.run(table, step);
    const Halo halo = step.halo(paper_params(clean.sensor));
    if (halo.is_guess) return;
    ++halos;
    for (int32_t first = 0; first < shape.rows; ++first)
      for (const int32_t last : {first + 1, (first + 1 + shape.rows) / 2, shape.rows}) {
        KernelWorld other = make_world_before(method, step, shape, seed);
        shuffle_rows(other, step.reads, first - halo.above, last + halo.below);
        other.run(table, step);
        const bool same = hash_rows(other, step.writes, first, last) == hash_rows(clean, step.writes, first, last);
        CHECK(same);
      }
  });
  CHECK(halos > 0);
}

// | `kernel` | reads | writes |
std::string row_of(const Step& step) {
  std::string row = "| `" + std::string(step.name) + "` |";
  for (const Columns set : {step.reads, step.writes}) {
    for (int32_t c = 0; c < kColumnCount; ++c)
      if (has(set, Column(c))) row += ' ' + std::string(column_name(Column(c)));
    row += " |";
  }
  return row;
}

TEST_CASE("steps: the table of kernels/README.md says what the steps of every preset read and write") {
  std::ifstream file("kernels/README.md");
  REQUIRE(file.good());
  const std::string text(std::istreambuf_iterator<char>(file), {});
  int32_t rows = 0;
  const Method* const presets[] = {
#define OVT_PRESET(name, method) &method,
#include "pipeline/method/presets.def"
#undef OVT_PRESET
  };
  for (const Method* method : presets)
    for (const Step* kernel : step::kOfKernel)
      for (const Step& step : method->segment)
        if (kernel && std::strcmp(kernel->name, step.name) == 0) {
          INFO(row_of(step));
          CHECK(text.find('\n' + row_of(step)) != std::string::npos);
          ++rows;
        }
  CHECK(rows > 20);
}

TEST_CASE("steps: no chain without the step that writes what another reads, and none with a stage in two places") {
  constexpr Step kWhole[] = {step::project_points, step::rank_layers, step::scatter_points, step::fill_gaps};
  CHECK(is_chain(kWhole, kGivenColumns));
  constexpr Step kWithout[] = {step::project_points, step::rank_layers, step::fill_gaps};
  CHECK_FALSE(is_chain(kWithout, kGivenColumns));
  constexpr Step kSwapped[] = {step::project_points, step::scatter_points, step::rank_layers};
  CHECK_FALSE(is_chain(kSwapped, kGivenColumns));
  constexpr Step kTorn[] = {step::project_points, step::rank_layers, step::scatter_points, step::fill_gaps,
                            step::scatter_points};
  CHECK_FALSE(is_chain(kTorn, kGivenColumns));
}

}  // namespace
}  // namespace overtake::test
