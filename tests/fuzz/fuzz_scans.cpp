// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The C API with scans of any layout, good and bad: fields of any type, stride, size and address, in exactly the memory
// that they declare. Two detectors are created and destroyed in between; readers outlive them.
#include <memory>

#include "tests/fuzz/small_detector.h"

using namespace overtake::fuzz;

namespace {

struct Field {
  std::unique_ptr<uint64_t[]> memory;
  ovt_column column{};
};

// A field with exactly the bytes that it declares; its numbers are mostly plausible.
void draw_field(Bytes& in, int32_t count, int32_t usual, Field& out) {
  static constexpr std::size_t kSize[] = {0, 4, 8, 1, 1, 2, 2, 4, 4};
  const int32_t type = in.chance(200) ? usual : in.in(-1, 9);
  const std::size_t size = type >= 1 && type <= 8 ? kSize[type] : 4;
  const std::size_t stride = in.chance(24) ? in.byte() : size * std::size_t(in.in(1, 4));
  std::size_t bytes = count > 0 ? std::size_t(count - 1) * stride + size : 0;
  if (in.chance(16) && bytes > 0) bytes -= 1;
  // The last byte of the field is the last of the block, so that a read beyond it is detected.
  const std::size_t shift = in.chance(16) ? in.byte() % 8 : 0;
  out.memory = std::make_unique<uint64_t[]>((bytes + shift + 7) / 8 + 1);
  auto* at = reinterpret_cast<uint8_t*>(out.memory.get()) + shift;
  const bool raw = in.chance(40);
  for (std::size_t i = 0; size > 0 && i + size <= bytes; i += stride ? stride : bytes) {
    if (raw) {
      const auto word = in.raw<uint64_t>();
      std::memcpy(at + i, &word, size);
    } else if (type == OVT_F32) {
      const float v = float(in.in(-100, 100)) * 0.25f;
      std::memcpy(at + i, &v, size);
    } else if (type == OVT_F64) {
      const double v = in.in(-100, 100) * 0.25;
      std::memcpy(at + i, &v, size);
    } else {
      at[i] = uint8_t(in.byte() % 12);
    }
  }
  out.column = {in.chance(250) ? at : nullptr, bytes, stride, type};
}

// Wraps around at the end of int64.
int64_t later_ms(int64_t stamp_ns, int32_t ms) {
  return int64_t(uint64_t(stamp_ns) + uint64_t(int64_t(ms) * 1'000'000));
}

struct Life {
  SmallDef small;
  FrameWatch watch;
  ovt_detector* detector = nullptr;
  ovt_reader* reader = nullptr;
  int64_t stamp_ns = 0;

