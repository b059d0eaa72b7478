// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The output of the simulated LiDARs: pattern, times, returns, and points on the world's surfaces.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "core/hash.h"
#include "tools/sim/link_budget.h"
#include "tools/sim/log_writer.h"

using namespace overtake;
using namespace overtake::sim;

namespace {

Scenario exact(const std::string& name) {
  Scenario s = load_scenario(name);
  s.errors.range_noise_m = 0, s.errors.clock_jitter_s = 0;
  s.errors.mounting_error_m = s.errors.mounting_error_rad = 0;
  s.errors.own_nose_share = 0;
  return s;
}

int32_t count_surface(const SimFrame& frame, Surface surface) {
  int32_t count = 0;
  for (const Scan& scan : frame.scans)
    count += int32_t(std::count(scan.surface.begin(), scan.surface.end(), uint16_t(surface)));
  return count;
}

constexpr uint64_t kGoldenFrame = 18411656268966428040u;  // scenario overtake, seed 11, frame 1
constexpr uint64_t kGoldenRain = 4190095563275138102u;    // scenario rain, seed 11, frame 1

uint64_t hash_of(const SimFrame& frame) {
  Hash h;
  for (int32_t s = 0; s < kSensors; ++s) {
    const Scan& scan = frame.scans[std::size_t(s)];
    h.add_value(frame.stamp_ns[s]);
    h.add_bytes(scan.x_m.data(), scan.size() * sizeof(float)),
        h.add_bytes(scan.y_m.data(), scan.size() * sizeof(float));
    h.add_bytes(scan.z_m.data(), scan.size() * sizeof(float)),
        h.add_bytes(scan.intensity.data(), scan.size() * sizeof(float));
    h.add_bytes(scan.ring.data(), scan.size() * sizeof(uint16_t)),
        h.add_bytes(scan.surface.data(), scan.size() * sizeof(uint16_t));
    h.add_bytes(scan.time_ns.data(), scan.size() * sizeof(uint32_t));
  }
  return h.value();
}

}  // namespace

TEST_CASE("sim: 10 % Lambertian is detected at 250 m with probability 0.9, and the link budget follows physics") {
  Random dice(1);
  int noticed = 0;
  for (int i = 0; i < 100000; ++i) noticed += received_signal(0.1, 250) + dice.normal() > kThreshold;
  CHECK(noticed / 1e5 == doctest::Approx(0.9).epsilon(0.005));
  CHECK(received_signal(0.1, 125) / received_signal(0.1, 250) == doctest::Approx(4 * std::exp(2e-4 * 125)));
  CHECK(received_signal(0.2, 80) / received_signal(0.1, 80) == doctest::Approx(2));
  CHECK(stretch_loss(50, 0.0015, 1) == doctest::Approx(1));
  CHECK(stretch_loss(80, 0.0015, 0.65 / 80) == doctest::Approx(0.6 / (80 * 0.0015 * 80 / 0.65)).epsilon(0.01));
  // Asphalt as in the recorded front scans: no return is missing at a spread of 1.25 m (40 m away), half of them at
  // 1.9 m (54 m), all at 2.5 m (60 m).
  const auto share = [&](double range, double spread) {
    const double c = range * 0.0015 / std::hypot(spread, range * 0.0015);
    const double g = returned_share(material_of(MaterialId::asphalt), c);
    const double mean = received_signal(g * receiver_loss(stretch_loss(range, 0.0015, c)), range);
    int detected = 0;
    for (int i = 0; i < 2000; ++i) detected += mean + dice.normal() > kThreshold;
    return detected / 2000.0;
  };
  CHECK(share(40, 1.25) > 0.999);
  CHECK(std::fabs(share(54, 1.9) - 0.5) < 0.2);
  CHECK(share(60, 2.5) < 0.01);
}

