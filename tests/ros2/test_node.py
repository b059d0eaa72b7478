#!/usr/bin/env python3
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/ros2/test_node.py NAME OVERTAKE PEER. `overtake node` (Cyclone DDS) against ros2_peer (Fast DDS), on the
# loopback interface and in a domain of its own. Exit code 77 without PEER.
import csv
import math
import os
import pathlib
import random
import re
import signal
import struct
import subprocess
import sys
import tempfile
import time

name, overtake, peer_program = sys.argv[1], pathlib.Path(sys.argv[2]).resolve(), sys.argv[3]
PERIOD_NS = 50_000_000
PATIENCE_S = 60      # a busy machine; no test measures this time


class Failure(Exception):
    pass


def expect(good, sentence):
    if not good:
        raise Failure(sentence)


def make_race(work, seconds, scenario='overtake'):
    race = work / 'race.mcap'
    subprocess.run([overtake, 'simulate', scenario, '--seed', '7', '--seconds', str(seconds), '--out', race, '--quiet'],
                   check=True)
    return race


class Node:
    """An `overtake node` of its own domain."""

    def __init__(self, work, race, *options, rig=None, environment=None):
        self.domain = random.SystemRandom().randrange(1, 232)
        self.log = work / f'node_{time.monotonic_ns()}.txt'
        words = [overtake, 'node', '--rig', rig or race, '--map', race, '--domain', str(self.domain), '--interface', 'lo',
                 *options]
        kept = {key: value for key, value in os.environ.items() if not key.startswith(('ROS_', 'CYCLONEDDS_'))}
        with open(self.log, 'w') as log:
            self.process = subprocess.Popen(words, stdout=log, stderr=log, env=kept | (environment or {}))
        self.expect(r'domain \d+, rig')

    def said(self):
        return self.log.read_text()

    def expect(self, pattern, count=1):
        """Waits until the node has said it so many times."""
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            if len(re.findall(pattern, self.said())) >= count:
                return
            expect(self.process.poll() is None, f'the node ended ({self.process.returncode}):\n{self.said()}')
            time.sleep(0.02)
        raise Failure(f"the node has not said '{pattern}':\n{self.said()}")

    def expect_not(self, pattern):
        expect(not re.search(pattern, self.said()), f"the node said '{pattern}':\n{self.said()}")

    def stop(self, code=130):
        self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise Failure(f'Ctrl-C does not end the node:\n{self.said()}') from None
        expect(self.process.returncode == code, f'exit code {self.process.returncode}:\n{self.said()}')

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()


