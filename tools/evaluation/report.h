// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Makes from the runs of a folder: metrics.json, summary tables as CSV, and report.html, one file with all its pictures
// as SVG; pictures/ contains some of them as files.
#pragma once

#include <string>

#include "tools/io/output.h"

namespace overtake::evaluation {

// `print`: also prints the headline numbers. Throws io::Error.
void write_report(const std::string& out, bool print);

// Whether these files may be written, said before hours of work. Throws io::Error.
void check_report(io::OutputGuard& guard, const std::string& out);

}  // namespace overtake::evaluation
