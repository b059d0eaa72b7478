#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: test_made_races.sh OVERTAKE
# tools/dev/made_races: the same number draws the same race, the simulator takes it, and wrong arguments are refused.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
overtake=$(realpath "${1:?usage: test_made_races.sh OVERTAKE}")
made_races=$(realpath "$(dirname "$0")/../tools/dev/made_races")
readonly overtake made_races
need test_made_races "tools/setup" python3
cd "$work" || exit 1

expect "made_races" "$made_races" 1 12 --out one
expect "made_races again" "$made_races" 3 3 --out two
cmp one/made_3.toml two/made_3.toml || fail "the same number draws another race"
[[ $(sort -u <(tail -qn +2 one/made_3.toml) | wc -l) -gt 15 && $(ls one | wc -l) == 12 ]] || fail "not twelve races: $(ls one)"
[[ $(md5sum one/*.toml | cut -d' ' -f1 | sort -u | wc -l) == 12 ]] || fail "two numbers draw the same race"
# taken_of FOLDER: how many of its races the simulator takes; a bend may be too tight for a car
taken_of() {
  local race taken=0
  for race in "$1"/*.toml; do
    if "$overtake" simulate "./$race" --seconds 0.05 --quiet --out "${race%.toml}.mcap" 2>error.txt; then
      taken=$((taken + 1))
    else
      grep -q "acceleration across" error.txt || fail "$race: $(cat error.txt)"
    fi
  done
  echo "$taken"
}
taken=$(taken_of one)
((taken >= 8)) || fail "the simulator takes $taken of 12 races"

expect "mixed races" "$made_races" 1 24 --mixed --out mixed
for key in 'speed = \[' 'spin = ' '\[\[smoke\]\]' '\[\[debris\]\]' '\[\[reflector\]\]' 'jump = ' 'drop_out = ' 'change = '; do
  grep -q "^$key" mixed/mixed_*.toml || fail "none of 24 mixed races has $key"
done
taken=$(taken_of mixed)
((taken >= 16)) || fail "the simulator takes $taken of 24 mixed races"
for bad in "" "1 2" "1 x --out d" "2 1 --out d" "1 1 --out /dev/null/d"; do
  code=0
  # shellcheck disable=SC2086
  "$made_races" $bad >/dev/null 2>error.txt || code=$?
  [[ $code == 2 ]] && grep -q "^tools/dev/made_races: " error.txt || fail "'$bad': exit code $code: $(cat error.txt)"
done
passed
