# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A parameter file says the same to the library and to a node, whatever is in it."""

import re

import numpy as np
import pytest

rclpy = pytest.importorskip('rclpy')
pytest.importorskip('yaml')

from linkage_ros import scene  # noqa: E402
from linkage_ros.scene.parameter_file import overrides  # noqa: E402
from rcl_interfaces.msg import ParameterDescriptor  # noqa: E402
from rclpy.node import Node  # noqa: E402

# `{b:1}` is left out: libyaml reads it one way or another, by its version.
VALUES = r"""
1e-2 1E5 1_0 1:30 010 0x1F 08 +5 -5 nan .nan .inf -.inf +.inf inf Infinity 1e400 1e-400 -0 -0.0
9223372036854775807 9223372036854775808 -9223372036854775809 ~ null "" '' "5" '1.5' !!str !!float
yes No ON y N TRUE tRUE [] {} [1,2] [0,1.5] [1.5,0] [1.5,.5] [true,no] [1,true] [a,b] [a,1] [[1]]
[[1],[2]] [1,2 *x &x 1. .5 1e5. 0x1p3 0X1.8P1 0x 0b11 0o17 << nan(1) !custom 08.5 00 --5 +.nan -nan
5e-324 1e-310 2.2250738585072014e-308 - | @x `x %x text a.b 1,5 1d 1e 2026-11-22 #
""".split() + [
    '!!str 5', '!!float 5', '!custom 3', '{b: 1}', '{b: {c: 1}, d: 2}', '{b.c: {d: 1}, e: 2}',
    '- 5', '&x 5', '|-\n      5', '|\n      5', '>\n      text', '[{a: 1}]', '{[1]: 2}', '? 3',
    '"a: 1"', '{a: [1, 2.0]}', '"\\u0041"', '0.1 # so', '[nan, 1.0]', '  7  ', 'a b', '']
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
    given = {'cli_args': ['--ros-args', '--params-file', str(path)], 'enable_rosout': False,
             'use_global_arguments': False, 'start_parameter_services': False}
    try:
        node = Node(name, allow_undeclared_parameters=True,
                    automatically_declare_parameters_from_overrides=True, **given)
        found = node.get_parameters_by_prefix('')
    except Exception as error:
        refused = re.search(r'Error: (.*?)\s*, at /', str(error), re.DOTALL)
        if refused:
            return refused[1]
        # An empty list has no type, and is declared only by name.
        node = Node(name, **given)
        found = {key: node.declare_parameter(key, None, ParameterDescriptor(dynamic_typing=True))
                 for key in expected}
    node.destroy_node()
    return {key: list(one.value) if hasattr(one.value, 'tolist') else one.value
            for key, one in found.items() if key not in OF_ROS}


def of_ours(path, name):
    """Return the same of the library."""
    try:
        return overrides(str(path), f'/{name}') or {}
    except scene.SceneError as error:
        return str(error)


def alike(ros, ours):
    """Return whether both say the same, or refuse with the same sentence."""
    if isinstance(ros, str) and isinstance(ours, str):
        # Of names that cannot be, ROS has a sentence for each reason.
        return ros in ours or 'node name must not' in ours and re.search('name|slash|token', ros)
    return type(ros) is type(ours) and ros.keys() == ours.keys() and all(
        repr(ros[key]) == repr(ours[key]) for key in ros)


@pytest.fixture(scope='module')
def ros():
    """Start the client library."""
    rclpy.init(args=[])
    yield
    rclpy.shutdown()


def check(path, text):
    """Read a file both ways, for two nodes."""
    path.write_text(text)
    for node in ('kinematics', 'crank_driver'):
        own = of_ours(path, node)
        theirs = of_ros(path, node, own)
        assert alike(theirs, own), (text, theirs, own)


@pytest.mark.sample(12)
@pytest.mark.parametrize('value', VALUES)
def test_a_value_is_the_same_to_the_library_and_to_a_node(ros, tmp_path, value):
    check(tmp_path / 'file.yaml', f'/**:\n  ros__parameters:\n    a: {value}\n    b: 1\n')


@pytest.mark.parametrize('first', [0, *(pytest.param(n, marks=pytest.mark.long)
                                        for n in range(100, 1200, 100))])
def test_odd_files_are_the_same_to_the_library_and_to_a_node(ros, tmp_path, first):
    for seed in range(first, first + 100):
        check(tmp_path / 'file.yaml', written(np.random.default_rng(seed)))


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
    found = scene.load(str(path))
    assert (found.rate, found.machines['jansen'].first.speed) == (100.0, 2.5)
    assert found.machines['jansen'].scale == 2.0
