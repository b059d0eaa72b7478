// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Words in messages: numbers with nouns, and suggestions for misspelled names.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace overtake::io {

// "1 gap", "3 gaps", "0 gaps"; pass a plural that is not noun + s.
std::string counted(int64_t count, std::string_view noun, std::string_view plural = {});

// The candidate with the fewest letters inserted, missing, changed or swapped with a neighbour, at most a third of the
// word's; else the only one that begins with the word. Ignores case. "": none is near.
std::string nearest_name(std::string_view word, const std::vector<std::string>& candidates);
// "; did you mean 'av21'?", or "" if no name is near.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace overtake::io
