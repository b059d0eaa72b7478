#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_cli.sh OVERTAKE. The command line as users call it: files and columns, same bytes, exit codes, the
# one sentence for each kind of bad input, Ctrl-C. Needs no recording: it makes a small scene. Exit code 0 is a pass.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
readonly overtake=$(realpath "${1:?usage: test_cli.sh OVERTAKE WRITE_SCENE}") write_scene=$(realpath "${2:?}")
readonly scenarios=$(cd "$(dirname "${BASH_SOURCE[0]}")/../tools/sim/scenarios" && pwd)
cd "$work" || exit 1

# expect NAME COMMAND...: the command must succeed.
expect() {
  local name=$1
  shift
  "$@" >stdout 2>stderr || { fail "$name: exit code $?: $(head -c 400 stderr)"; return 1; }
}

# refuse SENTENCE ARGUMENTS...: overtake must print exactly this line (a glob pattern) and exit with 1.
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
expect "info --help" "$overtake" info --help && grep -q '^ *PCD (.pcd): ' stdout && grep -q '^ *MCAP (.mcap): ' stdout ||
  fail "the help of info lists no formats"
expect "params" "$overtake" params && grep -q '^tracker.confirm_hits' stdout || fail "params lists no tracker.confirm_hits"
expect "scene" "$write_scene" scene 8
run=("$overtake" run scene --rig av21 --ego scene/ego.csv --map scene/map.csv --set tracker.horizon_s=2.5)
expect "run" "${run[@]}" --out run
grep -q '^ *scan  *points' stdout || fail "run prints no table"
has_header run/detections.csv frame,stamp_ns,x_m,y_m,z_m,heading_rad,heading_source,length_m,width_m,points,inliers_ref,inliers_var,heading_ref_rad,heading_var_rad,sensor_mask,var_x,var_y,cov_xy,view,class,road_z_m,height_m,ego_offset_rad
has_header run/tracks.csv stamp_ns,id,state,frame,x_m,y_m,speed_mps,course_rad,yaw_rate_rps,heading_rad,age,hits,var_x,var_y,ahead_m,left_m,name,existence,class,visibility,unseen_s,heading_sigma_rad
has_header run/timing.csv frame,stamp_ns,sensor,stage,time_us
for table in run/*.csv; do
  awk -F, 'NR == 1 { n = NF } NF != n { exit 1 }' "$table" || fail "$table: a row is not as long as the header"
done
[[ $(awk -F, 'NR > 1 { print $1 }' run/timing.csv | sort -un | tr '\n' ' ') == "0 1 2 3 4 5 6 7 " ]] || fail "timing.csv lacks frames"
awk -F, 'FNR > 1 && $4 == 7 && $3 == "confirmed" && $18 > 0.9 && $19 == "car" && $20 == "seen" && $21 < 0.1 { found = 1 }
  END { exit !found }' run/tracks.csv || fail "no track of a car that was just seen: $(tail -n 3 run/tracks.csv)"
# The opponent's columns in the ego vehicle's frame equal the truth, and the name is the id's slot and generation.
awk -F, 'NR == FNR { if ($1 == 7) { x = $3; y = $4 } next }
  FNR > 1 && $4 == 7 && ($15 - x) ^ 2 + ($16 - y) ^ 2 < 9 { near = 1 }
  FNR > 1 { split($17, part, ":"); if (part[2] * 4294967296 + part[1] != $2) wrong = 1 }
  END { exit !near || wrong }' scene/truth.csv run/tracks.csv || fail "ahead_m, left_m, name of tracks.csv: $(tail -n 3 run/tracks.csv)"
grep -q ' hits of last 20  age in iterations$' stdout || fail "run's table does not say what hits and age are: $(cat stdout)"
grep -qE '^ +[0-9]+:[0-9]+ +map ' stdout || fail "run's table does not name tracks by slot and generation: $(cat stdout)"
expect "run of paper" "${run[@]}" --preset paper --out run_paper
has_header run_paper/tracks.csv stamp_ns,id,state,frame,x_m,y_m,speed_mps,course_rad,yaw_rate_rps,heading_rad,age,hits,var_x,var_y,ahead_m,left_m,name
grep -q ',confirmed,7,' run/tracks.csv || fail "no confirmed track at the end of the scene"
grep -q '^horizon_s = 2.5$' run/config.toml || fail "config.toml lacks what --set said"

expect "quiet" "${run[@]}" --quiet --out again && [[ ! -s stdout && ! -s stderr ]] || fail "--quiet prints"
expect "config" "$overtake" run scene --config run/config.toml --out from_config
expect "picture of a frame" "${run[@]}" --picture-at 6 --out pictured
[[ $(head -c 8 pictured/frame_6.png | od -An -tx1 | tr -d ' ') == 89504e470d0a1a0a ]] || fail "frame_6.png is no PNG"
expect "workers" "${run[@]}" --workers 3 --out workers
expect "trace" "${run[@]}" --workers 2 --out traced --trace trace.json
[[ $(grep -c '"name":"track"' trace.json) == 8 ]] || fail "trace.json lacks frames"
[[ $(tail -n 1 trace.json) == "]}" ]] || fail "trace.json does not end"
cmp -s workers/tracks.csv traced/tracks.csv || fail "--trace changes the tracks"
expect "scans in pieces" "${run[@]}" --stream --out pieces
expect "a worker per CPU" "${run[@]}" --workers 0 --out workers_0
expect "isa" "${run[@]}" --isa ref --out isa
for other in again from_config workers workers_0 isa pieces; do
  for table in detections tracks; do cmp run/$table.csv "$other/$table.csv" || fail "$other/$table.csv differs"; done
done
cmp run/config.toml from_config/config.toml || fail "config.toml changes on its way through --config"

expect "inspect" "$overtake" inspect scene --rig av21 --frame 3 --sensor front --preset paper --out images
for image in range elevation range_filled angle angle_smooth nonground range_repaired nonground_repaired labels \
  pixel_point point_label point_reason; do
  [[ $(head -c 6 images/$image.npy) == $'\x93NUMPY' ]] || fail "images/$image.npy is no NPY file"
  [[ $(head -c 4 images/$image.png | tail -c 3) == PNG ]] || fail "images/$image.png is no PNG file"
done
expect "inspect with the default preset" "$overtake" inspect scene --rig av21 --frame 3 --sensor front --out images_best &&
  [[ -s images_best/height.png && ! -e images_best/angle.png ]] || fail "inspect's default is not preset best"
grep -q '^preset = "best"$' run/config.toml || fail "the default preset of run is not best"
grep -q '"0": "labelled"' images/reasons.json || fail "reasons.json does not name reason 0"
grep -q "'descr': '<f4'.*'shape': (32, 857)" <(head -c 128 images/range.npy | tr -d '\0') || fail "range.npy has another type or shape"

{ echo stamp_ns,x_m,y_m; for i in {0..29}; do echo "$((i * 50000000)),$((i * 2)),5"; done; echo 1500000000,,; } >detections.csv
expect "track" "$overtake" track detections.csv --out track
grep -q '^note: .* not read' stdout && fail "track does not read a column: $(cat stdout)"
printf 'stamp_ns,x_m,y_m,lenght_m,yaw_rad,heading_rad,class\n0,1,2,4.5,0,0,car\n' >unread.csv
expect "track with unknown columns" "$overtake" track unread.csv --out track_unread
[[ $(grep -c '^note: unread.csv has columns that are not read: lenght_m, yaw_rad, class$' stdout) == 1 ]] ||
  fail "unknown columns are not named once: $(cat stdout)"
[[ $(awk -F, 'NR > 1 { print $2 }' track/tracks.csv | sort -u | wc -l) == 1 ]] || fail "a straight drive is not one track"
awk -F, '$4 == 29 && ($7 < 38 || $7 > 42) { exit 1 }' track/tracks.csv || fail "2 m each 50 ms is not about 40 m/s"
awk -F, 'NR > 1 && $15 $16 != "" { exit 1 }' track/tracks.csv || fail "track knows no ego pose, and says how far ahead a car is"
{ echo stamp_ns,x_m,y_m,heading_rad,length_m,width_m,height_m
  for i in {0..29}; do echo "$((i * 50000000)),$((i * 2)),5,0,4.6,1.9,$([[ $i == 5 ]] || echo 1.2)"; done; } >boxes.csv
expect "track with boxes" "$overtake" track boxes.csv --out track_boxes
cmp -s <(cut -d, -f1-14 track/tracks.csv | head -n 31) <(cut -d, -f1-14 track_boxes/tracks.csv) ||
  fail "boxes change where a car is: $(tail -n 1 track_boxes/tracks.csv)"
confirmed_at() {   # the first frame with a confirmed track, of rows of this height and score
  { echo stamp_ns,x_m,y_m,height_m,score; for i in {0..29}; do echo "$((i * 50000000)),$((i * 2)),5,$1,$2"; done; } >scored.csv
  "$overtake" track scored.csv --out scored --force --quiet || { echo failed && return; }
  awk -F, '/,confirmed,/ { print $4; exit }' scored/tracks.csv
}
[[ $(confirmed_at 1.2 0.9) == 1 && $(confirmed_at 1.2 "") == 1 ]] || fail "a car of a high score is not confirmed at its second row"
[[ $(confirmed_at 1.2 0.2) =~ ^[3-9]$ ]] || fail "a low score does not confirm later"
[[ -z $(confirmed_at 0.2 0.5) ]] || fail "a box of 0.2 m is a car"
{ echo stamp_ns,x_m,y_m,yaw_rad,speed_mps; for i in {-5..160}; do echo "$((i * 10000000)),$((i * 1)),1,0,100"; done; } >straight.csv
expect "track with ego poses" "$overtake" track detections.csv --ego straight.csv --out track_ego
awk -F, 'NR > 1 && $4 == 29 && ($15 + 145 - $5) ^ 2 + ($16 + 1 - $6) ^ 2 > 0.01 { exit 1 }' track_ego/tracks.csv ||
  fail "ahead_m, left_m are not those of the ego pose: $(tail -n 1 track_ego/tracks.csv)"
grep -q ',confirmed,30,' track/tracks.csv || fail "an empty scan is not a scan"

# ---- bad input
mkdir -p empty strangers cut
touch file
cp scene/000000_front.pcd strangers/1_rear.pcd
head -c 5000 scene/000000_front.pcd >cut/1_front.pcd
printf 'period_s = 0.05\nlasers = 3\n[[sensor]]\n' >rig.toml
printf 'workers = 1\n[tracker]\nconfirm = 3\n' >config.toml
printf 'period_s = 0.05\nshard_cloud = true\n[[sensor]]\nname = "front"\nx_m = 0\ny_m = 0\nz_m = 1\nrows = 32\ncols = 857\nwraps = true\n' >rig_key.toml
printf 'workers = 1\n[tracker]\nconfirm_hits = 3000\n' >range.toml
printf '[trackers]\nconfirm_hits = 3\n' >group.toml
printf 'stamp_ns,x_m,y_m\n2,0,0\n1,0,0\n' >back.csv
printf 'stamp_ns,x_m,y_m\n2,0,zero\n' >word.csv
printf 'stamp_ns,x_m,yaw_rad\n2,0,0\n' >ego.csv
printf '0,0,5,5\n1,0,5,5\n2,0,five,5\n' >map.csv
printf 'preset = "worst"\n' >preset.toml
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
refuse "*empty: holds no recording: no .pcd, .pcd.bin, .bin,*.db3 or .mcap file" run empty "${av21[@]}"
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
refuse "--picture-at 600: has no effect: the recording has no frame of that number" "${run[@]:1}" --picture-at 600 --out out
refuse "rig.toml:3: sensor 1: 'name' is missing" run scene --rig rig.toml --out out
refuse "av22: neither a file nor one of the built-in rigs *; did you mean 'av21'[?]" run scene --rig av22 --out out
refuse "demoo: is neither a file nor a built-in scenario; *; did you mean 'demo'[?]" simulate demoo --out out
refuse "rig_key.toml:2: unknown key 'shard_cloud'; did you mean 'shared_cloud'[?]" run scene --rig rig_key.toml --out out
refuse "config.toml:3: tracker: unknown key 'confirm'; did you mean 'confirm_hits'[?]" run scene --config config.toml "${av21[@]}"
refuse "range.toml:3: tracker: tracker.confirm_hits is '3000', it takes a whole number from *" run scene --config range.toml "${av21[@]}"
refuse "group.toml:1: unknown key 'trackers'" run scene --config group.toml "${av21[@]}"
printf '[[tracker]]\nconfirm_hits = 3\n[[tracker]]\nconfirm_hits = 9\n' >twice.toml
refuse "twice.toml:3: a second table [[][[]tracker]]: only one is read, as [[]tracker]" run scene --config twice.toml "${av21[@]}"
printf '[[car]]\nname = "ego"\n[[sensors]]\n[[sensors]]\n' >two_sensors.toml
refuse "two_sensors.toml:4: a second table [[][[]sensors]]: only one is read, *" simulate two_sensors.toml --out out
printf '[[car]]\nname = "ego"\n[[reflector]]\ns_m = 5\nd_m = 3\ncount = 2.7\n' >post.toml
refuse "post.toml:6: reflector: 'count' is not a whole number" simulate post.toml --out out
refuse "no.toml: no such file" run scene --config no.toml "${av21[@]}"
refuse "--preset: there is no preset 'worst' (there is: paper, best)" run scene --preset worst "${av21[@]}"
refuse "preset.toml:1: there is no preset 'worst' (there is: paper, best)" run scene --config preset.toml "${av21[@]}"
refuse "--set smooth.window=5: has no effect: preset best does not read it (overtake params --preset best tells which it reads)" \
  run scene --set smooth.window=5 "${av21[@]}"
refuse "--sweep smooth.window=3:7:2: has no effect: preset best does not read it *" \
  evaluate scene --preset best --sweep smooth.window=3:7:2 --out out
printf '[tracker]\nconfirm_hits = nan\n' >nan.toml
refuse "nan.toml:2: tracker: tracker.confirm_hits is 'nan', it takes a whole number from 1 to 64 hits" \
  run scene --config nan.toml "${av21[@]}"
printf 'x_m,y_m,w_tr_right_m,w_tr_left_m\n0,0,0,0\n9,0,0,0\n18,0,0,0\n' >thin.csv
refuse "thin.csv: a track map is nowhere 1 m wide: *" run scene --map thin.csv --ego scene/ego.csv "${av21[@]}"
refuse "--allow-origin https://app.example/x: is the origin of no page: scheme://host[[]:port] is needed" \
  run scene --live 0 --allow-origin https://app.example/x "${av21[@]}"
refuse "--set tracker.M=3: there is no parameter 'tracker.M' *" run scene --set tracker.M=3 "${av21[@]}"
refuse "--set tracker.confrm_hits=3: there is no parameter 'tracker.confrm_hits' *; did you mean 'tracker.confirm_hits'[?]" \
  run scene --set tracker.confrm_hits=3 "${av21[@]}"
refuse "--set tracker.confirm_hits=65: tracker.confirm_hits is '65', it takes a whole number from 1 to 64 hits" \
  run scene --set tracker.confirm_hits=65 "${av21[@]}"
refuse "--set tracker.confirm_hits: key=value is needed" run scene --set tracker.confirm_hits "${av21[@]}"
refuse "--set tracker.confirm_hits=x: tracker.confirm_hits is 'x', it takes a whole number from *" run scene --set tracker.confirm_hits=x "${av21[@]}"
refuse "--set smooth.window=99: smooth.window is '99', it takes a whole number from *" run scene --set smooth.window=99 "${av21[@]}"
refuse "bound.csv:1: a bound has two columns, *" run scene --map bound.csv,bound.csv "${av21[@]}"
for box in "short_box|7 numbers are needed: x y z length width height yaw" "bad_box|'east' is not a number"; do
  expect "run with an odd box" "$overtake" run "${box%|*}" --rig av21 --out odd_box
  grep -qxF "note: 1 box of the opponent could not be read; the first: ${box%|*}/000000_box.txt:1: ${box#*|}" stdout ||
    fail "an odd box is not named: $(cat stdout)"
done
refuse "*0_front.pcd: * points, but sensor 'front' has point_capacity 100 (--capacity points=* raises it)" run small --rig small.toml --out out
refuse "map.csv:3:5: 'five' is not a number" run scene --map map.csv "${av21[@]}"
refuse "no.csv: no such file" run scene --map no.csv "${av21[@]}"
refuse "ego.csv: no column y_m or y *" run scene --ego ego.csv "${av21[@]}"
refuse "--isa sse9: unknown, or this CPU lacks it; it has ref*" run scene --isa sse9 "${av21[@]}"
: >empty.mcap
for command in info doctor run label inspect; do
  # shellcheck disable=SC2086
  refuse "empty.mcap: is empty (0 bytes)" $command empty.mcap $([[ $command == info || $command == doctor ]] || echo --out out)
done
refuse "file/out: the folder cannot be made: Not a directory" run scene --rig av21 --out file/out
refuse "--sensor is needed: front, left, right" inspect scene --frame 3 "${av21[@]}"
refuse "--sensor top: rig av21 has front, left, right" inspect scene --frame 3 --sensor top "${av21[@]}"
refuse "--frame is needed: scene has several, from 0 on" inspect scene --sensor front "${av21[@]}"
refuse "--frame 99: scene has no such frame (there are 0 to 7)" inspect scene --frame 99 --sensor front "${av21[@]}"
refuse "lone: frame 0 has no scan of sensor 'front'" inspect lone --frame 0 --sensor front "${av21[@]}"
refuse "back.csv:3:1: the stamp goes back" track back.csv --out out
refuse "word.csv:2:5: y_m 'zero' is not a number" track word.csv --out out
printf 'stamp_ns,x_m,y_m,length_m,width_m\n0,1,2,4.5,1.8\n1,1,2,4.5,-1.8\n' >narrow.csv
printf 'stamp_ns,x_m,y_m,height_m\n0,1,2,\n1,1,2,tall\n' >tall.csv
refuse "narrow.csv:3:11: width_m is not positive" track narrow.csv --out out
printf 'stamp_ns,x_m,y_m,score\n0,1,2,0.5\n1,1,2,87\n' >percent.csv
refuse "percent.csv:3:7: score is not between 0 and 1" track percent.csv --out out
printf 'stamp_ns,x_m,y_m,var_x,var_y\n0,1,2,0.1,0.1\n1,1,2,0.1,-0.1\n' >unsure.csv
refuse "unsure.csv:3:11: var_y is negative" track unsure.csv --out out
sed -i 's/-0.1/0.1/; s/1,2,0.1/1,2,-0.1/' unsure.csv
refuse "unsure.csv:2:7: var_x is negative" track unsure.csv --out out
for row in "0.1,,|var_x and var_y are needed together" ",,0.1|cov_xy needs var_x and var_y" \
  "0,0,|a variance is not between 1e-12 and 1e12 m^2" "0.1,0.1,0.1|cov_xy is too large: its square must be below var_x [*] var_y"; do
  printf 'stamp_ns,x_m,y_m,var_x,var_y,cov_xy\n0,1,2,0.1,0.2,\n1,1,2,0.1,0.2,-0.1\n2,1,2,%s\n' "${row%|*}" >unsure.csv
  refuse "unsure.csv:4:*: ${row#*|}" track unsure.csv --out out
done
{ echo stamp_ns,x_m,y_m; for i in {1..300}; do echo "7,$((i * 10)),5"; done; } >many.csv
refuse "many.csv: scan 7 has 300 rows, at most 256 are taken (--capacity candidates=512 raises it)" track many.csv --out out
expect "track of many rows" "$overtake" track many.csv --capacity candidates=512 --out many
printf 'stamp_ns,x_m,y_m\n0,1,2\n1,1e20,2\n' >far.csv
expect "track of a row without a place" "$overtake" track far.csv --out far
grep -q '^note: of 2 rows 1 was not used: 1 without a place' stdout || fail "a row that is not used is not said: $(cat stdout)"
printf 'stamp_ns,x_m,y_m,x_m\n0,1,2,3\n' >double.csv
refuse "double.csv: two columns are named x_m" track double.csv --out out
refuse "tall.csv:3:7: height_m 'tall' is not a number" track tall.csv --out out
refuse "no/trace.json: cannot be written: No such file or directory" run scene "${av21[@]}" --trace no/trace.json
refuse "no.csv: no such file" track no.csv --out out
for usage in "" "run" "run scene --rig av21" "run scene --rig av21 --out out --workers -1" "fly scene" \
  "evaluate race.mcap --preset best --map scene/map.csv --out out"; do
  # shellcheck disable=SC2086
  "$overtake" $usage >stdout 2>stderr
  code=$?
  ((code == 2)) && [[ -s stderr ]] || fail "overtake $usage: exit code $code, not 2, or no word"
  [[ $(wc -l <stderr) == 1 && $(cat stderr) == "overtake: "* && ! -s stdout ]] || fail "overtake $usage: says $(cat stdout stderr)"
done
# misuse SENTENCE ARGUMENTS...: overtake must print exactly this line and exit with 2.
misuse() {
  local sentence=$1 code
  shift
  "$overtake" "$@" >stdout 2>stderr
  code=$?
  # shellcheck disable=SC2053
  ((code == 2)) && [[ $(cat stderr) == "overtake: "$sentence ]] || fail "$*: exit code $code, '$(cat stderr)', not '$sentence'"
}
rm -rf out
misuse "a command is needed: run, inspect, track, *, params (overtake --help)"
misuse "unknown command 'rnu'; did you mean 'run'[?] (overtake --help)" rnu scene
misuse "unknown command 'fly' (overtake --help)" fly scene
misuse "run: unknown option '--rgi'; did you mean '--rig'[?] (overtake run --help)" run --rgi av21 scene
misuse "run: unknown option '--rgi'; did you mean '--rig'[?] (overtake run --help)" run scene --rgi=av21 --out out
misuse "simulate: unknown option '--sed'; did you mean '--seed'[?] (overtake simulate --help)" simulate demo --sed 3 --out out
misuse "run: 'b' is one argument too many (overtake run --help)" run a b --rig av21 --out out
misuse "run: --out is required (overtake run --help)" run scene --rig av21
misuse "run: --workers: *-1* (overtake run --help)" run scene --rig av21 --out out --workers -1
misuse "run: --rig: is empty; a value is needed (overtake run --help)" run scene --rig "" --out out
for option in map ego config preset isa mcap trace; do
  misuse "run: --$option: is empty; a value is needed (overtake run --help)" run scene --rig av21 --out out --$option ""
done
misuse "run: --out: is empty; a value is needed (overtake run --help)" run scene --rig av21 --out ""
misuse "run: input: is empty; a value is needed (overtake run --help)" run "" --rig av21 --out out
for number in -1 1.5 nan inf 18446744073709551616 ""; do
  misuse "simulate: --seed: Value $number is not a whole number from 0 on (overtake simulate --help)" simulate demo --seed "$number" --out out
done
misuse "simulate: --seed: Value +-1 is not a *" simulate demo --seed +-1 --out out
expect "--seed +5" "$overtake" simulate demo --seed +5 --seconds 0.05 --out plus --quiet
for number in nan -nan inf -1 1e9; do
  misuse "simulate: --seconds: Value $number not in range 0.05 to 36000 (overtake simulate --help)" simulate demo --seconds $number --out out
  misuse "simulate: --picture-at: Value $number not in range 0 to 36000 *" simulate demo --pictures out --picture-at $number
  misuse "run: --rate: Value $number not in range 0.001 to 1000 *" run scene --rig av21 --out out --rate $number
  misuse "label: --flat-deg: Value $number not in range 1 to 89 *" label scene --rig av21 --out out --flat-deg $number
done
misuse "inspect: --frame: Value -3 not in range 0 to *" inspect scene --rig av21 --sensor front --out out --frame -3
[[ ! -e out/tracks.csv ]] || fail "a wrong command line was executed"
"$overtake" --help >stdout || fail "--help fails"
for code in "0 done" "1 an error" "2 a wrong command line" "3 the recording is damaged" "the map or the ego poses do not fit" \
  "130 ended by Ctrl-C"; do
  grep -q "\(^\|[ ;]\)$code" stdout || fail "--help does not say exit code $code: $(cat stdout)"
done

# ---- a command that is gone works for one more version, says what to use, and nothing names it
expect "scene" "$overtake" scene --frames 2 --seed 3 --out gone.d
[[ $(cat stderr) == "overtake: scene is gone"*"use: overtake simulate demo --seconds 0.1 --seed 3 --out gone.d" ]] || fail "scene says $(cat stderr)"
expect "what it says" "$overtake" simulate demo --seconds 0.1 --seed 3 --out instead
diff -r gone.d instead || fail "scene does something else than it says"
"$overtake" scene --frames 121 --out too_many 2>stderr && fail "scene --frames 121 passes"
[[ $(tail -n 1 stderr) == "overtake: --frames 121: the scenario demo has 120 frames; "* && ! -e too_many ]] || fail "scene --frames 121: $(cat stderr)"
grep -qw scene <("$overtake" --help; "$overtake" 2>&1; "$overtake" scen 2>&1) && fail "overtake names the command that is gone"

# ---- a log or a folder may have the name of its scenario or rig: the built-in one is meant
mkdir demo av21
expect "folder of a scenario's name" "$overtake" simulate demo --seconds 0.1 --seed 3 --out demo/
expect "the same again, over it" "$overtake" simulate demo --seconds 0.1 --seed 3 --out demo/ --force
diff -r gone.d demo || fail "a folder of a scenario's name changes what is simulated"
expect "folder of a rig's name" "$overtake" run demo --rig av21 --out rig_run
cp -r demo/rig.toml ./overtake
refuse "./overtake:1: no car is named 'ego', the ego" simulate ./overtake --out out
rm -r demo av21 overtake rig_run

# ---- one of a thing has no plural
expect "one frame" "$overtake" simulate demo --seconds 0.05 --out one_frame && grep -q ': 1 frame (' stdout || fail "simulate: $(cat stdout)"
expect "one frame" "$write_scene" one 1
expect "run of one frame" "$overtake" run one --rig av21 --out one_run && grep -q '^1 frame[.] Written' stdout ||
  fail "run of one frame: $(cat stdout)"

# ---- JSON, for programs (checked with an independent reader, if there is one)
read_json() {  # FILE EXPRESSION of json
  command -v python3 >/dev/null || return 0
  python3 -c 'import json, sys; json = json.load(open(sys.argv[1])); sys.exit(not eval(sys.argv[2]))' "$@" ||
    fail "$1 is not so: $2: $(head -c 600 "$1")"
}
expect "info --json" "$overtake" info scene --json && cp stdout info.json
read_json info.json 'json["kind"] == "a folder of scans" and [s["files"] for s in json["scans"]] == [8, 8, 8] and json["first_ns"] is None'
expect "params --json" "$overtake" params --json && cp stdout params.json
read_json params.json '{"name": "tracker.confirm_hits", "min": 1, "max": 64}.items() <= [p for p in json["parameters"] if p["name"] == "tracker.confirm_hits"][0].items()'
expect "params" "$overtake" params
grep -qE '^cluster.threshold_deg +2.8 deg ' stdout || fail "params: not the defaults of best"
grep -qE '^smooth.window .*no effect in best[]]$' stdout || fail "params: smooth.window has an effect in best"
expect "params --preset paper" "$overtake" params --preset paper
grep -qE '^cluster.threshold_deg +2.5 deg ' stdout || fail "params --preset paper: other defaults"
refuse "--preset: there is no preset 'worst' (there is: paper, best)" params --preset worst
[[ $(grep -c '"name"' params.json) == $("$overtake" params | wc -l) ]] || fail "params --json lists others than params"
expect "compare" "$overtake" compare run again && grep -q '^Confirmed tracks that only A has: 0$' stdout || fail "compare of equal runs: $(cat stdout)"
expect "another run" "${run[@]}" --set gate.min_points=60 --quiet --out fewer
expect "compare --json" "$overtake" compare run fewer --map scene/map.csv --json && cp stdout compare.json
read_json compare.json 'json["b"]["detections"] < json["a"]["detections"] == json["matched_detections"]["count"] + json["a"]["detections_without_match"]'
refuse "scene/detections.csv: *" compare run scene
misuse "compare: run_b is required (overtake compare --help)" compare run
# Options that another one leaves without effect.
misuse "label: --frame excludes --every (overtake label --help)" label scene --rig av21 --frame 1 --every 2 --out out
judge=(evaluate race.mcap --out out)
misuse "evaluate: --warm-up requires --from (overtake evaluate --help)" "${judge[@]}" --preset best --only-figures --warm-up 3
misuse "evaluate: --tune excludes --sweep (overtake evaluate --help)" "${judge[@]}" --tune --sweep gate.min_points=1:2:1
misuse "evaluate: --tune excludes --preset (overtake evaluate --help)" "${judge[@]}" --tune --preset best
expect "a race" "$overtake" simulate demo --seconds 0.5 --out race.mcap --quiet
expect "evaluate" "$overtake" evaluate race.mcap --preset paper,best --only-figures --quiet --out judged
grep -q note stdout && fail "a note on an evaluation: $(cat stdout)"
printf 'preset = "paper"\n[capacities]\nclusters = 20\n' >few.toml
expect "evaluate with few clusters" "$overtake" evaluate race.mcap --config few.toml --only-figures --quiet --out judged_few
grep -qE '^note: race, few: capacity clusters [(]20[)] was reached in [0-9]+ of 10 frames: .* raise it with \[capacities\] clusters=40$' stdout || fail "a capacity that is reached: $(cat stdout)"
# A damaged log: a sentence also with --quiet, the results, exit code 3.
head -c $(($(stat -c %s race.mcap) / 2)) race.mcap >cut_race.mcap
"$overtake" evaluate cut_race.mcap --preset paper --only-figures --quiet --out judged_cut >stdout 2>stderr
code=$?
((code == 3)) || fail "evaluate of a damaged log: exit code $code"
[[ $(wc -l <stderr) == 1 && $(cat stderr) == "overtake: cut_race.mcap: "*"; results are from the part before it" ]] ||
  fail "evaluate of a damaged log: $(cat stderr)"
[[ -s judged_cut/metrics.json && -s judged_cut/report.html ]] || fail "evaluate of a damaged log: no report"
log=$'cut\xff.mcap'  # a name that is no text
cp race.mcap "$log"
expect "evaluate of a name that is not UTF-8" "$overtake" evaluate "$log" --preset paper --every 9 --frames 2 --quiet --out judged_name
[[ -s judged_name/metrics.json && -s judged_name/report.html ]] || fail "evaluate of a name that is not UTF-8: no report"
expect "a run of a name that is not UTF-8" "$overtake" run "$log" --out named --quiet
expect "its config.toml" "$overtake" run race.mcap --config named/config.toml --out named_again --quiet
cmp named/tracks.csv named_again/tracks.csv || fail "config.toml of a name that is not UTF-8 gives other results"
cp scene/map.csv "$log.csv"
refuse "*/cut?xff.mcap.csv: its path is not UTF-8: config.toml cannot name it" run race.mcap --map "$log.csv" --out out
expect "compare of evaluations" "$overtake" compare judged judged
grep -q '^  judged/best ' stdout && grep -q '^  judged/paper .*[+]' stdout || fail "compare of evaluations: $(cat stdout)"
expect "compare of evaluations --json" "$overtake" compare judged judged --json && cp stdout differences.json
read_json differences.json 'json["base"] == "judged/best" and json["logs"] == 1 and len(json["contestants"]) == 2'
refuse "run: is no result of overtake evaluate*" compare judged run
refuse "judged: is a result of overtake evaluate, and run is none*" compare run judged
refuse "run: is no result of overtake evaluate*" compare run again fewer
refuse "--map: *" compare judged judged --map scene/map.csv
expect "doctor --json" "$overtake" doctor scene --rig av21 --json && cp stdout doctor.json
read_json doctor.json 'json["wrong"] == 0 and json["rig"] == "av21" and json["findings"][0]["severity"] == "note"'

