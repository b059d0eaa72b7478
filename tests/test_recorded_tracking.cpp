// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker alone on real motion, as `overtake track` runs it: detections made from recorded truth with noise and
// gaps, pushed through the C API with default parameters. Truth: a trajectory of the AV-21 on the Las Vegas Motor
// Speedway (data: GPL/LGPL), and the labels of KITTI tracking (data: CC BY-NC-SA 3.0).
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <random>
#include <set>
#include <sstream>

#include "pipeline/overtake.h"
#include "tests/support/recorded.h"
#include "tests/support/temp_folder.h"
#include "tools/cli/command_line.h"
#include "tools/evaluation/metrics/clear_mot.h"
#include "tools/io/csv.h"
#include "tools/io/kitti_tracking.h"
#include "tools/io/text.h"

namespace overtake {
namespace {

constexpr double kPi = 3.14159265358979323846;

double wrap(double angle_rad) { return std::remainder(angle_rad, 2 * kPi); }
constexpr uint64_t kSeeds = 8;  // of the noise: results of single seeds vary by a third
double degrees(double angle_rad) { return angle_rad * 180.0 / kPi; }

// Root mean square of errors, and their mean.
struct Rms {
  double squares = 0, sum = 0;
  int64_t count = 0;
  void add(double error) {
    squares += error * error;
    sum += error;
    ++count;
  }
  double value() const { return std::sqrt(squares / double(count)); }
  double mean() const { return sum / double(count); }
};

// ---- the tracker alone, through the C API ---------------------------------------------------------------------------

// A row of tracks.csv, published at the stamp of the detections.
struct TrackRow {
  int64_t stamp_ns = 0;
  uint64_t id = 0;
  bool confirmed = false, hit = false;  // hit: by the detections of this stamp
  double x_m = 0, y_m = 0, speed_mps = 0, course_rad = 0, yaw_rate_rps = 0, var_x = 0, var_y = 0;
};

class TrackerAlone {
 public:
  explicit TrackerAlone(const ovt_params& params) {
    ovt_detector_def def = ovt_default_detector_def();
    def.params = &params;
    def.sensors = nullptr;
    def.sensor_count = 0;
    def.worker_count = 1;
    def.on_frame = &TrackerAlone::on_frame;
    def.user = this;
    REQUIRE(ovt_create_detector(&def, &detector_) == OVT_OK);
  }
  ~TrackerAlone() { ovt_destroy_detector(detector_); }
  TrackerAlone(const TrackerAlone&) = delete;
  TrackerAlone& operator=(const TrackerAlone&) = delete;

  // Runs one iteration; returns the tracks after it.
  const std::vector<TrackRow>& push(int64_t stamp_ns, const std::vector<double>& x_m, const std::vector<double>& y_m) {
    ovt_external_detections in;
    ovt_external_detections_init(&in, sizeof in);
    in.stamp_ns = stamp_ns;
    in.count = int32_t(x_m.size());
    in.reference = OVT_REFERENCE_MAP;
    in.x_m = x_m.data();
    in.y_m = y_m.data();
    const int64_t before = frames_;
    REQUIRE(ovt_push_detections(detector_, &in) == OVT_OK);
    REQUIRE(frames_ == before + 1);
    return rows_;
  }

 private:
  static void on_frame(ovt_reader* reader, void* self) { static_cast<TrackerAlone*>(self)->read(reader); }
  void read(ovt_reader* reader) {
    ++frames_;
    rows_.clear();
    ovt_tracks t;
    REQUIRE(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &t) == OVT_OK);
    for (int32_t i = 0; i < t.count; ++i)
      rows_.push_back({t.publish_ns, t.id[i], t.state[i] == OVT_CONFIRMED, t.measured_ns[i] == t.publish_ns, t.x_m[i],
                       t.y_m[i], t.speed_mps[i], t.course_rad[i], t.yaw_rate_rps[i], t.covariance[0][i],
                       t.covariance[2][i]});
  }

