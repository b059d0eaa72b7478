#!/usr/bin/env python3
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/check_manual.py PROGRAM MANUAL_FOLDER. The manual pages have every command, argument and option with the
# texts of --help, and the exit codes; the completions of bash and zsh propose commands, options and values; --version
# tells the same as text and as JSON.
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
faults = []


def expect(good, sentence):
    if not good:
        faults.append(sentence)


def run(*words, **more):
    return subprocess.run(words, capture_output=True, text=True, **more)


def plain(text):
    return " ".join(text.split())


def help_entries(text):
    """Names, type and text of each argument and option that a help lists."""
    entries = []
    for line in text.splitlines():
        entry = re.match(r"  (-\S+|[a-z_]+)(?: (\S.*?))?(?: {2,}(\S.*))?$", line)
        if entry:
            entries.append([entry[1], (entry[2] or "").strip(), entry[3] or ""])
        elif entries and line.startswith(" " * 20):
            entries[-1][2] = plain(entries[-1][2] + " " + line)
    return entries


def unroff(page):
    page = re.sub(r"\\f[BIR]", "", page).replace("\\-", "-").replace("\\&", "").replace("\\e", "\\")
    return plain(re.sub(r"^\.(TP|SH|PP|nf|fi)\b", "", page, flags=re.M))


# ---- manual pages
listing = run(program, "--help").stdout
commands = re.findall(r"^  ([a-z]+) {2,}\S", listing.split("Subcommands:")[1], re.M)
expect(len(commands) > 9, f"--help lists {commands}")
pages = {path.name for path in folder.glob("*.1")}
expect(pages == {"overtake.1"} | {f"overtake-{command}.1" for command in commands}, f"pages: {sorted(pages)}")
codes = {"0": "done", "1": "an error", "2": "a wrong command line", "3": "damaged", "130": "Ctrl-C"}
checked = 0
for command in ["", *commands]:
    words = [command] if command else []
    path = folder / ("-".join(["overtake", *words]) + ".1")
    made = run(program, "manual", *words)
    expect(made.returncode == 0 and made.stdout == path.read_text(), f"{path}: not what `overtake manual` prints")
    page = unroff(path.read_text())
    text = run(program, *words, "--help").stdout
    for names, kind, meaning in help_entries(text.split("Subcommands:")[0].split("Exit codes:")[0]):
        meaning = re.sub(r"(half of the machine's), [^)]*", r"\1", meaning)
        value = kind.replace("REQUIRED", "").replace("...", "").split("Needs:")[0].split("=")[0].strip()
        entry = plain(f"{names} {value}")
        expect(entry in page, f"{path.name} has no '{entry}'")
        expect(plain(meaning) in page and meaning, f"{path.name}: {names} has another text than --help: {meaning}")
        expect("REQUIRED" not in kind or re.search(re.escape(entry) + r"( \.\.\.)? \(required\)", page),
               f"{path.name}: {names} is not marked as required")
        checked += 1
    summary = text.splitlines()[0].rstrip(".")
    expect(f"- {summary}" in page, f"{path.name} does not begin with '{summary}'")
    for code, meaning in codes.items():
        expect(re.search(rf" {code} [^.]*{meaning}", page.split("EXIT STATUS")[-1]), f"{path.name}: exit code {code}")
    if shutil.which("man"):
        wide = {"MANWIDTH": "200", "LC_ALL": "C.UTF-8", "PATH": "/usr/bin:/bin"}
        shown = run("man", "--warnings", "-l", path, env=wide)
        expect(shown.returncode == 0 and not shown.stderr, f"man {path.name}: {shown.stderr}")
expect(checked > 80, f"only {checked} options of --help were found")
expect(run(program, "manual", "rnu").returncode == 1, "a manual page of a command that does not exist")
expect("did you mean 'run'" in run(program, "manual", "rnu").stderr, "no suggestion for a page")
expect(not re.search(r"[0-9.]+ GiB", (folder / "overtake.1").read_text()), "a page tells the memory of one machine")

# ---- bash
COMPLETE = """source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _overtake
printf '%s\\n' "${COMPREPLY[@]}" """