# ---- doctor detects a wrong rig: exit code 3, no error
# diagnose SENTENCE ARGUMENTS...: doctor must print this line (a pattern of grep).
diagnose() {
  local sentence=$1 code
  shift
  "$overtake" doctor "$@" >stdout 2>stderr
  code=$?
  ((code == 3)) && grep -q -- "$sentence" stdout && [[ ! -s stderr ]] ||
    fail "doctor $*: exit code $code, not '$sentence' but $(cat stdout stderr)"
}
diagnose "^WRONG  recording: its files are of sensors front, left, right; rig hdl64 has 1 sensor: top$" scene --rig hdl64
grep -q -- '--rig av21' stdout || fail "doctor does not name the rig that fits: $(cat stdout)"
diagnose "^WRONG  recording: its files are of sensors front, left, right; rig av2 expects one cloud a frame" scene --rig av2
mkdir unnamed
cp scene/000000_front.pcd unnamed/000000.pcd
diagnose "^WRONG  recording: its files name no sensor (FRAME.pcd); rig av21 has 3 sensors: front, left, right (FRAME_SENSOR.pcd)$" unnamed --rig av21
diagnose "^WRONG  sensor 'top': its clouds have 32 lines only, the rig's image 64 rows" unnamed --rig hdl64
grep -q "^note   sensor 'top': its points cover 1[23][05] deg; the rig says that it sees a full turn$" stdout || fail "no full turn: $(cat stdout)"
expect "a rig to change" "$overtake" run one --rig av21 --out rig_of && sed -n '/^\[rig\]/,$p' rig_of/config.toml |
  sed 's/^\[rig\]$//; s/^\[\[rig\./[[/; s/^yaw_deg = 120/yaw_deg = +120/; s/^yaw_deg = -120/yaw_deg = 120/; s/^yaw_deg = +120/yaw_deg = -120/' >swapped.toml