  ovt_detector* detector_ = nullptr;
  int64_t frames_ = 0;
  std::vector<TrackRow> rows_;
};

// ---- Las Vegas Motor Speedway ---------------------------------------------------------------------------------------

constexpr const char* kTrajectory = "lvms/LVMS_23_01_04_B.csv";
constexpr double kDriving_mps = 3.0;

struct Trajectory {
  std::vector<int64_t> stamp_ns;
  std::vector<double> x_m, y_m, vx_mps, vy_mps, phi_rad, omega_rps;
  std::size_t size() const { return x_m.size(); }
};

Trajectory read_trajectory() {
  const io::Csv csv = io::Csv::read(recorded(kTrajectory));
  Trajectory t;
  for (const double time_s : csv.numbers(csv.need({"time"})))
    t.stamp_ns.push_back(io::to_nanoseconds(time_s, 1'000'000'000));
  t.x_m = csv.numbers(csv.need({"x"}));
  t.y_m = csv.numbers(csv.need({"y"}));
  t.vx_mps = csv.numbers(csv.need({"vx"}));
  t.vy_mps = csv.numbers(csv.need({"vy"}));
  t.phi_rad = csv.numbers(csv.need({"phi"}));
  t.omega_rps = csv.numbers(csv.need({"omega"}));
  return t;
}

struct Detection {
  std::size_t row;  // of the trajectory
  int64_t stamp_ns;
  double x_m, y_m;
};

// Gaussian noise of 0.3 m on both coordinates; every fifth row is dropped.
std::vector<Detection> detect(const Trajectory& truth, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise_m(0.0, 0.3);
  std::vector<Detection> out;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (i % 5 == 4) continue;
    const double x_m = truth.x_m[i] + noise_m(random), y_m = truth.y_m[i] + noise_m(random);
    out.push_back({i, truth.stamp_ns[i], x_m, y_m});
  }
  return out;
}

// ---- KITTI tracking -------------------------------------------------------------------------------------------------

// Vehicles on four wheels or on rails. People, cyclists, Misc (mostly trailers) and DontCare are neither detections nor
// objects.
bool is_vehicle(const io::KittiLabel& label) {
  return label.type == "Car" || label.type == "Van" || label.type == "Truck" || label.type == "Tram";
}

// The labels end at the edge of the camera's picture, about 40 degrees to either side. The cars do not, and a confirmed
// track exists for up to 1.5 s more. So a track outside the picture and near no object may be right or wrong: this is
// unknown.
bool is_in_view(const io::RigidTransform& T_world_camera, const TrackRow& row) {
  const double ahead[3] = {0, 0, 1};
  double point_m[3];
  T_world_camera.apply(ahead, point_m);
  const double* camera_m = T_world_camera.translation_m;
  const double course_rad = std::atan2(point_m[1] - camera_m[1], point_m[0] - camera_m[0]);
  return std::fabs(wrap(std::atan2(row.y_m - camera_m[1], row.x_m - camera_m[0]) - course_rad)) < 40.0 * kPi / 180.0;
}

bool is_near(const metrics::MotPlace& place, const std::vector<metrics::MotPlace>& objects) {
  for (const metrics::MotPlace& object : objects)
    if (std::hypot(place.x_m - object.x_m, place.y_m - object.y_m) <= 2.0) return true;
  return false;
}

struct Scores {
  metrics::ClearMot all, in_view;  // every confirmed track; without the tracks of unknown truth
};

Scores track_sequence(const std::string& name, uint64_t seed) {
  Scores scores;
  const io::KittiSequence sequence = io::read_kitti_sequence(recorded("kitti/tracking"), name);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise_m(0.0, 0.2);
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  ovt_params params = ovt_default_params();
  params.frame_period_s = 0.1;
  TrackerAlone tracker(params);

  const int32_t frames = int32_t(sequence.T_world_camera.size());
  for (int32_t frame = 0; frame < frames; ++frame) {
    std::vector<metrics::MotPlace> objects, all, in_view;
    std::vector<double> x_m, y_m;
    for (const io::KittiLabel& label : sequence.labels) {
      if (label.frame != frame || !is_vehicle(label)) continue;
      double world_m[3];
      sequence.place(label, world_m);
      objects.push_back({uint64_t(label.track), world_m[0], world_m[1]});
      const double noise_x_m = noise_m(random), noise_y_m = noise_m(random);
      if (chance(random) < 0.1) continue;
      x_m.push_back(world_m[0] + noise_x_m);
      y_m.push_back(world_m[1] + noise_y_m);
    }
    for (const TrackRow& row : tracker.push(frame * int64_t(100'000'000), x_m, y_m)) {
      if (!row.confirmed) continue;
      const metrics::MotPlace place{row.id, row.x_m, row.y_m};
      all.push_back(place);
      if (is_in_view(sequence.T_world_camera[std::size_t(frame)], row) || is_near(place, objects))
        in_view.push_back(place);
    }
    scores.all.add_frame(objects, all);
    scores.in_view.add_frame(objects, in_view);
  }
  return scores;
}

std::string to_text(const metrics::ClearMotCounts& c) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(3) << "MOTA " << c.mota() << ", MOTP " << c.motp_m() << " m, " << c.switches
       << " switches, " << c.fragments << " fragments, " << c.misses << " misses, " << c.false_positives
       << " false positives of " << c.objects << " objects";
  return text.str();
}

}  // namespace

