#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_symbols.sh LIBOVERTAKE_SO LIBOVT_A. libovertake.so exports exactly the functions that the header
# declares; its SONAME is libovertake.so.0; it needs no unnecessary library, and has no insecure loader settings.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
set -e
readonly library=${1:?usage: test_symbols.sh LIBOVERTAKE_SO LIBOVT_A} archive=${2:?}
readonly header=$(dirname "${BASH_SOURCE[0]}")/../pipeline/overtake.h
need symbols binutils readelf nm

exported=$(nm -D --defined-only "$library" | awk '$2 != "A" { sub(/@.*/, "", $3); print $3 }' | sort)
declared=$(sed 's,/\*.*\*/,,' "$header" | grep -oP '^OVT_API [^(]*\b\Kovt_[a-z_]+(?=\()' | sort)
[[ $(wc -w <<<"$declared") -gt 30 ]] ||
  fail "only $(wc -w <<<"$declared") functions found in overtake.h"
[[ $exported == "$declared" ]] ||
  fail "exported (<) is not what the header declares (>):"$'\n'"$(diff <(echo "$exported") <(echo "$declared"))"
! nm -D --defined-only "$library" | awk '$2 != "A"' | grep -v '@@OVERTAKE_0$' || fail "these carry no version"

# Besides the version script, hidden visibility must work in the objects themselves.
seen=$(readelf -sW "$archive" | awk '$5 == "GLOBAL" && $7 != "UND" && $8 ~ /^_ZN?K?.*8overtake/')
[[ -n $seen ]] || fail "$archive has no symbol of the library's namespace: this test cannot read it any more"
leaks=$(awk '$6 != "HIDDEN" { print $8 }' <<<"$seen")
[[ -z $leaks ]] || fail "visible in the objects: $leaks"

dynamic=$(readelf -dW "$library")
[[ $dynamic == *"soname: [libovertake.so.0]"* ]] || fail "SONAME is not libovertake.so.0"
while read -r needed; do
  case $needed in
    libtbb.so.* | libstdc++.so.* | libm.so.* | libgcc_s.so.* | libc.so.* | ld-linux*) ;;
    *) fail "needs $needed" ;;
  esac
done < <(sed -n 's/.*(NEEDED).*\[\(.*\)\]$/\1/p' <<<"$dynamic")
[[ $dynamic != *RPATH* && $dynamic != *RUNPATH* ]] || fail "holds a search path"
[[ $dynamic != *TEXTREL* ]] || fail "is not position independent"
[[ $(readelf -lW "$library" | grep GNU_STACK) == *'RW  '* ]] || fail "its stack is executable"
[[ $(readelf -nW "$library") == *'Build ID'* ]] || fail "has no build id"

passed "$(wc -w <<<"$exported") functions exported, as declared; nothing else"
