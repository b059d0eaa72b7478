// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/metrics/consistency.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace overtake::metrics {

// Cholesky P = L L^T, then |L^-1 e|^2.
double normalized_square(const double* error, const double* lower, int32_t n) {
  double l[8][8] = {}, y[8] = {}, sum = 0;
  for (int32_t i = 0; i < n; ++i) {
    for (int32_t j = 0; j <= i; ++j) {
      double rest = lower[i * (i + 1) / 2 + j];
      for (int32_t k = 0; k < j; ++k) rest -= l[i][k] * l[j][k];
      if (i != j)
        l[i][j] = rest / l[j][j];
      else if (rest > 0)
        l[i][i] = std::sqrt(rest);
      else
        return std::numeric_limits<double>::quiet_NaN();
    }
    y[i] = error[i];
    for (int32_t k = 0; k < i; ++k) y[i] -= l[i][k] * y[k];
    y[i] /= l[i][i];
    sum += y[i] * y[i];
  }
  return sum;
}

void Continuity::add(double time_s, uint64_t object, bool followed) {
  auto it = open_.find(object);
  if (it != open_.end() && time_s - it->second.presence.end_s > away_s_) {
    done_.push_back(close(it->second));
    open_.erase(it);
    it = open_.end();
  }
  if (it == open_.end()) {
    State fresh;
    fresh.presence = {object, time_s, time_s, std::numeric_limits<double>::quiet_NaN(), 0};
    it = open_.emplace(object, fresh).first;
  }
  State& s = it->second;
  s.presence.end_s = time_s;
  if (!followed) return;
  if (s.ever)
    s.presence.longest_gap_s = std::max(s.presence.longest_gap_s, time_s - s.last_followed_s);
  else
    s.presence.time_to_confirm_s = time_s - s.presence.begin_s;
  s.ever = true, s.last_followed_s = time_s;
}

Presence Continuity::close(const State& state) {
  Presence p = state.presence;
  if (state.ever) p.longest_gap_s = std::max(p.longest_gap_s, p.end_s - state.last_followed_s);
  return p;
}

std::vector<Presence> Continuity::presences() const {
  std::vector<Presence> all = done_;
  for (const auto& [object, state] : open_) all.push_back(close(state));
  return all;
}

int64_t FalseTracks::count() const {
  return std::count_if(seen_.begin(), seen_.end(), [&](uint64_t track) { return !good_.count(track); });
}

double FalseTracks::per_hour(double seconds) const {
  return seconds > 0 ? double(count()) * 3600 / seconds : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace overtake::metrics
