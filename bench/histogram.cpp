// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "bench/histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>

namespace overtake::bench {
namespace {

constexpr int32_t kHalf = Histogram::kSubBuckets / 2;
constexpr int32_t kHalfBits = 10;
constexpr int32_t kTicksPerHalving = 5;

template <class... Values>
void append(std::string& text, const char* format, Values... values) {
  char line[160];
  std::snprintf(line, sizeof line, format, values...);
  text += line;
}

}  // namespace

int32_t Histogram::bucket_of(int64_t value) {
  const int32_t shift = std::max(0, int32_t(std::bit_width(uint64_t(value))) - (kHalfBits + 1));
  return shift * kHalf + int32_t(value >> shift);
}

int64_t Histogram::bucket_lowest(int32_t bucket) {
  const int32_t shift = std::max(0, bucket / kHalf - 1);
  return int64_t(bucket - shift * kHalf) << shift;
}

double Histogram::middle_of(int32_t bucket) const {
  return 0.5 * (double(bucket_lowest(bucket)) + double(bucket_highest(bucket)));
}

void Histogram::record(int64_t value) {
  value = std::max<int64_t>(value, 0);
  const auto bucket = std::size_t(bucket_of(value));
  if (bucket >= counts_.size()) counts_.resize(bucket + 1, 0);
  ++counts_[bucket];
  ++count_;
  min_ = std::min(min_, value);
  max_ = std::max(max_, value);
}

void Histogram::add(const Histogram& other) {
  if (other.counts_.size() > counts_.size()) counts_.resize(other.counts_.size(), 0);
  for (std::size_t i = 0; i < other.counts_.size(); ++i) counts_[i] += other.counts_[i];
  count_ += other.count_;
  min_ = std::min(min_, other.min_);
  max_ = std::max(max_, other.max_);
}

double Histogram::mean() const {
  double sum = 0;
  for (std::size_t i = 0; i < counts_.size(); ++i) sum += double(counts_[i]) * middle_of(int32_t(i));
  return count_ ? sum / double(count_) : 0;
}

double Histogram::deviation() const {
  const double m = mean();
  double sum = 0;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    const double d = middle_of(int32_t(i)) - m;
    sum += double(counts_[i]) * d * d;
  }
  return count_ ? std::sqrt(sum / double(count_)) : 0;
}

int64_t Histogram::percentile(double percent) const {
  // The small subtraction removes the rounding error of, for example, 99.9 / 100 * 1000.
  const double rank = std::ceil(std::clamp(percent, 0.0, 100.0) / 100.0 * double(count_) - 1e-6);
  const int64_t wanted = std::max<int64_t>(1, int64_t(rank));
  int64_t seen = 0;
  for (std::size_t i = 0; i < counts_.size(); ++i)
    if ((seen += counts_[i]) >= wanted) return std::min(bucket_highest(int32_t(i)), max_);
  return max_;
}

std::string Histogram::format_hgrm(double unit) const {
  std::string text;
  append(text, "%12s %14s %10s %14s\n\n", "Value", "Percentile", "TotalCount", "1/(1-Percentile)");
  double level = 0;
  int64_t seen = 0;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    if (!counts_[i]) continue;
    seen += counts_[i];
    const double value = double(std::min(bucket_highest(int32_t(i)), max_)) / unit;
    while (level < 100 && 100.0 * double(seen) / double(count_) >= level) {
      append(text, "%12.3f %2.12f %10lld %14.2f\n", value, level / 100, static_cast<long long>(seen),
             1 / (1 - level / 100));
      const double halvings = std::floor(std::log2(100 / (100 - level))) + 1;
      level += 100 / (kTicksPerHalving * std::exp2(halvings));
      if (seen == count_) break;  // one line with the last value, then the end
    }
  }
  append(text, "%12.3f %2.12f %10lld\n", double(max_) / unit, 1.0, static_cast<long long>(count_));
  append(text, "#[Mean    = %12.3f, StdDeviation   = %12.3f]\n", mean() / unit, deviation() / unit);
  append(text, "#[Max     = %12.3f, Total count    = %12lld]\n", double(max_) / unit, static_cast<long long>(count_));
  append(text, "#[Buckets = %12d, SubBuckets     = %12d]\n", std::max(1, int32_t(counts_.size()) / kHalf), kSubBuckets);
  return text;
}

}  // namespace overtake::bench
