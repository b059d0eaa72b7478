#!/usr/bin/env python3
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/check_batches.py [-- TARGET FILE...]... Checks the names in unnamed namespaces of the files that
# OVT_UNITY compiles together: no two files of a target may share one. Two constants or types of one name would not
# compile. Of two functions with different parameters, a call might silently choose the other file's.
import collections
import os
import re
import sys

OPENS = re.compile(r'^namespace \{')
CLOSES = re.compile(r'^\}  // namespace$')
FUNCTION = re.compile(r'^(?!return|using|namespace|typedef|static_assert)(?:template <[^()]*>\s*)?'
                      r'[A-Za-z_][\w:<>,&*\s\[\]]*?[\s&*](\w+)\(')
TYPE = re.compile(r'^(?:struct|class|enum|enum class|union) (\w+)\b(?! *;)')
CONSTANT = re.compile(r'\b(k[A-Z]\w*)(?:\[[^\]]*\])*\s*[={]')


def names_of(path):
    """Names at the outermost level of the unnamed namespaces of a file."""
    found, inside, statement = set(), False, ''
    with open(path) as file:
        for line in file:
            line = re.sub(r'//.*', '', line) if not CLOSES.match(line) else line
            if OPENS.match(line):
                inside = True
            elif CLOSES.match(line):
                inside = False
            elif inside and line[:1] not in (' ', '\t', '\n', '}', '#', '"', ')'):
                type_ = TYPE.match(line)
                if type_:
                    found.add(type_.group(1))
                elif re.match(r'^(static |inline )*(const|constexpr)\b[^(]*[={]', line):
                    found.update(CONSTANT.findall(line))
                elif FUNCTION.match(line):
                    found.add(FUNCTION.match(line).group(1))
    return found


failed = 0
targets = [part.split('\n') for part in '\n'.join(sys.argv[1:]).split('--\n')[1:]]
for target, *files in targets:
    users = collections.defaultdict(list)
    for path in filter(None, files):
        for found in names_of(path):
            users[found].append(os.path.basename(path))
    for found, where in sorted(users.items()):
        if len(where) > 1:
            print(f'{target}: {found} is in the unnamed namespaces of {", ".join(where)}: rename one')
            failed += 1
    print(f'{target}: {len(users)} names in {len(files)} files')
    if not users:
        print(f'{target}: none found: this check is broken')
        failed += 1
if not targets:
    sys.exit('no targets')
sys.exit(failed > 0)
