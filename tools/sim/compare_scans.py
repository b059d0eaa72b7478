#!/usr/bin/env python3
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# Statistics of scan patterns, to compare simulated scans with recorded ones: compare_scans.py FOLDER...
# Each folder holds NNNNNN_{front,left,right}.pcd (binary). Prints medians over its frames, one table per sensor.
import collections
import math
import os
import re
import struct
import sys

CODES = {'F4': 'f', 'F8': 'd', 'U1': 'B', 'U2': 'H', 'U4': 'I', 'I8': 'q', 'I4': 'i', 'I2': 'h', 'I1': 'b'}


def read_pcd(path):
    data = open(path, 'rb').read()
    begin = data.index(b'DATA binary\n') + len(b'DATA binary\n')
    head = {line.split()[0]: line.split()[1:] for line in data[:begin].decode().splitlines() if line[0] != '#'}
    layout = '<' + ''.join(CODES[t + s] for t, s in zip(head['TYPE'], head['SIZE']))
    end = begin + int(head['POINTS'][0]) * struct.calcsize(layout)
    return [dict(zip(head['FIELDS'], row)) for row in struct.iter_unpack(layout, data[begin:end])]


def median(values):
    values = sorted(values)
    return values[len(values) // 2] if values else float('nan')


def ground_reach(points):
    # Goes up in each half degree of azimuth while the slope from point to point is that of a road.
    columns = collections.defaultdict(list)
    for p in points:
        columns[int(math.degrees(math.atan2(p['y'], p['x'])) * 2)].append((math.hypot(p['x'], p['y']), p['z']))
    reach = []
    for column in columns.values():
        column.sort(key=lambda q: q[1] / q[0])
        last = None
        for h, z in column:
            if last:
                run, rise = h - last[0], abs(z - last[1])
                if run < -0.3 or run > 25 or (rise > 0.15 and rise > 0.62 * max(run, 1e-6)):
                    break
            last = (h, z)
        reach.append(last[0])
    reach.sort()
    return reach[int(0.95 * len(reach))]


def heads_overlap(azimuth):
    # The right head starts in the middle while the left one is at +60 deg, and the left one ends there while the right
    # one is at -60 deg: neighbours in the order of acquisition tell whose point it is.
    starts, ends = [], []
    for i in range(6, len(azimuth) - 6):
        if abs(azimuth[i]) < 3:
            far = [a for a in azimuth[i - 6:i + 7] if abs(a) > 30]
            if len(far) >= 3 and median(far) > 45:
                starts.append(azimuth[i])
            if len(far) >= 3 and median(far) < -45:
                ends.append(azimuth[i])
    if len(starts) < 20 or len(ends) < 20:
        return float('nan')
    return sorted(starts)[int(0.98 * len(starts))] - sorted(ends)[int(0.02 * len(ends))]


def figures(points):
    azimuth = [math.degrees(math.atan2(p['y'], p['x'])) for p in points]
    elevation = [math.degrees(math.atan2(p['z'], math.hypot(p['x'], p['y']))) for p in points]
    rings = collections.defaultdict(list)
    for i, p in enumerate(points):
        rings[p['ring']].append(i)
    steps, seconds, middles = [], 0, {}
    for ring, members in rings.items():
        for half in (1, -1):
            own = [i for i in members if azimuth[i] * half > 0]
            for a, b in zip(own, own[1:]):
                step = azimuth[a] - azimuth[b]
                if 0.05 < step < 0.2:
                    steps.append(step)
        # Two returns of one beam follow one another; recorded directions are not exactly equal.
        seconds += sum(abs(azimuth[i] - azimuth[j]) < 0.003 and abs(elevation[i] - elevation[j]) < 0.003
                       for i, j in zip(members, members[1:]))
        near = [elevation[i] for i in members if 25 < azimuth[i] < 35]
        if len(near) > 20:
            middles[ring] = median(near)
    order = sorted(middles.values(), reverse=True)
    spacing = [a - b for a, b in zip(order, order[1:]) if abs(a + b) < 3]
    filled = {(p['ring'], int((60 - a) * 857 / 120)) for p, a in zip(points, azimuth) if abs(a) < 60}
    full = {r for r, m in rings.items() if len(m) > 700}
    drop = []
    for r in full:
        own = [elevation[i] for i in rings[r] if azimuth[i] > 45]
        end = [elevation[i] for i in rings[r] if 2 < azimuth[i] < 15]
        if own and end:
            drop.append(median(own) - median(end))
    return [('points', len(points)), ('lines (700 points and more)', len(full)), ('azimuth step, deg', median(steps)),
            ('spacing within 1.5 deg of the horizon, deg', median(spacing)),
            ('fall of a line from 52 to 8 deg azimuth, deg', median(drop)),
            ('lowest, highest elevation, deg', (min(elevation), max(elevation))),
            ('empty share of 32 x 857 pixels', 1 - len(filled) / (32 * 857)), ('second returns', seconds),
            ('overlap of the two heads, deg', heads_overlap([a for a, p in zip(azimuth, points) if p['ring'] in full])),
            ('points of the own front', sum(math.hypot(p['x'], p['y']) < 1.6 for p in points)),
            ('points on other cars, by the truth', sum(p.get('surface', 0) >= 100 for p in points)),
            ('road seen to, 95th percentile, m', ground_reach(points)),
            ('median intensity within 15 m', median([p['intensity'] for p in points
                                                     if math.hypot(p['x'], p['y']) < 15]))]


for sensor in ('front', 'left', 'right'):
    table = {}
    for folder in sys.argv[1:]:
        names = sorted(n for n in os.listdir(folder) if re.fullmatch(r'\d+_%s\.pcd' % sensor, n))[:8]
        frames = [figures(read_pcd(os.path.join(folder, n))) for n in names]
        for k, (name, first) in enumerate(frames[0]):
            values = [f[k][1] for f in frames]
            if isinstance(first, tuple):
                text = '%.1f %.1f' % tuple(median([v[j] for v in values]) for j in (0, 1))
            else:
                text = '%.4g' % median(values) if not isinstance(first, int) else str(median(values))
            table.setdefault(name, []).append(text)
    print(sensor)
    for name, row in table.items():
        print('  %-46s' % name + ''.join('%14s' % text for text in row))
