#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: test_evaluate.sh OVERTAKE
# tools/evaluate: two shards merged say what one run says, a second call does nothing again, bad options are refused.
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
for bad in "--shard 3/2" "--shard 0/1" "--shard x" "--seeds abc" "--jobs 0" "--nonsense"; do
  # shellcheck disable=SC2086
  if run --out "$folder/bad" $bad >/dev/null 2>"$folder/log"; then fail "$bad was taken"; fi
  grep -q "tools/evaluate: " "$folder/log" || fail "$bad gave no sentence"
done
if "$1" evaluate "$folder/log" --preset paper --out "$folder/x" 2>"$folder/error"; then fail "a text is no log"; fi
grep -q "overtake: $folder/log" "$folder/error" || fail "the error does not name the file"
echo "ok"
