#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: test_sweep.sh OVERTAKE
# tools/evaluation/Snakefile: a sweep of scenarios, seeds, presets, a grid and recordings gives the metrics.json of
# overtake evaluate on all its logs; logs of a sweep are deleted; a failed job is tried again; a wrong sweep.yaml gets a
# sentence that begins with its field; calls beside a running sweep change nothing; wrong files, folders, versions and
# profiles get a sentence, too (tools/evaluation/sweep).
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
overtake=$(realpath "${1:?usage: test_sweep.sh OVERTAKE}")
evaluation=$(realpath "$(dirname "$0")/../tools/evaluation")
snakefile=$evaluation/Snakefile
readonly overtake evaluation snakefile
need test_sweep "tools/setup --cluster" snakemake
cd "$work" || exit 1
sweep() { "$evaluation/sweep" --configfile sweep.yaml --rerun-triggers mtime --cores 2 "$@" >"$work/log" 2>&1; }

# What the sweep runs, by hand.
mkdir logs records
for seed in 1 2; do
  for scenario in overtake empty_track; do
    "$overtake" simulate "$scenario" --seed "$seed" --seconds 0.4 --quiet --out "logs/${scenario}_${seed}_0.4s.mcap"
  done
done
"$overtake" simulate overtake --seed 3 --seconds 0.5 --quiet --out "records/drive one.mcap"
"$overtake" simulate overtake --seed 4 --seconds 0.3 --quiet --out records/drive_two.mcap
printf 'preset = "best"\n[gate]\nmin_points = 8\n' >strict.toml
for preset in paper best; do
  for value in 2 6; do printf 'preset = "%s"\n[gate]\nmin_points = %s\n' $preset $value >"${preset}_gate.min_points=$value.toml"; done
done
grid=$(ls -- *_gate*.toml | tr '\n' ',')
expect "evaluate" "$overtake" evaluate logs/*.mcap records/*.mcap --preset paper,best --config "strict.toml,${grid%,}" \
  --only-figures --quiet --out by_hand

cat >sweep.yaml <<END
overtake: $overtake
scenarios: [overtake, empty_track]
seeds: [1, 2]
seconds: 0.4
recordings: records
presets: [paper, best]
configurations: [strict.toml]
grid: {parameters: {gate.min_points: [2, 6]}}
contestants_per_job: 3
END
sweep --directory out || fail "the sweep: $(tail -n 30 "$work/log")"
cmp by_hand/metrics.json out/metrics.json || fail "the sweep differs from overtake evaluate"
[[ $(ls out/parts | wc -l) == 18 ]] || fail "not 6 logs with 3 groups: $(ls out/parts)"
[[ -z $(ls out/logs 2>/dev/null) ]] || fail "logs are left: $(ls out/logs)"
[[ -f records/drive_two.mcap ]] || fail "a recording was deleted"
[[ -z $(find out -name '*:*') ]] || fail "a colon in a name: $(find out -name '*:*')"
sweep --directory out --dry-run || fail "dry run: $(cat "$work/log")"
grep -q "Nothing to be done" "$work/log" || fail "a finished sweep is not finished: $(cat "$work/log")"
# The differences from another result.
sed 's/^seeds: .*/&\nagainst: [by_hand]/' sweep.yaml >sweep_against.yaml
snakemake --snakefile "$snakefile" --configfile sweep_against.yaml --rerun-triggers mtime --cores 2 --directory out >"$work/log" 2>&1 ||
  fail "against: $(tail -n 30 "$work/log")"
[[ $(grep -c '^rule compare:' "$work/log") == 1 && $(grep -cE '^rule (evaluate|simulate|merge|report):' "$work/log") == 0 ]] ||
  fail "against runs more than compare: $(grep '^rule' "$work/log")"
