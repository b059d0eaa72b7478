// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// How one car is followed over a run: its id, and when it is confirmed, in rows made by hand.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/support/track_rows.h"
#include "tools/evaluation/figures.h"
#include "tools/evaluation/track_quality.h"

using namespace overtake;
using namespace overtake::evaluation;
using namespace overtake::test;
using doctest::Approx;

namespace {

// Rows of a car every 0.5 s, all with 20 points and a confirmed track of id 7.
std::vector<CarRow> drive(const std::vector<double>& ahead_m) {
  std::vector<CarRow> rows;
  for (const double ahead : ahead_m) rows.push_back({0.5 * double(rows.size()), ahead, 2, 20, true, 7, 0.9});
  return rows;
}

}  // namespace

TEST_CASE("identity: a whole overtake keeps one id if the same track is at the car on both sides") {
  const auto overtakes = [](const std::vector<CarRow>& rows) { return count_kept_ids(rows).overtakes; };
  std::vector<CarRow> rows = drive({80, 59, 30, 1, -20, -59, -70});
  CHECK(overtakes(rows).trials == 1);
  CHECK(overtakes(rows).hits == 1);
  rows[3].id = 0;  // a miss alongside
  CHECK(overtakes(rows).hits == 1);
  rows[0].id = rows[6].id = 8;  // another id beyond 60 m
  CHECK(overtakes(rows).hits == 1);
  rows[4].id = 8;
  CHECK(overtakes(rows).hits == 0);
  rows[4].id = rows[5].id = 0;  // never behind
  CHECK(overtakes(rows).hits == 0);
  CHECK(overtakes(rows).trials == 1);
  std::reverse(rows.begin(), rows.end());
  for (std::size_t k = 0; k < rows.size(); ++k) rows[k].time_s = 0.5 * double(k), rows[k].id = 7;
  CHECK(overtakes(rows).hits == 1);  // the other way

  CHECK(overtakes(drive({80, 59, 30, 1, -20, -59})).trials == 0);     // the log ends
  CHECK(overtakes(drive({80, 59, 30, 1, -20, 10, 61})).trials == 0);  // falls back again
  CHECK(overtakes(drive({59, 30, 1, -20, -59, -70})).trials == 0);    // begins within
  rows = drive({80, 59, 30, 1, -20, -59, -70});
  rows[3].left_m = 31;  // another part of the circuit
  CHECK(overtakes(rows).trials == 0);
  rows[3].left_m = 2;
  for (std::size_t k = 3; k < rows.size(); ++k) rows[k].time_s += 2;  // away in between
  CHECK(overtakes(rows).trials == 0);
}

TEST_CASE("identity: a gap of 3 s counts if the car had an id before it, and is kept if it has the same one after") {
  const auto gaps = [](const std::vector<CarRow>& rows) { return count_kept_ids(rows).gaps; };
  const auto hidden = [](std::size_t from, std::size_t to) {
    std::vector<CarRow> rows = drive(std::vector<double>(20, 40));
    for (std::size_t k = from; k < to; ++k) rows[k].points = 2, rows[k].id = 0;
    return rows;
  };
  std::vector<CarRow> rows = hidden(4, 9);  // detectable in row 3 and row 9: 3 s
  CHECK(gaps(rows).trials == 1);
  CHECK(gaps(rows).hits == 1);
  CHECK(gaps(hidden(4, 8)).trials == 0);  // 2.5 s
  for (std::size_t k = 9; k < 13; ++k) rows[k].id = 0;
  CHECK(gaps(rows).hits == 1);  // back 2 s after the gap
  rows[13].id = 0;
  CHECK(gaps(rows).hits == 0);  // too late
  CHECK(gaps(rows).trials == 1);
  rows = hidden(4, 9);
  for (std::size_t k = 9; k < 20; ++k) rows[k].id = 8;
  CHECK(gaps(rows).hits == 0);
  rows = hidden(4, 9);
  rows[3].id = rows[2].id = 0;
  CHECK(gaps(rows).hits == 1);  // 1 s before the gap it had one
  rows[1].id = 0;
  CHECK(gaps(rows).trials == 0);
  rows = hidden(4, 9);
  rows[6].ahead_m = -101;  // out of reach meanwhile
  CHECK(gaps(rows).trials == 0);
  rows = hidden(4, 18);  // the log ends 0.5 s after the gap
  CHECK(gaps(rows).hits == 1);
  rows[18].id = rows[19].id = 0;
  CHECK(gaps(rows).trials == 0);
  rows = hidden(4, 9);
  for (CarRow& row : rows) row.points = NAN;  // a log that does not say
  CHECK(gaps(rows).trials == 0);
}

