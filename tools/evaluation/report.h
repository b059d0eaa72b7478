// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// From the runs of a folder: metrics.json, summary tables as CSV, and report.html, one file with all its pictures as
// SVG; pictures/ holds some of them as files.
#pragma once

#include <string>

#include "tools/io/output.h"

namespace overtake::evaluation {

// `print`: the headline numbers to stdout as well. Throws io::Error.
void write_report(const std::string& out, bool print);

// Whether these files may be written, said before hours of work. Throws io::Error.
void check_report(io::OutputGuard& guard, const std::string& out);

}  // namespace overtake::evaluation
