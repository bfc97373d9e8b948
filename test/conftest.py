# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Fixtures; message fields are checked, which is off by default."""

import atexit
from collections import defaultdict
import contextlib
import gc
from importlib.util import find_spec
import math
import os
from pathlib import Path
import re
import runpy
import shutil
import subprocess

from domains import Domain
from hypothesis import settings
import pytest

# Until all tests are collected there is no garbage worth a search.
gc.disable()
os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'
os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
# Matrices are small: numpy's threads would only wait for each other, busily.
os.environ['OPENBLAS_NUM_THREADS'] = '1'
# A failure prints how to repeat it; a run depends on no earlier one.
settings.register_profile('repeatable', database=None, print_blob=True, deadline=None)
settings.load_profile('repeatable')
# Its failures show both sides, as those of tests do.
pytest.register_assert_rewrite('oracle')
# Of whatever a test starts that is not told another.
_domain = Domain()
atexit.register(_domain.release)
os.environ['ROS_DOMAIN_ID'] = str(_domain.id)
# Packages that may be missing, and what files import that need them.
NEEDS = {
    'rclpy': r'rclpy|\w+_msgs|oracle|ros_harness|viewer_harness|linkage_ros\.(?:nodes|web)',
    'linkage_interfaces': r'linkage_interfaces|viewer_harness|linkage_ros\.nodes\.servo_inverse',
    'aiohttp': 'aiohttp|browser|viewer_harness',
    'gmpy2': 'gmpy2|truth|test_(?:operations|robot_files|simulators|urdf)',
    'matplotlib': r'matplotlib|linkage_ros\.render', 'yaml': 'yaml'}
MISSING = [name for name in NEEDS if not find_spec(name)]


def pytest_report_header():
    """Name the packages that are missing."""
    return [f'{name} is not installed: what imports it is left out' for name in MISSING]


def pytest_ignore_collect(collection_path):
    """Leave out files that import what is not installed."""
    imported = '|'.join(NEEDS[name] for name in MISSING)
    if imported and collection_path.suffix == '.py':
        return bool(re.search(
            rf'^(?:from|import) (?:{imported})\b', collection_path.read_text(), re.M)) or None
    return None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Keep `all_but` of the cases of a sweep, evenly spread, out of the nightly tests."""
    sweeps = defaultdict(list)
    for item in items:
        marks = [*item.iter_markers('nightly')]
        if marks and all(mark.kwargs for mark in marks):
            sweeps[item.nodeid.partition('[')[0], marks[0].kwargs['all_but']].append(item)
    for (_, count), cases in sweeps.items():
        for k in range(min(count, len(cases))):
            case = cases[round(k * (len(cases) - 1) / max(count - 1, 1))]
            case.own_markers = [mark for mark in case.own_markers if mark.name != 'nightly']


def pytest_collection_finish():
    """Exclude imports and collected tests from garbage collection, and collect less often."""
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)
    gc.enable()


@pytest.fixture(scope='session')
def tracked():
    """Return the files that git keeps, or would keep."""
    root = Path(__file__).parents[1]
    if not shutil.which('git') or not (root / '.git').exists():
        pytest.skip('no clone')
    listed = subprocess.run(['git', 'ls-files', '-co', '--exclude-standard'], cwd=root, check=True,
                            text=True, capture_output=True).stdout.split()
    return {root / name for name in listed if (root / name).is_file()}


@pytest.fixture
def copy(tracked, tmp_path):
    """Return a copy of what git keeps, in the sources of a workspace."""
    folder = tmp_path / 'src' / 'linkage_ros'
    for file in tracked:
        target = folder / file.relative_to(Path(__file__).parents[1])
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, target)
    return folder


@pytest.fixture
def setup_arguments(monkeypatch):
    """Return a function that returns what setup.py hands to setup() in a command."""
    import setuptools

    def arguments(command):
        arguments_ = {}
        monkeypatch.chdir(Path(__file__).parents[1])
        monkeypatch.setattr('sys.argv', ['setup.py', command])
        monkeypatch.setattr(setuptools, 'setup', arguments_.update)
        runpy.run_path('setup.py')
        return arguments_

    return arguments


@pytest.fixture(scope='module')
def mechanisms(request):
    """Return the mechanisms of the module's SCENE."""
    from linkage_ros import scene

    return scene.read(request.module.SCENE).mechanisms


@pytest.fixture(scope='module')
def library(request, mechanisms, tmp_path_factory):
    """Return the C library of all of them."""
    from c_libraries import shared

    with shared(tmp_path_factory, request.module.__name__) as folder:
        return request.module.compiled(folder, [*mechanisms.values()])


@pytest.fixture
def graph(monkeypatch):
    """Real nodes in this process, in a context and a domain of their own."""
    pytest.importorskip('rclpy')
    from linkage_ros.nodes import log
    from ros_harness import Graph

    # However slow the machine is, what is logged now and then is logged once.
    monkeypatch.setattr(log.Throttle, 'seconds', math.inf)
    with Graph() as one:
        yield one


@pytest.fixture
def show(graph):
    """Return a function that starts a scene with a viewer."""
    from viewer_harness import Show

    with contextlib.ExitStack() as shows:
        yield lambda *args, **kwargs: shows.enter_context(Show(graph, *args, **kwargs))


@pytest.fixture(scope='module')
def lever():
    """Yield a running lever and drop that no test changes, with a page."""
    from ros_harness import Graph
    from viewer_harness import LEVER, Show

    with Graph() as graph, Show(graph, LEVER) as running:
        running.open_page = running.page()
        yield running


@pytest.fixture
def page(lever):
    """Return a page that knows the lever and the drop, and changes neither."""
    return lever.open_page
