#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: test_evaluate_set.sh OVERTAKE
# tools/dev/evaluate_set: two merged shards equal one run; a second call repeats nothing; a killed run continues to the same
# result; results of another build and deleted ones are computed again; bad options are refused.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
set -e  # an unexpected failure ends the test
overtake=$(realpath "${1:?usage: test_evaluate_set.sh OVERTAKE}")
build=$(dirname "$overtake")
readonly overtake build
cd "$(dirname "$0")/.."
need test_evaluate_set "tools/setup --cluster" snakemake
run() { tools/dev/evaluate_set --build "$build" --set overtake,empty_track --seconds 0.4 --sweep none "$@"; }

# The names of the parts that are newer than FILE.
made_after() { find "$1/parts" -mindepth 1 -maxdepth 1 -newer "$2" -printf '%f\n' | sort | tr '\n' ' '; }
run --out "$work/whole" >"$work/log" 2>&1
for line in 'simulate  *2  *1 ' 'evaluate  *2  *1 '; do
  grep -q "^$line" "$work/log" || fail "no line '$line': $(cat "$work/log")"
done
before=$(stat -c %Y "$work/whole/parts/overtake_1001_0.4s/metrics.json")
run --out "$work/whole" >"$work/log" 2>&1
grep -q "Nothing to be done" "$work/log" || fail "a done job was done again: $(cat "$work/log")"
[[ $(stat -c %Y "$work/whole/parts/overtake_1001_0.4s/metrics.json") == "$before" ]] || fail "a done part was written"
# Measured once, beside the parts (for so short a race only where it exists already).
"$overtake" evaluate "$work/whole/logs/overtake_1001_0.4s.mcap" --preset paper --scaling --frames 1 --quiet \
  --out "$work/times"
mkdir "$work/a"
cp "$work/times/scaling.json" "$work/a"
run --out "$work/a" --shard 1/2 >/dev/null 2>&1
run --out "$work/b" --shard 2/2 >/dev/null 2>&1
[[ $(ls "$work/a/parts" "$work/b/parts" | grep -c 1001) == 2 ]] || fail "shards are no partition"
"$overtake" merge "$work"/a/parts/* "$work"/b/parts/* --out "$work/merged" >/dev/null
cmp "$work/whole/metrics.json" "$work/merged/metrics.json" || fail "shards merged differ from the whole"
cmp "$work/times/scaling.json" "$work/merged/scaling.json" || fail "shards merged lack the times against workers"
grep -qi "against sensors and workers" "$work/merged/report.html" || fail "the merged report lacks them"
# Killed in the middle with all its children: wherever it stopped, the next call gives the result of the whole run.
setsid tools/dev/evaluate_set --build "$build" --set overtake,empty_track --seconds 0.4 --sweep none --out "$work/killed" \
  >"$work/log" 2>&1 &
killed=$!
for ((k = 0; k < 600; ++k)); do
  [[ -z $(ls "$work/killed/logs" 2>/dev/null) ]] || break
  sleep 0.1
done
kill -KILL -- "-$killed" 2>/dev/null || fail "it ended before it could be killed"
wait "$killed" 2>/dev/null || true
[[ ! -f $work/killed/metrics.json ]] || fail "it was whole before it was killed"
run --out "$work/killed" >/dev/null 2>&1
cmp "$work/whole/metrics.json" "$work/killed/metrics.json" || fail "killed and gone on differs from the whole"
# A deleted part is made again, though the merged file is newer; a deleted log is not missed.
cp -r "$work/whole" "$work/deleted"
rm -rf "$work/deleted/parts/overtake_1001_0.4s" "$work/deleted/logs"
touch "$work/now"
run --out "$work/deleted" >/dev/null 2>&1
[[ $(made_after "$work/deleted" "$work/now") == "overtake_1001_0.4s " ]] || fail "deleted: made $(made_after "$work/deleted" "$work/now")"
[[ $work/deleted/metrics.json -nt $work/now ]] || fail "deleted: not merged again"
cmp "$work/whole/metrics.json" "$work/deleted/metrics.json" || fail "a deleted part made again differs"
# Results of another build: every part is made again, no log.
mkdir "$work/other"
cat >"$work/other/overtake" <<END
#!/bin/bash
[[ \$1 != --version ]] || { "$overtake" --version | sed 's/^commit .*/commit   another/'; exit; }
exec "$overtake" "\$@"
END
chmod +x "$work/other/overtake"
touch "$work/now"
run --out "$work/killed" --build "$work/other" >"$work/log" 2>&1
[[ $(made_after "$work/killed" "$work/now") == "empty_track_1001_0.4s overtake_1001_0.4s " ]] ||
  fail "another build: made $(made_after "$work/killed" "$work/now")"
