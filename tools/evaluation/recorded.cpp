// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/recorded.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tools/client/console.h"
#include "tools/client/session.h"
#include "tools/evaluation/baselines/grid_ground.h"
#include "tools/evaluation/baselines/label_ground.h"
#include "tools/evaluation/metrics/summary.h"
#include "tools/evaluation/places.h"
#include "tools/evaluation/racecar_wall.h"
#include "tools/evaluation/recorded_tracks.h"
#include "tools/evaluation/variant.h"
#include "tools/io/angles.h"
#include "tools/io/box_file.h"
#include "tools/io/csv.h"
#include "tools/io/error.h"
#include "tools/io/json_text.h"
#include "tools/io/kitti_tracking.h"
#include "tools/io/text.h"

namespace overtake::evaluation {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
constexpr double kNear = 2.0, kOversize = 1.0, kRange = 20;

struct KnownBox {  // vehicle frame
  double x_m, y_m, yaw_rad, length_m, width_m;
  int64_t points;
  bool is_vehicle;
};

bool holds(const KnownBox& b, double x_m, double y_m, double margin_m) {
  const double c = std::cos(b.yaw_rad), s = std::sin(b.yaw_rad), dx = x_m - b.x_m, dy = y_m - b.y_m;
  return std::fabs(c * dx + s * dy) <= b.length_m / 2 + margin_m &&
         std::fabs(c * dy - s * dx) <= b.width_m / 2 + margin_m;
}

struct SeenFrame {
  std::vector<std::array<double, 2>> detections;
  std::vector<int32_t> cluster_of_detection;
  struct Point {
    std::array<double, 3> at;
    int32_t sensor, cluster;
    bool found;
  };
  std::vector<Point> points;  // with a label
};

// One frame's detections and points, vehicle frame.
struct Look {
  const io::Rig* rig;
  SeenFrame seen;
  static void on_frame(ovt_reader* reader, void* self) { static_cast<Look*>(self)->read(reader); }
  void read(ovt_reader* reader) {
    seen = SeenFrame();
    ovt_detections d;
    if (ovt_read_detections(reader, &d) != OVT_OK) return;
    for (int32_t i = 0; i < d.count; ++i) {
      seen.detections.push_back({double(d.x_m[i]), double(d.y_m[i])});
      seen.cluster_of_detection.push_back(d.cluster[i]);
    }
    for (int32_t s = 0; s < int32_t(rig->sensors.size()); ++s) {
      ovt_labels l;
      if (ovt_read_labels(reader, s, &l) != OVT_OK) continue;
      const io::Mounting mounting(rig->sensors[std::size_t(s)]);
      for (int32_t i = 0; i < l.count; ++i)
        if (l.label[i] >= 0)
          seen.points.push_back({mounting.to_vehicle(l.x_m[i], l.y_m[i], l.z_m[i]), s,
                                 l.label[i] > 0 ? l.cluster_of_label[l.label[i]] : -1, l.label[i] > 0});
    }
  }
};

struct Scores {
  double tp = 0, fp = 0, fn = 0;
  void add(bool found, bool positive) { tp += found && positive, fp += found && !positive, fn += !found && positive; }
  void add(const Scores& other) { tp += other.tp, fp += other.fp, fn += other.fn; }
  Json json() const { return {{"tpr", tp / (tp + fn)}, {"ppv", tp / (tp + fp)}, {"f1", 2 * tp / (2 * tp + fp + fn)}}; }
};

struct GroundScores {
  Scores ours, of_grid;
  void add(const GroundScores& other) { ours.add(other.ours), of_grid.add(other.of_grid); }
  Json json() const { return {{"pipeline", ours.json()}, {"grid_2_5d", of_grid.json()}}; }
};

// Evaluates our ground and the grid's on one frame, compared with the automatic labels.
GroundScores evaluate_ground(const SeenFrame& seen, std::size_t sensors) {
  std::vector<float> x, y, z;
  for (const SeenFrame::Point& p : seen.points)
    x.push_back(float(p.at[0])), y.push_back(float(p.at[1])), z.push_back(float(p.at[2]));
  const std::vector<bool> grid = baselines::mark_nonground(x, y, z);
  GroundScores out;
  for (int32_t s = 0; s < int32_t(sensors); ++s) {
    std::vector<float> sx, sy, sz;
    std::vector<std::size_t> row;
    for (std::size_t i = 0; i < seen.points.size(); ++i)
      if (seen.points[i].sensor == s) sx.push_back(x[i]), sy.push_back(y[i]), sz.push_back(z[i]), row.push_back(i);
    const std::vector<bool> labels = baselines::label_nonground(sx, sy, sz);
    for (std::size_t i = 0; i < row.size(); ++i)
      out.ours.add(seen.points[row[i]].found, labels[i]), out.of_grid.add(grid[row[i]], labels[i]);
  }
  return out;
}

// The preset or configuration with the rig of a data set, without the map and the poses of other runs.
cli::Config config_of(const cli::Options& preset, const std::string& rig) {
  cli::Options options = preset;
  options.rig = rig, options.map = "none", options.ego = "none";
  cli::Config config = cli::load_config(options);
  if (rig != "av21" && rig != "racecar") {  // data sets of road traffic: vans are taller than a race car
    config.params.gate_height_m = std::max(config.params.gate_height_m, 2.3);
    config.params.gate_top_m = std::max(config.params.gate_top_m, 2.6);
  }
  config.no_ego = false, config.workers = 1;
  return config;
}

double mean_f1(const std::vector<Json>& ground) {
  double sum = 0;
  for (const Json& g : ground) sum += g["pipeline"]["f1"].get<double>();
  return ground.empty() ? NAN : sum / double(ground.size());
}

// Labelled cars to 60 m that are not larger than the known vehicle, with 3 points or more.
class CarScores {
 public:
  CarScores(const cli::Config& config) : longest_m_(config.params.vehicle_length_m * (1 + config.params.gate_slack)) {}
  void add(const SeenFrame& seen, const std::vector<KnownBox>& boxes) {
    for (const KnownBox& b : boxes) {
      if (!b.is_vehicle || b.length_m > longest_m_ || b.points < 3 || std::hypot(b.x_m, b.y_m) > kFarM) continue;
      ++cars_;
      std::map<int32_t, std::array<int64_t, 3>> clusters;  // points, in the box, in the box enlarged by 1 m
      for (const SeenFrame::Point& p : seen.points) {
        if (p.cluster < 0) continue;
        auto& n = clusters[p.cluster];
        ++n[0], n[1] += holds(b, p.at[0], p.at[1], 0), n[2] += holds(b, p.at[0], p.at[1], kOversize);
      }
      int64_t at_car = 0, whole = 0;
      for (const auto& [cluster, n] : clusters) at_car += n[1] >= 3, whole += n[1] >= 3 && n[2] == n[0];
      as_one_ += at_car == 1 && whole == 1;
      double nearest = kNear;
      bool found = false;
      for (const auto& d : seen.detections)
        if (const double m = std::hypot(b.x_m - d[0], b.y_m - d[1]); m <= nearest) nearest = m, found = true;
      detected_ += found;
      if (found) errors_.push_back(nearest);
    }
  }
  Json summary(const std::vector<Json>& ground) const {
    const double cars = cars_ > 0 ? double(cars_) : NAN;
    const metrics::Summary error = metrics::summarize(errors_);
    return {{"cars_to_60_m", cars_},
            {"cars_as_one_cluster", double(as_one_) / cars},
            {"cars_detected", double(detected_) / cars},
            {"centre_error_median_m", error.median},
            {"centre_error_p95_m", error.p95},
            {"ground_f1_by_auto_label", mean_f1(ground)}};
  }

