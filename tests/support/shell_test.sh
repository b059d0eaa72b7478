# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# Every test in bash sources this file first. It sets $work, a temporary folder, and records failures, also those in
# subshells. `passed [SENTENCE]` at the end gives the test's exit code.
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

# need NAME WHERE TOOL...: skips the test NAME if one of the tools is missing; WHERE tells how to get them.
need() {
  local name=$1 where=$2 tool
  shift 2
  for tool; do
    command -v "$tool" >/dev/null || { echo "skipped: $name: no $tool ($where)"; exit 77; }
  done
}

# expect NAME COMMAND...: the command must succeed.
expect() {
  local name=$1
  shift
  "$@" >"$work/log" 2>&1 || { fail "$name: exit code $?: $(tail -n 30 "$work/log")"; return 1; }
}

