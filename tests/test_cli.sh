#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_cli.sh OVERTAKE. The command line from outside: files and columns, same bytes, exit codes and the
# one sentence each kind of bad input gets, Ctrl-C. Needs no recording: it makes a small scene. Exit code 0 is a pass.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
readonly overtake=$(realpath "${1:?usage: test_cli.sh OVERTAKE}")
cd "$work" || exit 1

# expect NAME COMMAND...: succeeds.
expect() {
  local name=$1
  shift
  "$@" >stdout 2>stderr || { fail "$name: exit code $?: $(head -c 400 stderr)"; return 1; }
}

# refuse SENTENCE ARGUMENTS...: overtake says exactly that line (a glob pattern) and exits with 1.
refuse() {
  local sentence=$1 code
  shift
  "$overtake" "$@" >stdout 2>stderr
  code=$?
  ((code == 1)) || fail "$*: exit code $code, not 1"
  [[ $(wc -l <stderr) == 1 ]] || fail "$*: not one line: $(head -c 400 stderr)"
  # shellcheck disable=SC2053
  [[ $(cat stderr) == "overtake: "$sentence ]] || fail "$*: said '$(head -c 400 stderr)', not '$sentence'"
}

has_header() { [[ $(head -n 1 "$1") == "$2" ]] || fail "$1 begins with $(head -n 1 "$1")"; }