  void create(Bytes& in) {
    const int32_t sensor_count = in.in(1, 2);
    draw_def(in, sensor_count, small);
    watch.sensor_count = sensor_count;
    small.def.on_frame = FrameWatch::on_frame;
    small.def.user = &watch;
    const char* const isas[] = {"ref", "sse2", "avx2", "avx512", nullptr};
    small.def.isa = isas[in.in(0, 4)];
    if (in.chance(4)) small.def.track_capacity = in.raw<int32_t>();
    if (in.chance(4)) small.sensors[0].range_max_m = in.raw<double>();
    if (in.chance(4)) small.sensors[0].rows = in.in(-1, 2);
    const ovt_status status = ovt_create_detector(&small.def, &detector);
    OVT_FUZZ_REQUIRE((status == OVT_OK) == (detector != nullptr));
  }
  void push(Bytes& in) {
    ovt_points points;
    ovt_points_init(&points, sizeof points);
    stamp_ns = in.chance(230) ? later_ms(stamp_ns, in.in(0, 60)) : next_stamp(in, stamp_ns);
    points.stamp_ns = stamp_ns;
    points.sensor = in.chance(250) ? in.in(0, watch.sensor_count - 1) : in.in(-1, 9);
    Cloud cloud;
    Field fields[6];
    if (in.chance(128) && points.sensor >= 0 && points.sensor < watch.sensor_count) {
      cloud.draw(in, in.in(0, 120), small.sensors[std::size_t(points.sensor)]);
      points = cloud.points(points.sensor, stamp_ns);
    } else {
      points.count = in.chance(245) ? in.in(0, 60) : in.raw<int32_t>();
      const int32_t held = points.count < 0 || points.count > 300 ? in.in(0, 60) : points.count;
      const int32_t usual[6] = {OVT_F32, OVT_F32, OVT_F32, OVT_U16, OVT_NONE, OVT_NONE};
      ovt_column* const columns[6] = {&points.x, &points.y, &points.z, &points.layer, &points.intensity, &points.time};
      for (int32_t f = 0; f < 6; ++f) {
        draw_field(in, held, usual[f], fields[f]);
        *columns[f] = fields[f].column;
      }
      if (in.chance(40)) points.time_unit_ns = in.chance(128) ? 1e9 : in.raw<double>();
      if (in.chance(4)) points.struct_size = in.byte();
    }
    const ovt_stats before = stats_of(detector);
    const ovt_status status = ovt_push_scan(detector, &points);
    const bool counted = stats_of(detector).pushed == before.pushed + 1;
    OVT_FUZZ_REQUIRE(counted == (status == OVT_OK || status == OVT_DUPLICATE || status == OVT_LATE));
  }
  void read(Bytes& in) {
    if (!reader && ovt_create_reader(detector, &reader) != OVT_OK) return;
    if (ovt_next_frame(reader, nullptr) == OVT_OK) check_frame(reader, watch.sensor_count);
    ovt_tracks tracks;
    ovt_read_tracks(reader, next_stamp(in, stamp_ns), &tracks);
    if (in.chance(64)) {
      ovt_destroy_reader(reader);
      reader = nullptr;
    }
  }
  void destroy() {
    if (!detector) return;
    OVT_FUZZ_REQUIRE(ovt_flush(detector) == OVT_OK);
    const ovt_stats stats = stats_of(detector);
    OVT_FUZZ_REQUIRE(stats.pushed == stats.used + stats.dropped + stats.late + stats.dup);
    OVT_FUZZ_REQUIRE(stats.frames == watch.frames && stats.exceptions == 0);
    ovt_destroy_detector(detector);
    detector = nullptr;
    if (reader) {
      ovt_frame_info info;
      OVT_FUZZ_REQUIRE(ovt_next_frame(reader, &info) == OVT_NO_FRAME);
      if (ovt_read_info(reader, &info) == OVT_OK) check_frame(reader, watch.sensor_count);
    }
    ovt_destroy_reader(reader);
    reader = nullptr;
  }
  ~Life() { destroy(); }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  Bytes in(data, size);
  std::unique_ptr<Life> lives[2];
  for (int32_t step = 0; step < 60 && !in.empty(); ++step) {
    const int32_t what = in.in(0, 31);
    std::unique_ptr<Life>& slot = lives[what == 31 ? 1 : 0];
    if (!slot || what == 30) {
      slot = std::make_unique<Life>();
      slot->create(in);
    }
    Life& life = *slot;
    if (!life.detector) {
      slot.reset();
      continue;
    }
    if (what < 20 || what == 31) {
      life.push(in);
    } else if (what < 23) {
      const ovt_ego_pose pose = draw_ego(in, later_ms(life.stamp_ns, in.in(-20, 20)));
      ovt_push_ego_pose(life.detector, &pose);
    } else if (what < 25) {
      Rows rows;
      const ovt_external_detections d = rows.draw(in, life.stamp_ns);
      ovt_push_detections(life.detector, &d);
    } else if (what < 27) {
      ovt_advance(life.detector, next_stamp(in, life.stamp_ns));
    } else if (what < 29) {
      life.read(in);
    } else {
      ovt_flush(life.detector);
    }
  }
  return 0;
}
