// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// about.json of a run: its build and inputs. A later command keeps the run only if these agree.
//
//   commit       of the build
//   every        interval in frames of a run of a sweep, or of the baselines beside the run; "none": every frame, no
//                baselines
//   frame_limit  --frames, or "none"
//   compared     "N": every N-th frame was compared with the truth (--compare-every)
//   extent       "whole", or "figures": no baselines, times or pictures (--only-figures)
//   config       what a configuration of --config changes; "" for a preset
//   input        hash of the log, and of its rig and map
//   log, from_s, to_s, warm_up_s    of a piece of a log (pieces.h), to_s "end": until the end
//   cpu          the CPU of the times
//
// input and cpu depend on files and machines: metrics.json omits them, so that it is the same everywhere.
#pragma once

#include <map>
#include <string>

namespace overtake::evaluation {

using About = std::map<std::string, std::string>;

// Throws io::Error if the file is missing or damaged.
About read_about(const std::string& folder);
void write_about(const std::string& folder, const About& about);
// Without the keys that depend on files and machines.
About portable(About about);

// The name of a log's file or folder, also of a path that ends in a separator or is "." or "..". log_stem: without the
// ending, the name of its results. Throws io::Error if there is none ("/"): the results would lie among those of other
// logs.
std::string log_file_name(const std::string& log);
std::string log_stem(const std::string& log);
// Hash of a log, for a folder file by file: of up to 64 MiB of a file, else of its size and 64 blocks of 1 MiB at even
// distances, because hashing 8 GB would take too long. `more`: the options it is read with, as text. Throws io::Error
// if the file is missing.
std::string hash_input(const std::string& log, const std::string& more);

inline constexpr const char* kNotThere = "nothing";
// Why the run in `folder` does not answer `wanted`, in words: "" if it does, kNotThere, else "another" with the keys
// that differ.
std::string why_not_kept(const std::string& folder, const About& wanted);

}  // namespace overtake::evaluation