# ---- results
expect "version" "$overtake" --version && grep -q '^overtake [0-9]' stdout || fail "no version"
expect "help" "$overtake" --help
expect "params" "$overtake" params && grep -q '^tracker.confirm_hits' stdout || fail "params lists no tracker.confirm_hits"
expect "scene" "$overtake" scene --out scene --frames 8
run=("$overtake" run scene --rig av21 --ego scene/ego.csv --map scene/map.csv --set tracker.confirm_hits=3)
expect "run" "${run[@]}" --out run
grep -q '^ *scan  *points' stdout || fail "run prints no table"
has_header run/detections.csv frame,stamp_ns,x_m,y_m,z_m,heading_rad,heading_source,length_m,width_m,points,inliers_ref,inliers_var,heading_ref_rad,heading_var_rad,sensor_mask
has_header run/tracks.csv stamp_ns,id,state,frame,x_m,y_m,speed_mps,course_rad,yaw_rate_rps,heading_rad,age,hits,var_x,var_y
has_header run/timing.csv frame,stamp_ns,sensor,stage,time_us
for table in run/*.csv; do
  awk -F, 'NR == 1 { n = NF } NF != n { exit 1 }' "$table" || fail "$table: a row is not as long as the header"
done
[[ $(awk -F, 'NR > 1 { print $1 }' run/timing.csv | sort -un | tr '\n' ' ') == "0 1 2 3 4 5 6 7 " ]] || fail "timing.csv lacks frames"
grep -q ',confirmed,7,' run/tracks.csv || fail "no confirmed track at the end of the scene"
grep -q '^confirm_hits = 3$' run/config.toml || fail "config.toml lacks what --set said"

expect "quiet" "${run[@]}" --quiet --out again && [[ ! -s stdout && ! -s stderr ]] || fail "--quiet prints"
expect "config" "$overtake" run scene --config run/config.toml --out from_config
expect "workers" "${run[@]}" --workers 3 --out workers
expect "trace" "${run[@]}" --workers 2 --out traced --trace trace.json
[[ $(grep -c '"name":"track"' trace.json) == 8 ]] || fail "trace.json lacks frames"
[[ $(tail -n 1 trace.json) == "]}" ]] || fail "trace.json does not end"
cmp -s workers/tracks.csv traced/tracks.csv || fail "--trace changes the tracks"
expect "a worker per CPU" "${run[@]}" --workers 0 --out workers_0
expect "isa" "${run[@]}" --isa ref --out isa
for other in again from_config workers workers_0 isa; do
  for table in detections tracks; do cmp run/$table.csv "$other/$table.csv" || fail "$other/$table.csv differs"; done
done
cmp run/config.toml from_config/config.toml || fail "config.toml changes on its way through --config"

expect "inspect" "$overtake" inspect scene --rig av21 --frame 3 --sensor front --out images
for image in range elevation range_filled angle angle_smooth nonground range_repaired nonground_repaired labels \
  pixel_point point_label point_reason; do
  [[ $(head -c 6 images/$image.npy) == $'\x93NUMPY' ]] || fail "images/$image.npy is no NPY file"
  [[ $(head -c 4 images/$image.png | tail -c 3) == PNG ]] || fail "images/$image.png is no PNG file"
done
grep -q '"0": "labelled"' images/reasons.json || fail "reasons.json does not name reason 0"
grep -q "'descr': '<f4'.*'shape': (32, 857)" <(head -c 128 images/range.npy | tr -d '\0') || fail "range.npy has another type or shape"

{ echo stamp_ns,x_m,y_m; for i in {0..29}; do echo "$((i * 50000000)),$((i * 2)),5"; done; echo 1500000000,,; } >detections.csv
expect "track" "$overtake" track detections.csv --out track
[[ $(awk -F, 'NR > 1 { print $2 }' track/tracks.csv | sort -u | wc -l) == 1 ]] || fail "a straight drive is not one track"
awk -F, '$4 == 29 && ($7 < 38 || $7 > 42) { exit 1 }' track/tracks.csv || fail "2 m each 50 ms is not about 40 m/s"
grep -q ',confirmed,30,' track/tracks.csv || fail "an empty scan is not a scan"

# ---- bad input
mkdir -p empty strangers cut
touch file
cp scene/000000_front.pcd strangers/1_rear.pcd
head -c 5000 scene/000000_front.pcd >cut/1_front.pcd
printf 'period_s = 0.05\nlasers = 3\n[[sensor]]\n' >rig.toml
printf 'workers = 1\n[tracker]\nconfirm = 3\n' >config.toml
printf 'workers = 1\n[tracker]\nconfirm_hits = 3000\n' >range.toml
printf '[trackers]\nconfirm_hits = 3\n' >group.toml
printf 'stamp_ns,x_m,y_m\n2,0,0\n1,0,0\n' >back.csv
printf 'stamp_ns,x_m,y_m\n2,0,zero\n' >word.csv
printf 'stamp_ns,x_m,yaw_rad\n2,0,0\n' >ego.csv
printf '0,0,5,5\n1,0,5,5\n2,0,five,5\n' >map.csv
printf 'preset = "best"\n' >preset.toml
printf '0,0,5\n1,0,5\n2,0,5\n' >bound.csv
mkdir -p lone short_box bad_box small
cp scene/000000_left.pcd lone
for folder in short_box bad_box; do cp scene/000000_front.pcd $folder; done
echo 1 2 3 >short_box/000000_box.txt
echo 1 2 3 4 5 6 east >bad_box/000000_box.txt
cp scene/000000_front.pcd small/0_front.pcd
cat >small.toml <<'END'
period_s = 0.05
[[sensor]]
name = "front"
x_m = 0
y_m = 0
z_m = 1
rows = 32
cols = 857
azimuth_left_deg = 60
azimuth_right_deg = -60
point_capacity = 100
END
av21=(--rig av21 --out out)
refuse "*no: no such folder" run no "${av21[@]}"
refuse "*empty: holds nothing that is read: no .pcd, .bin, .db3 or .mcap file" run empty "${av21[@]}"
refuse "*1_rear.pcd: rig av21 has no sensor 'rear' (it has front, left, right)" run strangers "${av21[@]}"
refuse "*1_front.pcd: the data ends at field '*' of point *; * points are declared" run cut "${av21[@]}"
refuse "*1_front.pcd: rig hdl64 has no sensor 'front' (it has top)" run cut --rig hdl64 --out out
refuse "--rig is needed (the recording holds none): a TOML file, or av21, racecar, hdl64, hdl32, nuscenes, av2" run scene --out out
refuse "--rig is needed (the recording holds none): *" label scene --out out
for command in label run doctor "inspect --frame 0 --sensor front"; do
  # shellcheck disable=SC2086
  refuse "nope.mcap: no such file" $command nope.mcap $([[ $command == doctor ]] || echo --out out)
done
refuse "av22: neither a file nor one of the built-in rigs *" run scene --rig av22 --out out
refuse "rig.toml:3: sensor 1: 'name' is missing" run scene --rig rig.toml --out out
refuse "config.toml:3: tracker: unknown key 'confirm'" run scene --config config.toml "${av21[@]}"
refuse "range.toml:3: tracker: tracker.confirm_hits is '3000', it takes a whole number from *" run scene --config range.toml "${av21[@]}"
refuse "group.toml:1: unknown key 'trackers'" run scene --config group.toml "${av21[@]}"
refuse "no.toml: no such file" run scene --config no.toml "${av21[@]}"
refuse "--preset: there is no preset 'best' (there is: paper)" run scene --preset best "${av21[@]}"
refuse "preset.toml:1: there is no preset 'best' (there is: paper)" run scene --config preset.toml "${av21[@]}"
refuse "--set tracker.M=3: there is no parameter 'tracker.M' *" run scene --set tracker.M=3 "${av21[@]}"
refuse "--set tracker.confirm_hits: key=value is needed" run scene --set tracker.confirm_hits "${av21[@]}"
refuse "--set tracker.confirm_hits=x: tracker.confirm_hits is 'x', it takes a whole number from *" run scene --set tracker.confirm_hits=x "${av21[@]}"
refuse "--set smooth.window=99: smooth.window is '99', it takes a whole number from *" run scene --set smooth.window=99 "${av21[@]}"
refuse "bound.csv:1: a bound has two columns, *" run scene --map bound.csv,bound.csv "${av21[@]}"
refuse "*short_box/000000_box.txt:1: 7 numbers are needed: *" run short_box "${av21[@]}"
refuse "*bad_box/000000_box.txt:1: 'east' is no number" run bad_box "${av21[@]}"
refuse "*0_front.pcd: * points, but sensor 'front' has point_capacity 100" run small --rig small.toml --out out
refuse "map.csv:3:5: 'five' is no number" run scene --map map.csv "${av21[@]}"
refuse "no.csv: no such file" run scene --map no.csv "${av21[@]}"
refuse "ego.csv: no column y_m or y *" run scene --ego ego.csv "${av21[@]}"
refuse "--isa z80: *" run scene --isa z80 "${av21[@]}"
refuse "file/out: the folder cannot be made" run scene --rig av21 --out file/out
refuse "--sensor is needed: front, left, right" inspect scene --frame 3 "${av21[@]}"
refuse "--sensor top: rig av21 has front, left, right" inspect scene --frame 3 --sensor top "${av21[@]}"
refuse "--frame is needed: scene has several, from 0 on" inspect scene --sensor front "${av21[@]}"
refuse "--frame 99: scene has no such frame (there are 0 to 7)" inspect scene --frame 99 --sensor front "${av21[@]}"
refuse "lone: frame 0 has no scan of sensor 'front'" inspect lone --frame 0 --sensor front "${av21[@]}"
refuse "back.csv:3:1: the stamp goes back" track back.csv --out out
refuse "word.csv:2:5: y_m 'zero' is no number" track word.csv --out out
refuse "no/trace.json: cannot be written: No such file or directory" run scene "${av21[@]}" --trace no/trace.json
refuse "no.csv: no such file" track no.csv --out out
for usage in "" "run" "run scene --rig av21" "run scene --rig av21 --out out --workers -1" "fly scene"; do
  # shellcheck disable=SC2086
  "$overtake" $usage >stdout 2>stderr
  code=$?
  ((code == 2)) && [[ -s stderr ]] || fail "overtake $usage: exit code $code, not 2, or no word"
done

# ---- a simulated log is run by its own rig, map and ego poses; what is given wins
expect "simulate a log" "$overtake" simulate demo --seed 3 --seconds 0.5 --out race.mcap --quiet
expect "simulate a folder" "$overtake" simulate demo --seed 3 --seconds 0.5 --out race --quiet
run_hash() {
  "$overtake" run "$@" --out own >stdout 2>stderr || fail "run $*: $(cat stderr)"
  sed -n 's/^Hash of all detections and tracks: //p' stdout
}
own=$(run_hash race.mcap)
[[ -n $own ]] || fail "a log alone gives no hash"
grep -q '^note: the rig and the map are from the log itself$' stdout || fail "the log's own rig and map are not said: $(cat stdout)"
grep -q 'no ego poses\|no map' stdout && fail "the log's own poses or map are not used: $(cat stdout)"
[[ $(run_hash race.mcap --rig race/rig.toml --map race/map.csv) == "$own" ]] || fail "the log's own rig and map are not those of the folder"
grep -q 'from the log itself' stdout && fail "what is given is said to be the log's"
[[ $(run_hash race --rig race.mcap --map race.mcap) == "$(run_hash race --rig race/rig.toml --map race/map.csv)" ]] ||
  fail "--rig and --map do not take a log"
without=$(run_hash race.mcap --map none)
[[ $without != "$own" ]] || fail "--map none changes nothing"
grep -q '^note: no map' stdout || fail "--map none: $(cat stdout)"
cp own/config.toml without.toml
[[ $(run_hash race.mcap --config without.toml) == "$without" ]] || fail "config.toml does not repeat --map none"
run_hash race.mcap --rig race/rig.toml --ego race/ego.csv >/dev/null
grep -q '^note: the map is from the log itself$' stdout || fail "a rig and poses given, the map the log's: $(cat stdout)"
cp own/config.toml given.toml
[[ $(run_hash race.mcap --config given.toml) == "$(run_hash race.mcap --ego race/ego.csv)" ]] || fail "config.toml does not repeat it"
expect "inspect of a log alone" "$overtake" inspect race.mcap --frame 3 --sensor front --out look --quiet
[[ -s look/scan.png ]] || fail "inspect draws no scan.png"
expect "doctor of a log alone" "$overtake" doctor race.mcap
expect "label of a log alone" "$overtake" label race.mcap --frame 3 --out labels_own --quiet
expect "label with its rig" "$overtake" label race.mcap --rig race/rig.toml --frame 3 --out labels_given --quiet
diff -rq labels_own labels_given || fail "label takes another rig than the log's"

# ---- pictures of a race
expect "pictures" "$overtake" simulate demo --pictures pictures --picture-at 1.5
for picture in above front left right; do
  [[ $(head -c 4 pictures/$picture.png | tail -c 3) == PNG ]] || fail "no picture $picture.png"
done
"$overtake" simulate demo >stdout 2>stderr
code=$?
((code == 2)) && grep -q -- '--out or --pictures' stderr || fail "simulate without an output: exit code $code, $(cat stderr)"

# ---- Ctrl-C keeps what is done
mkdir long
for ((i = 0; i < 2000; ++i)); do
  for sensor in front left right; do ln "scene/00000$((i % 8))_$sensor.pcd" "long/${i}_$sensor.pcd"; done
done
"$overtake" run long --rig av21 --out long_run --quiet >stdout 2>stderr &
pid=$!
for ((i = 0; i < 200; ++i)); do
  [[ -s long_run/tracks.csv.part && $(wc -l <long_run/tracks.csv.part) -gt 20 ]] && break
  sleep 0.1
done
kill -INT $pid
wait $pid
code=$?
((code == 130)) || fail "after Ctrl-C the exit code is $code, not 130"
grep -q '^overtake: interrupted after [0-9]* frames; what is done is kept, its names end in .part$' stderr || fail "after Ctrl-C: $(cat stderr)"
done_frames=$(sed 's/[^0-9]//g' stderr)
[[ $(tail -n 1 long_run/timing.csv.part) == "$((done_frames - 1))",* ]] || fail "timing.csv.part does not end with the last frame"
((done_frames < 2000)) || fail "Ctrl-C came too late to show anything"
for table in long_run/*.csv.part; do
  [[ -z $(tail -c 1 "$table") ]] || fail "$table ends in the middle of a row"
done
[[ -s long_run/config.toml.part ]] || fail "no config.toml after Ctrl-C"

passed "all command line checks passed"
