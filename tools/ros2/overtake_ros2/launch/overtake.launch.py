# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# ros2 launch overtake_ros2 overtake.launch.py rig:=racecar rviz:=true
#
# Starts the program `overtake` (on the PATH), which needs no ROS libraries, and RViz if wanted.
import os
import re

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

SHARE = get_package_share_directory('overtake_ros2')


def has_rig(config):
    if not config:
        return False
    with open(config, encoding='utf-8') as file:
        return re.search(r'^\s*(rig\s*=|\[rig\])', file.read(), re.M) is not None


def start_node(context):
    def value(name):
        return LaunchConfiguration(name).perform(context)
    words = [value('program'), 'node']
    if not value('rig') and not has_rig(value('config')):
        words += ['--rig', 'racecar']
    for option in ('rig', 'preset', 'map', 'config', 'namespace'):  # an option has the last word, so none by default
        if value(option):
            words += [f'--{option}', value(option)]
    for remap in value('remap').split():
        words += ['--remap', remap]
    if value('use_sim_time') == 'true':
        words.append('--use-sim-time')
    return [ExecuteProcess(cmd=words, output='screen', sigterm_timeout='5')]


def generate_launch_description():
    arguments = [('program', 'overtake'), ('rig', ''), ('preset', ''), ('map', ''), ('config', ''),
                 ('namespace', ''), ('remap', ''), ('use_sim_time', 'false'), ('rviz', 'false')]
    return LaunchDescription(
        [DeclareLaunchArgument(name, default_value=default) for name, default in arguments] +
        [OpaqueFunction(function=start_node),
         Node(package='rviz2', executable='rviz2', arguments=['-d', os.path.join(SHARE, 'rviz', 'overtake.rviz')],
              condition=IfCondition(LaunchConfiguration('rviz')))])