 private:
  static constexpr double kFarM = 60;
  double longest_m_;
  int64_t cars_ = 0, as_one_ = 0, detected_ = 0;
  std::vector<double> errors_;
};

Json evaluate_racecar(const std::string& folder, const cli::Options& preset) {
  const cli::Config config = config_of(preset, "av21");
  Look look{&config.rig, {}};
  cli::Session session(config, &Look::on_frame, &look);
  const io::Recording recording(folder, config.rig);
  Json out = {{"frames", Json::array()}};
  int64_t as_one = 0, others = 0;
  std::vector<Json> ground;
  std::vector<double> errors;
  for (std::size_t k = 0; k < recording.frame_count(); ++k) {
    const io::FrameScans frame = recording.read(k);
    session.push(frame);
    session.flush();
    const auto box = io::read_box_beside(frame);
    if (!box) continue;
    const KnownBox opponent{box->x_m, box->y_m, box->yaw_rad, kCarLengthM, kCarWidthM, 0, true};
    Json row = {{"frame", frame.frame}, {"opponent_ahead_m", box->x_m}};
    int32_t at = 0, on_road = 0;
    for (const auto& d : look.seen.detections)
      on_road += std::hypot(d[0] - box->x_m, d[1] - box->y_m) > 4.0 && is_on_racecar_road(d[0], d[1]);
    for (std::size_t i = 0; i < look.seen.detections.size(); ++i) {
      const double dx = look.seen.detections[i][0] - box->x_m, dy = look.seen.detections[i][1] - box->y_m;
      if (std::hypot(dx, dy) > 4.0) continue;
      const double c = std::cos(box->yaw_rad), s = std::sin(box->yaw_rad);
      errors.push_back(std::hypot(dx, dy));
      row["off_along_m"] = c * dx + s * dy, row["off_across_m"] = c * dy - s * dx;
      const int32_t cluster = look.seen.cluster_of_detection[i];
      int64_t points = 0, outside = 0;
      for (const SeenFrame::Point& p : look.seen.points)
        if (p.cluster == cluster && cluster >= 0) ++points, outside += !holds(opponent, p.at[0], p.at[1], 2.5);
      row["points_of_its_cluster"] = points, row["of_them_outside_the_box"] = outside;
      ++at;
    }
    as_one += at == 1, others += on_road;
    row["others_on_the_road"] = on_road;
    row["detections_within_4_m"] = at, row["detections"] = look.seen.detections.size();
    std::map<int32_t, std::pair<int64_t, int64_t>> inside;  // cluster -> points, points inside
    for (const SeenFrame::Point& p : look.seen.points)
      if (p.cluster >= 0) ++inside[p.cluster].first, inside[p.cluster].second += holds(opponent, p.at[0], p.at[1], 1);
    int64_t whole = 0;
    for (const auto& [cluster, n] : inside) whole += n.first == n.second;
    row["clusters_in_box"] = whole;
    row["ground_by_auto_label"] = evaluate_ground(look.seen, config.rig.sensors.size()).json();
    ground.push_back(row["ground_by_auto_label"]);
    out["frames"].push_back(row);
  }
  const double frames = out["frames"].empty() ? NAN : double(out["frames"].size());
  out["summary"] = {{"frames", out["frames"].size()},
                    {"opponent_as_one_detection", double(as_one) / frames},
                    {"other_detections_on_the_road", double(others) / frames},
                    {"centre_error_median_m", metrics::summarize(errors).median},
                    {"ground_f1_by_auto_label", mean_f1(ground)}};
  return out;
}

struct LabelledScan {
  std::string file;
  std::vector<KnownBox> boxes;
};

// Scans of other places each: every one has its own session, and all are counted together.
Json evaluate_scans(const std::vector<LabelledScan>& scans, const cli::Options& preset, const std::string& rig) {
  const cli::Config config = config_of(preset, rig);
  struct Bin {
    int64_t boxes = 0, found = 0, false_detections = 0;
  };
  std::map<int32_t, Bin> bins;
  const double longest = config.params.vehicle_length_m * (1 + config.params.gate_slack);
  const auto near = [](const KnownBox& b, const std::array<double, 2>& d, double gate) {
    return std::hypot(b.x_m - d[0], b.y_m - d[1]) <= gate;
  };
  std::size_t detections = 0;
  GroundScores ground;
  std::vector<Json> ground_of_scan;
  CarScores scores(config);
  for (const auto& [file, boxes] : scans) {
    Look look{&config.rig, {}};
    cli::Session session(config, &Look::on_frame, &look);
    const io::Recording recording(file, config.rig);
    session.push(recording.read(0));
    session.flush();
    for (const KnownBox& b : boxes) {
      if (!b.is_vehicle || b.length_m > longest || b.points < 3) continue;
      Bin& bin = bins[int32_t(std::hypot(b.x_m, b.y_m) / kRange)];
      ++bin.boxes;
      for (const auto& d : look.seen.detections)
        if (near(b, d, kNear)) {
          ++bin.found;
          break;
        }
    }
    for (const auto& d : look.seen.detections) {
      bool at_any = false;
      for (const KnownBox& b : boxes) at_any = at_any || near(b, d, kNear) || holds(b, d[0], d[1], kOversize);
      bins[int32_t(std::hypot(d[0], d[1]) / kRange)].false_detections += !at_any;
    }
    detections += look.seen.detections.size();
    const GroundScores of_scan = evaluate_ground(look.seen, config.rig.sensors.size());
    ground.add(of_scan);
    ground_of_scan.push_back(of_scan.json());
    scores.add(look.seen, boxes);
  }
  Json out = {{"gate_m", kNear}, {"detections", detections}, {"by_range", Json::array()}};
  out["ground_by_auto_label"] = ground.json();
  out["summary"] = scores.summary(ground_of_scan);
  for (const auto& [range, b] : bins)
    out["by_range"].push_back({{"from_m", range * kRange},
                               {"to_m", (range + 1) * kRange},
                               {"boxes", b.boxes},
                               {"detected", b.found},
                               {"detections_at_no_box", b.false_detections}});
  return out;
}

// Frame k of the scans is frame k of the sequence 0000. The labels cover what its camera sees.
Json evaluate_kitti_frames(const std::string& folder, const cli::Options& preset) {
  constexpr std::size_t kGroundEvery = 4;  // the automatic labels of one frame take seconds
  const cli::Config config = config_of(preset, "hdl64");
  const std::string sequence = folder + "/tracking/0000";
  const std::vector<io::KittiLabel> labels = io::read_kitti_labels(sequence + "_labels.txt");
  const io::RigidTransform T_velodyne_camera = io::read_kitti_camera_mounting(sequence + "_calib.txt");
  const io::RigSensor& sensor = config.rig.sensors[0];
  Look look{&config.rig, {}};
  cli::Session session(config, &Look::on_frame, &look);
  const io::Recording recording(folder, config.rig);
  CarScores scores(config);
  std::vector<Json> ground;
  for (std::size_t k = 0; k < recording.frame_count(); ++k) {
    const io::FrameScans frame = recording.read(k);
    session.push(frame);
    session.flush();
    std::vector<KnownBox> boxes;
    for (const io::KittiLabel& label : labels) {
      if (label.frame != int32_t(frame.frame) || label.track < 0) continue;
      double at[3] = {label.x_m, label.y_m, label.z_m};
      T_velodyne_camera.apply(at, at);
      KnownBox box{at[0] + sensor.x_m,
                   at[1] + sensor.y_m,
                   -label.rotation_y_rad - io::kPi / 2,
                   label.length_m,
                   label.width_m,
                   0,
                   is_vehicle_category(label.type)};
      for (const SeenFrame::Point& p : look.seen.points) {
        const double over_road_m = p.at[2] - at[2] - sensor.z_m;
        box.points += holds(box, p.at[0], p.at[1], 0) && over_road_m > 0.2 && over_road_m < label.height_m;
      }
      boxes.push_back(box);
    }
    scores.add(look.seen, boxes);
    if (k % kGroundEvery == 0) ground.push_back(evaluate_ground(look.seen, config.rig.sensors.size()).json());
  }
  return {{"frames", recording.frame_count()}, {"summary", scores.summary(ground)}};
}

std::vector<fs::path> files_with(const std::string& folder, const std::string& tail) {
  std::vector<fs::path> out;
  if (!fs::is_directory(folder)) return out;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.size() > tail.size() && name.compare(name.size() - tail.size(), tail.size(), tail) == 0)
      out.push_back(entry.path());
  }
  std::sort(out.begin(), out.end());
  return out;
}

