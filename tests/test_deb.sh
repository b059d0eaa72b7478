#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_deb.sh BUILD_FOLDER CC. cpack's Debian packages: their dependencies are this system's package names.
# dpkg installs them into an empty root (with this system's package database, so that it checks the dependencies). From
# there the command line, a program built with the library and the Python package run. This system does not change.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
build=$(realpath "${1:?usage: test_deb.sh BUILD_FOLDER CC}")
readonly build cc=${2:?}
need deb "tools/setup --dev" cmake dpkg dpkg-deb dpkg-shlibdeps fakeroot file pkg-config
make_deb=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/tools/install/make_deb.cmake
readonly make_deb

# The README's command, after building the package's content.
grep -q -e '--target deb' tools/examples/README.md || fail "tools/examples/README.md does not say how the package is made"
[[ $(cmake --build "$build" --target help) == *$'\n'deb:* ]] || fail "there is no target deb"
pack() { env "$@" cmake -D CONFIG="$build/CPackConfig.cmake" -D OUT="$work/packages" -P "$make_deb"; }
expect "make_deb.cmake" pack || exit 1
of_package() {      # the file of package $1
  local files=("$work"/packages/"$1"_*.deb)
  [[ ${#files[@]} == 1 && -f ${files[0]} ]] && echo "${files[0]}"
}
library_deb=$(of_package libovertake0) && dev_deb=$(of_package libovertake-dev) && deb=$(of_package overtake) ||
  { fail "cpack did not make libovertake0, libovertake-dev and overtake: $(ls "$work/packages")"; exit 1; }
readonly library_deb dev_deb deb

version=$(dpkg-deb --field "$deb" Version)
depends=$(dpkg-deb --field "$deb" Depends)
depends_library=$(dpkg-deb --field "$library_deb" Depends)
for package in libc6 libstdc++6 libtbb; do
  [[ $depends == *"$package"* ]] || fail "overtake does not depend on $package: $depends"
  [[ $depends_library == *"$package"* ]] || fail "libovertake0 does not depend on $package: $depends_library"
done
[[ $depends == *libembree* && $depends_library != *libembree* && $depends_library != *libpng* ]] ||
  fail "the library depends on what only the tools need: $depends_library"
[[ $depends$depends_library != *-dev* && $depends$depends_library != *eigen* ]] ||
  fail "depends on a package that only a build needs: $depends, $depends_library"
[[ $(dpkg-deb --field "$dev_deb" Depends) == *"libovertake0 (= $version)"* ]] ||
  fail "libovertake-dev: $(dpkg-deb --field "$dev_deb" Depends)"
for file in "$library_deb" "$dev_deb" "$deb"; do
  [[ $(dpkg-deb --field "$file" Architecture) == "$(dpkg --print-architecture)" ]] || fail "wrong architecture: $file"
  package=$(dpkg-deb --field "$file" Package)
  dpkg-deb --contents "$file" >"$work/contents"
  grep -q " ./usr/share/doc/$package/copyright\$" "$work/contents" || fail "$package has no copyright file"
done
dpkg-deb --contents "$library_deb" >"$work/contents"
! grep -E '/(include|bin|cmake|pkgconfig|share/overtake)/|\.so ->' "$work/contents" >"$work/log" ||
  fail "libovertake0 has files of other packages: $(cat "$work/log")"
dpkg-deb --contents "$deb" >"$work/contents"
for path in bin/overtake share/overtake/rigs share/doc/overtake/tools/evaluation/README.md \
            share/doc/overtake/tools/io/formats.def share/man/man1/overtake-run.1 share/overtake/evaluation/Snakefile share/overtake/evaluation/sweep share/overtake/ros2/overtake_msgs/package.xml; do
  grep -q " ./usr/$path" "$work/contents" || fail "overtake has no $path"
done
expect control dpkg-deb --control "$library_deb" "$work/control"
grep -qx 'libovertake 0 libovertake0 (>= [0-9.]*)' "$work/control/shlibs" ||
  fail "packages built on it would not know: $(cat "$work/control/shlibs")"
grep -q ldconfig "$work/control/triggers" "$work"/control/post* 2>/dev/null || fail "no ldconfig after installing the library"

# Without the programs it needs, it reports how to get them.
mkdir "$work/few"
ln -s "$(command -v cmake)" "$work/few/cmake"
! pack PATH="$work/few" >"$work/log" 2>&1 || fail "packs without file and dpkg-shlibdeps"
grep -q 'needs file, dpkg-shlibdeps: run tools/setup --package' "$work/log" || fail "the message does not name the missing programs: $(cat "$work/log")"

# ---- dpkg installs the package into a separate root
readonly root=$work/root
mkdir -p "$root"/var/lib/dpkg/{info,updates,triggers} "$root"/etc "$work/bin"
cp /var/lib/dpkg/status "$root/var/lib/dpkg/status"
sed -i -E '/^Package: (overtake|libovertake0|libovertake-dev|python3-overtake)$/,/^$/d' "$root/var/lib/dpkg/status"
printf '#!/bin/sh\nexec /sbin/ldconfig -C "%s" -f /dev/null -n "%s"\n' "$root/etc/ld.so.cache" "$root/usr/lib" \
  >"$work/bin/ldconfig"
chmod +x "$work/bin/ldconfig"
dpkg_there() {
  PATH=$work/bin:$PATH:/sbin:/usr/sbin fakeroot dpkg --root="$root" --log=/dev/null --force-not-root \
    --force-script-chrootless "$@"
}
dpkg_there --install "$dev_deb" >"$work/log" 2>&1 && fail "dpkg installs libovertake-dev without libovertake0"
dpkg_there --purge libovertake-dev >/dev/null 2>&1
expect "dpkg --install" dpkg_there --install "$library_deb" "$dev_deb" "$deb"
for package in libovertake0 libovertake-dev overtake; do
  grep -qx 'Status: install ok installed' <<<"$(dpkg_there --status $package 2>/dev/null)" ||
    fail "dpkg does not call $package installed"
  expect "dpkg --verify" dpkg_there --verify $package
  [[ -z $(cat "$work/log") ]] || fail "dpkg --verify $package: $(cat "$work/log")"
done

# ---- run it there
library=$(find "$root/usr/lib" -name libovertake.so.0)
readonly libdir=${library%/*}
expect "overtake --version" "$root/usr/bin/overtake" --version
expect "overtake simulate" "$root/usr/bin/overtake" simulate demo --seconds 0.1 --out "$work/scene" --quiet
expect "overtake run" "$root/usr/bin/overtake" run "$work/scene" --rig av21 --out "$work/run" --quiet
[[ -s $work/run/tracks.csv ]] || fail "the packaged overtake wrote no tracks.csv"
export PKG_CONFIG_PATH=$libdir/pkgconfig
read -ra flags <<<"$(pkg-config --cflags --libs overtake)"
readonly example=$root/usr/share/doc/overtake/examples/poll_tracks.c
expect "an example" "$cc" -std=c99 -o "$work/poll_tracks" "$example" "${flags[@]}" -lm
expect "the example" env LD_LIBRARY_PATH="$libdir" "$work/poll_tracks"
[[ $(readelf -SW "$libdir/libovertake.so.0") != *.debug_info* ]] || fail "the package holds the debug information"
for package in libovertake0 overtake; do
  [[ -n $(find "$work/packages" -name "$package-dbgsym_*.ddeb") ]] || fail "there is no package with the symbols of $package"
done

# ---- a program that was built needs the library alone
expect "dpkg --remove" dpkg_there --remove overtake libovertake-dev
[[ ! -e $root/usr/include && ! -e $root/usr/bin/overtake ]] || fail "removed, but left: $(find "$root/usr" -type f)"
expect "the example, with libovertake0 alone" env LD_LIBRARY_PATH="$libdir" "$work/poll_tracks"
expect "dpkg --install" dpkg_there --install "$deb"

# ---- the Python package, where it is built
python_debs=("$work"/packages/python3-overtake_*.deb)
if [[ -f ${python_debs[0]} ]]; then
  depends_python=$(dpkg-deb --field "${python_debs[0]}" Depends)
  for package in python3 python3-numpy "overtake (= $version)" libtbb; do
    [[ $depends_python == *"$package"* ]] || fail "python3-overtake does not depend on $package: $depends_python"
  done
  expect "dpkg --install python3-overtake" dpkg_there --install "${python_debs[0]}"
  there() { env PYTHONDONTWRITEBYTECODE=1 PYTHONPATH="$root/usr/lib/python3/dist-packages" PATH="$root/usr/bin:$PATH" "$@"; }
  expect "overtake.run" there /usr/bin/python3 -c "import overtake
frames = list(overtake.run('$work/scene', path_horizon_s=0))
assert len(frames) == 2 and overtake.__file__.startswith('$root'), frames"
  expect "python -m overtake" there /usr/bin/python3 -m overtake --version
  dpkg_there --remove overtake >"$work/log" 2>&1 && fail "dpkg removes overtake under python3-overtake"
  expect "dpkg --remove python3-overtake" dpkg_there --remove python3-overtake
else
  grep -q '^pybind11_DIR:PATH=/' "$build/CMakeCache.txt" && fail "there is no python3-overtake"
fi

expect "dpkg --remove" dpkg_there --remove overtake libovertake0
[[ ! -e $root/usr ]] || fail "removed, but left: $(find "$root/usr")"

# A missing dependency: dpkg refuses.
sed -i '/^Package: libtbb12$/,/^$/d' "$root/var/lib/dpkg/status"
dpkg_there --install "$deb" >"$work/log" 2>&1 && fail "dpkg installs it without libtbb12"
grep -q 'depends on libtbb12' "$work/log" || fail "dpkg does not miss libtbb12: $(cat "$work/log")"

passed "packaged, installed by dpkg, run, removed; Depends: $depends"
