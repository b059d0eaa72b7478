#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_view.sh OVERTAKE. The command `overtake view`: what it refuses, the address that it prints, the browser
# that it starts, the port, Ctrl-C. Exit code 77 if it was built without pages.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
readonly overtake=$(realpath "$1")
need view "tools/setup" python3
cd "$work" || exit 1
unset DISPLAY WAYLAND_DISPLAY

# refuse WORDS ARGUMENTS...: one sentence with WORDS, and nothing is served.
refuse() {
  local words=$1
  shift
  timeout 20 "$overtake" view "$@" >stdout 2>stderr
  local code=$?
  ((code == 1 || code == 2)) || fail "view $*: exit code $code"
  [[ $(cat stderr) == "overtake: "*"$words"* ]] || fail "view $*: not '$words' but: $(cat stderr)"
  [[ ! -s stdout ]] || fail "view $* prints $(cat stdout)"
}
expect "a log" "$overtake" simulate demo --seconds 0.2 --out race.mcap --quiet
expect "its view" "$overtake" run race.mcap --out run --mcap view.mcap --quiet
: >empty.mcap
echo "no log" >text.mcap
mkfifo pipe.mcap
refuse "nothing.mcap: no such file" nothing.mcap
refuse "empty.mcap: is empty (0 bytes)" empty.mcap
refuse "text.mcap: is not an MCAP file" text.mcap
refuse "run: is a folder" run
refuse "pipe.mcap: is a pipe" pipe.mcap
refuse "log is required" --no-open
refuse "--bind 0.0.0.0: lets everyone who reaches this address read the logs: say so with --insecure-bind" view.mcap --bind 0.0.0.0
refuse "--at now: is not a frame's stamp in ns" view.mcap --at now
refuse "--at -5: is not a frame's stamp in ns" view.mcap --at=-5
refuse "--port" view.mcap --port 70000
refuse "" view.mcap race.mcap text.mcap

timeout 1 "$overtake" view view.mcap --no-open >stdout 2>stderr
if grep -q 'has no pages to show: it was built without node' stderr; then
  [[ ! -s $work.failed ]] || exit 1
  echo "skipped: view: this overtake was built without node (tools/setup --node)"
  exit 77
fi

# serve ARGUMENTS...: starts it, and sets url and pid.
serve() {
  rm -f stdout
  "$overtake" view "$@" >stdout 2>stderr &
  pid=$!
  for ((i = 0; i < 200; ++i)); do
    [[ -s stdout ]] && break
    sleep 0.05
  done
  url=$(head -n 1 stdout)
}
# end SIGNAL: it ends with 130 and no word.
end() {
  kill -"$1" $pid
  wait $pid
  local code=$?
  ((code == 130)) || fail "after $1 the exit code is $code"
  [[ $(wc -l <stdout) == 1 && ! -s stderr ]] || fail "it prints more than the address: $(cat stdout stderr)"
}
fetch() {
  python3 - "$@" <<'PYTHON'
import sys, urllib.request
request = urllib.request.Request(sys.argv[1])
for header in sys.argv[2:]:
    request.add_header(*header.split(': ', 1))
sys.stdout.buffer.write(urllib.request.urlopen(request, timeout=20).read())
PYTHON
}

serve view.mcap race.mcap --no-open --at 1700000000000025378
[[ $url =~ ^http://127\.0\.0\.1:([0-9]+)/#at=1700000000000025378$ ]] || fail "the address is '$url'"
base=${url%#*} port=${BASH_REMATCH[1]:-0}
fetch "${base}log/0" | cmp - view.mcap || fail "/log/0 is not the first log"
fetch "${base}log/1" "Range: bytes=-1000" | cmp - <(tail -c 1000 race.mcap) || fail "/log/1 is not the second log"
fetch "${base}logs.json" | grep -q '"name":"view.mcap".*"name":"race.mcap"' || fail "logs.json: $(fetch "${base}logs.json")"
fetch "$base" | gunzip | grep -qi '<html' || fail "there is no page"
timeout 20 "$overtake" view view.mcap --no-open --port "$port" >stdout_2 2>stderr_2
(($? == 1)) && [[ $(cat stderr_2) == "overtake: port $port: is taken by another program; choose another one" ]] ||
  fail "a taken port: $(cat stdout_2 stderr_2)"
end INT

# Ctrl-C in the middle of a transfer.
cp view.mcap large.mcap && truncate -s 300M large.mcap
serve large.mcap --no-open --port "$port"
[[ $url == "http://127.0.0.1:$port/" ]] || fail "--port $port gives '$url'"
python3 - "$port" >transfer.txt <<'PYTHON' &
import socket, sys, time
port = sys.argv[1]
s = socket.create_connection(('127.0.0.1', int(port)), timeout=20)
s.sendall(f'GET /log/0 HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n'.encode())
got = len(s.recv(1000))
print('began', flush=True)
time.sleep(1)
try:
    while data := s.recv(1 << 20):
        got += len(data)
except ConnectionError:
    pass
print('ended', got < 300 << 20, flush=True)
PYTHON
reader=$!
for ((i = 0; i < 200; ++i)); do
  grep -qs began transfer.txt && break
  sleep 0.05
done
end INT
wait $reader
grep -q 'ended True' transfer.txt || fail "the transfer: $(cat transfer.txt)"
serve view.mcap --no-open
end TERM

# The browser.
mkdir bin
printf '%s\n' '#!/bin/sh' "echo \"\$@\" >>'$work/opened'" >bin/xdg-open
chmod +x bin/xdg-open
DISPLAY=:9 PATH=$work/bin:$PATH serve view.mcap
for ((i = 0; i < 200; ++i)); do
  [[ -s opened ]] && break
  sleep 0.05
done
[[ $(cat opened) == "$url" ]] || fail "the browser is called with '$(cat opened)', not '$url'"
end INT
rm opened
# One that stays: it holds neither the server nor its socket.
mkdir stays
printf '%s\n' '#!/bin/sh' "echo \$\$ >'$work/sleeper'" 'exec sleep 600' >stays/xdg-open
chmod +x stays/xdg-open
DISPLAY=:9 PATH=$work/stays:$PATH serve view.mcap
for ((i = 0; i < 200; ++i)); do
  [[ -s sleeper ]] && break
  sleep 0.05
done
[[ -s sleeper ]] || fail "the browser that stays was not started"
fetch "${url}logs.json" >/dev/null || fail "no answer beside a browser that stays"
port=${url##*:} port=${port%/}
end INT
kill -0 "$(cat sleeper)" || fail "the browser ends with the server"
serve view.mcap --no-open --port "$port"
[[ $url == "http://127.0.0.1:$port/" ]] || fail "a browser that stays holds port $port: $(cat stderr)"
end INT
kill "$(cat sleeper)"
DISPLAY=:9 PATH=$work/bin:$PATH serve view.mcap --no-open
fetch "${url}logs.json" >/dev/null
end INT
PATH=$work/bin:$PATH serve view.mcap # without a desktop
fetch "${url}logs.json" >/dev/null
end INT
[[ ! -e opened ]] || fail "--no-open, or a machine without a desktop, opens a browser"
passed
