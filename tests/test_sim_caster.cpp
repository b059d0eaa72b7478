// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The ray caster, compared with brute force and with formulas.
#include <doctest/doctest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tools/sim/bvh.h"
#include "tools/sim/random.h"
#include "tools/sim/track.h"

using namespace overtake::sim;

namespace {

Vec3 any_direction(Random& dice) {
  for (;;) {
    const Vec3 v{dice.uniform(-1, 1), dice.uniform(-1, 1), dice.uniform(-1, 1)};
    const double size = length(v);
    if (size > 0.1 && size < 1) return v * (1 / size);
  }
}

// Compares `rays` random rays; returns the number of hits.
int64_t compare(const Bvh& bvh, int64_t rays, double reach, uint64_t seed) {
  Random dice(seed);
  int64_t hits = 0, apart = 0;
  for (int64_t i = 0; i < rays; ++i) {
    const Vec3 at = bvh.center() +
                    Vec3{dice.uniform(-reach, reach), dice.uniform(-reach, reach), dice.uniform(-reach / 4, reach / 4)};
    const Vec3 aim = bvh.center() + any_direction(dice) * dice.uniform(0, 0.8 * bvh.radius_m());
    const Vec3 direction = normalized(aim - at);
    const Hit quick = bvh.cast(at, direction, 0.02, 300), slow = bvh.cast_brute_force(at, direction, 0.02, 300);
    hits += slow.triangle >= 0;
    // On an edge, the last bit may decide whether each formula reports a hit.
    if ((quick.triangle < 0) != (slow.triangle < 0) || std::fabs(quick.range_m - slow.range_m) > 1e-3) ++apart;
  }
  CHECK(apart <= rays / 1000000);
  return hits;
}

Mesh random_soup(int count, uint64_t seed) {
  Random dice(seed);
  Mesh mesh;
  for (int i = 0; i < count; ++i) {
    const Vec3 at{dice.uniform(-20, 20), dice.uniform(-20, 20), dice.uniform(-5, 5)};
    mesh.add_triangle(at, at + any_direction(dice) * dice.uniform(0.01, 3),
                      at + any_direction(dice) * dice.uniform(0.01, 3));
  }
  return mesh;
}

}  // namespace

TEST_CASE("sim: the caster agrees with brute force to 1 mm on triangles anywhere and on a race car") {
  CHECK(compare(Bvh(random_soup(400, 1)), 20000, 30, 2) > 2000);
  CHECK(compare(Bvh(make_race_car(Surface::car)), 5000, 12, 3) > 1000);
}

TEST_CASE("sim: four rays cast together have the hits of single rays, for any directions and limits") {
  Random dice(9);
  for (const Bvh& bvh : {Bvh(random_soup(400, 1)), Bvh(make_race_car(Surface::car)), Bvh(Mesh())}) {
    int32_t hits = 0;
    for (int i = 0; i < 4000; ++i) {
      const Vec3 at = bvh.center() + any_direction(dice) * dice.uniform(0, 30), aim = any_direction(dice);
      const double spread = i % 2 ? 0.01 : 2;  // almost parallel; in all directions
      Vec3 origin[Bvh::kPack], direction[Bvh::kPack];
      double near_m[Bvh::kPack], far_m[Bvh::kPack];
      Hit together[Bvh::kPack];
      for (int k = 0; k < Bvh::kPack; ++k) {
        origin[k] = at + any_direction(dice) * 0.01;
        direction[k] = normalized((i % 4 < 2 ? aim : bvh.center() - at) + any_direction(dice) * spread);
        near_m[k] = dice.uniform(0, 5), far_m[k] = k == i % 7 ? -1 : dice.uniform(5, 60);
      }
      const int32_t likely = i % 3 && bvh.size() > 0 ? int32_t(dice.bits() % bvh.size()) : -1;
      bvh.cast_pack(origin, direction, near_m, far_m, likely, together);
      for (int k = 0; k < Bvh::kPack; ++k) {
        const Hit alone = far_m[k] > 0 ? bvh.cast(origin[k], direction[k], near_m[k], far_m[k]) : Hit();
        REQUIRE(together[k].triangle == alone.triangle);
        REQUIRE(together[k].range_m == alone.range_m);
        hits += alone.triangle >= 0;
      }
    }
    if (bvh.size() > 0) CHECK(hits > 1000);
  }
}

