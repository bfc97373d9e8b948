# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The crank driver as a node: what it publishes, when, and what may be changed meanwhile."""

import math

from linkage_ros.nodes.crank_driver import CrankDriver
from linkage_ros.nodes.scene_node import Executor
import pytest
from pytest import approx
from rclpy.clock import ClockType
from rclpy.duration import Duration
from rclpy.parameter import Parameter
from rclpy.time import Time
from ros_harness import Graph
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

SECOND = 10 ** 9


DROP = {'mechanisms': ['drop'], 'drop.type': 'water_drop', 'use_sim_time': True}
CELL = {'mechanisms': ['cell'], 'cell.type': 'peaucellier', 'use_sim_time': True}


class Driver:
    """A crank driver on simulated time."""

    def __init__(self, graph, parameters, **kwargs):
        self.node = graph.start(CrankDriver, parameters, **kwargs)
        self._graph = graph
        self._heard = graph.listen(JointState, 'crank_states')
        self._clock = graph.node.create_publisher(Clock, '/clock', 10)

    def _tick(self, now):
        """Set the simulated time [ns] that the nodes see."""
        self._clock.publish(Clock(clock=Time(nanoseconds=now).to_msg()))

    def at(self, now):
        """Return position and velocity in the message with a stamp [ns]."""
        def message():
            self._tick(now)
            return [m for m in self._heard if m.header.stamp.sec * SECOND
                    + m.header.stamp.nanosec == now]

        state = self._graph.until(message)[0]
        return state.position[0], state.velocity[0]

    def back_to(self, now):
        """Set the time back and let the node notice."""
        def noticed():
            self._tick(now)
            return self.node.get_clock().now().nanoseconds == now

        self._graph.until(noticed)

    def set(self, **values):
        """Set parameters; return the result."""
        return self._graph.set(self.node, **values)


# Parameters; then times [s] with the position and the speed at that time, a time to which the
# clock goes back, or what is set.
MOTIONS = {
    'start plus speed times time, a turn taken off': (
        {**DROP, 'drop.crank.speed': 2.0, 'drop.crank.start': 0.5},
        (5, (0.5, 2.0)), (6, (2.5, 2.0)), (9, (approx(8.5 - math.tau, abs=1e-15), 2.0))),
    'a motor has a ratio and an offset, and a sweep is a triangle wave': (
        {**DROP, 'drop.crank.ratio': -0.25, 'drop.crank.offset': 1.0, 'drop.crank.speed': -1.0,
         'drop.crank.sweep': [-0.5, 1.0]}, (1, (4.0, 4.0)), (1.25, (5.0, 4.0)),
        (1.75, (5.0, -4.0)), (3.25, (1.0, 4.0))),
    'a joint that moves two inputs does what the last of them says': (
        {**DROP, 'mechanisms': ['drop', 'bars'], 'bars.type': 'four_bar',
         'bars.crank.source': 'drop_crank', 'bars.crank.speed': -0.5, 'bars.crank.start': 2.0},
        (1, (2.0, -0.5)), (2, (1.5, -0.5))),
    'an end of a range may be rounded': (
        DROP, {'drop__crank__speed': 100.00001}, (1, (0.0, 100.00001))),
    'simulated time may leap ahead': (
        DROP, (1, (0.0, 1.0)), (3601, (approx(3600.0 % math.tau, abs=1e-12), 1.0))),
    'time that goes back makes no jump': (
        DROP, (100, (0.0, 1.0)), (102, (2.0, 1.0)), 50, (51, (2.0, 1.0)), (52, (3.0, 1.0))),
    **{f'a rate of {rate:g}': ({**DROP, 'rate': rate}, {'rate': 100.0}, (1, (0.0, 1.0)))
       for rate in (5e-324, 1e-300, 1e-9)}}


@pytest.mark.parametrize('parameters, steps', [(first, rest) for first, *rest in MOTIONS.values()],
                         ids=MOTIONS)
def test_the_crank_moves_as_the_parameters_say(parameters, steps):
    with Graph(executor=Executor) as graph:
        driver = Driver(graph, parameters)
        for step in steps:
            if isinstance(step, dict):
                assert driver.set(**step).successful
            elif isinstance(step, int):
                driver.back_to(step * SECOND)
            else:
                assert driver.at(round(step[0] * SECOND)) == step[1]


