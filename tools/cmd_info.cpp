// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake info: what a recording holds. Needs no rig.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>

#include "tools/commands.h"
#include "tools/console.h"
#include "tools/io/bag_stream.h"
#include "tools/io/cloud_message.h"
#include "tools/io/error.h"
#include "tools/io/kitti_bin.h"
#include "tools/io/output.h"
#include "tools/io/text.h"

namespace overtake::cli {
namespace {

namespace fs = std::filesystem;

struct TopicInfo {
  int64_t messages = 0, first_ns = 0, last_ns = 0, points = 0, undecoded = 0;
  uint64_t bytes = 0;
  std::string layout, frame;
};

void look_into(const io::BagTopic& topic, std::string_view data, TopicInfo& info) {
  try {
    if (io::is_type(topic, io::kPointCloud2Name)) {
      const io::PointCloud2 cloud = io::decode_point_cloud2(data);
      info.points += int64_t(cloud.width) * cloud.height;
      if (info.layout.empty()) info.layout = io::describe_layout(cloud);
      if (info.frame.empty()) info.frame = "frame " + cloud.header.frame_id;
    } else if (io::is_type(topic, io::kOdometryName) && info.frame.empty()) {
      const io::Odometry odometry = io::decode_odometry(data);
      info.frame = odometry.child_frame_id + " in " + odometry.header.frame_id;
    }
  } catch (const std::runtime_error&) {
    ++info.undecoded;
  }
}

int describe_bag(const std::string& path) {
  const auto bag = io::open_bag(path);
  std::vector<TopicInfo> infos;
  int64_t first_ns = INT64_MAX, last_ns = INT64_MIN;
  io::BagMessage message;
  while (!interrupted() && bag->next(message)) {
    if (std::size_t(message.topic) >= infos.size()) infos.resize(bag->topics().size());
    TopicInfo& info = infos[std::size_t(message.topic)];
    if (info.messages++ == 0) info.first_ns = info.last_ns = message.log_ns;
    info.first_ns = std::min(info.first_ns, message.log_ns);
    info.last_ns = std::max(info.last_ns, message.log_ns);
    info.bytes += message.data.size();
    first_ns = std::min(first_ns, message.log_ns);
    last_ns = std::max(last_ns, message.log_ns);
    look_into(bag->topics()[std::size_t(message.topic)], message.data, info);
  }
  infos.resize(bag->topics().size());
  std::printf("%s: %s\n", path.c_str(), bag->describe().c_str());
  if (first_ns <= last_ns)
    std::printf("from %s to %s s, %s s\n\n", fixed(double(first_ns) * 1e-9, 3).c_str(),
                fixed(double(last_ns) * 1e-9, 3).c_str(),
                fixed((double(last_ns) - double(first_ns)) * 1e-9, 3).c_str());
  TextTable table({"topic", "messages", "Hz", "MB", "type", "frame"});
  for (std::size_t i = 0; i < infos.size(); ++i) {
    const TopicInfo& info = infos[i];
    const double span_s = (double(info.last_ns) - double(info.first_ns)) * 1e-9;
    table.add({bag->topics()[i].name, std::to_string(info.messages),
               fixed(info.messages > 1 && span_s > 0 ? double(info.messages - 1) / span_s : NAN, 1),
               fixed(double(info.bytes) * 1e-6, 1), bag->topics()[i].type, info.frame});
  }
  std::fputs(table.format().c_str(), stdout);
  for (std::size_t i = 0; i < infos.size(); ++i) {
    const TopicInfo& info = infos[i];
    const char* name = bag->topics()[i].name.c_str();
    if (!info.layout.empty())
      std::printf("\n%s: %lld points a cloud; %s\n", name, static_cast<long long>(info.points / info.messages),
                  info.layout.c_str());
    if (info.undecoded > 0)
      std::printf("%s: %lld messages are not what their type says\n", name, static_cast<long long>(info.undecoded));
  }
  if (bag->damage().empty()) return 0;
  std::fprintf(stderr, "overtake: %s: %s; the lines above are about what came before it\n", path.c_str(),
               bag->damage().c_str());
  return kDamaged;
}

int describe_folder(const std::string& path) {
  std::error_code code;
  std::vector<std::string> files;
  if (fs::is_directory(path, code)) {
    for (fs::directory_iterator at(path, code), end; !code && at != end; at.increment(code))
      files.push_back(at->path().string());
    std::sort(files.begin(), files.end());
  } else if (fs::exists(path, code)) {
    files.push_back(path);
  } else {
    throw io::Error(path, 0, "no such file or folder");
  }
  std::map<std::string, std::vector<std::string>> scans;  // by kind and sensor
  for (const std::string& file : files) {
    const std::string kind = io::lower_case(fs::path(file).extension().string());
    if (kind != ".pcd" && kind != ".bin") continue;
    const std::string stem = fs::path(file).stem().string();
    const auto first = stem.find('_');
    const bool digits = stem.substr(0, first).find_first_not_of("0123456789") == std::string::npos;
    scans[(digits && first != std::string::npos ? "FRAME" + stem.substr(first) : "FRAME") + kind].push_back(file);
  }
  if (scans.empty()) throw io::Error(path, 0, "holds nothing that is read: no .pcd, .bin, .db3 or .mcap");
  std::printf("%s: %s\n\n", path.c_str(), fs::is_directory(path, code) ? "a folder of scans" : "one scan");
  TextTable table({"scans", "files", "first", "points of the first", "fields"});
  for (const auto& [name, list] : scans) {
    const bool kitti = name.ends_with(".bin");
    const io::Pcd pcd = kitti ? io::read_kitti_bin(list[0]) : io::Pcd{io::read_pcd_header(list[0]), {}};
    std::vector<std::string> fields;
    static constexpr const char* kType[] = {"float32", "float64", "int8",   "uint8", "int16",
                                            "uint16",  "int32",   "uint32", "int64", "uint64"};
    for (const io::PcdField& field : pcd.header.fields)
      fields.push_back(field.name + " " + kType[std::size_t(field.type)]);
    table.add({name, std::to_string(list.size()), fs::path(list[0]).filename().string(),
               std::to_string(pcd.header.points), io::join(fields, ", ")});
  }
  std::fputs(table.format().c_str(), stdout);
  return 0;
}

}  // namespace

int info_command(const Options& options) {
  catch_interrupt();
  const std::string partial = io::why_partial(options.input);
  if (!partial.empty()) std::printf("this log is partial: %s\n", partial.c_str());
  io::check_one_kind(options.input);
  return io::is_bag(options.input) ? describe_bag(options.input) : describe_folder(options.input);
}

}  // namespace overtake::cli
