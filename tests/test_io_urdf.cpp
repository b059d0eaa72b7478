// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <string>

#include "tests/support/recorded.h"
#include "tests/support/temp_folder.h"
#include "tools/io/urdf.h"

using namespace overtake;

namespace {

io::Rig one_sensor(const std::string& frame_id) {
  return io::parse_rig(
      "r",
      "period_s = 0.05\n[[sensor]]\nname = \"front\"\nx_m = 0.0\ny_m = 0.0\nz_m = 0.0\nrows = 8\ncols = 64\n"
      "wraps = true\nframe_id = \"" +
          frame_id + "\"\n");
}

std::string joint(const std::string& parent, const std::string& child, const std::string& origin) {
  return "<joint name=\"" + parent + child + "\" type=\"fixed\"><parent link=\"" + parent + "\"/><child link=\"" +
         child + "\"/>" + origin + "</joint>\n";
}

std::string robot(const std::string& joints) {
  return "<?xml version=\"1.0\"?>\n<robot name=\"car\">\n<link name=\"road\"/>\n<link name=\"axle\"/>\n<link "
         "name=\"lidar\"/>\n" +
         joints + "</robot>\n";
}

}  // namespace

TEST_CASE("URDF: a sensor's mounting is the chain of joints from its link to the base") {
  const TempFolder folder;
  const std::string path =
      folder.write("car.urdf", robot(joint("road", "axle", "<origin xyz=\"0 0 0.2\" rpy=\"0 0 1.5707963267948966\"/>") +
                                     joint("axle", "lidar", "<origin xyz=\"2 1 0.5\" rpy=\"0 0.1 0\"/>")));
  io::Rig rig = one_sensor("lidar");
  io::mount_by_urdf(rig, path);
  CHECK(rig.sensors[0].x_m == doctest::Approx(-1));  // axle's x is road's y
  CHECK(rig.sensors[0].y_m == doctest::Approx(2));
  CHECK(rig.sensors[0].z_m == doctest::Approx(0.7));
  CHECK(rig.sensors[0].yaw_deg == doctest::Approx(90));
  CHECK(rig.sensors[0].pitch_deg == doctest::Approx(5.72958));
  CHECK(rig.sensors[0].roll_deg == doctest::Approx(0));
  io::mount_by_urdf(rig, path + ",axle");
  CHECK(rig.sensors[0].x_m == doctest::Approx(2));
  CHECK(rig.sensors[0].yaw_deg == doctest::Approx(0));
  rig.cloud_in_vehicle_frame = true;
  CHECK(error_of([&] { io::mount_by_urdf(rig, path + ",axle"); }).starts_with(path + ": link 'lidar' is turned, but"));
}

TEST_CASE("URDF: missing or wrong elements are named") {
  const TempFolder folder;
  const auto error = [&](const std::string& text, const std::string& link = "", const std::string& frame = "lidar") {
    io::Rig rig = one_sensor(frame);
    const std::string path = folder.write("car.urdf", text);
    return error_of([&] { io::mount_by_urdf(rig, path + link); }).substr(path.size());
  };
  CHECK(error("<robot>", "") == ":1: is not XML: XML_ERROR_MISMATCHED_ELEMENT");
  std::string deep = "<robot>";
  for (int32_t i = 0; i < 50'000; ++i) deep += "<a>";
  CHECK(error(deep) == ":1: is not XML: XML_ELEMENT_DEPTH_EXCEEDED");
  CHECK(error("<car/>") == ": is not a URDF: it has no <robot>");
  CHECK(error(robot(""), "", "mast") == ": has no link 'mast' for sensor 'front' (frame_id in the rig file names it)");
  CHECK(error(robot(""), ",boat") == ": has no link 'boat'");
  CHECK(error(robot(joint("road", "axle", "")), ",road") == ": link 'lidar' does not hang on link 'road'");
  CHECK(error(robot(joint("axle", "lidar", "") + joint("lidar", "axle", ""))) ==
        ": link 'lidar' hangs in a circle of joints");
  CHECK(error(robot(joint("road", "lidar", "\n<origin xyz=\"1 2\"/>"))) == ":7: xyz is not three numbers");
  // Positions that no rig file allows, in one joint or as the sum of joints.
  const std::string far = "<origin xyz=\"0 60 0\"/>";
  CHECK(error(robot(joint("road", "axle", far) + joint("axle", "lidar", far))) ==
        ": link 'lidar' lies more than 100 m from its root");
  io::Rig rig = one_sensor("lidar");
  io::mount_by_urdf(
      rig, folder.write("car.urdf", robot(joint("road", "axle", far) + joint("axle", "lidar", far))) + ",axle");
  CHECK(rig.sensors[0].y_m == 60);
  CHECK(error(robot(joint("road", "lidar", "<origin xyz=\"1e308 0 0\"/>")), ",road") ==
        ": link 'lidar' lies more than 100 m from 'road'");
}

TEST_CASE("URDF: the AV-21's file gives the mounting of rig av21") {
  OVT_NEED_RECORDED("racecar/av21.urdf");
  io::Rig rig = io::load_rig("racecar");
  const io::Rig expected = io::load_rig("av21");
  io::mount_by_urdf(rig, recorded("racecar/av21.urdf"));
  for (std::size_t s = 0; s < 3; ++s) {
    CHECK(rig.sensors[s].x_m == doctest::Approx(expected.sensors[s].x_m));
    CHECK(rig.sensors[s].y_m == doctest::Approx(expected.sensors[s].y_m));
    CHECK(rig.sensors[s].z_m == doctest::Approx(expected.sensors[s].z_m));
    CHECK(rig.sensors[s].yaw_deg == doctest::Approx(expected.sensors[s].yaw_deg));
    CHECK(rig.sensors[s].roll_deg == doctest::Approx(0));
  }
}
