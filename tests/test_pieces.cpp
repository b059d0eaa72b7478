// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Pieces of a log: joined, they are the whole log. A lost or doubled frame would change figures and not be seen.
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "tests/support/simulated_race.h"
#include "tests/support/temp_folder.h"
#include "tools/evaluation/kept_runs.h"
#include "tools/evaluation/pieces.h"
#include "tools/evaluation/report.h"
#include "tools/io/error.h"
#include "tools/io/mcap_reader.h"
#include "tools/io/mcap_writer.h"
#include "tools/io/text.h"

using namespace overtake;
using namespace overtake::evaluation;

namespace {

void simulate_race(const std::string& path, double seconds) {
  test::write_race(sim::load_scenario("blind_zone"), 2, seconds, path);
}

// A race whose localisation fills the library's list of poses within seconds.
void simulate_small_race(const std::string& path) {
  const sim::Scenario scenario = sim::parse_scenario("small", R"(
[sensors]
rate_hz = 10
lines_per_s = 64
second_returns = false
[localisation]
rate_hz = 500
[[car]]
name = "ego"
[[car]]
name = "other"
start_s_m = 15
speed_kmh = 201
)");
  test::write_race(scenario, 2, 12, path);
}

// The same messages, attachments and metadata, without an index of chunks.
void copy_without_index(const std::string& from, const std::string& to) {
  io::McapOptions options;
  options.index = false;
  io::McapReader attached(from);
  attached.list_attachments();
  io::McapReader log(from);
  io::McapWriter out(to, options);
  for (const auto& [name, entries] : attached.metadata()) out.add_metadata(name, entries);
  for (const io::McapAttachment& a : attached.attachments()) out.add_attachment(a.name, a.media_type, a.data);
  std::map<uint16_t, uint16_t> channels;
  io::McapMessage message;
  while (log.next(message)) {
    const io::McapChannel& channel = log.channels().at(message.channel_id);
    if (!channels.count(message.channel_id)) {
      const io::McapSchema& schema = log.schemas().at(channel.schema_id);
      const uint16_t id = out.add_schema(schema.name, schema.encoding, schema.data);
      channels[message.channel_id] = out.add_channel(id, channel.topic, channel.message_encoding);
    }
    out.write(channels[message.channel_id], message.log_ns, message.data, message.publish_ns);
  }
  REQUIRE(log.damage().empty());
  out.close();
}

// The bytes that this process has read from files; -1 where the system does not tell.
int64_t bytes_read() {
  std::ifstream file("/proc/self/io");
  std::string word;
  int64_t count = -1;
  return file >> word >> count ? count : -1;
}

// The bytes that a function reads.
template <class Function>
int64_t bytes_of(Function&& function) {
  const int64_t before = bytes_read();
  function();
  return bytes_read() - before;
}

void run_piece(RunOptions options, double from_s, double to_s, double warm_up_s, const std::string& out) {
  options.from_s = from_s, options.to_s = to_s, options.warm_up_s = warm_up_s, options.out = out;
  REQUIRE(run_logs(options));
}

// A piece of two frames: a track in each of them, and those at the cuts.
Run hand_made(const char* from_s, const char* to_s, double frame, double id, std::vector<std::vector<double>> cuts) {
  Run run{"best",
          "log_from_" + std::string(from_s) + "s",
          {{"log", "log"}, {"from_s", from_s}, {"to_s", to_s}, {"warm_up_s", "1"}, {"frames", "2"}},
          make_tables()};
  for (const double k : {0.0, 1.0}) {
    run.tables["tracks"].add({frame + k, 0, id, 1, -1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
    run.tables["existence"].add({frame + k, 0, id, 0.5, 1, -1});
  }
  for (const auto& row : cuts) run.tables["cuts"].add(row);
  return run;
}

std::vector<double> ids_of(const Run& run, const char* name) {
  const Table& table = run.tables.at(name);
  std::vector<double> out;
  for (std::size_t r = 0; r < table.rows(); ++r) out.push_back(table.at(r, table.column("id")));
  return out;
}

}  // namespace

TEST_CASE("pieces: with the warm-up from the start, joined pieces give the bytes of the whole log") {
  const TempFolder folder;
  simulate_race(folder.path("race.mcap"), 3.0);
  RunOptions options;
  options.logs = {folder.path("race.mcap")};
  options.presets = {"paper", "best", "paper:late_truth", "best:no_poses"};
  options.only_figures = options.quiet = true;
  for (const int32_t every : {1, 3}) {
    CAPTURE(every);
    options.compare_every = every;
    const std::string base = folder.path(std::to_string(every));
    run_piece(options, 0, -1, 0, base + "/whole");
    run_piece(options, 1, 2.02, 100, base + "/b");  // ends between two frames
    run_piece(options, 0, 1, 100, base + "/a");
    run_piece(options, 2.02, 2.5, 100, base + "/c");
    run_piece(options, 2.5, 9, 100, base + "/d");
    run_piece(options, 9, -1, 100, base + "/e");  // after the end of the log
    merge_runs({base + "/b", base + "/a", base + "/c", base + "/d", base + "/e"}, base + "/joined");
    const std::vector<Run> whole = read_runs(base + "/whole"), joined = read_runs(base + "/joined");
    REQUIRE(whole.size() == options.presets.size());
    REQUIRE(joined.size() == whole.size());
    for (std::size_t k = 0; k < whole.size(); ++k) {
      CAPTURE(whole[k].variant);
      CHECK(joined[k].log == "race");
      CHECK(joined[k].about == whole[k].about);
      CHECK(whole[k].tables.at("cuts").rows() == 0);
      CHECK((whole[k].tables.at("paths").rows() > 0) == (whole[k].variant != "best:no_poses"));
      for (const auto& [name, table] : whole[k].tables) {
        CAPTURE(name);
        if (name == "tracks" || name == "existence" || name == "parked_tracks") {
          CHECK(joined[k].tables.at(name).rows() == table.rows());  // ids have other names
          continue;
        }
        CHECK(io::read_whole_file(joined[k].folder + "/" + name + ".csv") ==
              io::read_whole_file(whole[k].folder + "/" + name + ".csv"));
      }
    }
    write_report(base + "/whole", false), write_report(base + "/joined", false);
    CHECK(io::read_whole_file(base + "/joined/metrics.json") == io::read_whole_file(base + "/whole/metrics.json"));
  }
}

TEST_CASE("pieces: with a short warm-up every frame is compared once, and a car's track keeps its id over the cuts") {
  const TempFolder folder;
  simulate_race(folder.path("race.mcap"), 3.0);
  RunOptions options;
  options.logs = {folder.path("race.mcap")};
  options.presets = {"best"};
  options.only_figures = options.quiet = true;
  run_piece(options, 0, -1, 0, folder.path("whole"));
  run_piece(options, 0, 2, 0.8, folder.path("a"));
  run_piece(options, 2, -1, 0.8, folder.path("b"));
  merge_runs({folder.path("a"), folder.path("b")}, folder.path("joined"));
  const Run whole = read_runs(folder.path("whole"))[0], joined = read_runs(folder.path("joined"))[0];
  for (const char* name : {"cars", "scans", "ego", "clusters"}) {
    CAPTURE(name);
    const Table &a = whole.tables.at(name), &b = joined.tables.at(name);
    REQUIRE(a.rows() == b.rows());
    for (std::size_t r = 0; r < a.rows(); ++r) CHECK(a.at(r, 0) == b.at(r, 0));
  }
  const auto of_car = [](const Run& run) {
    std::set<double> ids;
    const Table& t = run.tables.at("tracks");
    for (std::size_t r = 0; r < t.rows(); ++r)
      if (t.at(r, t.column("car")) >= 0 && t.at(r, t.column("confirmed")) > 0) ids.insert(t.at(r, t.column("id")));
    return ids.size();
  };
  CHECK(of_car(whole) == 1);
  CHECK(of_car(joined) == 1);
}

TEST_CASE("pieces: a piece of an indexed log is read from its warm-up on, with the same results") {
  if (bytes_read() < 0) {
    MESSAGE("skipped: the system does not count the bytes that a process reads");
    return;
  }
  const TempFolder folder;
  simulate_small_race(folder.path("race.mcap"));
  std::filesystem::create_directory(folder.path("plain"));
  copy_without_index(folder.path("race.mcap"), folder.path("plain/race.mcap"));
  RunOptions options;
  options.presets = {"paper", "best", "best:no_poses"};
  options.only_figures = options.quiet = true;
  for (const double from_s : {5.0, 10.0, 20.0}) {  // 20: after the end of the log
    CAPTURE(from_s);
    const std::string a = folder.path("a" + std::to_string(from_s)), b = folder.path("b" + std::to_string(from_s));
    options.logs = {folder.path("plain/race.mcap")};
    const int64_t from_start = bytes_of([&] { run_piece(options, from_s, from_s + 1, 1, a); });
    options.logs = {folder.path("race.mcap")};
    const int64_t by_index = bytes_of([&] { run_piece(options, from_s, from_s + 1, 1, b); });
    const int64_t hashed = bytes_of([&] { hash_input(options.logs[0], ""); });
    if (from_s == 10) CHECK(double(by_index - hashed) < 0.75 * double(from_start - hashed));
    const std::vector<Run> runs = read_runs(a), sought = read_runs(b);
    REQUIRE(runs.size() == options.presets.size());
    REQUIRE(sought.size() == runs.size());
    for (std::size_t k = 0; k < runs.size(); ++k) {
      CAPTURE(runs[k].variant);
      CHECK(sought[k].about.at("frames") == runs[k].about.at("frames"));
      if (from_s < 20) CHECK(runs[k].tables.at("clusters").rows() >= 10);
      for (const auto& [name, table] : runs[k].tables) {
        CAPTURE(name);
        CHECK(io::read_whole_file(sought[k].folder + "/" + name + ".csv") ==
              io::read_whole_file(runs[k].folder + "/" + name + ".csv"));
      }
    }
  }
}

TEST_CASE("pieces: the nearest tracks at a cut are one track; farther ones end and begin there") {
  // Frame 1 ends the first piece, and the warm-up of the second one.
  Run a = hand_made("0", "1", 0, 7, {{1, 7, 0, 0}, {1, 8, 10, 0}});
  SUBCASE("the nearest of two") {
    Run b = hand_made("1", "end", 2, 5, {{1, 5, 0.5, 0}, {1, 7, 1.5, 0}, {3, 5, 0, 0}});
    const Run whole = join_pieces({b, a});
    CHECK(ids_of(whole, "tracks") == std::vector<double>{7, 7, 7, 7});
    CHECK(ids_of(whole, "existence") == std::vector<double>{7, 7, 7, 7});
    CHECK(whole.about.at("frames") == "4");
    CHECK(whole.about.count("from_s") == 0);
    CHECK(whole.tables.at("cuts").rows() == 0);
  }
  SUBCASE("a new track gets an id that no other has") {
    Run b = hand_made("1", "end", 2, 7, {{1, 7, 4, 0}, {3, 7, 4, 0}});
    CHECK(ids_of(join_pieces({a, b}), "tracks") == std::vector<double>{7, 7, 8, 8});
  }
  SUBCASE("without a warm-up no track goes on") {
    Run b = hand_made("1", "end", 2, 7, {{3, 7, 0, 0}});
    CHECK(ids_of(join_pieces({a, b}), "tracks") == std::vector<double>{7, 7, 8, 8});
  }
  SUBCASE("over two cuts") {
    Run b = hand_made("1", "2", 2, 3, {{1, 3, 0, 1}, {3, 3, 20, 0}}), c = hand_made("2", "end", 4, 9, {{3, 9, 21, 0}});
    CHECK(ids_of(join_pieces({c, a, b}), "tracks") == std::vector<double>{7, 7, 7, 7, 7, 7});
  }
}

TEST_CASE("pieces: a repeated merge keeps the joined run; another run of this log is an error") {
  const TempFolder folder;
  const auto write = [&](const Run& run) {
    const std::string to = folder.path("parts") + "/runs/best/" + run.log;
    std::filesystem::create_directories(to);
    write_tables(to, run.tables);
    write_about(to, run.about);
  };
  write(hand_made("0", "1", 0, 7, {{1, 7, 0, 0}}));
  write(hand_made("1", "end", 2, 5, {{1, 5, 0.5, 0}}));
  const std::string out = folder.path("out"), joined = out + "/runs/best/log";
  const auto merge = [&] { merge_runs({folder.path("parts")}, out); };
  merge();
  const auto time = std::filesystem::last_write_time(joined + "/tracks.csv");
  CHECK(error_of(merge) == "");
  CHECK(std::filesystem::last_write_time(joined + "/tracks.csv") == time);
  REQUIRE(read_runs(out).size() == 1);
  CHECK(ids_of(read_runs(out)[0], "tracks") == std::vector<double>{7, 7, 7, 7});
  write(hand_made("1", "end", 2, 5, {{1, 5, 50, 0}}));  // another track
  CHECK(error_of(merge) == joined + ": differs in existence.csv from the pieces of best on log");
}

TEST_CASE("pieces: a missing, a doubled or a different piece is an error that names it") {
  const Run a = hand_made("0", "1", 0, 7, {}), b = hand_made("1", "2", 2, 7, {}), c = hand_made("2", "end", 4, 7, {});
  CHECK_NOTHROW(join_pieces({a, b, c}));
  CHECK_THROWS_WITH_AS(join_pieces({a, c}), doctest::Contains("no piece of best on log from 1 to 2 s"), io::Error);
  CHECK_THROWS_WITH_AS(join_pieces({b, c}), doctest::Contains("from 0 to 1 s"), io::Error);
  CHECK_THROWS_WITH_AS(join_pieces({a, b}), doctest::Contains("from 2 s to the end"), io::Error);
  CHECK_THROWS_WITH_AS(join_pieces({a, b, b, c}), doctest::Contains("overlaps"), io::Error);
  Run other = b;
  other.about["input"] = "another";
  CHECK_THROWS_WITH_AS(join_pieces({a, other, c}), doctest::Contains("differs in 'input'"), io::Error);
  CHECK_THROWS_WITH_AS(PieceTimes(2, 1, 0), doctest::Contains("is not after --from 2"), io::Error);
}
