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
    # Its rig and map as files of their own: a node starts at once.
    subprocess.run([overtake, 'simulate', scenario, '--seed', '7', '--seconds', '0.05', '--out', work / 'race', '--quiet'],
                   check=True)
    return race


def random_domain():
    return random.SystemRandom().randrange(1, 232)


class Node:
    """An `overtake node` of its own domain."""

    def __init__(self, work, *options, rig=None, environment=None, domain=None):
        self.domain = domain or random_domain()
        self.log = work / f'node_{time.monotonic_ns()}.txt'
        words = [overtake, 'node', '--rig', rig or work / 'race' / 'rig.toml', '--map', work / 'race' / 'map.csv',
                 '--domain', str(self.domain), '--interface', 'lo', *options]
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

    def __init__(self, work, race, node_or_domain, *options):
        self.folder = work / f'peer_{time.monotonic_ns()}'
        self.folder.mkdir()
        domain = node_or_domain if isinstance(node_or_domain, int) else node_or_domain.domain
        words = [peer_program, race, self.folder, '--domain', str(domain), '--wait', str(PATIENCE_S), *options]
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def ready(self):
        line = self.process.stdout.readline()
        if line != 'ready\n':
            raise Failure(f'ros2_peer: {line}{self.process.stdout.read()}')
        return self

    def wait(self):
        try:
            self.summary, _ = self.process.communicate(timeout=4 * PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise Failure('ros2_peer does not end') from None
        expect(self.process.returncode == 0, f'ros2_peer: {self.summary}')
        return self

    def counted(self, pattern):
        """Numbers of the summary."""
        found = re.search(pattern, self.summary)
        expect(found, f"no '{pattern}' in the summary:\n{self.summary}")
        return tuple(float(number) for number in found.groups())

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


def interop(work, seconds, scenario='overtake'):
    race = make_race(work, seconds, scenario)
    frames = 20 * seconds
    subprocess.run([overtake, 'run', race, '--preset', 'paper', '--out', work / 'run', '--quiet'], check=True)
    with Node(work, '--preset', 'paper') as node, Peer(work, race, node) as peer:
        peer.ready().wait()
        node.stop()
        try:
            compare(work / 'run', peer, frames)
        except Failure as failure:
            raise Failure(f'{failure}\n{node.said()}\n{chr(10).join(peer.diagnostics().splitlines()[-7:])}') from None
        lines = peer.diagnostics().splitlines()
        for part in ('front', 'left', 'right'):
            of_part = [line for line in lines if f' overtake: {part}:' in line]
            expect(value_of(of_part[-1], 'lost') == '0' and value_of(of_part[-1], 'refused') == '0', of_part[-1])
            expect(of_part[-1].startswith('0 '), of_part[-1])
        front, left = ([line for line in lines if f' overtake: {part}:' in line][-1] for part in ('front', 'left'))
        expect(value_of(front, 'read') == 'in place' and value_of(left, 'read') == 'in place', f'{front}\n{left}')
        check_others(peer)
        check_summary(peer, frames)
        report_times(peer, frames)


def check_summary(peer, frames):
    """The numbers that ros2_peer prints at its end are those of its tables."""
    clouds = [row for row in peer.rows('times.csv') if row['what'].startswith('write')]
    expect(peer.counted(r'sent +(\d+) frames, (\d+) clouds, [1-9][\d.]+ MB, [1-9]\d* poses') == (frames, len(clouds)),
           peer.summary)
    expect(peer.counted(r'received +(\d+) frames with (\d+) detections, (\d+) of tracks') ==
           (frames, len(peer.rows('detections.csv')),
            len([row for row in peer.rows('times.csv') if row['what'] == 'tracks'])), peer.summary)
    expect(peer.counted(r'lost +(\d+) frames') == (0,), peer.summary)
    p50, p90, p99, most = peer.counted(r'detections: p50 ([\d.]+), p90 ([\d.]+), p99 ([\d.]+), max ([\d.]+) ms')
    expect(0 < p50 <= p90 <= p99 <= most, peer.summary)


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


def frames_back(peer):
    return len([row for row in peer.rows('times.csv') if row['what'] == 'detections'])


def rig_with_frames(work):
    """The race's rig, with the frame_id of each sensor's clouds."""
    text = (work / 'race' / 'rig.toml').read_text()
    for sensor in ('front', 'left', 'right'):
        text = text.replace(f'name = "{sensor}"', f'name = "{sensor}"\nframe_id = "{sensor}"')
    rig = work / 'frames.toml'
    rig.write_text(text)
    return rig


def test_faults(work):
    """Types, quality of service, frames of reference and fields that do not fit: one node, many publishers."""
    race = make_race(work, 2)
    short = ('--frames', '25', '--linger', '1.5')
    with Node(work, rig=rig_with_frames(work)) as node:
        node.expect(r'front: nobody publishes /front/points or .*of type sensor_msgs/msg/PointCloud2 there is none')

        def play(*options):
            # Its stamps follow those before: the publishers of a race that goes on.
            play.shift += 5
            with Peer(work, race, node, *short, '--shift', str(play.shift), *options) as peer:
                if '--no-match' not in options:
                    peer.ready()
                return peer.wait()
        play.shift = 0

        peer = play('--type', 'front=std_msgs::msg::dds_::String_', '--no-match', '--wait', '3')
        node.expect(r'front: /front/points has the type std_msgs/msg/String, sensor_msgs/msg/PointCloud2 is needed')
        expect(re.search(r'^2 overtake: front: /front/points has the type std_msgs/msg/String', peer.diagnostics(), re.M),
               f'the wrong type is not in the diagnostics:\n{peer.diagnostics()}\n{node.said()}')
        expect(frames_back(peer) >= 20, 'the other sensors have no frames while the type of one is wrong')
        peer = play()
        node.expect(r'front: nobody publishes it with the wrong type any more')
        node.expect(r'front: found on /front/points')
        expect(frames_back(peer) >= 20, 'no frames after the type was mended')

        peer = play('--exclusive', 'left', '--no-match', '--wait', '3')
        node.expect(r'left: the quality of service of a publisher of /left/points does not match: its ownership')
        expect(re.search(r'^2 overtake: left: .*ownership', peer.diagnostics(), re.M), 'not in the diagnostics')

        peer = play('--latched', 'detections', '--no-match', '--wait', '3')
        node.expect(r'results: the quality of service of a subscriber of /overtake/detections does not match: its durab')

        peer = play('--frame-id', 'right=base_link')
        node.expect(r"right: its clouds on /right/points are in frame_id 'base_link', the rig 'av21' says 'right'")
        expect(re.search(r'^2 overtake: right: its clouds .*\[refused=[1-9]', peer.diagnostics(), re.M), 'the wrong frame')

        play('--pose-frame', 'odom')
        node.expect(r"ego: frame_id of a pose on /ego/odometry is 'odom', not 'map': not used")

        play('--drop-field', 'front.x')
        node.expect(r'front: a cloud is not used: /front/points: no field gives x')

        peer = play('--drop-field', 'front.ring')
        expect('[read=by a copy: it has no ring field: the 32 lines are recovered from the points]' in peer.diagnostics(),
               'clouds without ring')
        node.stop()
        expect(len(re.findall('front: a cloud is not used', node.said())) == 1, f'said more than once:\n{node.said()}')


def test_scans(work):
    """Scans without stamps, with repeated stamps, with more points than the rig has room for."""
    race = make_race(work, 2)
    short = ('--frames', '30', '--linger', '1.5')
    with Node(work) as node:
        for shift, options, sensor, said, advice in (
                (0, ('--stamp', 'front=none'), 'front', r'its clouds have no stamp \(header.stamp is 0\): not used', ''),
                (5, ('--stamp', 'left=repeat'), 'left', 'a scan has the stamp of the scan before: not used', ''),
                (10, ('--points', 'right=4'), 'right', r'a scan has \d+ points, point_capacity of the rig is \d+: not used',
                 r' \(--capacity points=\d+ raises it\)')):
            with Peer(work, race, node, *short, '--shift', str(shift), *options) as peer:
                peer.ready().wait()
            node.expect(f'{sensor}: {said}{advice}')
            expect(re.search(rf'^2 overtake: {sensor}: {said}.*\[refused=[1-9]', peer.diagnostics(), re.M),
                   f'{sensor} refused:\n{peer.diagnostics()}')
            expect(frames_back(peer) >= 20, f'{frames_back(peer)} of 30 frames while scans of {sensor} are refused')
        node.stop()
        advice = re.search(r'--capacity points=\d+', node.said())[0].split()
    with Node(work, *advice) as node, Peer(work, race, node, *short, '--points', 'right=4') as peer:     # it helps
        peer.ready().wait()
        line = [line for line in peer.diagnostics().splitlines() if ' overtake: right:' in line][-1]
        expect(value_of(line, 'refused') == '0' and int(value_of(line, 'received')) >= 25, line)
        node.stop()


def test_senders(work):
    """Two publishers of one topic that send at the same time."""
    race = make_race(work, 5)
    with Node(work) as node:
        with Peer(work, race, node, '--linger', '5') as first:
            first.ready()
            with Peer(work, race, node, '--frames', '40', '--only', 'front', '--no-poses', '--linger', '0') as second:
                second.ready()
                node.expect(r'front: 2 publishers of /front/points send at the same time: their messages mix')
                second.wait()
            first.wait()
            node.expect(r'front: only one publisher of /front/points sends now')
            expect(re.search(r'^[12] overtake: front: .*2 publishers of /front/points send at the same time',
                             first.diagnostics(), re.M), f'not in the diagnostics:\n{first.diagnostics()}')
        node.stop()
        node.expect_not(r'(left|right|ego): 2 publishers')


def test_slow(work):
    """A subscriber that has stopped costs the node and the other subscribers nothing."""
    race = make_race(work, 5)
    with Node(work, '--preset', 'paper') as node:
        with Peer(work, race, node, '--frames', '0', '--no-poses', '--linger', '200') as stopped:
            stopped.ready().process.send_signal(signal.SIGSTOP)
            with Peer(work, race, node, '--linger', '2') as peer:
                peer.ready().wait()
            expect(peer.counted(r'sent +(\d+) frames') == (100,), peer.summary)
            expect(frames_back(peer) >= 90, f'{frames_back(peer)} of 100 frames while another subscriber has stopped')
            line = [line for line in peer.diagnostics().splitlines() if ' overtake: results:' in line][-1]
            expect(value_of(line, 'not_sent') == '0', line)
        node.stop()


def test_graph(work):
    """The node's entry in the graph of ROS 2: its names, and the GUIDs that an independent participant has found."""
    race = make_race(work, 2)

    def check(peer, gid_bytes, name_space, name, topics):
        rows = peer.rows('graph.csv')
        expect(rows, f'nothing on ros_discovery_info:\n{peer.summary}')
        last = [row for row in rows if row['message'] == rows[-1]['message']]
        expect({(row['namespace'], row['node']) for row in last} == {(name_space, name)}, f'names: {last[0]}')
        participant, = {row['participant'] for row in last}
        zeros = '00' * (gid_bytes - 16)
        found = peer.rows('endpoints.csv')
        expect([row['type'] for row in found if row['kind'] == 'participant' and row['guid'] + zeros == participant]
               == ['enclave=/;'], f'the participant {participant} in {found[:3]}')
        theirs = [row for row in found if row['kind'] != 'participant' and row['guid'][:24] == participant[:24]]
        for kind in ('reader', 'writer'):
            said = [row['guid'] for row in last if row['kind'] == kind]
            seen = [row['guid'] + zeros for row in theirs if row['kind'] == kind and row['topic'].startswith('rt/')]
            expect(sorted(said) == sorted(seen) and said, f'{kind}s: {len(said)} said, {len(seen)} seen')
        others = {row['topic']: row['type'] for row in theirs if not row['topic'].startswith('rt/')}
        expect(others == {'ros_discovery_info': 'rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_'}, f'{others}')
        known = {row['topic'] for row in theirs}
        expect(set(topics) <= known, f'{set(topics) - known} is missing')
        return len({row['message'] for row in rows})

    inputs = [f'rt/{sensor}/points' for sensor in ('front', 'left', 'right')] + ['rt/ego/odometry']
    with Node(work) as node:
        with Peer(work, race, node, '--frames', '10') as peer:      # the node finds its topics while it plays
            peer.ready().wait()
            expect(check(peer, 24, '/', 'overtake', [*inputs, 'rt/overtake/tracks']) <= 3, 'more messages than changes')
        with Peer(work, race, node, '--frames', '0', '--no-poses') as late:
            late.ready().wait()
            expect(check(late, 24, '/', 'overtake', inputs) == 1, 'a late subscriber gets more than the last entry')
        node.stop()
    for options, environment in ((('--ros-distro', 'jazzy'), {'ROS_DISTRO': 'humble'}), ((), {'ROS_DISTRO': 'iron'})):
        with Node(work, '--namespace', '/car1', '--name', 'detector', *options, environment=environment) as node:
            with Peer(work, race, node, '--gid', '16', '--frames', '0', '--no-poses', '--no-match', '--wait', '3') as peer:
                peer.ready().wait()
                check(peer, 16, '/car1', 'detector', ['rt/car1/detector/tracks', 'rt/diagnostics'])
            node.stop()


def test_publishers(work):
    """Late joiners on both sides; a publisher that crashes and comes back."""
    race = make_race(work, 4)
    domain = random_domain()
    # The publisher is first, the node and another subscriber join it.
    with Peer(work, race, domain, '--no-match', '--wait', '0', '--rate', '4', '--linger', '60') as first:
        first.ready()
        with Node(work, domain=domain) as node:
            with Peer(work, race, node, '--frames', '0', '--no-poses', '--linger', '2.5') as late:
                late.ready().wait()
                transforms = {row['child_frame_id'] for row in late.rows('others.csv') if row['topic'] == 'tf_static'}
                expect(transforms == {'front', 'left', 'right'}, f'a late subscriber has the transforms of {transforms}')
                expect('overtake: detector: ' in late.diagnostics(), 'a late subscriber has no diagnostics')
            expect(first.process.poll() is None, f'the first publisher ended: {first.process.poll()}')
            node.expect_not('nobody publishes')
            first.kill()
            node.expect(r'front: nothing on /front/points for')
            node.expect(r'ego: nothing on /ego/odometry for')
            with Peer(work, race, node, '--frames', '40', '--shift', '60', '--linger', '1.5') as second:
                second.ready().wait()
                node.expect(r'front: comes again, after')
                node.expect(r'ego: comes again, after')
                expect(frames_back(second) >= 25, f'{frames_back(second)} of 40 frames after the return')
                node.expect_not('their messages mix')
            node.expect(r'front: the publisher of /front/points is gone')      # it said farewell
            with Peer(work, race, node, '--frames', '40', '--shift', '70') as third:
                third.ready().wait()
            node.expect(r'front: the publisher of /front/points is back, after')
            node.stop()


def test_lost(work):
    """Clouds of up to 650 kB in fragments, into a receive buffer that is far too small."""
    race = make_race(work, 3)
    small = '<CycloneDDS><Domain id="any"><Internal><SocketReceiveBufferSize max="40kB"/></Internal></Domain></CycloneDDS>'
    with Node(work, '--preset', 'paper', environment={'CYCLONEDDS_URI': small}) as node:
        with Peer(work, race, node, '--linger', '1.5') as peer:
            peer.ready().wait()
        node.expect(r'network: the kernel dropped \d+ datagrams? since the start, so clouds are torn')
        expect(re.search(r'^2 overtake: network: the kernel dropped .*\[datagrams_dropped=[1-9]', peer.diagnostics(), re.M),
               'not in the diagnostics')
        node.expect(r'(front|left|right): (\d+ scans? of /\w+/points missing since the start|nothing on )')
        node.stop()
        node.expect_not('is not used: is not a')     # what arrives is whole


def test_clocks(work):
    """Stamps that jump, of all sensors and of one; a simulation's clock that goes back."""
    race = make_race(work, 4)
    for jump in ('100', '-100'):
        with Node(work) as node, Peer(work, race, node, '--jump-at', '30', '--jump', jump, '--linger', '1.5') as peer:
            peer.ready().wait()
            node.expect(r'detector: the stamps of the sensors jumped: the tracker started again')
            expect(frames_back(peer) >= 70, f'{frames_back(peer)} of 80 frames around a jump of {jump} s')
            expect(re.search(r'\[clock_jumps=1\]', peer.diagnostics()), 'the jump is not in the diagnostics')
            node.stop()
    options = ('--jump-at', '30', '--jump', '1.5', '--jump-only', 'front')
    with Node(work) as node, Peer(work, race, node, *options) as peer:
        peer.ready().wait()
        node.expect(r"detector: the clock of front does not fit the others'")
        node.stop()
    with Node(work, '--use-sim-time') as node, Peer(work, race, node, '--clock', 'back') as peer:
        peer.ready().wait()
        node.expect(r'clock: /clock went back by \d+\.\d s')
        node.stop()


def test_sim_time(work):
    """With the clock of a simulation, tracks go on while the sensors are silent, by that clock and no other."""
    race = make_race(work, 4)
    with Node(work, '--use-sim-time') as node:
        options = ('--clock', 'run', '--silent-from', '50', '--silent-to', '60', '--rate', '8')
        with Peer(work, race, node, *options) as peer:
            peer.ready().wait()
        node.stop()
    scans = {int(row['stamp_ns']) for row in peer.rows('times.csv') if row['what'] == 'detections'}
    begin = min(scans)
    predicted = [row for row in peer.rows('times.csv') if row['what'] == 'tracks' and int(row['stamp_ns']) not in scans]
    expect(len(predicted) >= 5, f'{len(predicted)} predictions while the sensors were silent')
    for row in predicted:
        frame = (int(row['stamp_ns']) - begin) / PERIOD_NS
        expect(50 <= frame <= 62 or frame >= 80, f'a prediction at frame {frame:.1f}')
    # Eight frames a second would be silence by the clock of this machine.
    expect(60 <= len(scans) <= 74, f'{len(scans)} of 70 frames')     # a busy machine may tear some apart, and lose some


def test_names(work):
    """Namespaces, remaps, a configuration file; what the command line refuses."""
    race = make_race(work, 2)
    results = ['detections', 'tracks', 'markers', 'track_0/odometry', 'track_0/path']
    moved = [word for result in results for word in ('--remap', f'~/{result}:=/overtake/{result}')]

    def expect_inputs(what, *options, prefix='', rig=None):
        """Inputs that are not found give no frame at all; a busy machine may lose a few of the 40."""
        with Node(work, *options, rig=rig) as node, Peer(work, race, node, '--prefix', prefix) as peer:
            peer.ready().wait()
            node.stop()
            expect(frames_back(peer) >= 20, f'{what}: {frames_back(peer)} of 40 frames\n{peer.summary}')
    expect_inputs('inputs in the namespace', '--namespace', '/car1', *moved, prefix='/car1')
    expect_inputs('inputs outside of the namespace', '--namespace', 'car1', *moved)
    inputs = [word for topic in ('front/points', 'left/points', 'right/points', 'ego/odometry')
              for word in ('--remap', f'{topic}:=/elsewhere/{topic}')]
    expect_inputs('inputs with other names', *inputs, prefix='/elsewhere')

    text = (work / 'race' / 'rig.toml').read_text()
    for sensor in ('front', 'left', 'right'):
        text = text.replace(f'name = "{sensor}"', f'name = "{sensor}"\ntopics = ["/vehicle_*/{sensor}/points"]')
    star = work / 'star.toml'
    star.write_text(text.replace('[[sensor]]', '[topics]\nego = ["/vehicle_*/ego/odometry"]\n[[sensor]]', 1))
    expect_inputs('topics of a rig with *', prefix='/vehicle_5', rig=star)

    config = work / 'node.toml'
    config.write_text(f'rig = "{race}"\npreset = "paper"\n[node]\nname = "other"\nremap = ['
                      + ', '.join(f'"~/{result}:=/overtake/{result}"' for result in results) + ']\n')
    expect_inputs('a configuration file', '--config', str(config))

    def refused(sentence, *words, code=1):
        done = subprocess.run([overtake, 'node', *words], capture_output=True, text=True, timeout=PATIENCE_S)
        expect(done.returncode == code and re.search(sentence, done.stderr), f'{words}: {done.returncode} {done.stderr}')
    rig = ('--rig', work / 'race' / 'rig.toml', '--interface', 'lo', '--domain', str(random_domain()))
    refused('--rig is needed')
    refused(r"this node has no topic /frnt/points; did you mean '/front/points'", *rig, '--remap', 'frnt/points:=/a')
    refused(r'FROM:=TO is needed', *rig, '--remap', 'front/points')
    refused(r'two inputs, front and left, have the topic /a', *rig, '--remap', 'front/points:=/a',
            '--remap', 'left/points:=/a')
    refused(r"'/2nd' is not a name of ROS 2", *rig, '--namespace', '/2nd')
    refused(r'--interface nothing: Cyclone DDS cannot join', '--rig', race, '--interface', 'nothing')
    refused(r'--domain', '--rig', race, '--domain', '233', code=2)
    config.write_text('[node]\nnamespce = "/a"\n')
    refused(r"node.toml:2: .*namespce", *rig, '--config', str(config))
    done = subprocess.run([overtake, 'node', '--rig', race], capture_output=True, text=True, timeout=PATIENCE_S,
                          env=os.environ | {'ROS_DOMAIN_ID': 'x'})
    expect("ROS_DOMAIN_ID: 'x' is not a domain id" in done.stderr, done.stderr)
    refused(r"--ros-distro: 'humbel' is not a release of ROS 2 .*did you mean 'humble'", *rig, '--ros-distro', 'humbel')


def rig_of_left(work, topics=''):
    """The race's rig with its left sensor alone."""
    head, *sensors = (work / 'race' / 'rig.toml').read_text().split('[[sensor]]')
    left = next(sensor for sensor in sensors if 'name = "left"' in sensor)
    rig = work / 'left.toml'
    rig.write_text(head + '[[sensor]]' + left.replace('name = "left"', 'name = "left"\n' + topics))
    return rig


def test_found(work):
    """Publishers appear one by one; an input is found by its name, or as the only one there is."""
    race = make_race(work, 6)
    long = ('--frames', '1000', '--no-match', '--wait', '2', '--linger', '0.5')
    def topics(peer):
        return [value_of(line, 'topic') for line in peer.diagnostics().splitlines() if ' overtake: left:' in line]
    with Node(work, rig=rig_of_left(work)) as node, Peer(work, race, node, '--only', 'front', *long) as other:
        time.sleep(4)       # after a while the only cloud is the sensor's
        with Peer(work, race, node, '--only', 'left', '--no-poses', '--shift', '60', *long) as peer:
            peer.ready().wait()
        other.wait()
        node.stop()
    expect('/front/points' in topics(other) and topics(peer)[-1] == '/left/points', topics(other) + topics(peer))
    with Node(work, '--namespace', '/car1', rig=rig_of_left(work)) as node, \
            Peer(work, race, node, '--only', 'front', '--prefix', '/car2', *long) as other:
        time.sleep(3)
        with Peer(work, race, node, '--only', 'front', '--prefix', '/car1', '--shift', '60', *long) as peer:
            other.wait(), peer.wait()
        node.stop()
        expect(topics(peer)[-1] == '/car1/front/points', topics(peer))      # the only one of the namespace

    text = (work / 'race' / 'rig.toml').read_text()
    for sensor in ('front', 'left', 'right'):
        text = text.replace(f'name = "{sensor}"', f'name = "{sensor}"\ntopics = ["/vehicle_*/{sensor}/points"]')
    star = work / 'star.toml'
    star.write_text(text)
    with Node(work, rig=star) as node, Peer(work, race, node, '--only', 'front', '--prefix', '/vehicle_2', *long) as one:
        one.ready()
        node.expect('left: nobody publishes')
        with Peer(work, race, node, '--prefix', '/vehicle_5', *long) as other:
            other.wait()
        one.wait()
        node.stop()
    expect('topic=/vehicle_2/front/points' in one.diagnostics() and 'topic=/vehicle_5' not in one.diagnostics(),
           one.diagnostics())


def test_empty(work):
    """Clouds without points are not "all clear"."""
    race = make_race(work, 2)
    with Node(work, rig=rig_of_left(work)) as node:
        with Peer(work, race, node, '--only', 'left', '--points', 'left=0', '--linger', '1.5') as peer:
            peer.ready().wait()
        node.expect('left: clouds on /left/points have no points')
        node.expect("detector: no scan of a frame has a usable point: this is not 'all clear'")
        expect(re.search(r'^2 overtake: detector: no scan', peer.diagnostics(), re.M), peer.diagnostics())
        expect(frames_back(peer) == 0, f'{frames_back(peer)} empty lists of detections')
        node.stop()


def test_silence(work):
    """While all sensors are silent the tracks are predicted, with any period of theirs."""
    race = make_race(work, 2)
    text = (work / 'race' / 'rig.toml').read_text()
    expect('period_s = 0.05' in text, text)
    for period_s in ('0.05', '0.02'):
        rig = work / 'period.toml'
        rig.write_text(text.replace('period_s = 0.05', f'period_s = {period_s}'))
        with Node(work, rig=rig) as node, Peer(work, race, node, '--frames', '20', '--linger', '2') as peer:
            peer.ready().wait()
            node.stop()
        frames = [row for row in peer.rows('times.csv') if row['what'] == 'tracks']
        expect(len(frames) > 40, f'period {period_s}: {len(frames)} frames of tracks, of 20 with scans')


def test_detections(work):
    """Detections of another detector come into the tracker."""
    race = make_race(work, 3)
    with Node(work) as node, Peer(work, race, node, '--external', '--linger', '1.5') as peer:
        peer.ready().wait()
        line = [line for line in peer.diagnostics().splitlines() if ' overtake: detections:' in line][-1]
        expect(int(value_of(line, 'received')) >= 55 and value_of(line, 'refused') == '0', line)
        node.stop()
    # A push that comes before the scans of its time makes their frame an insertion, whose tracks have the push's stamp.
    frames = [row['stamp_ns'] for row in peer.rows('times.csv') if row['what'] == 'tracks']
    expect(len(frames) >= 115, f'{len(frames)} iterations of the tracker: those of 60 frames and of 60 pushes')


def test_interop(work):
    interop(work, 10)


def test_interop_long(work):
    interop(work, 60, 'las_vegas_15')


def test_messages(_):
    """messages.idl and the .msg files of overtake_msgs have the same fields in the same order."""
    folder = pathlib.Path(__file__).resolve().parents[2] / 'tools' / 'ros2'
    idl = (folder / 'messages.idl').read_text()
    types = {'double': 'float64', 'octet': 'uint8', 'long': 'int32', 'unsigned long': 'uint32', 'string': 'string',
             'unsigned long long': 'uint64', 'builtin_interfaces::msg::dds_::Time_': 'builtin_interfaces/Time',
             'std_msgs::msg::dds_::Header_': 'std_msgs/Header', 'sequence<Track_>': 'Track[]'}
    for message, count in (('Track', 22), ('Tracks', 7)):
        body = re.search(rf'struct {message}_ \{{(.*?)\}};', idl, re.S)[1]
        of_idl = [(types[kind] + (size or ''), field)
                  for kind, field, size in re.findall(r'(\S[^;\n]*?) (\w+)(\[\d+\])?;', body)]
        lines = [line.split('#')[0] for line in (folder / f'overtake_msgs/msg/{message}.msg').read_text().splitlines()]
        of_msg = [tuple(line.split()) for line in lines if line.strip() and '=' not in line]
        expect(of_idl == of_msg and len(of_idl) == count, f'{message}: {set(of_idl) ^ set(of_msg)}')


if not peer_program and name != 'messages':
    print(f'skipped: ros2_{name}: no Cyclone DDS, or no Fast DDS with fastddsgen (tools/setup --ros2)')
    sys.exit(77)
with tempfile.TemporaryDirectory() as folder:
    try:
        globals()[f'test_{name}'](pathlib.Path(folder))
    except Failure as failure:
        sys.exit(f'FAILED: ros2_{name}: {failure}')
print('passed')
