#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_setup.sh. How our tools use third-party software and shared folders, tested with substitutes for
# npm, dpkg-query and the compiler: tools/setup --node installs the content of the lock files and runs no package
# scripts; the lock files are complete and name no registry; tools/dev/fuzz opens no file in the temporary folder that may be
# a link.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
readonly project=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly node_folders=(tests/node tools/view/web)

# stand_in NAME LINE...: puts a program of this name on the PATH.
mkdir -p "$work/bin" "$work/tree/tests/node" "$work/tree/build" "$work/tmp"
stand_in() {
  local name=$1
  shift
  printf '%s\n' '#!/bin/bash' "$@" >"$work/bin/$name"
  chmod +x "$work/bin/$name"
}
export PATH=$work/bin:$PATH

# ---- npm
# shellcheck disable=SC2016
stand_in npm 'echo "$PWD: $*" >>"$SEEN"'
stand_in dpkg-query 'echo installed'
stand_in apt-get 'exit 1'
(cd "$project" && tar -c --exclude=node_modules tools) | tar -x -C "$work/tree"
cp "$project"/tests/node/*.json "$work/tree/tests/node"
SEEN=$work/seen expect "tools/setup --node" "$work/tree/tools/setup" --node
for folder in "${node_folders[@]}"; do
  echo "$(realpath "$work/tree/$folder"): ci --ignore-scripts --no-audit --no-fund"
  mkdir -p "$work/tree/$folder/node_modules"
  touch -d '+1 minute' "$work/tree/$folder/node_modules/.package-lock.json"
done >"$work/wanted"
cmp -s "$work/wanted" "$work/seen" || fail "tools/setup --node calls npm as: $(cat "$work/seen")"
: >"$work/seen"
SEEN=$work/seen expect "tools/setup --node once more" "$work/tree/tools/setup" --node
[[ ! -s $work/seen ]] || fail "what is installed is installed again"

# ---- the lock files
for folder in "${node_folders[@]}"; do
  lock=$project/$folder/package-lock.json
  packages=$(grep -c '^    "node_modules/' "$lock") whole=$(grep -c '^      "integrity": "sha512-' "$lock")
  ((packages > 9 && packages == whole)) || fail "$packages packages in $folder/package-lock.json, $whole with a checksum"
  grep -n '"resolved"' "$lock" && fail "$lock names a registry"
  # esbuild's script only replaces its launcher by the program of the platform's package.
  scripts=$(grep -B 12 'hasInstallScript' "$lock" | sed -n 's|^    "node_modules/\(.*\)": {|\1|p' | tail -n 1)
  [[ -z $scripts || $scripts == esbuild ]] || fail "$scripts wants to run a script"
  (($(grep -c hasInstallScript "$lock") <= 1)) || fail "several packages of $folder want to run scripts"
  while read -r name version; do
    grep -A 1 "^    \"node_modules/$name\": {" "$lock" | grep -q "\"version\": \"$version\"" ||
      fail "$lock has another version of $name than package.json ($version)"
  done < <(sed -n '/ependencies"/,/}/s/^ *"\(.*\)": "\([0-9.]*\)",*$/\1 \2/p' "$project/$folder/package.json")
done

# ---- every script says what it does
for script in "$project"/tools/{setup,demo,test} "$project"/tools/dev/*; do
  [[ $script == *progress.sh || $script == *.txt || -d $script ]] && continue  # read by other scripts
  "$script" --help >"$work/help" 2>"$work/error" && grep -qi '^usage: ' "$work/help" ||
    fail "$script --help: $(head -c 300 "$work/help" "$work/error")"
done

# ---- an option without its value
for call in "bench --core" "bench --filter" "bench --build" "latency --cpus" "latency --runs" "soak --frames" \
  "soak --workers" "fuzz --runs" "../test --jobs"; do
  # shellcheck disable=SC2086
  "$project/tools/dev/"$call >"$work/log" 2>&1 && fail "tools/dev/$call was taken"
  [[ $(head -n 1 "$work/log") == tools/*": ${call#* } needs a value" ]] || fail "tools/dev/$call: $(cat "$work/log")"
done

# ---- tools/dev/fuzz
mkdir -p "$work/lib"
touch "$work/lib/libclang_rt.fuzzer-x86_64.a"
stand_in clang++-14 "echo '$work/lib/libclang_rt.fuzzer-x86_64.a'"
stand_in cmake 'exit 0'
echo precious >"$work/victim"
ln -s "$work/victim" "$work/tmp/overtake_fuzz_$(cd "$work/tree" && pwd | cksum | cut -d' ' -f1).lock"
TMPDIR=$work/tmp expect "tools/dev/fuzz --build-only" "$work/tree/tools/dev/fuzz" --build-only
[[ $(cat "$work/victim") == precious ]] || fail "tools/dev/fuzz writes through a link in the temporary folder"
[[ $(find "$work/tmp" -mindepth 1 | wc -l) == 1 ]] || fail "tools/dev/fuzz leaves something: $(ls "$work/tmp")"

passed "all checks of the tools passed"