// Whether this machine has an instruction set of Embree's list.
bool runs_here([[maybe_unused]] const std::string& isa) {
#if defined(__x86_64__)
  if (isa == "sse4.2") return __builtin_cpu_supports("sse4.2");
  if (isa == "avx") return __builtin_cpu_supports("avx");
  if (isa == "avx2") return __builtin_cpu_supports("avx2");
  if (isa == "avx512") return __builtin_cpu_supports("avx512f");
#endif
  return true;
}

TEST_CASE("sim: every instruction set of Embree gives the same hits") {
  const Mesh soup = random_soup(400, 1);
  std::vector<Hit> expected;
  for (const char* isa : {"", "sse2", "sse4.2", "avx", "avx2", "avx512"}) {
    if (!runs_here(isa)) continue;  // Embree takes no wider one than the machine's
    const Bvh bvh(soup, isa);
    Random dice(17);
    std::vector<Hit> hits;
    for (int i = 0; i < 5000; ++i) {
      const Vec3 at = any_direction(dice) * dice.uniform(0, 30), aim = any_direction(dice);
      Vec3 origin[Bvh::kPack], direction[Bvh::kPack];
      const double near_m[Bvh::kPack] = {0.5, 0.5, 0.5, 0.5}, far_m[Bvh::kPack] = {60, 60, 60, 60};
      for (Vec3& v : origin) v = at;
      for (Vec3& v : direction) v = normalized(aim + any_direction(dice) * 0.01);
      Hit together[Bvh::kPack];
      bvh.cast_pack(origin, direction, near_m, far_m, -1, together);
      hits.insert(hits.end(), together, together + Bvh::kPack);
    }
    if (expected.empty()) expected = hits;
    const auto found = [](const Hit& hit) { return hit.triangle >= 0; };
    CHECK(std::count_if(hits.begin(), hits.end(), found) > 1000);
    CHECK(std::equal(hits.begin(), hits.end(), expected.begin(),
                     [](const Hit& a, const Hit& b) { return a.triangle == b.triangle && a.range_m == b.range_m; }));
  }
}

TEST_SUITE("long") {
  TEST_CASE("sim: the caster agrees with brute force to 1 mm on a million rays") {
    CHECK(compare(Bvh(make_race_car(Surface::car)), 700000, 15, 4) > 100000);
    CHECK(compare(Bvh(random_soup(500, 5)), 280000, 30, 6) > 30000);
    // A piece of the track with its coordinates, hundreds of metres from the origin.
    Mesh piece;
    for (const Triangle& t : make_surroundings(Track::make("oval")).triangles)
      if (std::hypot(t.a.x - 300, t.a.y - 60) < 40) piece.triangles.push_back(t);
    CHECK(piece.triangles.size() > 500);
    CHECK(compare(Bvh(piece), 20000, 60, 7) > 5000);
  }
}

TEST_CASE("sim: a caster leaves all threads to the rest of the process") {
  using Threads = oneapi::tbb::global_control;
  const std::size_t before = Threads::active_value(Threads::max_allowed_parallelism);
  const Bvh bvh(make_race_car(Surface::car));
  CHECK(Threads::active_value(Threads::max_allowed_parallelism) == before);
}

