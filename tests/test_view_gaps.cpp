// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Gaps in the view of a sensor: where they are in a scan, and which of them last.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "core/math.h"
#include "pipeline/track/gap_watch.h"
#include "pipeline/view_gaps.h"
#include "tests/support/images.h"

namespace {

using namespace overtake;

constexpr double kDegree = kPi / 180;
constexpr int32_t kRows = 8;

SensorModel make_sensor(int32_t cols, bool wraps) {
  const double left_rad = wraps ? kPi : 60 * kDegree;
  return make_sensor_model(kRows, cols, left_rad, -left_rad, wraps, 0.5, 200);
}

// An image whose columns in `empty` have no point; every other one has one point, in any row.
ViewGaps look(const SensorModel& sensor, const std::set<int32_t>& empty) {
  test::OwnedPlane<int32_t> point(kRows, sensor.cols);
  point.fill(kNoPoint);
  for (int32_t c = 0; c < sensor.cols; ++c)
    if (!empty.contains(c)) point.at((5 * c) % kRows, c) = c;
  return find_gaps(sensor, point);
}
std::set<int32_t> span_of(int32_t first, int32_t count, int32_t cols) {
  std::set<int32_t> columns;
  for (int32_t i = 0; i < count; ++i) columns.insert((first + i) % cols);
  return columns;
}

bool is_gap(const ViewGap& gap, int32_t first_col, int32_t cols) {
  return gap.first_col == first_col && gap.cols == cols;
}

struct Watch {
  SensorModel sensor;
  Frame frame;
  GapWatch watch;
  bool known = true;

  explicit Watch(int32_t cols = 1200, bool wraps = false) : sensor(make_sensor(cols, wraps)) {
    frame.sensors[0].present = true;
  }
  const ViewGaps& see(double time_s, std::vector<ViewGap> gaps) {
    frame.sensors[0].stamp_ns = int64_t(time_s * 1e9 + 0.5);
    frame.gaps[0].known = known;
    frame.gaps[0].count = int32_t(gaps.size());
    std::copy(gaps.begin(), gaps.end(), frame.gaps[0].gap);
    watch.follow(&sensor, 1, frame);
    return frame.blocked[0];
  }
};

}  // namespace

TEST_CASE("view gaps: of 3 degrees and more, with their exact columns") {
  const SensorModel sensor = make_sensor(1200, false);  // of 0.1 deg
  const int32_t least = least_gap(sensor);
  CHECK(least == 30);
  CHECK(look(sensor, {}).count == 0);
  for (const int32_t first : {0, 1, 29, 30, 31, 577, 1170}) {
    CAPTURE(first);
    CHECK(look(sensor, span_of(first, least - 1, 1200)).count == 0);
    const ViewGaps gaps = look(sensor, span_of(first, least, 1200));
    REQUIRE(gaps.count == 1);
    CHECK(is_gap(gaps.gap[0], first, least));
    CHECK(double(left_of(sensor, gaps.gap[0])) == doctest::Approx((60 - 0.1 * first) * kDegree));
    CHECK(double(width_of(sensor, gaps.gap[0])) == doctest::Approx(3 * kDegree));
  }
  CHECK(look(sensor, span_of(1180, 40, 1200)).count == 0);  // 20 columns at either edge: they are no neighbours
}

TEST_CASE("view gaps: several, with a column between them") {
  const SensorModel sensor = make_sensor(1200, false);
  std::set<int32_t> empty = span_of(100, 300, 1200);
  empty.erase(200);
  ViewGaps gaps = look(sensor, empty);
  REQUIRE(gaps.count == 2);
  CHECK(is_gap(gaps.gap[0], 100, 100));
  CHECK(is_gap(gaps.gap[1], 201, 199));
  empty.clear();
  for (int32_t i = 0; i < 12; ++i) empty.merge(span_of(100 * i, 30, 1200));
  gaps = look(sensor, empty);
  CHECK(gaps.count == kMaxViewGaps);
}

TEST_CASE("view gaps: across the first column of a sensor that wraps") {
  const SensorModel sensor = make_sensor(1800, true);  // of 0.2 deg
  for (const int32_t first : {1799, 1790, 1786}) {
    CAPTURE(first);
    const ViewGaps gaps = look(sensor, span_of(first, 15, 1800));
    REQUIRE(gaps.count == 1);
    CHECK(is_gap(gaps.gap[0], first, 15));
  }
  std::set<int32_t> empty = span_of(1700, 150, 1800);
  empty.merge(span_of(900, 20, 1800));
  const ViewGaps gaps = look(sensor, empty);
  REQUIRE(gaps.count == 2);
  CHECK(is_gap(gaps.gap[0], 1700, 150));
  CHECK(is_gap(gaps.gap[1], 900, 20));
}

TEST_CASE("view gaps: of a whole view, and of views of few columns") {
  for (const bool wraps : {false, true}) {
    const ViewGaps whole = look(make_sensor(1200, wraps), span_of(0, 1200, 1200));
    REQUIRE(whole.count == 1);
    CHECK(whole.gap[0].cols == 1200);
  }
  CHECK(look(make_sensor(4, true), span_of(3, 1, 4)).count == 1);
  CHECK(look(make_sensor(4, true), {}).count == 0);
  CHECK(look(make_sensor(1, false), {0}).count == 1);
}

