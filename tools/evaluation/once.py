#!/usr/bin/env python3
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: once.py [--forget FOLDER] [--accept CODE] [KEPT OUTPUT [INPUT...] -- COMMAND...]
#
# Runs a job's command once, even if Snakemake is killed before it notes the end of the job: then Snakemake deletes
# OUTPUT and starts the job again. The command writes to the name that replaces its word OUT. In one step (a rename) its
# whole result is in KEPT, with the hash of the command and of its inputs. Then OUTPUT gets hard links to the result.
# If KEPT is of the same hash, OUTPUT gets the links alone. A job that reads the result forgets KEPT: by then the end of
# the job that wrote it is noted.
#
# A command that ends with an exit code other than 0 and CODE has no result. once.py then ends with that code, else with 0.
#
# A small INPUT counts by its content, another one by its size and time.
import hashlib
import os
import shutil
import subprocess
import sys

SMALL = 1 << 20
HASH = '.hash'


def fingerprint(command, inputs):
    found = hashlib.sha256('\0'.join(command).encode())
    for path in inputs:
        about = os.stat(path)
        if os.path.isfile(path) and about.st_size <= SMALL:
            with open(path, 'rb') as file:
                found.update(hashlib.sha256(file.read()).digest())
        else:
            found.update(f'{about.st_size} {about.st_mtime_ns}'.encode())
    return found.hexdigest()


def is_kept(kept, value):
    try:
        with open(os.path.join(kept, HASH)) as file:
            return file.read() == value
    except OSError:
        return False


def remove(path):
    if os.path.isdir(path) and not os.path.islink(path):
        shutil.rmtree(path, ignore_errors=True)
    elif os.path.lexists(path):
        os.remove(path)


def forget(kept):
    """A folder that is half deleted must not look whole."""
    part = kept + '.part'
    remove(part)
    try:
        os.rename(kept, part)
    except FileNotFoundError:
        return
    shutil.rmtree(part, ignore_errors=True)


def hand_over(result, output):
    """Hard links; where the file system has none, the result itself."""
    remove(output)
    os.makedirs(os.path.dirname(os.path.abspath(output)), exist_ok=True)
    try:
        if os.path.isdir(result):
            shutil.copytree(result, output, copy_function=os.link)
        else:
            os.link(result, output)
    except (OSError, shutil.Error):
        remove(output)
        os.rename(result, output)
    os.utime(output)  # not older than the inputs


def main(arguments):
    if arguments[0] == '--forget':
        forget(arguments[1])
        arguments = arguments[2:]
        if not arguments:
            return 0
    accepted = {0}
    if arguments[0] == '--accept':
        accepted.add(int(arguments[1]))
        arguments = arguments[2:]
    at = arguments.index('--')
    kept, output, inputs, command = arguments[0], arguments[1], arguments[2:at], arguments[at + 1:]
    value, part, name = fingerprint(command, inputs), kept + '.part', os.path.basename(output)
    if is_kept(kept, value) and os.path.lexists(os.path.join(kept, name)):
        print('done before an interruption')
    else:
        forget(kept)
        os.makedirs(part)
        code = subprocess.call([os.path.join(part, name) if word == 'OUT' else word for word in command])
        if code not in accepted:
            remove(part)
            return code if code > 0 else 128 - code
        with open(os.path.join(part, HASH), 'w') as file:
            file.write(value)
        os.rename(part, kept)
    hand_over(os.path.join(kept, name), output)
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