TEST_CASE("sim: scan patterns go down, stay in their field of view, and are dense where specified") {
  ScanPattern p;
  CHECK(p.lines() == 32);
  for (const char* name : {"uniform", "gaussian", "horizon_dense"}) {
    p.kind = pattern_kind(name);
    double last = 1;
    for (int i = 0; i <= 320; ++i) {
      const double e = p.elevation(i / 320.0, 0);
      CHECK(e < last);
      CHECK(e <= p.fov_top_rad + 1e-9);
      CHECK(e >= p.fov_bottom_rad - 1e-9);
      last = e;
    }
    const double middle = p.elevation(15.5 / 32, 0) - p.elevation(16.5 / 32, 0),
                 edge = p.elevation(0.5 / 32, 0) - p.elevation(1.5 / 32, 0);
    if (p.kind == PatternKind::uniform) {
      CHECK(middle == doctest::Approx(edge));
      CHECK(middle / kDegree == doctest::Approx(14.0 / 32));
    } else {
      CHECK(middle < 0.7 * edge);
    }
  }
  p.rate_hz = 1;
  CHECK(p.lines() == 640);
  p.rate_hz = 30;
  CHECK(p.lines() == 21);
  p.rate_hz = 25;
  CHECK(p.lines() == 25);  // a scan ends before the next one begins
  p.drift_rad = 0.01, p.drift_period_s = 4;
  CHECK(p.elevation(0.5, 1) - p.elevation(0.5, 0) == doctest::Approx(0.01));
  for (const double q : {0.001, 0.1, 0.5, 0.8, 0.9999})
    CHECK(normal_distribution(normal_quantile(q)) == doctest::Approx(q));
  CHECK(kSignalAtReference - kThreshold == doctest::Approx(normal_quantile(0.9)).epsilon(1e-9));
}

TEST_CASE("sim: one seed gives one hash for any workers and order; another seed gives another") {
  const Scenario scenario = load_scenario("overtake");
  Simulator one(scenario, 11, 0.4, 1), three(scenario, 11, 0.4, 3), other(scenario, 12, 0.4, 1);
  const uint64_t later = hash_of(three.frame(5)), hash = hash_of(one.frame(1));
  CHECK(hash == hash_of(three.frame(1)));
  CHECK(later == hash_of(one.frame(5)));
  CHECK(hash != later);
  CHECK(hash != hash_of(other.frame(1)));
  // The same on every compiler and machine. After an intended change of the simulator, put the new value here.
  CHECK(hash == kGoldenFrame);
  Simulator rain(load_scenario("rain"), 11, 1, 2);
  CHECK(hash_of(rain.frame(1)) == kGoldenRain);
}

TEST_CASE("sim: without errors every point lies on the surface of its label at its time") {
  Scenario scenario = exact("overtake");
  scenario.errors.beam_rad = 0;
  Simulator simulator(scenario, 1, 6, 2);
  const World& world = simulator.world();
  const SimFrame frame = simulator.frame(110);
  int32_t road = 0, wall = 0, car = 0;
  for (int32_t s = 0; s < kSensors; ++s) {
    const Scan& scan = frame.scans[std::size_t(s)];
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const double t = double(frame.begin_ns + scan.time_ns[i]) * 1e-9;
      const Vec3 p =
          world.motions[0]->at(t).T_map_vehicle *
          (simulator.mounting(s).nominal * Vec3{double(scan.x_m[i]), double(scan.y_m[i]), double(scan.z_m[i])});
      if (scan.surface[i] == uint16_t(Surface::car) + 1) {
        const Vec3 in_car = world.motions[1]->at(t).T_map_vehicle.inverse_times(p);
        REQUIRE(std::fabs(in_car.x - kCarCenterXM) < kCarLengthM / 2 + 0.01);
        REQUIRE(std::fabs(in_car.y) < kCarWidthM / 2 + 0.01);
        REQUIRE(in_car.z > -0.01);
        REQUIRE(in_car.z < 1.1);
        ++car;
      } else if (scan.surface[i] == uint16_t(Surface::road) || scan.surface[i] == uint16_t(Surface::outer_wall)) {
        // Along the centre line: the nearest of all its metres.
        double best = 1e18, best_s = 0;
        const double ego_s = world.motions[0]->at(t).s_m;
        for (double at = ego_s - 150; at < ego_s + 150; at += 0.5) {
          const TrackPoint q = world.track.at(at);
          const double off = square(p.x - q.x) + square(p.y - q.y);
          if (off < best) best = off, best_s = at;
        }
        const TrackPoint q = world.track.at(best_s);
        const double d = -(p.x - q.x) * std::sin(q.heading_rad) + (p.y - q.y) * std::cos(q.heading_rad);
        if (std::fabs(best_s - ego_s) > 148) continue;  // outside of the searched part
        if (scan.surface[i] == uint16_t(Surface::road)) {
          REQUIRE(std::fabs(p.z - world.track.height(best_s, d)) < 0.04);
          ++road;
        } else {
          REQUIRE(d < -q.width_right_m - world.track.wall_behind_edge_m() + 0.02);
          REQUIRE(d > -q.width_right_m - world.track.wall_behind_edge_m() - 0.65);
          ++wall;
        }
      }
      if (i % 7) ++i;  // every seventh point is enough
    }
  }
  CHECK(road > 2000);
  CHECK(wall > 500);
  CHECK(car > 20);
}

