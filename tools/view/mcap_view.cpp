// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/view/mcap_view.h"

#include <algorithm>
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

McapView::McapView(const Config& config, std::vector<ViewSink*> sinks)
    : config_(config),
      sinks_(std::move(sinks)),
      frames_(config.rig),
      keeps_frames_(std::any_of(sinks_.begin(), sinks_.end(), [](const ViewSink* s) { return s->keeps_frames(); })) {
  if (!config.map.empty()) map_ = io::read_map(config.map);
}

uint16_t McapView::wanted(const std::string& topic, const std::string& schema, ViewKind kind, bool once) {
  uint16_t& id = channels_[topic];
  if (id == 0) {
    id = uint16_t(channels_.size());
    const bool numbers = !schema.starts_with("foxglove.");
    const ViewChannel channel{id,
                              topic,
                              numbers ? "json" : "protobuf",
                              schema,
                              numbers ? "jsonschema" : "protobuf",
                              numbers ? number_schema(schema) : descriptor_of(schema),
                              kind,
                              once};
    for (ViewSink* sink : sinks_) sink->add_channel(channel);
  }
  const bool any = std::any_of(sinks_.begin(), sinks_.end(), [id](const ViewSink* sink) { return sink->wants(id); });
  return any ? id : 0;
}

void McapView::write(uint16_t channel, int64_t stamp_ns, const std::string& data) {
  for (ViewSink* sink : sinks_)
    if (sink->wants(channel)) sink->write(channel, stamp_ns, data);
}

void McapView::add(ovt_reader* reader, const ViewFrame& frame) {
  ovt_frame_info info;
  ovt_detections detections;
  ovt_tracks tracks;
  check(ovt_read_info(reader, &info), "frame");
  check(ovt_read_detections(reader, &detections), "detections");
  check(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks), "tracks");
  last_ns_ = std::max(last_ns_, info.stamp_ns);
  if (info.stamp_ns < 0) return;  // MCAP has no time before 1970
  for (ViewSink* sink : sinks_) sink->begin_frame();
  if (keeps_frames_) frames_.add(reader, frame.number, info, tracks);
  add_map(info.stamp_ns);
  add_transforms(info);
  add_clouds(reader, info);
  add_detections(info, detections);
  add_tracks(info, tracks);
  add_truth(info, frame);
  if (const uint16_t times = wanted("/times", "overtake.Times"))
    write(times, info.stamp_ns, format_times(reader, info, config_.rig));
  for (ViewSink* sink : sinks_) sink->end_frame();
}

void McapView::add_transforms(const ovt_frame_info& info) {
  const uint16_t tf = wanted("/tf", "foxglove.FrameTransform");
  if (tf == 0) return;
  if (info.ego_known) {
    auto ego = make_transform(info.stamp_ns, kMapFrame, kVehicleFrame);
    set_vector(*ego.mutable_translation(), info.ego_x_m, info.ego_y_m, 0);
    set_rotation(*ego.mutable_rotation(), 0, 0, cli::vehicle_yaw_rad(info));
    write(tf, info.stamp_ns, ego.SerializeAsString());
  }
  for (const io::RigSensor& sensor : config_.rig.sensors) {
    auto mounting = make_transform(info.stamp_ns, kVehicleFrame, sensor.name);
    set_vector(*mounting.mutable_translation(), sensor.x_m, sensor.y_m, sensor.z_m);
    set_rotation(*mounting.mutable_rotation(), io::rad(sensor.roll_deg), io::rad(sensor.pitch_deg),
                 io::rad(sensor.yaw_deg));
    write(tf, info.stamp_ns, mounting.SerializeAsString());
  }
}

namespace {

// Each value lies on a multiple of its size, so that a reader takes it in place.
constexpr struct {
  const char* name;
  uint32_t offset;
  PackedElementField::NumericType type;
} kPointFields[] = {{"x", 0, PackedElementField::FLOAT32},    {"y", 4, PackedElementField::FLOAT32},
                    {"z", 8, PackedElementField::FLOAT32},    {"intensity", 12, PackedElementField::FLOAT32},
                    {"label", 16, PackedElementField::INT32}, {"cluster", 20, PackedElementField::INT32},
                    {"layer", 24, PackedElementField::INT32}, {"reason", 28, PackedElementField::UINT8}};
constexpr std::size_t kPointStride = 32;

std::string encode_cloud(const std::string& sensor, const ovt_labels& labels) {
  foxglove::PointCloud cloud;
  set_stamp(*cloud.mutable_timestamp(), labels.stamp_ns);
  cloud.set_frame_id(sensor);
  set_vector(*cloud.mutable_pose()->mutable_position(), 0, 0, 0);
  set_rotation(*cloud.mutable_pose()->mutable_orientation(), 0, 0, 0);
  cloud.set_point_stride(kPointStride);
  for (const auto& field : kPointFields) {
    PackedElementField& packed = *cloud.add_fields();
    packed.set_name(field.name);
    packed.set_offset(field.offset);
    packed.set_type(field.type);
  }
  std::string& data = *cloud.mutable_data();
  data.resize(kPointStride * std::size_t(labels.count));
  for (int32_t i = 0; i < labels.count; ++i) {
    const std::size_t at = kPointStride * std::size_t(i);
    const int32_t label = labels.label[i];
    store(data, at, labels.x_m[i]);
    store(data, at + 4, labels.y_m[i]);
    store(data, at + 8, labels.z_m[i]);
    store(data, at + 12, labels.intensity[i]);
    store(data, at + 16, label);
    store(data, at + 20, label < 0 ? -1 : labels.cluster_of_label[label]);
    store(data, at + 24, labels.layer[i]);
    store(data, at + 28, labels.reason[i]);
  }
  return cloud.SerializeAsString();
}

std::string encode_image(const std::string& sensor, const ovt_image& image, int64_t stamp_ns) {
  const std::size_t rows = std::size_t(image.rows), cols = std::size_t(image.cols);
  foxglove::RawImage raw;
  set_stamp(*raw.mutable_timestamp(), stamp_ns);
  raw.set_frame_id(sensor);
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
      const io::Rgb color = io::label_color(reinterpret_cast<const int32_t*>(row)[c]);
      std::memcpy(out + 3 * c, color.data(), 3);
    }
  }
  return raw.SerializeAsString();
}

}  // namespace

