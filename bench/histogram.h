// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Counts of durations with three significant digits from one nanosecond to centuries (the idea of Gil Tene's
// HdrHistogram): one bucket per value below 2,048, then 1,024 buckets per power of two.
//
//   value      0 ... 2047 | 2048 ... 4095 | 4096 ... 8191 | ...
//   width            1    |       2       |       4       |        a bucket is at most 1/1024 of its values
//   buckets       2,048   |     1,024     |     1,024     |
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace overtake::bench {

class Histogram {
 public:
  void record(int64_t value);  // a negative value counts as 0
  void add(const Histogram& other);

  int64_t count() const { return count_; }
  int64_t min() const { return count_ ? min_ : 0; }
  int64_t max() const { return max_; }  // exact, like min
  double mean() const;                  // mean and percentile use the buckets' middles
  double deviation() const;
  // The value that `percent` of all values do not exceed (nearest rank), at most 1/1024 too large; 0 if empty.
  int64_t percentile(double percent) const;

  // HdrHistogram's percentile text (.hgrm, five steps per halving of the remainder), values divided by `unit`.
  std::string format_hgrm(double unit) const;

  static constexpr int32_t kSubBuckets = 2048;
  static int32_t bucket_of(int64_t value);
  static int64_t bucket_lowest(int32_t bucket);
  static int64_t bucket_highest(int32_t bucket) { return bucket_lowest(bucket + 1) - 1; }

 private:
  double middle_of(int32_t bucket) const;
  std::vector<int64_t> counts_;  // up to the largest value
  int64_t count_ = 0, min_ = INT64_MAX, max_ = 0;
};

}  // namespace overtake::bench