for pair in "left|right" "right|left"; do
  diagnose "^WRONG  sensor '${pair%|*}': it seems to be turned as the rig says of sensor '${pair#*|}': of the upright" scene --rig swapped.toml
done
grep -q 'roll_deg and pitch_deg' stdout && fail "the yaws are exchanged, and doctor says roll and pitch: $(cat stdout)"
grep -q "^note   rig: nothing is wrong with its first scans for rig av21" stdout || fail "doctor does not name the right rig: $(cat stdout)"

# ---- capacities: from the command line and the rig, written to config.toml, and reported when they are reached
expect "capacities" "${run[@]}" --capacity clusters=20 --capacity candidates=4 --capacity tracks=7 --out full
grep -q '^note: capacity clusters (20) was reached in 8 of 8 frames: nearest first were kept; raise it with --capacity clusters=40$' stdout ||
  fail "full clusters are not said: $(grep note stdout)"
grep -q 'capacity [ct]ra' stdout && fail "a capacity that nothing filled is called full: $(grep note stdout)"
expect "capacities by workers" "${run[@]}" --capacity clusters=20 --capacity candidates=4 --capacity tracks=7 --workers 2 --out full_workers
cmp full/detections.csv full_workers/detections.csv || fail "capacities: another result with workers"
expect "candidates that do not fit" "${run[@]}" --capacity candidates=1 --out full_candidates
crowded=$(awk -F, 'NR > 1 { ++n[$1] } END { for (f in n) more += n[f] > 1; print more }' run/detections.csv)
grep -q "^note: capacity candidates (1) was reached in $crowded of 8 frames: nearest first were kept; raise it with --capacity candidates=2\$" stdout ||
  fail "candidates are more than one in $crowded frames: $(grep note stdout)"
