#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: test_compare_baseline.sh
# tools/dev/compare_baseline: removed and rounded values are not in the base line, differences are reported, and making a base line
# from a base line changes nothing.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
need "base line" "tools/setup" python3
cd "$(dirname "$0")/.." || exit 1
readonly base=bench/results/evaluation_paper.json

# change CODE: changes the figures by some Python; `d` is the base line, `paper` its figures of las_vegas_15.
change() {
  python3 - "$base" "$work/metrics.json" <<END
import copy, json, sys
d = json.load(open(sys.argv[1]))
paper = [f for f in d['figures'] if f['contestant'] == 'paper' and f['scenario'] == 'las_vegas_15'][0]
$1
json.dump(d, open(sys.argv[2], 'w'), indent=1)
END
}
# compare CODE LINE [OPTION]: expects an exit code and a line of the table (a regular expression).
compare() {
  local code=0
  # shellcheck disable=SC2086
  tools/dev/compare_baseline compare ${3:-} "$work/metrics.json" >"$work/log" 2>&1 || code=$?
  ((code == $1)) || fail "compare: exit code $code, not $1: $(cat "$work/log")"
  grep -qE "$2" "$work/log" || fail "compare: no '$2' in $(cat "$work/log")"
}

change "
sweep = copy.deepcopy(paper)
sweep['contestant'] = 'paper@cluster.threshold_deg=1'
d['figures'].append(sweep)
d['runs'].append(dict(d['runs'][0], contestant=sweep['contestant']))
d['judgements'].append({'scenario': 'pit'})
paper['sweep_of_something'] = {'values': [1]}
paper['ground']['tpr'].update(min=0.0, max=1.0)
paper['ground']['tpr']['mean'] += 1e-9"
tools/dev/compare_baseline make "$work/metrics.json" >"$work/made.json" || fail "make"
cmp "$work/made.json" $base || fail "make: differs from the base line"
compare 0 '^0 headline numbers differ, 0 '

change "paper['tracking']['gospa_m']['mean'] *= 1.01; paper['tracking']['mota'] += 0.01; paper['nonsense'] = 1"
compare 1 '^paper +las_vegas_15 +GOSPA \[m\] .* worse$'
grep -q ' MOTA .* better$' "$work/log" || fail "compare: MOTA is not better: $(cat "$work/log")"
grep -q '^2 headline numbers differ, 2 ' "$work/log" || fail "compare: not two numbers: $(cat "$work/log")"
change "paper['tracking']['nees']['p75'] += 1"  # not a headline number
compare 0 '^0 headline numbers differ, 1 '
change "d['figures'] = [paper]"
compare 1 '^missing: paper on pit$'
compare 0 '1 of 17 figures compared$' --part
change "d['figures'] = []"
compare 2 'tools/dev/compare_baseline: .*holds nothing'
# Another preset: its own part, quality figures included; each preset is compared with its own base line.
change "
for f in d['figures'] + d['runs']:
    f['contestant'] = f['contestant'].replace('paper', 'other')
for j in d['judgements']:
    j['preset'] = 'other'
number = {'median': 0.1, 'p95': 1.0, 'count': 9}
d['quality'] = [{'contestant': name, 'scenario': 'las_vegas_15', 'detected_of_3_points': 0.5, 'detected_of_5_points': 0.5,
                 'false_detections': {'a_frame_anywhere': 0.5, 'a_frame_without_car': 0.25}, 'mixed_per_car': 0,
                 'ground': {'ppv_p5': 0.875}, 'centre_along_m': number, 'centre_across_m': number,
                 'in_95_ellipse': {'value': 0.9375}} for name in ('other', 'paper')]
spread = {'rms': 0.5, 'p95_of_size': 1.0}
pair = {'along_m': spread, 'across_m': spread}
d['track_quality'] = [dict(pair, contestant=name, scenario='las_vegas_15', course_rad=spread,
                           speed_mps={'all': spread, 'cruising': spread, 'braking': dict(spread, rms=0.625)},
                           position=[dict(pair, to_m=40.0)], paths=[{'horizon_s': 2.0, 'cruising': pair}],
                           confirmed_after_detectable={'median_s': 0.125, 'p99_s': 0.25, 'never': 0},
                           overtakes={'share': 1.0}, gaps={'share': None}, losses={'share': 1.0})
                      for name in ('other', 'paper')]"
