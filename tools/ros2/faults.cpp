// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/ros2/faults.h"

#include <algorithm>

namespace overtake::ros2 {

void Faults::put(const Fault& fault) {
  for (Fault& old : faults_)
    if (old.part == fault.part && old.kind == fault.kind) {
      old.level = fault.level;
      old.sentence = fault.sentence;
      old.until_ns = fault.until_ns;
      return;
    }
  faults_.push_back(fault);
  print_(fault.part + ": " + fault.sentence);
}

void Faults::raise(const std::string& part, const std::string& kind, Level level, const std::string& sentence,
                   int64_t now_ns) {
  put({part, kind, sentence, level, now_ns, INT64_MAX});
}

void Faults::lower(const std::string& part, const std::string& kind, const std::string& over) {
  const auto is_it = [&](const Fault& fault) { return fault.part == part && fault.kind == kind; };
  if (std::erase_if(faults_, is_it) > 0 && !over.empty()) print_(part + ": " + over);
}

void Faults::note(const std::string& part, const std::string& kind, Level level, const std::string& sentence,
                  int64_t now_ns) {
  put({part, kind, sentence, level, now_ns, now_ns + kEvent_ns});
}

void Faults::pass(int64_t now_ns) {
  std::erase_if(faults_, [&](const Fault& fault) { return fault.until_ns <= now_ns; });
}

std::vector<Faults::Fault> Faults::of(const std::string& part) const {
  std::vector<Fault> out;
  std::copy_if(faults_.begin(), faults_.end(), std::back_inserter(out),
               [&](const Fault& fault) { return fault.part == part; });
  const auto weight = [](Level level) { return level == Level::kError ? 3 : level == Level::kStale ? 2 : int(level); };
  std::reverse(out.begin(), out.end());
  std::stable_sort(out.begin(), out.end(),
                   [&](const Fault& a, const Fault& b) { return weight(a.level) > weight(b.level); });
  return out;
}

}  // namespace overtake::ros2
