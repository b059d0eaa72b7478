// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Runs the command line as a function.
#pragma once

#include <unistd.h>

#include <cstdio>
#include <string>
#include <vector>

#include "tests/support/temp_folder.h"
#include "tools/cli/command_line.h"
#include "tools/io/text.h"

namespace overtake {

// Standard output goes to a file for as long as this lives.
class OutputFile {
 public:
  explicit OutputFile(const std::string& path) : kept_(dup(1)), file_(std::fopen(path.c_str(), "w")) {
    std::fflush(stdout);
    dup2(fileno(file_), 1);
  }
  ~OutputFile() {
    std::fflush(stdout);
    dup2(kept_, 1);
    close(kept_);
    std::fclose(file_);
  }
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

 private:
  int kept_;
  std::FILE* file_;
};

struct Outcome {
  int code;
  std::string text;  // of standard output
};
inline Outcome run_overtake(const TempFolder& folder, const std::vector<std::string>& words) {
  std::vector<const char*> argv = {"overtake"};
  for (const std::string& word : words) argv.push_back(word.c_str());
  const std::string path = folder.path("stdout.txt");
  const auto run = [&] {
    const OutputFile redirected(path);
    return cli::run_command_line(int(argv.size()), argv.data());
  };
  const int code = run();
  return {code, io::read_whole_file(path)};
}

}  // namespace overtake