expect "tracks that do not fit" "${run[@]}" --capacity tracks=2 --out full_tracks
grep -q '^note: capacity tracks (2) was reached in [1-8] of 8 frames: confirmed first, then nearest first were kept; ' stdout ||
  fail "full tracks are not said: $(grep note stdout)"
[[ $(awk -F, 'NR > 1 { ++n[$1] } END { for (s in n) if (n[s] > most) most = n[s]; print most }' full_tracks/tracks.csv) == 2 ]] ||
  fail "tracks=2 gives another number of tracks"
for capacity in 'clusters = 20' 'candidates = 4' 'tracks = 7' 'ego_poses = 1024'; do
  grep -qx "$capacity" full/config.toml || fail "config.toml lacks $capacity"
done
expect "capacities by config" "$overtake" run scene --config full/config.toml --out full_again
diff -rq -x timing.csv -x .overtake full full_again || fail "config.toml does not repeat --capacity"
{ cat full/config.toml | sed -n '/^\[rig\]/,$p' | sed 's/^\[rig\]//; s/\[rig\./[/; s/\[\[rig\./[[/'; printf '[capacities]\nclusters = 20\ncandidates = 4\ntracks = 7\n'; } >full.toml
expect "capacities by rig" "$overtake" run scene --rig full.toml "${run[@]:5}" --out full_rig
cmp full/detections.csv full_rig/detections.csv || fail "capacities of the rig are not used"
cmp full/tracks.csv full_rig/tracks.csv || fail "capacities of the rig are not used for the tracks"
expect "a capacity given wins" "$overtake" run scene --rig full.toml "${run[@]:5}" --capacity clusters=1024 --capacity candidates=256 --capacity tracks=256 --out full_won
cmp run/detections.csv full_won/detections.csv || fail "--capacity does not win over the rig's"
expect "points" "$overtake" run small --rig small.toml --capacity points=40000 --out points
grep -qx 'point_capacity = 40000' points/config.toml || fail "config.toml lacks --capacity points"
expect "capacities of track" "$overtake" track detections.csv --capacity tracks=5 --out track_full
grep -qx 'tracks = 5' track_full/config.toml || fail "track does not take --capacity"
sed 's/^clusters = 20/clusters = 0/' full.toml >zero.toml
sed 's/^clusters = 20/lasers = 20/' full.toml >lasers.toml
refuse "zero.toml:*: capacities: 'clusters' is 0, its limits are 1 to 1000000" run scene --rig zero.toml --out out
refuse "lasers.toml:*: capacities: unknown key 'lasers'" run scene --rig lasers.toml --out out
refuse "--capacity tracks=5000: a whole number from 1 to 4096 is needed" run scene --capacity tracks=5000 "${av21[@]}"
refuse "--capacity tracks: a whole number from 1 to 4096 is needed" run scene --capacity tracks "${av21[@]}"
refuse "--capacity lanes=3: there is no capacity 'lanes' (there are: points, clusters, candidates, tracks, ego_poses)" run scene --capacity lanes=3 "${av21[@]}"
refuse "--capacity points=5: needs a rig: points are of its sensors" track detections.csv --capacity points=5 --out out

