# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The package as colcon, pip and a reader of the changelog see it."""

import configparser
from importlib.metadata import EntryPoint
import json
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
import zipfile

import pytest

ROOT = Path(__file__).parents[1]


def manifest(folder):
    return ElementTree.parse(ROOT / folder / 'package.xml')


def test_all_files_name_one_package_and_version():
    settings = configparser.ConfigParser()
    settings.read(ROOT / 'setup.cfg')
    of_ros, of_services = manifest('.'), manifest('linkage_interfaces')
    for key in ('name', 'license', 'version'):
        assert settings['metadata'][key] == of_ros.findtext(key)
    version, newest = of_ros.findtext('version'), r'^(\d+\.\d+\.\d+) \((\d{4}-\d\d-\d\d)\)\n-+$'
    changes, services = ((ROOT / folder / 'CHANGELOG.rst').read_text()
                         for folder in ('.', 'linkage_interfaces'))
    named, day = re.search(newest, changes, re.MULTILINE).groups()
    assert named == version == of_services.findtext('version')
    assert f'\n{version} ({day})\n---' in services
    assert f"\nversion: {version}\ndate-released: '{day}'\n" in (ROOT / 'CITATION.cff').read_text()
    urls = [{url.get('type'): url.text for url in each.iter('url')}
            for each in (of_ros, of_services)]
    assert urls[0] == urls[1] and set(urls[0]) == {'website', 'repository', 'bugtracker'}


def without_comments(text):
    return re.sub(r'^ *#.*', '', text, flags=re.MULTILINE)


PROMISES = [(ROOT / name).read_text() for name in ('README.md', 'CONTRIBUTING.md')]
SCRIPT, WORKFLOW = ((ROOT / name).read_text() for name in ('.ci/run', '.github/workflows/ci.yml'))
PROGRAM = (r'((?:make|ros2|colcon|rosdep) [a-z-]+|python -m [\w.]+|python \w+/[\w./]+|bloom-\w+'
           r'|(?:source|pip|git|pre-commit)(?= [a-z.-])|catkin_\w+|\.ci/run)')


def test_what_is_promised_is_run_or_is_said_not_to_be():
    named = set(re.findall(rf'(?:`|^ *\$ |^    |&& ){PROGRAM}', ''.join(PROMISES), re.MULTILINE))
    excused = set(re.findall(r'^#   ([\w. -]+): .+', SCRIPT, re.MULTILINE))
    run = set(re.findall(rf'(?:^|run: |&& |\| ) *(?:timeout .*? )?(?:xvfb-run )?{PROGRAM}',
                         without_comments(SCRIPT + WORKFLOW), re.MULTILINE))
    assert len(named) > 15 and {'make test', 'colcon build', 'ros2 launch'} <= run
    assert named - run == excused | {'.ci/run'}, (named - run) ^ excused


def test_the_workflow_runs_what_has_to_be_green():
    made, by_workflow = (set(re.findall(r'\bmake (\w+)', without_comments(text)))
                         for text in (SCRIPT, WORKFLOW))
    # Its alone: the nodes without llvmlite, the nightly tests, the peers, the demo, and linters
    # that are no Python packages.
    assert by_workflow == made | {'ready', 'nodes', 'nightly', 'verify', 'demo', 'ctidy'}
    assert all((ROOT / script).exists() for script in re.findall(r'\.ci/\w+', WORKFLOW))
    jobs = pytest.importorskip('yaml').safe_load(WORKFLOW)['jobs']
    distros = {file.stem for file in (ROOT / 'wheels').glob('*.txt')
               if 'ros-rclpy' in file.read_text()}
    for name in ('test', 'ros', 'nightly', 'ros2_control'):
        assert set(jobs[name]['strategy']['matrix']['distro']) == distros, name