python3 - <<'END' || fail "comparison.json: $(head -c 300 out/comparison.json)"
import json
found = json.load(open('out/comparison.json'))
assert found['base'] == 'by_hand/best' and found['logs'] == 6 and len(found['contestants']) == 14, found['base']
there = {c['contestant']: c['differences']['detected']['value'] for c in found['contestants']}
assert there['out/best'] == 0 and there['out/paper'] == there['by_hand/paper'], there
END
# Another value makes its two groups anew, and of a deleted log all three; another seed its logs alone; then the merge.
sed -i 's/min_points: \[2, 6\]/min_points: [2, 7]/' sweep.yaml
sweep --directory out --dry-run
grep -qE '^evaluate +16 ' "$work/log" || fail "another value: $(cat "$work/log")"
grep -qE '^merge +1 ' "$work/log" && grep -qE '^report +1 ' "$work/log" || fail "another value does not merge and report again"
sed -i 's/min_points: \[2, 7\]/min_points: [2, 6]/; s/seeds: .*/seeds: [1, 2, 5]/' sweep.yaml
sweep --directory out --dry-run
grep -qE '^evaluate +6 ' "$work/log" && grep -qE '^simulate +2 ' "$work/log" || fail "another seed: $(cat "$work/log")"
sed -i 's/seeds: .*/seeds: [1, 2]/' sweep.yaml
sweep --directory out --dry-run
grep -q "Nothing to be done" "$work/log" || fail "the first sweep again is not finished: $(cat "$work/log")"

# Pieces with a warm-up from the start give the bytes of the whole.
mv sweep.yaml whole.yaml
sed 's/contestants_per_job: 3/pieces: {seconds: 0.2, warm_up: 10}/' whole.yaml >sweep.yaml
sweep --directory pieces || fail "pieces: $(tail -n 30 "$work/log")"
[[ $(ls pieces/parts | wc -l) == 15 ]] || fail "not 2 pieces of each race, 4 and 3 of the records, whose poses are longer: $(ls pieces/parts)"
cmp by_hand/metrics.json pieces/metrics.json || fail "pieces differ from overtake evaluate"

# While a sweep runs, a dry run and the picture of another plan change nothing in its folder; a second call is refused.
tree_of() { (cd "$1" && find . -path ./.snakemake -prune -o -type f -printf '%p %T@ %s\n' | sort); }
cat >waiting <<END
#!/bin/bash
for ((k = 0; k < 600; ++k)); do
  [[ \$1 == simulate && ! -e "$work/go" ]] || exec "$overtake" "\$@"
  sleep 0.1
done
END
chmod +x waiting
printf 'overtake: ./waiting\nscenarios: [empty_track]\nseeds: [1, 2, 3]\nseconds: 0.2\nkeep_logs: build\n' >three.yaml
printf 'overtake: ./waiting\nscenarios: [empty_track]\nseeds: [1]\nseconds: 0.2\npresets: [best]\n' >sweep.yaml
"$evaluation/sweep" --configfile three.yaml --cores 2 --directory busy >three.log 2>&1 &
running=$!
for ((k = 0; k < 300; ++k)); do
  [[ ! -d busy/whole/simulate ]] || break
  sleep 0.1
done
tree_of busy >before
for look in -n --dry-run --dag --summary; do
  sweep --directory busy "$look"
  tree_of busy | cmp -s before - || fail "$look changes a running sweep: $(tree_of busy | diff before -)"
done
sweep --directory busy && fail "a second sweep of a folder was taken"
grep -q -- "--directory: $work/busy: another sweep is running there" "$work/log" ||
  fail "no sentence on the second sweep: $(cat "$work/log")"
"$evaluation/../dev/evaluate_set" --set empty_track --only-figures --build "$(dirname "$overtake")" --out busy \
  >"$work/log" 2>&1 && fail "evaluate_set was taken while a sweep runs"
grep -q -- "--out: $work/busy: another sweep is running there" "$work/log" ||
  fail "no sentence of evaluate_set: $(cat "$work/log")"
tree_of busy | cmp -s before - || fail "a refused call changes a running sweep: $(tree_of busy | diff before -)"
touch go
wait "$running" || fail "the sweep beside others: $(tail -n 30 three.log)"
[[ $(ls busy/runs/paper) == $'empty_track_1_0.2s\nempty_track_2_0.2s\nempty_track_3_0.2s' ]] ||
  fail "not three races: $(ls busy/runs/paper)"