class Peer:
    """A ros2_peer in the background."""

    def __init__(self, work, race, node, *options, folder=None):
        self.folder = work / (folder or f'peer_{time.monotonic_ns()}')
        self.folder.mkdir()
        words = [peer_program, race, self.folder, '--domain', str(node.domain), '--wait', str(PATIENCE_S), *options]
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def ready(self):
        line = self.process.stdout.readline()
        expect(line == 'ready\n', f'ros2_peer: {line}{self.process.stdout.read() if line != "ready" else ""}')
        return self

    def wait(self):
        try:
            out, _ = self.process.communicate(timeout=4 * PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise Failure('ros2_peer does not end') from None
        expect(self.process.returncode == 0, f'ros2_peer: {out}')
        return self

    def kill(self):
        """As a crash: without a farewell."""
        self.process.kill()
        self.process.wait()

    def rows(self, table):
        with open(self.folder / table, newline='') as file:
            return list(csv.DictReader(file))

    def diagnostics(self):
        return (self.folder / 'diagnostics.txt').read_text()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()


def float32(text):
    return struct.unpack('f', struct.pack('f', float(text)))[0]


def rows_of_run(folder, table):
    with open(folder / table, newline='') as file:
        return list(csv.DictReader(file))


def quantile(values, share):
    return sorted(values)[int(share * (len(values) - 1) + 0.5)]


def compare(run, peer, frames):
    """The results of the node are those of `overtake run` on the same scans: every detection and track, every bit."""
    times = peer.rows('times.csv')
    arrived = [row['stamp_ns'] for row in times if row['what'] == 'detections']
    expect(len(arrived) == frames, f'{len(arrived)} of {frames} frames came back')

    wanted = [(row['stamp_ns'], *(float32(row[key]) for key in ('x_m', 'y_m', 'z_m', 'length_m', 'width_m')))
              for row in rows_of_run(run, 'detections.csv')]
    got_rows = peer.rows('detections.csv')
    got = [(row['stamp_ns'], *(float(row[key]) for key in ('x_m', 'y_m', 'z_m', 'length_m', 'width_m')))
           for row in got_rows]
    expect(len(wanted) > 2 * frames, f'{len(wanted)} detections in the run: too few to prove anything')
    expect(got == wanted, f'{len(got)} detections, the run has {len(wanted)}; '
           f'only there: {list(set(wanted) - set(got))[:3]}; only here: {list(set(got) - set(wanted))[:3]}')
    for row, theirs in zip(got_rows, rows_of_run(run, 'detections.csv')):
        half = float(theirs['heading_rad']) / 2     # a quaternion has no more than the last bits of an angle
        expect(abs(float(row['qz']) - math.sin(half)) < 1e-6 and abs(float(row['qw']) - math.cos(half)) < 1e-6,
               f'heading of {row}')
        expect(row['frame_id'] == 'base_link', f'frame of {row}')

    columns = ('stamp_ns', 'id', 'x_m', 'y_m', 'speed_mps', 'course_rad', 'yaw_rate_rps', 'heading_rad', 'age', 'hits',
               'var_x', 'var_y')
    frames_of_scans = set(arrived)
    key = lambda row: tuple(float(row[c]) if '.' in row[c] or 'e' in row[c] else int(row[c]) for c in columns)
    wanted_tracks = [key(row) for row in rows_of_run(run, 'tracks.csv')]
    got_tracks = [key(row) for row in peer.rows('tracks.csv') if row['frame_ns'] in frames_of_scans]
    expect(len(wanted_tracks) > frames / 2, f'{len(wanted_tracks)} tracks in the run: too few to prove anything')
    expect(got_tracks == wanted_tracks, f'{len(got_tracks)} tracks, the run has {len(wanted_tracks)}; '
           f'only there: {list(set(wanted_tracks) - set(got_tracks))[:2]}; '
           f'only here: {list(set(got_tracks) - set(wanted_tracks))[:2]}')


def value_of(line, key):
    return re.search(rf'\[{key}=([^\]]*)\]', line)[1]


def report_times(peer, frames):
    """The latency of DDS apart: there and back less what the node takes from the last scan to its tracks."""
    written, there_and_back = 0, []
    for row in peer.rows('times.csv'):
        if row['what'].startswith('write'):
            written = int(row['at_ns'])
        elif row['what'] == 'detections':
            there_and_back.append((int(row['at_ns']) - written) * 1e-6)
    lines = peer.diagnostics().splitlines()
    last = {part: [line for line in lines if f' overtake: {part}:' in line][-1] for part in
            ('detector', 'front', 'left', 'right', 'results')}
    print(f'{frames} frames of three sensors at 20 Hz, none lost')
    print(f'last write to detections at the subscriber: p50 {quantile(there_and_back, 0.5):.2f}, '
          f'p99 {quantile(there_and_back, 0.99):.2f} ms')
    print(f"of it push to tracks: p50 {value_of(last['detector'], 'latency_p50_ms')}, "
          f"p99 {value_of(last['detector'], 'latency_p99_ms')} ms; messages made and written: p50 "
          f"{value_of(last['results'], 'publish_p50_ms')}, p99 {value_of(last['results'], 'publish_p99_ms')} ms")
    for sensor in ('front', 'left', 'right'):
        print(f"DDS, write to arrival, {sensor}: p50 {value_of(last[sensor], 'transport_p50_ms')}, "
              f"p99 {value_of(last[sensor], 'transport_p99_ms')} ms, read {value_of(last[sensor], 'read')}")


def interop(work, seconds):
    race = make_race(work, seconds)
    frames = 20 * seconds
    subprocess.run([overtake, 'run', race, '--preset', 'paper', '--out', work / 'run', '--quiet'], check=True)
    with Node(work, race, '--preset', 'paper') as node, Peer(work, race, node) as peer:
        peer.ready().wait()
        node.stop()
        compare(work / 'run', peer, frames)
        lines = peer.diagnostics().splitlines()
        for part in ('front', 'left', 'right'):
            of_part = [line for line in lines if f' overtake: {part}:' in line]
            expect(value_of(of_part[-1], 'lost') == '0' and value_of(of_part[-1], 'refused') == '0', of_part[-1])
            expect(of_part[-1].startswith('0 '), of_part[-1])
        front, left = ([line for line in lines if f' overtake: {part}:' in line][-1] for part in ('front', 'left'))
        expect(value_of(front, 'read') == 'in place', front)
        expect("by a copy: field 'x' is not aligned in points of 22 bytes" in left, left)
        check_others(peer)
        report_times(peer, frames)


def check_others(peer):
    """The further topics agree with the tracks."""
    others = peer.rows('others.csv')
    mounting = {row['child_frame_id']: row for row in others if row['topic'] == 'tf_static'}
    expect(set(mounting) == {'front', 'left', 'right'}, f'tf_static: {sorted(mounting)}')
    expect(all(row['frame_id'] == 'base_link' for row in mounting.values()), f'tf_static: {mounting}')
    expect(mounting['front']['x_m'] == '2.3420000000000001', f'tf_static: {mounting["front"]}')
    places = {(row['stamp_ns'], row['x_m'], row['y_m']) for row in peer.rows('tracks.csv') if row['state'] == '1'}
    odometry = [row for row in others if row['topic'] == 'odometry']
    expect(len(odometry) > 20, f'{len(odometry)} odometry messages of track_0')
    for row in odometry:
        expect((row['stamp_ns'], row['x_m'], row['y_m']) in places, f'no track at {row}')
        expect(row['frame_id'] == 'map' and re.fullmatch(r'track_\d+_\d+', row['child_frame_id']), f'{row}')
    paths = [row for row in others if row['topic'] == 'path']
    expect(len([row for row in paths if int(row['count']) > 10]) >= len(odometry), f'{len(paths)} paths')
    markers = [row for row in others if row['topic'].startswith('marker ')]
    boxes = [row for row in markers if row['topic'] == 'marker tracks']
    expect(len(boxes) == len(peer.rows('tracks.csv')), f'{len(boxes)} markers of tracks')
    expect(len([row for row in markers if row['topic'] == 'marker detections']) == len(peer.rows('detections.csv')),
           'markers of detections')
    expect(any(row['topic'] == 'marker labels' and ' m/s' in row['child_frame_id'] for row in markers), 'labels')


def test_interop(work):
    interop(work, 10)


def test_interop_long(work):
    interop(work, 60)


if not peer_program:
    print(f'skipped: ros2_{name}: no Cyclone DDS, or no Fast DDS with fastddsgen (tools/setup --ros2)')
    sys.exit(77)
with tempfile.TemporaryDirectory() as folder:
    try:
        globals()[f'test_{name}'](pathlib.Path(folder))
    except Failure as failure:
        sys.exit(f'FAILED: ros2_{name}: {failure}')
print('passed')
