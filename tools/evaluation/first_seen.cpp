// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/first_seen.h"

#include <map>

namespace overtake::evaluation {

FirstSeen first_seen(const std::vector<Run>& runs, const std::string& variant, const std::string& scenario) {
  std::vector<double> detected_s, confirmed_m;
  for (const Run& run : runs) {
    const auto of = run.about.find("scenario");
    if (run.variant != variant || (of == run.about.end() ? run.log : of->second) != scenario) continue;
    const Table& cars = run.tables.at("cars");
    const std::size_t car = cars.column("car"), time = cars.column("time_s"), ahead = cars.column("ahead_m"),
                      detections = cars.column("detections"), confirmed = cars.column("confirmed");
    struct Firsts {
      double there_s = 0;
      bool detected = false, confirmed = false;
    };
    std::map<double, Firsts> of_car;
    for (std::size_t r = 0; r < cars.rows(); ++r) {
      if (cars.at(r, ahead) < kNearestM || cars.at(r, ahead) >= kFarthestM) continue;
      Firsts& f = of_car.try_emplace(cars.at(r, car), Firsts{cars.at(r, time)}).first->second;
      if (!f.detected && cars.at(r, detections) > 0) {
        f.detected = true;
        detected_s.push_back(cars.at(r, time) - f.there_s);
      }
      if (!f.confirmed && cars.at(r, confirmed) > 0) {
        f.confirmed = true;
        confirmed_m.push_back(cars.at(r, ahead));
      }
    }
  }
  return {metrics::summarize(detected_s), metrics::summarize(confirmed_m)};
}

}  // namespace overtake::evaluation
