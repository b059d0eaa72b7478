# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# Sourced by tools/setup and tools/demo.
# shellcheck shell=bash

# show_progress NAME LOG: appends its input to LOG and shows lines that begin with [DONE/TOTAL] as progress: on a
# terminal one line that it rewrites, else one line per tenth.
show_progress() {
  local name=$1 log=$2 line count total tenth=0 begin=$SECONDS rest text=''
  while IFS= read -r line || [[ -n $line ]]; do
    printf '%s\n' "$line" >>"$log"
    [[ $line =~ ^\[([0-9]+)/([0-9]+)\] ]] || continue
    count=${BASH_REMATCH[1]} total=${BASH_REMATCH[2]}
    ((count > 0 && total > 0)) || continue
    rest=''
    if ((count < total && count * 10 >= total)); then
      rest=", about $(((SECONDS - begin) * (total - count) / count)) s to go"
    fi
    text="$name [$count/$total] $((SECONDS - begin)) s$rest"
    if [[ -t 1 ]]; then
      printf '\r%s\033[K' "$text"
    elif ((count * 10 / total > tenth)); then
      tenth=$((count * 10 / total))
      printf '%s\n' "$text"
    fi
  done
  if [[ -t 1 && -n $text ]]; then printf '\n'; fi
}
