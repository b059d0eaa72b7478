// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/recorded_tracks.h"

#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "tools/client/session.h"
#include "tools/evaluation/metrics/clear_mot.h"
#include "tools/evaluation/metrics/gospa.h"
#include "tools/evaluation/metrics/hota.h"
#include "tools/evaluation/metrics/summary.h"
#include "tools/evaluation/truth_log.h"
#include "tools/io/angles.h"
#include "tools/io/csv.h"
#include "tools/io/error.h"
#include "tools/io/kitti_tracking.h"
#include "tools/io/text.h"

namespace overtake::evaluation {
namespace {

using Json = nlohmann::json;
constexpr double kGate = 2.0, kNoise_m = 0.2, kMissed = 0.1;
constexpr uint64_t kSeeds = 4;

struct LabelFrame {
  int64_t stamp_ns = 0;
  std::vector<metrics::MotPlace> objects;
  double x_m = 0, y_m = 0, course_rad = 0, half_view_rad = io::kPi;  // who labelled, and how far to either side
};

bool is_judged(const LabelFrame& f, const metrics::MotPlace& track) {
  const double off = std::atan2(track.y_m - f.y_m, track.x_m - f.x_m) - f.course_rad;
  if (std::fabs(wrap_angle(off)) <= f.half_view_rad) return true;
  for (const metrics::MotPlace& o : f.objects)
    if (std::hypot(o.x_m - track.x_m, o.y_m - track.y_m) <= kGate) return true;
  return false;
}

// The tracker without sensors, in the map frame.
class TrackerAlone {
 public:
  TrackerAlone(const cli::Options& preset, const std::string& map, double period_s)
      : session_(config_of(preset, map, period_s), nullptr, nullptr) {
    ovt_reader* reader = nullptr;
    cli::check(ovt_create_reader(session_.detector(), &reader), "reader");
    reader_.reset(reader);
  }
  // The tracks after these detections, at their stamp; valid until the next call.
  ovt_tracks push(int64_t stamp_ns, const std::vector<double>& x_m, const std::vector<double>& y_m) {
    ovt_external_detections in;
    ovt_external_detections_init(&in, sizeof in);
    in.stamp_ns = stamp_ns, in.count = int32_t(x_m.size()), in.reference = OVT_REFERENCE_MAP;
    in.x_m = x_m.data(), in.y_m = y_m.data();
    cli::check(ovt_push_detections(session_.detector(), &in), "detections");
    session_.flush();
    ovt_frame_info info;
    ovt_tracks tracks;
    cli::check(ovt_next_frame(reader_.get(), &info), "frame");
    cli::check(ovt_read_tracks(reader_.get(), OVT_AT_FRAME_STAMP, &tracks), "tracks");
    return tracks;
  }

 private:
  static cli::Config config_of(cli::Options options, const std::string& map, double period_s) {
    options.map = map, options.ego = "none";
    cli::Config config = cli::load_config(options);
    config.no_ego = config.has_rig = false, config.rig = io::Rig(), config.workers = 1;
    config.params.frame_period_s = period_s;
    return config;
  }
  cli::Session session_;
  std::unique_ptr<ovt_reader, void (*)(ovt_reader*)> reader_{nullptr, &ovt_destroy_reader};
};

Json evaluate_tracks(const std::vector<LabelFrame>& frames, double period_s, const cli::Options& preset) {
  metrics::ClearMotCounts counts;
  std::vector<double> gospa;
  metrics::HotaResult hota;
  for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise(0, kNoise_m);
    std::uniform_real_distribution<double> chance(0, 1);
    TrackerAlone tracker(preset, "none", period_s);
    metrics::ClearMot mot(kGate);
    metrics::Hota of_seed(kGate);
    for (const LabelFrame& f : frames) {
      std::vector<double> x, y;
      for (const metrics::MotPlace& o : f.objects) {
        const double dx = noise(random), dy = noise(random);
        if (chance(random) < kMissed) continue;
        x.push_back(o.x_m + dx), y.push_back(o.y_m + dy);
      }
      const ovt_tracks t = tracker.push(f.stamp_ns, x, y);
      std::vector<metrics::MotPlace> tracks;
      for (int32_t i = 0; i < t.count; ++i) {
        const metrics::MotPlace place{t.id[i], t.x_m[i], t.y_m[i]};
        if (t.state[i] == OVT_CONFIRMED && is_judged(f, place)) tracks.push_back(place);
      }
      mot.add_frame(f.objects, tracks);
      of_seed.add_frame(f.objects, tracks);
      gospa.push_back(metrics::gospa(f.objects, tracks).distance_m);
    }
    counts += mot.counts();
    const metrics::HotaResult h = of_seed.result();
    hota.hota += h.hota / kSeeds, hota.detection += h.detection / kSeeds, hota.association += h.association / kSeeds;
  }
  return {{"frames", frames.size()},
          {"objects", counts.objects},
          {"gate_m", kGate},
          {"mota", counts.mota()},
          {"motp_m", counts.motp_m()},
          {"switches", counts.switches},
          {"fragments", counts.fragments},
          {"misses", counts.misses},
          {"false_positives", counts.false_positives},
          {"hota", hota.hota},
          {"det_a", hota.detection},
          {"ass_a", hota.association},
          {"gospa_m", metrics::summarize(gospa).mean}};
}

// Root mean square.
class Rms {
 public:
  void add(double error) { squares_ += error * error, ++count_; }
  double value() const { return count_ > 0 ? std::sqrt(squares_ / double(count_)) : NAN; }

