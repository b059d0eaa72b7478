#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_subproject.sh SOURCE_FOLDER CC CXX. Overtake inside another project, by FetchContent (which uses
# add_subdirectory): overtake::overtake as if installed; our tests, tools, install rules and flags do not reach the
# other project. And the installed static library in a C program. Two builds of the library without optimisation.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
export CMAKE_GENERATOR=Ninja  # the default generator needs make, which tools/setup does not install
source_dir=$(realpath "${1:?usage: test_subproject.sh SOURCE_FOLDER CC CXX}")
readonly source_dir cc=${2:?} cxx=${3:?}
export CC=$cc CXX=$cxx
options=(-DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0)
if command -v ninja >/dev/null; then options+=(-G Ninja); fi
if command -v ccache >/dev/null; then options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi

mkdir "$work/theirs"
cat >"$work/theirs/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.16)
project(theirs LANGUAGES C CXX)
include(FetchContent)
FetchContent_Declare(overtake SOURCE_DIR $source_dir)
FetchContent_MakeAvailable(overtake)
add_executable(theirs $source_dir/tools/examples/poll_tracks.c)
target_link_libraries(theirs PRIVATE overtake::overtake m)
foreach(foreign overtake_tests bench_kernels ovt_cli)
  if(TARGET \${foreign})
    message(FATAL_ERROR "\${foreign} is built in another's project")
  endif()
endforeach()
END
if expect "configure" cmake -S "$work/theirs" -B "$work/build" "${options[@]}" -DCMAKE_EXPORT_COMPILE_COMMANDS=ON &&
  expect "build" cmake --build "$work/build" --target theirs --parallel 2; then
  expect "their program" "$work/build/theirs"
  [[ $(ldd "$work/build/theirs") == *'libovertake.so.0 => '*/build/* ]] || fail "it does not use the library built with it"
  command=$(grep '"command"' "$work/build/compile_commands.json" | grep 'poll_tracks.c')
  [[ -n $command ]] || fail "no command compiles poll_tracks.c"
  [[ $command != *-ffp-contract* && $command != *-Werror* && $command != *"-I$source_dir "* ]] ||
    fail "flags of ours: $command"
  expect "install" cmake --install "$work/build" --prefix "$work/theirs_installed"
  [[ -z $(find "$work/theirs_installed" -name 'overtake*' 2>/dev/null) ]] || fail "their install installs ours"
fi

if expect "configure with OVT_STATIC" cmake -S "$source_dir" -B "$work/static" "${options[@]}" -DOVT_STATIC=ON \
  -DOVT_TOOLS=OFF -DOVT_TESTS=OFF -DOVT_BENCH=OFF &&
  expect "build the static library" cmake --build "$work/static" --parallel 2 &&
  expect "install it" cmake --install "$work/static" --prefix "$work/prefix"; then
  mkdir "$work/user"
  cat >"$work/user/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.16)
project(user LANGUAGES C CXX)
find_package(overtake 0.2 REQUIRED COMPONENTS static)
add_executable(user $source_dir/tools/examples/poll_tracks.c)
set_target_properties(user PROPERTIES LINKER_LANGUAGE CXX)
target_link_libraries(user PRIVATE overtake::overtake_static m)
END
  expect "configure on it" cmake -S "$work/user" -B "$work/user/build" -DCMAKE_PREFIX_PATH="$work/prefix" &&
    expect "build on it" cmake --build "$work/user/build" && expect "run on it" "$work/user/build/user"
  ! ldd "$work/user/build/user" | grep libovertake || fail "the static library is not static"
  if command -v pkg-config >/dev/null; then
    pc=$(dirname "$(find "$work/prefix" -name overtake.pc)")
    read -ra flags <<<"$(PKG_CONFIG_PATH=$pc pkg-config --static --cflags --libs overtake)"
    expect "by pkg-config --static" "$cc" -std=c99 -o "$work/plain" "$source_dir/tools/examples/poll_tracks.c" \
      "${flags[@]/-lovertake/-l:libovertake.a}" -lm && expect "run it" "$work/plain"
  fi
fi

passed "built inside another project, and as a static library"
