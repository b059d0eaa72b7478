#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_live.sh OVERTAKE LIVE_VIEW. `overtake run --live` and the example of a vehicle: clients by @foxglove/ws-protocol decode every message, with
# either subprotocol; two at a time; one that stops reading, one that is killed, one that comes again: the results of the
# run are the same bytes as without. Exit code 77 if node or its modules are missing.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
readonly overtake=$(realpath "$1") live_view=$(realpath "$2")
readonly client=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/node/read_live.js
need "live run" "tools/setup --node" node
cd "$work" || exit 1
node "$client" >skip.txt 2>&1
grep -q '^skipped' skip.txt && { cat skip.txt; exit 77; }

expect "a log" "$overtake" simulate demo --seed 1 --seconds 3 --out race.mcap --quiet
expect "a run" "$overtake" run race.mcap --out alone --quiet

# live NAME ARGUMENTS...: starts a run; sets pid and port.
live() {
  local name=$1
  shift
  rm -f err.txt
  "$overtake" run race.mcap --out "$name" --live 0 "$@" >"$name.txt" 2>err.txt &
  pid=$!
  for ((i = 0; i < 400; ++i)); do
    port=$(sed -n 's|^overtake: live at http://127.0.0.1:\([0-9]*\)/ .*|\1|p' err.txt 2>/dev/null)
    [[ -n $port ]] && break
    sleep 0.02
  done
  [[ -n $port ]] || fail "$name: no address: $(cat err.txt)"
}
# ended NAME: the run ends well, with the results of a run without --live.
ended() {
  wait $pid
  local code=$?
  ((code == 0)) || fail "$1: exit code $code: $(cat err.txt)"
  for table in detections.csv tracks.csv; do
    cmp "alone/$table" "$1/$table" || fail "$1: $table differs from that of a run without --live"
  done
}
# watch FILE PROTOCOL MODE: a client in the background.
watch() { node "$client" "ws://127.0.0.1:$port" "$2" "$3" >"$1" 2>&1 & }
# seen FILE EXPRESSION: of the client's summary `s`.
seen() {
  node -e 'const s = JSON.parse(process.argv[1]); process.exit(eval(process.argv[2]) ? 0 : 1)' "$(tail -n 1 "$1")" "$2" ||
    fail "$1: not $2: $(tail -n 3 "$1" | head -c 2000)"
  grep FAILED "$1" && fail "$1"
}

live nobody --rate 20
ended nobody
grep -q '^note: live: 0 clients, 0 frames sent, 0 not sent to slow ones$' nobody.txt || fail "nobody: $(tail -n 2 nobody.txt)"

# Two clients by both subprotocols; the file of --mcap has the same messages beside them.
live two --rate 0.5 --live-clients 2 --mcap two.mcap
watch all.txt foxglove.sdk.v1 all
all=$!
watch numbers.txt foxglove.websocket.v1 numbers
ended two
wait $all $!
seen all.txt 's.order && s.connections === 1 && Object.keys(s.messages).length > 20'
seen all.txt '["/tf", "/map", "/truth", "/front/points", "/left/image/labels", "/tracks", "/detections", "/times", "/counters"].every((t) => s.messages[t] > 0)'
seen all.txt 's.messages["/map"] === 1 && s.messages["/front/points"] > 5'
seen numbers.txt 'Object.keys(s.messages).sort().join() === "/detections/numbers,/tracks/numbers"'
# 60 frames: the run held the second one until both had subscribed.
awk '/^note: live: 2 clients, / { given = $5 + $8 } END { exit given < 112 }' two.txt || fail "two: $(tail -n 1 two.txt)"
"$overtake" info two.mcap | awk '$1 == "/map" && $2 == 1 { ++map } $1 == "/times" && $2 == 60 { ++times } END { exit !(map && times) }' ||
  fail "the file beside a live run: $("$overtake" info two.mcap)"

# A client that stops reading, and one that is killed.
live stopped --rate 0.5 --live-clients 2
watch stall.txt foxglove.sdk.v1 stall
stall=$!
watch killed.txt foxglove.sdk.v1 all
killed=$!
for ((i = 0; i < 400; ++i)); do
  grep -qs 'first message' killed.txt && break
  sleep 0.02
done
kill -9 $killed
ended stopped
kill -9 $stall 2>/dev/null
grep -q 'first message' stall.txt || fail "the client that stops has seen nothing: $(cat stall.txt)"
dropped=$(sed -n 's/^note: live: 2 clients, [0-9]* frames* sent, \([0-9]*\) not sent to slow ones$/\1/p' stopped.txt)
((${dropped:-0} > 5)) || fail "frames not sent to a client that stops: $(tail -n 1 stopped.txt)"

# One that comes again.
live again --rate 0.5 --live-clients 1
watch twice.txt foxglove.websocket.v1 twice
ended again
wait $!
seen twice.txt 's.connections === 2 && s.messages["/map"] === 2 && s.messages["/front/points"] > 1'

# Ctrl-C as soon as the address is told (a shell's background jobs ignore it until the program asks for it), and of a
# run that goes on; a port that is taken.
live waiting --live-clients 1
kill -INT $pid
wait $pid
(($? == 130)) || fail "Ctrl-C of a run without its client: $(cat err.txt)"
live early --rate 0.1 --live-clients 1
timeout 20 "$overtake" run race.mcap --out late --live "$port" --quiet 2>late.txt && fail "a taken port is taken again"
grep -q "^overtake: port $port: is taken by another program" late.txt || fail "a taken port: $(cat late.txt)"
[[ ! -e late ]] || fail "a run that cannot be live leaves results"
watch early_client.txt foxglove.sdk.v1 all
for ((i = 0; i < 400; ++i)); do
  grep -qs 'first message' early_client.txt && break
  sleep 0.02
done
kill -INT $pid
wait $pid
(($? == 130)) || fail "Ctrl-C of a live run: $(cat err.txt)"
wait $!
seen early_client.txt 's.messages["/tf"] > 0'

# The same sink behind the callback of the C API.
: >vehicle.txt
"$live_view" 0 5 >vehicle.txt 2>&1 &
pid=$!
for ((i = 0; i < 400; ++i)); do
  port=$(sed -n 's|^http://127.0.0.1:\([0-9]*\)/$|\1|p' vehicle.txt)
  [[ -n $port ]] && break
  sleep 0.02
done
watch vehicle_client.txt foxglove.sdk.v1 all
wait $! $pid
grep -Eq '^1 clients, [1-9][0-9]* frames sent' vehicle.txt || fail "the example: $(cat vehicle.txt)"
seen vehicle_client.txt 's.messages["/front/points"] > 3 && s.messages["/tracks/numbers"] > 3 && s.messages["/front/image/labels"] > 3'
passed
