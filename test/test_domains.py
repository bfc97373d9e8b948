# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Domains: whatever runs at the same time has its own."""

import os
from pathlib import Path
import socket
import subprocess
import sys

import domains
import pytest

TAKE = """
import sys
import domains
held = [domains.Domain() for _ in range(20)]
print(*(domain.id for domain in held), flush=True)
sys.stdin.read()
"""


def test_what_runs_at_the_same_time_never_shares_a_domain(graph):
    from ros_harness import Graph

    there = {**os.environ, 'PYTHONPATH': str(Path(__file__).parent)}
    with domains.Domain() as own, Graph() as other, subprocess.Popen(
            [sys.executable, '-c', TAKE], text=True, stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, env=there) as process:
        taken = {own.id, graph.context.get_domain_id(), other.context.get_domain_id(),
                 *map(int, process.stdout.readline().split())}
        assert len(taken) == 3 + 20
        process.stdin.close()


@pytest.mark.parametrize('kind, first, apart', [
    (socket.SOCK_STREAM, domains.FIRST_LOCK, 1),
    (socket.SOCK_DGRAM, domains.FIRST_PORT, domains.PORTS_PER_DOMAIN)])
def test_a_domain_that_others_use_is_left_alone(kind, first, apart):
    with domains.Domain() as domain, domains.Domain() as free:
        pass
    with socket.socket(socket.AF_INET, kind) as other:
        other.bind(('', first + apart * domain.id))
        with domains.Domain(iter([domain.id, free.id])) as another:
            assert another.id == free.id


def test_the_locks_are_those_of_the_domain_coordinator():
    coordinator = pytest.importorskip('domain_coordinator.impl')
    assert coordinator.PORT_BASE == domains.FIRST_LOCK
