# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""After any history the kinematics node publishes what the library says, on every topic."""

import sys

import pytest

pytest.importorskip('rclpy')

from oracle import Bench, history, SCENES  # noqa: E402
from ros_harness import Graph  # noqa: E402

EXECUTORS = ['machine code', 'plain Python']
# Of each scene, with each executor: 240 histories in all, and 10 000.
FEW, MANY = range(10), range(10, 427)


@pytest.fixture(params=EXECUTORS)
def executor(request, monkeypatch):
    """Have machine code, or no llvmlite."""
    if request.param == 'plain Python':
        monkeypatch.setitem(sys.modules, 'llvmlite', None)
    else:
        pytest.importorskip('llvmlite')
    return request.param


@pytest.mark.parametrize('name', SCENES)
@pytest.mark.parametrize('seeds', [FEW, pytest.param(MANY, marks=pytest.mark.long)],
                         ids=['few', 'many'])
def test_whatever_happens_the_node_publishes_what_the_library_says(executor, name, seeds):
    with Graph() as graph:
        bench = Bench(graph, SCENES[name])
        for seed in seeds:
            bench.run(history(SCENES[name], seed))