// `stamp`: use only rows with this stamp; empty: all. With a sensor, transforms from its frame to the vehicle's.
std::vector<KnownBox> read_boxes(const std::string& path, const std::string& stamp, const io::RigSensor* sensor) {
  const io::Csv csv = io::Csv::read(path);
  const int32_t category = csv.need({"category"}), x = csv.need({"x_m"}), y = csv.need({"y_m"}), z = csv.need({"z_m"}),
                yaw = csv.need({"yaw_rad"}), length = csv.need({"length_m"}), width = csv.need({"width_m"}),
                points = csv.need({"points"}), at = stamp.empty() ? -1 : csv.need({"timestamp_ns"});
  std::vector<KnownBox> out;
  for (std::size_t i = 0; i < csv.row_count(); ++i) {
    if (!stamp.empty() && csv.text(i, at) != stamp) continue;
    std::array<double, 3> p = {csv.number(i, x), csv.number(i, y), csv.number(i, z)};
    double turn = csv.number(i, yaw);
    if (sensor) {
      p = io::Mounting(*sensor).to_vehicle(p[0], p[1], p[2]);
      turn += sensor->yaw_deg * io::kPi / 180;
    }
    out.push_back({p[0], p[1], turn, csv.number(i, length), csv.number(i, width), csv.integer(i, points),
                   is_vehicle_category(csv.text(i, category))});
  }
  return out;
}

