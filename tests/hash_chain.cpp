// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// hash_chain [--isa NAME]        hash_chain --golden >tests/golden_hashes.def   (of best: golden_hashes_best.def)
//
// The whole chain from points to tracks, one hash per frame: of the golden scene, and of every recorded frame that is
// present (with OVT_HASH_RECORDED; $OVERTAKE_DATA or ./recordings). All ISAs of this CPU, or the given one, must give
// the same hash, and on the golden scene the hash of the table below. Prints the hashes; tools/dev/check_same_bytes
// compares the output of builds with other compilers and levels. Exit status 1 on any difference.
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "pipeline/overtake.h"
#include "tests/support/frame_hash.h"
#include "tests/support/golden_scene.h"
#include "tests/support/test_method.h"

#if defined(OVT_HASH_RECORDED)
#include <filesystem>

#include "tools/client/session.h"
#endif

namespace overtake::test {
namespace {

// Made with ref. A change of these lines is a change of the library's results; --golden prints new ones, of the method
// that OVT_TEST_METHOD names. A preset whose results are final gets a file and a line here.
constexpr uint64_t kPaperHashes[kGoldenFrames] = {
#include "tests/golden_hashes.def"
};
constexpr uint64_t kBestHashes[kGoldenFrames] = {
#include "tests/golden_hashes_best.def"
};
constexpr struct {
  const char* method;
  const uint64_t* hashes;
} kGolden[] = {{"paper", kPaperHashes}, {"best", kBestHashes}};

struct Hashes {
  int32_t sensor_count = 0, detections = 0, tracks = 0;
  std::vector<uint64_t> frames;
  static void add(ovt_reader* reader, void* user) {
    Hashes& self = *static_cast<Hashes*>(user);
    const FrameHash hash(reader, self.sensor_count);
    self.frames.push_back(hash.value());
    self.detections += hash.detections();
    self.tracks = hash.tracks();
  }
};

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "hash_chain: %s\n", what.c_str());
  std::exit(1);
}

Hashes hash_scene(const char* isa) {
  const std::vector<ovt_sensor_def> sensors = golden_sensors();
  const GoldenMap map;
  Hashes hashes;
  hashes.sensor_count = kGoldenSensors;
  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = sensors.data();
  def.sensor_count = kGoldenSensors;
  const ovt_params params = test_params();
  def.params = &params;
  def.map = &map.def;
  def.worker_count = 1;
  def.isa = isa;
  def.push_policy = OVT_PUSH_WAIT;
  def.on_frame = Hashes::add;
  def.user = &hashes;
  ovt_detector* detector = nullptr;
  if (ovt_create_detector(&def, &detector) != OVT_OK) fail(std::string("no detector on ") + isa);
  int64_t ego_ns = golden_stamp_ns(0, 0) - 20000000;
  for (int32_t frame = 0; frame < kGoldenFrames; ++frame) {
    for (; ego_ns < golden_stamp_ns(frame, kGoldenSensors) + kGoldenPeriodNs; ego_ns += 10000000) {
      const ovt_ego_pose pose = golden_ego(ego_ns);
      if (ovt_push_ego_pose(detector, &pose) != OVT_OK) fail("an ego pose was refused");
    }
    for (int32_t s = 0; s < kGoldenSensors; ++s) {
      const std::vector<GoldenPoint> cloud = golden_cloud(frame, s);
      const auto column = [&](const void* at, int32_t type) {
        const auto offset = static_cast<const char*>(at) - reinterpret_cast<const char*>(cloud.data());
        return ovt_column{at, cloud.size() * sizeof(GoldenPoint) - std::size_t(offset), sizeof(GoldenPoint), type};
      };
      ovt_points scan;
      ovt_points_init(&scan, sizeof scan);
      scan.sensor = s;
      scan.count = int32_t(cloud.size());
      scan.stamp_ns = golden_stamp_ns(frame, s);
      scan.x = column(&cloud[0].x_m, OVT_F32);
      scan.y = column(&cloud[0].y_m, OVT_F32);
      scan.z = column(&cloud[0].z_m, OVT_F32);
      scan.intensity = column(&cloud[0].intensity, OVT_F32);
      scan.layer = column(&cloud[0].layer, OVT_U16);
      scan.time = column(&cloud[0].time_ns, OVT_U32);
      scan.time_unit_ns = 1.0;
      if (ovt_push_scan(detector, &scan) != OVT_OK) fail("a scan was refused");
    }
  }
  ovt_flush(detector);
  ovt_destroy_detector(detector);
  return hashes;
}