TEST_CASE("sim: closed-form scenes agree with their formulas") {
  Mesh floor;
  floor.add_quad({-500, -500, 0}, {500, -500, 0}, {500, 500, 0}, {-500, 500, 0});
  const Bvh ground(floor);
  Mesh pipe;  // a fine cylinder around the z axis
  constexpr int kSides = 4000;
  for (int i = 0; i < kSides; ++i) {
    const SinCos a = sin_cos(2 * kPi * i / kSides), b = sin_cos(2 * kPi * (i + 1) / kSides);
    pipe.add_quad({50 * a.cos, 50 * a.sin, -10}, {50 * b.cos, 50 * b.sin, -10}, {50 * b.cos, 50 * b.sin, 10},
                  {50 * a.cos, 50 * a.sin, 10});
  }
  const Bvh wall(pipe);
  Random dice(8);
  for (int i = 0; i < 5000; ++i) {
    const double azimuth = dice.uniform(-kPi, kPi), down = dice.uniform(0.01, 1.2), height = dice.uniform(0.3, 2);
    const SinCos a = sin_cos(azimuth), e = sin_cos(-down);
    const Vec3 direction{e.cos * a.cos, e.cos * a.sin, e.sin};
    REQUIRE(ground.cast({3, 4, height}, direction, 0.02, 300).range_m == doctest::Approx(height / std::sin(down)));
    // |o + t d| = 50 in the plane.
    const double x = dice.uniform(-30, 30), y = dice.uniform(-30, 30), up = dice.uniform(-0.05, 0.05);
    const Vec3 flat{std::cos(up) * a.cos, std::cos(up) * a.sin, std::sin(up)};
    const double b = (x * a.cos + y * a.sin), c = x * x + y * y - 2500;
    const double expected = (-b + std::sqrt(b * b - c)) / std::cos(up);
    REQUIRE(std::fabs(wall.cast({x, y, 0}, flat, 0.02, 300).range_m - expected) < 1e-3);
  }
  CHECK(ground.cast({0, 0, 1}, {0, 0, 1}, 0.02, 300).triangle == -1);
  CHECK(ground.cast({0, 0, 1}, {0, 0, -1}, 0.02, 0.9).triangle == -1);  // farther than the far limit
  CHECK(ground.cast({0, 0, 1}, {0, 0, -1}, 1.5, 300).triangle == -1);   // nearer than the near limit
  CHECK(Bvh(Mesh()).cast({0, 0, 1}, {0, 0, -1}, 0, 300).triangle == -1);
}

TEST_CASE("sim: the race car has its size and a few thousand triangles, and its sensors are not covered") {
  const Mesh car = make_race_car(Surface::car);
  CHECK(car.triangles.size() > 1000);
  CHECK(car.triangles.size() < 6000);
  Vec3 low{9, 9, 9}, high{-9, -9, -9};
  for (const Triangle& t : car.triangles)
    for (const Vec3 p : {t.a, t.b, t.c}) {
      low = {std::fmin(low.x, p.x), std::fmin(low.y, p.y), std::fmin(low.z, p.z)};
      high = {std::fmax(high.x, p.x), std::fmax(high.y, p.y), std::fmax(high.z, p.z)};
    }
  CHECK(high.x - low.x == doctest::Approx(kCarLengthM).epsilon(0.005));
  CHECK(high.y - low.y == doctest::Approx(kCarWidthM).epsilon(0.005));
  CHECK((high.x + low.x) / 2 == doctest::Approx(kCarCenterXM).epsilon(0.01));
  CHECK(low.z >= -0.001);
  // Nothing blocks the view ahead of each sensor.
  const Bvh bvh(car);
  CHECK(bvh.cast({2.342, 0, 0.646}, {1, 0, 0}, 0.001, 10).triangle == -1);
  const SinCos out = sin_cos(120 * kDegree);
  CHECK(bvh.cast({1.549, 0.267, 0.741}, {out.cos, out.sin, 0}, 0.001, 10).triangle == -1);
  CHECK(bvh.cast({1.549, -0.267, 0.741}, {out.cos, -out.sin, 0}, 0.001, 10).triangle == -1);
}
