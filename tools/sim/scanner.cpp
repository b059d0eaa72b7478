// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/sim/scanner.h"

#include <algorithm>
#include <span>

#include "tools/sim/link_budget.h"

namespace overtake::sim {
namespace {

constexpr int32_t kHeads = 2, kBeams = kHeads * kShots, kLayers = 3;
constexpr double kBloomFrom = 3;    // reflectivity above which the beam's skirts give returns
constexpr int32_t kBloomReach = 3;  // shots to either side

// The hits of one ray, nearest first: more than one only behind wire mesh.
using Layers = std::span<const BeamHit>;

struct LineWork {
  LineView view;
  double begin_s = 0, top_rad = 0, fall_rad = 0;
  bool missing = false;
  std::vector<SinCos> elevation;  // [shot][head]
  std::vector<BeamHit> hits;      // of the middle rays, in casting order
  struct Span {
    int32_t begin, count;
  };
  std::vector<Span> spans;  // in `hits`: [shot][head]
  Layers middle(int32_t beam) const {
    const Span& span = spans[std::size_t(beam)];
    return {hits.data() + span.begin, std::size_t(span.count)};
  }
  struct CarCone {
    double azimuth_rad, elevation_rad, radius_rad;  // sensor frame, generous
  };
  std::vector<CarCone> cars;
  Scan out;
};

struct Contribution {
  double range_m, g;  // g: reflectivity times its share of the beam
  double peak;        // part of g at the peak of the pulse: the reported intensity
  double noticed;     // part of g to which the receiver responds
  uint16_t surface;