tools/dev/compare_baseline make "$work/metrics.json" other >"$work/other.json" || fail "make of another preset"
grep -q '"command": ".* --preset other --seeds test' "$work/other.json" || fail "make: not the preset's command"
[[ $(grep -c '"in_95_ellipse"' "$work/other.json") == 1 ]] || fail "make: not the quality of the preset alone"
lines=$(grep -c '"contestant":"other"' "$work/other.json")
want=$(python3 -c "import json; d = json.load(open('$base')); print(sum(e['contestant'] == 'paper' for e in d['figures'] + d['runs']) + 2)")
((lines == want)) || fail "make: $lines lines of the preset, not $want"  # one of quality, one of track quality
sed -i 's/"detected_of_3_points": 0.5/"detected_of_3_points": 0.75/; s/"rms": 0.625/"rms": 0.75/' "$work/metrics.json"
code=0
tools/dev/compare_baseline compare "$work/metrics.json" "$work/other.json" >"$work/log" || code=$?
((code == 1)) || fail "compare of another preset: exit code $code"
grep -qE '^other +las_vegas_15 +detected of 3 points +0.5 +0.75 +better$' "$work/log" || fail "compare: no quality in $(cat "$work/log")"
grep -qE '^other +las_vegas_15 +speed, braking, rms +0.625 +0.75 +worse$' "$work/log" ||
  fail "compare: no track quality in $(cat "$work/log")"
# The pooled quality of some scenarios is not compared with that of all, and a missing quality is named.
python3 - "$work" <<END
import json, sys
for source, target in ('other', 'pooled'), ('metrics', 'part'):
    data = json.load(open(f'{sys.argv[1]}/{source}.json'))
    for q in data['quality'] + data['track_quality']:
        q['scenario'] = 'all'
    json.dump(data, open(f'{sys.argv[1]}/{target}.json', 'w'))
END
compare_pooled() {  # CODE METRICS [OPTION]
  local code=0
  # shellcheck disable=SC2086
  tools/dev/compare_baseline compare ${3:-} "$work/$2.json" "$work/pooled.json" >"$work/log" || code=$?
  ((code == $1)) || fail "compare ${3:-} $2: exit code $code: $(cat "$work/log")"
}
compare_pooled 0 part --part
compare_pooled 1 part
grep -qE '^other +all +detected of 3 points +0.5 +0.75 +better$' "$work/log" || fail "compare: no pooled quality in $(cat "$work/log")"
compare_pooled 1 metrics
grep -q '^missing: other on all$' "$work/log" || fail "compare: a missing quality is not named: $(cat "$work/log")"
compare 2 'holds nothing that a base line does'
change "
other = copy.deepcopy(paper)
other['contestant'] = 'other'
d['figures'].append(other)"
compare 0 '^0 headline numbers differ, 0 '  # a preset without a base line is left out
if tools/dev/compare_baseline make $base other >/dev/null 2>"$work/log"; then fail "make: a preset without runs"; fi
grep -q 'no run of other on las_vegas_15' "$work/log" || fail "make: does not say that the preset is missing: $(cat "$work/log")"
change "d['runs'][0]['about']['seed'] = '7'"
if tools/dev/compare_baseline make "$work/metrics.json" >/dev/null 2>"$work/log"; then fail "make: other seeds were accepted"; fi
grep -q 'was run with the seeds .*7' "$work/log" || fail "make: the seed is not named: $(cat "$work/log")"
change "d['runs'][0]['about']['commit'] = 'another'"
if tools/dev/compare_baseline make "$work/metrics.json" >/dev/null 2>"$work/log"; then fail "make: two commits were accepted"; fi
# Tables of two presets: what is worse is bold, what nobody measured is a dash.
python3 - bench/results/evaluation_best.json "$work/two.json" <<END
import copy, json, sys
d = json.load(open(sys.argv[1]))
d['figures'] = [f for f in d['figures'] if f['scenario'] in ('pit', 'empty_track', 'las_vegas_15')]
d['quality'] = [q for q in d['quality'] if q['scenario'] in ('pit', 'empty_track', 'las_vegas_15')]
for key in 'figures', 'quality':
    for entry in copy.deepcopy(d[key]):
        entry['contestant'] = 'other'
        if key == 'figures':
            entry['tracking'].update(mota=-0.25, switches=entry['tracking']['switches'] + 2)
        elif entry['scenario'] == 'pit':
            entry.update(detected_of_3_points=0.25, mixed_per_car=0)
        d[key].append(entry)
json.dump(d, open(sys.argv[2], 'w'))
END
tools/dev/compare_baseline tables "$work/two.json" best other >"$work/log" || fail "tables: $(cat "$work/log")"
for line in '^\| pit \| 0\.[0-9]{3}; \*\*0\.250\*\* \| ' '^\| pit \| [0-9.]+; \*\*-0\.25\*\* \| .* 0; \*\*2\*\* \| ' \
    '^\| empty_track \| -; - \| ' '^\| scenario \| MOTA \| '; do
  grep -qE "$line" "$work/log" || fail "tables: no '$line' in $(cat "$work/log")"
done
! grep -q las_vegas_15 "$work/log" || fail "tables: las_vegas_15 has a table of its own"
for bad in "make nope.json" "tables $base paper best" "compare tests/test_compare_baseline.sh"; do
  # shellcheck disable=SC2086
  tools/dev/compare_baseline $bad >/dev/null 2>"$work/log"
  (($? == 2)) && [[ $(wc -l <"$work/log") == 1 ]] || fail "$bad: no exit code 2, or no sentence: $(cat "$work/log")"
done
passed
