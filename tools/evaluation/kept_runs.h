// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// about.json of a run: what was run, and what a later command must agree with to keep the run.
//
//   commit       of the build
//   every        frames between two that the run, one of a sweep, was given, or that the baselines judged beside it;
//                "none": every frame, no baselines
//   frame_limit  --frames, or "none"
//   input        hash of the log, and of the rig and the map it was read with
//   cpu          whose times these are
//
// The last two belong to files and machines: metrics.json leaves them out, to be the same from wherever.
#pragma once

#include <map>
#include <string>

namespace overtake::evaluation {

using About = std::map<std::string, std::string>;

// Throws io::Error: no such file, damaged.
About read_about(const std::string& folder);
void write_about(const std::string& folder, const About& about);
// Without what belongs to files and machines.
About portable(About about);

// Of a log's size and its first and last 1 MiB, as it stands or file by file where it is a folder: the whole of 8 GB
// would take longer than asking again is worth, and a log of another seed differs in its first scan. `more`: what it is
// read with, as text. Throws io::Error: no such file.
std::string hash_input(const std::string& log, const std::string& more);

inline constexpr const char* kNotThere = "nothing";
// What keeps the run in `folder` from being taken for one that `wanted` tells of, in words: "" nothing does, kNotThere,
// else "another" with the keys that differ.
std::string why_not_kept(const std::string& folder, const About& wanted);

}  // namespace overtake::evaluation
