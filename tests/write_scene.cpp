// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// write_scene FOLDER FRAMES: the scene of tests/support/scene.h as files, for tests in bash.
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "tests/support/scene_files.h"

int main(int argc, char** argv) {
  if (argc != 3) return std::fputs("usage: write_scene FOLDER FRAMES\n", stderr), 2;
  try {
    overtake::write_scene_files(argv[1], std::atoi(argv[2]));
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "write_scene: %s\n", error.what()), 1;
  }
  return 0;
}
