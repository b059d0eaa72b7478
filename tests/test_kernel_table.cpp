// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The table of kernels per ISA.
#include "kernels/kernel_table.h"

#include <doctest/doctest.h>

#include <cstring>

namespace overtake {
namespace {

TEST_CASE("find_kernels: knows ref and refuses an unknown ISA") {
  const KernelTable* ref_table = find_kernels("ref");
  REQUIRE(ref_table != nullptr);
  CHECK(std::strcmp(ref_table->isa, "ref") == 0);
  CHECK((ref_table->label_bfs == &ref::label_bfs));  // doctest cannot print function pointers
  CHECK((ref_table->load_points == &ref::load_points));
  CHECK(find_kernels("mmx") == nullptr);
  CHECK(find_kernels("") == nullptr);
}

TEST_CASE("list_kernels: starts with ref and ends with the default of find_kernels") {
  const KernelTable* tables[16] = {};
  const int32_t count = list_kernels(tables);
  REQUIRE(count >= 1);
  REQUIRE(count <= 16);
  CHECK(list_kernels(nullptr) == count);
  CHECK(tables[0] == find_kernels("ref"));
  CHECK(tables[count - 1] == find_kernels(nullptr));
  for (int32_t i = 0; i < count; ++i) CHECK(find_kernels(tables[i]->isa) == tables[i]);
}

TEST_CASE("kernel_table: every entry of every table is set") {
  const KernelTable* tables[16] = {};
  const int32_t count = list_kernels(tables);
  for (int32_t i = 0; i < count; ++i) {
#define OVT_KERNEL(name, form, caller) CHECK((tables[i]->name != nullptr));
#include "kernels/kernels.def"
#undef OVT_KERNEL
  }
}

}  // namespace
}  // namespace overtake