def test_a_new_dimension_keeps_the_crank_in_its_new_reach(graph):
    driver = Driver(graph, {**CELL, 'cell.crank.speed': 0.0, 'cell.crank.start': 1.1})
    assert driver.at(SECOND) == (1.1, 0.0)
    graph.change(driver.node, CELL, cell__dimensions__r=2.6)
    (_, end), = driver.node.scene.mechanisms['cell'].first.reach
    assert 0.0 < driver.at(2 * SECOND)[0] < end < 1.0
    assert driver.set(cell__crank__start=0.25).successful
    assert driver.at(3 * SECOND) == (0.25, 0.0)


def test_a_new_dimension_makes_the_crank_turn_twice_before_poses_repeat(graph):
    # With c = 1.5 the longest and the shortest bar are as long as the other two.
    bars = {'mechanisms': ['bars'], 'bars.type': 'custom', 'bars.dimensions.c': 1.6,
            'use_sim_time': True, 'bars.joints': [
                'O ground 0 0', 'Q ground 3 0', 'A crank O 1', 'B dyad A Q 2.5 c left']}
    driver = Driver(graph, bars)
    assert driver.at(SECOND) == (0.0, 1.0) and driver.at(3 * SECOND) == (2.0, 1.0)
    graph.change(driver.node, bars, bars__dimensions__c=1.5)
    for now, angle in (6, 5.0), (9, 8.0), (15, approx(14.0 - 2.0 * math.tau, abs=1e-12)):
        assert driver.at(now * SECOND) == (angle, 1.0)
    graph.change(driver.node, bars, bars__dimensions__c=1.6)
    assert driver.at(22 * SECOND)[0] == approx(21.0 % math.tau, abs=1e-12)


def test_a_rate_of_0_sends_nothing_until_it_is_changed(graph):
    driver = Driver(graph, {**DROP, 'rate': 0.0})
    timer = next(timer for timer in driver.node.timers if timer.clock == driver.node.get_clock())
    assert timer.is_canceled()
    assert driver.set(rate=100.0).successful
    assert driver.at(SECOND) == (0.0, 1.0)
    assert driver.set(rate=0.0).successful and timer.is_canceled()
    assert driver.set(rate=100.0).successful
    assert driver.at(3 * SECOND) == (2.0, 1.0)


class OnSystemTime(CrankDriver):
    """A crank driver on a machine whose clock can be set: `set_by` is by how much."""

    set_by = Duration()

    def system_time(self):
        """Return what a clock says that has been set [ns]."""
        return CrankDriver.system_time() + self.set_by.nanoseconds


@pytest.fixture
def on_system_time(graph):
    """Return a crank driver whose clock can be set, and what it sends; it has sent something."""
    node = graph.start(OnSystemTime, {'mechanisms': ['drop'], 'drop.type': 'water_drop'})
    messages = graph.listen(JointState, 'crank_states')
    graph.until(lambda: len(messages) > 2)
    return node, messages


@pytest.mark.parametrize('seconds, speed', [(3600, 1.0), (-1000, 1.0), (1000, 0.5)])
def test_system_time_that_is_set_makes_no_jump_not_even_amid_a_change(
        graph, on_system_time, seconds, speed):
    node, messages = on_system_time
    before = messages[-1].position[0]
    node.set_by = Duration(seconds=seconds)
    if speed != 1.0:
        assert node.set_parameters([Parameter('drop.crank.speed', value=speed)])[0].successful
    del messages[:]
    now = node.system_time()
    graph.until(lambda: [m for m in messages if abs(
        m.header.stamp.sec * SECOND + m.header.stamp.nanosec - now) < 100 * SECOND][2:])
    for message in messages:
        assert 0.0 <= (message.position[0] - before) % math.tau < 2.0
    assert message.velocity[0] == speed


def test_no_timer_waits_for_a_time_that_system_time_was_set_back_from(on_system_time):
    node, _ = on_system_time
    assert {timer.clock.clock_type for timer in node.timers} == {ClockType.STEADY_TIME}
