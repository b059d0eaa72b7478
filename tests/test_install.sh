#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_install.sh BUILD_FOLDER CC CXX [HARDENED]. Tests what a user gets: installs the build to a folder,
# moves the folder, builds the examples there twice, by CMake and by hand with pkg-config, and runs them. HARDENED 1:
# the build claims to be hardened (OVT_HARDEN in an optimised build).
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
export CMAKE_GENERATOR=Ninja  # the default generator needs make, which tools/setup does not install
build=$(realpath "${1:?usage: test_install.sh BUILD_FOLDER CC CXX [HARDENED]}")
readonly build cc=${2:?} cxx=${3:?} hardened=${4:-0}
readonly strict=(-pedantic -Wall -Wextra -Wconversion -Wshadow -Werror)
unset CMAKE_PREFIX_PATH PKG_CONFIG_PATH LD_LIBRARY_PATH

expect install cmake --install "$build" --prefix "$work/first" || exit 1
mv "$work/first" "$work/moved"
readonly prefix=$work/moved
library=$(find "$prefix" -name libovertake.so.0)
readonly libdir=${library%/*}
for file in include/overtake/overtake.h include/overtake/overtake.hpp include/overtake/columns.def bin/overtake \
  share/man/man1/overtake.1 share/man/man1/overtake-run.1 share/bash-completion/completions/overtake \
  share/zsh/site-functions/_overtake share/zsh/vendor-completions/_overtake \
  share/overtake/rigs/av21.toml share/doc/overtake/copyright share/doc/overtake/examples/poll_tracks.c; do
  [[ -f $prefix/$file ]] || fail "$file is not installed"
done
readonly docs=$prefix/share/doc/overtake
links=0
while IFS= read -r document; do  # every link in the documents leads to an installed file
  while IFS= read -r link; do
    links=$((links + 1))
    [[ -e $(dirname "$document")/$link ]] || fail "${document#"$docs"/} links to $link, which is not installed"
  done < <(grep -o '](\([^)#]*\))' "$document" | sed 's/^](//; s/)$//' | grep -v '://')
done < <(find "$docs" -name '*.md')
((links >= 20)) || fail "$links links in the installed documents"
for word in 'azimuth_left_deg = ' '/SENSOR/points' 'it seems to be turned as the rig says'; do
  grep -qF -- "$word" "$docs/tools/io/README.md" || fail "the format of rigs or logs is not installed"
done
[[ $(find "$prefix/include" -type f | wc -l) == 3 ]] ||
  fail "headers of our own are installed: $(find "$prefix/include" -type f)"
[[ $(readlink "$libdir/libovertake.so") == libovertake.so.0 ]] || fail "libovertake.so is no link to libovertake.so.0"

# The installed files name no library inside ours, and no path of this machine.
texts=("$prefix"/include/overtake/* "$libdir"/cmake/overtake/overtake-{shared,config}*.cmake)
[[ -f $libdir/libovertake.a ]] || texts+=("$libdir"/pkgconfig/*)      # users of the static library do need oneTBB
! grep -niE 'tbb|eigen|xsimd' "${texts[@]}" || fail "a library inside shows in the interface"
! grep -nF -e "$build" -e "$work" "${texts[@]}" || fail "a path of this machine is installed"

# ---- hardened: no lazy symbol resolution, read-only relocated data, guarded stack and copies
if ((hardened)); then
  for file in "$libdir/libovertake.so.0" "$prefix/bin/overtake"; do
    dynamic=$(readelf -dW "$file") segments=$(readelf -lW "$file") symbols=$(readelf -W --dyn-syms "$file")
    grep -qE 'FLAGS_1.*\bNOW\b' <<<"$dynamic" || fail "$file: symbols are resolved lazily (no -z now)"
    grep -q 'GNU_RELRO' <<<"$segments" || fail "$file: relocated data stays writable (no -z relro)"
    grep -qE 'GNU_STACK.* RW ' <<<"$segments" || fail "$file: the stack is executable"
    grep -q ' UND __stack_chk_fail' <<<"$symbols" || fail "$file: no stack protector"
    grep -qE ' UND __[a-z]+_chk\b' <<<"$symbols" || fail "$file: no checked copies (_FORTIFY_SOURCE)"
    ! grep -q TEXTREL <<<"$dynamic" || fail "$file: code is relocated"
  done
  grep -qE 'FLAGS_1.*\bPIE\b' <<<"$(readelf -dW "$prefix/bin/overtake")" || fail "overtake does not move (no PIE)"
fi

# ---- the command line and its rigs
expect "overtake --version" "$prefix/bin/overtake" --version
expect "overtake simulate" "$prefix/bin/overtake" simulate demo --seconds 0.1 --out "$work/scene" --quiet
readonly rig=$prefix/share/overtake/rigs/av21.toml
expect "overtake run" "$prefix/bin/overtake" run "$work/scene" --rig "$rig" --out "$work/run" --quiet
[[ -s $work/run/tracks.csv ]] || fail "the installed overtake wrote no tracks.csv"

# ---- CMake: find_package finds it by prefix alone
examples=$prefix/share/doc/overtake/examples
env CC="$cc" CXX="$cxx" cmake -S "$examples" -B "$work/cmake" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_C_FLAGS="${strict[*]}" -DCMAKE_CXX_FLAGS="${strict[*]}" >"$work/log" 2>&1 ||
    fail "cmake: $(tail -n 30 "$work/log")"
expect "build by CMake" cmake --build "$work/cmake" --parallel 2
for example in poll_tracks on_frame producers; do
  expect "$example by CMake" "$work/cmake/$example"
  [[ $(ldd "$work/cmake/$example") == *"$(realpath "$libdir")/libovertake.so.0"* ]] ||
    fail "$example does not use the installed library"
  ! readelf -dW "$work/cmake/$example" | grep NEEDED | grep -i tbb || fail "$example names oneTBB"
done

# find_package rejects a version that does not fit.
for version in 0.9 1.0; do
  mkdir -p "$work/wrong"
  printf 'cmake_minimum_required(VERSION 3.16)\nproject(wrong C)\nfind_package(overtake %s REQUIRED)\n' $version \
    >"$work/wrong/CMakeLists.txt"
  cmake -S "$work/wrong" -B "$work/wrong/$version" -DCMAKE_PREFIX_PATH="$prefix" >"$work/log" 2>&1 &&
    fail "find_package(overtake $version) is content"
  grep -q 'version: 0\.[0-9.]*$' "$work/log" ||
    fail "find_package(overtake $version) does not say what there is: $(cat "$work/log")"
done

# ---- pkg-config and plain compilers
if command -v pkg-config >/dev/null; then
  export PKG_CONFIG_PATH=$libdir/pkgconfig
  expect "pkg-config" pkg-config --exists --print-errors 'overtake >= 0.2'
  read -ra cflags <<<"$(pkg-config --cflags overtake)"
  read -ra libs <<<"$(pkg-config --libs overtake)"
  for example in poll_tracks on_frame; do
    expect "$cc $example" "$cc" -std=c99 "${strict[@]}" "${cflags[@]}" -o "$work/$example" "$examples/$example.c" \
      "${libs[@]}" -lm
  done
  expect "$cxx producers" "$cxx" -std=c++20 "${strict[@]}" "${cflags[@]}" -o "$work/producers" \
    "$examples/producers.cpp" "${libs[@]}" -pthread
  for example in poll_tracks on_frame producers; do
    expect "$example by pkg-config" env LD_LIBRARY_PATH="$libdir" "$work/$example"
  done
  alone=("${strict[@]}" "${cflags[@]}" -fsyntax-only -include overtake/overtake.h)
  for standard in c99 c11; do
    expect "$standard" "$cc" -std=$standard "${alone[@]}" -x c /dev/null
  done
  for standard in c++17 c++20; do
    expect "$standard" "$cxx" -std=$standard "${alone[@]}" -x c++ /dev/null
  done
else
  echo "skipped: install: the part that needs pkg-config (tools/setup --dev)"
fi

passed "installed, moved, built on and run"
