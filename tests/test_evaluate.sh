#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: test_evaluate.sh OVERTAKE
# tools/evaluate: two shards merged say what one run says, a second call does nothing again, one that was killed goes on
# to the same end, bad options are refused.
set -euo pipefail
build=$(dirname "$1")
cd "$(dirname "$0")/.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
fail() {
  echo "FAILED: $*"
  exit 1
}
run() { tools/evaluate --build "$build" --set overtake,empty_track --seconds 0.4 --sweep none "$@"; }

run --out "$folder/whole" >"$folder/log"
grep -q "simulated" "$folder/log" || fail "nothing was simulated"
before=$(stat -c %Y "$folder/whole/parts/overtake_1001_0.4s/metrics.json")
run --out "$folder/whole" >"$folder/log"
[[ $(grep -c "done before" "$folder/log") == 2 ]] || fail "a done job was done again"
[[ $(stat -c %Y "$folder/whole/parts/overtake_1001_0.4s/metrics.json") == "$before" ]] || fail "a done part was written"
run --out "$folder/a" --shard 1/2 >/dev/null
run --out "$folder/b" --shard 2/2 >/dev/null
[[ $(ls "$folder/a/parts" "$folder/b/parts" | grep -c 1001) == 2 ]] || fail "shards are no partition"
"$1" merge "$folder"/a/parts/* "$folder"/b/parts/* --out "$folder/merged" >/dev/null
cmp "$folder/whole/metrics.json" "$folder/merged/metrics.json" || fail "shards merged differ from the whole"
# Killed in the middle, with everything it started; whatever it had reached, the next call ends where the whole one did.
setsid tools/evaluate --build "$build" --set overtake,empty_track --seconds 0.4 --sweep none --out "$folder/killed" \
  >"$folder/log" 2>&1 &
killed=$!
for ((k = 0; k < 600; ++k)); do
  [[ -z $(ls "$folder/killed/logs" 2>/dev/null) ]] || break
  sleep 0.1
done
kill -KILL -- "-$killed" 2>/dev/null || fail "it ended before it could be killed"
wait "$killed" 2>/dev/null || true
[[ ! -f $folder/killed/metrics.json ]] || fail "it was whole before it was killed"
run --out "$folder/killed" >/dev/null
cmp "$folder/whole/metrics.json" "$folder/killed/metrics.json" || fail "killed and gone on differs from the whole"
for bad in "--shard 3/2" "--shard 0/1" "--shard x" "--seeds abc" "--jobs 0" "--nonsense"; do
  # shellcheck disable=SC2086
  if run --out "$folder/bad" $bad >/dev/null 2>"$folder/log"; then fail "$bad was taken"; fi
  grep -q "tools/evaluate: " "$folder/log" || fail "$bad gave no sentence"
done
ones_of() { tail -c +129 "$1" | tr -d '\000' | wc -c; }  # ones of a NPY of bytes
race=$folder/race
"$1" simulate overtake --seconds 0.15 --quiet --out "$race"
"$1" label "$race" --rig "$race/rig.toml" --frame 1 --out "$folder/labels" >"$folder/log"
grep -q "front" "$folder/log" || fail "label says nothing of the front sensor"
[[ $(ls "$folder/labels" | wc -l) == 4 ]] || fail "label: not one file a sensor and one table"
while IFS=, read -r frame sensor points obstacles; do
  [[ $frame == frame ]] && continue
  [[ $(ones_of "$folder/labels/${frame}_${sensor}_labels.npy") == "$obstacles" ]] || fail "label: $sensor's count"
  ((points > 10000 && obstacles > 100 && obstacles < points)) || fail "label: $obstacles of $points are obstacles"
done <"$folder/labels/labels.csv"
if "$1" label "$race" --rig "$race/rig.toml" --frame 99 --out "$folder/x" 2>"$folder/error"; then fail "frame 99"; fi
grep -q "no scan of that frame" "$folder/error" || fail "label of a frame that is not there gave no sentence"

tune=$folder/a/logs/overtake_1001_0.4s.mcap
[[ -f $tune ]] || tune=$folder/b/logs/overtake_1001_0.4s.mcap
"$1" evaluate "$tune" --tune --frames 1 --out "$folder/tune" >"$folder/log"
grep -q "^grid *best: cell_m=" "$folder/log" || fail "tuning found no grid"
[[ $(grep -c "^grid," "$folder/tune/tuning.csv") == 42 ]] || fail "tuning did not try every grid"
if "$1" evaluate --out "$folder/x" 2>/dev/null; then fail "evaluate without a log was taken"; fi

if "$1" evaluate "$folder/log" --preset paper --out "$folder/x" 2>"$folder/error"; then fail "a text is no log"; fi
grep -q "overtake: $folder/log" "$folder/error" || fail "the error does not name the file"
echo "ok"