TEST_CASE("recorded: lvms: phi is the heading from +x, counter-clockwise") {
  OVT_NEED_RECORDED(kTrajectory);
  const Trajectory truth = read_trajectory();
  REQUIRE(truth.size() > 16000);
  Rms against_phi, against_course;  // minus the course from positions; with and without slip angle atan(vy / vx)
  for (std::size_t i = 2; i + 2 < truth.size(); ++i) {
    if (truth.vx_mps[i] <= kDriving_mps) continue;
    const double course_rad = std::atan2(truth.y_m[i + 2] - truth.y_m[i - 2], truth.x_m[i + 2] - truth.x_m[i - 2]);
    against_phi.add(wrap(course_rad - truth.phi_rad[i]));
    against_course.add(wrap(course_rad - truth.phi_rad[i] - std::atan2(truth.vy_mps[i], truth.vx_mps[i])));
  }
  CHECK(std::fabs(degrees(against_phi.mean())) < 0.2);
  CHECK(degrees(against_phi.value()) < 0.7);
  CHECK(degrees(against_course.value()) < 0.3);
}

TEST_CASE("recorded: lvms: one track over the whole drive, never lost, with speed, course and yaw rate of the car") {
  OVT_NEED_RECORDED(kTrajectory);
  const Trajectory truth = read_trajectory();
  Rms place, speed, course, slip_course, yaw_rate;  // while it drives, over all seeds
  double least_course_rad = 10, most_course_rad = 0;
  for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
    CAPTURE(seed);
    TrackerAlone tracker(ovt_default_params());
    Rms own_course;
    std::set<uint64_t> ids;
    int64_t not_one = 0, not_hit = 0, not_confirmed = 0, iteration = 0;
    for (const Detection& d : detect(truth, seed)) {
      const std::vector<TrackRow>& rows = tracker.push(d.stamp_ns, {d.x_m}, {d.y_m});
      ++iteration;
      not_one += rows.size() != 1;
      for (const TrackRow& row : rows) {
        ids.insert(row.id);
        not_hit += !row.hit;
        not_confirmed += iteration >= 6 && !row.confirmed;  // M_c = 6 hits
        if (truth.vx_mps[d.row] <= kDriving_mps) continue;
        place.add(std::hypot(row.x_m - truth.x_m[d.row], row.y_m - truth.y_m[d.row]));
        speed.add(row.speed_mps - truth.vx_mps[d.row]);
        const double off_heading_rad = wrap(row.course_rad - truth.phi_rad[d.row]);
        course.add(off_heading_rad);
        own_course.add(off_heading_rad);
        slip_course.add(wrap(off_heading_rad - std::atan2(truth.vy_mps[d.row], truth.vx_mps[d.row])));
        yaw_rate.add(row.yaw_rate_rps - truth.omega_rps[d.row]);
      }
    }
    CHECK(iteration == 13433);
    CHECK(ids.size() == 1);
    CHECK(not_one == 0);
    CHECK(not_hit == 0);
    CHECK(not_confirmed == 0);
    least_course_rad = std::min(least_course_rad, own_course.value());
    most_course_rad = std::max(most_course_rad, own_course.value());
  }
  MESSAGE("LVMS, RMSE over seeds 1 to " << kSeeds << " where vx > 3 m/s: speed " << speed.value() << " m/s, course "
                                        << degrees(course.value()) << " deg (" << degrees(least_course_rad) << " to "
                                        << degrees(most_course_rad) << "; with the slip angle "
                                        << degrees(slip_course.value()) << "), yaw rate " << yaw_rate.value()
                                        << " rad/s, place " << place.value() << " m");
  CHECK(speed.count > int64_t(kSeeds) * 9000);
  CHECK(speed.value() < 0.57);
  CHECK(degrees(course.value()) < 1.85);
  CHECK(degrees(most_course_rad) < 2.5);
  CHECK(yaw_rate.value() < 0.026);
  CHECK(place.value() < 0.25);
}

