# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Domains: whatever runs at the same time has its own."""

from itertools import cycle, repeat
import os
from pathlib import Path
import re
import socket
import subprocess
import sys

import domains
import pytest

ROOT = Path(__file__).parents[1]
TAKE = """
import sys
import domains
held = [domains.Domain() for _ in range({count})]
print(*(domain.id for domain in held), flush=True)
sys.stdin.read()
"""


def elsewhere(count):
    """Return another process that holds domains until its input ends."""
    return subprocess.Popen(
        [sys.executable, '-c', TAKE.format(count=count)], text=True, stdin=subprocess.PIPE,
        stdout=subprocess.PIPE, env=dict(os.environ, PYTHONPATH=str(Path(__file__).parent)))


def test_processes_that_run_at_the_same_time_never_share_a_domain():
    others = [elsewhere(15) for _ in range(3)]
    try:
        taken = [int(word) for other in others for word in other.stdout.readline().split()]
        with domains.Domain() as own:
            assert len({*taken, own.id}) == 3 * 15 + 1
    finally:
        for other in others:
            other.communicate(timeout=20)


def test_a_domain_that_was_given_back_can_be_had_again():
    for _ in range(2 * domains.DOMAINS):
        with domains.Domain() as domain:
            assert 1 <= domain.id <= 100


def test_graphs_of_one_process_have_domains_of_their_own(graph):
    from ros_harness import Graph

    with Graph() as other:
        assert other.context.get_domain_id() != graph.context.get_domain_id()


@pytest.mark.parametrize('kind, first, apart', [
    (socket.SOCK_STREAM, domains.FIRST_LOCK, 1),
    (socket.SOCK_DGRAM, domains.FIRST_PORT, domains.PORTS_PER_DOMAIN)])
def test_a_domain_that_others_use_is_left_alone(kind, first, apart, monkeypatch):
    with domains.Domain() as domain:
        theirs = domain.id
    with socket.socket(socket.AF_INET, kind) as other:
        other.bind(('', first + apart * theirs))
        monkeypatch.setattr(domains, 'candidates', cycle(
            [theirs, *(number for number in range(1, 101) if number != theirs)]))
        with domains.Domain() as another:
            assert another.id != theirs


def test_where_all_are_in_use_that_is_said(monkeypatch):
    with domains.Domain() as domain:
        monkeypatch.setattr(domains, 'candidates', repeat(domain.id))
        with pytest.raises(RuntimeError, match='every ROS_DOMAIN_ID from 1 to 100 is in use'):
            domains.Domain()


def test_the_locks_are_those_of_the_domain_coordinator():
    coordinator = pytest.importorskip('domain_coordinator.impl')
    assert coordinator.PORT_BASE == domains.FIRST_LOCK


@pytest.mark.nightly
def test_two_runs_of_the_same_tests_do_not_disturb_each_other():
    pytest.importorskip('rclpy')
    environment = {key: value for key, value in os.environ.items()
                   if not re.match('PYTEST|ROS_DOMAIN_ID', key)}
    runs = [subprocess.Popen(
        [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', 'test/test_kinematics.py',
         '-m', 'not nightly'], cwd=ROOT, env=environment, text=True, stdout=subprocess.PIPE)
        for _ in range(2)]
    said = [run.communicate(timeout=300)[0] for run in runs]
    assert [run.returncode for run in runs] == [0, 0], '\n'.join(said)
