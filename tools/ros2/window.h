// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Values of the last ten seconds: rates and quantiles for the diagnostics. One thread.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <vector>

namespace overtake::ros2 {

inline int64_t steady_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

class Window {
 public:
  static constexpr int64_t kLength_ns = 10'000'000'000;

  void add(int64_t now_ns, double value) {
    if (first_ns_ == 0) first_ns_ = now_ns;
    samples_.push_back({now_ns, value});
  }
  void pass(int64_t now_ns) {
    while (!samples_.empty() && samples_.front().at_ns < now_ns - kLength_ns) samples_.pop_front();
    passed_ns_ = now_ns;
  }
  std::size_t count() const { return samples_.size(); }
  // Per second, over the window or the time since the first value.
  double rate() const {
    const int64_t span_ns = std::min(kLength_ns, passed_ns_ - first_ns_);
    return samples_.empty() || span_ns <= 0 ? 0 : double(samples_.size()) * 1e9 / double(span_ns);
  }
  // share: 0.5 is the median. 0 without values.
  double quantile(double share) const {
    if (samples_.empty()) return 0;
    std::vector<double> values;
    for (const Sample& sample : samples_) values.push_back(sample.value);
    const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1) + 0.5);
    std::nth_element(values.begin(), at, values.end());
    return *at;
  }

 private:
  struct Sample {
    int64_t at_ns;
    double value;
  };
  std::deque<Sample> samples_;
  int64_t first_ns_ = 0, passed_ns_ = 0;
};

}  // namespace overtake::ros2