# ---- files that need more memory than the limit, inputs that are not files, and escape sequences
le() {  # VALUE BYTES
  local i
  for ((i = 0; i < $2; ++i)); do printf "\\x$(printf %02x $(($1 >> (8 * i) & 255)))"; done
}
text() { le ${#1} 4; printf %s "$1"; }
record() {  # OPCODE CONTENT_FILE
  le "$1" 1
  le "$(stat -c %s "$2")" 8
  cat "$2"
}
mcap_head() {
  { text "ros2$1"; text ''; } >content
  printf '\x89MCAP0\r\n'
  record 1 content
}
printf '\x02\x00\x10\x00' >zeros   # a block of Zstandard: 128 KiB of zeros
for ((i = 0; i < 14; ++i)); do cat zeros zeros >more; mv more zeros; done
{ printf '\x28\xb5\x2f\xfd\x00\x38'; cat zeros zeros zeros; printf '\x03\x00\x10\x00'; } >packed   # 6 GiB
{ le 0 16; le $((100 << 30)) 8; le 0 4; text zstd; le "$(stat -c %s packed)" 8; cat packed; } >chunk
{ mcap_head ''; record 6 chunk; } >bomb.mcap
bomb='a chunk cannot be unpacked: it declares 100.0 GiB, its 192.0 KiB cannot hold more than 6.0 GiB'
(ulimit -v 1000000; timeout 20 "$overtake" info bomb.mcap >stdout 2>stderr)
code=$?
((code == 3)) && grep -q "^overtake: bomb.mcap: damaged at byte 29: $bomb; " stderr || fail "info of a bomb: $code, $(cat stderr)"
refuse "bomb.mcap: damaged at byte 29: $bomb" run bomb.mcap "${av21[@]}"
"$overtake" doctor bomb.mcap --rig av21 >stdout 2>stderr
code=$?
((code == 3)) && grep -qF "$bomb" stdout || fail "doctor of a bomb: $code, $(cat stdout stderr)"
mkfifo pipe
for input in /dev/zero pipe; do
  kind=device
  [[ $input == pipe ]] && kind=pipe
  refuse "$input: is a $kind, a regular file is needed" run scene --rig $input --out out
  for option in --ego --map --config; do
    refuse "$input: is a $kind, a regular file is needed" run scene --rig av21 "$option" $input --out out
  done
  refuse "$input: is a $kind, a regular file is needed" run $input "${av21[@]}"
  refuse "$input: is a $kind, a regular file is needed" track $input --out out
  refuse "$input: is a $kind, a regular file is needed" simulate $input --out out.mcap
done
truncate -s 40M big.csv
refuse "big.csv: is 40.0 MiB long, at most 2.0 MiB are read; the memory limit is 64.0 MiB (--max-memory)" run scene "${av21[@]}" --ego big.csv --max-memory 64M
refuse "big.csv: is 40.0 MiB long, at most 2.0 MiB are read; *" --max-memory 64M track big.csv --out out
refuse "scene/000000_front.pcd: *the memory limit is 1.0 MiB (--max-memory)" run scene "${av21[@]}" --max-memory 1M
"$overtake" run scene "${av21[@]}" --max-memory much >stdout 2>stderr
code=$?
((code == 2)) && grep -q "'much' is not a size" stderr || fail "--max-memory much: exit code $code, $(cat stderr)"
misuse "*'much' is not a size of 1M or more (4G, 512M)*" --max-memory much run scene "${av21[@]}"
misuse "run: --out is required (overtake run --help)" --max-memory 4G run scene --rig av21
misuse "unknown command 'rnu'; did you mean 'run'[?] (overtake --help)" --max-memory 4G rnu scene
misuse "unknown command 'rnu'; did you mean 'run'[?] (overtake --help)" --max-memory=4G rnu scene

clear=$'\e[2J'
{ le 1 2; le 0 2; text "/front$clear"; text cdr; le 0 4; } >channel
{ le 1 2; le 0 4; le 5 8; le 5 8; printf x; } >message
{ le 0 16; text "$clear.txt"; text "text/plain"; le 0 8; le 0 4; } >attachment
{ mcap_head "$clear"; record 4 channel; record 5 message; record 9 attachment; record 2 chunk; } >escape.mcap
for command in info doctor run; do
  given=(--rig av21)
  case $command in info) given=() ;; run) given+=(--out out) ;; esac
  "$overtake" $command escape.mcap "${given[@]}" >stdout 2>stderr
  grep -q $'\e' stdout stderr && fail "$command lets an escape sequence of the file through: $(cat -v stdout stderr)"
  cat stdout stderr >both
