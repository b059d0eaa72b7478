// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake info: lists the contents of a recording. Needs no rig.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>

#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/cli/report_json.h"
#include "tools/client/console.h"
#include "tools/io/bag_stream.h"
#include "tools/io/cloud_message.h"
#include "tools/io/error.h"
#include "tools/io/formats.h"
#include "tools/io/output.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::cli {
namespace {

namespace fs = std::filesystem;

struct InfoOptions {
  std::string input;
  bool json = false;
};

struct TopicInfo {
  int64_t messages = 0, first_ns = 0, last_ns = 0, points = 0, undecoded = 0;
  uint64_t bytes = 0;
  std::string layout, frame;
};

void look_into(const io::BagTopic& topic, std::string_view data, TopicInfo& info) {
  try {
    if (io::is_type(topic, io::kPointCloud2Name)) {
      const io::PointCloud2 cloud = io::decode_point_cloud2(data);
      const uint64_t points = uint64_t(cloud.width) * cloud.height;
      if (points > uint64_t(INT32_MAX)) throw std::runtime_error("no cloud has so many points");
      info.points += int64_t(points);
      if (info.layout.empty()) info.layout = io::describe_layout(cloud);
      if (info.frame.empty()) info.frame = cloud.header.frame_id;
    } else if (io::is_type(topic, io::kOdometryName)) {
      const io::Odometry odometry = io::decode_odometry(data);
      if (info.frame.empty()) info.frame = odometry.child_frame_id + " in " + odometry.header.frame_id;
    }
  } catch (const std::runtime_error&) {
    ++info.undecoded;
  }
}

std::string format_stamp(int64_t ns) { return fixed(double(ns) * 1e-9, 3); }

RecordingInfo look_into_bag(const std::string& path) {
  const auto bag = io::open_bag(path);
  std::vector<TopicInfo> infos;
  RecordingInfo out;
  out.path = path;
  out.first_ns = INT64_MAX, out.last_ns = INT64_MIN;
  io::BagMessage message;
  while (!interrupted() && bag->next(message)) {
    if (std::size_t(message.topic) >= infos.size()) infos.resize(bag->topics().size());
    TopicInfo& info = infos[std::size_t(message.topic)];
    if (info.messages++ == 0) info.first_ns = info.last_ns = message.log_ns;
    info.first_ns = std::min(info.first_ns, message.log_ns);
    info.last_ns = std::max(info.last_ns, message.log_ns);
    info.bytes += message.data.size();
    out.first_ns = std::min(out.first_ns, message.log_ns);
    out.last_ns = std::max(out.last_ns, message.log_ns);
    look_into(bag->topics()[std::size_t(message.topic)], message.data, info);
  }
  infos.resize(bag->topics().size());
  out.kind = bag->describe();
  out.damage = bag->damage();
  for (std::size_t i = 0; i < infos.size(); ++i) {
    const TopicInfo& info = infos[i];
    const double span_s = (double(info.last_ns) - double(info.first_ns)) * 1e-9;
    const double rate_hz = info.messages > 1 && span_s > 0 ? double(info.messages - 1) / span_s : NAN;
    const io::BagTopic& topic = bag->topics()[i];
    out.topics.push_back({topic.name, topic.type, info.frame, info.layout, info.messages, info.points, info.undecoded,
                          rate_hz, info.bytes});
  }
  return out;
}

void print_bag(const RecordingInfo& info) {
  std::printf("%s: %s\n", printable(info.path).c_str(), printable(info.kind).c_str());
  if (info.first_ns <= info.last_ns)
    std::printf("from %s to %s s, %s s\n\n", format_stamp(info.first_ns).c_str(), format_stamp(info.last_ns).c_str(),
                fixed((double(info.last_ns) - double(info.first_ns)) * 1e-9, 3).c_str());
  TextTable table({"topic", "messages", "Hz", "MB", "type", "frame"});
  for (const RecordingInfo::Topic& topic : info.topics)
    table.add({topic.name, std::to_string(topic.messages), fixed(topic.rate_hz, 1),
               fixed(double(topic.bytes) * 1e-6, 1), topic.type,
               topic.layout.empty() ? topic.frame : "frame " + topic.frame});
  std::fputs(table.format().c_str(), stdout);
  for (const RecordingInfo::Topic& topic : info.topics) {
    if (!topic.layout.empty())
      std::printf("\n%s: %s a cloud; %s\n", printable(topic.name).c_str(),
                  io::counted(topic.points / (topic.messages - topic.undecoded), "point").c_str(),
                  printable(topic.layout).c_str());
    if (topic.undecoded > 0)
      std::printf("%s: %s not fit %s type\n", printable(topic.name).c_str(),
                  io::counted(topic.undecoded, "message does", "messages do").c_str(),
                  topic.undecoded == 1 ? "its" : "their");
  }
}

struct LostFiles {
  int64_t read = 0, count = 0;
  std::string first;  // error
};

// Describes the sensor by its first good scan.
void look_into_scan(const std::string& file, RecordingInfo::Scans& of_sensor, LostFiles& lost) {
  ++lost.read;
  try {
    const io::Cloud cloud = io::read_cloud(file);
    if (!of_sensor.first_file.empty()) return;
    std::vector<std::string> fields;
    for (const io::CloudField& field : cloud.fields) fields.push_back(field.name + " " + io::name_of(field.type));
    of_sensor.first_file = fs::path(file).filename().string();
    of_sensor.fields = io::join(fields, ", ");
    of_sensor.points = cloud.points;
  } catch (const io::Error& error) {
    if (lost.count++ == 0) lost.first = error.what();
  }
}

RecordingInfo look_into_folder(const std::string& path) {
  std::error_code code;
  std::vector<std::string> files;
  if (fs::is_directory(path, code)) {
    for (fs::directory_iterator at(path, code), end; !code && at != end; at.increment(code))
      files.push_back(at->path().string());
    if (code) throw io::Error(path, 0, "cannot be listed: " + code.message());
    std::sort(files.begin(), files.end());
  } else if (fs::exists(path, code)) {
    files.push_back(path);
  } else {
    throw io::Error(path, 0, "no such file or folder");
  }
  std::map<std::string, std::vector<std::string>> scans;  // by kind and sensor
  for (const std::string& file : files) {
    const io::Format* by_name = file == path ? io::find_format(file) : io::find_format_by_name(file);
    if (!by_name || !by_name->cloud) continue;
    const std::string kind = by_name->extension;
    const std::string stem = io::stem_of(file);
    const auto first = stem.find('_');
    const bool digits = stem.substr(0, first).find_first_not_of("0123456789") == std::string::npos;
    scans[(digits && first != std::string::npos ? "FRAME" + stem.substr(first) : "FRAME") + kind].push_back(file);
  }
  if (scans.empty()) throw io::Error(path, 0, "holds no recording: no " + io::list_extensions());
  RecordingInfo out;
  out.path = path;
  out.kind = fs::is_directory(path, code) ? "a folder of scans" : "one scan";
  LostFiles lost;
  for (const auto& [name, list] : scans) {
    RecordingInfo::Scans of_sensor = {name, "", "", int64_t(list.size()), 0};
    for (const std::string& file : list) {
      if (interrupted()) break;
      look_into_scan(file, of_sensor, lost);
    }
    out.scans.push_back(of_sensor);
  }
  if (lost.count > 0) {
    if (lost.count == lost.read) throw io::Error("", 0, lost.first);
    out.damage = io::counted(lost.count, "file") + " cannot be read; the first: " + lost.first;
  }
  return out;
}

void print_folder(const RecordingInfo& info) {
  std::printf("%s: %s\n\n", info.path.c_str(), info.kind.c_str());
  TextTable table({"scans", "files", "first", "points of the first", "fields"});
  for (const RecordingInfo::Scans& s : info.scans)
    table.add({s.name, std::to_string(s.files), s.first_file, std::to_string(s.points), s.fields});
  std::fputs(table.format().c_str(), stdout);
}

void add_info_options(CLI::App& command, InfoOptions& options) {
  command.add_option("input", options.input, io::describe_inputs())->required();
  add_json_option(command, options.json);
  command.footer("Formats, recognised by a file's first bytes, else by its extension:\n" + io::list_formats());
}

int print_info(const InfoOptions& options) {
  catch_interrupt();
  const std::string partial = io::why_partial(options.input);
  if (!partial.empty() && !options.json) std::printf("this log is partial: %s\n", printable(partial).c_str());
  io::check_one_kind(options.input);
  const bool is_bag = io::is_bag(options.input);
  RecordingInfo info = is_bag ? look_into_bag(options.input) : look_into_folder(options.input);
  info.partial = partial;
  if (interrupted()) info.damage = "interrupted, not read to its end";
  if (options.json)
    std::fputs(info_json(info).c_str(), stdout);
  else
    is_bag ? print_bag(info) : print_folder(info);
  if (info.damage.empty()) return 0;
  if (interrupted()) {
    std::fprintf(stderr, "overtake: interrupted; the output describes the part that was read\n");
    return kInterrupted;
  }
  std::fprintf(stderr, "overtake: %s: %s; the output describes the %s\n", printable(info.path).c_str(),
               printable(info.damage).c_str(), is_bag ? "part before the damage" : "others");
  return kDamaged;
}

}  // namespace

Command info_command() {
  return make_command("info", "lists the contents of a recording", kListed, add_info_options, print_info);
}

}  // namespace overtake::cli