def pins(file):
    """Return (package, version, whether there is a hash) of each line of a requirement file."""
    pin = re.compile(r'([\w.-]+)(?:\[\w+\])?==([\w.+!]+)(.*--hash=sha256:[0-9a-f]{64})?')
    lines = without_comments(file.read_text()).replace('\\\n', ' ').splitlines()
    pins_ = [pin.match(line).groups() for line in lines if line.strip()]
    return [(name.lower(), version, bool(hashed)) for name, version, hashed in pins_]


def test_all_that_make_installs_is_locked_with_hashes():
    makefile, script = ((ROOT / name).read_text() for name in ('Makefile', 'wheels/install.sh'))
    assert not re.search(r'pip\b.* install', makefile)
    # Given an extra, pip 23.2 looks for the newest release, whatever is pinned: hence --no-deps.
    assert re.findall(r'pip install.*', script) == [
        'pip install -q --no-deps --require-hashes --no-build-isolation "$@" \\']
    locked = {file: pins(file) for file in (ROOT / 'wheels' / 'lock').glob('*.txt')}
    assert all(pins_ and all(hashed for *_, hashed in pins_) for pins_ in locked.values())
    direct = [*(ROOT / 'wheels').glob('*.txt'), ROOT / 'docs' / 'requirements.txt',
              *(ROOT / 'benchmark').glob('*.txt')]
    assert {pin[:2] for file in direct for pin in pins(file)} <= {
        pin[:2] for pins_ in locked.values() for pin in pins_}


def test_actions_are_pinned_by_commit():
    used = re.findall(r'uses: (.*)', WORKFLOW)
    assert used and all(re.fullmatch(r'[\w/-]+@[0-9a-f]{40}  # v[\d.]+', use) for use in used)


def test_a_robot_without_a_screen_installs_nothing_to_look_at_it_with():
    names = {element.text for element in manifest('.').getroot() if 'depend' in element.tag}
    assert {'rclpy', 'linkage_interfaces', 'python3-numpy'} <= names
    assert not any(re.search('rviz|matplotlib|aiohttp|rqt|ament_(copy|flake|pep|xml)', name)
                   for name in names)


def test_every_executable_can_be_called(setup_arguments):
    pytest.importorskip('rclpy')
    lines = setup_arguments('install')['entry_points']['console_scripts']
    executables = [EntryPoint(*re.split(r'\s*=\s*', line), 'console_scripts') for line in lines]
    assert {'crank_driver', 'kinematics', 'servo_inverse'} <= {e.name for e in executables}
    assert all(callable(e.load()) for e in executables)


@pytest.mark.parametrize('command', ['bdist_wheel', 'dist_info', 'editable_wheel'])
def test_pip_puts_no_command_on_the_path(setup_arguments, command):
    assert setup_arguments(command)['entry_points'] == {'console_scripts': []}


@pytest.mark.nightly
def test_a_wheel_has_the_library_and_the_page(copy, tmp_path):
    subprocess.run([sys.executable, '-m', 'pip', 'wheel', '-q', '--no-build-isolation',
                    '--no-deps', '-w', tmp_path, copy], check=True, timeout=120)
    wheel, = tmp_path.glob('*.whl')
    with zipfile.ZipFile(wheel) as packed:
        names = packed.namelist()
    assert {f'linkage_ros/{name}' for name in (
        'mechanisms/jansen.py', 'web/page/index.html', 'web/page/vendor/LICENSE', 'py.typed',
    )} <= set(names)


@pytest.mark.nightly
@pytest.mark.skipif(not shutil.which('colcon'), reason='colcon is not installed')
@pytest.mark.parametrize('layout', [
    '', '--merge-install', '--symlink-install',
    '--base-paths src src/linkage_ros/linkage_interfaces'])