TEST_CASE("recorded: lvms: overtake track writes the results of the C API") {
  OVT_NEED_RECORDED(kTrajectory);
  const std::vector<Detection> detections = detect(read_trajectory(), 1);
  const TempFolder folder;
  const std::string input = folder.path("detections.csv"), out = folder.path("out");
  {
    io::CsvWriter csv(input, "stamp_ns,x_m,y_m");
    for (const Detection& d : detections) csv.cell(d.stamp_ns).cell(d.x_m).cell(d.y_m).end_row();
  }
  const char* const words[] = {"overtake", "track", input.c_str(), "--preset",
                               "paper",    "--out", out.c_str(),   "--quiet"};
  REQUIRE(cli::run_command_line(8, words) == 0);

  const io::Csv csv = io::Csv::read(out + "/tracks.csv");
  REQUIRE(csv.row_count() == detections.size());  // one track, in every scan
  const int32_t stamp = csv.need({"stamp_ns"}), id = csv.need({"id"}), state = csv.need({"state"});
  const int32_t frame = csv.need({"frame"}), x = csv.need({"x_m"}), y = csv.need({"y_m"});
  const int32_t speed = csv.need({"speed_mps"}), course = csv.need({"course_rad"}), yaw = csv.need({"yaw_rate_rps"});
  const int32_t var_x = csv.need({"var_x"}), var_y = csv.need({"var_y"});
  TrackerAlone tracker(ovt_default_params());
  for (std::size_t i = 0; i < detections.size(); ++i) {
    const std::vector<TrackRow>& rows = tracker.push(detections[i].stamp_ns, {detections[i].x_m}, {detections[i].y_m});
    CAPTURE(i);
    REQUIRE(rows.size() == 1);
    const TrackRow& row = rows[0];
    REQUIRE(csv.integer(i, stamp) == row.stamp_ns);
    REQUIRE(row.stamp_ns == detections[i].stamp_ns);
    REQUIRE(uint64_t(csv.integer(i, id)) == row.id);
    REQUIRE(csv.text(i, state) == (row.confirmed ? "confirmed" : "tentative"));
    REQUIRE(csv.integer(i, frame) == int64_t(i));
    REQUIRE(csv.number(i, x) == row.x_m);  // the text reads back as the same double
    REQUIRE(csv.number(i, y) == row.y_m);
    REQUIRE(csv.number(i, speed) == row.speed_mps);
    REQUIRE(csv.number(i, course) == row.course_rad);
    REQUIRE(csv.number(i, yaw) == row.yaw_rate_rps);
    REQUIRE(csv.number(i, var_x) == row.var_x);
    REQUIRE(csv.number(i, var_y) == row.var_y);
  }
}

TEST_CASE("recorded: kitti: the tracker has its known CLEAR MOT at 2 m on real traffic") {
  OVT_NEED_RECORDED("kitti/tracking");
  struct Bound {
    const char* sequence;
    double mota, mota_in_view;
    int64_t switches, fragments;  // of all seeds together
  };
  for (const Bound& bound : {Bound{"0000", 0.74, 0.81, 16, 32}, Bound{"0004", 0.34, 0.74, 4, 32},
                             Bound{"0010", 0.48, 0.83, 2, 4}, Bound{"0018", 0.71, 0.87, 8, 16}}) {
    const std::string name = bound.sequence;
    CAPTURE(name);
    metrics::ClearMotCounts all, in_view;
    for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
      const Scores scores = track_sequence(name, seed);
      all += scores.all.counts();
      in_view += scores.in_view.counts();
    }
    MESSAGE("KITTI " << name << ", seeds 1 to " << kSeeds << ": " << to_text(all)
                     << "; without the false positives outside the camera's view: MOTA " << in_view.mota() << ", "
                     << in_view.false_positives << " false positives");
    CHECK(all.mota() > bound.mota);
    CHECK(in_view.mota() > bound.mota_in_view);
    CHECK(all.switches <= bound.switches);
    CHECK(all.fragments <= bound.fragments);
    CHECK(all.motp_m() < 0.45);
    CHECK(in_view.matches == all.matches);  // the excluded tracks were matched with no object
    CHECK(in_view.switches == all.switches);
    CHECK(in_view.fragments == all.fragments);
  }
}

}  // namespace overtake