// Checks all boxes first: otherwise a recording without boxes would be skipped silently.
void check_boxes(const std::string& folder) {
  if (fs::is_directory(folder + "/racecar") && files_with(folder + "/racecar", "_box.txt").empty())
    throw io::Error(folder + "/racecar", 0, "holds no FRAME_box.txt: there is nothing to judge by");
  for (const std::string set : {"av2", "nuscenes"})
    for (const fs::path& file : files_with(folder + "/" + set, ".pcd")) {
      const std::string stem = file.stem().string();
      const std::string boxes = folder + "/" + set + "/" + stem.substr(0, stem.find('_')) + "_boxes.csv";
      if (!fs::exists(boxes)) throw io::Error(boxes, 0, "no such file: there is nothing to judge " + stem + ".pcd by");
    }
}

Json evaluate_all(const std::string& folder, const std::string& name, const cli::Options& preset) {
  Json json = {{"simulated", false}, {"preset", name}};
  if (fs::is_directory(folder + "/racecar")) json["racecar"] = evaluate_racecar(folder + "/racecar", preset);
  std::vector<LabelledScan> av2, nuscenes;
  for (const fs::path& file : files_with(folder + "/av2", ".pcd")) {
    const std::string stem = file.stem().string(), log = stem.substr(0, stem.find('_'));
    const std::string boxes = folder + "/av2/" + log + "_boxes.csv";
    av2.push_back({file.string(), read_boxes(boxes, stem.substr(stem.find('_') + 1), nullptr)});
  }
  const io::Rig rig = io::load_rig("nuscenes");
  for (const fs::path& file : files_with(folder + "/nuscenes", ".pcd")) {
    const std::string boxes = folder + "/nuscenes/" + file.stem().string() + "_boxes.csv";
    nuscenes.push_back({file.string(), read_boxes(boxes, "", &rig.sensors[0])});
  }
  if (!av2.empty()) json["av2_sweep"] = evaluate_scans(av2, preset, "av2");
  if (!nuscenes.empty()) json["nuscenes_sweep"] = evaluate_scans(nuscenes, preset, "nuscenes");
  if (!files_with(folder + "/kitti", ".pcd").empty() && fs::exists(folder + "/kitti/tracking/0000_labels.txt"))
    json["kitti_frames"] = evaluate_kitti_frames(folder + "/kitti", preset);
  for (const fs::path& file : files_with(folder + "/kitti/tracking", "_labels.txt")) {
    const std::string sequence = file.filename().string().substr(0, 4);
    json["kitti_tracks"][sequence] = evaluate_kitti_tracks(folder + "/kitti/tracking", sequence, preset);
  }
  if (json.contains("kitti_tracks")) json["kitti_tracks_all"]["summary"] = sum_tracks(json["kitti_tracks"]);
  for (const fs::path& file : files_with(folder + "/av2", "_boxes.csv")) {
    const std::string log = file.filename().string().substr(0, file.filename().string().find('_'));
    json["av2_tracks"][log] = evaluate_av2_tracks(folder + "/av2", log, preset);
  }
  if (json.contains("av2_tracks")) json["av2_tracks_all"]["summary"] = sum_tracks(json["av2_tracks"]);
  const std::string lvms = folder + "/lvms/", drive = lvms + "LVMS_23_01_04_B.csv";
  if (fs::exists(drive)) {
    json["lvms_drive"]["summary"] = evaluate_drive(drive, "none", preset);
    const std::string bounds = lvms + "lvms_inner_bound.csv," + lvms + "lvms_outer_bound.csv";
    json["lvms_drive_on_map"]["summary"] = evaluate_drive(drive, bounds, preset);
  }
  if (json.size() == 2) throw io::Error(folder, 0, "holds none of racecar, av2, nuscenes, kitti/tracking, lvms");
  return json;
}

}  // namespace

