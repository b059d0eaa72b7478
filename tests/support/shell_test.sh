# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# What every test written in bash begins with; sourced. Gives $work, a folder that goes with the test, and notes
# failures, those in a subshell too: `passed [SENTENCE]` at the end is the test's exit code.
set -uo pipefail
work=$(mktemp -d)
readonly work
trap 'rm -rf "$work" "$work.failed"' EXIT

fail() {
  echo "FAILED: $*" | tee -a "$work.failed" >&2
}
passed() {
  [[ ! -s $work.failed ]] && echo "${1:-passed}"
}

# need NAME WHERE TOOL...: without one of the tools the test NAME is skipped; WHERE has them.
need() {
  local name=$1 where=$2 tool
  shift 2
  for tool; do
    command -v "$tool" >/dev/null || { echo "skipped: $name: no $tool ($where)"; exit 77; }
  done
}

# expect NAME COMMAND...: succeeds.
expect() {
  local name=$1
  shift
  "$@" >"$work/log" 2>&1 || { fail "$name: exit code $?: $(tail -n 30 "$work/log")"; return 1; }
}