 private:
  double squares_ = 0;
  int64_t count_ = 0;
};

}  // namespace

bool is_vehicle_category(std::string_view c) {
  for (const std::string_view name : {"Car", "Van", "Truck", "Tram", "car", "truck", "bus", "trailer",
                                      "construction_vehicle", "REGULAR_VEHICLE", "LARGE_VEHICLE", "BOX_TRUCK", "TRUCK",
                                      "TRUCK_CAB", "VEHICULAR_TRAILER", "BUS", "ARTICULATED_BUS", "SCHOOL_BUS"})
    if (c == name) return true;
  return false;
}

Json evaluate_kitti_tracks(const std::string& folder, const std::string& sequence, const cli::Options& preset) {
  const io::KittiSequence kitti = io::read_kitti_sequence(folder, sequence);
  std::vector<LabelFrame> frames(kitti.T_world_camera.size());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const double ahead[3] = {0, 0, 1};
    double point[3];
    const io::RigidTransform& camera = kitti.T_world_camera[k];
    camera.apply(ahead, point);
    LabelFrame& f = frames[k];
    f.stamp_ns = int64_t(k) * 100'000'000;
    f.x_m = camera.translation_m[0], f.y_m = camera.translation_m[1];
    f.course_rad = std::atan2(point[1] - f.y_m, point[0] - f.x_m), f.half_view_rad = 40 * io::kPi / 180;
  }
  for (const io::KittiLabel& label : kitti.labels) {
    if (label.frame < 0 || std::size_t(label.frame) >= frames.size() || !is_vehicle_category(label.type)) continue;
    double world[3];
    kitti.place(label, world);
    frames[std::size_t(label.frame)].objects.push_back({uint64_t(label.track), world[0], world[1]});
  }
  return evaluate_tracks(frames, 0.1, preset);
}

Json evaluate_av2_tracks(const std::string& folder, const std::string& log, const cli::Options& preset) {
  const std::string ego_path = folder + "/" + log + "_ego.csv";
  const io::Csv ego = io::Csv::read(ego_path), boxes = io::Csv::read(folder + "/" + log + "_boxes.csv");
  struct Pose {
    double x_m, y_m, yaw_rad;
  };
  std::map<int64_t, Pose> poses;
  const int32_t et = ego.need({"timestamp_ns"}), ex = ego.need({"x_m"}), ey = ego.need({"y_m"}),
                eyaw = ego.need({"yaw_rad"});
  for (std::size_t i = 0; i < ego.row_count(); ++i)
    poses[ego.integer(i, et)] = {ego.number(i, ex), ego.number(i, ey), ego.number(i, eyaw)};
  const auto pose_of = [&](int64_t stamp) {
    const auto above = poses.lower_bound(stamp);
    if (above == poses.end()) return poses.rbegin()->second;
    if (above == poses.begin() || above->first == stamp) return above->second;
    const auto below = std::prev(above);
    const double w = double(stamp - below->first) / double(above->first - below->first);
    const Pose &a = below->second, &b = above->second;
    return Pose{a.x_m + w * (b.x_m - a.x_m), a.y_m + w * (b.y_m - a.y_m),
                a.yaw_rad + w * wrap_angle(b.yaw_rad - a.yaw_rad)};
  };
  std::map<std::string, uint64_t> ids;
  std::map<int64_t, LabelFrame> frames;
  const int32_t bt = boxes.need({"timestamp_ns"}), track = boxes.need({"track"}), category = boxes.need({"category"}),
                bx = boxes.need({"x_m"}), by = boxes.need({"y_m"});
  for (std::size_t i = 0; i < boxes.row_count(); ++i) {
    LabelFrame& f = frames[boxes.integer(i, bt)];
    f.stamp_ns = boxes.integer(i, bt);
    if (!is_vehicle_category(boxes.text(i, category))) continue;
    const Pose p = pose_of(f.stamp_ns);
    const double c = std::cos(p.yaw_rad), s = std::sin(p.yaw_rad), x = boxes.number(i, bx), y = boxes.number(i, by);
    const uint64_t id = ids.emplace(std::string(boxes.text(i, track)), ids.size()).first->second;
    f.objects.push_back({id, p.x_m + c * x - s * y, p.y_m + s * x + c * y});
  }
  std::vector<LabelFrame> in_order;
  for (auto& [stamp, f] : frames) in_order.push_back(std::move(f));
  return evaluate_tracks(in_order, 0.1, preset);
}

