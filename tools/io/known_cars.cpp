// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/known_cars.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "tools/io/angles.h"

namespace overtake::io {
namespace {

constexpr std::size_t kMostBytes = 1 << 20, kMostCars = 256, kMostStates = 256;
constexpr int64_t kMostBeyond_ns = 100'000'000;

double between(double a, double b, double share) { return a + share * (b - a); }

}  // namespace

void KnownCars::add(std::string_view text) {
  if (text.size() > kMostBytes) throw std::runtime_error("the states of the cars are longer than 1 MiB");
  States states;
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    states.stamp_ns = json.at("stamp_ns").get<int64_t>();
    double own_z_m = std::nan("");
    for (const auto& car : json.at("cars")) {
      if (car.at("is_ego").get<bool>()) {
        own_z_m = car.at("z_m");
        continue;
      }
      if (states.cars.size() < kMostCars)
        states.cars.push_back({car.at("car"), car.at("name"), car.at("x_m"), car.at("y_m"), car.at("z_m"),
                               car.at("heading_rad"), car.at("speed_mps"), car.at("length_m"), car.at("width_m")});
    }
    for (KnownCar& car : states.cars) car.z_m -= own_z_m;
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(std::string("the states of the cars cannot be read: ") + error.what());
  }
  if (states.stamp_ns < 0) return;
  if (!states_.empty() && states.stamp_ns <= states_.back().stamp_ns) return;
  states_.push_back(std::move(states));
  if (states_.size() > kMostStates) states_.pop_front();
}

std::vector<KnownCar> KnownCars::at(int64_t stamp_ns) const {
  auto after = std::lower_bound(states_.begin(), states_.end(), stamp_ns,
                                [](const States& states, int64_t t) { return states.stamp_ns < t; });
  if (after == states_.end() && states_.size() > 1 && stamp_ns - states_.back().stamp_ns <= kMostBeyond_ns) --after;
  if (after == states_.end()) return {};
  if (after->stamp_ns == stamp_ns) return after->cars;
  if (after == states_.begin()) return {};
  const States& before = *(after - 1);
  const double share =
      (double(stamp_ns) - double(before.stamp_ns)) / (double(after->stamp_ns) - double(before.stamp_ns));
  std::vector<KnownCar> cars;
  for (const KnownCar& a : before.cars) {
    const auto b =
        std::find_if(after->cars.begin(), after->cars.end(), [&](const KnownCar& c) { return c.id == a.id; });
    if (b == after->cars.end()) continue;
    KnownCar car = a;
    car.x_m = between(a.x_m, b->x_m, share);
    car.y_m = between(a.y_m, b->y_m, share);
    car.z_m = between(a.z_m, b->z_m, share);
    car.heading_rad = wrap_angle(a.heading_rad + share * wrap_angle(b->heading_rad - a.heading_rad));
    car.speed_mps = between(a.speed_mps, b->speed_mps, share);
    cars.push_back(std::move(car));
  }
  return cars;
}

}  // namespace overtake::io
