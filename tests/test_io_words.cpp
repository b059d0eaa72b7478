// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/words.h"

#include <doctest/doctest.h>

using namespace overtake::io;

TEST_CASE("counted: one has no plural, none and many have") {
  CHECK(counted(1, "frame") == "1 frame");
  CHECK(counted(0, "frame") == "0 frames");
  CHECK(counted(-1, "frame") == "-1 frames");
  CHECK(counted(1'000'000'000'000, "point") == "1000000000000 points");
  CHECK(counted(1, "thing is", "things are") == "1 thing is");
  CHECK(counted(2, "thing is", "things are") == "2 things are");
}

TEST_CASE("nearest_name: a slip of the finger, the begin of one name, and nothing else") {
  const std::vector<std::string> commands = {"run",    "inspect", "track",    "info",
                                             "doctor", "scene",   "simulate", "evaluate"};
  CHECK(nearest_name("rnu", commands) == "run");        // two letters exchanged
  CHECK(nearest_name("rn", commands) == "run");         // one left out
  CHECK(nearest_name("ruun", commands) == "run");       // one too many
  CHECK(nearest_name("docter", commands) == "doctor");  // one changed
  CHECK(nearest_name("INFO", commands) == "info");      // case does not count
  CHECK(nearest_name("sim", commands) == "simulate");   // the only one that begins so
  CHECK(nearest_name("inf", commands) == "info");
  CHECK(nearest_name("s", commands).empty());
  CHECK(nearest_name("fly", commands).empty());
  CHECK(nearest_name("xyz", commands).empty());  // as far from run as from nothing
  CHECK(nearest_name("", commands).empty());
  CHECK(nearest_name("run", {}).empty());
  CHECK(nearest_name("in", {"inspect", "info"}).empty());  // two begin so
  CHECK(nearest_name("--rgi", {"--rig", "--ego"}) == "--rig");
  CHECK(nearest_name("tracker.confrm_hits", {"tracker.confirm_hits", "tracker.coast_s"}) == "tracker.confirm_hits");
  CHECK(nearest_name(std::string(1 << 20, 'r'), commands).empty());
  CHECK(did_you_mean("rnu", commands) == "; did you mean 'run'?");
  CHECK(did_you_mean("fly", commands).empty());
}
