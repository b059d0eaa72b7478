// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake label: labels a recording's points as ground or obstacle by the paper's automatic labelling.
#include <cstdio>

#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/client/console.h"
#include "tools/evaluation/baselines/label_ground.h"
#include "tools/io/error.h"
#include "tools/io/mounting.h"
#include "tools/io/npy.h"
#include "tools/io/output.h"
#include "tools/io/scan_stream.h"
#include "tools/io/text.h"

namespace overtake::cli {
namespace {

struct LabelOptions {
  std::string input, rig, out;
  int64_t frame = -1, every = 1;
  baselines::LabelGroundParams params;
  bool quiet = false, force = false;
};

constexpr const char* kLabelsEnding = "_labels.npy";

std::vector<uint8_t> label_scan(const io::SensorScan& scan, const io::RigSensor& sensor,
                                const baselines::LabelGroundParams& params) {
  const io::Mounting mounting(sensor);
  std::vector<float> x, y, z;
  for (std::size_t i = 0; i < std::size_t(scan.count); ++i) {
    const auto at = mounting.to_vehicle(scan.x.value(i), scan.y.value(i), scan.z.value(i));
    x.push_back(float(at[0])), y.push_back(float(at[1])), z.push_back(float(at[2]));
  }
  const std::vector<bool> nonground = baselines::label_nonground(x, y, z, params);
  return {nonground.begin(), nonground.end()};
}

int label(const LabelOptions& options) {
  if (options.frame >= 0 && options.every > 1) throw CLI::ExcludesError("--frame", "--every");
  Options given;
  given.command = "label", given.input = options.input, given.rig = options.rig;
  const io::Rig rig = load_config_with_rig(given).rig;
  const auto stream = io::open_scans(options.input, rig);
  io::OutputGuard guard(options.force);
  add_inputs(guard, given, Config());
  guard.add_input(options.input);
  guard.add_folder(options.out);
  guard.check(options.out + "/labels.csv");
  catch_interrupt();
  Progress progress(1000, options.quiet);
  std::string csv = "frame,sensor,points,obstacles\n";
  TextTable table({"frame", "sensor", "points", "obstacles"});
  io::FrameScans frame;
  int64_t first = -1, last = -1;  // frames of the recording
  for (int64_t n = 0; stream->next(frame) && !interrupted(); ++n) {
    if (n == 0) first = frame.frame;
    last = frame.frame;
    progress.show(int64_t(1000 * stream->progress()));
    if (options.frame >= 0 ? frame.frame != options.frame : n % options.every != 0) continue;
    for (const io::SensorScan& scan : frame.scans) {
      const io::RigSensor& sensor = rig.sensors[std::size_t(scan.sensor)];
      const std::vector<uint8_t> labels = label_scan(scan, sensor, options.params);
      int64_t obstacles = 0;
      for (const uint8_t l : labels) obstacles += l;
      const std::string place = std::to_string(frame.frame) + "_" + sensor.name;
      io::write_npy(options.out + "/" + place + kLabelsEnding, labels.data(), {int64_t(labels.size())});
      csv += std::to_string(frame.frame) + "," + sensor.name + "," + std::to_string(labels.size()) + "," +
             std::to_string(obstacles) + "\n";
      guard.keep();
      table.add({std::to_string(frame.frame), sensor.name, std::to_string(labels.size()), std::to_string(obstacles)});
    }
  }
  progress.clear();
  if (table.size() == 0 && !interrupted()) {
    if (options.frame < 0) throw io::Error(options.input, 0, "holds no frame");
    const std::string range =
        first < 0 ? "no frame" : "frames " + std::to_string(first) + " to " + std::to_string(last);
    throw io::Error(options.input, 0,
                    "holds no scan of that frame, " + std::to_string(options.frame) + "; it holds " + range);
  }
  io::write_whole_file(options.out + "/labels.csv", csv);
  if (interrupted()) {
    guard.keep();
    std::fprintf(stderr,
                 "overtake: interrupted after %zu scans; the results so far are kept in files that end in .part\n",
                 table.size());
    return kInterrupted;
  }
  guard.remove_leftovers(options.out, "", kLabelsEnding);  // of frames that an earlier command labelled
  guard.commit();
  if (!options.quiet)
    std::printf(
        "%s\nWritten to %s: FRAME_SENSOR_labels.npy (1 obstacle, 0 ground; points in the recording's order) "
        "labels.csv\n",
        table.format(20).c_str(), options.out.c_str());
  if (stream->lost_count() > 0)
    std::fprintf(stderr, "overtake: %s: %s\n", printable(options.input).c_str(), printable(stream->losses()).c_str());
  if (!stream->damage().empty())
    std::fprintf(stderr, "overtake: %s: %s; results are from the part before it\n", printable(options.input).c_str(),
                 printable(stream->damage()).c_str());
  return stream->lost_count() > 0 || !stream->damage().empty() ? kDamaged : 0;
}

void add_label_options(CLI::App& command, LabelOptions& options) {
  command.add_option("input", options.input, "a recording, as for run")->required();
  command.add_option("--rig", options.rig,
                     "sensors: a TOML file or a built-in rig (default: that of a simulated log or folder)");
  command.add_option("--out", options.out, "folder for the labels")->required();
  command.add_option("--frame", options.frame, "this frame only")->check(CLI::Range(int64_t(0), INT64_MAX));
  command.add_option("--every", options.every, "every N-th frame")->check(CLI::Range(1, 1000000));
  command.add_option("--neighbours", options.params.neighbours, "neighbours for the first plane of a point")
      ->check(CLI::Range(3, 96));
  command.add_option("--flat-deg", options.params.flat_deg, "a normal this close to the vertical is ground")
      ->check(in_range(1.0, 89.0));
  command.add_option("--voters", options.params.voters, "points that vote in the last step")->check(CLI::Range(1, 96));
  add_quiet_option(command, options.quiet);
  add_force_option(command, options.force);
}

}  // namespace

Command label_command() {
  return make_command("label", "ground and obstacles of every point, by planes and votes", kListed, add_label_options,
                      label);
}

}  // namespace overtake::cli
