// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/ros_messages.h"

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/exceptions/Exception.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace overtake::io {
namespace {

using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

constexpr int64_t kSecond = 1'000'000'000;

// Fast-CDR takes a pointer to non-const, but only reads.
class Decoder {
 public:
  explicit Decoder(std::string_view bytes)
      : size_(bytes.size()),
        buffer_(const_cast<char*>(bytes.data()), bytes.size()),
        cdr_(buffer_, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR) {
    if (bytes.starts_with("\x28\xb5\x2f\xfd"))
      throw std::runtime_error(
          "it is compressed (ros2 bag record --compression-mode message); ros2 bag convert makes a "
          "bag without");
    if (bytes.size() < 4 || bytes[0] != 0 || (bytes[1] != 0 && bytes[1] != 1))
      throw std::runtime_error("it does not start as CDR does");
    cdr_.read_encapsulation();
  }

  template <class T>
  T value() {
    T out{};
    cdr_.deserialize(out);
    return out;
  }
  bool flag() { return value<uint8_t>() != 0; }  // accepts other values than 0 and 1
  // Bytes of a sequence or a string, without a copy.
  std::string_view bytes() {
    const auto count = value<uint32_t>();
    if (count > left()) throw std::runtime_error("it ends within a field of " + std::to_string(count) + " bytes");
    const std::string_view out(cdr_.getCurrentPosition(), count);
    if (count > 0) {
      cdr_.jump(count - 1);
      value<char>();  // after jump() alone, Fast-CDR would not align the next value
    }
    return out;
  }
  std::string text() {
    std::string_view out = bytes();
    if (!out.empty() && out.back() == 0) out.remove_suffix(1);
    return std::string(out);
  }
  // A number of elements, each of at least `least` bytes.
  uint32_t count(std::size_t least) {
    const auto out = value<uint32_t>();
    if (out > left() / least) throw std::runtime_error("it declares " + std::to_string(out) + " elements and ends");
    return out;
  }
  RosHeader header() {
    const auto seconds = value<int32_t>();
    const auto nanoseconds = value<uint32_t>();
    return {int64_t(seconds) * kSecond + int64_t(nanoseconds), text()};
  }
  RosPose pose() {
    RosPose pose;
    for (double* v : {&pose.x_m, &pose.y_m, &pose.z_m, &pose.qx, &pose.qy, &pose.qz, &pose.qw}) *v = value<double>();
    return pose;
  }

 private:
  std::size_t left() const { return size_ - std::min(size_, cdr_.getSerializedDataLength()); }
  std::size_t size_;
  FastBuffer buffer_;
  Cdr cdr_;
};

class Encoder {
 public:
  // `most`: upper limit of the bytes. They are zeroed, because Fast-CDR does not write padding.
  explicit Encoder(std::size_t most)
      : bytes_(most + 1024, '\0'),
        buffer_(bytes_.data(), bytes_.size()),
        cdr_(buffer_, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR) {
    cdr_.serialize_encapsulation();
  }
  template <class T>
  void value(T v) {
    cdr_.serialize(v);
  }
  void text(const std::string& v) { cdr_.serialize(v); }
  void bytes(std::string_view v) {
    value(uint32_t(v.size()));
    if (!v.empty()) cdr_.serializeArray(v.data(), v.size());
  }
  void header(const RosHeader& v) {
    const int64_t seconds = v.stamp_ns >= 0 ? v.stamp_ns / kSecond : -((kSecond - 1 - v.stamp_ns) / kSecond);
    value(int32_t(seconds));
    value(uint32_t(v.stamp_ns - seconds * kSecond));
    text(v.frame_id);
  }
  void pose(const RosPose& v) {
    for (const double d : {v.x_m, v.y_m, v.z_m, v.qx, v.qy, v.qz, v.qw}) value(d);
  }
  std::string take() {
    bytes_.resize(cdr_.getSerializedDataLength());
    return std::move(bytes_);
  }

 private:
  std::string bytes_;
  FastBuffer buffer_;
  Cdr cdr_;
};

// Fast-CDR's exceptions are not derived from std::runtime_error.
template <class F>
auto decode(std::string_view bytes, const char* name, F&& f) {
  try {
    Decoder decoder(bytes);
    return f(decoder);
  } catch (const eprosima::fastcdr::exception::Exception&) {
    throw std::runtime_error(std::string("is not a ") + name + ": it ends too early");
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(std::string("is not a ") + name + ": " + error.what());
  }
}

double squared_norm(const RosPose& p) { return p.qx * p.qx + p.qy * p.qy + p.qz * p.qz + p.qw * p.qw; }
bool is_rotation(double norm2) { return norm2 > 1e-200 && std::isfinite(norm2); }  // 2 / norm2 is finite

}  // namespace

void set_rotation(RosPose& pose, double roll_rad, double pitch_rad, double yaw_rad) {
  const double cr = std::cos(roll_rad / 2), sr = std::sin(roll_rad / 2);
  const double cp = std::cos(pitch_rad / 2), sp = std::sin(pitch_rad / 2);
  const double cy = std::cos(yaw_rad / 2), sy = std::sin(yaw_rad / 2);
  pose.qx = sr * cp * cy - cr * sp * sy;
  pose.qy = cr * sp * cy + sr * cp * sy;
  pose.qz = cr * cp * sy - sr * sp * cy;
  pose.qw = cr * cp * cy + sr * sp * sy;
}

double known_yaw_rad(const RosPose& p) { return is_rotation(squared_norm(p)) ? rotation_of(p).yaw_rad : NAN; }

RollPitchYaw rotation_of(const RosPose& p) {
  const double norm2 = squared_norm(p);
  if (!is_rotation(norm2)) return {0, 0, 0};
  const double k = 2 / norm2;
  return {std::atan2(k * (p.qw * p.qx + p.qy * p.qz), 1 - k * (p.qx * p.qx + p.qy * p.qy)),
          std::asin(std::clamp(k * (p.qw * p.qy - p.qz * p.qx), -1.0, 1.0)),
          std::atan2(k * (p.qw * p.qz + p.qx * p.qy), 1 - k * (p.qy * p.qy + p.qz * p.qz))};
}

std::string encode_point_cloud2(const PointCloud2& cloud) {
  std::size_t most = cloud.data.size() + cloud.header.frame_id.size();
  for (const PointField& field : cloud.fields) most += field.name.size() + 32;
  Encoder out(most);
  out.header(cloud.header);
  out.value(cloud.height);
  out.value(cloud.width);
  out.value(uint32_t(cloud.fields.size()));
  for (const PointField& field : cloud.fields) {
    out.text(field.name);
    out.value(field.offset);
    out.value(field.datatype);
    out.value(field.count);
  }
  out.value(uint8_t(cloud.is_bigendian));
  out.value(cloud.point_step);
  out.value(cloud.row_step);
  out.bytes(cloud.data);
  out.value(uint8_t(cloud.is_dense));
  return out.take();
}

PointCloud2 decode_point_cloud2(std::string_view bytes) {
  return decode(bytes, kPointCloud2Name, [](Decoder& in) {
    PointCloud2 cloud;
    cloud.header = in.header();
    cloud.height = in.value<uint32_t>();
    cloud.width = in.value<uint32_t>();
    const uint32_t fields = in.count(14);
    if (fields > kMostPointFields)
      throw std::runtime_error("it declares " + std::to_string(fields) + " fields a point, at most " +
                               std::to_string(kMostPointFields) + " are read");
    for (uint32_t i = 0; i < fields; ++i) {
      PointField field;
      field.name = in.text();
      field.offset = in.value<uint32_t>();
      field.datatype = in.value<uint8_t>();
      field.count = in.value<uint32_t>();
      cloud.fields.push_back(std::move(field));
    }
    cloud.is_bigendian = in.flag();
    cloud.point_step = in.value<uint32_t>();
    cloud.row_step = in.value<uint32_t>();
    cloud.data = in.bytes();
    cloud.is_dense = in.flag();
    return cloud;
  });
}

std::string encode_odometry(const Odometry& o) {
  Encoder out(o.header.frame_id.size() + o.child_frame_id.size());
  out.header(o.header);
  out.text(o.child_frame_id);
  out.pose(o.pose);
  for (const double v : o.pose_covariance) out.value(v);
  for (const double v : {o.vx_mps, o.vy_mps, o.vz_mps, o.wx_rps, o.wy_rps, o.wz_rps}) out.value(v);
  for (const double v : o.twist_covariance) out.value(v);
  return out.take();
}

Odometry decode_odometry(std::string_view bytes) {
  return decode(bytes, kOdometryName, [](Decoder& in) {
    Odometry o;
    o.header = in.header();
    o.child_frame_id = in.text();
    o.pose = in.pose();
    for (double& v : o.pose_covariance) v = in.value<double>();
    for (double* v : {&o.vx_mps, &o.vy_mps, &o.vz_mps, &o.wx_rps, &o.wy_rps, &o.wz_rps}) *v = in.value<double>();
    for (double& v : o.twist_covariance) v = in.value<double>();
    return o;
  });
}

std::string encode_transforms(const std::vector<RosTransform>& transforms) {
  std::size_t most = 0;
  for (const RosTransform& t : transforms) most += t.header.frame_id.size() + t.child_frame_id.size() + 128;
  Encoder out(most);
  out.value(uint32_t(transforms.size()));
  for (const RosTransform& transform : transforms) {
    out.header(transform.header);
    out.text(transform.child_frame_id);
    out.pose(transform.pose);
  }
  return out.take();
}

std::vector<RosTransform> decode_transforms(std::string_view bytes) {
  return decode(bytes, kTransformsName, [](Decoder& in) {
    std::vector<RosTransform> transforms(in.count(72));
    for (RosTransform& transform : transforms) {
      transform.header = in.header();
      transform.child_frame_id = in.text();
      transform.pose = in.pose();
    }
    return transforms;
  });
}

}  // namespace overtake::io