TEST_CASE("sim: rings, heads and times of a scan follow the pattern") {
  Simulator simulator(exact("overtake"), 1, 0.3, 1);
  const SimFrame frame = simulator.frame(2);
  const Scan& scan = frame.scans[1];
  CHECK(frame.begin_ns == 100'000'000);
  CHECK(scan.lines == 32);
  CHECK(scan.beams == 32 * 2 * kShots);
  std::map<uint16_t, std::pair<double, int>> elevation;
  uint32_t last = 0;
  int32_t changes = 0, neighbours = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    CHECK(scan.time_ns[i] >= last);
    last = scan.time_ns[i];
    const double azimuth = std::atan2(double(scan.y_m[i]), double(scan.x_m[i])) / kDegree;
    CHECK(std::fabs(azimuth) < 60.2);
    auto& e = elevation[scan.ring[i]];
    e.first += std::atan2(double(scan.z_m[i]), std::hypot(double(scan.x_m[i]), double(scan.y_m[i])));
    ++e.second;
    if (i > 0 && scan.ring[i] == scan.ring[i - 1] && scan.return_number[i] == 0) {
      ++neighbours;
      changes += (azimuth > 0) != (scan.y_m[i - 1] > 0);
    }
  }
  CHECK(last < 50'000'000);
  CHECK(last > 45'000'000);
  CHECK(changes > neighbours * 0.8);  // the points of the two heads alternate
  REQUIRE(elevation.size() == 32);
  for (uint16_t ring = 0; ring + 1 < 32; ++ring) {
    const double step = elevation[ring].first / elevation[ring].second -
                        elevation[uint16_t(ring + 1)].first / elevation[uint16_t(ring + 1)].second;
    CHECK(std::fabs(step / kDegree - 14.0 / 32) < 0.07);
  }
}

TEST_CASE("sim: the pattern can change during a run, rings can be missing, the seam strip has the given width") {
  Scenario scenario = load_scenario("pattern_change");
  scenario.errors.missing_line_share = 0.1;
  Simulator simulator(scenario, 1, 8, 1);
  int32_t before = 0, after = 0;
  for (int32_t i = 0; i < simulator.frame_count(); ++i) (simulator.frame_begin_s(i) < 7 ? before : after) += 1;
  CHECK(before == 140);
  CHECK(after == 25);
  const SimFrame early = simulator.frame(3), late = simulator.frame(simulator.frame_count() - 1);
  int32_t early_lines = 0, late_lines = 0;
  for (const Scan& s : early.scans) early_lines += s.lines;
  for (const Scan& s : late.scans) late_lines += s.lines;
  CHECK(early_lines > 96 - 25);
  CHECK(early_lines < 96);
  CHECK(late_lines <= 3 * 25);
  for (const double strip : {0.40, 0.82}) {
    scenario.seam_strip_m = strip;
    const Simulator moved(scenario, 1, 0.1, 1);
    const Vec3 front = moved.mounting(0).nominal.place, left = moved.mounting(1).nominal.place;
    // The distance between two parallel rays at +60 degrees, one from each sensor.
    CHECK((front.x - left.x) * std::sin(60 * kDegree) + left.y * std::cos(60 * kDegree) == doctest::Approx(strip));
  }
}

