// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/sim/bvh.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace overtake::sim {
namespace {

constexpr double kGrow = 2e-3;  // metres: covers what float loses up to a few kilometres from the origin
constexpr double kRimTolerance = 1e-12;

// Two doubles in one vector (an extension of g++ and clang; every supported machine has it).
using Two = double __attribute__((vector_size(16)));
Two both_of(double v) { return Two{v, v}; }

// Vectors of two rays. Products use the same operations in the same order as those of Vec3.
struct TwoVec {
  Two x, y, z;
  TwoVec operator-(Vec3 o) const { return {x - both_of(o.x), y - both_of(o.y), z - both_of(o.z)}; }
};
Two dot(Vec3 a, const TwoVec& b) { return both_of(a.x) * b.x + both_of(a.y) * b.y + both_of(a.z) * b.z; }
Two dot(const TwoVec& a, const TwoVec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
TwoVec cross(const TwoVec& a, Vec3 v) {
  const TwoVec b{both_of(v.x), both_of(v.y), both_of(v.z)};
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Embree's search limit: a little beyond far_m, because float rounds.
float search_far(double far_m) { return float(far_m * (1 + 1e-6)); }

}  // namespace

// Input and output of Embree's callback, which receives the address of the first member.
struct Bvh::Pack {
  RTCIntersectContext context;
  const std::vector<Edges>& edges;
  TwoVec from[2], along[2];
  Two near_m[2], far_m[2];
  double nearest_m[kPack];  // so far
  Hit hit[kPack];

  // Intersects a triangle with the rays 2 half and 2 half + 1.
  void meet(int32_t triangle, int32_t half) {
    const Edges& e = edges[std::size_t(triangle)];
    const TwoVec p = cross(along[half], e.ac);
    const Two inv = 1 / dot(e.ab, p);  // infinite for a ray in the triangle's plane: then no comparison holds
    const TwoVec to = from[half] - e.a;
    const Two u = dot(to, p) * inv;
    const TwoVec q = cross(to, e.ab);
    const Two v = dot(along[half], q) * inv, t = dot(e.ac, q) * inv;
    const auto met = (u >= -kRimTolerance) & (u <= 1 + kRimTolerance) & (v >= -kRimTolerance) &
                     (u + v <= 1 + kRimTolerance) & (t > near_m[half]) & (t < far_m[half]);
    if ((met[0] | met[1]) == 0) return;
    for (int32_t lane = 0; lane < 2; ++lane) {
      const int32_t i = 2 * half + lane;
      if (met[lane] == 0 || !(t[lane] < nearest_m[i] || (t[lane] == nearest_m[i] && triangle < hit[i].triangle)))
        continue;
      nearest_m[i] = t[lane];
      hit[i] = {t[lane], triangle};
    }
  }

  static void box_of(const RTCBoundsFunctionArguments* of) {
    const Edges& e = (*static_cast<const std::vector<Edges>*>(of->geometryUserPtr))[of->primID];
    const auto low = [](double a, double ab, double ac) { return float(a + std::min({0.0, ab, ac}) - kGrow); };
    const auto high = [](double a, double ab, double ac) { return float(a + std::max({0.0, ab, ac}) + kGrow); };
    *of->bounds_o = {low(e.a.x, e.ab.x, e.ac.x),  low(e.a.y, e.ab.y, e.ac.y),  low(e.a.z, e.ab.z, e.ac.z),  0,
                     high(e.a.x, e.ab.x, e.ac.x), high(e.a.y, e.ab.y, e.ac.y), high(e.a.z, e.ab.z, e.ac.z), 0};
  }

  static void meet_valid(const RTCIntersectFunctionNArguments* of) {
    Pack& pack = *reinterpret_cast<Pack*>(of->context);
    RTCRayN* rays = RTCRayHitN_RayN(of->rayhit, of->N);
    bool half[2] = {};
    for (unsigned i = 0; i < of->N; ++i)
      if (of->valid[i] != 0) half[RTCRayN_id(rays, of->N, i) / 2] = true;
    for (int32_t k = 0; k < 2; ++k)
      if (half[k]) pack.meet(int32_t(of->primID), k);
    for (unsigned i = 0; i < of->N; ++i)
      if (of->valid[i] != 0) RTCRayN_tfar(rays, of->N, i) = search_far(pack.nearest_m[RTCRayN_id(rays, of->N, i)]);
  }
};

Bvh::Bvh(const Mesh& mesh, const std::string& isa) : triangles_(mesh.triangles) {
  if (triangles_.empty()) return;
  std::vector<Edges> edges;
  Vec3 low = triangles_[0].a, high = low;
  for (const Triangle& t : triangles_) {
    const Vec3 n = cross(t.b - t.a, t.c - t.a);
    const double size = length(n);
    normal_.push_back(size > 0 ? n * (1 / size) : Vec3{0, 0, 1});
    edges.push_back({t.a, t.b - t.a, t.c - t.a});
    for (const Vec3 p : {t.a, t.b, t.c}) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  }
  center_ = (low + high) * 0.5;
  for (const Triangle& t : triangles_)
    for (const Vec3 p : {t.a, t.b, t.c}) radius_ = std::max(radius_, length(p - center_));

  edges_ = std::make_shared<const std::vector<Edges>>(std::move(edges));
  // The scene keeps a reference to the device. No "threads": Embree would limit all of the process to them.
  const std::unique_ptr<RTCDeviceTy, void (*)(RTCDevice)> device(
      rtcNewDevice((isa.empty() ? "" : "isa=" + isa).c_str()), rtcReleaseDevice);
  if (device == nullptr) throw std::runtime_error("Embree does not run on this machine");
  scene_.reset(rtcNewScene(device.get()), rtcReleaseScene);
  rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_HIGH);
  rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
  const RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, unsigned(triangles_.size()));
  rtcSetGeometryUserData(geometry, const_cast<std::vector<Edges>*>(edges_.get()));
  rtcSetGeometryBoundsFunction(geometry, Pack::box_of, nullptr);
  rtcSetGeometryIntersectFunction(geometry, Pack::meet_valid);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_.get(), geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_.get());
  if (const RTCError error = rtcGetDeviceError(device.get()); error != RTC_ERROR_NONE)
    throw std::runtime_error("Embree cannot build a hierarchy of " + std::to_string(triangles_.size()) +
                             " triangles: error " + std::to_string(int(error)));
}

