#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: test_sweep_hour.sh OVERTAKE [SECONDS]
# A simulated hour (hour.toml; 18 GB in TMPDIR) evaluated whole and in six pieces with 30 s of warm-up: preset paper, which
# remembers nothing for longer, has the same figures (sums in another order: 1e-12); preset best has the same cars and
# frames, and figures that differ by what is remembered at five cuts (tools/evaluation/README.md, Pieces of a log).
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
overtake=$(realpath "${1:?usage: test_sweep_hour.sh OVERTAKE [SECONDS]}")
project=$(realpath "$(dirname "$0")/..")
readonly overtake project seconds=${2:-3600}
need test_sweep_hour "tools/setup --cluster" snakemake python3
cd "$work" || exit 1
free_mb=$(df -m --output=avail . | tail -n 1)
if ((free_mb < seconds * 6)); then
  echo "skipped: test_sweep_hour: $((seconds * 6)) MB are needed in $work, there are $free_mb"
  exit 77
fi
cat >whole.yaml <<END
overtake: $overtake
scenarios: [$project/tests/hour.toml]
seeds: [1]
seconds: $seconds
presets: [paper, best]
keep_logs: build
resources: {simulate: {threads: 2}}
END
sed "\$ a pieces: {seconds: $((seconds / 6)), warm_up: 30}" whole.yaml >pieces.yaml
sweep() { snakemake --snakefile "$project/tools/evaluation/Snakefile" --configfile "$1" --rerun-triggers mtime --cores 2 --directory out; }
expect "the whole" sweep whole.yaml
cp out/metrics.json whole.json
expect "the pieces" sweep pieces.yaml
[[ $(ls -d out/parts/*_from_* | wc -l) == 6 ]] || fail "not six pieces: $(ls out/parts)"
[[ $(ls out/logs) == "hour_1_${seconds}s.mcap" ]] || fail "the race was not kept: $(ls out/logs)"
python3 - whole.json out/metrics.json <<'END' || fail "the pieces differ from the whole"
import json
import sys
whole, joined = (json.load(open(path)) for path in sys.argv[1:])
differ = {}


def compare(a, b, preset, path):
    if isinstance(a, dict) and isinstance(b, dict) and a.keys() == b.keys():
        for key in a:
            compare(a[key], b[key], preset, path + [key])
    elif isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        for k, (x, y) in enumerate(zip(a, b)):
            compare(x, y, preset, path + [str(k)])
    elif a != b:
        number = isinstance(a, (int, float)) and isinstance(b, (int, float))
        differ.setdefault(preset, []).append((abs(a - b) if number else 1e9, a, b, '.'.join(path)))


for key in ('figures', 'judgements', 'quality', 'track_quality', 'runs'):
    for a, b in zip(whole[key], joined[key], strict=True):
        compare(a, b, a.get('contestant') or a.get('preset'), [key])
presets = [f['contestant'] for f in whole['figures']]
assert sorted(presets) == ['best', 'paper'], presets
print({preset: len(differ.get(preset, [])) for preset in presets}, 'figures differ')
for size, a, b, path in differ.get('paper', []):
    print('paper', path, a, b)
    assert size <= 1e-12 * abs(a), path
for a, b in zip(whole['figures'], joined['figures']):
    print(a['contestant'], *((k, a['tracking'][k], b['tracking'][k]) for k in ('objects', 'misses', 'false_positives', 'switches', 'fragments')))
    for key in ('frames', 'seconds'):
        assert a[key] == b[key], key
    for key in ('objects', 'cars_seen'):
        assert a['tracking'][key] == b['tracking'][key], key
    for key in ('misses', 'false_positives', 'switches', 'fragments'):  # five cuts
        assert abs(a['tracking'][key] - b['tracking'][key]) <= 25, key
    assert abs(a['tracking']['mota'] - b['tracking']['mota']) < 0.005
    assert abs(a['ground']['f1']['mean'] - b['ground']['f1']['mean']) < 0.01
END
passed