TEST_CASE("sim: two heads overlap in the middle, and one looks higher than the other") {
  for (const double overlap : {1.0, -0.6, 0.0}) {
    Scenario scenario = exact("overtake");
    scenario.errors.head_overlap_rad = overlap * kDegree, scenario.errors.head_spread_rad = 0;
    scenario.errors.head_step_rad = 0;
    Simulator simulator(scenario, 1, 0.1, 2);
    // A point's time tells its beam; beams of the two heads alternate.
    double first[2] = {-90, -90}, last[2] = {90, 90};
    for (const Scan& scan : simulator.frame(1).scans)
      for (std::size_t i = 0; i < scan.size(); ++i) {
        const double line = scan.time_ns[i] * 640e-9 - scan.ring[i];
        const int head = int(line / kSweepShare * 2 * kShots) % 2;
        const double azimuth = std::atan2(double(scan.y_m[i]), double(scan.x_m[i])) / kDegree;
        first[head] = std::fmax(first[head], azimuth), last[head] = std::fmin(last[head], azimuth);
      }
    CHECK(first[0] == doctest::Approx(60).epsilon(0.01));
    CHECK(last[1] == doctest::Approx(-60).epsilon(0.01));
    CHECK(std::fabs(first[1] - last[0] - overlap) < 0.2);
  }
  // By default: about 1 deg, different in each sensor and run; elevations differ by some hundredths of a degree.
  double sum = 0, least = 90, most = -90, steps = 0;
  int count = 0;
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    const Simulator run(load_scenario("overtake"), seed, 0.1, 1);
    for (int32_t s = 0; s < kSensors; ++s, ++count) {
      const double overlap = run.heads(s).overlap_rad / kDegree;
      sum += overlap, least = std::fmin(least, overlap), most = std::fmax(most, overlap);
      steps += square(run.heads(s).step_rad / kDegree);
    }
  }
  CHECK(std::fabs(sum / count - 1) < 0.4);
  CHECK(most - least > 1.5);
  CHECK(std::sqrt(steps / count) / 0.08 == doctest::Approx(1).epsilon(0.3));
  Scenario scenario = exact("overtake");
  scenario.errors.head_step_rad = 0;
  Simulator level(scenario, 1, 0.1, 1);
  scenario.errors.head_step_rad = 0.3 * kDegree;
  Simulator tilted(scenario, 1, 0.1, 1);
  const double step = tilted.heads(0).step_rad / kDegree;
  REQUIRE(std::fabs(step) > 0.05);
  const auto left_minus_right = [](const Scan& scan) {  // of a line's ends near the middle, both halfway down
    double elevation[2] = {0, 0};
    int32_t number[2] = {0, 0};
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const double azimuth = std::atan2(double(scan.y_m[i]), double(scan.x_m[i])) / kDegree;
      if (scan.ring[i] != 20 || std::fabs(azimuth) < 10) continue;
      elevation[azimuth < 0] += std::asin(scan.z_m[i] / std::hypot(scan.x_m[i], scan.y_m[i], scan.z_m[i])) / kDegree;
      ++number[azimuth < 0];
    }
    return elevation[0] / number[0] - elevation[1] / number[1];
  };
  const double change = left_minus_right(tilted.frame(0).scans[0]) - left_minus_right(level.frame(0).scans[0]);
  CHECK(std::fabs(change - step) < 0.05);
}

TEST_CASE("sim: the front sensor reports a few points of its own car's front, the side sensors none") {
  Simulator simulator(load_scenario("overtake"), 1, 1.6, 2);
  int32_t frames = 0, points = 0, most = 0;
  for (int32_t k = 0; k < 30; k += 3, ++frames) {
    const SimFrame frame = simulator.frame(k);
    for (int32_t s = 0; s < kSensors; ++s) {
      const Scan& scan = frame.scans[std::size_t(s)];
      int32_t own = 0;
      for (std::size_t i = 0; i < scan.size(); ++i) {
        if (scan.surface[i] != uint16_t(Surface::own_car)) continue;
        ++own;
        const Vec3 p = simulator.mounting(s).real * Vec3{double(scan.x_m[i]), double(scan.y_m[i]), double(scan.z_m[i])};
        REQUIRE(std::fabs(p.x - 2.95) < 0.3);
        REQUIRE(std::fabs(p.y) < 0.95);
        REQUIRE(std::fabs(p.z - 0.53) < 0.1);
        REQUIRE(scan.intensity[i] < 0.05);
      }
      if (s > 0) REQUIRE(own == 0);
      points += own, most = std::max(most, own);
    }
  }
  CHECK(points >= 6 * frames);
  CHECK(points <= 60 * frames);
  CHECK(most < 120);
}

