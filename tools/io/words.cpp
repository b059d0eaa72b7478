// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/words.h"

#include <algorithm>

#include "tools/io/text.h"

namespace overtake::io {
namespace {

// Optimal string alignment distance; three rows of its table.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before, last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before = last;
    std::swap(last, row);
  }
  return last[b.size()];
}

}  // namespace

std::string counted(int64_t count, std::string_view noun, std::string_view plural) {
  std::string text = std::to_string(count) + " ";
  if (count == 1) return text.append(noun);
  return plural.empty() ? text.append(noun) + "s" : text.append(plural);
}

std::string nearest_name(std::string_view word, const std::vector<std::string>& candidates) {
  if (word.size() > 100) return "";  // longer than every name; the distance takes time quadratic in the length
  const std::string wanted = lower_case(word);
  std::string nearest, only;
  std::size_t least = std::max<std::size_t>(1, wanted.size() / 3) + 1, begin_alike = 0;
  for (const std::string& candidate : candidates) {
    const std::string name = lower_case(candidate);
    const std::size_t distance = edit_distance(wanted, name);
    if (distance < least && distance < name.size()) least = distance, nearest = candidate;
    if (wanted.size() > 1 && name.starts_with(wanted)) ++begin_alike, only = candidate;
  }
  if (nearest.empty() && begin_alike == 1) return only;
  return nearest;
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string name = nearest_name(word, candidates);
  return name.empty() ? "" : "; did you mean '" + name + "'?";
}

}  // namespace overtake::io