done
"$overtake" info escape.mcap >stdout 2>stderr
for shown in 'of profile ros2\x1b[2J' '/front\x1b[2J' 'attachment \x1b[2J.txt'; do
  grep -qF "$shown" stdout || fail "info does not show $shown: $(cat -v stdout)"
done
mkdir "$clear"
cp scene/000000_front.pcd "$clear/1_no.pcd"
"$overtake" run "$clear" "${av21[@]}" >stdout 2>stderr
grep -q $'\e' stdout stderr && fail "an error lets an escape sequence of a file's name through"
grep -qF '\x1b[2J/1_no.pcd: rig av21 has no sensor' stderr || fail "an error does not show the file's name: $(cat -v stderr)"

# ---- run uses a simulated log's rig, map and ego poses; options have priority
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

# ---- banking of the opposite sign is turned round, and said
awk -F, 'BEGIN { OFS = "," } NR > 1 { $5 = "-" $5 } 1' race/map.csv >minus.csv
turned="minus.csv: its banking has the opposite sign (positive: the right side is higher): it is turned round"
[[ $(run_hash race.mcap --map minus.csv) == "$own" ]] || fail "banking of the opposite sign gives other results"
grep -qxF "note: $turned" stdout || fail "run turns banking round and does not say so: $(cat stdout)"
"$overtake" doctor race.mcap --map minus.csv >stdout || fail "doctor of banking of the opposite sign: $(cat stdout)"
grep -qxF "note   map: $turned" stdout || fail "doctor does not say that banking is turned round: $(cat stdout)"
awk -F, 'BEGIN { OFS = "," } NR > 1 { $5 = $5 * 57.3 } 1' race/map.csv >degrees.csv
refuse "degrees.csv:2:*: banking_rad is beyond 1 rad (degrees[?])" run race.mcap --map degrees.csv --out out

