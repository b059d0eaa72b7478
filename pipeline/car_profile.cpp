// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/car_profile.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/math.h"

namespace overtake {
namespace {

// A face that an end of the car shows: its place ahead of the centre and its height, m, and the share of the returns.
struct Face {
  double along_m, along_sigma_m, height_m, height_sigma_m, share;
};
// A Dallara AV-21 (length, wheel base and tyres as published), by the returns of simulated scans from all distances.
constexpr Face kFromAhead[] = {
    {2.37, 0.10, 0.21, 0.09, 0.06},   // nose
    {2.09, 0.10, 0.24, 0.07, 0.12},   // front wing
    {1.61, 0.12, 0.40, 0.10, 0.15},   // front tyres
    {1.11, 0.24, 0.47, 0.10, 0.08},   // suspension, tub
    {0.63, 0.11, 0.63, 0.07, 0.12},   // cockpit
    {0.44, 0.10, 0.35, 0.11, 0.11},   // side pods
    {0.11, 0.27, 0.58, 0.14, 0.07},   // head rest
    {-0.16, 0.14, 0.82, 0.07, 0.04},  // air box
    {-0.43, 0.10, 0.98, 0.09, 0.04},  // its top
    {-1.16, 0.10, 0.22, 0.09, 0.02},  // floor
    {-1.34, 0.10, 0.45, 0.10, 0.08},  // rear tyres
    {-1.92, 0.10, 0.60, 0.11, 0.05},  // rear wing,
    {-2.29, 0.10, 0.70, 0.07, 0.02},  // its end plates,
    {-2.35, 0.10, 0.36, 0.07, 0.01},  // and crash structure
};
// In recorded scans the rear tyres are 0.13 m nearer to the car's end than in simulated ones. Here they are 0.08 m
// nearer, with a deviation that covers both cars.
constexpr Face kFromBehind[] = {
    {-2.45, 0.10, 0.64, 0.07, 0.10},  // rear wing,
    {-2.22, 0.10, 0.51, 0.07, 0.02},  // its end plates,
    {-2.40, 0.10, 0.30, 0.07, 0.07},  // and crash structure
    {-1.92, 0.14, 0.28, 0.14, 0.29},  // rear tyres,
    {-1.81, 0.15, 0.48, 0.07, 0.12},  // their upper half
    {-1.63, 0.33, 0.04, 0.07, 0.03},  // diffuser
    {-1.23, 0.10, 0.21, 0.13, 0.10},  // floor
    {-1.13, 0.13, 0.77, 0.07, 0.05},  // engine cover
    {-0.64, 0.10, 0.98, 0.08, 0.03},  // air box
    {-0.37, 0.32, 0.48, 0.13, 0.09},  // side pods
    {0.40, 0.10, 0.62, 0.07, 0.02},   // mirrors
    {1.15, 0.10, 0.33, 0.14, 0.06},   // front tyres,
    {1.18, 0.10, 0.48, 0.07, 0.01},   // their upper half
    {1.93, 0.10, 0.24, 0.08, 0.01},   // front wing
};
constexpr double kOther = 0.06;                        // share of the returns of no face
constexpr double kOtherOnCar = 0.2, kOtherOff = 0.01;  // their density, 1 / m^2
constexpr double kTop_m = 1.0;                         // of the car

constexpr double kCell_m = 0.05, kFirst_m = -2.75, kLowest_m = -0.2;
constexpr double kUnit = 256.0;      // of a score
constexpr float kBeyond_m = 0.1f;    // points may lie so far beyond an end of the car
constexpr float kLeastFit = -2.4f;   // mean log likelihood of a point; of 100 cars 99 have more
constexpr double kUnlikely = 12.0;   // places that are exp(this) less likely than the best one do not count
constexpr double kMostSigmas = 3.0;  // of the height of the road,
constexpr int32_t kMostRaised = 6;   // at most so many cells

double gaussian(double x, double mean, double sigma) {
  const double z = (x - mean) / sigma;
  return exp_f64(-std::min(0.5 * z * z, 600.0)) / sigma;
}

}  // namespace

void PointsAlong::add(int32_t pixel, float along_m, float height_m) noexcept {
  constexpr uint32_t kGolden = 2654435769u;  // 2^32 over the golden ratio: multiples of it lie evenly
  const uint32_t place = uint32_t(pixel) * kGolden;
  while (place < limit_ && count_ == kCapacity) {
    limit_ /= 2;
    int32_t kept = 0;
    for (int32_t i = 0; i < count_; ++i) {
      if (place_[i] >= limit_) continue;
      place_[kept] = place_[i];
      along_m_[kept] = along_m_[i];
      height_m_[kept++] = height_m_[i];
    }
    count_ = kept;
  }
  if (place >= limit_) return;
  place_[count_] = place;
  along_m_[count_] = along_m;
  height_m_[count_++] = height_m;
}

CarProfile::CarProfile(End seen) {
  const std::span<const Face> faces = seen == End::kRear ? std::span<const Face>(kFromBehind) : kFromAhead;
  const auto place_of = [](int32_t i) { return kFirst_m + (i + 0.5) * kCell_m; };
  const auto height_of = [](int32_t h) { return kLowest_m + (h + 0.5) * kCell_m; };
  double density[kHeights][kPlaces] = {};
  for (const Face& f : faces) {
    double at_place[kPlaces];
    for (int32_t i = 0; i < kPlaces; ++i) at_place[i] = gaussian(place_of(i), f.along_m, f.along_sigma_m);
    for (int32_t h = 0; h < kHeights; ++h) {
      const double at_height = f.share / kTwoPi * gaussian(height_of(h), f.height_m, f.height_sigma_m);
      for (int32_t i = 0; i < kPlaces; ++i) density[h][i] += at_height * at_place[i];
    }
  }
  for (int32_t h = 0; h < kHeights; ++h)
    for (int32_t i = 0; i < kPlaces; ++i) {
      const bool on_car =
          std::fabs(place_of(i)) < 0.5 * double(kLength_m) && height_of(h) >= 0.0 && height_of(h) < kTop_m;
      const double with_others = (1.0 - kOther) * density[h][i] + kOther * (on_car ? kOtherOnCar : kOtherOff);
      score_[h][kPlaces - 1 - i] = int16_t(std::floor(kUnit * log_f64(with_others) + 0.5));
    }
}

void CarProfile::sum_scores(const PointsAlong& points, float first_m, int32_t centers, int32_t raised,
                            int32_t* sum) const noexcept {
  constexpr float kPerMetre = float(1.0 / kCell_m);
  for (int32_t k = 0; k < points.count(); ++k) {
    const float place = (points.along_m(k) - first_m - float(kFirst_m)) * kPerMetre;
    const float height = (points.height_m(k) - float(kLowest_m)) * kPerMetre;
    const int32_t h = int32_t(std::clamp(height, 0.0f, float(kHeights - 1)));
    const int32_t i = int32_t(std::clamp(place, float(centers - 1), float(kPlaces - 1)));
    const int16_t* const score = score_[std::clamp(h + raised, 0, kHeights - 1)] + kPlaces - 1 - i;
    for (int32_t c = 0; c < centers; ++c) sum[c] += score[c];
  }
}

CarProfile::Match CarProfile::match(const PointsAlong& points, float low_m, float high_m, float independent,
                                    float road_sigma_m) const noexcept {
  constexpr float kPerMetre = float(1.0 / kCell_m), kReach_m = 0.5f * kLength_m + kBeyond_m;
  constexpr int32_t kMostCenters = kPlaces;
  if (points.count() == 0) return {};
  // The centres at which all points lie on the car: from first_m, a cell apart.
  float first_m = high_m - kReach_m, last_m = low_m + kReach_m;
  if (first_m > last_m) first_m = last_m = 0.5f * (low_m + high_m);
  const int32_t centers = std::min(1 + int32_t((last_m - first_m) * kPerMetre), kMostCenters);
  // The road may be some cells lower than the one that the heights are over, or higher: then the points are raised.
  const double cell_sigmas = kCell_m / std::max(double(road_sigma_m), 1e-3);
  const int32_t most = int32_t(std::min(kMostSigmas / cell_sigmas, double(kMostRaised)));
  const int32_t roads = 2 * most + 1;
  int32_t sum[2 * kMostRaised + 1][kMostCenters] = {};
  int32_t best = INT32_MIN;
  for (int32_t r = 0; r < roads; ++r) {
    sum_scores(points, first_m, centers, r - most, sum[r]);
    best = std::max(best, *std::max_element(sum[r], sum[r] + centers));
  }
  if (float(best) < kLeastFit * float(kUnit) * float(points.count())) return {};
  const double share = std::min(1.0, double(independent) / points.count()) / kUnit;
  double weights = 0.0, mean = 0.0, square = 0.0;
  for (int32_t r = 0; r < roads; ++r) {
    const double raised = (r - most) * cell_sigmas;
    for (int32_t c = 0; c < centers; ++c) {
      const double less = share * double(best - sum[r][c]) + 0.5 * raised * raised;
      if (less > kUnlikely) continue;
      const double weight = exp_f64(-less), at_m = c * kCell_m;
      weights += weight;
      mean += weight * at_m;
      square += weight * at_m * at_m;
    }
  }
  mean /= weights;
  const double variance = std::max(square / weights - mean * mean, 0.0);
  return {true, first_m + float(mean), float(std::sqrt(variance))};
}

}  // namespace overtake
