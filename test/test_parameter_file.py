# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A parameter file says the same to the library and to a node, whatever is in it."""

import re

from linkage_ros import scene
from linkage_ros.scene.parameter_file import overrides, sections
import numpy as np
import pytest
from rcl_interfaces.msg import ParameterDescriptor
import rclpy
from rclpy.node import Node
from scenes import ROOT

# `{b:1}` is left out: libyaml reads it one way or another, by its version.
VALUES = r"""
1e-2 1E5 1_0 1:30 010 0x1F 08 +5 -5 nan .nan .inf -.inf +.inf inf Infinity -0 -0.0
9223372036854775807 ~ null "" '' "5" '1.5' !!str !!float
yes No ON y N TRUE tRUE [] {} [1,2] [0,1.5] [1.5,0] [1.5,.5] [true,no] [1,true] [a,b] [a,1] [[1]]
[[1],[2]] [1,2 *x &x 1. .5 1e5. 0x1p3 0X1.8P1 0x 0b11 0o17 << nan(1) !custom 08.5 00 --5 +.nan -nan
2.2250738585072014e-308 - | @x `x %x text a.b 1,5 1d 1e 2026-11-22 #
""".split() + [
    '!!str 5', '!!float 5', '!custom 3', '{b: 1}', '{b: {c: 1}, d: 2}', '{b.c: {d: 1}, e: 2}',
    '- 5', '&x 5', '|-\n      5', '|\n      5', '>\n      text', '[{a: 1}]', '{[1]: 2}', '? 3',
    '"a: 1"', '{a: [1, 2.0]}', '"\\u0041"', '0.1 # so', '[nan, 1.0]', '  7  ', 'a b', '']
# What ROS reads in a surprising way, such as 010 as 8, and what it refuses, too.
REFUSED = set(r"""
010 08 00 nan inf Infinity -nan nan(1) 0x1p3 0X1.8P1 !!str !!float !custom {} [0,1.5] [1.5,0]
[1,true] [a,1] [[1]] [[1],[2]] [1,2 *x &x - | @x `x %x #
""".split()) | {
    '!!str 5', '!!float 5', '!custom 3', '- 5', '>\n      text',
    '|-\n      5', '|\n      5', '[{a: 1}]', '{[1]: 2}', '? 3',
    '{a: [1, 2.0]}', '[nan, 1.0]', '{b.c: {d: 1}, e: 2}', ''}
# What every node has.
OF_ROS = 'use_sim_time', 'start_type_description_service'
SECTIONS = ['/**', '**', '/kinematics', 'kinematics', '/**/kinematics', '/*', '*', '/*/kinematics',
            'other', '/robot/kinematics', '/crank_driver', '5', 'a b', '/:\n  kinematics', '//a']
NAMES = ['a', 'b', 'a.b', 'rate', 'm', '"c"', '1', 'm.crank.speed', '""']


def written(rng):
    """Return a file of odd values, in odd sections and, now and then, broken."""
    def parameters(indent, depth=0):
        for _ in range(rng.integers(1, 4)):
            name = NAMES[rng.integers(len(NAMES))] if rng.random() < 0.97 else '? [x]'
            if depth < 3 and rng.random() < 0.25:
                yield f'{indent}{name}:'
                yield from parameters(indent + '  ', depth + 1)
            else:
                yield f'{indent}{name}: {VALUES[rng.integers(len(VALUES))]}'

    lines = []
    for _ in range(rng.integers(1, 4)):
        section = SECTIONS[rng.integers(len(SECTIONS)) if rng.random() < 0.4 else rng.integers(6)]
        indent = '    ' if '\n' in section else '  '
        lines += [f'{section}:', f'{indent}ros__parameters:', *parameters(indent + '  ')]
        lines += ['---'] * (rng.random() < 0.1)
    if rng.random() < 0.15:
        del lines[rng.integers(len(lines))]
    return '\n'.join(lines) + '\n' * (rng.random() < 0.9)