TEST_CASE("sim: the own rear wing hides what is behind it, and a scenario may report all points of the own car") {
  Simulator simulator(exact("blind_zone"), 1, 0.2, 1);
  const SimFrame frame = simulator.frame(0);
  CHECK(count_surface(frame, Surface::own_car) == 0);  // without its front
  Scenario bare = exact("blind_zone");
  bare.errors.report_own_car = true;
  Simulator seen(bare, 1, 0.2, 1);
  const SimFrame own = seen.frame(0);
  CHECK(count_surface(own, Surface::own_car) > 300);
  CHECK(count_surface(own, Surface::car) == 0);
  // Straight back, 1 to 3 degrees down, the left sensor sees no road; 20 degrees to the side it does.
  int32_t behind = 0, aside = 0;
  const Scan& left = frame.scans[1];
  for (std::size_t i = 0; i < left.size(); ++i) {
    const double azimuth = std::atan2(double(left.y_m[i]), double(left.x_m[i])) / kDegree;
    const double elevation =
        std::atan2(double(left.z_m[i]), std::hypot(double(left.x_m[i]), double(left.y_m[i]))) / kDegree;
    if (elevation > -1 || elevation < -2.5) continue;
    behind += azimuth > 54 && azimuth < 60;
    aside += azimuth > 34 && azimuth < 40;
  }
  CHECK(behind == 0);
  CHECK(aside > 100);
}

TEST_CASE("sim: edges give second returns, smoke gives returns and hides, a reflector blooms") {
  Simulator race(load_scenario("overtake"), 1, 6, 2);
  const SimFrame frame = race.frame(100);
  int32_t second = 0, points = 0;
  for (const Scan& s : frame.scans)
    second += int32_t(std::count(s.return_number.begin(), s.return_number.end(), 1)), points += int32_t(s.size());
  CHECK(second > 50);
  CHECK(second < points / 10);
  for (const Scan& s : frame.scans)
    for (std::size_t i = 1; i < s.size(); ++i) {
      if (s.return_number[i] != 1) continue;
      const auto range = [&](std::size_t k) {
        return std::hypot(double(s.x_m[k]), double(s.y_m[k]), double(s.z_m[k]));
      };
      REQUIRE(range(i) - range(i - 1) > kRecovery - 0.08);
      REQUIRE(range(i) - range(i - 1) < kSecondWithin + 0.08);
    }
  Scenario single = load_scenario("overtake");
  single.errors.second_returns = false;
  Simulator strongest(single, 1, 6, 2);
  for (const Scan& s : strongest.frame(100).scans)
    CHECK(std::count(s.return_number.begin(), s.return_number.end(), 1) == 0);

  Scenario with = load_scenario("smoke"), without = with;
  without.puffs.clear();
  Simulator smoke(with, 1, 4, 2), clear(without, 1, 4, 2);
  const SimFrame hazy = smoke.frame(60), clean = clear.frame(60);
  CHECK(count_surface(hazy, Surface::smoke_dust) > 100);
  CHECK(count_surface(clean, Surface::smoke_dust) == 0);
  // Nor does smoke return through the own car, which a sensor does not report: that would be below the road.
  int32_t near = 0;
  for (const Scan& s : smoke.frame(75).scans)
    for (std::size_t i = 0; i < s.size(); ++i) {
      if (s.surface[i] != uint16_t(Surface::smoke_dust) || std::hypot(s.x_m[i], s.y_m[i]) > 12.0f) continue;
      ++near;
      CHECK(s.z_m[i] > -0.9f);  // the sensors are 0.65 m over the road
    }
  CHECK(near > 100);
  const auto car = Surface(uint16_t(Surface::car) + 1);
  CHECK(count_surface(clean, car) > 60);
  CHECK(count_surface(hazy, car) < 0.8 * count_surface(clean, car));

  Scenario pit = load_scenario("empty_track");
  Simulator lap(pit, 1, 12, 2);
  int32_t blooming = 0;
  for (int32_t i = 90; i < 120; i += 3) blooming += count_surface(lap.frame(i), Surface::blooming);
  CHECK(blooming > 0);
}