# Times of a finished sweep stay although a dry run with another preset would measure them anew.
echo '{}' >busy/scaling.json
sweep --directory busy --dry-run || fail "a dry run: $(cat "$work/log")"
grep -qE '^evaluate +1 ' "$work/log" || fail "a dry run with another preset plans nothing: $(cat "$work/log")"
[[ -e busy/scaling.json ]] || fail "a dry run deletes scaling.json"
sweep --directory planned --dry-run || fail "a dry run of a new folder: $(cat "$work/log")"
[[ -z $(ls -A planned) ]] || fail "a dry run fills a new folder: $(ls -A planned)"

# Files of the user under a sweep's names: refused, by a dry run, too; races are taken with keep_logs: any.
for name in configs logs parts inputs jobs whole; do
  mkdir -p "mine/$name"
  echo mine >"mine/$name/mine.toml"
  for option in --printshellcmds --dry-run; do
    sweep --directory mine "$option" && fail "a folder with $name was taken"
    grep -q -- "--directory: $work/mine/$name is not of a sweep: choose another folder" "$work/log" ||
      fail "no sentence on $name: $(cat "$work/log")"
  done
  [[ $(find mine -type f -not -path '*/.snakemake/*') == "mine/$name/mine.toml" ]] ||
    fail "$name: files were changed: $(find mine -type f)"
  rm -r "mine/$name"
done
mkdir -p taken/logs
cp busy/logs/empty_track_1_0.2s.mcap taken/logs/
sed '$ a keep_logs: any' sweep.yaml >any.yaml
"$evaluation/sweep" --configfile any.yaml --cores 2 --directory taken >"$work/log" 2>&1 ||
  fail "a race made by hand: $(tail -n 30 "$work/log")"
cmp busy/logs/empty_track_1_0.2s.mcap taken/logs/empty_track_1_0.2s.mcap || fail "a race made by hand was replaced"
! grep -q '^rule simulate:' "$work/log" || fail "a race made by hand was simulated again"

# Recorded data sets are evaluated while the parts are merged: neither needs the folder of the other.
mkdir -p sets/nuscenes
{
  printf 'VERSION 0.7\nFIELDS x y z intensity ring\nSIZE 4 4 4 4 2\nTYPE F F F F U\nCOUNT 1 1 1 1 1\nWIDTH 40\nHEIGHT 1\n'
  printf 'VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 40\nDATA ascii\n'
  for ((k = 0; k < 40; ++k)); do echo "10.$((k % 10)) 0 -0.$((k / 10)) 1 $((k / 10))"; done
} >sets/nuscenes/1.pcd
printf 'category,x_m,y_m,z_m,length_m,width_m,height_m,yaw_rad,points\ncar,10,0,0,4.5,1.9,1.5,0,40\n' >sets/nuscenes/1_boxes.csv
cat >together <<END
#!/bin/bash
until_there() { for ((k = 0; k < 100; ++k)); do [[ ! -e \$1 ]] || return; sleep 0.1; done; }
if [[ \$1 == merge ]]; then
  until_there "$work/measures"
  "$overtake" "\$@"
  code=\$?
  touch "$work/merged"
  exit \$code
elif [[ \$2 == --recordings ]]; then
  mkdir -p "\${*: -1}"
  exec 9<"\${*: -1}"  # overtake locks the folder of its results likewise
  flock 9
  touch "$work/measures"
  until_there "$work/merged"
  flock --unlock 9
fi
exec "$overtake" "\$@"
END
chmod +x together
printf 'overtake: ./together\nscenarios: [empty_track]\nseeds: [1]\nseconds: 0.2\ndata_sets: sets\nretries: 0\n' >sweep.yaml
sweep --directory together_out || fail "data sets beside a merge: $(tail -n 30 "$work/log")"
grep -q nuscenes together_out/metrics.json || fail "the data sets are not in the result"