std::vector<std::string> names_for_recordings(const std::vector<std::string>& names) {
  std::vector<std::string> out;
  for (const std::string& name : names)
    if (name.find(':') == std::string::npos) out.push_back(name);
  if (out.empty()) out.push_back(names.empty() ? "paper" : names[0].substr(0, names[0].find(':')));
  return out;
}

Rows recording_rows(const Json& recordings) {
  static constexpr std::pair<const char*, const char*> kSets[] = {
      {"racecar", "RACECAR"},
      {"kitti_frames", "KITTI"},
      {"nuscenes_sweep", "nuScenes"},
      {"av2_sweep", "Argoverse 2"},
      {"kitti_tracks_all", "KITTI, label centres"},
      {"av2_tracks_all", "Argoverse 2, label centres"},
      {"lvms_drive", "AV-21 drive (LVMS)"},
      {"lvms_drive_on_map", "AV-21 drive (LVMS) on its map"}};
  static constexpr std::pair<const char*, const char*> kFigures[] = {
      {"frames", "frames"},
      {"opponent_as_one_detection", "opponent as exactly one detection"},
      {"other_detections_on_the_road", "other detections on the road, a frame"},
      {"cars_to_60_m", "labelled cars to 60 m"},
      {"cars_as_one_cluster", "of them one cluster"},
      {"cars_detected", "of them detected"},
      {"centre_error_median_m", "centre error, median m"},
      {"centre_error_p95_m", "centre error, 95 % m"},
      {"ground_f1_by_auto_label", "ground F1 by automatic labels"},
      {"mota", "MOTA"},
      {"switches", "id switches"},
      {"fragments", "fragments"},
      {"followed", "share with a confirmed track"},
      {"tracks", "ids"},
      {"speed_rmse_mps", "speed, RMSE m/s"},
      {"course_rmse_deg", "course against the heading, RMSE deg"},
      {"course_with_slip_rmse_deg", "course, RMSE deg"},
      {"yaw_rate_rmse_rps", "yaw rate, RMSE rad/s"},
      {"place_rmse_m", "place, RMSE m"}};
  std::vector<const Json*> columns = {&recordings};
  if (recordings.contains("others"))
    for (const Json& other : recordings["others"]) columns.push_back(&other);
  Rows rows(1, {"recorded"});
  for (const Json* column : columns) rows[0].push_back(column->value("preset", "-"));
  for (const auto& [set, title] : kSets)
    for (const auto& [figure, words] : kFigures) {
      std::vector<std::string> row = {std::string(title) + ": " + words};
      bool any = false;
      for (const Json* column : columns) {
        const Json value = column->value(Json::json_pointer("/" + std::string(set) + "/summary/" + figure), Json());
        any = any || !value.is_null();
        row.push_back(value.is_number_integer() ? std::to_string(value.get<int64_t>())
                      : value.is_number()       ? cli::fixed(value.get<double>(), 3)
                                                : "-");
      }
      if (any) rows.push_back(std::move(row));
    }
  return rows;
}

nlohmann::json evaluate_recordings(const std::string& folder, const std::vector<std::string>& presets,
                                   const std::map<std::string, std::string>& configs, const std::string& out,
                                   bool print) {
  check_boxes(folder);
  Json json;
  for (const std::string& name : presets) {
    Json of_this = evaluate_all(folder, name, options_of(name, configs));
    if (json.is_null())
      json = std::move(of_this);
    else
      json["others"].push_back(std::move(of_this));
  }
  cli::make_folder(out);
  io::write_whole_file(out + "/recordings.json", io::dump_json(json, 1) + "\n");
  if (!print) return json;
  const Rows rows = recording_rows(json);
  cli::TextTable table(rows[0]);
  for (std::size_t r = 1; r < rows.size(); ++r) table.add(rows[r]);
  std::printf("%s\n%s\nRecorded. Written to %s/recordings.json\n", io::dump_json(json, 1).c_str(),
              table.format().c_str(), out.c_str());
  return json;
}

}  // namespace overtake::evaluation
