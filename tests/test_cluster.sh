#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: test_cluster.sh OVERTAKE
# A sweep (three scenarios, two seeds, two presets, a grid of five values) on a real Slurm of this machine
# (tools/cluster/start), with faults: a job is killed in the middle, the node is drained and resumed, the controller is
# restarted, Snakemake is killed and started again. metrics.json has the bytes of a run by one process
# and of one by snakemake -j 2, and no whole job is done twice. Prints wall times.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
overtake=$(realpath "${1:?usage: test_cluster.sh OVERTAKE}")
project=$(realpath "$(dirname "$0")/..")
readonly overtake project
PATH=$PATH:/usr/sbin
need test_cluster "tools/setup --cluster" snakemake munged slurmctld slurmd sbatch ps
((EUID == 0)) || { echo "skipped: test_cluster: only root can start Slurm"; exit 77; }
unset SLURM_CONF
cd "$work" || exit 1
cluster=$work/cluster
trap '"$project/tools/cluster/stop" "$cluster" 2>/dev/null; rm -rf "$work" "$work.failed"' EXIT

# Notes which jobs are done. While a file hold_RULE exists, the first job of this rule waits until the file is gone.
cat >program <<END
#!/bin/bash
if [[ \$1 == simulate || \$1 == evaluate && \$2 != --check ]]; then
  [[ ! -e $work/hold_\$1 ]] || ! mkdir "$work/held_\$1" 2>/dev/null || while [[ -e $work/hold_\$1 ]]; do sleep 0.2; done
  "$overtake" "\$@" || exit
  echo "\$*" >>"$work/done"
else
  exec "$overtake" "\$@"
fi
END
chmod +x program
cat >sweep.yaml <<END
overtake: ./program
scenarios: [overtake, empty_track, three_cars]
seeds: [1, 2]
seconds: 0.5
grid:
  presets: [paper, best]
  parameters: {gate.min_points: [2, 3, 4, 6, 8]}
contestants_per_job: 5
retries: 3
END
snakemake=(snakemake --snakefile "$project/tools/evaluation/Snakefile" --configfile sweep.yaml)
now() { date +%s%N; }
since() { awk -v a="$1" -v b="$(now)" 'BEGIN { printf "%.1f s", (b - a) * 1e-9 }'; }
until_true() {  # SENTENCE COMMAND...
  local sentence=$1 k
  shift
  for ((k = 0; k < 1200; ++k)); do
    if "$@"; then return 0; fi
    kill -0 "$sweep" 2>/dev/null || break
    sleep 0.1
  done
  fail "$sentence: $(tail -n 30 "$work/log")"
  return 1
}
need_true() { until_true "$@" || { rm -f hold_*; exit 1; }; }
jobs_done() { cut -d' ' -f1-2 done | grep -c . || true; }

begin=$(now)
: >done
expect "snakemake -j 2" "${snakemake[@]}" --rerun-triggers mtime --directory local --cores 2
echo "snakemake -j 2: $(since "$begin"), $(jobs_done) jobs and the merge"
[[ $(jobs_done) == 18 ]] || fail "not 6 and 12 jobs: $(cat done)"
begin=$(now)
mkdir logs
for scenario in overtake empty_track three_cars; do
  for seed in 1 2; do "$overtake" simulate $scenario --seed $seed --seconds 0.5 --workers 2 --quiet --out "logs/${scenario}_${seed}_0.5s.mcap"; done
