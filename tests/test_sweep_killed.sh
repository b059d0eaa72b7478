#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: test_sweep_killed.sh OVERTAKE [TIMES]
# A sweep that is killed with all its jobs at 20 random moments (seed 1) and started again each time gives the metrics.json
# of one that is not, and does no whole job twice.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
overtake=$(realpath "${1:?usage: test_sweep_killed.sh OVERTAKE [TIMES]}")
project=$(realpath "$(dirname "$0")/..")
readonly overtake project times=${2:-20}
need test_sweep_killed "tools/setup --cluster" snakemake
cd "$work" || exit 1
# Notes the jobs that are whole: their results are there, and Snakemake may still be killed before it notices.
cat >program <<END
#!/bin/bash
[[ \$1 == simulate || \$1 == evaluate && \$2 != --check ]] || exec "$overtake" "\$@"
"$overtake" "\$@" || exit
echo "\$*" >>"$work/done"
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
END
sweep=(snakemake --snakefile "$project/tools/evaluation/Snakefile" --configfile sweep.yaml --rerun-triggers mtime
  --rerun-incomplete --cores 2)
: >done
begin=$(date +%s%N)
expect "the sweep" "${sweep[@]}" --directory whole
took_ms=$((($(date +%s%N) - begin) / 1000000))
[[ $(grep -c . done) == 18 ]] || fail "not 6 and 12 jobs: $(cat done)"
: >done
RANDOM=1
killed=0
for ((k = 0; k < times; ++k)); do
  setsid "${sweep[@]}" --directory killed >"$work/log" 2>&1 &
  sweep_id=$!
  # Up to an eighth of the whole sweep, after a start of Snakemake.
  sleep "$(awk -v t="$took_ms" -v r="$RANDOM" 'BEGIN { print (0.8 + t / 8000 * r / 32768) }')"
  if kill -KILL -- "-$sweep_id" 2>/dev/null; then killed=$((killed + 1)); fi
  wait "$sweep_id" 2>/dev/null
  "${sweep[@]}" --directory killed --unlock >/dev/null 2>&1
done
expect "the last start" "${sweep[@]}" --directory killed
echo "killed $killed times; $(grep -c . done) whole jobs"
((killed > times / 2)) || fail "killed only $killed times: the sweep was done"
cmp whole/metrics.json killed/metrics.json || fail "killed and gone on differs"
# A job is done again only if Snakemake was killed between the job's end and its note of it.
again=$(sort done | uniq -d | grep -c .)
echo "whole jobs done again: $again"
((again <= killed / 4)) || fail "whole jobs were done twice: $(sort done | uniq -d)"
passed
