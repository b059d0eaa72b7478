// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Deliberate races for the thread sanitizer: it must report them in this build (tests/CMakeLists.txt checks its
// output); otherwise its silence about all other code would mean nothing. And the same without the race: no report.
//
//   race graph       two tasks of a flow graph write one frame
//   race callback    on_frame writes data that another thread reads
//   race none        the same, correctly synchronised
#include <oneapi/tbb/flow_graph.h>
#include <oneapi/tbb/global_control.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstring>

#include "pipeline/overtake.h"

namespace {

struct Frame {
  int64_t stamp_ns = 0;
  float range_m[16] = {};
  int32_t count = 0;
};

// Two tasks that certainly overlap, on one frame or on one each.
int32_t race_in_graph(bool apart) {
  namespace flow = oneapi::tbb::flow;
  const oneapi::tbb::global_control threads(oneapi::tbb::global_control::max_allowed_parallelism, 4);
  oneapi::tbb::task_arena arena(3);
  Frame frames[2];
  std::atomic<int32_t> arrived{0};
  arena.execute([&] {
    flow::graph graph;
    flow::function_node<int32_t, flow::continue_msg> segment(graph, flow::unlimited, [&](int32_t sensor) {
      arrived.fetch_add(1, std::memory_order_relaxed);
      for (int32_t spins = 0; arrived.load(std::memory_order_relaxed) < 2 && spins < 1000000000; ++spins) {
      }
      Frame& frame = frames[apart ? sensor : 0];
      frame.range_m[3] += 1.0f;
      ++frame.count;
      return flow::continue_msg();
    });
    segment.try_put(0);
    segment.try_put(1);
    graph.wait_for_all();
  });
  return frames[0].count + frames[1].count;
}

int32_t race_in_callback() {
  static Frame frame;
  ovt_sensor_def sensor = ovt_default_sensor_def();
  sensor.rows = 8, sensor.cols = 64, sensor.point_capacity = 64;
  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = &sensor;
  def.sensor_count = 1;
  def.worker_count = 2;
  def.on_frame = [](ovt_reader*, void*) { ++frame.count; };
  ovt_detector* detector = nullptr;
  if (ovt_create_detector(&def, &detector) != OVT_OK) return -1;
  ovt_points empty;
  ovt_points_init(&empty, sizeof empty);
  empty.x.type = empty.y.type = empty.z.type = OVT_F32;
  empty.layer.type = OVT_U8;
  ovt_push_scan(detector, &empty);
  usleep(300000);  // not synchronised, only delayed
  const int32_t seen = frame.count;
  ovt_destroy_detector(detector);
  return seen;
}

}  // namespace

int main(int argc, char** argv) {
  const char* what = argc == 2 ? argv[1] : "";
  int32_t count = 0;
  if (!std::strcmp(what, "graph")) {
    count = race_in_graph(false);
  } else if (!std::strcmp(what, "callback")) {
    count = race_in_callback();
  } else if (!std::strcmp(what, "none")) {
    count = race_in_graph(true);
  } else {
    std::fprintf(stderr, "usage: race graph|callback|none\n");
    return 2;
  }
  std::printf("%s: %d\n", what, count);
  return 0;
}