// One source of frames, on every requested ISA. Prints and returns the hashes of the first; counts differences.
Hashes compare(const std::string& name, const std::vector<std::string>& isas,
               const std::function<Hashes(const char*)>& run, int32_t& differences) {
  Hashes first;
  for (const std::string& isa : isas) {
    const Hashes hashes = run(isa.c_str());
    if (isa == isas[0]) {
      first = hashes;
      for (std::size_t i = 0; i < first.frames.size(); ++i)
        std::printf("%s %02zu %016" PRIx64 "\n", name.c_str(), i, first.frames[i]);
      continue;
    }
    if (hashes.frames.size() != first.frames.size()) fail(name + ": a different number of frames on " + isa);
    for (std::size_t i = 0; i < first.frames.size(); ++i)
      if (hashes.frames[i] != first.frames[i]) {
        ++differences;
        std::fprintf(stderr, "%s %02zu: %s %016" PRIx64 ", %s %016" PRIx64 "\n", name.c_str(), i, isas[0].c_str(),
                     first.frames[i], isa.c_str(), hashes.frames[i]);
      }
  }
  return first;
}

void compare_golden(const Hashes& hashes, int32_t& differences) {
  if (hashes.frames.size() != kGoldenFrames) fail("the golden scene gave a different number of frames");
  if (hashes.detections == 0 || hashes.tracks < 2) fail("the golden scene gives no cars");
  for (const auto& golden : kGolden) {
    if (std::strcmp(golden.method, test_method()) != 0) continue;
    for (std::size_t i = 0; i < kGoldenFrames; ++i)
      if (hashes.frames[i] != golden.hashes[i]) {
        ++differences;
        std::fprintf(stderr, "scene %02zu: new hash 0x%016" PRIx64 ", golden hash 0x%016" PRIx64 "\n", i,
                     hashes.frames[i], golden.hashes[i]);
      }
  }
}

#if defined(OVT_HASH_RECORDED)
void compare_recorded(const std::vector<std::string>& isas, int32_t& differences) {
  const char* from_user = std::getenv("OVERTAKE_DATA");
  const std::string data = from_user && *from_user ? from_user : "recordings";
  const char* const recordings[][2] = {
      {"racecar", "av21"}, {"kitti", "hdl64"}, {"nuscenes", "nuscenes"}, {"av2", "av2"}};
  for (const auto& recording_of : recordings) {
    const char *const name = recording_of[0], *const rig = recording_of[1];
    std::error_code code;
    if (!std::filesystem::is_directory(data + "/" + name, code)) {
      std::printf("skipped: %s is not there (tools/README.md, \"Recorded data\", says where to get it)\n", name);
      continue;
    }
    cli::Options options;
    options.input = data + "/" + name;
    options.rig = rig;
    const auto run = [&](const char* isa) {
      options.isa = isa;
      const cli::Config config = cli::load_config(options);
      const io::Recording recording(options.input, config.rig);
      Hashes hashes;
      hashes.sensor_count = int32_t(config.rig.sensors.size());
      cli::Session session(config, Hashes::add, &hashes);
      for (std::size_t i = 0; i < recording.frame_count(); ++i) session.push(recording.read(i));
      session.flush();
      if (hashes.frames.size() != recording.frame_count()) fail(std::string(name) + ": frames are missing");
      return hashes;
    };
    compare(name, isas, run, differences);
  }
}
#endif

}  // namespace
}  // namespace overtake::test

int main(int argc, char** argv) {
  using namespace overtake::test;
  std::vector<std::string> isas;
  if (argc == 3 && std::strcmp(argv[1], "--isa") == 0) {
    isas.push_back(argv[2]);
  } else if (argc == 2 && std::strcmp(argv[1], "--golden") == 0) {
    const Hashes hashes = hash_scene("ref");
    for (std::size_t i = 0; i < hashes.frames.size(); ++i)
      std::printf("0x%016" PRIx64 ",%c", hashes.frames[i], i % 4 == 3 ? '\n' : ' ');
    return 0;
  } else if (argc == 1) {
    ovt_build_info info;
    ovt_read_build_info(&info);
    std::istringstream names(info.isas);
    for (std::string name; names >> name;) isas.push_back(name);
  } else {
    fail("usage: hash_chain [--isa NAME | --golden]");
  }
  int32_t differences = 0;
  const Hashes scene = compare("scene", isas, hash_scene, differences);
  compare_golden(scene, differences);
#if defined(OVT_HASH_RECORDED)
  if (tests_paper()) compare_recorded(isas, differences);
#endif
  for (const std::string& isa : isas) std::fprintf(stderr, "%s ", isa.c_str());
  std::fprintf(stderr, "-> %d differences\n", differences);
  return differences ? 1 : 0;
}
