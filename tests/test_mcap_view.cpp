// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The log of `overtake run --mcap`: layout of the points, which images are in it, the record of all frames against the
// tables, the truth, the colours of labels.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "foxglove.pb.h"
#include "pipeline/overtake.h"
#include "tests/support/run_command.h"
#include "tests/support/temp_folder.h"
#include "tools/io/csv.h"
#include "tools/io/image.h"
#include "tools/io/known_cars.h"
#include "tools/io/mcap_reader.h"
#include "tools/io/mcap_writer.h"
#include "tools/io/npy.h"
#include "tools/io/text.h"

using namespace overtake;

namespace {

using Json = nlohmann::json;

struct Message {
  int64_t log_ns;
  std::string data;
};

struct ViewLog {
  std::map<std::string, std::vector<Message>> topics;
  std::map<std::string, std::string> attachments;

  explicit ViewLog(const std::string& path) {
    io::McapReader reader(path);
    io::McapMessage message;
    while (reader.next(message))
      topics[reader.channels().at(message.channel_id).topic].push_back({message.log_ns, std::string(message.data)});
    REQUIRE(reader.damage() == "");
    for (const io::McapAttachment& attachment : reader.attachments()) attachments[attachment.name] = attachment.data;
  }
  bool has_image(const std::string& name) const { return topics.contains("/front/image/" + name); }
};

// A simulated log of half a second, run with --mcap.
struct ShortRun {
  TempFolder folder;
  std::string log = folder.path("race.mcap"), out = folder.path("run");

