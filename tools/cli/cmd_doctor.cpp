// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake doctor: finds what is wrong with a recording and proposes repairs.
#include <algorithm>
#include <cstdio>
#include <set>

#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/cli/doctor.h"
#include "tools/cli/report_json.h"
#include "tools/client/console.h"
#include "tools/io/bag_stream.h"
#include "tools/io/error.h"
#include "tools/io/map_file.h"
#include "tools/io/output.h"
#include "tools/io/recording.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::cli {
namespace {

struct DoctorOptions : Options {
  bool json = false;
};

constexpr std::size_t kTried = 3;  // frames for testing another rig

// The built-in rigs whose sensors all have a topic.
std::vector<std::string> rigs_by_topics(const std::vector<io::BagTopic>& topics) {
  std::vector<std::string> names;
  for (const std::string& name : io::builtin_rig_names()) {
    const io::Rig rig = io::load_rig(name);
    const std::vector<int32_t> sensor_of = io::find_topic_roles(topics, rig).sensor_of;
    bool all = !rig.shared_cloud;  // one topic for all sensors: ignore its name
    for (int32_t s = 0; s < int32_t(rig.sensors.size()); ++s)
      all = all && std::find(sensor_of.begin(), sensor_of.end(), s) != sensor_of.end();
    if (all) names.push_back(name);
  }
  return names;
}

// Whether the first frames of the folder fit the rig without a finding.
bool fits_first_scans(const std::string& path, const io::Rig& rig) {
  try {
    const io::Recording recording(path, rig);
    Doctor doctor(rig);
    for (std::size_t i = 0; i < std::min(kTried, recording.frame_count()) && !interrupted(); ++i)
      for (const io::SensorScan& scan : recording.read(i).scans) doctor.add_scan(scan);
    const auto findings = doctor.findings();
    return std::none_of(findings.begin(), findings.end(), [](const Finding& finding) { return finding.wrong; });
  } catch (const io::Error&) {
    return false;  // files of other sensors, or damaged
  }
}

std::vector<std::string> rigs_by_scans(const std::string& path) {
  std::vector<std::string> names = io::builtin_rig_names();
  std::erase_if(names, [&](const std::string& name) { return !fits_first_scans(path, io::load_rig(name)); });
  return names;
}

std::string or_rigs(const std::vector<std::string>& names) {
  return names.empty() ? ", or give the rig that fits (--rig)"
                       : ", or give a rig that fits (--rig " + io::join(names, ", --rig ") + ")";
}

// Whether the file names fit the rig; else adds a finding.
bool check_names(const Config& config, std::vector<Finding>& findings) {
  const std::set<std::string> names = io::sensor_names_in(config.input);
  const bool one_cloud = config.rig.sensors.size() == 1 || config.rig.shared_cloud;
  const bool unnamed = names.contains("");
  std::vector<std::string> named;
  bool known = true;
  for (const std::string& name : names) {
    if (name.empty()) continue;
    known = known && (config.rig.shared_cloud || config.rig.find(name) >= 0);
    named.push_back(name);
  }
  if (known && (config.rig.shared_cloud ? names.size() == 1 : one_cloud || !unnamed)) return true;
  const std::string expected = config.rig.shared_cloud
                                   ? "expects one cloud a frame for all its sensors (FRAME.pcd)"
                                   : "has " + io::counted(int64_t(config.rig.sensors.size()), "sensor") + ": " +
                                         config.rig.sensor_names() + (one_cloud ? "" : " (FRAME_SENSOR.pcd)");
  const std::string found = named.empty()
                                ? "its files name no sensor (FRAME.pcd)"
                                : "its files are of " + std::string(named.size() == 1 ? "sensor " : "sensors ") +
                                      io::join(named, ", ") + (unnamed ? ", and some name none" : "");
  findings.push_back({true, "recording", found + "; rig " + config.rig.name + " " + expected,
                      "name the sensors of the rig file as the files do" + or_rigs(rigs_by_scans(config.input))});
  return false;
}

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
                        "name the topics in the rig file" + or_rigs(rigs_by_topics(bag->topics()))});
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
      const io::EgoRow row = io::ego_of_odometry(io::decode_odometry(message.data));
      if (!io::is_finite(row)) throw std::runtime_error("has a value that is not finite: this pose is not used");
      doctor.add_ego(row);
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
    std::vector<io::LostFile> lost;
    const io::FrameScans frame = recording.read(i, &lost);
    for (const io::LostFile& file : lost) {
      const int32_t last = config.rig.shared_cloud ? int32_t(config.rig.sensors.size()) - 1 : file.sensor;
      for (int32_t s = file.sensor; s <= last; ++s) doctor.add_error(s, file.error);
    }
    for (const io::SensorScan& scan : frame.scans) doctor.add_scan(scan);
  }
}