TEST_CASE("gap watch: the narrowest gap, at every place of every sensor") {
  for (const bool wraps : {false, true})
    for (const int32_t cols : {120, 857, 1024, 1800, 2048, 3600, 4096}) {
      CAPTURE(cols);
      Watch watch(cols, wraps);
      const int32_t least = least_gap(watch.sensor);
      const double part_rad = double(watch.sensor.pitch_rad) * std::max(1.0, std::ceil(cols / 1024.0));
      for (int32_t first = 0; first + least <= cols; first += 7) {
        watch.watch.restart();
        watch.see(0.0, {{first, least}});
        const ViewGaps& lasting = watch.see(0.3, {{first, least}});
        REQUIRE(lasting.count == 1);
        CHECK(double(width_of(watch.sensor, lasting.gap[0])) > 3 * kDegree - 2 * part_rad);
        CHECK(lasting.gap[0].first_col >= first);
        CHECK(lasting.gap[0].first_col + lasting.gap[0].cols <= first + least);
      }
    }
}

TEST_CASE("gap watch: a gap lasts from a quarter of a second on, until a scan has a return there") {
  Watch watch;
  CHECK(watch.see(0.0, {{100, 60}}).count == 0);
  for (int k = 1; k < 5; ++k) CHECK(watch.see(0.05 * k, {{100, 60}}).count == 0);
  const ViewGaps lasting = watch.see(0.25, {{100, 60}});
  REQUIRE(lasting.count == 1);
  CHECK(lasting.gap[0].first_col >= 100);
  CHECK(lasting.gap[0].first_col < 105);
  CHECK(lasting.gap[0].first_col + lasting.gap[0].cols <= 160);
  CHECK(lasting.gap[0].first_col + lasting.gap[0].cols > 155);
  CHECK(watch.see(0.30, {}).count == 0);
  CHECK(watch.see(0.35, {{100, 60}}).count == 0);  // it begins anew
  CHECK(watch.see(0.55, {{100, 60}}).count == 0);
  CHECK(watch.see(0.60, {{100, 60}}).count == 1);
}

TEST_CASE("gap watch: what several gaps have in common lasts") {
  Watch watch;
  watch.see(0.0, {{100, 100}, {600, 60}});
  watch.see(0.1, {{150, 100}});
  const ViewGaps lasting = watch.see(0.3, {{100, 150}, {600, 60}});
  REQUIRE(lasting.count == 1);
  CHECK(lasting.gap[0].first_col >= 150);
  CHECK(lasting.gap[0].first_col + lasting.gap[0].cols <= 200);
  // A moving gap is one of the scene.
  Watch moving;
  for (int k = 0; k < 20; ++k) CHECK(moving.see(0.05 * k, {{20 + 30 * k, 60}}).count == 0);
}

TEST_CASE("gap watch: a gap across the first column is one") {
  Watch watch(1800, true);
  watch.see(0.0, {{1780, 40}});
  const ViewGaps lasting = watch.see(0.3, {{1780, 40}});
  REQUIRE(lasting.count == 1);
  CHECK(lasting.gap[0].first_col >= 1780);
  CHECK(lasting.gap[0].cols > 25);
}

TEST_CASE("gap watch: after a silence a gap begins anew") {
  Watch watch;
  watch.see(1.0, {{100, 60}});
  CHECK(watch.see(1.9, {{100, 60}}).count == 0);
  CHECK(watch.see(2.2, {{100, 60}}).count == 1);
  CHECK(watch.see(3.1, {}).count == 0);
  CHECK(watch.see(3.15, {}).count == 0);
  watch.see(3.2, {{100, 60}});
  CHECK(watch.see(3.5, {{100, 60}}).count == 1);
  watch.known = false;  // for longer, no scan tells
  CHECK(watch.see(4.0, {}).count == 1);
  CHECK(watch.see(4.2, {}).count == 0);
  Watch slow;
  slow.see(1.0, {{100, 60}});
  CHECK(slow.see(1.5, {{100, 60}}).count == 1);
}

TEST_CASE("gap watch: incomplete, missing, unclear and older scans change nothing; a restart forgets") {
  Watch watch;
  watch.see(1.0, {{100, 60}});
  watch.known = false;
  CHECK(watch.see(1.05, {}).count == 0);
  watch.known = true;
  watch.frame.incomplete_mask = 1;
  CHECK(watch.see(1.1, {}).count == 0);
  watch.frame.incomplete_mask = 0;
  watch.frame.sensors[0].present = false;
  CHECK(watch.see(1.2, {}).count == 0);
  watch.frame.sensors[0].present = true;
  CHECK(watch.see(1.3, {{100, 60}}).count == 1);
  CHECK(watch.see(1.2, {}).count == 1);  // an older scan has what the newest ones have shown
  CHECK(watch.see(1.35, {{100, 60}}).count == 1);
  watch.known = false;
  CHECK(watch.see(1.37, {}).count == 1);
  watch.known = true;
  watch.frame.incomplete_mask = 1;
  CHECK(watch.see(1.4, {{100, 60}}).count == 0);
  watch.frame.incomplete_mask = 0;
  watch.watch.restart();
  CHECK(watch.see(0.1, {{100, 60}}).count == 0);
  CHECK(watch.see(0.35, {{100, 60}}).count == 1);
}
