// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake inspect: every image of one sensor's scan as NPY and PNG, and the label and reason of every input point.
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/client/console.h"
#include "tools/client/session.h"
#include "tools/io/error.h"
#include "tools/io/npy.h"
#include "tools/io/scan_stream.h"
#include "tools/io/text.h"
#include "tools/io/words.h"
#include "tools/view/scan_picture.h"
#include "tools/view/views.h"

namespace overtake::cli {
namespace {

struct InspectOptions : Options {
  std::string sensor;
  int64_t frame = -1;
};

int32_t choose_sensor(const io::Rig& rig, const std::string& name) {
  if (name.empty() && rig.sensors.size() == 1) return 0;
  if (name.empty()) throw io::Error("", 0, "--sensor is needed: " + rig.sensor_names());
  const int32_t sensor = rig.find(name);
  if (sensor < 0) {
    std::vector<std::string> names;
    for (const io::RigSensor& known : rig.sensors) names.push_back(known.name);
    throw io::Error("--sensor " + name, 0,
                    "rig " + rig.name + " has " + rig.sensor_names() + io::did_you_mean(name, names));
  }
  return sensor;
}

io::FrameScans choose_frame(const std::string& input, const io::Rig& rig, int64_t wanted) {
  const auto stream = io::open_scans(input, rig);
  io::FrameScans frame, first;
  int64_t count = 0, last = 0;
  while (stream->next(frame)) {
    if (wanted >= 0 && frame.frame == wanted) return frame;
    last = frame.frame;
    if (count++ == 0) first = std::move(frame);
    if (wanted < 0 && count > 1) break;
  }
  if (count == 0)
    throw io::Error(input, 0, "holds no scan" + (stream->damage().empty() ? "" : ": " + stream->damage()));
  if (wanted < 0 && count == 1) return first;
  if (wanted < 0)
    throw io::Error("", 0, "--frame is needed: " + input + " has several, from " + std::to_string(first.frame) + " on");
  throw io::Error("--frame " + std::to_string(wanted), 0,
                  input + " has no such frame (there are " + std::to_string(first.frame) + " to " +
                      std::to_string(last) + ")" + (stream->lost_count() > 0 ? "; " + stream->losses() : ""));
}

// The range image that defines which pixels of image `id` are returns: that of its stage, else any available one.
DenseImage returns_of(const std::map<int32_t, DenseImage>& images, int32_t id) {
  const int32_t own = id == OVT_IMAGE_ELEVATION_FILLED || id == OVT_IMAGE_HEIGHT ? OVT_IMAGE_RANGE_FILLED
                      : id == OVT_IMAGE_ELEVATION_REPAIRED                       ? OVT_IMAGE_RANGE_REPAIRED
                                                                                 : OVT_IMAGE_RANGE;
  for (const int32_t range : {own, int32_t(OVT_IMAGE_RANGE), int32_t(OVT_IMAGE_RANGE_FILLED)})
    if (const auto known = images.find(range); known != images.end()) return known->second;
  DenseImage all = images.at(id);
  all.real.assign(std::size_t(all.rows) * std::size_t(all.cols), 1.0f);
  return all;
}

void write_image(const std::string& folder, const DenseImage& image, const DenseImage& returns) {
  const std::string path = folder + "/" + image.name;
  const std::vector<int64_t> shape = {image.rows, image.cols};
  if (image.is_float)
    io::write_npy(path + ".npy", image.real.data(), shape);
  else if (!image.is_bits)
    io::write_npy(path + ".npy", image.integer.data(), shape);
  else
    io::write_npy(path + ".npy", std::vector<uint8_t>(image.integer.begin(), image.integer.end()).data(), shape);
  io::write_png(path + ".png", draw_image(image, returns));
}

std::vector<std::string> reason_names() {
  std::vector<std::string> names;
  for (int32_t i = 0; ovt_reason_name(i); ++i) names.emplace_back(ovt_reason_name(i));
  return names;
}

std::string format_reasons(const std::vector<std::string>& names) {
  nlohmann::ordered_json json;
  for (std::size_t i = 0; i < names.size(); ++i) json[std::to_string(i)] = names[i];
  return json.dump(2) + "\n";
}

// Labels and reasons in the order of the input file. In a shared cloud, points whose layer belongs to another sensor
// have no label here.
struct PointResult {
  std::vector<int32_t> label;
  std::vector<uint8_t> reason;
};
PointResult spread_points(const ovt_labels& labels, const io::SensorScan& scan,
                          const std::vector<std::string>& reasons) {
  uint8_t bad_layer = 0;
  for (std::size_t i = 0; i < reasons.size(); ++i)
    if (reasons[i] == "bad_layer") bad_layer = uint8_t(i);
  PointResult out{std::vector<int32_t>(std::size_t(scan.input_count), -1),
                  std::vector<uint8_t>(std::size_t(scan.input_count), bad_layer)};
  for (int32_t i = 0; i < labels.count; ++i) {
    const std::size_t row = std::size_t(scan.input_index.empty() ? i : scan.input_index[std::size_t(i)]);
    out.label[row] = labels.label[i];
    out.reason[row] = labels.reason[i];
  }
  return out;
}

void write_points(const std::string& folder, const PointResult& points, const ovt_labels& labels) {
  const std::vector<int64_t> shape = {int64_t(points.label.size())};
  io::write_npy(folder + "/point_label.npy", points.label.data(), shape);
  io::write_npy(folder + "/point_reason.npy", points.reason.data(), shape);
  std::vector<io::Rgb> by_label, by_reason;
  for (int32_t i = 0; i < labels.count; ++i) {
    by_label.push_back(labels.label[i] < 0 ? io::Rgb{90, 0, 0} : io::label_color(labels.label[i]));
    by_reason.push_back(labels.reason[i] == 0 ? io::Rgb{60, 60, 60} : io::label_color(labels.reason[i]));
  }
  io::write_png(folder + "/point_label.png",
                draw_top_view(labels.x_m, labels.y_m, by_label, 80, "labels, sensor frame"));
  io::write_png(folder + "/point_reason.png",
                draw_top_view(labels.x_m, labels.y_m, by_reason, 80, "points without a label, sensor frame"));
}

// Draws the raw scan.
void write_scan_images(const std::string& folder, const io::SensorScan& scan, const std::string& caption) {
  std::vector<float> x, y, z;
  for (std::size_t i = 0; i < std::size_t(scan.count); ++i) {
    x.push_back(float(scan.x.value(i)));
    y.push_back(float(scan.y.value(i)));
    z.push_back(float(scan.z.value(i)));
  }
  io::write_png(folder + "/scan.png", draw_scan({x.data(), y.data(), z.data(), x.size(), nullptr}, caption));
}

// The images of preset `paper` that the preset's method does not compute.
std::string absent_images(const std::map<int32_t, DenseImage>& images) {
  std::vector<std::string> names;
  for (int32_t id = 0; id < OVT_IMAGE_COUNT; ++id)
    if (id != OVT_IMAGE_HEIGHT && !images.contains(id)) names.emplace_back(ovt_image_name(id));
  return io::join(names, ", ");
}

void print_summary(const Options& options, const io::SensorScan& scan, const ovt_labels& labels,
                   const PointResult& points, const std::vector<std::string>& reasons) {
  std::map<uint8_t, int64_t> counts;
  int64_t ground = 0;
  for (std::size_t i = 0; i < points.reason.size(); ++i) {
    ++counts[points.reason[i]];
    ground += points.label[i] == 0;
  }
  std::printf("%s: %s, %lld ground, %lld in %s\n", printable(scan.path).c_str(),
              io::counted(scan.input_count, "point").c_str(), static_cast<long long>(ground),
              static_cast<long long>(counts[0] - ground), io::counted(labels.label_count, "cluster").c_str());
  for (const auto& [reason, count] : counts)
    if (reason > 0) std::printf("  %lld without a label: %s\n", static_cast<long long>(count), reasons[reason].c_str());
  std::printf(
      "Written to %s: every image as .npy and .png, strip.png with four of them, scan.png,\n"
      "point_label.npy, point_reason.npy, reasons.json, config.toml\n",
      options.out.c_str());
}

int inspect(const InspectOptions& options) {
  const Config config = load_config_with_rig(options);
  const int32_t sensor = choose_sensor(config.rig, options.sensor);
  io::FrameScans frame = choose_frame(config.input, config.rig, options.frame);
  std::erase_if(frame.scans, [sensor](const io::SensorScan& scan) { return scan.sensor != sensor; });
  if (frame.scans.empty())
    throw io::Error(config.input, 0,
                    "frame " + std::to_string(frame.frame) + " has no scan of sensor '" + options.sensor + "'");

  Session session(config, nullptr, nullptr);
  session.push(frame);
  session.flush();
  ovt_reader* reader = nullptr;
  check(ovt_create_reader(session.detector(), &reader), "reader");
  const std::unique_ptr<ovt_reader, decltype(&ovt_destroy_reader)> owner(reader, &ovt_destroy_reader);
  ovt_frame_info info;
  check(ovt_next_frame(reader, &info), frame.scans[0].path);

  io::OutputGuard guard(options.force);
  add_inputs(guard, options, config);
  guard.add_folder(options.out);
  std::map<int32_t, DenseImage> images = read_images(reader, sensor);
  if (const auto owner_image = images.find(OVT_IMAGE_PIXEL_POINT);
      owner_image != images.end() && !frame.scans[0].input_index.empty())
    for (int32_t& point : owner_image->second.integer)
      if (point >= 0) point = frame.scans[0].input_index[std::size_t(point)];  // rows of the input file
  for (const auto& [id, image] : images) write_image(options.out, image, returns_of(images, id));
  std::vector<io::Picture> strip;  // four stages of one scan; ground removal by angles or by height
  for (int32_t id :
       {OVT_IMAGE_RANGE, OVT_IMAGE_ANGLE_SMOOTH, OVT_IMAGE_HEIGHT, OVT_IMAGE_RANGE_REPAIRED, OVT_IMAGE_LABELS})
    if (images.contains(id)) strip.push_back(draw_image(images.at(id), returns_of(images, id)));
  io::write_png(options.out + "/strip.png", stack_pictures(strip));

  ovt_labels labels;
  check(ovt_read_labels(reader, sensor, &labels), "labels");
  const auto reasons = reason_names();
  const PointResult points = spread_points(labels, frame.scans[0], reasons);
  write_points(options.out, points, labels);
  write_scan_images(options.out, frame.scans[0],
                    "frame " + std::to_string(frame.frame) + " " + config.rig.sensors[std::size_t(sensor)].name);
  io::write_whole_file(options.out + "/reasons.json", format_reasons(reasons));
  io::write_whole_file(options.out + "/config.toml", format_config(config));
  for (int32_t id = 0; id < OVT_IMAGE_COUNT; ++id)  // images of another preset
    for (const char* ending : {".npy", ".png"}) guard.remove_leftovers(options.out, ovt_image_name(id), ending);
  guard.commit();
  if (!options.quiet) print_summary(options, frame.scans[0], labels, points, reasons);
  if (const std::string absent = absent_images(images); !options.quiet && !absent.empty())
    std::printf("note: preset %s does not compute %s\n", config.preset.c_str(), absent.c_str());
  return 0;
}

void add_inspect_options(CLI::App& command, InspectOptions& options) {
  options.command = "inspect";
  add_detector_options(command, options);
  add_common_options(command, options);
  command
      .add_option(
          "--frame", options.frame,
          "the number in the scan's file name, or the place in a recording with topics, from 0 (optional for one "
          "frame)")
      ->check(CLI::Range(int64_t(0), INT64_MAX));
  command.add_option("--sensor", options.sensor, "sensor of the rig (optional for one sensor)");
}

}  // namespace

Command inspect_command() {
  return make_command("inspect", "writes every image of one scan as NPY and PNG", kListed, add_inspect_options,
                      inspect);
}

}  // namespace overtake::cli
