#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_bench_latency.sh BENCH_LATENCY OVERTAKE. The program as users call it: its files, a recording as its
# input, exit codes. Exit code 0 is a pass.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
bench=$(realpath "${1:?usage: test_bench_latency.sh BENCH_LATENCY WRITE_SCENE}")
write_scene=$(realpath "${2:?}")
readonly bench overtake
cd "$work" || exit 1

"$bench" --frames 4 --warmup 1 --rate 5 --json --out run.json --hgrm run.hgrm >stdout 2>stderr || fail "a plain run: $(head -c 400 stderr)"
cmp -s stdout run.json || fail "--json and --out differ"
awk '/"end_to_end": / { here = 1 } here && /"p50_us": [0-9]/ { found = 1 } /}/ { here = 0 } END { exit !found }' run.json ||
  fail "no end_to_end.p50_us"
for file in run.hgrm run.hgrm.noise; do
  grep -q '^#\[Max     = .*Total count    = *[1-4]\]$' "$file" || fail "$file does not count up to four frames"
done

"$write_scene" scene 3 || fail "no scene"
"$bench" --input scene --rig av21 --map scene/map.csv --ego scene/ego.csv --loop closed --workers 1 --frames 5 --warmup 1 \
  >stdout 2>stderr || fail "a recording: $(head -c 400 stderr)"
grep -q '^input: recording, 3 frames of 3 sensors' stdout || fail "the recording is not named: $(grep '^input' stdout)"
grep -q '^  end to end  *5 ' stdout || fail "not five frames: $(grep '^  end to end' stdout)"

for usage in "--frames 0" "--cpus 1,x" "--loop round" "--loop closed --rate 30" "--loop closed --stagger-us 5" "fly" "--map scene/map.csv"; do
  # shellcheck disable=SC2086
  "$bench" $usage >stdout 2>stderr
  code=$?
  ((code == 2)) && [[ -s stderr && ! -s stdout ]] || fail "bench_latency $usage: exit code $code, not 2, or no word"
done
for failing in "--input nowhere" "--isa mmx --frames 1" "--cpus 1000 --frames 1"; do
  # shellcheck disable=SC2086
  "$bench" $failing >stdout 2>stderr
  code=$?
  ((code == 1)) && [[ $(wc -l <stderr) == 1 && $(cat stderr) == bench_latency:* ]] ||
    fail "bench_latency $failing: exit code $code, not 1, or not one line: $(head -c 400 stderr)"
done
passed "all checks of bench_latency passed"
