#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_progress.sh. The progress that tools/setup and tools/demo show: in a file one line per tenth, on a
# terminal one line that is rewritten; the log contains everything.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
# shellcheck source=tools/dev/progress.sh
source "$(dirname "${BASH_SOURCE[0]}")/../tools/dev/progress.sh"

steps() { for ((k = 1; k <= 188; ++k)); do printf '[%d/188] step %d\nits warning\n' $k $k; done; }
steps | show_progress "Building" "$work/all" >"$work/shown"
steps | cmp - "$work/all" || fail "the log is not what was read"
[[ $(wc -l <"$work/shown") == 10 ]] || fail "not a line each tenth: $(cat "$work/shown")"
[[ $(head -n 1 "$work/shown") == "Building [19/188] "*" s, about "*" s to go" ]] || fail "first: $(head -n 1 "$work/shown")"
[[ $(tail -n 1 "$work/shown") == "Building [188/188] "*" s" ]] || fail "last: $(tail -n 1 "$work/shown")"

printf 'one\n[0/0] nothing\ntwo' | show_progress "Building" "$work/none" >"$work/shown"
[[ ! -s $work/shown && $(cat "$work/none") == $'one\n[0/0] nothing\ntwo' ]] || fail "no progress: $(cat "$work/shown" "$work/none")"

if script -qec true /dev/null >/dev/null 2>&1 </dev/null; then  # there is a pseudo-terminal
  # A script of its own: `script` starts $SHELL or sh, and sh hands no functions of bash on.
  { declare -f steps show_progress; echo 'steps | show_progress Building "$1"'; } >"$work/show.sh"
  script -qec "bash '$work/show.sh' '$work/terminal'" /dev/null >"$work/shown" </dev/null
  [[ $(grep -o $'\r''Building \[' "$work/shown" | wc -l) == 188 && $(tr -d '\r' <"$work/shown" | wc -l) == 1 ]] ||
    fail "a terminal gets more than one line: $(head -c 400 "$work/shown")"
fi

# The pipe's exit code is that of the watched command.
(set -o pipefail; { steps; exit 3; } | show_progress "Building" "$work/code" >/dev/null) && fail "a failure is lost"

passed "progress is shown and logged"
