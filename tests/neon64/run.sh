#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# tests/neon64/run.sh BUILD_FOLDER
#
# Cross-builds for AArch64 and runs under qemu-user: compares the kernels' vector forms with the scalar references, and
# the whole chain with the golden hashes, which were made on x86. Needs tools/setup --cross; else it is skipped.
set -euo pipefail
build=${1:?usage: tests/neon64/run.sh BUILD_FOLDER}
source=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

for tool in aarch64-linux-gnu-g++ qemu-aarch64; do
  command -v "$tool" >/dev/null && continue
  echo "skipped: neon64: no $tool (tools/setup --cross)"
  exit 77
done

options=(-DCMAKE_BUILD_TYPE=Release)
if command -v ccache >/dev/null; then options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
cmake -G Ninja -S "$source" -B "$build" -DCMAKE_TOOLCHAIN_FILE="$source/toolchain.cmake" "${options[@]}" >/dev/null
cmake --build "$build" --parallel "$(nproc)"
qemu-aarch64 "$build/agreement" --no-colors
qemu-aarch64 "$build/hash_chain"
