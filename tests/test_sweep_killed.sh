#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: test_sweep_killed.sh OVERTAKE [TIMES]
# A sweep that is killed with all its jobs 20 times, at random moments (seed 1) and every fifth time as soon as a job is
# whole, and started again each time gives the metrics.json of one that is not, and does no whole job twice.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
overtake=$(realpath "${1:?usage: test_sweep_killed.sh OVERTAKE [TIMES]}")
project=$(realpath "$(dirname "$0")/..")
readonly overtake project times=${2:-20}
need test_sweep_killed "tools/setup --cluster" snakemake
cd "$work" || exit 1
# A job is whole when its result is (tools/evaluation/once.py): after a kill, those in the folder whole; and the log of an
# evaluation that starts. A job that starts although it is whole is done again.
mkdir done
cat >program <<END
#!/bin/bash
[[ \$1 == simulate || \$1 == evaluate && \$2 != --check ]] || exec "$overtake" "\$@"
out=\${*: -1}
job=\$1.\$(basename "\$(dirname "\$out")" .part)
echo "\$job" >>"$work/started"
[[ ! -e "$work/done/\$job" ]] || echo "\$job" >>"$work/again"
[[ \$1 != evaluate ]] || touch "$work/done/simulate.\$(basename "\$2" .mcap)"
exec "$overtake" "\$@"
END
chmod +x program
note_whole() {  # FOLDER
  local path
  for path in "$1"/whole/*/*/.hash; do
    path=${path%/.hash}
    [[ ! -d $path || $path == *.part ]] || touch "done/$(basename "$(dirname "$path")").$(basename "$path")"
  done
}
has_new_whole() {  # FOLDER: a whole result that note_whole has not seen
  local path
  for path in "$1"/whole/*/*/.hash; do
    path=${path%/.hash}
    [[ ! -d $path || $path == *.part || -e done/$(basename "$(dirname "$path")").$(basename "$path") ]] || return 0
  done
  return 1
}
cat >sweep.yaml <<END
overtake: ./program
scenarios: [overtake, empty_track, three_cars]
seeds: [1, 2]
seconds: 0.5
grid:
  presets: [paper, best]
  parameters: {gate.min_points: [2, 3, 4, 6, 8]}
contestants_per_job: 5
END
sweep=(snakemake --snakefile "$project/tools/evaluation/Snakefile" --configfile sweep.yaml --rerun-triggers mtime
  --rerun-incomplete --cores 2)
begin=$(date +%s%N)
expect "the sweep" "${sweep[@]}" --directory whole
took_ms=$((($(date +%s%N) - begin) / 1000000))
[[ $(sort started | uniq | grep -c .) == 18 && $(grep -c . started) == 18 ]] || fail "not 6 and 12 jobs: $(cat started)"
[[ ! -e whole/whole ]] || fail "whole results are kept after the sweep: $(ls whole/whole)"
rm -f done/* started again
RANDOM=1
killed=0
for ((k = 0; k < times; ++k)); do
  setsid "${sweep[@]}" --directory killed >"$work/log" 2>&1 &
  sweep_id=$!
  if ((k % 5 == 4)); then  # when a job is whole, and Snakemake does not know yet
    for ((w = 0; w < 1000; ++w)); do
      if has_new_whole killed; then break; fi
      sleep 0.01
    done
  else  # up to an eighth of the whole sweep, after a start of Snakemake
    sleep "$(awk -v t="$took_ms" -v r="$RANDOM" 'BEGIN { print (0.8 + t / 8000 * r / 32768) }')"
  fi
  if kill -KILL -- "-$sweep_id" 2>/dev/null; then killed=$((killed + 1)); fi
  wait "$sweep_id" 2>/dev/null
  note_whole killed
  "${sweep[@]}" --directory killed --unlock >/dev/null 2>&1
done
expect "the last start" "${sweep[@]}" --directory killed
recognised=$(cat killed/jobs/*/*.txt | grep -c "done before an interruption")
echo "killed $killed times; $(grep -c . started) starts of $(sort -u started | grep -c .) jobs, of which $recognised were whole at a kill and not noted"
((recognised > 0)) || fail "no kill came between the end of a job and Snakemake's note of it"
((killed > times / 2)) || fail "killed only $killed times: the sweep was done"
cmp whole/metrics.json killed/metrics.json || fail "killed and gone on differs"
[[ ! -e again ]] || fail "whole jobs were done again: $(cat again)"
passed
