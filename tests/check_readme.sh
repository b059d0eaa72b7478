#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# The examples in README.md and tools/examples/README.md equal tests/test_c_api.c and tests/test_cpp_api.cpp line by
# line, and need only the installed headers.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
for pair in README.md:test_c_api.c tools/examples/README.md:test_cpp_api.cpp; do
  readme=${pair%%:*} file=${pair##*:}
  example=$(sed -n '/README begin/,/README end/p' tests/$file | sed '1d;$d')
  quoted=$(sed -n "/^\`\`\`${file##*.}\$/,/^\`\`\`\$/p" "$readme" | sed '1d;$d')
  [ -n "$example" ] || { echo "tests/$file has no example between its markers"; exit 1; }
  diff <(echo "$example") <(echo "$quoted") || { echo "$readme and tests/$file differ"; exit 1; }
  # shellcheck disable=SC2016
  ! grep -n '#include "' <<<"$example" || { echo "$readme includes a header that is not installed"; exit 1; }
done
