// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Definitions in MCAP's encoding "ros2msg": the message, then every type it uses, each after a line of =.
#include "tools/io/ros_messages.h"

#define OVT_MSG(name) \
  "================================================================================\nMSG: " name "\n"
#define OVT_HEADER           \
  OVT_MSG("std_msgs/Header") \
  "builtin_interfaces/Time stamp\n"              \
  "string frame_id\n" OVT_MSG("builtin_interfaces/Time") \
  "int32 sec\n"                                  \
  "uint32 nanosec\n"
#define OVT_XYZ(name) OVT_MSG(name) "float64 x\nfloat64 y\nfloat64 z\n"
#define OVT_QUATERNION OVT_MSG("geometry_msgs/Quaternion") "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"

namespace overtake::io {

const char* const kPointCloud2Schema =
    "std_msgs/Header header\n"
    "uint32 height\n"
    "uint32 width\n"
    "sensor_msgs/PointField[] fields\n"
    "bool is_bigendian\n"
    "uint32 point_step\n"
    "uint32 row_step\n"
    "uint8[] data\n"
    "bool is_dense\n"
    OVT_HEADER
    OVT_MSG("sensor_msgs/PointField")
    "uint8 INT8=1\n"
    "uint8 UINT8=2\n"
    "uint8 INT16=3\n"
    "uint8 UINT16=4\n"
    "uint8 INT32=5\n"
    "uint8 UINT32=6\n"
    "uint8 FLOAT32=7\n"
    "uint8 FLOAT64=8\n"
    "string name\n"
    "uint32 offset\n"
    "uint8 datatype\n"
    "uint32 count\n";

const char* const kOdometrySchema =
    "std_msgs/Header header\n"
    "string child_frame_id\n"
    "geometry_msgs/PoseWithCovariance pose\n"
    "geometry_msgs/TwistWithCovariance twist\n"
    OVT_HEADER
    OVT_MSG("geometry_msgs/PoseWithCovariance")
    "geometry_msgs/Pose pose\n"
    "float64[36] covariance\n"
    OVT_MSG("geometry_msgs/Pose")
    "geometry_msgs/Point position\n"
    "geometry_msgs/Quaternion orientation\n"
    OVT_XYZ("geometry_msgs/Point")
    OVT_QUATERNION
    OVT_MSG("geometry_msgs/TwistWithCovariance")
    "geometry_msgs/Twist twist\n"
    "float64[36] covariance\n"
    OVT_MSG("geometry_msgs/Twist")
    "geometry_msgs/Vector3 linear\n"
    "geometry_msgs/Vector3 angular\n"
    OVT_XYZ("geometry_msgs/Vector3");

const char* const kTransformsSchema =
    "geometry_msgs/TransformStamped[] transforms\n"
    OVT_MSG("geometry_msgs/TransformStamped")
    "std_msgs/Header header\n"
    "string child_frame_id\n"
    "geometry_msgs/Transform transform\n"
    OVT_HEADER
    OVT_MSG("geometry_msgs/Transform")
    "geometry_msgs/Vector3 translation\n"
    "geometry_msgs/Quaternion rotation\n"
    OVT_XYZ("geometry_msgs/Vector3")
    OVT_QUATERNION;

}  // namespace overtake::io