void Bvh::cast_pack(const Vec3* origin, const Vec3* direction, const double* near_m, const double* far_m,
                    int32_t likely, Hit* out) const {
  std::fill_n(out, kPack, Hit());
  if (scene_ == nullptr) return;
  Pack pack{
      .context = {}, .edges = *edges_, .from = {}, .along = {}, .near_m = {}, .far_m = {}, .nearest_m = {}, .hit = {}};
  rtcInitIntersectContext(&pack.context);
  pack.context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  for (int32_t i = 0; i < kPack; ++i) {
    const int32_t half = i / 2, lane = i % 2;
    pack.from[half].x[lane] = origin[i].x, pack.from[half].y[lane] = origin[i].y, pack.from[half].z[lane] = origin[i].z;
    pack.along[half].x[lane] = direction[i].x, pack.along[half].y[lane] = direction[i].y;
    pack.along[half].z[lane] = direction[i].z;
    pack.near_m[half][lane] = near_m[i], pack.far_m[half][lane] = pack.nearest_m[i] = far_m[i];
  }
  if (likely >= 0) pack.meet(likely, 0), pack.meet(likely, 1);
  alignas(16) int32_t valid[kPack];
  alignas(16) RTCRayHit4 rays = {};
  for (int32_t i = 0; i < kPack; ++i) {
    valid[i] = far_m[i] > 0 ? -1 : 0;
    rays.ray.org_x[i] = float(origin[i].x), rays.ray.dir_x[i] = float(direction[i].x);
    rays.ray.org_y[i] = float(origin[i].y), rays.ray.dir_y[i] = float(direction[i].y);
    rays.ray.org_z[i] = float(origin[i].z), rays.ray.dir_z[i] = float(direction[i].z);
    rays.ray.tfar[i] = search_far(pack.nearest_m[i]);
    rays.ray.mask[i] = ~0u, rays.ray.id[i] = unsigned(i);
    rays.hit.geomID[i] = rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  rtcIntersect4(valid, scene_.get(), &pack.context, &rays);
  std::copy_n(pack.hit, kPack, out);
}

Hit Bvh::cast(Vec3 origin, Vec3 direction, double near_m, double far_m, int32_t likely) const {
  const Vec3 origins[kPack] = {origin, origin, origin, origin};
  const Vec3 directions[kPack] = {direction, direction, direction, direction};
  const double nears[kPack] = {near_m, near_m, near_m, near_m}, fars[kPack] = {far_m, 0, 0, 0};
  Hit hits[kPack];
  cast_pack(origins, directions, nears, fars, likely, hits);
  return hits[0];
}

Hit Bvh::cast_brute_force(Vec3 origin, Vec3 direction, double near_m, double far_m) const {
  Hit hit;
  double far = far_m;
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const Triangle& t = triangles_[i];
    const Vec3 n = cross(t.b - t.a, t.c - t.a);
    const double speed = dot(n, direction);
    if (speed == 0) continue;
    const double range = dot(n, t.a - origin) / speed;
    if (range <= near_m || range >= far) continue;
    const Vec3 p = origin + direction * range;
    const double slack = -1e-12 * dot(n, n);
    if (dot(n, cross(t.b - t.a, p - t.a)) < slack || dot(n, cross(t.c - t.b, p - t.b)) < slack ||
        dot(n, cross(t.a - t.c, p - t.c)) < slack)
      continue;
    far = range;
    hit = {range, int32_t(i)};
  }
  return hit;
}

}  // namespace overtake::sim
