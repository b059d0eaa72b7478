// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/words.h"

#include <doctest/doctest.h>

using namespace overtake::io;

TEST_CASE("counted: one is singular, none and many are plural") {
  CHECK(counted(1, "frame") == "1 frame");
  CHECK(counted(0, "frame") == "0 frames");
  CHECK(counted(-1, "frame") == "-1 frames");
  CHECK(counted(1'000'000'000'000, "point") == "1000000000000 points");
  CHECK(counted(1, "thing is", "things are") == "1 thing is");
  CHECK(counted(2, "thing is", "things are") == "2 things are");
}

TEST_CASE("nearest_name: finds a typing error and the start of one name, and nothing else") {
  const std::vector<std::string> commands = {"run",    "inspect", "track",    "info",
                                             "doctor", "scene",   "simulate", "evaluate"};
  CHECK(nearest_name("rnu", commands) == "run");        // two letters swapped
  CHECK(nearest_name("rn", commands) == "run");         // one missing
  CHECK(nearest_name("ruun", commands) == "run");       // one too many
  CHECK(nearest_name("docter", commands) == "doctor");  // one changed
  CHECK(nearest_name("INFO", commands) == "info");      // case is ignored
  CHECK(nearest_name("sim", commands) == "simulate");   // the only one with this start
  CHECK(nearest_name("inf", commands) == "info");
  CHECK(nearest_name("s", commands).empty());
  CHECK(nearest_name("fly", commands).empty());
  CHECK(nearest_name("xyz", commands).empty());  // too far from every name
  CHECK(nearest_name("", commands).empty());
  CHECK(nearest_name("run", {}).empty());
  CHECK(nearest_name("in", {"inspect", "info"}).empty());  // two names have this start
  CHECK(nearest_name("--rgi", {"--rig", "--ego"}) == "--rig");
  CHECK(nearest_name("tracker.confrm_hits", {"tracker.confirm_hits", "tracker.coast_s"}) == "tracker.confirm_hits");
  CHECK(nearest_name(std::string(1 << 20, 'r'), commands).empty());
  CHECK(did_you_mean("rnu", commands) == "; did you mean 'run'?");
  CHECK(did_you_mean("fly", commands).empty());
}
