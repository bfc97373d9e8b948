# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""The package as colcon, pip and a reader of the changelog see it."""

from importlib.metadata import EntryPoint
from pathlib import Path
import re
import runpy
import shutil
import subprocess
import xml.etree.ElementTree as ElementTree

import pytest
import setuptools

ROOT = Path(__file__).parents[1]


@pytest.fixture
def arguments(monkeypatch):
    """Return what setup.py hands to setup()."""
    handed = {}
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(setuptools, 'setup', handed.update)
    runpy.run_path('setup.py')
    return handed


def manifest(folder):
    return ElementTree.parse(ROOT / folder / 'package.xml')


def test_all_files_name_one_version(arguments):
    version = manifest('.').findtext('version')
    changelog = (ROOT / 'CHANGELOG.rst').read_text()
    released = re.findall(r'^(\d+\.\d+\.\d+) \(\d{4}-\d\d-\d\d\)\n-+$', changelog, re.MULTILINE)
    assert manifest('linkage_interfaces').findtext('version') == version
    assert arguments['version'] == version
    assert released[0] == version


def test_setup_names_the_package_of_the_manifest(arguments):
    assert arguments['name'] == manifest('.').findtext('name')
    assert arguments['license'] == manifest('.').findtext('license')
    assert 'linkage_ros.mechanisms' in arguments['packages']
    assert all(name.split('.')[0] == 'linkage_ros' for name in arguments['packages'])


def test_every_executable_can_be_called(arguments):
    pytest.importorskip('rclpy')
    lines = arguments['entry_points']['console_scripts']
    executables = [EntryPoint(*re.split(r'\s*=\s*', line), 'console_scripts') for line in lines]
    assert {'crank_driver', 'kinematics', 'servo_inverse'} <= {e.name for e in executables}
    assert all(callable(e.load()) for e in executables)


@pytest.mark.skipif(not shutil.which('colcon'), reason='colcon is not installed')
def test_colcon_finds_both_packages_and_their_build_types():
    found = subprocess.run(['colcon', '--log-base', '/dev/null', 'list'], cwd=ROOT, timeout=60,
                           check=True, capture_output=True, text=True).stdout
    assert {tuple(line.split('\t')) for line in found.splitlines()} == {
        ('linkage_interfaces', 'linkage_interfaces', '(ros.ament_cmake)'),
        ('linkage_ros', '.', '(ros.ament_python)')}