  ShortRun() {
    REQUIRE(run_overtake(folder, {"simulate", "demo", "--seconds", "0.5", "--out", log, "--quiet"}).code == 0);
  }
  ViewLog view(const std::vector<std::string>& options) const {
    std::vector<std::string> words = {"run",   log, "--quiet", "--force",
                                      "--out", out, "--mcap",  folder.path("view.mcap")};
    words.insert(words.end(), options.begin(), options.end());
    REQUIRE(run_overtake(folder, words).code == 0);
    return ViewLog(folder.path("view.mcap"));
  }
};

template <class T>
T value_at(const std::string& bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

}  // namespace

TEST_CASE("view log: values of a point lie on multiples of their size, 32 bytes a point") {
  const ShortRun run;
  const ViewLog view = run.view({});
  REQUIRE(view.topics.at("/front/points").size() == 10);
  foxglove::PointCloud cloud;
  REQUIRE(cloud.ParseFromString(view.topics.at("/front/points")[3].data));
  CHECK(cloud.point_stride() == 32);
  std::map<std::string, uint32_t> offsets;
  for (const foxglove::PackedElementField& field : cloud.fields()) {
    offsets[field.name()] = field.offset();
    if (field.type() != foxglove::PackedElementField::UINT8) CHECK(field.offset() % 4 == 0);
  }
  CHECK(offsets == std::map<std::string, uint32_t>{{"x", 0},
                                                   {"y", 4},
                                                   {"z", 8},
                                                   {"intensity", 12},
                                                   {"label", 16},
                                                   {"cluster", 20},
                                                   {"layer", 24},
                                                   {"reason", 28}});
  // The values are the scan's: x, y, z of the simulated cloud; a point with a label has reason 0.
  const std::size_t points = cloud.data().size() / 32;
  CHECK(points > 10000);
  int64_t labelled = 0;
  for (std::size_t i = 0; i < points; ++i) {
    const auto label = value_at<int32_t>(cloud.data(), 32 * i + 16);
    CHECK((label >= 0) == (value_at<uint8_t>(cloud.data(), 32 * i + 28) == 0));
    labelled += label > 0;
    const auto layer = value_at<int32_t>(cloud.data(), 32 * i + 24);
    CHECK(layer >= 0);
    CHECK(layer < 32);
  }
  CHECK(labelled > 100);
}

TEST_CASE("view log: --mcap-images selects the images, and no other topic") {
  const ShortRun run;
  const ViewLog all = run.view({}), labels = run.view({"--mcap-images", "labels"}),
                none = run.view({"--mcap-images", "none"});
  CHECK(all.topics.at("/map").size() == 1);
  CHECK(all.has_image("range"));
  CHECK(all.has_image("labels"));
  CHECK_FALSE(labels.has_image("range"));
  CHECK(labels.has_image("labels"));
  CHECK_FALSE(none.has_image("labels"));
  for (const auto& [topic, messages] : all.topics) {
    if (topic.find("/image/") != std::string::npos) continue;
    REQUIRE(none.topics.contains(topic));
    CHECK(none.topics.at(topic).size() == messages.size());
    if (topic != "/times" && topic != "/counters")
      for (std::size_t i = 0; i < messages.size(); ++i) CHECK(none.topics.at(topic)[i].data == messages[i].data);
  }
}

TEST_CASE("view log: the record of all frames has the numbers of the tables") {
  const ShortRun run;
  const ViewLog view = run.view({});
  const Json frames = Json::parse(view.attachments.at("frames"));
  const auto count = std::size_t(frames.at("count"));
  REQUIRE(count == 10);
  CHECK(frames.at("sensors") == Json({"front", "left", "right"}));
  CHECK(frames.at("period_us") == 50000);
  CHECK(frames.at("deadline_us").is_null());
  for (const char* key : {"stamp_ns", "frame", "frame_us", "latency_us", "points", "detections", "tracks", "confirmed",
                          "flags", "lost_scans"})
    CHECK_MESSAGE(frames.at(key).size() == count, key);
  const auto rows_of = [&](const char* file, int64_t frame) {
    const io::Csv csv = io::Csv::read(run.out + file);
    int64_t rows = 0;
    for (std::size_t i = 0; i < csv.row_count(); ++i) rows += csv.integer(i, csv.need({"frame"})) == frame;
    return rows;
  };
  const auto& times = view.topics.at("/times");
  int64_t tracks = 0;
  for (std::size_t i = 0; i < count; ++i) {
    CHECK(frames.at("frame")[i] == int64_t(i));
    CHECK(frames.at("stamp_ns")[i] == std::to_string(times[i].log_ns));
    CHECK(frames.at("detections")[i] == rows_of("/detections.csv", int64_t(i)));
    CHECK(frames.at("tracks")[i] == rows_of("/tracks.csv", int64_t(i)));
    CHECK(frames.at("lost_scans")[i] == 0);
    tracks += int64_t(frames.at("tracks")[i]);
    foxglove::PointCloud cloud;
    std::size_t points = 0;
    for (const char* topic : {"/front/points", "/left/points", "/right/points"}) {
      REQUIRE(cloud.ParseFromString(view.topics.at(topic)[i].data));
      points += cloud.data().size() / 32;
    }
    CHECK(frames.at("points")[i] == points);
  }
  CHECK(tracks > 0);
  // Each time of timing.csv is in its stage's column, rounded as README.md says.
  const io::Csv timing = io::Csv::read(run.out + "/timing.csv");
  std::map<std::pair<std::string, std::string>, Json> columns;
  for (const Json& stage : frames.at("stages")) columns[{stage.at("sensor"), stage.at("stage")}] = stage.at("us");
  std::size_t values = 0;
  for (std::size_t i = 0; i < timing.row_count(); ++i) {
    const Json& column = columns.at(
        {std::string(timing.text(i, timing.need({"sensor"}))), std::string(timing.text(i, timing.need({"stage"})))});
    const double us = timing.number(i, timing.need({"time_us"}));
    CHECK(std::fabs(double(column[std::size_t(timing.integer(i, timing.need({"frame"})))]) - us) <=
          (us < 99 ? 0.06 : 0.6));
    ++values;
  }
  std::size_t numbers = 0;
  for (const auto& [key, column] : columns)
    for (const Json& value : column) numbers += !value.is_null();
  CHECK(numbers == values);
  CHECK(frames.at("frame_us") == columns.at({"", "frame"}));
  CHECK(frames.at("flag_names").at("512") == "deadline_missed");
  CHECK(frames.at("reason_names")[0].is_string());
}

TEST_CASE("view log: a frame without a sensor counts its lost scan") {
  const ShortRun run;
  REQUIRE(
      run_overtake(run.folder, {"simulate", "demo", "--seconds", "0.3", "--out", run.folder.path("race"), "--quiet"})
          .code == 0);
  std::filesystem::remove(run.folder.path("race/000002_left.pcd"));
  REQUIRE(run_overtake(run.folder, {"run", run.folder.path("race"), "--quiet", "--out", run.folder.path("lost"),
                                    "--mcap", run.folder.path("lost.mcap")})
              .code == 0);
  const Json frames = Json::parse(ViewLog(run.folder.path("lost.mcap")).attachments.at("frames"));
  CHECK(frames.at("lost_scans") == Json({0, 0, 1, 0, 0, 0}));
}

TEST_CASE("view log: /truth has the other cars at the frame's stamp, in the map") {
  const ShortRun run;
  const ViewLog view = run.view({});
  std::map<int64_t, Json> states;  // of the recording
  io::McapReader race(run.log);
  io::McapMessage message;
  while (race.next(message))
    if (race.channels().at(message.channel_id).topic == io::kCarStatesTopic) {
      const Json json = Json::parse(message.data);
      states[json.at("stamp_ns")] = json.at("cars");
    }
  const auto& truth = view.topics.at("/truth");
  REQUIRE(truth.size() == 10);
  for (const Message& m : truth) {
    const Json json = Json::parse(m.data);
    CHECK(json.at("stamp_ns") == std::to_string(m.log_ns));
    CHECK(json.at("frame") == "map");
    const auto after = states.upper_bound(m.log_ns);
    const Json& cars = std::prev(after)->second;
    std::size_t others = 0;
    for (const Json& car : cars) {
      if (car.at("is_ego")) continue;
      const Json& shown = json.at("cars").at(others++);
      CHECK(shown.at("id") == car.at("car"));
      CHECK(shown.at("name") == car.at("name"));
      CHECK(shown.at("length_m") == car.at("length_m"));
      const double late_s = double(m.log_ns - std::prev(after)->first) * 1e-9, speed = car.at("speed_mps");
      CHECK(late_s < 0.05);
      const double x = double(car.at("x_m")) + late_s * speed * std::cos(double(car.at("course_rad"))),
                   y = double(car.at("y_m")) + late_s * speed * std::sin(double(car.at("course_rad")));
      CHECK(std::hypot(double(shown.at("x_m")) - x, double(shown.at("y_m")) - y) < 0.02);
      CHECK(double(shown.at("speed_mps")) == doctest::Approx(speed).epsilon(0.02));
    }
    CHECK(json.at("cars").size() == others);
    CHECK(others > 0);
  }
}

TEST_CASE("view log: truth that cannot be read ends no run, a note says so") {
  const ShortRun run;
  const std::string odd = run.folder.path("odd.mcap");
  {
    io::McapReader from(run.log);
    io::McapWriter to(odd);
    std::map<uint16_t, uint16_t> channels;
    io::McapMessage message;
    int64_t truths = 0;
    while (from.next(message)) {
      const io::McapChannel& channel = from.channels().at(message.channel_id);
      if (!channels.contains(message.channel_id)) {
        const io::McapSchema& schema = from.schemas().at(channel.schema_id);
        channels[message.channel_id] = to.add_channel(to.add_schema(schema.name, schema.encoding, schema.data),
                                                      channel.topic, channel.message_encoding);
      }
      const bool is_truth = channel.topic == io::kCarStatesTopic;
      const bool is_odd = is_truth && (truths == 5 || truths == 6);
      truths += is_truth;
      to.write(channels[message.channel_id], message.log_ns,
               is_odd ? R"({"stamp_ns":1700000000000000000,"cars":[{"is_ego":false,"car":{}}]})" : message.data);
    }
    for (const io::McapAttachment& a : from.attachments()) to.add_attachment(a.name, a.media_type, a.data, a.log_ns);
    for (const auto& [name, entries] : from.metadata()) to.add_metadata(name, entries);
    to.close();
  }
  const auto run_on = [&](const std::string& log, const std::string& name) {
    const Outcome outcome = run_overtake(
        run.folder, {"run", log, "--out", run.folder.path(name), "--force", "--mcap", run.folder.path(name + ".mcap")});
    CHECK(outcome.code == 0);
    return outcome.text;
  };
  const std::string right = run_on(run.log, "right"), noted = run_on(odd, "odd_run");
  CHECK(right.find("truth") == std::string::npos);
  CHECK(noted.find("note: 2 messages with the truth could not be read; the first: message ") != std::string::npos);
  CHECK(noted.find(" on /truth/cars: the states of the cars cannot be read: ") != std::string::npos);
  for (const char* table : {"/detections.csv", "/tracks.csv"})
    CHECK(io::read_whole_file(run.folder.path("odd_run") + table) ==
          io::read_whole_file(run.folder.path("right") + table));
  CHECK(ViewLog(run.folder.path("odd_run.mcap")).topics.at("/truth").size() == 10);  // from the messages beside them
}

TEST_CASE("view log: a recording that knows a relative position only shows it in the map where the own pose is known") {
  const ShortRun run;
  const std::string race = run.folder.path("race");
  REQUIRE(run_overtake(run.folder, {"simulate", "demo", "--seconds", "0.2", "--out", race, "--quiet"}).code == 0);
  for (const char* frame : {"000000", "000001", "000002", "000003"})
    run.folder.write(std::string("race/") + frame + "_box.txt", "10 2 0.5 4.9 1.9 1.1 0.25\n");
  const auto truth_of = [&](const std::vector<std::string>& options) {
    std::vector<std::string> words = {"run",   race,    "--quiet", "--force",
                                      "--out", run.out, "--mcap",  run.folder.path("view.mcap")};
    words.insert(words.end(), options.begin(), options.end());
    REQUIRE(run_overtake(run.folder, words).code == 0);
    return Json::parse(ViewLog(run.folder.path("view.mcap")).topics.at("/truth")[1].data);
  };
  const Json relative = truth_of({"--ego", "none", "--map", "none"});
  CHECK(relative.at("frame") == "vehicle");
  CHECK(relative.at("cars")[0].at("x_m") == 10);
  CHECK(relative.at("cars")[0].at("y_m") == 2);
  CHECK(relative.at("cars")[0].at("speed_mps").is_null());
  const Json in_map = truth_of({"--preset", "paper"});  // /tf turns by the pushed pose
  CHECK(in_map.at("frame") == "map");
  foxglove::FrameTransform ego;
  const ViewLog view(run.folder.path("view.mcap"));
  const int64_t stamp_ns = view.topics.at("/truth")[1].log_ns;
  for (const Message& m : view.topics.at("/tf")) {
    REQUIRE(ego.ParseFromString(m.data));
    if (m.log_ns == stamp_ns && ego.parent_frame_id() == "map") break;
  }
  const double yaw = 2 * std::atan2(ego.rotation().z(), ego.rotation().w());
  const Json& car = in_map.at("cars")[0];
  CHECK(double(car.at("x_m")) == doctest::Approx(ego.translation().x() + 10 * std::cos(yaw) - 2 * std::sin(yaw)));
  CHECK(double(car.at("y_m")) == doctest::Approx(ego.translation().y() + 10 * std::sin(yaw) + 2 * std::cos(yaw)));
  CHECK(std::remainder(double(car.at("heading_rad")) - yaw - 0.25, 2 * 3.14159265358979) ==
        doctest::Approx(0).epsilon(1e-9));
}

TEST_CASE("view log: label images and PNG files take their colours from one table") {
  const ShortRun run;
  const ViewLog view = run.view({"--mcap-images", "labels", "--preset", "paper"});
  const std::string look = run.folder.path("look");
  REQUIRE(run_overtake(run.folder, {"inspect", run.log, "--frame", "4", "--sensor", "front", "--preset", "paper",
                                    "--out", look, "--quiet"})
              .code == 0);
  const io::Npy npy = io::read_npy(look + "/labels.npy");
  io::Picture png = io::read_png(look + "/labels.png");
  foxglove::RawImage raw;
  REQUIRE(raw.ParseFromString(view.topics.at("/front/image/labels")[4].data));
  const int32_t rows = int32_t(npy.shape[0]), cols = int32_t(npy.shape[1]);
  REQUIRE(int32_t(raw.height()) == rows);
  REQUIRE(int32_t(raw.width()) == cols);
  CHECK(raw.encoding() == "rgb8");
  const int32_t zoom_x = png.width / cols, zoom_y = (png.height - 20) / rows;
  std::vector<bool> seen(51);
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t c = 0; c < cols; ++c) {
      const std::size_t at = std::size_t(r) * std::size_t(cols) + std::size_t(c);
      const auto label = value_at<int32_t>(npy.bytes, 4 * at);
      const io::Rgb color = io::label_color(label);
      REQUIRE(std::memcmp(raw.data().data() + 3 * at, color.data(), 3) == 0);
      REQUIRE(png.at(c * zoom_x, png.height - (rows - r) * zoom_y) == color);
      if (label >= 0 && label < 51) seen[std::size_t(label)] = true;
    }
  CHECK(std::count(seen.begin(), seen.end(), true) >= 10);
}