  void keep(double part) { g *= part, peak *= part, noticed *= part; }
};

struct JobWork {
  const ScanJob* job;
  std::vector<LineWork> lines;
  PuffCloud smoke;
  std::vector<SinCos> azimuth;  // [shot][head]
};

double shot_share(int32_t shot) { return double(shot) / kShots; }

// Both heads sweep half of their overlap more than the half of the field of view.
double shot_step(const ScanJob& job) { return kShotStep + job.heads.overlap_rad / 2 / kShots; }

double azimuth_of(const ScanJob& job, int32_t beam) {
  return kAzimuthLeft - (beam % kHeads) * (60 * kDegree - job.heads.overlap_rad / 2) -
         (beam / kHeads + 0.5) * shot_step(job);
}

double elevation_of(const ScanJob& job, const LineWork& line, int32_t beam) {
  return line.top_rad + line.fall_rad * shot_share(beam / kHeads) +
         (beam % kHeads == 0 ? 0.5 : -0.5) * job.heads.step_rad;
}

Ray make_ray(const JobWork& work, const LineWork& line, int32_t beam, double aside_rad, double up_rad) {
  const double share = shot_share(beam / kHeads);
  SinCos a = work.azimuth[std::size_t(beam)];
  if (aside_rad != 0) a = {a.sin + a.cos * aside_rad, a.cos - a.sin * aside_rad};
  const SinCos e =
      up_rad == 0 ? line.elevation[std::size_t(beam)] : sin_cos(elevation_of(*work.job, line, beam) + up_rad);
  const Mounting& mounting = work.job->mounting;
  const Rigid ego = blend(line.view.ego[0], line.view.ego[1], share);
  Ray ray;
  ray.origin_vehicle = mounting.real.place;
  ray.direction_vehicle = normalized(mounting.real.rotation * Vec3{e.cos * a.cos, e.cos * a.sin, e.sin});
  ray.origin_map = ego * ray.origin_vehicle;
  ray.direction_map = ego.rotation * ray.direction_vehicle;
  return ray;
}

// A beam hits wires of a mesh or passes between them. Wires stop a share of the beam. Near the sensor the beam is
// narrower than a mesh, and most beams pass.
bool meets_wire(const SensorErrors& errors, BeamHit& hit, Random& dice) {
  const double wire = material_of(hit.material).wire_m;
  if (wire == 0) return true;
  const double across = kMeshPitch, along = kMeshPitch * std::max(hit.cos_incidence, 0.05);
  const double reach = wire + 0.5 * errors.beam_rad * hit.range_m;  // half of the energy is within half the width
  const double missed = (1 - std::min(1.0, reach / across)) * (1 - std::min(1.0, reach / along));
  const double stopped = 1 - (1 - wire / across) * (1 - std::min(1.0, wire / along));
  if (dice.uniform() < missed) return false;
  hit.coverage = std::min(1.0, stopped / (1 - missed));
  hit.cos_incidence = 0.7;  // wires are round
  return true;
}

int32_t last_triangle(Layers layers) { return layers.empty() ? -1 : layers.back().triangle; }

struct PackHits {
  BeamHit hit[Bvh::kPack][kLayers];
  int32_t count[Bvh::kPack] = {};
  Layers of(int32_t ray) const { return {hit[ray], std::size_t(count[ray])}; }
};

// Casts a pack until each ray is stopped or leaves the scene. All rays of a beam have the same result for a wire.
void cast_layers(const JobWork& work, const LineWork& line, int32_t number, const int32_t (&beams)[Bvh::kPack],
                 const Ray (&rays)[Bvh::kPack], int32_t likely, PackHits& out) {
  const ScanJob& job = *work.job;
  RayCast pack[Bvh::kPack];
  Random dice[Bvh::kPack] = {Random(0), Random(0), Random(0), Random(0)};
  for (int32_t i = 0; i < Bvh::kPack; ++i) {
    const double share = shot_share(beams[i] / kHeads);
    const bool own_car = job.own_car->may_meet(azimuth_of(job, beams[i]), elevation_of(job, line, beams[i]));
    pack[i] = {rays[i], share, own_car, true, 0.02, {}};
    dice[i] = job.random.branch(uint64_t(number) * kBeams + uint64_t(beams[i]) + (uint64_t(1) << 40));
    out.count[i] = 0;
  }
  for (bool more = true; more;) {
    cast(*job.world, line.view, pack, job.errors->range_max_m, likely);
    more = false;
    for (int32_t i = 0; i < Bvh::kPack; ++i) {
      RayCast& ray = pack[i];
      if (!ray.active) continue;
      if (ray.hit.surface == uint16_t(Surface::none)) {
        ray.active = false;
        continue;
      }
      ray.near_m = ray.hit.range_m + 1e-3;
      if (meets_wire(*job.errors, ray.hit, dice[i])) {
        out.hit[i][out.count[i]++] = ray.hit;
        ray.active = ray.hit.coverage < 1 && out.count[i] < kLayers;
      }
      more = more || ray.active;
    }
  }
}

void begin_line(JobWork& work, int32_t number) {
  const ScanJob& job = *work.job;
  LineWork& line = work.lines[std::size_t(number)];
  const double lines = double(work.lines.size());
  line.begin_s = job.begin_s + number / job.pattern->lines_per_s;
  line.view = LineView::make(*job.world, line.begin_s, line.begin_s + kSweepShare / job.pattern->lines_per_s);
  line.top_rad = job.pattern->elevation(number / lines, line.begin_s);
  line.fall_rad = job.pattern->elevation((number + kSweepShare) / lines, line.begin_s) - line.top_rad;
  line.missing = job.random.branch(uint64_t(number) + 1000000).uniform() < job.errors->missing_line_share;
  for (int32_t beam = 0; beam < kBeams; ++beam) line.elevation.push_back(sin_cos(elevation_of(job, line, beam)));
  line.hits.reserve(kBeams);
  line.spans.resize(kBeams);
  const Rigid sensor = line.view.ego[0] * job.mounting.real;
  for (const Rigid& car : line.view.cars[0]) {
    const Vec3 to = sensor.inverse_times(car * job.world->car.center());
    const double away = length(to), radius = job.world->car.radius_m() + 0.3;
    line.cars.push_back({atan2_of(to.y, to.x), atan2_of(to.z, std::sqrt(to.x * to.x + to.y * to.y)),
                         away > radius ? asin_of(radius / away) + kDegree : kPi});
  }
  static_assert(kShots % Bvh::kPack == 0);
  PackHits met;
  for (int32_t head = 0; head < kHeads && !line.missing; ++head) {
    int32_t likely = -1;
    for (int32_t shot = 0; shot < kShots; shot += Bvh::kPack) {
      int32_t beams[Bvh::kPack];
      Ray rays[Bvh::kPack];
      for (int32_t i = 0; i < Bvh::kPack; ++i) {
        beams[i] = (shot + i) * kHeads + head;
        rays[i] = make_ray(work, line, beams[i], 0, 0);
      }
      cast_layers(work, line, number, beams, rays, likely, met);
      for (int32_t i = 0; i < Bvh::kPack; ++i) {
        line.spans[std::size_t(beams[i])] = {int32_t(line.hits.size()), met.count[i]};
        line.hits.insert(line.hits.end(), met.hit[i], met.hit[i] + met.count[i]);
      }
      likely = last_triangle(met.of(Bvh::kPack - 1));
    }
  }
}

// Road, apron and grass count as one surface: there is no range edge between them.
uint16_t floor_as_one(uint16_t surface) {
  return surface == uint16_t(Surface::apron_grass) ? uint16_t(Surface::road) : surface;
}

// The surface that stopped the beam completely, behind wires, or none (surface 0).
const BeamHit& solid_hit(Layers layers) {
  static const BeamHit kNothing;
  return layers.empty() || layers.back().coverage < 1 ? kNothing : layers.back();
}

// Whether two neighbouring beams hit the same surface at about the same range.
bool alike(Layers a, Layers b) {
  const BeamHit &p = solid_hit(a), &q = solid_hit(b);
  if (floor_as_one(p.surface) != floor_as_one(q.surface)) return false;
  const double slack = p.cos_incidence < 0.3 ? 0.1 : 0.02;  // a surface seen at a grazing angle
  return std::fabs(p.range_m - q.range_m) < 0.3 + slack * std::min(p.range_m, q.range_m);
}

bool meets_car(Layers layers) {
  for (const BeamHit& hit : layers)
    if (hit.surface >= uint16_t(Surface::car)) return true;
  return false;
}

bool may_meet_car(const ScanJob& job, const LineWork& line, int32_t beam) {
  const double azimuth = azimuth_of(job, beam), elevation = elevation_of(job, line, beam);
  for (const auto& car : line.cars)
    if (std::fabs(wrap_angle(azimuth - car.azimuth_rad)) < car.radius_rad &&
        std::fabs(elevation - car.elevation_rad) < car.radius_rad)
      return true;
  return false;
}

bool needs_split(const JobWork& work, int32_t number, int32_t beam) {
  const LineWork& line = work.lines[std::size_t(number)];
  const Layers own = line.middle(beam);
  if (meets_car(own) || may_meet_car(*work.job, line, beam)) return true;
  for (const int32_t other : {beam - kHeads, beam + kHeads})
    if (other >= 0 && other < kBeams && !alike(own, line.middle(other))) return true;
  for (const int32_t other : {number - 1, number + 1}) {
    if (other < 0 || other >= int32_t(work.lines.size())) continue;
    const LineWork& next = work.lines[std::size_t(other)];
    if (next.missing) continue;
    // Floors differ in range from row to row: there only the surface counts.
    if (floor_as_one(solid_hit(own).surface) != floor_as_one(solid_hit(next.middle(beam)).surface)) return true;
  }
  return false;
}

// Whether the sensor reports what this beam sees of the own car. The own front tyres are so near and dark that the
// recorded front sensor reports a few patches of them only.
bool reports_own_car(const JobWork& work, int32_t number, int32_t beam) {
  const ScanJob& job = *work.job;
  if (job.errors->report_own_car) return true;
  if (job.sensor != 0) return false;
  constexpr int32_t kPatch = 16 * kHeads;  // 2 deg of one head
  constexpr double kPatches = 0.08;        // share of patches with returns
  const Random lines = job.random.branch(uint64_t(number) + (uint64_t(1) << 41));
  Random patch = lines.branch(uint64_t(beam / kPatch * kHeads + beam % kHeads));
  if (patch.uniform() >= std::max(kPatches, job.errors->own_nose_share)) return false;
  return lines.branch(uint64_t(beam) + kBeams).uniform() < std::min(1.0, job.errors->own_nose_share / kPatches);
}

void add_layers(const JobWork& work, Layers layers, double share, bool report_own, std::vector<Contribution>& out) {
  for (const BeamHit& hit : layers) {
    if (hit.surface == uint16_t(Surface::own_car) && !report_own) return;
    double g = share * hit.coverage * returned_share(material_of(hit.material), hit.cos_incidence);
    if (floor_as_one(hit.surface) == uint16_t(Surface::road)) g *= work.job->rain->floor_share();
    const double loss = stretch_loss(hit.range_m, work.job->errors->beam_rad, hit.cos_incidence);
    out.push_back({hit.range_m, g, g * loss, g * receiver_loss(loss), hit.surface});
    share *= 1 - hit.coverage;
  }
}

// A surface seen at a grazing angle spreads its echo, but gives one echo only. The rays across a beam sample it at a
// few places.
bool one_surface(const Contribution& a, const Contribution& b) {
  return floor_as_one(a.surface) == floor_as_one(b.surface) && a.surface <= uint16_t(Surface::inner_wall) &&
         b.range_m - a.range_m < 0.15 * a.range_m;
}

// Merges contributions within a pulse's length into one echo: range by energy, surface of the strongest.
void merge_echoes(std::vector<Contribution>& list) {
  std::sort(list.begin(), list.end(), [](const Contribution& a, const Contribution& b) {
    return a.range_m != b.range_m ? a.range_m < b.range_m : a.surface != b.surface ? a.surface < b.surface : a.g < b.g;
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < list.size();) {
    Contribution echo = list[i];
    double strongest = echo.g, moment = echo.g * echo.range_m;
    std::size_t j = i + 1;
    for (; j < list.size() && (list[j].range_m - list[i].range_m < kPulse || one_surface(list[j - 1], list[j])); ++j) {
      echo.g += list[j].g;
      echo.peak += list[j].peak;
      echo.noticed += list[j].noticed;
      moment += list[j].g * list[j].range_m;
      if (list[j].g > strongest) strongest = list[j].g, echo.surface = list[j].surface;
    }
    if (echo.g > 0) echo.range_m = moment / echo.g;
    list[kept++] = echo;
    i = j;
  }
  list.resize(kept);
}

// Whether dirt on the window stops a beam of this azimuth.
bool is_stopped(const ScanJob& job, const SinCos& azimuth) {
  return std::any_of(job.dirt.begin(), job.dirt.end(), [&](const Dirt& dirt) {
    const double cos = azimuth.cos * std::cos(dirt.azimuth_rad) + azimuth.sin * std::sin(dirt.azimuth_rad);
    return dirt.sensor == job.sensor && job.begin_s >= dirt.from_s && job.begin_s < dirt.to_s &&
           cos > std::cos(dirt.width_rad / 2);
  });
}

void emit(const JobWork& work, const LineWork& line, int32_t number, int32_t beam, std::vector<Contribution>& echoes,
          Random& dice, Scan& out) {
  const SensorErrors& errors = *work.job->errors;
  const SinCos a = work.azimuth[std::size_t(beam)], e = line.elevation[std::size_t(beam)];
  if (is_stopped(*work.job, a)) return;
  struct Found {
    Contribution echo;
    double signal, mean;
  };
  Found found[2];
  int32_t count = 0;
  double ready_m = 0;
  for (const Contribution& echo : echoes) {
    if (echo.range_m < std::max(ready_m, errors.range_min_m) || echo.range_m > errors.range_max_m) continue;
    const double mean = received_signal(echo.noticed, echo.range_m);
    if (mean < kThreshold - 6) continue;  // six sigma below the threshold: never detected
    const double speckle = 0.1 * clamp(dice.normal(), -3, 3), noise = dice.normal();
    const double signal = mean * (mean > 50 ? 1 + speckle : 1) + noise;
    if (signal <= kThreshold) continue;
    ready_m = echo.range_m + kRecovery;
    const int32_t most = errors.second_returns ? 2 : 1;
    if (count < most)
      found[count++] = {echo, signal, mean};
    else if (signal > std::min(found[0].signal, found[most - 1].signal))
      found[most == 2 && found[0].signal > found[1].signal ? 1 : 0] = {echo, signal, mean};
  }
  if (count == 2 && found[1].echo.range_m < found[0].echo.range_m) std::swap(found[0], found[1]);
  if (count == 2 && found[1].echo.range_m - found[0].echo.range_m > kSecondWithin) {
    if (found[1].signal > found[0].signal) found[0] = found[1];
    count = 1;
  }
  const double late = (double(number) + kSweepShare * (beam + 0.5) / kBeams) / work.job->pattern->lines_per_s;
  for (int32_t i = 0; i < count; ++i) {
    const double range = found[i].echo.range_m + errors.range_noise_m * dice.normal();
    const double intensity = clamp(found[i].echo.peak * found[i].signal / found[i].mean, 0, 4095.0 / 2048);
    out.x_m.push_back(float(range * e.cos * a.cos));
    out.y_m.push_back(float(range * e.cos * a.sin));
    out.z_m.push_back(float(range * e.sin));
    out.intensity.push_back(float(std::floor(intensity * 2048) / 2048));
    out.ring.push_back(uint16_t(number));
    out.surface.push_back(found[i].echo.surface);
    out.time_ns.push_back(uint32_t(late * 1e9 + 0.5));
    out.return_number.push_back(uint8_t(i));
  }
}

// Drops before the surfaces, and the loss by all the rain on the way.
void rain_on(const ScanJob& job, std::span<const DropReturn> drops, double far_m, std::vector<Contribution>& echoes) {
  const double loss_pm = 2 * job.rain->extinction_pm();
  double left = 1;
  const std::size_t surfaces = echoes.size();
  for (const DropReturn& drop : drops) {
    if (drop.range_m > far_m) break;
    const double g = left * drop.share * job.rain->drop_reflectivity;
    echoes.push_back({drop.range_m, g, g, g * gain_near(drop.range_m), uint16_t(Surface::rain)});
    left *= square(1 - drop.share);
  }
  for (std::size_t i = 0; i < surfaces; ++i) echoes[i].keep(left * exp_of(-loss_pm * echoes[i].range_m));
}

struct Bloom {
  int32_t beam;
  double range_m, g;
};

void finish_line(JobWork& work, int32_t number) {
  LineWork& line = work.lines[std::size_t(number)];
  if (line.missing) return;
  const ScanJob& job = *work.job;
  const double beam_rad = job.errors->beam_rad, off = 0.3 * beam_rad;
  std::vector<Bloom> blooms;
  for (int32_t beam = 0; beam < kBeams; ++beam) {
    const Layers layers = line.middle(beam);
    if (layers.empty()) continue;
    const BeamHit& last = layers.back();
    const Material& material = material_of(last.material);
    if (material.retro < 1) continue;
    const double g = returned_share(material, last.cos_incidence);
    if (g > kBloomFrom) blooms.push_back({beam, last.range_m, g});
  }
  std::vector<Contribution> echoes;
  std::vector<SmokeReturn> smoke;
  std::vector<DropReturn> drops[kHeads];
  std::size_t next_drop[kHeads] = {};
  for (int32_t head = 0; head < kHeads; ++head)
    catch_drops(*job.rain, {shot_step(job), beam_rad, kShots}, job.errors->range_min_m,
                job.random.branch(uint64_t(number * kHeads + head) + (uint64_t(1) << 42)), drops[head]);
  PackHits met;
  line.out.beams = kBeams;
  line.out.lines = 1;
  for (int32_t beam = 0; beam < kBeams; ++beam) {
    Random dice = job.random.branch(uint64_t(number) * kBeams + uint64_t(beam));
    echoes.clear();
    const Layers middle = line.middle(beam);
    const bool on_own = !middle.empty() && middle.back().surface == uint16_t(Surface::own_car);
    const bool report_own = on_own && reports_own_car(work, number, beam);
    if (beam_rad > 0 && needs_split(work, number, beam)) {
      ++line.out.split_beams;
      const int32_t likely = last_triangle(middle);
      add_layers(work, middle, 0.4, report_own, echoes);
      Ray parts[Bvh::kPack];
      for (int32_t corner = 0; corner < Bvh::kPack; ++corner)
        parts[corner] = make_ray(work, line, beam, corner & 1 ? off : -off, corner & 2 ? off : -off);
      cast_layers(work, line, number, {beam, beam, beam, beam}, parts, likely, met);
      for (int32_t corner = 0; corner < Bvh::kPack; ++corner)
        add_layers(work, met.of(corner), 0.15, report_own, echoes);
    } else {
      add_layers(work, middle, 1, report_own, echoes);
    }
    for (const Bloom& bloom : blooms) {
      const int32_t shots = std::abs(bloom.beam - beam) / kHeads;
      if ((bloom.beam - beam) % kHeads == 0 && shots > 0 && shots <= kBloomReach)
        echoes.push_back({bloom.range_m, bloom.g * exp_of(-2.5 * shots), bloom.g * exp_of(-2.5 * shots),
                          bloom.g * exp_of(-2.5 * shots), uint16_t(Surface::blooming)});
    }
    double far = job.errors->range_max_m;
    if (!echoes.empty()) far = std::min(far, echoes.front().range_m);
    if (!middle.empty()) far = std::min(far, middle.back().range_m);  // also the own car, reported or not
    if (!work.smoke.puffs.empty()) {
      smoke.clear();
      const Ray ray = make_ray(work, line, beam, 0, 0);
      const double left = cross_smoke(work.smoke, ray.origin_map, ray.direction_map, far, dice, smoke);
      for (Contribution& echo : echoes) echo.keep(left);
      for (const SmokeReturn& s : smoke) {
        const double g = kSmokeReflectivity * s.share, peak = g * kPulse / (kPulse + s.depth_m);
        echoes.push_back({s.range_m, g, peak, peak, uint16_t(Surface::smoke_dust)});
      }
    }
    if (job.rain->falls()) {
      const std::vector<DropReturn>& list = drops[beam % kHeads];
      std::size_t& next = next_drop[beam % kHeads];
      const std::size_t first = next;
      while (next < list.size() && list[next].shot == beam / kHeads) ++next;
      rain_on(job, {list.data() + first, next - first}, far, echoes);
    }
    merge_echoes(echoes);
    emit(work, line, number, beam, echoes, dice, line.out);
  }
}

template <class T>
void append_column(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

}  // namespace

void Scan::append(const Scan& o) {
  append_column(x_m, o.x_m), append_column(y_m, o.y_m), append_column(z_m, o.z_m);
  append_column(intensity, o.intensity), append_column(ring, o.ring), append_column(surface, o.surface);
  append_column(time_ns, o.time_ns), append_column(return_number, o.return_number);
  lines += o.lines, beams += o.beams, split_beams += o.split_beams;
}

std::vector<Scan> take_scans(const std::vector<ScanJob>& jobs, Workers& workers) {
  std::vector<JobWork> works(jobs.size());
  std::vector<std::pair<int32_t, int32_t>> tasks;
  for (std::size_t j = 0; j < jobs.size(); ++j) {
    works[j].job = &jobs[j];
    works[j].lines.resize(std::size_t(jobs[j].pattern->lines()));
    works[j].smoke = puffs_at(jobs[j].world->puff_sources, jobs[j].begin_s, jobs[j].world->puff_random);
    for (int32_t shot = 0; shot < kShots; ++shot)
      for (int32_t head = 0; head < kHeads; ++head)
        works[j].azimuth.push_back(sin_cos(azimuth_of(jobs[j], shot * kHeads + head)));
    for (int32_t line = 0; line < int32_t(works[j].lines.size()); ++line) tasks.push_back({int32_t(j), line});
  }
  workers.for_each(int32_t(tasks.size()), [&](int32_t i) {
    begin_line(works[std::size_t(tasks[std::size_t(i)].first)], tasks[std::size_t(i)].second);
  });
  workers.for_each(int32_t(tasks.size()), [&](int32_t i) {
    finish_line(works[std::size_t(tasks[std::size_t(i)].first)], tasks[std::size_t(i)].second);
  });
  std::vector<Scan> scans(jobs.size());
  for (std::size_t j = 0; j < jobs.size(); ++j)
    for (const LineWork& line : works[j].lines) scans[j].append(line.out);
  return scans;
}

}  // namespace overtake::sim
