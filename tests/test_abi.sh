#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_abi.sh LIBOVERTAKE_SO CXX [INCLUDE_FOLDER...]. The library keeps the binary interface of tests/abi.
# Also checks the check: compiles the API's files against changed headers, and every change must be found.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
readonly library=${1:?usage: test_abi.sh LIBOVERTAKE_SO CXX} cxx=${2:?}
shift 2
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 1
need abi "tools/setup --dev" abidw abidiff
[[ -f tests/abi/overtake_$(uname -m).abi ]] || { echo "skipped: abi: no baseline for $(uname -m)"; exit 77; }

tools/dev/abi_baseline --check --library "$library" ||
  fail "the interface differs from tests/abi (tools/dev/abi_baseline updates it)"

# variant NAME HEADER_SED: a library with the same functions, which are never called; its header is in NAME/.
include=(-I .)
for folder; do include+=(-isystem "$folder"); done
variant() {
  mkdir -p "$work/$1/pipeline"
  sed "$2" pipeline/overtake.h >"$work/$1/pipeline/overtake.h"
  local file
  for file in overtake params; do
    cp pipeline/$file.cpp "$work/$1/pipeline"
    "$cxx" -std=c++20 -g -O0 -fPIC -fvisibility=hidden -DEIGEN_DONT_VECTORIZE -I "$work/$1" "${include[@]}" \
      -c "$work/$1/pipeline/$file.cpp" -o "$work/$1/$file.o" &
  done
  wait
  link "$1" pipeline/overtake.map
}
link() {
  "$cxx" -shared -Wl,-soname,libovertake.so.0 "-Wl,--version-script=$2" -Wl,--unresolved-symbols=ignore-all \
    -o "$work/$1/libovertake.so" "$work/$1"/{overtake,params}.o || fail "variant $1 does not build"
}
check() {
  tools/dev/abi_baseline --check --library "$work/$1/libovertake.so" --header "$work/$1/pipeline/overtake.h" \
    >"$work/$1/report" 2>&1
}

# Unchanged: the differences below come from the change, not from the way the variants are built.
variant same ''
check same || fail "the unchanged variant differs: $(cat "$work/same/report")"

# A member inserted in the middle, a narrower type, one more member at the end; a renumbered constant.
variant changed '
  s/^  int64_t publish_ns;/  int32_t inserted;\n&/
  s/^  size_t stride; /  uint32_t stride; /
  /^} ovt_stats;/i\  int64_t appended;
  s/OVT_FLAG_NO_MAP = 2,/OVT_FLAG_NO_MAP = 2048,/'
check changed && fail "no change is found"
for name in ovt_tracks ovt_column ovt_stats 'inserted' 'appended' 'OVT_FLAG_NO_MAP 2$'; do
  grep -q "$name" "$work/changed/report" || fail "the change of $name is not found: $(cat "$work/changed/report")"
done

# A function that is no longer exported.
sed 's/local: \*;/local: ovt_flush; *;/' pipeline/overtake.map >"$work/same/hidden.map"
link same "$work/same/hidden.map"
check same && fail "a missing function is not found"
grep -q 'ovt_flush' "$work/same/report" || fail "ovt_flush is missing and not named: $(cat "$work/same/report")"

passed "the interface equals the baseline; a changed member, constant or function would be found"
