// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/scaling.h"

#include <chrono>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "tools/client/console.h"
#include "tools/client/session.h"
#include "tools/evaluation/metrics/summary.h"
#include "tools/evaluation/report_pages.h"
#include "tools/evaluation/simulated_log.h"
#include "tools/io/json_text.h"
#include "tools/io/output.h"
#include "tools/io/text.h"

namespace overtake::evaluation {
namespace {

constexpr int32_t kFrames = 40, kWarm = 5;
using Clock = std::chrono::steady_clock;
using Stages = std::map<std::string, std::vector<double>>;

double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

void read_stages(ovt_reader* reader, void* to) {
  Stages& stages = *static_cast<Stages*>(to);
  for (int32_t sensor = -1; sensor < OVT_MAX_SENSORS; ++sensor)
    for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage) {
      int64_t ns = -1;
      if (ovt_read_time(reader, sensor, ovt_stage(stage), &ns) == OVT_OK && ns >= 0)
        stages[ovt_stage_name(stage)].push_back(double(ns) * 1e-6);
    }
}

io::Rig widen(const io::Rig& rig, int32_t sensors) {
  io::Rig out = rig;
  out.sensors.clear();
  for (int32_t k = 0; k < sensors; ++k) {
    io::RigSensor s = rig.sensors[std::size_t(k) % rig.sensors.size()];
    s.name += std::to_string(k);
    s.yaw_deg += 40.0 * double(std::size_t(k) / rig.sensors.size());
    out.sensors.push_back(s);
  }
  return out;
}

}  // namespace

void measure_scaling(const std::string& path, const cli::Options& preset, const std::string& out, bool print) {
  SimulatedLog log(path);
  std::vector<io::FrameScans> frames;
  LogFrame frame;
  while (int32_t(frames.size()) < kFrames && log.next(frame))
    if (frame.scans.scans.size() == log.rig().sensors.size()) frames.push_back(frame.scans);
  std::vector<io::EgoRow> poses;
  for (const PublishedPose& p : log.poses()) poses.push_back(p.row);
  cli::make_folder(out + "/maps");
  const std::string map_file = out + "/maps/scaling.csv";
  io::write_whole_file(map_file, log.map_text());
  io::commit_outputs();

  nlohmann::json json;
  double load[3] = {0, 0, 0};
  getloadavg(load, 3);
  const int32_t cpus = int32_t(std::max(1u, std::thread::hardware_concurrency()));
  json["cpu"] = cpu_name(), json["cpus"] = cpus, json["load_average_at_start"] = load[0];
  json["frames"] = frames.size(), json["log"] = path.substr(path.rfind('/') + 1);
  cli::TextTable table({"sensors", "workers", "median ms", "p90 ms", "segmentation", "frames/s"});
  for (int32_t sensors = 1; sensors <= OVT_MAX_SENSORS; ++sensors) {
    std::vector<io::FrameScans> input = frames;
    for (io::FrameScans& f : input) {
      const std::vector<io::SensorScan> own = f.scans;
      f.scans.clear();
      for (int32_t k = 0; k < sensors; ++k) {
        f.scans.push_back(own[std::size_t(k) % own.size()]);
        f.scans.back().sensor = k;
      }
    }
    for (int32_t workers = 1; workers <= cpus; workers = workers < cpus ? std::min(2 * workers, cpus) : cpus + 1) {
      cli::Config config = cli::load_config(preset);
      config.ego.clear();
      config.map = log.map_text().empty() ? "" : map_file, config.rig = widen(log.rig(), sensors),
      config.has_rig = true, config.workers = workers;
      config.params.frame_period_s = log.rig().period_s;
      config.keep_images = false;  // as for overtake run: nothing reads them
      std::vector<double> alone;
      Stages stages;
      {
        cli::Session session(config, &read_stages, &stages);
        session.add_ego(poses);
        for (std::size_t k = 0; k < input.size(); ++k) {
          const auto begin = Clock::now();
          session.push(input[k]);
          session.flush();
          if (k >= kWarm) alone.push_back(ms_since(begin));
        }
      }
      cli::Session session(config, nullptr, nullptr);
      session.add_ego(poses);
      const auto begin = Clock::now();
      for (const io::FrameScans& f : input) session.push(f);
      session.flush();
      const double per_second = 1000.0 * double(input.size()) / ms_since(begin);

      const metrics::Summary s = metrics::summarize(alone);
      std::vector<double> sorted = alone;
      std::sort(sorted.begin(), sorted.end());
      nlohmann::json cell = {{"sensors", sensors},
                             {"workers", workers},
                             {"median_ms", s.median},
                             {"p90_ms", metrics::percentile(sorted, 0.9)},
                             {"frames_per_second", per_second}};
      for (const auto& [stage, values] : stages) cell["stage_median_ms"][stage] = metrics::summarize(values).median;
      const double segmentation = metrics::summarize(stages["segment"]).median;
      json["cells"].push_back(cell);
      table.add({std::to_string(sensors), std::to_string(workers), cli::fixed(s.median, 2),
                 cli::fixed(metrics::percentile(sorted, 0.9), 2), cli::fixed(segmentation, 2),
                 cli::fixed(per_second, 0)});
    }
  }
  io::write_whole_file(out + "/scaling.json", io::dump_json(json, 1) + "\n");
  if (print)
    std::printf("%s\n%s, load average %.1f. Written to %s/scaling.json\n", table.format().c_str(), cpu_name().c_str(),
                load[0], out.c_str());
}

}  // namespace overtake::evaluation