[[ -z $(find "$work/killed/logs" -newer "$work/now" -name '*.mcap') ]] || fail "a log was simulated again"
cmp "$work/whole/metrics.json" "$work/killed/metrics.json" || fail "done again differs"
cp -r "$work/whole/parts/overtake_1001_0.4s" "$work/mixed"
sed -i 's/"commit": "[^"]*"/"commit": "another"/' "$work/mixed/runs/paper/overtake_1001_0.4s/about.json"
"$overtake" merge "$work/mixed" "$work/whole/parts/empty_track_1001_0.4s" --out "$work/x" >/dev/null 2>"$work/error" &&
  fail "runs of two builds were merged"
grep -q "of build another" "$work/error" || fail "merging two builds gave no message"
refuse() {  # OPTIONS: expects exit code 2 and a sentence as the last line, before anything runs
  local code=0
  # shellcheck disable=SC2086
  run --out "$work/bad" $1 >/dev/null 2>"$work/log" || code=$?
  ((code == 2)) || fail "$1: exit code $code, not 2"
  [[ $(tail -n 1 "$work/log") == "tools/dev/evaluate_set: "* ]] || fail "$1 gave no sentence: $(cat "$work/log")"
  [[ -z $(ls "$work/bad/logs" 2>/dev/null) ]] || fail "$1: found out after a simulation"
}
for bad in "--sweep cluster.nonsense=1:2:1" "--sweep cluster.threshold_deg=80:100:10" "--sweep x" "--preset nonsense" \
  "--preset paper,paper:nonsense" "--preset paper@x=1"; do
  refuse "$bad"
  [[ $(wc -l <"$work/log") == 1 ]] || fail "$bad: more than a sentence: $(cat "$work/log")"
done
for bad in "--seeds 1,x" "--set overtake,nonsense" "--shard 3/2" "--shard 0/1" "--shard x" "--seeds abc" "--jobs 0" "--nonsense"; do
  refuse "$bad"
done
ones_of() { tail -c +129 "$1" | tr -d '\000' | wc -c; }  # ones of a NPY of bytes
race=$work/race
"$overtake" simulate overtake --seconds 0.15 --quiet --out "$race"
"$overtake" label "$race" --rig "$race/rig.toml" --frame 1 --out "$work/labels" >"$work/log"
grep -q "front" "$work/log" || fail "label says nothing of the front sensor"
[[ $(ls "$work/labels" | wc -l) == 4 ]] || fail "label: not one file a sensor and one table"
while IFS=, read -r frame sensor points obstacles; do
  [[ $frame == frame ]] && continue
  [[ $(ones_of "$work/labels/${frame}_${sensor}_labels.npy") == "$obstacles" ]] || fail "label: $sensor's count"
  ((points > 10000 && obstacles > 100 && obstacles < points)) || fail "label: $obstacles of $points are obstacles"
done <"$work/labels/labels.csv"
if "$overtake" label "$race" --rig "$race/rig.toml" --frame 99 --out "$work/x" 2>"$work/error"; then fail "frame 99"; fi
grep -q "no scan of that frame" "$work/error" || fail "label of a frame that is not there gave no sentence"

log=$work/whole/logs/overtake_1001_0.4s.mcap
"$overtake" evaluate "$log" --preset paper --frames 3 --quiet --progress 0 --out "$work/lines" >"$work/log" 2>&1
[[ $(grep -cE "^overtake_1001_0.4s: evaluated [0-9.]+ %, [0-9]+ s so far$" "$work/log") == 3 && $(wc -l <"$work/log") == 3 ]] ||
  fail "--progress: not a line a frame: $(cat "$work/log")"
"$overtake" evaluate "$log" --preset paper --frames 2 --out "$work/lines" >"$work/log"
grep -q "paper was run before with another --frames; again" "$work/log" || fail "other frames were not run, or not said"
grep -q ": 2 frames, 1 variant$" "$work/log" || fail "the frames and the one variant are not counted: $(cat "$work/log")"
"$overtake" evaluate "$log" --preset paper --frames 2 --out "$work/lines" >"$work/log"
grep -q "done before" "$work/log" || fail "the same frames were run again"

