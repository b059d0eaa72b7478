// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Pieces of a log, so that one log is many jobs. A piece is the frames whose first scan is from `from_s` until before
// `to_s` after the log's first scan. The pipeline starts `warm_up_s` earlier; these frames are compared with nothing.
// The truth is read further, as far as predicted paths reach. Every frame is in one piece.
//
// A track at a cut. Each piece names its tracks by itself. The tracks of the frame before a cut are known twice: as the
// end of one piece, and as the end of the next one's warm-up. Two of them are one track if they are the nearest pair
// that is left and at most kCutPlaceM apart. Its id goes on. Any other track ends at the cut, or begins there.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/evaluation/kept_runs.h"
#include "tools/evaluation/run_logs.h"

namespace overtake::evaluation {

inline constexpr double kCutPlaceM = 2;
inline constexpr int64_t kLookAheadNs = 3'500'000'000;  // more than the longest horizon of a path

class PieceTimes {
 public:
  // to_s negative: until the end. Throws io::Error.
  PieceTimes(double from_s, double to_s, double warm_up_s);
  bool is_whole() const { return from_s_ == 0 && to_s_ < 0; }
  // After the log's first scan.
  int64_t warm_up_ns() const;
  int64_t begin_ns() const { return ns_of(from_s_); }
  int64_t end_ns() const { return to_s_ < 0 ? INT64_MAX - kLookAheadNs : ns_of(to_s_); }
  // The name of the piece's results; that of the log if the piece is whole.
  std::string name_of(const std::string& log) const;
  // The keys of a piece: log, from_s, to_s, warm_up_s. None if it is whole.
  void add_to(About& about, const std::string& log) const;

 private:
  static int64_t ns_of(double seconds);
  double from_s_, to_s_, warm_up_s_;
};

int64_t first_stamp(const LogFrame& frame);
inline bool is_piece(const Run& run) { return run.about.count("from_s") > 0; }
// The run of the log from all its pieces, in any order. Throws io::Error if one is missing or of other options.
Run join_pieces(std::vector<Run> pieces);

}  // namespace overtake::evaluation
