#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# The README's C example is tests/test_c_api.c, line for line.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
example=$(sed -n '/README begin/,/README end/p' tests/test_c_api.c | sed '1d;$d')
quoted=$(sed -n '/^```c$/,/^```$/p' README.md | sed '1d;$d')
[ -n "$example" ] || { echo "tests/test_c_api.c has no example between its markers"; exit 1; }
diff <(echo "$example") <(echo "$quoted") || { echo "README.md and tests/test_c_api.c differ"; exit 1; }
