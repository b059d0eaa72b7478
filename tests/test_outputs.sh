#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_outputs.sh OVERTAKE. What the command line does to files: no output replaces an input or a foreign
# file; unfinished results have names that end in .part and are reported as partial; config.toml means the same in every
# folder; options without effect are errors. Makes its own recordings. Exit code 0 is a pass.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
readonly overtake=$(realpath "${1:?usage: test_outputs.sh OVERTAKE WRITE_SCENE}") write_scene=$(realpath "${2:?}")
cd "$work" || exit 1

expect() {  # NAME COMMAND...: must succeed
  local name=$1
  shift
  "$@" >stdout 2>stderr || { fail "$name: exit code $?: $(head -c 400 stderr)"; return 1; }
}
# end CODE PATTERN ARGUMENTS...: overtake must exit with that code and print one line on stderr that fits the glob
# pattern.
end() {
  local want=$1 pattern=$2 code line found=
  shift 2
  "$overtake" "$@" >stdout 2>stderr
  code=$?
  ((code == want)) || fail "$*: exit code $code, not $want: $(head -c 400 stderr)"
  while IFS= read -r line; do
    # shellcheck disable=SC2053
    [[ $line == $pattern ]] && found=1
  done <stderr
  [[ $found ]] || fail "$*: said '$(head -c 400 stderr)', not '$pattern'"
}
refuse() {  # PATTERN ARGUMENTS...: an error, in one line
  local pattern=$1
  shift
  end 1 "overtake: $pattern" "$@"
  [[ $(wc -l <stderr) == 1 ]] || fail "$*: not one line: $(head -c 400 stderr)"
}
same() { cmp -s "$1" "$2" || fail "$1 was changed ($3)"; }  # FILE COPY WHEN
hash_of() { sed -n 's/^Hash of all detections and tracks: //p' stdout; }
no_parts() { [[ -z $(find "$1" -name '*.part') ]] || fail "$1 holds $(find "$1" -name '*.part' | head -3)"; }

expect "a log" "$overtake" simulate demo --seed 3 --seconds 0.3 --out race.mcap --quiet
expect "a folder" "$overtake" simulate demo --seed 3 --seconds 0.3 --out race --quiet
expect "scene" "$write_scene" scene 6
for folder in . race scene; do no_parts $folder; done

# ---- an input is never replaced, under any name
cp race.mcap copy.mcap
ln race.mcap hard.mcap
ln -s race.mcap soft.mcap
for name in race hard soft; do
  for force in "" --force; do
    # shellcheck disable=SC2086
    refuse "$name.mcap: is read by this command*: an output never replaces it" run race.mcap --out ov --mcap $name.mcap $force
    same race.mcap copy.mcap "--mcap $name.mcap $force"
    [[ ! -e ov ]] || fail "a refused run leaves $(ls -A ov)"
  done
done
[[ -L soft.mcap ]] || fail "the link was removed"
refuse "hard.mcap: is read by this command as race.mcap: *" run race.mcap --out ov --trace hard.mcap
cp scene/ego.csv ego_copy.csv
mkdir here
ln scene/ego.csv here/tracks.csv
refuse "here/tracks.csv: is read by this command *" run scene --rig av21 --ego scene/ego.csv --out here --force
same scene/ego.csv ego_copy.csv "run --out with a hard link to --ego"
expect "a config to use" "$overtake" run scene --rig av21 --out first --quiet
cp first/config.toml config_copy.toml
refuse "first/config.toml: is read by this command*" run scene --config first/config.toml --out first
same first/config.toml config_copy.toml "run --config into its own folder"
cp race/map.csv map_copy.csv
mkdir tracked && ln race/map.csv tracked/tracks.csv
printf 'stamp_ns,x_m,y_m\n0,1,2\n50000000,2,2\n' >seen.csv
refuse "tracked/tracks.csv: is read by this command *" track seen.csv --map race/map.csv --out tracked
same race/map.csv map_copy.csv "track"
mkdir labelled && ln scene/000000_front.pcd labelled/labels.csv
refuse "labelled/labels.csv: is read by this command *" label scene --rig av21 --frame 0 --out labelled --force
mkdir looked && ln scene/000003_front.pcd looked/scan.png
refuse "looked/scan.png: is read by this command *" inspect scene --rig av21 --frame 3 --sensor front --out looked
mkdir judged && ln race.mcap judged/metrics.json
refuse "judged/metrics.json: is read by this command *" evaluate race.mcap --preset paper --frames 1 --out judged
same race.mcap copy.mcap "evaluate"

