#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: test_bench_compare.sh
# tools/dev/bench_compare on programs that only pretend to measure: a slow-down beyond the limit fails, the ratios are those of
# one round, and the rows are appended.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
need "benchmarks" "tools/setup" python3 taskset
cd "$(dirname "$0")/.." || exit 1

# make_program BUILD PROGRAM BENCHMARK TIME: a program whose benchmark takes this many ns, in the next round twice as many,
# and so on.
make_program() {
  mkdir -p "$work/$1"
  cat >"$work/$1/$2" <<END
#!/bin/bash
n=\$(cat "$work/$1/$2.rounds" 2>/dev/null || echo 0)
echo \$((n + 1)) >"$work/$1/$2.rounds"
for word in "\$@"; do [[ \$word == --benchmark_out=* ]] && out=\${word#*=}; done
echo "{\"benchmarks\": [{\"name\": \"$3\", \"cpu_time\": \$(($4 * (n + 1))), \"time_unit\": \"ns\"}]}" >"\$out"
END
  chmod +x "$work/$1/$2"
}
make_build() { # NAME TIME
  make_program "$1" bench_kernels segment/avx512/x "$2"
  make_program "$1" bench_floor segment_floor/avx512/racecar_front 10
}
# compare CODE LINE NEW: expects an exit code and a line of the table (a regular expression).
compare() {
  local code=0
  rm -f "$work"/*/*.rounds
  tools/dev/bench_compare "$work/old" "$work/$3" --rounds 3 --core "$core" --history "$work/history.csv" >"$work/log" 2>&1 || code=$?
  ((code == $1)) || fail "$3: exit code $code, not $1: $(cat "$work/log")"
  grep -qE "$2" "$work/log" || fail "$3: no '$2' in $(cat "$work/log")"
}
core=$(taskset -cp $$ | sed 's/.*: *//; s/[-,].*//')
make_build old 1000
make_build near 1040
make_build far 1060
make_build fast 500

# A round later both builds and the floor take longer, but not their ratios: 1000 to 1040 to 10.
compare 0 '^segment/avx512/x +2[.]0 +2[.]1 +1[.]040 +1[.]040-1[.]040 +100[.]00 +104[.]00$' near
compare 1 '^slower by more than 5 %: segment/avx512/x$' far
compare 0 '^segment/avx512/x .* 0[.]500 ' fast
(($(wc -l <"$work/history.csv") == 4)) || fail "history: not a header and three rows: $(cat "$work/history.csv")"
grep -qE '^[0-9-]+,.*,old,far,segment/avx512/x,2[.]00,2[.]12,1[.]0600,100[.]000,106[.]000,3$' "$work/history.csv" ||
  fail "history: no row of the slow build: $(cat "$work/history.csv")"
passed
