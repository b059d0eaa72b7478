// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Scans in pieces: cut anywhere, lost, doubled, in any order, of scans that do not end. A second detector gets whole
// scans of the points that came: every frame of both has the same segmentation, and every loss is counted.
#include "kernels/kernel_table.h"
#include "tests/fuzz/small_detector.h"
#include "tests/support/frame_hash.h"
#include "tests/support/pieces.h"

using namespace overtake::fuzz;
using overtake::test::FrameHash;
using overtake::test::piece_of;
using overtake::test::Range;

namespace {

// Of each frame: a hash of labels, images and clusters, and whether it is incomplete. The tracks of an incomplete frame
// differ, because what it does not show is not free.
struct Story {
  std::vector<uint64_t> hashes;
  std::vector<uint32_t> incomplete;
  static void on_frame(ovt_reader* reader, void* user) {
    auto& story = *static_cast<Story*>(user);
    ovt_frame_info info;
    ovt_labels labels;
    ovt_clusters clusters;
    OVT_FUZZ_REQUIRE(ovt_read_info(reader, &info) == OVT_OK);
    check_frame(reader, 1);
    FrameHash hash;
    if (ovt_read_labels(reader, 0, &labels) == OVT_OK) hash.add(labels);
    if (ovt_read_clusters(reader, &clusters) == OVT_OK) hash.add(clusters);
    story.hashes.push_back(hash.value());
    story.incomplete.push_back(info.incomplete_mask);
  }
};

ovt_detector* create(SmallDef& small, Story& story) {
  small.def.on_frame = Story::on_frame;
  small.def.user = &story;
  ovt_detector* detector = nullptr;
  OVT_FUZZ_REQUIRE(ovt_create_detector(&small.def, &detector) == OVT_OK);
  return detector;
}

// The points of `cloud` that came, in their order.
Cloud keep(const Cloud& cloud, const std::vector<bool>& came) {
  Cloud kept;
  for (std::size_t i = 0; i < came.size(); ++i) {
    if (!came[i]) continue;
    kept.x.push_back(cloud.x[i]), kept.y.push_back(cloud.y[i]), kept.z.push_back(cloud.z[i]);
    kept.layer.push_back(cloud.layer[i]);
  }
  return kept;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  Bytes in(data, size);
  Story streamed_story, whole_story;
  SmallDef small;
  draw_def(in, 1, small);
  const char* const isas[] = {"ref", "sse2", "avx2", "avx512", nullptr};
  small.def.isa = isas[in.in(0, 4)];
  if (!overtake::find_kernels(small.def.isa)) small.def.isa = nullptr;  // not on this CPU
  small.def.keep_images = in.in(0, 1);
  small.params.frame_scan_limit = 0;
  ovt_detector* const whole = create(small, whole_story);
  small.def.stream = !in.chance(40);
  ovt_detector* const streamed = create(small, streamed_story);

  std::vector<uint32_t> incomplete;
  int64_t stamp_ns = 0, pieces = 0, used = 0, dup = 0, late = 0, dropped = 0, missing_points = 0, unended = 0;
  Cloud before;
  int64_t before_ns = 0;
  for (int32_t step = 0; step < 12 && !in.empty(); ++step) {
    stamp_ns += in.in(1, 60) * int64_t(1'000'000);
    Cloud cloud;
    cloud.draw(in, in.in(0, 230), small.sensors[0]);  // the capacity is 200
    const ovt_points scan = cloud.points(0, stamp_ns);
    const int32_t order = in.in(0, 3);  // 0: as measured, 1: from the end, 2, 3: pairs change places
    std::vector<Range> ranges;
    for (int32_t first = 0; first < scan.count;) {
      const int32_t last = std::min(scan.count, first + in.in(1, in.chance(128) ? 8 : 80));
      ranges.push_back({first, last});
      first = last;
    }
    if (order == 1) std::reverse(ranges.begin(), ranges.end());
    if (order > 1)
      for (std::size_t i = 0; i + 1 < ranges.size(); i += 2) std::swap(ranges[i], ranges[i + 1]);

    std::vector<bool> came(std::size_t(scan.count), false);
    bool refused = false;
    const auto push = [&](const ovt_points& piece) {
      ++pieces;
      return ovt_push_points(streamed, &piece);
    };
    for (const Range& range : ranges) {
      const uint8_t fate = in.byte();
      if (fate < 20) continue;  // lost
      const ovt_points piece = piece_of(scan, range.first, range.last);
      const ovt_status status = push(piece);
      refused = refused || range.last > 200;
      OVT_FUZZ_REQUIRE(status == (refused ? OVT_TOO_MANY : OVT_OK));
      ++(refused ? dropped : used);
      if (!refused)
        for (int32_t i = range.first; i < range.last; ++i) came[std::size_t(i)] = true;
      if (fate >= 20 && fate < 50) {  // doubled
        OVT_FUZZ_REQUIRE(push(piece) == (refused ? OVT_TOO_MANY : OVT_DUPLICATE));
        ++(refused ? dropped : dup);
      }
      if (fate >= 50 && fate < 70 && before_ns != 0 && !before.x.empty()) {  // of the scan before
        OVT_FUZZ_REQUIRE(push(piece_of(before.points(0, before_ns), 0, 1)) == OVT_LATE);
        ++late;
      }
    }
    const int32_t end_kind = in.in(0, 7);
    const bool ends = end_kind != 0, counts = end_kind % 2 == 0;
    const auto count_came = int32_t(std::count(came.begin(), came.end(), true));
    const auto last_came = std::find(came.rbegin(), came.rend(), true);
    const auto end = int32_t(came.rend() - last_came);
    const bool opened = std::any_of(came.begin(), came.end(), [](bool c) { return c; }) || refused;
    if (ends) {
      const ovt_status status = ovt_end_scan(streamed, 0, stamp_ns, counts ? scan.count : -1);
      OVT_FUZZ_REQUIRE(status == (refused ? OVT_TOO_MANY : OVT_OK));
    } else {
      OVT_FUZZ_REQUIRE(ovt_flush(streamed) == OVT_OK);
      if (!opened) continue;
    }
    before = cloud, before_ns = stamp_ns;
    if (refused) continue;
    const int32_t missing = (ends && counts ? scan.count : end) - count_came;
    missing_points += missing;
    unended += !ends;
    incomplete.push_back(missing > 0 || !ends);
    const Cloud rest = keep(cloud, came);
    const ovt_points points = rest.points(0, stamp_ns);
    OVT_FUZZ_REQUIRE(ovt_push_scan(whole, &points) == OVT_OK);
  }
  OVT_FUZZ_REQUIRE(ovt_flush(streamed) == OVT_OK && ovt_flush(whole) == OVT_OK);
  OVT_FUZZ_REQUIRE(streamed_story.hashes == whole_story.hashes);
  OVT_FUZZ_REQUIRE(streamed_story.incomplete == incomplete);
  const ovt_stats stats = stats_of(streamed);
  OVT_FUZZ_REQUIRE(stats.pushed == stats.used + stats.dropped + stats.late + stats.dup && stats.exceptions == 0);
  OVT_FUZZ_REQUIRE(stats.pieces == pieces && stats.pieces_used == used && stats.pieces_dup == dup);
  OVT_FUZZ_REQUIRE(stats.pieces_late == late && stats.pieces_dropped == dropped);
  OVT_FUZZ_REQUIRE(stats.points_missing == missing_points && stats.scans_unended == unended);
  OVT_FUZZ_REQUIRE(stats.scans_incomplete == int64_t(std::count(incomplete.begin(), incomplete.end(), 1u)));
  ovt_destroy_detector(streamed);
  ovt_destroy_detector(whole);
  return 0;
}