# Presets and configurations on the same logs; changed contents of a configuration run again.
mkdir -p "$work/figures"
cp -r "$work/whole/logs" "$work/figures/logs"
printf '[gate]\nmin_points = 8\n' >"$work/strict.toml"
figures() { run --out "$work/figures" --preset paper --config "$work/strict.toml" --only-figures --compare-every 2 >"$work/log" 2>&1; }
figures || fail "--config: $(cat "$work/log")"
grep -qE '^ +scenario: all +paper +strict$' "$work/log" || fail "no table of both: $(cat "$work/log")"
[[ ! -e $work/figures/scaling.json && -z $(find "$work/figures/parts" -name '*.svg' -path '*/runs/*') ]] || fail "--only-figures made more"
[[ $(find "$work/figures/runs" -name about.json -exec grep -c '"compared": "2"' {} + | grep -c ':1$') == 4 ]] || fail "--compare-every 2"
echo '{}' >"$work/figures/scaling.json"
figures
grep -q "Nothing to be done" "$work/log" || fail "the same configuration was run again"
[[ -e $work/figures/scaling.json ]] || fail "what was measured once is gone with the same configuration"
sed -i 's/8/9/' "$work/strict.toml"
touch "$work/now"
figures
[[ $(made_after "$work/figures" "$work/now" | wc -w) == 2 ]] || fail "another configuration was not run again"
[[ ! -e $work/figures/scaling.json ]] || fail "what was measured once with another configuration is kept"
refuse "--config $work/none.toml"
# One table of a preset and of changes of it.
printf '# changes\nstrict gate.min_points=9\n\nloose gate.min_points=2 cluster.threshold_deg=3  # two\n' >"$work/changes"
mkdir -p "$work/ablation"
cp -r "$work/whole/logs" "$work/ablation/logs"
tools/dev/ablation "$work/changes" --preset paper --out "$work/ablation" --build "$build" --set overtake,empty_track \
  --seconds 0.4 >"$work/log" 2>&1 || fail "ablation: $(cat "$work/log")"
for line in '^\| loose \| gate.min_points = 2, cluster.threshold_deg = 3 \|$' '^### all$' '^### overtake$' '^\| paper \| [0-9]'; do
  grep -qE "$line" "$work/ablation/ablation.md" || fail "ablation: no '$line' in $(cat "$work/ablation/ablation.md")"
done
python3 - "$work" <<'END' || fail "ablation: its numbers are not those of metrics.json"
import json, sys
ablation = json.load(open(sys.argv[1] + '/ablation/ablation.json'))
quality = {(q['contestant'], q['scenario']): q for q in json.load(open(sys.argv[1] + '/ablation/metrics.json'))['quality']}
assert ablation['changes']['loose'] == {'gate.min_points': 2, 'cluster.threshold_deg': 3}
assert [t['scenario'] for t in ablation['tables']] == ['all', 'empty_track', 'overtake']
for table in ablation['tables']:
    assert [r['name'] for r in table['rows']] == ['paper', 'strict', 'loose']
    wrong = [quality[(r['name'], table['scenario'])]['false_detections']['a_frame'] for r in table['rows']]
    assert [r['values']['false a frame'] for r in table['rows']] == wrong
    assert table['scenario'] != 'overtake' or wrong[1] < wrong[0] < wrong[2], wrong
    assert table['rows'][0]['worse'] == []
    assert table['scenario'] != 'overtake' or 'false a frame' in table['rows'][2]['worse']
END
# The committed list: its parameters exist and take these values. That is checked before the jobs, and there are none.
tools/dev/ablation tools/dev/ablation_best.txt --preset best --out "$work/best" --build "$build" --shard 999/999 \
  >/dev/null 2>"$work/error" || true
grep -q ': shard: 999/999 of [0-9]* jobs is empty$' "$work/error" || fail "ablation_best.txt: $(cat "$work/error")"
for bad in "nope" "strict" "strict gate.min_points" "a/b gate.min_points=1" $'x gate.min_points=1\nx gate.min_points=2' "#"; do
  code=0
  printf '%s\n' "$bad" >"$work/changes"
  tools/dev/ablation "$work/changes" --preset paper --out "$work/x" >/dev/null 2>"$work/error" || code=$?
  [[ $code == 2 && $(wc -l <"$work/error") == 1 ]] || fail "ablation '$bad': exit code $code: $(cat "$work/error")"
done

tune=$work/a/logs/overtake_1001_0.4s.mcap
[[ -f $tune ]] || tune=$work/b/logs/overtake_1001_0.4s.mcap
"$overtake" evaluate "$tune" --tune --frames 1 --out "$work/tune" >"$work/log"
grep -q "^grid *best: cell_m=" "$work/log" || fail "tuning found no grid"
[[ $(grep -c "^grid," "$work/tune/tuning.csv") == 42 ]] || fail "tuning did not try every grid"
if "$overtake" evaluate --out "$work/x" 2>/dev/null; then fail "evaluate without a log was taken"; fi

if "$overtake" evaluate "$work/log" --preset paper --out "$work/x" 2>"$work/error"; then fail "a text is no log"; fi
grep -q "overtake: $work/log" "$work/error" || fail "the error does not name the file"
passed "all evaluation checks passed"
