#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_python.sh NAME FOUND PYTHON BUILD_FOLDER PROGRAM. Runs tests/python/test_NAME.py with the package of
# BUILD_FOLDER. FOUND: whether CMake found what the package needs. OVERTAKE_PRELOAD: libraries of a sanitizer.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
readonly name=${1:?usage: test_python.sh NAME FOUND PYTHON BUILD_FOLDER PROGRAM}
readonly found=${2:-} python=${3:-} build=${4:-} program=${5:-}
skip() { echo "skipped: python_$name: $* (tools/setup --python)"; exit 77; }

[[ $found == TRUE ]] || skip "no python3-dev or pybind11-dev"
for module in numpy pytest; do
  "$python" -c "import $module" 2>/dev/null || skip "no python3-$module"
done
if [[ $name == notebook ]]; then
  "$python" -c 'import matplotlib, pandas' 2>/dev/null || skip "no python3-matplotlib or python3-pandas"
fi

source_folder=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
export OVERTAKE_SOURCE=$source_folder OVERTAKE_PROGRAM=$program OVERTAKE_BUILD=$build
export PYTHONPATH=$build/python PYTHONDONTWRITEBYTECODE=1 TMPDIR=$work
if [[ -n ${OVERTAKE_PRELOAD:-} ]]; then
  # The interpreter does not free everything at its end.
  export LD_PRELOAD=$OVERTAKE_PRELOAD ASAN_OPTIONS=detect_leaks=0
fi
"$python" -m pytest -q --no-header -p no:cacheprovider --basetemp="$work/pytest" -rs \
  "$source_folder/tests/python/test_$name.py" >"$work/log" 2>&1
code=$?
unset LD_PRELOAD
grep -E '^SKIPPED' "$work/log" | sed "s/^SKIPPED/skipped: python_$name:/"
if ((code != 0)); then
  fail "python_$name: $(tail -n 100 "$work/log")"
fi
passed "$(tail -n 1 "$work/log")"
