#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_mcap_by_others.sh OVERTAKE WRITE_LOG [SECONDS]. @mcap/core reads the MCAP files that we write: logs
# in every compression, a simulated overtake and the pipeline's view of it. With SECONDS: the log of this part of a
# whole race instead. Exit code 77 if node or its modules are missing.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
readonly overtake=$(realpath "$1") write_log=$(realpath "$2")
readonly reader=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/node/read_mcap.js
need "MCAP by others" "tools/setup --node" node
cd "$work" || exit 1

# read_back FILE TOPIC...
read_back() {
  node "$reader" "$@" >read.txt 2>&1
  local code=$?
  cat read.txt
  ((code == 77)) && exit 77
  ((code == 0)) || fail "read_mcap.js $*: exit code $code"
}

readonly race_topics=(/front/points /left/points /right/points /truth/front/surface /truth/left/surface /truth/right/surface
  /truth/cars /truth/ego/odometry /ego/odometry /opponent/odometry /tf_static)
readonly view_topics=(/map /tf /front/points /left/points /right/points /front/image/range /front/image/labels /detections
  /detections/numbers /tracks /tracks/numbers /truth /times /counters)

if [[ -n ${3:-} ]]; then
  "$overtake" simulate las_vegas_15 --seed 1 --seconds "$3" --out race.mcap || exit 1
  ls -l race.mcap
  read_back race.mcap "${race_topics[@]}"
  grep -q ', 2 attachments: all decoded' read.txt || fail "map and rig are not attached"
  passed
  exit
fi

for compression in none lz4 zstd; do
  for chunk in 1 2000 1000000; do
    "$write_log" log.mcap $compression $chunk || fail "write_log $compression $chunk"
    read_back log.mcap /front/points /ego/odometry /tf_static
  done
done

"$overtake" simulate demo --seed 1 --seconds 2 --out race.mcap --quiet || fail "no race.mcap"
read_back race.mcap "${race_topics[@]}"
"$overtake" run race.mcap --out run --mcap view.mcap --quiet || fail "no view.mcap"
read_back view.mcap "${view_topics[@]}"
grep -q ', 2 attachments: all decoded' read.txt || fail "the configuration or the record of the frames is not attached"
"$overtake" run race.mcap --out run --mcap labels.mcap --mcap-images labels --quiet || fail "no labels.mcap"
read_back labels.mcap /front/image/labels /truth
"$overtake" info labels.mcap | grep '/image/' | grep -qv '/image/labels' && fail "--mcap-images labels has other images"
"$overtake" run race.mcap --out run --mcap none.mcap --mcap-images none --quiet || fail "no none.mcap"
read_back none.mcap /front/points
"$overtake" info none.mcap | grep -q '/image/' && fail "--mcap-images none has images"
"$overtake" run race.mcap --out run --mcap-images none --quiet 2>err.txt && fail "--mcap-images without --mcap is taken"
grep -q -- '--mcap-images none: has no effect without --mcap' err.txt || fail "no reason: $(cat err.txt)"

# A reader that accepts everything proves nothing: it must detect a flipped byte.
size=$(stat -c %s view.mcap)
printf '\x55\x55\x55' | dd of=view.mcap bs=1 seek=$((size / 2)) conv=notrunc status=none
node "$reader" view.mcap >read.txt 2>&1 && fail "a damaged file was read without a word"
"$overtake" info view.mcap >info.txt 2>err.txt
(($? == 3)) && grep -q 'damaged at byte' err.txt || fail "our own reader does not notice the damage"
passed
