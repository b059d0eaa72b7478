#!/usr/bin/env python3
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/check_includes.py [FOLDER...]. Checks that a C++ file reaches, through its own includes, a header for
# each function and type of the project that it names with a namespace (io::counted): alone it would not compile otherwise, though with
# OVT_UNITY another file of its batch may have included the header.
import functools
import os
import re
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
FOLDERS = sys.argv[1:] or ['core', 'kernels', 'pipeline', 'bench', 'tests', 'tools']
INCLUDE = re.compile(r'^\s*#\s*include "([^"]+)"', re.M)
IGNORED = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|^\s*#\s*include[^\n]*', re.S | re.M)
FUNCTION = re.compile(r'^(?!return|using|namespace|typedef|static_assert|#)(?:\[\[\w+\]\] |inline |constexpr |extern )*'
                      r'[A-Za-z_][\w:<>,&*\s]*?[\s&*](\w+)\(', re.M)
TYPE = re.compile(r'^(?:struct|class|enum class|enum|union) (?:\[\[\w+\]\] )?(\w+)\b', re.M)
QUALIFIED = re.compile(r'\b(\w+)::(\w+)')
NAMESPACE = re.compile(r'^namespace overtake((?:::\w+)+)', re.M)


@functools.lru_cache(None)
def text_of(path):
    with open(path, encoding='utf-8') as file:
        return file.read()


@functools.lru_cache(None)
def code_of(path):
    return IGNORED.sub(' ', text_of(path))


@functools.lru_cache(None)
def words_of(path):
    return frozenset(re.findall(r'\w+', code_of(path)))


def included_by(path):
    for name in INCLUDE.findall(text_of(path)):
        for folder in (ROOT, os.path.dirname(path)):
            if os.path.isfile(os.path.join(folder, name)):
                yield os.path.normpath(os.path.join(folder, name))
                break


def reached_from(path):
    reached, new = set(), [path]
    while new:
        for header in included_by(new.pop()):
            if header not in reached:
                reached.add(header)
                new.append(header)
    return reached


files = [os.path.join(folder, name) for top in FOLDERS for folder, _, names in os.walk(os.path.join(ROOT, top))
         for name in sorted(names) if name.endswith(('.h', '.hpp', '.cpp'))]
spaces = {name.split('::')[-1] for path in files for name in NAMESPACE.findall(text_of(path))}
declared = {}  # name: the headers that declare it
for path in files:
    if path.endswith(('.h', '.hpp')):
        for pattern in (FUNCTION, TYPE):
            for name in pattern.findall(code_of(path)):
                declared.setdefault(name, set()).add(os.path.relpath(path, ROOT))
failed = checked = 0
for path in files:
    known = set().union(*(words_of(header) for header in reached_from(path)))
    used = {name for space, name in QUALIFIED.findall(code_of(path)) if space in spaces and name in declared}
    checked += len(used)
    for name in sorted(used - known):
        if os.path.relpath(path, ROOT) not in declared[name]:
            print(f'{os.path.relpath(path, ROOT)}: {name} is declared in {", ".join(sorted(declared[name]))}, not included')
            failed += 1
print(f'{checked} names in {len(files)} files')
if checked == 0:
    print('none found: this check is broken')
sys.exit(failed > 0 or checked == 0)
