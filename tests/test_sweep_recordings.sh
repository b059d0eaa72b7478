#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: test_sweep_recordings.sh OVERTAKE
# A sweep of a folder of recordings (a db3 and a rosbag2 folder, written by make_db3.py) gives the metrics.json of overtake
# evaluate on them; a list of one recording that of this one; a folder without recordings is refused.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
overtake=$(realpath "${1:?usage: test_sweep_recordings.sh OVERTAKE}")
project=$(realpath "$(dirname "$0")/..")
readonly overtake project
need test_sweep_recordings "tools/setup --cluster" snakemake python3
cd "$work" || exit 1
sweep() {
  snakemake --snakefile "$project/tools/evaluation/Snakefile" --configfile sweep.yaml --rerun-triggers mtime --cores 2 "$@" \
    >"$work/log" 2>&1
}

# poses FOLDER CAR: the odometry of a car from 0 s on, as the stamps of make_db3.py.
poses() {
  awk -F, -v car="$2" 'NR > 1 && $3 == car { printf "%.0f,%s,%s,%s,%s,%s,%s,%s,%s\n", $1 * 5e7, $6, $7, $8, $9, $10, $11, $13, $14 }
    NR == 1 { print "stamp_ns,x_m,y_m,z_m,roll_rad,pitch_rad,yaw_rad,speed_mps,yaw_rate_rps" }' "$1/truth.csv"
}
mkdir -p records/second
for seed in 1 2; do
  "$overtake" simulate overtake --seed $seed --seconds 1 --quiet --out scene_$seed
  poses scene_$seed 0 >ego.csv
  poses scene_$seed 1 >opponent.csv
  out=records/first.db3
  [[ $seed == 1 ]] || out=records/second/second_0.db3
  expect "make_db3" python3 "$project/tests/make_db3.py" scene_$seed $out --ego ego.csv --opponent opponent.csv
done
touch records/notes.txt  # no recording
of=(--rig racecar --map scene_1/map.csv --only-figures --quiet)
expect "evaluate" "$overtake" evaluate records/first.db3 records/second --preset paper,best "${of[@]}" --out by_hand
expect "evaluate one" "$overtake" evaluate records/first.db3 --preset paper "${of[@]}" --out one_by_hand
python3 - <<'END' || fail "the recordings are hardly compared with anything"
import json
figures = json.load(open('by_hand/metrics.json'))['figures']
assert len(figures) == 4 and all(f['tracking']['objects'] > 5 for f in figures), figures
END

cat >sweep.yaml <<END
overtake: $overtake
recordings: records
rig: racecar
map: scene_1/map.csv
presets: [paper, best]
contestants_per_job: 1
END
sweep --directory out || fail "the sweep: $(tail -n 30 "$work/log")"
[[ $(ls out/parts) == $'first.1\nfirst.2\nsecond.1\nsecond.2' ]] || fail "not 2 recordings with 2 groups: $(ls out/parts)"
cmp by_hand/metrics.json out/metrics.json || fail "the sweep differs from overtake evaluate"
sweep --directory out --dry-run
grep -q "Nothing to be done" "$work/log" || fail "a finished sweep is not finished: $(cat "$work/log")"
# Pieces, with a warm-up from the start.
echo 'pieces: {seconds: 0.4, warm_up: 10}' >>sweep.yaml
sweep --directory pieces || fail "pieces: $(tail -n 30 "$work/log")"
[[ $(ls -d pieces/parts/*.1 | wc -l) -ge 4 ]] || fail "no pieces: $(ls pieces/parts)"
cmp by_hand/metrics.json pieces/metrics.json || fail "pieces differ from overtake evaluate"

sed -i '/pieces/d; s/^recordings: .*/recordings: [records\/first.db3]/; s/^presets: .*/presets: [paper]/' sweep.yaml
sweep --directory one || fail "a list: $(tail -n 30 "$work/log")"
cmp one_by_hand/metrics.json one/metrics.json || fail "a list of one recording differs from overtake evaluate"
mkdir none
sed -i 's/^recordings: .*/recordings: none/' sweep.yaml
sweep --directory empty && fail "a folder without recordings was taken"
grep -q "/sweep.yaml: recordings: .*/none holds no recording" "$work/log" || fail "no sentence: $(cat "$work/log")"
passed