done
configs=$(ls -d local/configs/* | tr '\n' ',')
expect "by one process" "$overtake" evaluate logs/*.mcap --config "${configs%,}" --only-figures --workers 2 --quiet --out by_hand
echo "by one process: $(since "$begin")"
cmp by_hand/metrics.json local/metrics.json || fail "snakemake -j 2 differs from one process"

begin=$(now)
expect "tools/cluster/start" "$project/tools/cluster/start" "$cluster" --cpus 2
echo "tools/cluster/start: $(since "$begin")"
# shellcheck source=/dev/null
source "$cluster/env"
slurm=("${snakemake[@]}" --profile "$project/tools/evaluation/profiles/slurm" --latency-wait 20)
begin=$(now)
: >done
expect "Slurm" "${slurm[@]}" --directory slurm
echo "Slurm without faults: $(since "$begin")"
cmp by_hand/metrics.json slurm/metrics.json || fail "Slurm differs from one process"
[[ -s slurm/.snakemake/slurm_jobs ]] || fail "status keeps its list elsewhere than in the sweep's folder"
[[ $(jobs_done) == 18 && -z $(sort done | uniq -d) ]] || fail "Slurm: not each job once: $(sort done)"

begin=$(now)
: >done
touch hold_simulate hold_evaluate
"${slurm[@]}" --directory faults >"$work/log" 2>&1 &
sweep=$!
need_true "no simulation runs" test -d held_simulate
# The node is drained: what runs goes on, what waits does not start.
node=$(sinfo -h -o %n)
scontrol update nodename="$node" state=drain reason=test || fail "the node cannot be drained"
rm hold_simulate
need_true "the node is not drained" bash -c '[[ $(sinfo -h -o %T) == drained ]]'
sleep 3
[[ $(squeue -h -t RUNNING | wc -l) == 0 && $(squeue -h -t PENDING | wc -l) -gt 0 ]] || fail "drained, but: $(squeue)"
scontrol update nodename="$node" state=resume
# A job is killed in the middle.
need_true "no evaluation runs" test -d held_evaluate
job=$(squeue -h -t RUNNING -n evaluate -o %i | sort -n | head -n 1)
scancel --full --signal=KILL "$job" || fail "job $job cannot be killed"
rm hold_evaluate
need_true "the killed job is not seen" grep -q "Trying to restart job\|Error in rule evaluate" "$work/log"
# The controller ends while jobs run, and is started again.
touch hold_evaluate
rmdir held_evaluate
need_true "no evaluation runs again" test -d held_evaluate
controller=$(<"$cluster/slurmctld.pid")
kill "$controller"
until_true "the controller does not end" bash -c "! kill -0 $controller 2>/dev/null"
rm hold_evaluate
expect "slurmctld again" "$project/tools/cluster/start" "$cluster" --again slurmctld
if ! wait "$sweep"; then  # a job that could not be submitted meanwhile: the same command goes on
  echo "the sweep ended with an error while the controller was away; the same command again"
  expect "Slurm again" "${slurm[@]}" --directory faults
fi
echo "Slurm with a drained node, a killed job and a restarted controller: $(since "$begin")"
cmp by_hand/metrics.json faults/metrics.json || fail "with faults it differs from one process"
[[ -z $(sort done | uniq -d) ]] || fail "with faults a whole job was done twice: $(sort done | uniq -d)"

# Snakemake is killed while jobs run; they go on, and the same command waits for them.
: >done
touch hold_simulate
rmdir held_simulate
setsid "${slurm[@]}" --directory again >"$work/log" 2>&1 &
sweep=$!
need_true "no simulation runs" test -d held_simulate
sleep 3
kill -KILL -- "-$sweep"
wait "$sweep" 2>/dev/null
rm hold_simulate
expect "unlock" "${slurm[@]}" --directory again --unlock
expect "Slurm after a killed Snakemake" "${slurm[@]}" --directory again
cmp by_hand/metrics.json again/metrics.json || fail "after a killed Snakemake it differs from one process"
[[ -z $(sort done | uniq -d) ]] || fail "after a killed Snakemake a whole job was done twice: $(sort done | uniq -d)"
[[ -z $(ls local/logs slurm/logs faults/logs again/logs 2>/dev/null | grep mcap) ]] || fail "logs are left"

"$project/tools/cluster/stop" "$cluster" || fail "tools/cluster/stop"
for name in munged slurmctld slurmd; do
  ! ps -p "$(<"$cluster/$name.pid")" >/dev/null || fail "$name is running"
done
passed