def of_ros(path, name, expected):
    """Return what a node is given by a file, or why it is not started."""
    arguments = {'cli_args': ['--ros-args', '--params-file', str(path)], 'enable_rosout': False,
                 'use_global_arguments': False, 'start_parameter_services': False}
    try:
        node = Node(name, allow_undeclared_parameters=True,
                    automatically_declare_parameters_from_overrides=True, **arguments)
        parameters = node.get_parameters_by_prefix('')
    except Exception as error:
        refused = re.search(r'Error: (.*?)\s*, at /', str(error), re.DOTALL)
        if refused:
            return refused[1]
        # An empty list has no type, and is declared only by name.
        node = Node(name, **arguments)
        dynamic = ParameterDescriptor(dynamic_typing=True)
        parameters = {key: node.declare_parameter(key, None, dynamic) for key in expected}
    node.destroy_node()
    return {key: list(parameter.value) if hasattr(parameter.value, 'tolist') else parameter.value
            for key, parameter in parameters.items() if key not in OF_ROS}


def alike(ros, ours):
    """Return whether values are the same, with their types."""
    return not isinstance(ros, str) and ros.keys() == ours.keys() and all(
        repr(ros[key]) == repr(ours[key]) for key in ros)


@pytest.fixture(scope='module')
def ros():
    """Start the client library."""
    rclpy.init(args=[])
    yield
    rclpy.shutdown()


def check(path, text):
    """Read a file both ways, for two nodes; return whether the library accepts it."""
    path.write_text(text)
    for node in ('kinematics', 'crank_driver'):
        try:
            own = overrides(sections(str(path)), f'/{node}')
        except scene.SceneError as error:
            assert 'is not a valid ROS parameter file' in str(error)
            return False
        theirs = of_ros(path, node, own)
        assert alike(theirs, own), (text, theirs, own)
    return True


def test_every_value_is_the_same_to_the_library_and_to_a_node(ros, tmp_path):
    accepted = [value for value in VALUES if value not in REFUSED]
    # A node with an empty list can be asked for parameters by their names only.
    for values in ([value for value in accepted if value != '[]'], ['[]']):
        lines = [f'    a{i}: {value}\n' for i, value in enumerate(values)]
        assert check(tmp_path / 'file.yaml', '/**:\n  ros__parameters:\n' + ''.join(lines))


def test_a_value_that_ros_refuses_or_reads_in_a_surprising_way_is_refused(tmp_path):
    for value in REFUSED:
        assert not check(tmp_path / 'file.yaml',
                         f'/**:\n  ros__parameters:\n    a: {value}\n    b: 1\n'), value


@pytest.mark.parametrize('first', [0, *(pytest.param(n, marks=pytest.mark.nightly)
                                        for n in range(100, 1200, 100))])
def test_odd_files_are_the_same_to_the_library_and_to_a_node(ros, tmp_path, first):
    for seed in range(first, first + 100):
        check(tmp_path / 'file.yaml', written(np.random.default_rng(seed)))


def test_every_file_of_the_package_is_the_same_to_the_library_and_to_a_node(ros, tmp_path):
    files = [path for folder in ('config', 'examples', 'pictures', 'test')
             for path in (ROOT / folder).rglob('*.yaml') if 'ros__parameters' in path.read_text()]
    assert len(files) > 10
    for path in files:
        assert check(tmp_path / 'file.yaml', path.read_text()), path


def test_a_section_for_one_node_counts_where_that_node_s_value_does(tmp_path):
    path = tmp_path / 'file.yaml'
    path.write_text("""
/**:
  ros__parameters: {mechanisms: [jansen], rate: 10.0, jansen.scale: 0.5}
/crank_driver:
  ros__parameters: {rate: 1e2, jansen.crank.speed: 2.5}
kinematics:
  ros__parameters: {jansen.scale: 2.0, rate: 7.0}
/robot/kinematics:
  ros__parameters: {jansen.scale: 3.0}
""")
    loaded = scene.load(str(path))
    assert (loaded.rate, loaded.mechanisms['jansen'].first.speed) == (100.0, 2.5)
    assert loaded.mechanisms['jansen'].scale == 2.0
