// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of a race show the scene's content.
#include <doctest/doctest.h>

#include <string>

#include "tests/support/temp_folder.h"
#include "tools/sim/material.h"
#include "tools/view/race_picture.h"
#include "tools/view/scan_picture.h"

using namespace overtake;
using namespace overtake::sim;

namespace {

int32_t count_color(const std::string& path, uint16_t surface, int32_t from_y) {
  const io::Picture picture = io::read_png(path);
  const io::Rgb wanted = cli::surface_color(surface);
  int32_t count = 0;
  for (std::size_t i = std::size_t(from_y) * std::size_t(picture.width); i < picture.pixels.size(); ++i)
    count += picture.pixels[i] == wanted;
  return count;
}

}  // namespace

TEST_CASE("sim: pictures show the track, the scan and the car ahead, and no car where there is none") {
  const TempFolder folder;
  const auto car = uint16_t(uint16_t(Surface::car) + 1);
  constexpr int32_t kSurfacePanel = 460, kPanelEnd = 440 + 420 - 10;  // without the legend's line
  int32_t seen[2] = {};
  for (const char* name : {"demo", "empty_track"}) {
    Simulator simulator(load_scenario(name), 1, 2, 2);
    cli::write_race_pictures(folder.path(name), simulator, 1.0);
    for (const char* sensor : {"front", "left", "right"}) {
      const io::Picture picture = io::read_png(folder.path(std::string(name) + "/" + sensor + ".png"));
      CHECK(picture.width >= 1400);
      int32_t road = 0, opponent = 0;
      for (int32_t y = kSurfacePanel; y < kPanelEnd; ++y)
        for (int32_t x = 0; x < 1400; ++x) {
          road += picture.pixels[std::size_t(y) * std::size_t(picture.width) + std::size_t(x)] ==
                  cli::surface_color(uint16_t(Surface::road));
          opponent +=
              picture.pixels[std::size_t(y) * std::size_t(picture.width) + std::size_t(x)] == cli::surface_color(car);
        }
      CHECK(road > 1000);
      seen[std::string(name) == "demo" ? 0 : 1] += opponent;
    }
    const std::string above = folder.path(std::string(name) + "/above.png");
    CHECK(count_color(above, uint16_t(Surface::road), 0) > 1000);
    CHECK((count_color(above, car, 60) > 100) == (std::string(name) == "demo"));  // below the captions
  }
  CHECK(seen[0] > 50);
  CHECK(seen[1] == 0);
}