Json evaluate_drive(const std::string& path, const std::string& map, const cli::Options& preset) {
  constexpr double kDriveNoise_m = 0.3, kDriving_mps = 3, kPeriod_s = 0.05;
  constexpr std::size_t kDropEvery = 5;
  const io::Csv csv = io::Csv::read(path);
  const std::vector<double> time_s = csv.numbers(csv.need({"time"})), x_m = csv.numbers(csv.need({"x"})),
                            y_m = csv.numbers(csv.need({"y"})), vx_mps = csv.numbers(csv.need({"vx"})),
                            vy_mps = csv.numbers(csv.need({"vy"})), phi_rad = csv.numbers(csv.need({"phi"})),
                            omega_rps = csv.numbers(csv.need({"omega"}));
  Rms speed, course, slip_course, yaw_rate, place;
  int64_t driven = 0, followed = 0, ids = 0;
  for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise(0, kDriveNoise_m);
    TrackerAlone tracker(preset, map, kPeriod_s);
    std::set<uint64_t> of_seed;
    for (std::size_t i = 0; i < x_m.size(); ++i) {
      if (i % kDropEvery == kDropEvery - 1) continue;
      const double dx = noise(random), dy = noise(random);
      const ovt_tracks t = tracker.push(io::to_nanoseconds(time_s[i], 1'000'000'000), {x_m[i] + dx}, {y_m[i] + dy});
      if (!(vx_mps[i] > kDriving_mps)) continue;
      ++driven;
      int32_t at = -1;
      for (int32_t k = 0; k < t.count; ++k) {
        if (t.state[k] != OVT_CONFIRMED) continue;
        of_seed.insert(t.id[k]);
        const auto distance_m = [&](int32_t j) { return std::hypot(t.x_m[j] - x_m[i], t.y_m[j] - y_m[i]); };
        if (at < 0 || distance_m(k) < distance_m(at)) at = k;
      }
      if (at < 0) continue;
      ++followed;
      const double off_phi_rad = wrap_angle(t.course_rad[at] - phi_rad[i]);
      speed.add(t.speed_mps[at] - vx_mps[i]);
      course.add(off_phi_rad * 180 / io::kPi);
      slip_course.add(wrap_angle(off_phi_rad - std::atan2(vy_mps[i], vx_mps[i])) * 180 / io::kPi);
      yaw_rate.add(t.yaw_rate_rps[at] - omega_rps[i]);
      place.add(std::hypot(t.x_m[at] - x_m[i], t.y_m[at] - y_m[i]));
    }
    ids += int64_t(of_seed.size());
  }
  return {{"followed", driven > 0 ? double(followed) / double(driven) : NAN},
          {"tracks", double(ids) / double(kSeeds)},
          {"speed_rmse_mps", speed.value()},
          {"course_rmse_deg", course.value()},
          {"course_with_slip_rmse_deg", slip_course.value()},
          {"yaw_rate_rmse_rps", yaw_rate.value()},
          {"place_rmse_m", place.value()}};
}

Json sum_tracks(const Json& sequences) {
  int64_t objects = 0, wrong = 0, switches = 0, fragments = 0;
  for (const Json& s : sequences) {
    objects += s["objects"].get<int64_t>(), fragments += s["fragments"].get<int64_t>();
    switches += s["switches"].get<int64_t>();
    wrong += s["misses"].get<int64_t>() + s["false_positives"].get<int64_t>();
  }
  return {{"mota", objects > 0 ? 1 - double(wrong + switches) / double(objects) : NAN},
          {"switches", double(switches) / double(kSeeds)},
          {"fragments", double(fragments) / double(kSeeds)}};
}

}  // namespace overtake::evaluation