def test_the_ordinary_colcon_build_of_a_workspace_is_enough(copy, tmp_path, layout):
    pytest.importorskip('rclpy')
    # What building against wheels needs besides.
    flags = [f'-DCMAKE_PREFIX_PATH={sys.prefix}', f'-DPython3_EXECUTABLE={sys.executable}',
             f'-DCMAKE_PROJECT_INCLUDE={ROOT}/wheels/prefix.cmake', '-DBUILD_TESTING=OFF']
    defaults = tmp_path / 'defaults.yaml'
    defaults.write_text(json.dumps({'build': {'cmake-args': flags}}))
    clean = {key: value for key, value in os.environ.items()
             if not key.endswith('PREFIX_PATH') and key != 'PYTHONPATH'}
    clean['COLCON_DEFAULTS_FILE'] = str(defaults)
    script = f"""
        colcon build {layout} >&2 && source install/setup.bash && cd / &&
        python -c 'from linkage_interfaces.srv import ServoInverse
from linkage_ros.nodes import servo_inverse
print(servo_inverse.__file__, ServoInverse.__module__)' && echo $AMENT_PREFIX_PATH
        """
    ended = subprocess.run(['bash', '-c', script], cwd=tmp_path, env=clean, timeout=300,
                           text=True, capture_output=True)
    assert ended.returncode == 0, ended.stderr
    module, prefixes = ended.stdout.splitlines()
    assert module.startswith(str(tmp_path))
    assert module.endswith('linkage_interfaces.srv._servo_inverse')
    executables = {file.name for prefix in prefixes.split(':')
                   for file in Path(prefix, 'lib', 'linkage_ros').glob('*')}
    assert executables == {'c_code', 'crank_driver', 'from_robot', 'kinematics', 'render', 'scene',
                           'servo_inverse', 'transmission', 'urdf', 'viewer'}


@pytest.mark.nightly(all_but=2)
@pytest.mark.skipif(not shutil.which('make'), reason='make is not installed')
@pytest.mark.parametrize('lines, settings, complaint', [
    ([], {'PYTHON': 'nowhere'}, 'PYTHON=nowhere is no command'),
    (['exit 1'], {}, 'is no Python that runs'),
    (['case "$*" in *version_info*) exit 1;; -V) echo Python 3.9.18; exit;; esac'], {},
     'is Python 3.9.18, but a Python from 3.10 to 3.14 is needed'),
    (['case "$*" in *ensurepip*) exit 1; esac'], {}, 'lacks venv: install python3-venv'),
    ([], {'CXX': 'nowhere'}, 'The compiler nowhere is missing: install gcc and g++'),
    (['case "$*" in *Python.h*) exit 1; esac'], {}, 'lacks its headers: install python3-dev'),
    pytest.param([], {'PIP_INDEX_URL': 'http://127.0.0.1:9'},
                 'The Python package index cannot be reached', marks=pytest.mark.nightly),
    ([], {'PYTHON': '', 'PATH': '../..'}, 'No Python from 3.10 to 3.14 was found')])
def test_the_build_says_in_one_line_what_is_missing(copy, tmp_path, lines, settings, complaint):
    # A Python that is like this one, but for what shell lines do to its arguments.
    python = tmp_path / 'python'
    python.write_text('\n'.join(['#!/bin/bash', *lines, f'exec {sys.executable} "$@"']))
    python.chmod(0o755)
    # A path without any.
    for command in ('bash', 'env', 'find', 'make'):
        (tmp_path / command).symlink_to(shutil.which(command))
    usual = {'PYTHON': str(python), 'PATH': os.environ['PATH'], 'PIP_CONFIG_FILE': os.devnull,
             'PIP_RETRIES': '1'}
    ended = subprocess.run(['make', 'build'], cwd=copy, env={**usual, **settings}, text=True,
                           capture_output=True, timeout=120)
    message, = (line for line in ended.stderr.splitlines() if not line.startswith('make'))
    assert ended.returncode and complaint in message


def test_clean_removes_nothing_that_git_keeps(tracked):
    rule = re.search(r'\trm -rf (.*?)\n\tfind', (ROOT / 'Makefile').read_text(), re.DOTALL)[1]
    removed = {made for pattern in re.findall(r'[\w.*/-]+', rule) for made in ROOT.glob(pattern)}
    assert removed and not [file for file in tracked if removed & {file, *file.parents}]