def complete(*words, cwd=None):
    done = run("bash", "-c", COMPLETE, "bash", folder.resolve() / "overtake.bash", "overtake", *words, cwd=cwd)
    expect(not done.stderr, f"completion of {words}: {done.stderr}")
    return done.stdout.split()


with tempfile.TemporaryDirectory() as place:
    pathlib.Path(place, "race 1.mcap").touch()
    pathlib.Path(place, "racetrack.csv").touch()
    for words, wanted in [((""), [*commands, "-h", "--help", "--version", "--max-memory"]),
                          (("si",), ["simulate"]), (("--max-memory", "4G", "ru"), ["run"]), (("scen",), []),
                          (("run", "--ri"), ["--rig"]),
                          (("run", "--rig", "ra"), ["racecar", "race", "1.mcap", "racetrack.csv"]),
                          (("run", "--rig", "=", "av"), ["av21", "av2"]),
                          (("run", "--set", "tracker.confirm"), ["tracker.confirm_hits="]),
                          (("run", "--capacity", "tr"), ["tracks="]), (("run", "--preset", ""), ["paper", "best"]),
                          (("simulate", "overta"), ["overtake"]), (("simulate", "--ego", ""), []),
                          (("simulate", "--pattern", ""), ["uniform", "gaussian", "horizon_dense"]),
                          (("run", "--workers", ""), []), (("info", "racet"), ["racetrack.csv"]),
                          (("run", "race", "--map", "racet"), ["racetrack.csv"])]:
        words = words or ("",)
        found = complete(*words, cwd=place)
        expect(found == wanted, f"bash completes {words} as {found}, not {wanted}")
    # Every option of every command.
    for command in commands:
        entries = help_entries(run(program, command, "--help").stdout)
        listed = {name for names, _, _ in entries for name in names.split(",") if name.startswith("-")}
        found = set(complete(command, "-"))
        expect(found == listed, f"bash completes the options of {command} as {found}")

# ---- zsh
if shutil.which("zsh"):
    expect(run("zsh", "-n", folder / "_overtake").returncode == 0, "_overtake is no valid zsh")
    # Lists completions in a pseudo-terminal.
    script = """
      zmodload zsh/zpty
      zpty shell zsh -f -i
      line() { local text; zpty -w shell "$1"; sleep 0.5; }
      line "PS1='$ '; fpath=($1 \\$fpath); autoload -Uz compinit; compinit -u -D"
      line "zstyle ':completion:*' menu no; LISTMAX=0; cd $2; echo re''ady"
      local text='' part
      while [[ $text != *ready* ]]; do zpty -r shell part || break; text+=$part; done
      zpty -w -n shell "$3"$'\\t\\t'
      zpty -w -n shell $'\\C-u'"echo do''ne"$'\\n'
      text=''
      while [[ $text != *[^\\']done* ]]; do zpty -r shell part || break; text+=$part; done
      print -r -- $text
      zpty -d shell
    """
    for words, wanted in [("overtake si", "simulate"), ("overtake run --ri", "--rig="),
                          ("overtake run --rig rac", "racecar"), ("overtake simulate overta", "overtake"),
                          ("overtake run --set=tracker.conf", "tracker.confirm_hits=")]:
        shown = run("zsh", "-f", "-c", script, "zsh", folder.resolve(), "/", words, timeout=60)
        expect(wanted in shown.stdout.replace("\r", ""), f"zsh completes '{words}' as {shown.stdout[-300:]!r}")
else:
    print("skipped: manual: no zsh (tools/setup --dev)")

# ---- --version
version = json.loads(run(program, "--version", "--json").stdout)
lines = run(program, "--version").stdout.splitlines()
expect(lines == [f"overtake {version['version']}", f"commit   {version['commit']}", f"compiler {version['compiler']}",
                 f"ISAs     {' '.join(version['isas'])}"], f"--version: {lines}, as JSON {version}")
wrong = run(program, "--json")
expect(wrong.returncode == 2 and "unknown option '--json'" in wrong.stderr, f"--json alone: {wrong.stderr}")

print("\n".join(faults) or f"{checked} arguments and options of {len(commands)} commands")
sys.exit(len(faults) > 0)
