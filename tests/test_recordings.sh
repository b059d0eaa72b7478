#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_recordings.sh OVERTAKE. ROS 2 recordings written by an independent program (make_db3.py): every
# layout is read, info lists the content, doctor finds each seeded fault and prints its sentence. Exit code 0 is a pass.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
readonly overtake=$(realpath "${1:?usage: test_recordings.sh OVERTAKE WRITE_SCENE}") write_scene=$(realpath "${2:?}")
readonly make_db3=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/make_db3.py
need "recordings" "tools/setup" python3
cd "$work" || exit 1

"$write_scene" scene 7 || fail "no scene"

# hash_of ARGUMENTS...: the hash that overtake run prints; its notes go to notes.txt.
hash_of() {
  "$overtake" run "$@" --map scene/map.csv --out out >stdout.txt 2>stderr.txt || fail "run $*: $(head -c 300 stderr.txt)"
  grep '^note: the clouds' stdout.txt >notes.txt
  sed -n 's/^Hash of all detections and tracks: //p' stdout.txt
}

# ---- the three layouts
expected=$(hash_of scene --rig av21 --ego scene/ego.csv)
[[ $expected =~ ^[0-9a-f]{16}$ ]] || fail "run prints no hash"
for layout in ring line_index none; do
  python3 "$make_db3" scene $layout.db3 --layout $layout --ego scene/ego.csv || fail "make_db3 $layout"
  found=$(hash_of $layout.db3 --rig racecar --ego scene/ego.csv)
  if [[ $layout == none ]]; then
    [[ $(grep -c "lines recovered from the order of the points (two heads" notes.txt) == 3 ]] || fail "recovered lines are not said"
    [[ -n $found ]] || fail "layout none gives no hash"
  else
    [[ $found == "$expected" ]] || fail "layout $layout: hash $found, PCD files have $expected"
    [[ ! -s notes.txt ]] || fail "layout $layout: $(cat notes.txt)"
  fi
done
own=$(hash_of ring.db3 --rig racecar)                        # ego poses of the recording
[[ -n $own && $own == "$(hash_of line_index.db3 --rig racecar)" ]] || fail "the layouts differ with their own ego poses"
python3 "$make_db3" scene bare.db3 --vehicle '' --ego scene/ego.csv
[[ $(hash_of bare.db3 --rig racecar) == "$own" ]] || fail "topics without a vehicle's name are not found"
"$overtake" inspect ring.db3 --rig racecar --frame 2 --sensor left --out images >/dev/null || fail "inspect of a db3"
"$overtake" inspect scene --rig racecar --frame 2 --sensor left --out images_pcd >/dev/null
cmp images/labels.npy images_pcd/labels.npy || fail "inspect sees other labels in a db3"

# ---- info
"$overtake" info line_index.db3 >info.txt || fail "info"
for text in "rosbag2, SQLite (.db3)" "from 0.000 to 0.400 s" "/vehicle_3/luminar_front_points .* 7 .* 20.0 .* frame luminar_front" \
  "/vehicle_3/local_odometry .* base_link in map" "line_index uint16 at 44, .*; 56 bytes a point"; do
  grep -q "$text" info.txt || fail "info does not say '$text': $(head -20 info.txt)"
done
grep -q 'FRAME_front.pcd .* 7 .*ring uint16' <<<"$("$overtake" info scene)" || fail "info of a folder"

"$overtake" info line_index.db3 --json >info.json || fail "info --json"
python3 - >stdout.txt 2>&1 <<'END' || fail "info --json: $(cat stdout.txt)"
import json
info = json.load(open('info.json'))
topic = [t for t in info['topics'] if t['name'] == '/vehicle_3/luminar_front_points'][0]
assert info['damage'] == '' and info['scans'] == [] and info['last_ns'] - info['first_ns'] == 400_000_000, info
assert topic['messages'] == 7 and abs(topic['rate_hz'] - 20) < 1e-9 and topic['type'] == 'sensor_msgs/msg/PointCloud2', topic
assert topic['frame'] == 'luminar_front' and topic['points'] > 7 * 10000 and topic['undecoded'] == 0, topic
assert 'line_index uint16 at 44' in topic['layout'], topic
END

