#!/bin/sh
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# Searches the static libraries of a build for AVX code that a CPU without AVX could run by mistake.
set -eu
usage() {
  cat <<'EOF'
usage: tools/dev/check_isa_symbols.sh BUILD_FOLDER

Searches the static libraries of a build for AVX code that a CPU without AVX could run by mistake:
  - ymm or zmm registers outside the translation units of AVX (kernels_avx2, kernels_avx512), zmm in that of AVX2;
  - weak symbols in those units without the architecture in their names: the linker keeps one copy of each symbol for
    all units, possibly the one with AVX (clang's __clang_call_terminate has no vector code);
  - units without any register of their ISA: their kernels were not vectorised.
Prints every finding; exit code 1 if there is one. For x86-64 builds without -march=native.
EOF
}
case ${1:-} in
  -h | --help) usage; exit 0 ;;
  '' | -*) usage >&2; exit 2 ;;
esac
build=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
findings=0
report() {
  echo "$1"
  findings=$((findings + 1))
}

# registers OBJECT PATTERN: does its machine code name such a register?
registers() { objdump -d --no-show-raw-insn "$1" | grep -q "%$2[0-9]"; }

check_unit() { # OBJECT ARCHITECTURE_PATTERN REGISTER
  registers "$1" "$3" || report "$(basename "$1"): holds no $3 register"
  nm -C "$1" | sed -n 's/^[0-9a-f]* *[WVuwv] //p' | grep -v -e "xsimd::$2" -e simd_avx512_ -e __clang_call_terminate -e '^DW\.ref\.' >"$work/leaks" || true
  while read -r symbol; do
    report "$(basename "$1"): weak symbol of no ISA: $symbol"
  done <"$work/leaks"
}

find "$build" -name 'libovt*.a' >"$work/archives"
seen=0
while read -r archive; do
  members="$work/$(basename "$archive")"
  mkdir -p "$members"
  (cd "$members" && ar x "$(readlink -f "$archive" 2>/dev/null || echo "$OLDPWD/$archive")")
  for object in "$members"/*.o; do
    [ -e "$object" ] || continue
    name=$(basename "$object")
    case $name in
      kernels_sse2.*) seen=$((seen + 1)) ;;
      kernels_avx2.*) seen=$((seen + 1)); check_unit "$object" 'avx2\{0,1\}[^a-z0-9]' ymm ;;
      kernels_avx512.*) seen=$((seen + 1)); check_unit "$object" avx512 zmm ;;
    esac
    case $name in
      kernels_avx512.*) ;;
      kernels_avx2.*) if registers "$object" zmm; then report "$name: zmm registers"; fi ;;
      *) if registers "$object" '[yz]mm'; then report "$(basename "$archive")($name): AVX registers"; fi ;;
    esac
  done
done <"$work/archives"

[ "$seen" -eq 3 ] || report "$build: expected the units of sse2, avx2 and avx512 in libovt*.a, found $seen"
[ "$findings" -eq 0 ] || exit 1
echo "no AVX code outside its translation units ($(wc -l <"$work/archives") libraries)"