TEST_CASE("known cars: states of other texts are refused with a reason") {
  io::KnownCars cars;
  for (const char* text : {"", "[]", "{", "{\"stamp_ns\":1}", "{\"stamp_ns\":1,\"cars\":[{}]}",
                           "{\"stamp_ns\":\"x\",\"cars\":[]}", "{\"stamp_ns\":1,\"cars\":[{\"is_ego\":false}]}"})
    CHECK_THROWS_AS(cars.add(text), std::runtime_error);
  CHECK_THROWS_AS(cars.add(std::string(2 << 20, ' ')), std::runtime_error);
  CHECK_THROWS_AS(cars.add(std::string(100000, '[')), std::runtime_error);
  CHECK(cars.at(0).empty());
  const auto state = [](int64_t stamp_ns, double x_m, double heading_rad) {
    return "{\"stamp_ns\":" + std::to_string(stamp_ns) +
           ",\"cars\":[{\"car\":1,\"name\":\"b\",\"is_ego\":false,\"x_m\":" + std::to_string(x_m) +
           ",\"y_m\":0,\"z_m\":7,\"heading_rad\":" + std::to_string(heading_rad) +
           ",\"speed_mps\":50,\"length_m\":5,\"width_m\":2},{\"car\":0,\"name\":\"a\",\"is_ego\":true,\"z_m\":4}]}";
  };
  cars.add(state(1'000'000'000, 10, 3.1));
  cars.add(state(1'050'000'000, 12, -3.1));
  CHECK(cars.at(999'999'999).empty());
  REQUIRE(cars.at(1'025'000'000).size() == 1);
  const io::KnownCar car = cars.at(1'025'000'000)[0];
  CHECK(car.id == 1);
  CHECK(car.x_m == doctest::Approx(11));
  CHECK(car.z_m == 3);
  CHECK(std::fabs(car.heading_rad) == doctest::Approx(3.14159265).epsilon(1e-6));
  CHECK(cars.at(1'100'000'000)[0].x_m == doctest::Approx(14));
  CHECK(cars.at(1'200'000'000).empty());
}
