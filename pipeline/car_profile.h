// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Where along a race car its returns come from. A distant car shows parts of itself only, by chance of the sensor's
// rows: nose, wheels, air box, wing. The heights of the points tell which parts they are, and so where the centre is.
#pragma once

#include <cstdint>

namespace overtake {

// Points on the axis of a heading, with their heights over the road: all of them or, of many, those of an evenly spread
// part of the pixels. Any order of add() keeps the same ones.
class PointsAlong {
 public:
  static constexpr int32_t kCapacity = 48;
  void add(int32_t pixel, float along_m, float height_m) noexcept;
  int32_t count() const { return count_; }
  float along_m(int32_t i) const { return along_m_[i]; }
  float height_m(int32_t i) const { return height_m_[i]; }

 private:
  uint64_t limit_ = uint64_t(1) << 32;  // pixels whose place is below it are kept: halved until they fit
  uint32_t place_[kCapacity];           // of the pixel in a sequence that spreads neighbours evenly
  float along_m_[kCapacity], height_m_[kCapacity];
  int32_t count_ = 0;
};

// Scores of a return by its place along the car and its height, for a car that is seen from one end: log likelihoods of
// a mixture of Gaussians, one for each face of the car. Sums of integers: any order gives the same bytes.
class CarProfile {
 public:
  // The length of the car that the faces are of. For a car of another length there is no profile.
  static constexpr float kLength_m = 4.921f, kLengthTolerance_m = 0.25f;

  enum class End { kRear, kFront };
  explicit CarProfile(End seen);

  // The centre, by the points of a car that lie within [low_m, high_m]: the mean over all places where they lie on the
  // car, each weighted with its likelihood. Of many points `independent` count, because a scan's points err together.
  // The heights are over a road whose own height has the deviation road_sigma_m: an error that all points share.
  // fits: false if there are no points, or if they look like no part of this car; then the rest is 0.
  struct Match {
    bool fits;
    float center_m, sigma_m;
  };
  Match match(const PointsAlong& points, float low_m, float high_m, float independent,
              float road_sigma_m) const noexcept;

 private:
  // Adds the scores of all points, raised by so many cells, to those of each centre.
  void sum_scores(const PointsAlong& points, float first_m, int32_t centers, int32_t raised,
                  int32_t* sum) const noexcept;

  static constexpr int32_t kPlaces = 110, kHeights = 28;  // cells of 0.05 m
  int16_t score_[kHeights][kPlaces];                      // the places run from the front to the rear
};

}  // namespace overtake
