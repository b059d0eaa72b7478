// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A caller that rounds otherwise, or traps floating-point exceptions, gets the same bytes, and its mode back.
#include <doctest/doctest.h>

#include <cfenv>
#include <cmath>
#include <vector>

#include "tests/support/detector_bench.h"

using namespace overtake::test;

namespace {

constexpr std::size_t kFrames = 4;

void set_usual() { std::fesetenv(FE_DFL_ENV); }

// What a detector publishes while the caller has a mode from before its create on. The callback computes hashes only.
template <class SetMode>
std::vector<FrameRecord> records_in(int32_t workers, SetMode&& set_mode) {
  DetectorBench bench({.workers = workers});
  for (std::size_t k = 0; k <= kFrames; ++k) demo_frame(k);
  set_mode();
  bench.create();
  for (std::size_t k = 0; k < kFrames; ++k) {
    set_usual();  // the poses are computed here
    bench.push_ego(k);
    set_mode();
    for (int32_t s = 0; s < 3; ++s) REQUIRE(bench.push_scan(k, s) == OVT_OK);
  }
  REQUIRE(bench.push_scan(kFrames, 0) == OVT_OK);  // the last frame is finished where the detector is destroyed
  bench.destroy();
  set_usual();
  return bench.records;
}

}  // namespace

TEST_CASE("float mode: the same bytes whatever the caller's rounding, which is back after each call") {
  for (const int32_t workers : {1, 2}) {
    const std::vector<FrameRecord> usual = records_in(workers, set_usual);
    REQUIRE(usual.size() == kFrames + 1);
    for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
      CAPTURE(workers);
      CAPTURE(mode);
      CHECK(records_in(workers, [&] { std::fesetround(mode); }) == usual);
    }
  }
  DetectorBench bench({});
  bench.create();
  std::fesetround(FE_UPWARD);
  bench.push_scan(0, 0);
  CHECK(std::fegetround() == FE_UPWARD);
  ovt_flush(bench.detector);
  CHECK(std::fegetround() == FE_UPWARD);
  set_usual();
}

TEST_CASE("float mode: parameters and log functions have the usual rounding in any mode of the caller") {
  const auto read_all = [](int mode) {
    std::fesetround(mode);
    ovt_params params = ovt_default_params();
    const int32_t count = ovt_param_count();
    std::vector<double> values(std::size_t(count), 0.0);
    for (int32_t i = 0; i < count; ++i) {
      ovt_param_info info = {};
      REQUIRE(ovt_describe_param_sized(i, &info, sizeof info) == OVT_OK);
      REQUIRE(ovt_get_param(&params, info.name, &values[std::size_t(i)]) == OVT_OK);
    }
    set_usual();
    return values;
  };
  const std::vector<double> usual = read_all(FE_TONEAREST);
  for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) CHECK(read_all(mode) == usual);

  DetectorBench bench({});
  static volatile double sum = 0, tiny = 1e-30;
  bench.def.log = [](ovt_log_level, const char*, void*) { sum = 1.0 + tiny; };
  bench.create();
  sum = 0;
  std::fesetround(FE_UPWARD);
  CHECK(ovt_push_scan(bench.detector, nullptr) == OVT_BAD_ARGUMENT);
  CHECK(std::fegetround() == FE_UPWARD);
  set_usual();
  CHECK(sum == 1.0);
}

#ifdef __GLIBC__
TEST_CASE("float mode: a caller that traps invalid operations is not interrupted by the library's") {
  if (feenableexcept(FE_INVALID) == -1) return;  // a processor without traps
  set_usual();
  const auto trap = [] { feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW); };
  for (const int32_t workers : {1, 2}) CHECK(records_in(workers, trap) == records_in(workers, set_usual));
  // Values that are refused.
  DetectorBench bench({});
  bench.create();
  ovt_reader* reader = nullptr;
  REQUIRE(ovt_create_reader(bench.detector, &reader) == OVT_OK);
  ovt_ego_pose pose;
  ovt_ego_pose_init(&pose, sizeof pose);
  pose.speed_mps = std::nan("");
  trap();
  const ovt_status of_pose = ovt_push_ego_pose(bench.detector, &pose);
  const ovt_status of_horizon = ovt_set_path_horizon(reader, std::nan(""));
  const ovt_status of_param = ovt_set_param(&bench.params, "tracker.window", "nan");
  set_usual();
  CHECK(of_pose == OVT_BAD_ARGUMENT);
  CHECK(of_horizon == OVT_BAD_ARGUMENT);
  CHECK(of_param == OVT_OUT_OF_RANGE);
  ovt_destroy_reader(reader);
}
#endif