# A program that fails once in each job.
cat >unlucky <<END
#!/bin/bash
if [[ \$1 == simulate || \$2 == logs/* ]] && mkdir "$work/\$1" 2>/dev/null; then kill -KILL \$\$; fi
exec "$overtake" "\$@"
END
chmod +x unlucky
printf 'overtake: ./unlucky\nscenarios: [overtake]\nseeds: [1]\nseconds: 0.2\nretries: 1\n' >sweep.yaml
sweep --directory unlucky_out || fail "a killed job was not tried again: $(tail -n 30 "$work/log")"
[[ -d simulate && -d evaluate ]] || fail "no job was killed"
rm -r simulate evaluate
sed -i 's/retries: 1/retries: 0/' sweep.yaml
sweep --directory unlucky_two && fail "a killed job counts as done"
[[ ! -e unlucky_two/metrics.json ]] || fail "merged without a part"
grep -q "^simulate: .* resources.simulate.mem_mb (now 2000)" "$work/log" || fail "no hint on the resources: $(tail "$work/log")"

# A damaged recording is a result; its job is not tried again, and a killed job is no such result.
mkdir damaged
head -c $(($(stat -c %s records/drive_two.mcap) / 2)) records/drive_two.mcap >damaged/cut.mcap
printf 'overtake: %s\nrecordings: damaged\nextent: figures\nretries: 0\n' "$overtake" >sweep.yaml
sweep --directory damaged_out || fail "a damaged recording stops the sweep: $(tail -n 30 "$work/log")"
[[ -s damaged_out/metrics.json && -d damaged_out/runs/paper/cut ]] || fail "a damaged recording has no result"
grep -q "cut.mcap: .*; results are from the part before it" damaged_out/jobs/evaluate/cut.txt || fail "the damage is not in the job's text"
once=(python3 "$evaluation/once.py" --accept 3 whole/job result -- bash -c)
"${once[@]}" 'echo x >"$0"; exit 3' OUT && [[ $(cat result) == x ]] || fail "once.py does not accept exit code 3"
for code in 1 2 130; do
  "${once[@]}" "echo y >\"\$0\"; exit $code" OUT
  [[ $? == "$code" && $(cat result) == x ]] || fail "once.py accepts exit code $code"
done

# Wrong files: a sentence that begins with the field, and no job. Two of them through the program.
refuse() {  # FIELD LINES
  printf 'overtake: %s\n%b\n' "$overtake" "$2" >sweep.yaml
  sweep --directory bad && fail "taken: $2"
  grep -q "/sweep.yaml: $1: " "$work/log" || fail "'$2' gave no sentence on $1: $(cat "$work/log")"
  [[ $(grep -c . "$work/log") -le 4 ]] || fail "'$2': more than a sentence: $(cat "$work/log")"
  [[ ! -d bad/logs ]] || fail "'$2': found out after a simulation"
}
good='scenarios: [overtake]\n'
refuse scenarios "scenarios: overtake"
refuse recordings "recordings: nowhere"
# The others in one process: field, lines, and what the sentence begins with.
: >cases
plan_fails() { printf '%s\0' "${1%%: *}" "$2" "$1" >>cases; }  # FIELD[: SENTENCE] LINES
plan_fails "scenarios or recordings" "presets: [paper]"
plan_fails scenarios "scenarios: [overtake, nonsense]"
plan_fails scenarios "scenarios: []"
plan_fails scenarios "scenarios: [none.toml]"
plan_fails "scenarios.0" "scenarios: [1]"
plan_fails seeds "${good}seeds: last"
plan_fails seeds.1 "${good}seeds: [1, -2]"
plan_fails seconds "${good}seconds: soon"
plan_fails sedes "${good}sedes: [1]"
plan_fails presets "${good}presets: [paper, nonsense]"
plan_fails configurations "${good}configurations: [none.toml]"
plan_fails grid.parameters.gate.min_points.1 "${good}presets: [best]\ngrid: {parameters: {gate.min_points: [1, two]}}"
plan_fails grid "${good}presets: [best]\ngrid: {parameters: {gate.nonsense: [1]}}"
plan_fails grid "${good}presets: [best]\ngrid: {combine: single}"
plan_fails grid.values "${good}presets: [best]\ngrid: {values: {}, parameters: {gate.min_points: [1]}}"
plan_fails grid.presets "${good}grid: {parameters: {gate.min_points: [1]}}"
plan_fails sweep "${good}sweep: cluster.nonsense=1:2:1"
plan_fails recordings "recordings: [records/none.mcap]"
plan_fails rig "recordings: [records]"
plan_fails resources.merge.threads "${good}resources: {merge: {threads: 0}}"
plan_fails resources.plot "${good}resources: {plot: {threads: 1}}"
plan_fails against.0 "${good}against: [logs]"
plan_fails pieces "${good}seconds: 1\nextent: whole\npieces: {seconds: 1}"
plan_fails pieces "scenarios: [las_vegas_15]\npieces: {seconds: 1}"
plan_fails pieces.seconds "${good}pieces: {seconds: 0}"
plan_fails shard "${good}shard: 3/2"
printf 'test_seeds=[7,\n  8]  # two\ntune_seeds = []\nseconds = 2e1\n' >written.toml
printf 'seconds = \n' >torn.toml
plan_fails "scenarios: $work/torn.toml: Invalid value (at line 1" "scenarios: [$work/torn.toml]"
plan_fails "seeds: written names no seeds for 'tune'" "scenarios: [$work/written.toml]\nseeds: tune"
plan_fails 'scenarios: "overtake" is none of all, a list; write [overtake]' "scenarios: overtake"
plan_fails "scenarios: the list is empty" "scenarios: []"
plan_fails "scenarios: there is no scenario 'overtke'; the nearest is 'overtake';" "scenarios: [overtke]"
plan_fails "scenarios: there is no scenario 'zzz'; there are being_overtaken, blind_zone, " "scenarios: [zzz]"
plan_fails "seeds: 3 is none of first, test, tune, a list; write [3]" "${good}seeds: 3"
plan_fails 'presets: "best" is not a list; write [best]' "${good}presets: best"
plan_fails "pieces: 600 is not a group of fields; write {seconds: 600}" "${good}pieces: 600"
plan_fails "keep_logs: true is none of no, build, any" "${good}keep_logs: yes"
plan_fails "grid.parameters.min_points: 'min_points' is not of the form GROUP.NAME, as gate.min_points" "${good}grid: {parameters: {min_points: [2]}}"
plan_fails "grid.parameters.gate.min_points: 2 is not a list; write [2]" "${good}grid: {parameters: {gate.min_points: 2}}"
plan_fails "resources.merge: 8000 is not a group of fields; write {mem_mb: " "${good}resources: {merge: 8000}"
plan_fails "shard: '3' is not of the form I/N" "${good}shard: '3'"
"$(sed -n '1s/^#!//p' "$(command -v snakemake)")" - "$evaluation" "$overtake" "$work/cases" <<'END' || fail "wrong files"
import os, sys
evaluation, overtake, cases = sys.argv[1:]
sys.path.insert(0, evaluation)
import yaml
from snakemake.utils import validate
import sweep
words = open(cases).read().split('\0')[:-1]
failed = 0
for field, lines, sentence in zip(*[iter(words)] * 3):
    config = yaml.safe_load(f'overtake: {overtake}\n' + lines.replace('\\n', '\n'))
    try:
        sweep.plan_of(config, 'sweep.yaml', validate)
        found = 'taken'
    except sweep.SweepError as error:
        found = str(error)
    if not found.startswith(f'sweep.yaml: {field}: ') or f'sweep.yaml: {sentence}' not in found or '\n' in found:
        print(f'{lines!r} does not say {sentence!r}: {found}')
        failed = 1
print(len(words) // 3, 'wrong files')
# A scenario in other forms of TOML than ours.
forms = {'scenarios': ['written.toml'], 'seeds': 'test', 'pieces': {'seconds': 5}}
logs, _ = sweep.simulated_logs(forms, os.path.dirname(cases))
if list(logs) != ['written_7', 'written_8'] or logs['written_7']['length_s'] != 20:
    print(logs)
    failed = 1
sys.exit(failed or len(words) < 3)
END
printf 'overtake: %s\nscenarios: [overtake]\nkeep_logs: no\n' "$overtake" >sweep.yaml
sweep --directory keep --dry-run || fail "keep_logs: no is refused: $(cat "$work/log")"

# stops SENTENCE COMMAND...: the command fails with one sentence, without a traceback.
stops() {
  local sentence=$1
  shift
  "$@" >"$work/log" 2>&1 && fail "taken: $*"
  grep -qF -- "$sentence" "$work/log" || fail "'$*' does not say: $sentence: $(cat "$work/log")"
  ! grep -q "^Traceback" "$work/log" && [[ $(grep -c . "$work/log") -le 4 ]] || fail "'$*': more than a sentence: $(cat "$work/log")"
}
call=("$evaluation/sweep" --cores 1 --directory bad)
printf 'scenarios: [overtake\nseeds: 1\n' >invalid.yaml
: >empty.yaml
echo '- overtake' >list.yaml
stops "--configfile: invalid.yaml:2:6: " "${call[@]}" --configfile invalid.yaml
stops "--configfile: empty.yaml: the file is empty" "${call[@]}" --configfile=empty.yaml
stops "--configfile: list.yaml: it has no fields" "${call[@]}" --configfile list.yaml
stops "--configfile: none.yaml: No such file" "${call[@]}" --configfile none.yaml
stops "--configfile: it is needed" "${call[@]}"
stops "--directory: $work/empty.yaml: " "$evaluation/sweep" --configfile sweep.yaml --directory "$work/empty.yaml" --cores 1
mkdir -m 555 closed
as_user=()
((EUID)) || as_user=(setpriv --reuid 65534 --regid 65534 --clear-groups env HOME=/tmp)
chmod 755 "$work"
if "${as_user[@]}" "$evaluation/sweep" --help >/dev/null 2>&1; then
  stops "--directory: $work/closed: no permission to write" "${as_user[@]}" "$evaluation/sweep" --configfile sweep.yaml --directory "$work/closed" --cores 1
else
  echo "skipped: a folder without permission: the source tree is closed to other users"
fi
mkdir shim
echo 'import snakemake; snakemake.__version__ = "8.4.2"' >shim/sitecustomize.py
stops "snakemake: version 7.21 or newer, but older than 8, is needed, not 8.4.2" env PYTHONPATH="$work/shim" snakemake -s "$snakefile" \
  --configfile sweep.yaml --cores 1 --directory bad

# A profile: an absolute path for Snakemake; sbatch and Slurm before the first job.
mkdir -p some/slurm bin
echo 'cores: 1' >some/slurm/config.yaml
stops "--profile: some/slurm must be an absolute path" snakemake --snakefile "$snakefile" --configfile sweep.yaml --profile some/slurm --directory bad
"$evaluation/sweep" --configfile sweep.yaml --profile some/slurm --directory keep --dry-run >"$work/log" 2>&1 || fail "a relative profile: $(cat "$work/log")"
mkdir shown
printf 'cores: 1\ndry-run: true\n' >some/slurm/config.yaml
expect "a profile with dry-run" "$evaluation/sweep" --configfile sweep.yaml --profile some/slurm --directory shown
[[ -z $(ls -A shown) ]] || fail "a profile with dry-run fills a new folder: $(ls -A shown)"
ln -s "$(command -v snakemake)" "$(command -v env)" "$(command -v bash)" bin/
ln -s "$(python3 -c 'import sys; print(sys.executable)')" bin/python3
slurm=(env PATH="$work/bin" "$evaluation/sweep" --configfile sweep.yaml --directory bad --profile "$evaluation/profiles/slurm")
stops "--profile: its jobs need Slurm, and there is no sbatch" "${slurm[@]}"
for program in sbatch squeue scancel; do printf '#!/usr/bin/env bash\necho "%s: no controller" >&2\nexit 1\n' $program >bin/$program; done
chmod +x bin/sbatch bin/squeue bin/scancel
stops "--profile: Slurm does not answer (squeue: no controller)" "${slurm[@]}"
expect "a dry run without Slurm" "${slurm[@]}" --dry-run
# A job that Slurm refuses: the field to change.
printf '#!/usr/bin/env bash\n' >bin/squeue
printf '#!/usr/bin/env bash\necho "sbatch: error: Memory specification can not be satisfied" >&2\nexit 1\n' >bin/sbatch
printf 'overtake: %s\nscenarios: [overtake]\nseconds: 0.2\n' "$overtake" >sweep.yaml
ln -s "$(command -v mkdir)" bin/
"${slurm[@]}" --latency-wait 1 >"$work/log" 2>&1 && fail "a refused job counts as done"
grep -q "^simulate: .* Slurm refuses it: resources.simulate.mem_mb (now 2000)" "$work/log" || fail "no hint on a refused job: $(cat "$work/log")"
rm -r bad
sed -i 's/^overtake:.*/overtake: .\/missing/' sweep.yaml
sweep --directory bad && fail "taken without a program"
grep -q "/sweep.yaml: overtake: " "$work/log" || fail "no sentence on the program: $(cat "$work/log")"
passed
