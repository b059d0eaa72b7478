// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/metrics/hota.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "tools/evaluation/metrics/assignment.h"

namespace overtake::metrics {
namespace {

using Ids = std::pair<uint64_t, uint64_t>;  // object, track

struct Match {
  Ids ids;
  double likeness;
};

}  // namespace

HotaResult Hota::result() const {
  const auto likeness = [&](const MotPlace& a, const MotPlace& b) {
    const double d = std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
    return d < zero_m_ ? 1 - d / zero_m_ : 0.0;
  };
  // How well two ids fit: the sum of their similarity's share in each frame, over the frames in which either exists.
  std::map<uint64_t, int64_t> object_frames, track_frames;
  std::map<Ids, double> together;
  int64_t objects = 0, tracks = 0;
  for (const Frame& f : frames_) {
    objects += int64_t(f.objects.size()), tracks += int64_t(f.tracks.size());
    for (const MotPlace& o : f.objects) ++object_frames[o.id];
    std::vector<double> of_track(f.tracks.size(), 0);
    for (std::size_t j = 0; j < f.tracks.size(); ++j) {
      ++track_frames[f.tracks[j].id];
      for (const MotPlace& o : f.objects) of_track[j] += likeness(o, f.tracks[j]);
    }
    for (const MotPlace& o : f.objects) {
      double of_object = 0;
      for (const MotPlace& t : f.tracks) of_object += likeness(o, t);
      for (std::size_t j = 0; j < f.tracks.size(); ++j)
        if (const double s = likeness(o, f.tracks[j]); s > 0)
          together[{o.id, f.tracks[j].id}] += s / (of_object + of_track[j] - s);
    }
  }
  for (auto& [ids, share] : together)
    share /= double(object_frames[ids.first]) + double(track_frames[ids.second]) - share;

  std::vector<Match> matches;
  for (const Frame& f : frames_) {
    const int32_t n = int32_t(f.objects.size()), m = int32_t(f.tracks.size());
    if (n == 0 || m == 0) continue;
    const std::vector<int32_t> column = assign(n, m, 0.0, [&](int32_t i, int32_t j) {
      const MotPlace &o = f.objects[std::size_t(i)], &t = f.tracks[std::size_t(j)];
      const double s = likeness(o, t);
      return s > 0 ? -s * together[{o.id, t.id}] : kForbidden;
    });
    for (int32_t i = 0; i < n; ++i)
      if (const int32_t j = column[std::size_t(i)]; j >= 0) {
        const MotPlace &o = f.objects[std::size_t(i)], &t = f.tracks[std::size_t(j)];
        matches.push_back({{o.id, t.id}, likeness(o, t)});
      }
  }

  HotaResult r;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  if (objects + tracks == 0) return {nan, nan, nan, nan, std::vector<double>(19, nan)};
  double localised = 0;
  int32_t with_pairs = 0;
  for (int32_t a = 1; a <= 19; ++a) {
    const double alpha = 0.05 * a - 1e-9;
    std::map<Ids, int64_t> pairs;
    double alike = 0;
    int64_t tp = 0;
    for (const Match& c : matches)
      if (c.likeness >= alpha) ++pairs[c.ids], ++tp, alike += c.likeness;
    double association = 0;
    for (const auto& [ids, count] : pairs)
      association +=
          double(count) * double(count) / double(object_frames[ids.first] + track_frames[ids.second] - count);
    const double det = double(tp) / double(objects + tracks - tp);
    const double ass = tp > 0 ? association / double(tp) : 0;
    r.hota_of_alpha.push_back(std::sqrt(det * ass));
    r.hota += r.hota_of_alpha.back() / 19, r.detection += det / 19, r.association += ass / 19;
    if (tp > 0) localised += alike / double(tp), ++with_pairs;
  }
  r.localisation = with_pairs > 0 ? localised / with_pairs : nan;
  return r;
}

}  // namespace overtake::metrics
