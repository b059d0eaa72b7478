// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/urdf.h"

#include <tinyxml2.h>

#include <array>
#include <cmath>
#include <map>
#include <set>

#include "tools/io/angles.h"
#include "tools/io/error.h"
#include "tools/io/mounting.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

constexpr double kMostOffset_m = 100;  // as in a rig file

struct Transform {
  Rotation axes = axes_of(0, 0, 0);
  std::array<double, 3> at = {};
};

Transform operator*(const Transform& a, const Transform& b) {
  const auto turn = [&a](const std::array<double, 3>& p, std::array<double, 3> sum) {
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t i = 0; i < 3; ++i) sum[i] += a.axes[k][i] * p[k];
    return sum;
  };
  return {{turn(b.axes[0], {}), turn(b.axes[1], {}), turn(b.axes[2], {})}, turn(b.at, a.at)};
}

struct Joint {
  std::string parent;
  Transform parent_child;
};

std::string attribute(const std::string& path, const tinyxml2::XMLElement* element, const char* child,
                      const char* name) {
  const tinyxml2::XMLElement* found = element->FirstChildElement(child);
  const char* value = found ? found->Attribute(name) : nullptr;
  if (!value) throw Error(path, element->GetLineNum(), std::string("a joint without <") + child + " " + name + "=...>");
  return value;
}

std::array<double, 3> three_numbers(const std::string& path, const tinyxml2::XMLElement* origin, const char* name) {
  std::array<double, 3> out = {0, 0, 0};
  const char* value = origin ? origin->Attribute(name) : nullptr;
  if (!value) return out;
  const auto words = split_words(value);
  bool fine = words.size() == 3;
  for (std::size_t i = 0; fine && i < 3; ++i) fine = parse_number(words[i], out[i]) && std::isfinite(out[i]);
  if (!fine) throw Error(path, origin->GetLineNum(), std::string(name) + " is not three numbers");
  return out;
}

double tidy(double value) { return std::round(value * 1e9) / 1e9; }  // removes rounding errors such as sin(pi)

}  // namespace

void mount_by_urdf(Rig& rig, const std::string& file_and_link) {
  const auto comma = file_and_link.rfind(',');
  const std::string path = file_and_link.substr(0, comma);
  constexpr uint64_t kMost = uint64_t(16) << 20;  // meshes are separate files
  const std::string text = read_whole_file(path, kMost);
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
    throw Error(path, document.ErrorLineNum(), "is not XML: " + std::string(document.ErrorName()));
  const tinyxml2::XMLElement* robot = document.FirstChildElement("robot");
  if (!robot) throw Error(path, 0, "is not a URDF: it has no <robot>");
  std::map<std::string, Joint> joint_above;  // by child link
  std::set<std::string> links;
  for (auto* link = robot->FirstChildElement("link"); link; link = link->NextSiblingElement("link"))
    if (const char* name = link->Attribute("name")) links.insert(name);
  for (auto* joint = robot->FirstChildElement("joint"); joint; joint = joint->NextSiblingElement("joint")) {
    const tinyxml2::XMLElement* origin = joint->FirstChildElement("origin");
    const auto [roll, pitch, yaw] = three_numbers(path, origin, "rpy");
    joint_above[attribute(path, joint, "child", "link")] = {
        attribute(path, joint, "parent", "link"), {axes_of(roll, pitch, yaw), three_numbers(path, origin, "xyz")}};
  }
  const std::string base = comma == std::string::npos ? "" : file_and_link.substr(comma + 1);
  if (!base.empty() && !links.contains(base)) throw Error(path, 0, "has no link '" + base + "'");
  for (RigSensor& sensor : rig.sensors) {
    const std::string link = links.contains(sensor.frame_id) ? sensor.frame_id : sensor.name;
    if (!links.contains(link))
      throw Error(path, 0,
                  "has no link '" + (sensor.frame_id.empty() ? sensor.name : sensor.frame_id) + "' for sensor '" +
                      sensor.name + "' (frame_id in the rig file names it)");
    Transform T_base_sensor;
    std::string at = link;
    std::size_t steps = 0;
    while (at != base && joint_above.contains(at)) {
      if (++steps > joint_above.size()) throw Error(path, 0, "link '" + link + "' hangs in a circle of joints");
      T_base_sensor = joint_above[at].parent_child * T_base_sensor;
      at = joint_above[at].parent;
    }
    if (!base.empty() && at != base) throw Error(path, 0, "link '" + link + "' does not hang on link '" + base + "'");
    for (const double v : T_base_sensor.at)
      if (!(std::fabs(v) <= kMostOffset_m))
        throw Error(path, 0,
                    "link '" + link + "' lies more than 100 m from " + (base.empty() ? "its root" : "'" + base + "'"));
    const auto& [x, y, z] = T_base_sensor.axes;
    sensor.x_m = tidy(T_base_sensor.at[0]);
    sensor.y_m = tidy(T_base_sensor.at[1]);
    sensor.z_m = tidy(T_base_sensor.at[2]);
    sensor.roll_deg = tidy(deg(std::atan2(y[2], z[2])));
    sensor.pitch_deg = tidy(deg(std::atan2(-x[2], std::hypot(y[2], z[2]))));
    sensor.yaw_deg = tidy(deg(std::atan2(x[1], x[0])));
    if (rig.cloud_in_vehicle_frame && (sensor.roll_deg != 0 || sensor.pitch_deg != 0 || sensor.yaw_deg != 0))
      throw Error(path, 0,
                  "link '" + link + "' is turned, but the clouds of rig '" + rig.name +
                      "' are in the vehicle frame (cloud_frame): no rotation may be applied to them");
  }
}

}  // namespace overtake::io