# ---- only results of Overtake are replaced, unless --force is given
expect "the same log again" "$overtake" simulate demo --seed 3 --seconds 0.1 --out copy.mcap --quiet
expect "the same folder again" "$overtake" run scene --rig av21 --out first --quiet
echo "# a note of mine" >>first/config.toml
cp first/config.toml config_copy.toml
refuse "first/config.toml: exists and is not a result of Overtake, or was changed since: *--force*" run scene --rig av21 --out first
same first/config.toml config_copy.toml "a second run"
no_parts first
expect "with --force" "$overtake" run scene --rig av21 --out first --quiet --force
grep -q "a note of mine" first/config.toml && fail "--force did not replace config.toml"
expect "again, ours now" "$overtake" run scene --rig av21 --out first --quiet
expect "a view of it" "$overtake" run scene --rig av21 --out first --mcap first/view.mcap --quiet
printf x >>first/view.mcap
cp first/view.mcap view_copy.mcap
refuse "first/view.mcap: exists and is not a result of Overtake, or was changed since: *--force*" run scene --rig av21 --out first --mcap first/view.mcap
same first/view.mcap view_copy.mcap "a changed view"
rm first/view.mcap
mkdir mine
for name in tracks.csv labels.csv truth.csv scan.png metrics.json rig.toml above.png; do echo "mine" >mine/$name; done
for words in "tracks.csv run scene --rig av21" "tracks.csv track seen.csv" "labels.csv label scene --rig av21 --frame 0" \
  "scan.png inspect scene --rig av21 --frame 0 --sensor front" \
  "metrics.json evaluate race.mcap --preset paper --frames 1"; do
  name=${words%% *}
  # shellcheck disable=SC2086
  refuse "mine/$name: exists and is not a result of Overtake, *" ${words#* } --out mine
done
refuse "mine/truth.csv: exists and is not a *" simulate demo --seconds 0.1 --out mine
refuse "mine/above.png: exists and is not a *" simulate demo --seconds 0.1 --pictures mine
[[ $(cat mine/* | sort -u) == mine && $(ls -A mine | wc -l) == 7 ]] || fail "a folder of files of mine holds $(ls -A mine)"
mkdir other && echo "mine" >other/detections.csv
refuse "other/detections.csv: exists and is not a *" run scene --rig av21 --out other
[[ $(cat other/*) == mine && $(ls -A other | wc -l) == 1 ]] || fail "a folder with detections of mine holds $(ls -A other)"
cp ego_copy.csv ego_copy.mcap
for words in "simulate demo --seconds 0.1 --out" "run scene --rig av21 --out ov --mcap" "run scene --rig av21 --out ov --trace"; do
  # shellcheck disable=SC2086
  refuse "ego_copy.mcap: exists and is not a *" $words ego_copy.mcap
done
same ego_copy.csv ego_copy.mcap "as a log"
expect "a trace" "$overtake" run scene --rig av21 --out first --trace trace.json --quiet
expect "the trace again" "$overtake" run scene --rig av21 --out first --trace trace.json --quiet
refuse "first/config.toml: is the name of two outputs of this command" run scene --rig av21 --out first --mcap first/config.toml
[[ $(head -c 1 first/config.toml) == "#" ]] || fail "config.toml is another file now"

# ---- names that are no file or folder
mkfifo pipe.mcap
for words in "info pipe.mcap" "doctor pipe.mcap --rig av21" "evaluate pipe.mcap --preset paper --out ov"; do
  # shellcheck disable=SC2086
  timeout 20 "$overtake" $words >stdout 2>stderr
  (($? == 1)) && grep -q 'pipe.mcap: is a pipe' stderr || fail "$words: $(head -c 300 stderr)"
done
cp -r race race_cut && rm race_cut/map.csv && ln -s nowhere race_cut/map.csv
refuse "race_cut/map.csv: no such file" run race_cut --out ov
refuse "scene: holds no scan of that frame, 77; it holds frames 0 to 5" label scene --rig av21 --frame 77 --out ov

# ---- a folder of results belongs to one command until that ends
expect "the first command" "$overtake" run scene --rig av21 --out held --quiet
cp held/tracks.csv held_tracks.csv
for words in "run scene --rig av21" "label scene --rig av21 --frame 0" "simulate demo --seconds 0.1"; do
  # shellcheck disable=SC2086
  flock held "$overtake" $words --out held >stdout 2>stderr && fail "$words: writes into a folder in use"
  [[ $(cat stderr) == "overtake: held: another command writes its results there: wait until it ends, or choose another folder" ]] ||
    fail "$words into a folder in use: $(head -c 300 stderr)"
done
same held/tracks.csv held_tracks.csv "by a command that was refused"

# ---- so does a file
printf '' >busy.mcap.part
for words in "run scene --rig av21 --out beside --mcap" "simulate demo --seconds 0.1 --out"; do
  # shellcheck disable=SC2086
  flock busy.mcap.part "$overtake" $words busy.mcap >stdout 2>stderr && fail "$words: writes a file in use"
  [[ $(cat stderr) == "overtake: busy.mcap: another command writes it: wait until it ends, or choose another name" ]] ||
    fail "$words into a file in use: $(head -c 300 stderr)"
  [[ -f busy.mcap.part && ! -e busy.mcap ]] || fail "$words: a file in use is gone"
done
rm busy.mcap.part
"$overtake" simulate demo --seconds 2 --out busy.mcap --quiet >first_out 2>first_err &
first=$!
for ((i = 0; i < 100; ++i)); do [[ -e busy.mcap.part ]] && break || sleep 0.05; done
"$overtake" simulate demo --seconds 0.1 --seed 2 --out busy.mcap --quiet >stdout 2>stderr && fail "a second writer"
wait "$first" || fail "the first writer: $(head -c 300 first_err)"
"$overtake" info busy.mcap >stdout 2>stderr || fail "the log of the first writer: $(head -c 300 stderr)"
head -c 100 busy.mcap >cut.mcap
refuse "--rig is needed (the recording holds none: damaged at byte *)*" run cut.mcap --out ov
rm busy.mcap cut.mcap
expect "the next command" "$overtake" run scene --rig av21 --out held --quiet

# ---- symbolic links, folders, devices
cp mine/tracks.csv victim
mkdir linked && ln -s ../victim linked/tracks.csv
refuse "linked/tracks.csv: is a symbolic link, outputs do not follow links: *" run scene --rig av21 --out linked
expect "--force replaces the link" "$overtake" run scene --rig av21 --out linked --quiet --force
[[ ! -L linked/tracks.csv && $(cat victim) == mine ]] || fail "--force wrote through the link"
mkdir -p folder.mcap
for words in "folder.mcap: is not a regular file*" "/dev/null: is not a regular file*"; do
  refuse "$words" run scene --rig av21 --out ov --mcap "${words%%:*}" --force
done
[[ -c /dev/null ]] || fail "/dev/null is gone"
# ---- evaluate and merge replace only their own runs
expect "evaluate" "$overtake" evaluate race.mcap --preset paper --frames 1 --quiet --out judged_1
expect "evaluate, another number of frames" "$overtake" evaluate race.mcap --preset paper --frames 2 --quiet --out judged_1
echo "mine" >judged_1/runs/paper/race/notes.txt
refuse "*judged_1/runs/paper/race/notes.txt: exists and is not a *" evaluate race.mcap --preset paper --frames 1 --quiet --out judged_1
[[ $(cat judged_1/runs/paper/race/notes.txt) == mine ]] || fail "evaluate deleted notes.txt"
cp judged_1/runs/paper/race/about.json about_before
expect "evaluate with --force" "$overtake" evaluate race.mcap --preset paper --frames 1 --quiet --force --out judged_1
[[ $(cat judged_1/runs/paper/race/notes.txt) == mine ]] || fail "evaluate --force deleted notes.txt"
! cmp -s about_before judged_1/runs/paper/race/about.json || fail "evaluate --force kept the run before"
expect "merge" "$overtake" merge judged_1 --out merged
expect "merge again" "$overtake" merge judged_1 --out merged
echo >>merged/report.html
refuse "merged/report.html: exists and is not a *" merge judged_1 --out merged
# ---- a result that ends early is partial, and is reported as partial
# stop SIGNAL FILE ARGUMENTS...: sends it as soon as FILE has grown.
stop() {
  local signal=$1 file=$2 pid
  shift 2
  "$overtake" "$@" >stdout 2>stderr &
  pid=$!
  for ((i = 0; i < 600; ++i)); do
    # shellcheck disable=SC2086
    [[ -s $(compgen -G "$file" | tail -n 1) ]] && break
    sleep 0.1
  done
  kill -"$signal" $pid
  wait $pid
  code=$?
  ((code == 130)) || fail "$*: after $signal the exit code is $code: $(head -c 300 stderr)"
  grep -q '^overtake: interrupted' stderr || fail "$*: after $signal no word: $(head -c 300 stderr)"
}
stop INT early.mcap.part simulate demo --seconds 8 --out early.mcap --quiet
[[ ! -e early.mcap && -s early.mcap.part ]] || fail "an interrupted log has its name: $(ls early*)"
"$overtake" info early.mcap.part >stdout 2>stderr || fail "info of a partial log: $(cat stderr)"
grep -q '^this log is partial: interrupted after [0-9]* of [0-9]* frames$' stdout || fail "info of a partial log: $(head -2 stdout)"
mv early.mcap.part renamed.mcap
grep -q '^this log is partial: interrupted' <("$overtake" info renamed.mcap) || fail "a partial log under another name is not known"
grep -q '^WRONG  recording: this log is partial: interrupted' <("$overtake" doctor renamed.mcap) || fail "doctor does not know it"
awk '$1 ~ /odometry$/ && $2 > 400 { exit 1 }' <("$overtake" info renamed.mcap) ||
  fail "the odometry goes on behind the last cloud: $("$overtake" info renamed.mcap)"
expect "evaluate of a partial log" "$overtake" evaluate renamed.mcap --preset paper --frames 4 --quiet --out judged_part
grep -q '^overtake: renamed.mcap: this log is partial: interrupted after' stderr || fail "evaluate of a partial log: $(cat stderr)"
stop TERM 'early/*_front.pcd.part' simulate demo --seconds 8 --out early --quiet
[[ -z $(compgen -G 'early/*.pcd') ]] || fail "an interrupted folder looks whole: $(ls early | head)"
refuse "early: holds no recording: *; the program that wrote it was interrupted or failed: *" run early --rig av21 --out ov
grep -q '^this log is partial: the program that wrote it was interrupted or failed: [0-9]* names end in .part' <("$overtake" info early 2>&1) ||
  fail "info of a partial folder: $("$overtake" info early 2>&1)"
refuse "*the program that wrote it was interrupted or failed: *" doctor early
refuse "*the program that wrote it was interrupted or failed: *" doctor early --rig av21
# The next simulate replaces it, and leaves no file of the longer race; a file that was changed stays.
cp early/000000_front.pcd.part early/000099_front.pcd.part
expect "over an interrupted race" "$overtake" simulate demo --seconds 0.4 --out early --quiet
no_parts early
[[ $(ls early/*.pcd | wc -l) == 24 ]] || fail "after 8 frames of three sensors there are $(ls early/*.pcd | wc -l) scans"
expect "info of a whole folder" "$overtake" info early && ! grep -q partial stdout || fail "a whole race is said to be partial: $(cat stdout)"
expect "doctor of a whole folder" "$overtake" doctor early
echo mine >early/notes.txt
echo mine >>early/000007_left.pcd
expect "over a longer race" "$overtake" simulate demo --seconds 0.2 --out early --quiet
[[ $(ls early/*.pcd | tail -n 2) == $'early/000003_right.pcd\nearly/000007_left.pcd' && -e early/notes.txt ]] ||
  fail "a shorter race over a longer one leaves $(ls early | tail -n 5)"
# A race without map or poses does not get those of the one before.
expect "a race without map" "$overtake" simulate no_map --seconds 0.1 --out early --quiet
[[ ! -e early/map.csv && -e early/ego.csv ]] || fail "the map of another race is left: $(ls early)"
expect "a race without poses" "$overtake" simulate no_poses --seconds 0.1 --out early --quiet
[[ -e early/map.csv && ! -e early/ego.csv ]] || fail "the poses of another race are left: $(ls early)"
# run, inspect and label leave no picture and no array of an earlier command; of other commands' files, none is theirs.
left() {  # WHAT NAMES...: the folder reused must hold neither .part nor these names
  local what=$1 name
  shift
  for name; do [[ ! -e reused/$name ]] || fail "$what leaves $name of an earlier command"; done
}
for frame in 2 4; do
  expect "a picture of frame $frame" "$overtake" run scene --rig av21 --out reused --picture-at $frame --quiet
  expect "labels of frame $frame" "$overtake" label scene --rig av21 --frame $frame --out reused --quiet
done
left "run --picture-at 4" frame_2.png && left "label" 2_front_labels.npy
for preset in paper best; do
  expect "inspect of $preset" "$overtake" inspect scene --rig av21 --frame 3 --sensor front --preset $preset --out reused --quiet
done
left "inspect of best" angle.png angle.npy
[[ -e reused/frame_4.png && -e reused/4_front_labels.npy && -e reused/scan.png ]] || fail "inspect removes $(ls reused)"
# Nor does a command remove unfinished results of another kind, or .part files of the user.
parts="notes.part tracks.csv.part angle.npy.part frame_9.png.part 9_front_labels.npy.part"
for name in $parts; do echo mine >reused/$name; done
expect "label" "$overtake" label scene --rig av21 --frame 4 --out reused --quiet
expect "inspect" "$overtake" inspect scene --rig av21 --frame 3 --sensor front --preset best --out reused --quiet
[[ $(ls reused | grep 'part$' | xargs) == "frame_9.png.part notes.part tracks.csv.part" ]] ||
  fail "label and inspect leave these of $parts: $(ls reused | grep 'part$' | xargs)"
expect "run over them" "$overtake" run scene --rig av21 --out reused --picture-at 4 --quiet
[[ $(ls reused | grep 'part$') == notes.part && $(cat reused/notes.part) == mine ]] || fail "run leaves $(ls reused | grep 'part$' | xargs)"
echo mine >>reused/4_front_labels.npy
expect "run --force" "$overtake" run scene --rig av21 --out reused --quiet --force
expect "label again" "$overtake" label scene --rig av21 --frame 0 --out reused --quiet
left "run --force" frame_4.png
[[ -e reused/4_front_labels.npy && -e reused/labels.npy && -e reused/range.png ]] || fail "run or label removes $(ls reused)"
mkdir long
for ((i = 0; i < 3000; ++i)); do ln "scene/00000$((i % 6))_front.pcd" "long/${i}_front.pcd"; done
stop INT 'long_run/tracks.csv.part' run long --rig av21 --out long_run --mcap long_run/view.mcap --quiet
[[ $(ls long_run) == "$(printf '%s\n' config.toml.part detections.csv.part timing.csv.part tracks.csv.part view.mcap.part)" ]] ||
  fail "an interrupted run leaves $(ls long_run)"
grep -q '^this log is partial: interrupted after' <("$overtake" info long_run/view.mcap.part) || fail "the view is not partial"
grep -q '"partial": "interrupted after' <("$overtake" info long_run/view.mcap.part --json) || fail "info --json: not partial"
stop TERM 'long_label/*_labels.npy.part' label long --rig av21 --out long_label --quiet
[[ -e long_label/labels.csv.part && -z $(compgen -G 'long_label/*.npy') ]] || fail "interrupted labels: $(ls long_label | head -3)"
expect "over what was interrupted" "$overtake" run scene --rig av21 --out long_run --quiet
[[ -s long_run/tracks.csv && ! -e long_run/tracks.csv.part ]] || fail "a run over parts: $(ls long_run)"
expect "a long log" "$overtake" simulate demo --seed 4 --seconds 2 --out longer.mcap --quiet
stop INT 'judged_2/maps/longer.csv' evaluate longer.mcap --preset paper,paper:clusters --quiet --out judged_2
[[ ! -e judged_2/report.html ]] || fail "an interrupted evaluate has a report"

# ---- a failed command leaves nothing
for words in "--map /nope.csv" "--isa z80" "--ego /nope.csv" "--set tracker.nothing=1"; do
  # shellcheck disable=SC2086
  "$overtake" run scene --rig av21 --out "failed/deep" $words >stdout 2>stderr && fail "run $words passes"
  [[ ! -e failed ]] || fail "run $words leaves $(find failed)"
done

# ---- config.toml from any folder
expect "a run with files" "$overtake" run race.mcap --map race/map.csv --ego race/ego.csv --out with_files
expected=$(hash_of)
mkdir -p else/where
(cd else/where && "$overtake" run ../../race.mcap --config ../../with_files/config.toml --out rerun) >stdout 2>stderr ||
  fail "config.toml in another folder: $(cat stderr)"
[[ $(hash_of) == "$expected" ]] || fail "config.toml gives another hash in another folder"
printf 'rig = "rig.toml"\nmap = "map.csv"\nego = "ego.csv"\n' >race/given.toml
(cd else && "$overtake" run ../race.mcap --config ../race/given.toml --out given) >stdout 2>stderr || fail "paths beside a config file: $(cat stderr)"
[[ $(hash_of) == "$expected" ]] || fail "paths beside a config file give another hash"
for words in "--map nowhere.mcap" "--map nowhere.csv"; do
  # shellcheck disable=SC2086
  refuse "${words#* }: no such file" run race.mcap $words --out ov
done
# ---- a folder of simulate runs with its own files, like a log
# ---- a folder of simulate is run by its own files, as a log is
expect "the folder alone" "$overtake" run race --out alone
of_folder=$(hash_of)
grep -q '^note: the rig, the map and the ego poses are from the log itself$' stdout || fail "the folder's own files are not said: $(cat stdout)"
expect "the same given" "$overtake" run race --rig race/rig.toml --map race/map.csv --ego race/ego.csv --out alone
[[ $(hash_of) == "$of_folder" ]] || fail "the folder's own files are not taken"
expect "none of them" "$overtake" run race --map none --ego none --out alone
grep -q 'note: no ego poses' stdout && grep -q 'note: no map' stdout || fail "--ego none, --map none: $(cat stdout)"
without=$(hash_of)
cp alone/config.toml without.toml
expect "none of them, by config.toml" "$overtake" run race --config without.toml --out alone
[[ $(hash_of) == "$without" && $without != "$of_folder" ]] || fail "config.toml does not repeat --ego none"
# ---- the same scans give the same hash, for any file numbers and stamp offset
# ---- the same scans give the same hash, whatever their names and stamps count from
mkdir later
for file in scene/*.pcd; do
  name=${file##*/}
  printf -v number '%06d' $((10#${name%%_*} + 40))
  cp "$file" "later/${number}_${name#*_}"
done
expect "scene" "$overtake" run scene --rig av21 --out ov && expected=$(hash_of)
expect "scene, later numbers" "$overtake" run later --rig av21 --out ov
[[ $(hash_of) == "$expected" ]] || fail "frame numbers change the hash"

# ---- options without effect
refuse "--map race/map.csv: has no effect without ego poses, *" run scene --rig av21 --map race/map.csv --out failed
end 2 "overtake: inspect: unknown option '--map'*" inspect scene --rig av21 --map race/map.csv --frame 0 --sensor front --out failed
grep -q -- --map <("$overtake" inspect --help) && fail "inspect offers a map"
refuse "--ego race/ego.csv: has no effect: its poses are from 17*, the scans from *" run scene --rig av21 --ego race/ego.csv --out failed
[[ ! -e failed ]] || fail "an option without effect leaves $(find failed)"
awk 'NR < 10' race/ego.csv >short.csv
end 3 "overtake: --ego short.csv: covers only [0-9]* of [0-9]* frames (* %)" run longer.mcap --ego short.csv --out ov
grep -q '^note: the ego poses cover [0-9]* of [0-9]* frames' stdout || fail "the share of frames is not said"
"$overtake" doctor longer.mcap --ego short.csv >stdout
code=$?
((code == 3)) && grep -q '^WRONG  ego: its poses cover only [0-9]* % of the time of the scans' stdout || fail "doctor: $code $(cat stdout)"

mkdir -p sets/nuscenes faceless/racecar && cp scene/000000_front.pcd sets/nuscenes/1.pcd && cp scene/*.pcd faceless/racecar
refuse "sets/nuscenes/1_boxes.csv: no such file: there is nothing to judge 1.pcd by" evaluate --recordings sets --out failed
refuse "faceless/racecar: holds no FRAME_box.txt: *" evaluate --recordings faceless --out failed
# ---- the opponent is shown only where it is known
# ---- the opponent only where it is known
expect "no truth" "$overtake" run scene --rig av21 --out ov
grep -qE 'opponent|off box' stdout && fail "an opponent is shown without ground truth: $(head -3 stdout)"
cp -r scene boxed && echo "20 0 0 4.9 1.9 1.2 0" >boxed/000003_box.txt
expect "a truth" "$overtake" run boxed --rig av21 --out ov
grep -q 'opponent  *ahead m' stdout || fail "no opponent where a box says it"

# ---- folders and names
mkdir both && cp scene/00000*_front.pcd both && cp race.mcap both
for command in "run both --rig av21 --out failed" "doctor both --rig av21" "info both" "label both --rig av21 --out failed"; do
  # shellcheck disable=SC2086
  refuse "both: holds recordings of two kinds, .mcap (race.mcap) and .pcd (000000_front.pcd): *" $command
done
refuse "--out race.mcp: a log's name ends in .mcap, not in .mcp; *" simulate demo --seconds 0.1 --out race.mcp
[[ ! -e race.mcp && ! -e failed ]] || fail "simulate --out race.mcp makes it"
expect "a folder with a dot" "$overtake" simulate demo --seconds 0.1 --out race.mcp/ --quiet
[[ -d race.mcp ]] || fail "race.mcp/ is no folder"

# ---- a damaged file costs its scan
cp -r scene hurt && truncate -s 5000 hurt/000002_left.pcd && truncate -s 0 hurt/000004_front.pcd
end 3 "overtake: hurt: 2 files could not be read, the others are done; the first: *000002_left.pcd: *" run hurt --rig av21 --out ov
[[ $(awk -F, 'NR > 1 { print $1 }' ov/timing.csv | sort -un | wc -l) == 6 ]] || fail "a damaged file costs more than its scan"
[[ -n $(hash_of) ]] || fail "no table and no hash where a file is damaged"
end 3 "overtake: hurt: 2 files could not be read, *" label hurt --rig av21 --out hurt_labels
[[ $(ls hurt_labels/*.npy | wc -l) == 16 ]] || fail "labels of a damaged folder: $(ls hurt_labels)"

# ---- track on run's own table
refuse "first/detections.csv: is detections.csv of overtake run: its positions are in the vehicle frame *" track first/detections.csv --out failed

passed "all output checks passed"