TEST_CASE("identity: after 3 s without a confirmed track the id is the same or another one, or there is none") {
  const auto losses = [](const std::vector<CarRow>& rows) { return count_kept_ids(rows).losses; };
  std::vector<CarRow> rows = drive(std::vector<double>(20, 40));
  CHECK(losses(rows).trials == 0);
  for (std::size_t k = 4; k < 9; ++k) rows[k].id = 0;  // rows 3 to 9: 3 s
  CHECK(losses(rows).trials == 1);
  CHECK(losses(rows).hits == 1);
  for (std::size_t k = 9; k < 20; ++k) rows[k].id = 8;
  CHECK(losses(rows).trials == 1);
  CHECK(losses(rows).hits == 0);
  rows[8].id = 8;  // 2.5 s
  CHECK(losses(rows).trials == 0);
  for (std::size_t k = 8; k < 20; ++k) rows[k].id = 0;
  CHECK(losses(rows).trials == 0);  // never again
  rows = drive(std::vector<double>(20, 40));
  for (std::size_t k = 4; k < 9; ++k) rows[k].id = 0;
  rows[6].left_m = 150;  // elsewhere on the circuit meanwhile
  CHECK(losses(rows).trials == 0);
}

TEST_CASE("confirmation: the delay runs from the first 3 points, the distance is that of a car that comes from afar") {
  const auto is_confirmed = [](const CarRow& row) { return row.confirmed; };
  std::vector<CarRow> rows = drive({160, 149, 130, 125, 90, 79});
  for (std::size_t k = 0; k < 4; ++k) rows[k].confirmed = false;
  rows[1].points = 2;
  CHECK(delays_to(rows, is_confirmed).seconds == std::vector<double>{1.0});  // rows 2 and 4
  rows[2].confirmed = true;
  rows[2].points = 2;
  CHECK(delays_to(rows, is_confirmed).seconds == std::vector<double>{0.0});  // before it is detectable
  rows[1].confirmed = true;  // its first row in reach: it had a track before
  CHECK(delays_to(rows, is_confirmed).seconds.empty());
  CHECK(delays_to(rows, is_confirmed).already_found == 1);
  rows[1].begins_log = true;  // no track is older: found at once
  CHECK(delays_to(rows, is_confirmed).seconds == std::vector<double>{0.0});
  rows[1].begins_log = false;
  for (CarRow& row : rows) row.confirmed = false;
  REQUIRE(delays_to(rows, is_confirmed).seconds.size() == 1);
  CHECK(std::isnan(delays_to(rows, is_confirmed).seconds[0]));
  for (CarRow& row : rows) row.points = 2, row.confirmed = true;
  CHECK(delays_to(rows, is_confirmed).seconds.empty());
  CHECK(delays_to(rows, is_confirmed).already_found == 0);  // never detectable

  // Not confirmed in rows 0 and 1; out of reach for 1.5 s the car is the same presence, for 2 s it comes anew.
  rows = drive({149, 140, 160, 155, 149, 140, 130});
  rows[0].confirmed = rows[1].confirmed = false;
  CHECK(delays_to(rows, is_confirmed).seconds == std::vector<double>{2.0});
  CHECK(delays_to(rows, is_confirmed).already_found == 0);
  rows = drive({149, 140, 160, 155, 151, 149, 140, 130});
  rows[0].confirmed = rows[1].confirmed = false;
  REQUIRE(delays_to(rows, is_confirmed).seconds.size() == 1);
  CHECK(std::isnan(delays_to(rows, is_confirmed).seconds[0]));
  CHECK(delays_to(rows, is_confirmed).already_found == 1);
  CHECK(delays_to(rows, is_confirmed, 2.0).seconds == std::vector<double>{2.5});

  const FoundAfter found = found_after({{0.1, NAN, 0.3, 0.2}, 5});
  CHECK(found.presences == 4);
  CHECK(found.already_found == 5);
  CHECK(found.never == 1);
  CHECK(found.median_s == Approx(0.2));
  CHECK(found.p99_s == Approx(0.298));

  rows = drive({260, 160, 120, 100, 80});
  for (std::size_t k = 0; k < 3; ++k) rows[k].confirmed = false;
  for (CarRow& row : rows) row.left_m = 0;
  REQUIRE(find_approaches(rows).size() == 1);
  CHECK(find_approaches(rows)[0].ahead);
  CHECK(find_approaches(rows)[0].confirmed_m == Approx(100));
  rows[3].confirmed = rows[4].confirmed = false;
  CHECK(std::isnan(find_approaches(rows)[0].confirmed_m));
  rows[4].ahead_m = 81;  // does not come near
  CHECK(find_approaches(rows).empty());
  CHECK(find_approaches(drive({119, 90, 70})).empty());  // does not come from afar
  rows = drive({-85, -70, -50.0, -40});
  rows[0].confirmed = false;
  REQUIRE(find_approaches(rows).size() == 1);
  CHECK(!find_approaches(rows)[0].ahead);
  CHECK(find_approaches(rows)[0].confirmed_m == Approx(std::hypot(70, 2)));
}

