// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake doctor: what is wrong with a recording, and what to do about it.
#include <cstdio>
#include <filesystem>

#include "tools/commands.h"
#include "tools/console.h"
#include "tools/doctor.h"
#include "tools/io/bag_stream.h"
#include "tools/io/error.h"
#include "tools/io/output.h"
#include "tools/io/recording.h"

namespace overtake::cli {
namespace {

void examine_bag(const Config& config, Doctor& doctor, std::vector<Finding>& findings) {
  const auto bag = io::open_bag(config.input);
  const io::TopicRoles roles = io::find_topic_roles(bag->topics(), config.rig);
  const bool own_ego = config.ego.empty();
  bool any = false;
  for (const int32_t sensor : roles.sensor_of) any = any || sensor >= 0;
  if (!any)
    findings.push_back({true, "recording",
                        "no topic of the rig's sensors is in it; clouds in it: " +
                            io::list_topics(bag->topics(), io::kPointCloud2Name),
                        "give the rig that fits (--rig), or name the topics in the rig file"});
  int64_t bad_poses = 0;
  io::BagMessage message;
  while (!interrupted() && bag->next(message)) {
    const auto topic = std::size_t(message.topic);
    const int32_t sensor = topic < roles.sensor_of.size() ? roles.sensor_of[topic] : -1;
    const std::string place = "message " + std::to_string(message.number);
    const auto first = config.rig.shared_cloud ? 0 : sensor;
    const auto last = config.rig.shared_cloud ? int32_t(config.rig.sensors.size()) - 1 : sensor;
    for (int32_t s = first; sensor >= 0 && s <= last; ++s) {
      try {
        doctor.add_scan(io::scan_of_message(place, message.data, config.rig, s));
      } catch (const std::runtime_error& error) {
        doctor.add_error(s, std::string(error.what()).starts_with(place) ? error.what() : place + " " + error.what());
      }
    }
    if (message.topic != roles.ego || !own_ego) continue;
    try {
      doctor.add_ego(io::ego_of_odometry(io::decode_odometry(message.data)));
    } catch (const std::runtime_error& error) {
      if (bad_poses++ == 0)
        findings.push_back({true, "ego", place + " " + error.what(), "check the recording of this topic"});
    }
  }
  if (!bag->damage().empty())
    findings.push_back({true, "recording", bag->damage(), "what came before can be used as it is; overtake run does"});
}

void examine_folder(const Config& config, Doctor& doctor) {
  const io::Recording recording(config.input, config.rig);
  for (std::size_t i = 0; i < recording.frame_count() && !interrupted(); ++i) {
    try {
      for (const io::SensorScan& scan : recording.read(i).scans) doctor.add_scan(scan);
    } catch (const io::Error& error) {
      int32_t sensor = 0;  // of the file's name
      const std::string stem = std::filesystem::path(error.file()).stem().string();
      for (int32_t s = 0; s < int32_t(config.rig.sensors.size()); ++s)
        if (stem.ends_with("_" + config.rig.sensors[std::size_t(s)].name)) sensor = s;
      doctor.add_error(sensor, error.what());
    }
  }
}

}  // namespace

int doctor_command(const Options& options) {
  const Config config = load_config_with_rig(options);
  catch_interrupt();
  Doctor doctor(config.rig);
  std::vector<Finding> findings;
  if (const std::string partial = io::why_partial(config.input); !partial.empty())
    findings.push_back({true, "recording", "this log is partial: " + partial, "make it again, or use what is there"});
  if (!config.ego.empty())
    for (const io::EgoRow& row : io::read_ego_file(config.ego)) doctor.add_ego(row);
  if (io::is_bag(config.input))
    examine_bag(config, doctor, findings);
  else
    examine_folder(config, doctor);
  for (Finding& finding : doctor.findings()) findings.push_back(std::move(finding));

  int64_t wrong = 0;
  for (const Finding& finding : findings) {
    wrong += finding.wrong;
    std::printf("%s  %s: %s\n", finding.wrong ? "WRONG" : "note ", finding.about.c_str(), finding.sentence.c_str());
    if (!finding.advice.empty()) std::printf("       -> %s\n", finding.advice.c_str());
  }
  if (wrong == 0)
    std::printf("Nothing is wrong with %s for rig %s.\n", config.input.c_str(), config.rig.name.c_str());
  else
    std::printf("%lld %s wrong with %s for rig %s.\n", static_cast<long long>(wrong),
                wrong == 1 ? "thing is" : "things are", config.input.c_str(), config.rig.name.c_str());
  return wrong == 0 ? 0 : kDamaged;
}

}  // namespace overtake::cli