# ---- columns of an unknown name: named, never half of an attitude
sed '1s/speed_mps/speed_kmh/' race/ego.csv >other_ego.csv
sed '1s/banking_rad/banking_deg/' race/map.csv >other_map.csv
expect "run with other columns" "$overtake" run race.mcap --map other_map.csv --ego other_ego.csv --out other --force
cp stdout run_notes
"$overtake" doctor race.mcap --map other_map.csv --ego other_ego.csv >doctor_notes
for unread in "map: other_map.csv has a column that is not read: banking_deg" \
  "ego: other_ego.csv has a column that is not read: speed_kmh"; do
  grep -qxF "note: ${unread#*: }" run_notes || fail "run does not say: $unread, but $(cat run_notes)"
  grep -qxF "note   $unread" doctor_notes || fail "doctor does not say: $unread, but $(cat doctor_notes)"
done
sed '1s/roll_rad/roll_deg/' race/ego.csv >half.csv
refuse "half.csv: has pitch_rad and no roll_rad*" run race.mcap --ego half.csv --out out

# ---- a map against the driving direction
{ head -n 1 race/map.csv; tail -n +2 race/map.csv | tac; } >against.csv
against='the ego vehicle drives against this map in \([0-9]*\) of \1 poses: turn its lines round'
"$overtake" run race.mcap --map against.csv --out against >stdout 2>stderr
code=$?
((code == 3)) && grep -q "^overtake: against.csv: $against$" stderr || fail "run on a map turned round: exit code $code, $(cat stderr)"
"$overtake" doctor race.mcap --map against.csv >stdout
code=$?
((code == 3)) && grep -q '^WRONG  map: the ego vehicle drives against against.csv in \([0-9]*\) of \1 poses$' stdout ||
  fail "doctor on a map turned round: exit code $code, $(cat stdout)"

# ---- poses that the library refuses for their values
awk -F, 'BEGIN { OFS = "," } NR > 1 { $2 = 1e12 } 1' race/ego.csv >far_ego.csv
refuse "--ego far_ego.csv: has no effect: [0-9]* ego poses with a value that is not finite or out of bounds: not used; *" \
  run race.mcap --ego far_ego.csv --out out