void McapView::add_clouds(ovt_reader* reader, const ovt_frame_info& info) {
  for (int32_t s = 0; s < int32_t(config_.rig.sensors.size()); ++s) {
    ovt_labels labels;
    if (ovt_read_labels(reader, s, &labels) != OVT_OK) continue;  // not in this frame
    const std::string& name = config_.rig.sensors[std::size_t(s)].name;
    if (const uint16_t cloud = wanted("/" + name + "/points", "foxglove.PointCloud", ViewKind::kCloud))
      write(cloud, info.stamp_ns, encode_cloud(name, labels));
    add_images(reader, s, info.stamp_ns);
  }
}

void McapView::add_images(ovt_reader* reader, int32_t sensor, int64_t stamp_ns) {
  const std::string& name = config_.rig.sensors[std::size_t(sensor)].name;
  for (const ovt_image_id id : {OVT_IMAGE_RANGE, OVT_IMAGE_ANGLE_SMOOTH, OVT_IMAGE_HEIGHT, OVT_IMAGE_NONGROUND,
                                OVT_IMAGE_RANGE_REPAIRED, OVT_IMAGE_LABELS}) {
    ovt_image image;
    if (ovt_read_image(reader, sensor, id, &image) != OVT_OK) continue;
    const ViewKind kind = id == OVT_IMAGE_LABELS ? ViewKind::kLabelImage : ViewKind::kImage;
    if (const uint16_t channel = wanted("/" + name + "/image/" + ovt_image_name(id), "foxglove.RawImage", kind))
      write(channel, stamp_ns, encode_image(name, image, stamp_ns));
  }
}

void McapView::add_detections(const ovt_frame_info& info, const ovt_detections& d) {
  if (const uint16_t numbers = wanted("/detections/numbers", "overtake.Detections"))
    write(numbers, info.stamp_ns, format_detections(info, d));
  const uint16_t scene = wanted("/detections", "foxglove.SceneUpdate");
  if (scene == 0) return;
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
  write(scene, info.stamp_ns, update.SerializeAsString());
}

void McapView::add_tracks(const ovt_frame_info& info, const ovt_tracks& t) {
  if (const uint16_t numbers = wanted("/tracks/numbers", "overtake.Tracks"))
    write(numbers, info.stamp_ns, format_tracks(info, t));
  const uint16_t scene = wanted("/tracks", "foxglove.SceneUpdate");
  if (scene == 0) return;
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
  write(scene, info.stamp_ns, update.SerializeAsString());
}

void McapView::add_map(int64_t stamp_ns) {
  if (config_.map.empty()) return;
  const uint16_t scene = wanted("/map", "foxglove.SceneUpdate", ViewKind::kNumbers, true);
  if (scene == 0) return;
  const io::MapData& map = map_;
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
  write(scene, stamp_ns, update.SerializeAsString());
}

// The other cars' true states; a position relative to the own car goes to the map where the own pose is known.
void McapView::add_truth(const ovt_frame_info& info, const ViewFrame& frame) {
  if (frame.cars.empty() && !frame.opponent) return;
  const uint16_t truth = wanted("/truth", "overtake.Truth");
  if (truth == 0) return;
  if (!frame.cars.empty()) {
    write(truth, info.stamp_ns, format_truth(info.stamp_ns, true, frame.cars));
    return;
  }
  const io::Box& box = *frame.opponent;
  io::KnownCar car{1, "opponent", box.x_m, box.y_m, box.z_m, box.yaw_rad, NAN, box.length_m, box.width_m};
  if (info.ego_known) {
    // Its box is by the pushed pose (io::BagStream), so by this pose it goes back to its place on the map.
    const double c = std::cos(info.ego_yaw_rad), s = std::sin(info.ego_yaw_rad);
    car.x_m = info.ego_x_m + box.x_m * c - box.y_m * s;
    car.y_m = info.ego_y_m + box.x_m * s + box.y_m * c;
    car.heading_rad = io::wrap_angle(box.yaw_rad + info.ego_yaw_rad);
  }
  write(truth, info.stamp_ns, format_truth(info.stamp_ns, info.ego_known != 0, {car}));
}

void McapView::add_counters(int64_t stamp_ns, const ovt_stats& stats) {
  if (stamp_ns < 0) return;
  if (const uint16_t counters = wanted("/counters", "overtake.Counters"))
    write(counters, stamp_ns, format_counters(stats));
}

void McapView::close(McapFile& file, const std::string& partial) const {
  io::McapWriter& log = file.log();
  const int64_t end_ns = std::max<int64_t>(0, last_ns_);
  log.add_attachment("frames", "application/json", frames_.format(), end_ns);
  log.add_attachment("config.toml", "application/toml", format_config(config_), end_ns);
  ovt_build_info build;
  ovt_read_build_info(&build);
  log.add_metadata("overtake", {{"version", build.version_text}, {"commit", build.commit}, {"input", config_.input}});
  if (!partial.empty()) log.add_metadata(io::kPartialMetadata, {{"reason", partial}});
  log.close();
}

}  // namespace overtake::cli
