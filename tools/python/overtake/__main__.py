# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
"""python -m overtake: the command line. Runs the program `overtake` of this package, else the installed one."""
import os
import shutil
import sys


def find_program():
    own = os.path.join(os.path.dirname(os.path.abspath(__file__)), "bin", "overtake")
    return own if os.access(own, os.X_OK) else shutil.which("overtake")


def main():
    program = find_program()
    if program is None:
        sys.exit("overtake: there is no program 'overtake' in this package or on the PATH (build with OVT_TOOLS=ON, or "
                 "install Debian's package overtake)")
    os.execv(program, ["overtake", *sys.argv[1:]])


if __name__ == "__main__":
    main()