TEST_CASE("car rows: the id is that of the track that CLEAR MOT gives the car, the existence the largest at it") {
  Run run = empty_run();
  for (int32_t k = 0; k < 3; ++k) {
    run.tables["clusters"].add({double(k), 1, 0, 0});
    add_car_row(run, k, 1, 60, 20, 1);
    add_track_row(run, k, 5, 1, k == 2 ? 60.5 : 60, 0, 0);
    add_track_row(run, k, 6, 1, k == 2 ? 60 : 62, 0, 0);  // a second one, nearer in the last frame
    run.tables["existence"].add({double(k), 0, 5, 0.4, 1, 1});
    run.tables["existence"].add({double(k), 0, 6, 0.8, 1, 1});
    run.tables["existence"].add({double(k), 0, 7, 0.99, 1, -1});
  }
  const auto rows = car_rows(run);
  REQUIRE(rows.size() == 1);
  REQUIRE(rows.at(1).size() == 3);
  CHECK(rows.at(1)[0].begins_log);
  CHECK_FALSE(rows.at(1)[1].begins_log);
  for (const CarRow& row : rows.at(1)) {
    CHECK(row.id == 5);
    CHECK(row.existence == 0.8);
    CHECK(row.confirmed);
  }
}

TEST_CASE(
    "every N-th frame: a step longer than the limits of a pause does not end a presence, an overtake, an approach") {
  Run run = empty_run();
  run.about["compared"] = "40";  // 2 s
  const double ahead_m[] = {140, 110, 70, 30, -30, -70, -90};
  for (int32_t k = 0; k < 7; ++k) {
    const double frame = 40 * k;
    run.tables["clusters"].add({frame, 1, 0, 0});
    add_car_row(run, frame, 1, ahead_m[k], 20, k > 0);
    if (k > 0) add_track_row(run, frame, 5, 1, ahead_m[k], 0, 0);
  }
  const TrackQuality q = quality_of_tracks(run);
  CHECK(q.confirmed.presences == 1);
  CHECK(q.confirmed.already_found == 0);
  CHECK(q.confirmed.median_s == Approx(2));
  CHECK(q.overtakes.trials == 1);
  CHECK(q.overtakes.hits == 1);
  CHECK(q.from_ahead.approaches == 1);
  CHECK(q.hours == Approx(14.0 / 3600));
  const TrackFigures t = make_figures({run})[0].tracks;
  CHECK(t.cars_seen == 1);
  CHECK(t.time_to_confirm_s.mean == Approx(2));
  run.tables["cars"].add({320, 16, 2, 140, 0, 140, 0, 20, 1, 1, 1, 0, 1});  // has had its track before
  CHECK(make_figures({run})[0].tracks.cars_seen == 2);
  CHECK(make_figures({run})[0].tracks.time_to_confirm_s.mean == Approx(2));
}
