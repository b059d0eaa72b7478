// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/view/mcap_view.h"

#include <cmath>
#include <cstring>

#include "tools/client/result_files.h"
#include "tools/client/session.h"
#include "tools/io/angles.h"
#include "tools/io/image.h"
#include "tools/io/map_file.h"
#include "tools/io/output.h"
#include "tools/view/foxglove_scene.h"
#include "tools/view/mcap_numbers.h"

namespace overtake::cli {
namespace {

using foxglove::PackedElementField;

constexpr const char* kMapFrame = "map";
constexpr const char* kVehicleFrame = "vehicle";

const char* frame_of(const ovt_frame_info& info) {
  return info.reference == OVT_REFERENCE_MAP ? kMapFrame : kVehicleFrame;
}

template <class T>
void store(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

foxglove::FrameTransform make_transform(int64_t stamp_ns, const char* parent, const std::string& child) {
  foxglove::FrameTransform transform;
  set_stamp(*transform.mutable_timestamp(), stamp_ns);
  transform.set_parent_frame_id(parent);
  transform.set_child_frame_id(child);
  return transform;
}

}  // namespace

McapView::McapView(const std::string& path, const Config& config)
    : config_(config), log_(path, [] {
        io::McapOptions options;
        options.profile = "";
        return options;
      }()) {
  if (!config.map.empty()) io::read_map(config.map);  // report an unreadable map before any work
}

uint16_t McapView::channel(const std::string& topic, const std::string& schema) {
  const auto known = channels_.find(topic);
  if (known != channels_.end()) return known->second;
  const bool numbers = !schema.starts_with("foxglove.");
  const uint16_t id = numbers ? log_.add_schema(schema, "jsonschema", number_schema(schema))
                              : log_.add_schema(schema, "protobuf", descriptor_of(schema));
  return channels_[topic] = log_.add_channel(id, topic, numbers ? "json" : "protobuf");
}

void McapView::add(ovt_reader* reader) {
  ovt_frame_info info;
  ovt_detections detections;
  ovt_tracks tracks;
  check(ovt_read_info(reader, &info), "frame");
  check(ovt_read_detections(reader, &detections), "detections");
  check(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks), "tracks");
  last_ns_ = std::max(last_ns_, info.stamp_ns);
  if (info.stamp_ns < 0) return;  // MCAP has no time before 1970
  if (!map_written_) add_map(info.stamp_ns);
  map_written_ = true;
  add_transforms(info);
  add_clouds(reader, info);
  add_detections(info, detections);
  add_tracks(info, tracks);
  add_times(reader, info);
}

void McapView::add_transforms(const ovt_frame_info& info) {
  const uint16_t tf = channel("/tf", "foxglove.FrameTransform");
  if (info.ego_known) {
    auto ego = make_transform(info.stamp_ns, kMapFrame, kVehicleFrame);
    set_vector(*ego.mutable_translation(), info.ego_x_m, info.ego_y_m, 0);
    set_rotation(*ego.mutable_rotation(), 0, 0, info.ego_yaw_rad);
    log_.write(tf, info.stamp_ns, ego.SerializeAsString());
  }
  for (const io::RigSensor& sensor : config_.rig.sensors) {
    auto mounting = make_transform(info.stamp_ns, kVehicleFrame, sensor.name);
    set_vector(*mounting.mutable_translation(), sensor.x_m, sensor.y_m, sensor.z_m);
    set_rotation(*mounting.mutable_rotation(), io::rad(sensor.roll_deg), io::rad(sensor.pitch_deg),
                 io::rad(sensor.yaw_deg));
    log_.write(tf, info.stamp_ns, mounting.SerializeAsString());
  }
}

void McapView::add_clouds(ovt_reader* reader, const ovt_frame_info& info) {
  constexpr struct {
    const char* name;
    uint32_t offset;
    PackedElementField::NumericType type;
  } kFields[] = {{"x", 0, PackedElementField::FLOAT32},      {"y", 4, PackedElementField::FLOAT32},
                 {"z", 8, PackedElementField::FLOAT32},      {"intensity", 12, PackedElementField::FLOAT32},
                 {"layer", 16, PackedElementField::INT32},   {"label", 20, PackedElementField::INT32},
                 {"cluster", 24, PackedElementField::INT32}, {"reason", 28, PackedElementField::UINT8}};
  constexpr std::size_t kStride = 29;
  for (int32_t s = 0; s < int32_t(config_.rig.sensors.size()); ++s) {
    ovt_labels labels;
    if (ovt_read_labels(reader, s, &labels) != OVT_OK) continue;  // not in this frame
    const std::string& name = config_.rig.sensors[std::size_t(s)].name;
    foxglove::PointCloud cloud;
    set_stamp(*cloud.mutable_timestamp(), labels.stamp_ns);
    cloud.set_frame_id(name);
    set_vector(*cloud.mutable_pose()->mutable_position(), 0, 0, 0);
    set_rotation(*cloud.mutable_pose()->mutable_orientation(), 0, 0, 0);
    cloud.set_point_stride(kStride);
    for (const auto& field : kFields) {
      PackedElementField& packed = *cloud.add_fields();
      packed.set_name(field.name);
      packed.set_offset(field.offset);
      packed.set_type(field.type);
    }
    std::string& data = *cloud.mutable_data();
    data.resize(kStride * std::size_t(labels.count));
    for (int32_t i = 0; i < labels.count; ++i) {
      const std::size_t at = kStride * std::size_t(i);
      const int32_t label = labels.label[i];
      store(data, at, labels.x_m[i]);
      store(data, at + 4, labels.y_m[i]);
      store(data, at + 8, labels.z_m[i]);
      store(data, at + 12, labels.intensity[i]);
      store(data, at + 16, labels.layer[i]);
      store(data, at + 20, label);
      store(data, at + 24, label < 0 ? -1 : labels.cluster_of_label[label]);
      store(data, at + 28, labels.reason[i]);
    }
    log_.write(channel("/" + name + "/points", "foxglove.PointCloud"), info.stamp_ns, cloud.SerializeAsString());
    add_images(reader, s, info.stamp_ns);
  }
}

void McapView::add_images(ovt_reader* reader, int32_t sensor, int64_t stamp_ns) {
  const std::string& name = config_.rig.sensors[std::size_t(sensor)].name;
  for (const ovt_image_id id : {OVT_IMAGE_RANGE, OVT_IMAGE_ANGLE_SMOOTH, OVT_IMAGE_HEIGHT, OVT_IMAGE_NONGROUND,
                                OVT_IMAGE_RANGE_REPAIRED, OVT_IMAGE_LABELS}) {
    ovt_image image;
    if (ovt_read_image(reader, sensor, id, &image) != OVT_OK) continue;
    const std::size_t rows = std::size_t(image.rows), cols = std::size_t(image.cols);
    foxglove::RawImage raw;
    set_stamp(*raw.mutable_timestamp(), stamp_ns);
    raw.set_frame_id(name);
    raw.set_width(uint32_t(cols));
    raw.set_height(uint32_t(rows));
    const std::size_t pixel = image.type == OVT_IMAGE_F32 ? 4 : image.type == OVT_IMAGE_I32 ? 3 : 1;
    raw.set_encoding(image.type == OVT_IMAGE_F32 ? "32FC1" : image.type == OVT_IMAGE_I32 ? "rgb8" : "mono8");
    raw.set_step(uint32_t(cols * pixel));
    std::string& data = *raw.mutable_data();
    data.resize(rows * cols * pixel);
    for (std::size_t r = 0; r < rows; ++r) {
      const char* row = static_cast<const char*>(image.data) + r * image.stride_bytes;
      char* out = data.data() + r * cols * pixel;
      if (image.type == OVT_IMAGE_F32) std::memcpy(out, row, cols * 4);
      for (std::size_t c = 0; c < cols && image.type == OVT_IMAGE_BITS; ++c)
        out[c] = reinterpret_cast<const uint64_t*>(row)[c / 64] >> (c % 64) & 1 ? char(-1) : char(0);
      for (std::size_t c = 0; c < cols && image.type == OVT_IMAGE_I32; ++c) {
        const int32_t label = reinterpret_cast<const int32_t*>(row)[c];
        const io::Rgb color = label < 0 ? io::Rgb{0, 0, 0} : io::label_color(label);
        std::memcpy(out + 3 * c, color.data(), 3);
      }
    }
    log_.write(channel("/" + name + "/image/" + ovt_image_name(id), "foxglove.RawImage"), stamp_ns,
               raw.SerializeAsString());
  }
}

void McapView::add_detections(const ovt_frame_info& info, const ovt_detections& d) {
  foxglove::SceneUpdate update;
  delete_all(update, info.stamp_ns);
  for (int32_t i = 0; i < d.count; ++i) {
    auto& entity = add_entity(update, d.stamp_ns[i], kVehicleFrame, "detection " + std::to_string(i));
    const double x = double(d.x_m[i]), y = double(d.y_m[i]), z = double(d.z_m[i]);
    add_cube(entity, {x, y, z}, double(d.heading_rad[i]), config_.params.vehicle_length_m,
             config_.params.vehicle_width_m, 1.0, {0.2, 0.6, 1.0, 0.4});
    add_arrow(entity, {double(d.ref_x_m[i]), double(d.ref_y_m[i]), z + 0.6}, double(d.heading_ref_rad[i]),
              {1.0, 1.0, 1.0, d.heading_source[i] == 0 ? 1.0 : 0.3});
    add_arrow(entity, {double(d.var_x_m[i]), double(d.var_y_m[i]), z + 0.6}, double(d.heading_var_rad[i]),
              {1.0, 0.6, 0.1, d.heading_source[i] == 1 ? 1.0 : 0.3});
  }
  log_.write(channel("/detections", "foxglove.SceneUpdate"), info.stamp_ns, update.SerializeAsString());
  log_.write(channel("/detections/numbers", "overtake.Detections"), info.stamp_ns, format_detections(info, d));
}

void McapView::add_tracks(const ovt_frame_info& info, const ovt_tracks& t) {
  foxglove::SceneUpdate update;
  delete_all(update, info.stamp_ns);
  for (int32_t i = 0; i < t.count; ++i) {
    const bool confirmed = t.state[i] == OVT_CONFIRMED;
    const SceneColor color = confirmed ? SceneColor{0.1, 0.9, 0.2, 0.6} : SceneColor{0.6, 0.6, 0.6, 0.3};
    auto& entity = add_entity(update, t.publish_ns, frame_of(info), "track " + std::to_string(t.id[i]));
    add_cube(entity, {t.x_m[i], t.y_m[i], 0.6}, t.heading_rad[i], config_.params.vehicle_length_m,
             config_.params.vehicle_width_m, 1.2, color);
    add_ellipse(entity, t.x_m[i], t.y_m[i], t.covariance[0][i], t.covariance[1][i], t.covariance[2][i], color);
    std::vector<ScenePoint> path = {{t.x_m[i], t.y_m[i], 0.1}};
    for (int32_t k = 0; k < t.path_points; ++k) {
      const auto at = std::size_t(i) * std::size_t(t.path_points) + std::size_t(k);
      path.push_back({t.path_x_m[at], t.path_y_m[at], 0.1});
    }
    add_line(entity, path, false, color);
    char text[64];
    std::snprintf(text, sizeof text, "%.1f m/s", t.speed_mps[i]);
    if (confirmed) add_text(entity, {t.x_m[i], t.y_m[i], 2.0}, text);
  }
  log_.write(channel("/tracks", "foxglove.SceneUpdate"), info.stamp_ns, update.SerializeAsString());
  log_.write(channel("/tracks/numbers", "overtake.Tracks"), info.stamp_ns, format_tracks(info, t));
}

void McapView::add_map(int64_t stamp_ns) {
  if (config_.map.empty()) return;
  const io::MapData map = io::read_map(config_.map);
  foxglove::SceneUpdate update;
  auto& entity = add_entity(update, stamp_ns, kMapFrame, "map");
  const auto zip = [](const std::vector<double>& x, const std::vector<double>& y) {
    std::vector<ScenePoint> points;
    for (std::size_t i = 0; i < x.size(); ++i) points.push_back({x[i], y[i], 0});
    return points;
  };
  if (map.is_bounds()) {
    add_line(entity, zip(map.left_x_m, map.left_y_m), map.closed, {1, 1, 1, 1});
    add_line(entity, zip(map.right_x_m, map.right_y_m), map.closed, {1, 1, 1, 1});
  } else {
    std::vector<ScenePoint> left, right;
    const std::size_t count = map.x_m.size();
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t a = i > 0 ? i - 1 : map.closed ? count - 1 : i, b = i + 1 < count ? i + 1 : map.closed ? 0 : i;
      const double dx = map.x_m[b] - map.x_m[a], dy = map.y_m[b] - map.y_m[a];
      const double norm = std::max(1e-9, std::hypot(dx, dy));
      const double nx = -dy / norm, ny = dx / norm;  // to the left
      left.push_back({map.x_m[i] + nx * map.width_left_m[i], map.y_m[i] + ny * map.width_left_m[i], 0});
      right.push_back({map.x_m[i] - nx * map.width_right_m[i], map.y_m[i] - ny * map.width_right_m[i], 0});
    }
    add_line(entity, zip(map.x_m, map.y_m), map.closed, {1, 1, 0, 0.6});
    add_line(entity, left, map.closed, {1, 1, 1, 1});
    add_line(entity, right, map.closed, {1, 1, 1, 1});
  }
  log_.write(channel("/map", "foxglove.SceneUpdate"), stamp_ns, update.SerializeAsString());
}

void McapView::add_times(ovt_reader* reader, const ovt_frame_info& info) {
  log_.write(channel("/times", "overtake.Times"), info.stamp_ns, format_times(reader, info, config_.rig));
}

void McapView::add_counters(int64_t stamp_ns, const ovt_stats& stats) {
  if (stamp_ns < 0) return;
  log_.write(channel("/counters", "overtake.Counters"), stamp_ns, format_counters(stats));
}

void McapView::close(const std::string& partial) {
  log_.add_attachment("config.toml", "application/toml", format_config(config_), std::max<int64_t>(0, last_ns_));
  ovt_build_info build;
  ovt_read_build_info(&build);
  log_.add_metadata("overtake", {{"version", build.version_text}, {"commit", build.commit}, {"input", config_.input}});
  if (!partial.empty()) log_.add_metadata(io::kPartialMetadata, {{"reason", partial}});
  log_.close();
}

}  // namespace overtake::cli
