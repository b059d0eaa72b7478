#!/usr/bin/env python3
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/check_layers.py [ROOT]. Each folder includes and links only what stands below it in LAYERS, so that no two
# libraries need each other; of tools, only what a stranger runs lies flat; and the top level is fixed.
import pathlib
import re
import sys

# A folder of sources: what its files may include, and its libraries link. Each stands below those that name it.
LAYERS = {
    'core': [],
    'kernels': ['core'],
    'pipeline': ['core', 'kernels'],
    'tools/io': ['core'],
    'tools/sim': ['tools/io'],
    'tools/client': ['core', 'pipeline', 'tools/io'],
    'tools/view': ['core', 'pipeline', 'tools/io', 'tools/sim', 'tools/client'],
    'tools/serve': ['core', 'pipeline', 'tools/io', 'tools/client', 'tools/view'],
    'tools/evaluation': ['core', 'kernels', 'pipeline', 'tools/io', 'tools/sim', 'tools/client', 'tools/view'],
    'tools/ros2': ['core', 'pipeline', 'tools/io', 'tools/client'],
    'tools/python': ['core', 'pipeline', 'tools/io', 'tools/sim', 'tools/client'],
    'tools/cli': ['core', 'pipeline', 'tools/io', 'tools/sim', 'tools/client', 'tools/view', 'tools/serve',
                  'tools/ros2', 'tools/evaluation'],
}
TOP = {'CMakeLists.txt', 'CMakePresets.json', 'CHANGELOG.md', 'CONTRIBUTING.md', 'LICENSE', 'README.md', 'bench', 'core',
       'kernels', 'pipeline', 'tests', 'tools'}
NOT_KEPT = {'build', 'out', 'recordings'}      # .gitignore
TOP_OF_TOOLS = {'CMakeLists.txt', 'README.md', 'demo', 'frame.png', 'setup', 'test', 'cli', 'client', 'dev', 'evaluation',
                'cluster', 'examples', 'install', 'io', 'python', 'rigs', 'ros2', 'serve', 'sim', 'view'}

root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else '.')
faults = []


def folder_of(path):
    """The entry of LAYERS that a path, as includes are written, lies in."""
    return next((folder for folder in LAYERS if path.startswith(folder + '/')), None)


def sources(folder, *patterns):
    return sorted(path for pattern in patterns for path in (root / folder).rglob(pattern))


def without_comments(path):
    return re.sub(r'#.*', '', path.read_text())


def check(where, folder, target, name):
    if target != folder and target not in LAYERS[folder]:
        faults.append(f'{where}: {name} is not below {folder}')


for at, (folder, below) in enumerate(LAYERS.items()):
    faults += [f'LAYERS: {folder} names {other}, which is not above it' for other in below
               if other not in list(LAYERS)[:at]]

includes = 0
for folder in LAYERS:
    for path in sources(folder, '*.h', '*.hpp', '*.cpp'):
        for name in re.findall(r'^ *# *include "([a-z]+/[^"]+)"', path.read_text(), re.M):
            includes += 1
            check(path.relative_to(root), folder, folder_of(name), name)

homes = {}      # library: folder
for folder in LAYERS:
    for path in sources(folder, 'CMakeLists.txt'):
        homes |= {library: folder for library in re.findall(r'add_library\((\w+)', without_comments(path))}
links = 0
for folder in LAYERS:
    for path in sources(folder, 'CMakeLists.txt'):
        for call in re.findall(r'target_link_libraries\(\w+([^)]*)\)', without_comments(path)):
            for library in re.findall(r'\b\w+\b', call):
                if library in homes:
                    links += 1
                    check(path.relative_to(root), folder, homes[library], library)

more = {path.name for path in root.iterdir() if not path.name.startswith('.')} - TOP - NOT_KEPT
faults += [f'{name}: the top level holds {", ".join(sorted(TOP))} and dotfiles only' for name in sorted(more)]
flat = {path.name for path in (root / 'tools').iterdir()} - TOP_OF_TOOLS
faults += [f'tools/{name}: a folder of tools is its place' for name in sorted(flat)]

print('\n'.join(faults + [f'{includes} includes and {links} links between {len(LAYERS)} folders']))
if includes < 500 or links < 20:
    sys.exit('too few of them: this check is broken')
sys.exit(len(faults) > 0)
