#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_probes.sh EXECUTABLE WITH_PROBES. The built file contains what a profiler needs: a build id,
# symbols, frame pointers, and the USDT probes with the numbers of arguments of pipeline/probes.h. WITH_PROBES is 0 if
# the build had no sys/sdt.h. Exit code 0 is a pass, 77 with a line "skipped: ..." a skip.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
readonly binary=${1:?usage: test_probes.sh EXECUTABLE WITH_PROBES} with_probes=${2:?}
need probes binutils readelf

notes=$(readelf --notes --wide "$binary") || fail "$binary: readelf cannot read it"
grep -q 'Build ID: [0-9a-f]\{16\}' <<<"$notes" || fail "$binary has no build id"
[[ $(readelf --symbols --wide "$binary") == *segment_scan* ]] || fail "$binary has lost its symbols"

# "Name: drop" is followed by a line "Arguments: -4@%edi 8@%rsi": one word per argument. With a constant (-4@$7) perf
# would refuse the probe.
expect_probe() { # NAME ARGUMENTS
  local counts
  counts=$(awk -v name="$1" '
    /Provider:/ { ours = $NF == "overtake" }
    /Name:/ { named = ours && $2 == name }
    /Arguments:/ && named { print NF - 1 }' <<<"$notes" | sort -u)
  [[ -n $counts ]] || fail "no probe overtake:$1"
  awk -v name="$1" '/Name:/ { named = $2 == name } /Arguments:.*@\$/ && named { exit 1 }' <<<"$notes" ||
    fail "overtake:$1 has a constant among its arguments"
  [[ -z $counts || $counts == "$2" ]] || fail "overtake:$1 has $counts arguments, not $2"
}
if ((with_probes)); then
  expect_probe stage_begin 4
  expect_probe stage_end 4
  expect_probe drop 2
  expect_probe deadline 2
elif grep -q 'Provider: overtake' <<<"$notes"; then
  fail "a build without sys/sdt.h has probes"
fi
passed || exit 1
((with_probes)) || { echo "skipped: USDT probes: built without sys/sdt.h (systemtap-sdt-dev)"; exit 77; }
echo "build id, symbols and probes are there"