# ---- an unreadable file loses its scan: doctor and info name it, and judge the others
mkdir torn
ln race/*.pcd race/rig.toml race/map.csv race/ego.csv torn
for frame in 3 5; do rm torn/00000${frame}_front.pcd && : >torn/00000${frame}_front.pcd; done
"$overtake" doctor torn >stdout
code=$?
((code == 3)) || fail "doctor of a torn folder: exit code $code"
[[ $(grep -c '^WRONG' stdout) == 1 ]] &&
  grep -q "^WRONG  sensor 'front': 2 of 10 scans cannot be read; the first: torn/000003_front.pcd.*; then: torn/000005_front.pcd" stdout ||
  fail "doctor of a torn folder: $(cat stdout)"
for file in torn/*_left.pcd; do rm "$file" && : >"$file"; done
"$overtake" doctor torn >stdout
grep -q 'there is no scan of it' stdout && fail "doctor misses the scans beside unreadable ones: $(cat stdout)"
grep -q "^WRONG  sensor 'left': 10 of 10 scans cannot be read" stdout || fail "doctor of a folder without a good left scan: $(cat stdout)"
"$overtake" info torn >stdout 2>stderr
code=$?
((code == 3)) && grep -q '^overtake: torn: 12 files cannot be read; the first: torn/000003_front.pcd.*; the output describes the others$' stderr &&
  grep -q 'FRAME_front.pcd  *10  *000000_front.pcd' stdout && grep -q 'FRAME_left.pcd  *10' stdout ||
  fail "info of a torn folder: exit code $code, $(cat stdout stderr)"

# ---- a map that the ego vehicle never enters: reported, with exit code 3; doctor finds it
printf 'x_m,y_m,w_tr_right_m,w_tr_left_m\n5000,5000,8,8\n5100,5000,8,8\n5200,5000,8,8\n' >elsewhere.csv
off='the ego vehicle is outside of this map in [0-9]* of [0-9]* frames, by up to [0-9]*[.][0-9] m'
"$overtake" run race.mcap --map elsewhere.csv --out elsewhere >stdout 2>stderr
code=$?
((code == 3)) && grep -q "^overtake: elsewhere.csv: $off" stderr || fail "run on a wrong map: exit code $code, $(cat stderr)"
"$overtake" run race.mcap --out own >stdout 2>stderr && ! grep -q "$off" stdout stderr || fail "the log's own map is said to be wrong"
"$overtake" doctor race.mcap --map elsewhere.csv >stdout
code=$?
((code == 3)) && grep -q '^WRONG  map: the ego vehicle is outside of elsewhere.csv in [0-9]* of [0-9]* poses' stdout ||
  fail "doctor on a wrong map: exit code $code, $(cat stdout)"
"$overtake" doctor race --rig race/rig.toml --map race/map.csv --ego race/ego.csv >stdout || fail "doctor on the right map: $(cat stdout)"
awk -F, 'BEGIN { OFS = "," } NR > 1 && NR < 8 { $2 += 3000 } 1' race/ego.csv >jump.csv  # a pose that jumps for a moment
"$overtake" run race.mcap --ego jump.csv --out jump >stdout 2>stderr || fail "a pose that jumps: $(cat stderr)"
grep -q "^note: $off" stdout || fail "a pose that jumps is not said: $(cat stdout)"
"$overtake" doctor race.mcap --ego jump.csv >stdout || fail "doctor on a pose that jumps: $(cat stdout)"
grep -q '^note   map: the ego vehicle is outside of race.mcap in 6 of [0-9]* poses' stdout || fail "doctor on a pose that jumps: $(cat stdout)"

"$overtake" doctor race --ego jump.csv >stdout || fail "doctor of a folder with its own map: $(cat stdout)"
grep -q '^note   map: the ego vehicle is outside of race/map.csv in 6 of [0-9]* poses' stdout || fail "doctor ignores the folder's map: $(cat stdout)"
"$overtake" doctor race --ego jump.csv --map none | grep -q '  map: ' && fail "doctor --map none uses a map"

# ---- a gap of more than a second between scans; a point without coordinates; a full disk
printf 'stamp_ns,x_m,y_m\n' >gap.csv
for ms in 1000 1050 1100 2300 2350 2400; do echo "${ms}000000,10,5" >>gap.csv; done
expect "track over a gap" "$overtake" track gap.csv --out gap
grep -q '^2400000000,[0-9]*,[a-z]*,5,' gap/tracks.csv || fail "track over a gap: $(cat gap/tracks.csv)"
grep -q '^note: 2 scans after a gap of more than a second' stdout || fail "track over a gap: $(cat stdout)"
mkdir nan
{
  printf '%s\n' 'VERSION 0.7' 'FIELDS x y z ring' 'SIZE 4 4 4 4' 'TYPE F F F U' 'COUNT 1 1 1 1' 'WIDTH 3' 'HEIGHT 1' \
    'POINTS 3' 'DATA ascii' '10 0 -0.5 9' 'nan nan nan 0' 'inf 0 0 1'
} >nan/000000_front.pcd
mkdir none no_bytes
for i in 0 1 2; do sed 's/^WIDTH.*/WIDTH 0/; s/^POINTS.*/POINTS 0/; /^DATA/q' nan/000000_front.pcd >none/00000${i}_front.pcd; done
refuse "none: holds no usable point in 3 scans" run none --rig av21 --out out
: >no_bytes/000000.bin
refuse "no_bytes/000000.bin: is empty (0 bytes)" run no_bytes --rig hdl64 --out out
expect "inspect of points that are not finite" "$overtake" inspect nan --rig av21 --sensor front --out nan_out
"$overtake" info scene >/dev/full 2>stderr
code=$?
((code == 1)) && grep -q '^overtake: the output could not be written$' stderr || fail "info to a full disk: exit code $code, $(cat stderr)"
printf '%s\n' 'name = "odd"' 'track = "oval"' '[sensors]' 'range_min_m = 50' 'range_max_m = 10' '[[car]]' 'name = "ego"' >odd.toml
refuse "odd.toml:4:*range_min_m must be below range_max_m" simulate odd.toml --out odd.mcap
sed -i 's/^range_min_m.*/rate_hz = 1/; s/^range_max_m.*/lines_per_s = 5120/' odd.toml
refuse "odd.toml:5:*more than 1024 lines a scan*" simulate odd.toml --out odd.mcap

# ---- pictures of a race
sed 's/^to_s = 3.5/to_s = 1/' "$scenarios/smoke.toml" >smoke.toml
refuse "smoke.toml:23: *to_s must be above from_s" simulate smoke.toml --out smoke.mcap
refuse "--picture-at 99.00: is after the race, which lasts 6.00 s" simulate demo --pictures pictures --picture-at 99
expect "pictures" "$overtake" simulate demo --pictures pictures --picture-at 1.5
for picture in above front left right; do
  [[ $(head -c 4 pictures/$picture.png | tail -c 3) == PNG ]] || fail "no picture $picture.png"
done
"$overtake" simulate demo >stdout 2>stderr
code=$?
((code == 2)) && grep -q -- '--out or --pictures' stderr || fail "simulate without an output: exit code $code, $(cat stderr)"

# ---- Ctrl-C keeps the results so far
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
grep -q '^overtake: interrupted after [0-9]* frames; the results so far are kept in files that end in .part$' stderr || fail "after Ctrl-C: $(cat stderr)"
done_frames=$(sed 's/[^0-9]//g' stderr)
[[ $(tail -n 1 long_run/timing.csv.part) == "$((done_frames - 1))",* ]] || fail "timing.csv.part does not end with the last frame"
((done_frames < 2000)) || fail "Ctrl-C came too late to show anything"
for table in long_run/*.csv.part; do
  [[ -z $(tail -c 1 "$table") ]] || fail "$table ends in the middle of a row"
done
[[ -s long_run/config.toml.part ]] || fail "no config.toml after Ctrl-C"

passed "all command line checks passed"