void add_doctor_options(CLI::App& command, DoctorOptions& options) {
  options.command = "doctor";
  add_detector_options(command, options);
  command.add_option("--config", options.config, "TOML file with the rig");
  command.add_option("--ego", options.ego, "CSV of ego poses, as for run");
  add_json_option(command, options.json);
  command.add_option("--map", options.map,
                     "map, as for run: tests whether the poses lie on it (default: that of a simulated log or folder)");
}

int examine(const DoctorOptions& options) {
  const Config config = load_config_with_rig(options);
  catch_interrupt();
  Doctor doctor(config.rig);
  std::vector<Finding> findings;
  bool fit = true;  // the recording may hold scans of the rig's sensors
  if (const std::string partial = io::why_partial(config.input); !partial.empty())
    findings.push_back({true, "recording", "this log is partial: " + partial, "make it again, or use what is there"});
  if (!config.map.empty()) {
    const io::MapData map = io::read_map(config.map);
    for (const std::string& note : map.notes) findings.push_back({false, "map", note, ""});
    doctor.set_map(map, config.map, config.params);
  }
  if (!config.ego.empty()) {
    std::vector<std::string> notes;
    for (const io::EgoRow& row : io::read_ego_file(config.ego, &notes)) doctor.add_ego(row);
    for (const std::string& note : notes) findings.push_back({false, "ego", note, ""});
  }
  if (io::is_bag(config.input))
    examine_bag(config, doctor, findings);
  else if ((fit = check_names(config, findings)))
    examine_folder(config, doctor);
  if (interrupted()) {  // a part of the recording tells nothing of the whole
    std::fprintf(stderr, "overtake: interrupted: %s was not read to its end\n", printable(config.input).c_str());
    return kInterrupted;
  }
  if (fit)  // else no sensor of the rig is in the recording
    for (Finding& finding : doctor.findings()) findings.push_back(std::move(finding));
  const bool any_wrong = std::any_of(findings.begin(), findings.end(), [](const Finding& f) { return f.wrong; });
  if (any_wrong && fit && !io::is_bag(config.input) && !fits_first_scans(config.input, config.rig)) {
    const auto rigs = rigs_by_scans(config.input);
    if (!rigs.empty())
      findings.push_back({false, "rig", "nothing is wrong with its first scans for rig " + io::join(rigs, ", rig "),
                          "if that is the vehicle: --rig " + rigs[0]});
  }
  if (options.json) {
    std::fputs(doctor_json(config.input, config.rig.name, findings).c_str(), stdout);
    return any_wrong ? kDamaged : 0;
  }

  int64_t wrong = 0;
  for (const Finding& finding : findings) {
    wrong += finding.wrong;
    std::printf("%s  %s: %s\n", finding.wrong ? "WRONG" : "note ", printable(finding.about).c_str(),
                printable(finding.sentence).c_str());
    if (!finding.advice.empty()) std::printf("       -> %s\n", printable(finding.advice).c_str());
  }
  if (wrong == 0)
    std::printf("Nothing is wrong with %s for rig %s.\n", printable(config.input).c_str(),
                printable(config.rig.name).c_str());
  else
    std::printf("%s wrong with %s for rig %s.\n", io::counted(wrong, "thing is", "things are").c_str(),
                printable(config.input).c_str(), printable(config.rig.name).c_str());
  return wrong == 0 ? 0 : kDamaged;
}

}  // namespace

Command doctor_command() {
  return make_command("doctor", "finds what is wrong with a recording for a rig, and gives advice", kListed,
                      add_doctor_options, examine);
}

}  // namespace overtake::cli