# ---- doctor: no finding on a good recording, one sentence per fault
"$overtake" doctor ring.db3 --rig racecar >doctor.txt || fail "doctor of a good recording: $(cat doctor.txt)"
grep -q '^Nothing is wrong with ring.db3 for rig racecar.$' doctor.txt || fail "doctor of a good recording says $(cat doctor.txt)"
"$overtake" doctor scene --rig av21 --ego scene/ego.csv >doctor.txt || fail "doctor of a good folder: $(cat doctor.txt)"
mkdir faults
python3 "$make_db3" scene faults --ego scene/ego.csv --fault all || fail "make_db3 --fault all"
seen=0
while IFS='|' read -r fault sentence; do
  [[ -n $fault ]] || continue
  "$overtake" doctor faults/$fault.db3 --rig racecar >doctor.txt 2>stderr.txt
  code=$?
  seen=$((seen + 1))
  if [[ $sentence == note* ]]; then ((code == 0)); else ((code == 3)); fi || fail "$fault: exit code $code $(head -c 300 stderr.txt)"
  grep -qE -- "^$sentence" doctor.txt || fail "$fault: not '$sentence' but $(cat doctor.txt)"
done <<'END'
frame_id|WRONG  sensor 'front': its clouds are in frame 'base_link', the rig expects 'luminar_front'
vehicle_frame|WRONG  sensor 'left': [0-9]+ % of its points lie outside of its field of view .* the cloud is in the vehicle frame
unordered|WRONG  sensor 'front': its stamps go back 1 time, first at scan 4 by 0.070 s
duplicate|WRONG  sensor 'left': 1 scan with the stamp of the scan before
millimetres|WRONG  sensor 'right': half of its points are more than [0-9]+ m away: the unit looks like millimetres
empty_sensor|WRONG  sensor 'right': all 7 scans are empty
missing_sensor|WRONG  sensor 'left': there is no scan of it \(looked for /vehicle_\*/luminar_left_points
mounting_height|WRONG  sensor 'front': the road lies 0\.[78][0-9] m above where its mounting puts it
mounting_pitch|WRONG  sensor 'front': the road is tilted by [56]\.[0-9] deg along
gap|note   sensor 'front': 1 gap between scans, the longest 0.10 s
time_unit|WRONG  sensor 'front': the times of its points span [0-9.]+ s within a scan of 0.050 s
time_us|WRONG  sensor 'front': the times of its points span [0-9.]+ us within a scan of 0.050 s
nan|WRONG  sensor 'front': 67 % of its points are NaN
ego_degrees|WRONG  ego: its yaw does not fit its motion
ego_missing|note   ego: there are no ego poses: tracks will be in the vehicle frame
ego_clock|WRONG  ego: its poses \(40.00 to 40.[0-9]+ s\) and the scans of sensor 'front' .* are of different times
ego_nan|WRONG  ego: message [0-9]+ has a value that is not finite: this pose is not used
short_cloud|WRONG  sensor 'front': 1 of 7 scans cannot be read; the first: message [0-9]+: declares [0-9]+ points
swapped|WRONG  sensor 'left': its clouds are in frame 'luminar_right', the rig expects 'luminar_left'
period|WRONG  sensor 'front': its scans come every 0.1000 s, the rig says 0.0500 s
float_lines|WRONG  sensor 'front': its ring values are not integers \(0.50\)
shuffled|WRONG  sensor 'front': 7 of 7 scans cannot be read; the first: message 0: no field gives the layer .* neither the order nor the elevations
cdr_cut|WRONG  sensor 'front': 1 of 7 scans cannot be read; the first: message [0-9]+ is not a sensor_msgs/msg/PointCloud2
bad_row|WRONG  recording: damaged after message 9: a message of a topic that is not in the table of topics
END
[[ $seen == "$(find faults -name '*.db3' | wc -l)" ]] || fail "$seen faults have a sentence, $(find faults -name '*.db3' | wc -l) are seeded"
grep -q '  -> set time_unit in the rig file; times 1000 times as long would fit$' <<<"$("$overtake" doctor faults/time_us.db3 --rig racecar)" ||
  fail "doctor does not say which time_unit would fit"
grep -q "^note   sensor 'front': its clouds have no ring field: 3[0-9] lines recovered" <<<"$("$overtake" doctor none.db3 --rig racecar)" ||
  fail "doctor does not say that lines were recovered"
"$overtake" doctor ring.db3 --rig hdl64 >doctor.txt
grep -q -- '--rig racecar' doctor.txt || fail "doctor does not name the rig whose topics fit: $(cat doctor.txt)"
grep -q 'no topic of the rig.s sensors is in it; clouds in it: /vehicle_3/luminar_front_points' doctor.txt || fail "wrong rig: $(cat doctor.txt)"

# ---- a sensor that sends clouds without points: they are scans, and every frame has them
for file in ring.db3 faults/empty_sensor.db3; do
  [[ -n $(hash_of $file --rig racecar --ego scene/ego.csv) ]] || fail "no hash of $file"
  cut -d, -f1 out/timing.csv | sort -u | wc -l
  grep -c "a sensor is missing" stdout.txt
done >frames.txt
[[ $(xargs <frames.txt) == "8 0 8 0" ]] || fail "frames, and frames without a sensor, of a recording and of one with empty clouds: $(xargs <frames.txt)"

# ---- a recording without a scan, or with scans in another format
cp ring.db3 no_scan.db3
cp ring.db3 json.db3
python3 - <<'END' || fail "no recordings without scans"
import sqlite3
for file, change in (('no_scan.db3', 'DELETE FROM messages'), ('json.db3', "UPDATE topics SET serialization_format = 'json'")):
    with sqlite3.connect(file) as bag:
        bag.execute(change)
END
for told in "no_scan.db3: holds no scan" \
  "json.db3: no topic of .*; clouds in it: /vehicle_3/luminar_front_points (sensor_msgs/msg/PointCloud2, serialization format json, cdr is needed), .*"; do
  "$overtake" run "${told%%:*}" --rig racecar --out "${told%%.*}" >stdout.txt 2>stderr.txt
  code=$?
  ((code == 1)) && grep -qx "overtake: $told" stderr.txt && [[ ! -e ${told%%.*} ]] || fail "${told%%:*}: exit code $code, $(cat stderr.txt)"
done

# ---- damage: the part before the damage is used, and the exit code reports the damage
head -c $(($(stat -c %s ring.db3) * 2 / 3)) ring.db3 >cut.db3
"$overtake" run cut.db3 --rig racecar --out cut >stdout.txt 2>stderr.txt
code=$?
((code == 3 || code == 1)) && grep -q 'SQLite says' stderr.txt || fail "a cut db3: exit code $code, $(cat stderr.txt)"
[[ $(wc -l <cut/timing.csv) -gt 1 ]] || fail "a cut db3 gives no frame"

# ---- a message that cannot be decoded is left out and named, the others are used; a topic of such messages is an error
for fault in "short_cloud|declares [0-9]* points" "cdr_cut|is not a sensor_msgs/msg/PointCloud2"; do
  "$overtake" run faults/${fault%|*}.db3 --rig racecar --out ${fault%|*} >stdout.txt 2>stderr.txt
  code=$?
  lost="3 messages could not be read, the others are done; the first: message [0-9]* on /vehicle_3/luminar_front_points"
  ((code == 3)) && grep -q "^overtake: faults/${fault%|*}.db3: $lost (log time [0-9.]* s): ${fault#*|}" stderr.txt ||
    fail "run with ${fault%|*}: exit code $code, $(cat stderr.txt)"
  [[ $(cut -d, -f1 ${fault%|*}/timing.csv | sort -u | wc -l) == 7 ]] || fail "bad messages of one time cost other frames than theirs"
  grep -q '^Hash of all detections and tracks' stdout.txt || fail "run with ${fault%|*} prints no result: $(cat stdout.txt)"
done
"$overtake" run faults/shuffled.db3 --rig racecar --out shuffled >stdout.txt 2>stderr.txt
code=$?
((code == 1)) && grep -q 'shuffled.db3: no message on /vehicle_3/luminar_front_points can be read, of 7; the first: message 0 ' stderr.txt ||
  fail "run on a topic without a good message: exit code $code, $(cat stderr.txt)"

# ---- a pose that is no number is left out, and named
"$overtake" run faults/ego_nan.db3 --rig racecar --out ego_nan >stdout.txt 2>stderr.txt || fail "run with a NaN pose: $(cat stderr.txt)"
grep -q '^note: 1 ego pose with a value that is not finite or out of bounds: not used; the first has stamp [0-9]*$' stdout.txt ||
  fail "run does not name the NaN pose: $(cat stdout.txt)"

passed "all recording checks passed"
