# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Commands for actuators from what is wanted of outputs, message by message or ahead of time."""

import math
import time
from typing import Callable, List, NamedTuple, Optional, Tuple

import numpy as np
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from . import joint_state_reader
from .message_layout import NEVER, pack, unpack, Unreadable, Wire
from .messages import JointStates
from .. import scene
from ..scene.wanted import Wanted
from ..words import elided

# What comes while the node is kept waiting is not lost; any source will do.
ANY = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)
SECONDS_BETWEEN_WARNINGS = 5.0
# So many arrangements of commands are remembered.
MOST_WIRES = 100


class Route(NamedTuple):
    """From an output, as others call it, to the actuator that moves it."""

    called: str
    machine: scene.Machine
    actuator: str
    wanted: Wanted
    sign: float
    offset: float

    def commanded(self, position, speed, near):
        """Return what `Wanted.commanded` does, for what others say [rad or m]."""
        return self.wanted.commanded(self.sign * (position - self.offset),
                                     speed and self.sign * speed, near)

    def reason(self, position):
        """Return in words why a position cannot be had."""
        return (f'{self.called} cannot be {position:.6g}: '
                + self.wanted.reason(self.sign * (position - self.offset)))


class Command(NamedTuple):
    """What an actuator is to do, and where it takes its input [rad or m]; its speed if known."""

    actuator: str
    machine: scene.Machine
    input: float
    position: float
    speed: Optional[float]

    @property
    def effort(self) -> float:
        """What it gives at rest against the loads [N m or N]; 0 where there are none."""
        loaded, (ratio, _) = self.machine.loads, self.machine.first.actuator
        return ratio * self.machine.efforts([self.input])[0] if loaded else 0.0


class CommandStream:
    """
    Publishes `servo_commands`, `<mechanism>/commands` and `servo_trajectory`.

    What is wanted comes on `wanted_states` and `wanted_trajectory`. Every answer is the one that
    goes on from the last; what cannot be had leaves its actuator at the last good command.

    Parameters
    ----------
    node : rclpy.node.Node
        Whose topics they are.
    mechanisms : iterable of str
        The mechanisms of its scene.
    present : callable
        From a Wanted to where its input is; infinite if that is not known.

    """

    def __init__(self, node, mechanisms, present: Callable[[Wanted], float]):
        self._present, self._logger, self._clock = present, node.get_logger(), node.get_clock()
        self._commands = node.create_publisher(JointState, 'servo_commands', 10)
        self._arrays = {name: node.create_publisher(Float64MultiArray, f'{name}/commands', 10)
                        for name in mechanisms}
        self._trajectories = node.create_publisher(JointTrajectory, 'servo_trajectory', 10)
        self._message, self._last, self._said = JointStates(), {}, {}
        node.create_subscription(JointState, 'wanted_states', self._hear, ANY, raw=True)
        node.create_subscription(JointTrajectory, 'wanted_trajectory', self._plan, 10)

    def adopt(self, machines):
        """Act on these mechanisms from now on."""
        self._machines, self._wires = machines, {}
        self._reader = joint_state_reader.Reader(self._understood)

    def _route(self, called: str) -> Route:
        """Return the way of an output that others call so; raise ValueError if there is none."""
        for machine in self._machines.values():
            own = {name.name: (joint, name.sign, name.offset)
                   for joint, name in machine.joints.items()}
            joint, sign, offset = own.get(called) or (
                called.removeprefix(f'{machine.name}_'), 1.0, 0.0)
            if joint != called and machine.linkage.has_output(joint):
                drive = machine.first
                actuator = f'{machine.name}_{drive.input.name}' if drive.measures else drive.source
                return Route(called, machine, actuator, Wanted(machine, joint), sign, offset)
        raise ValueError(f'nothing is called {elided(called)}; an output is called '
                         '<mechanism>_<link>, <mechanism>_<joint>.x, or as joint_names has it')

    def _routes(self, names, leave_out) -> List[Tuple[Route, int]]:
        """Return the ways of outputs and their places; tell `leave_out` why of the others."""
        routes, owners = [], {}
        for place, name in enumerate(names):
            try:
                route = self._route(name)
                if other := owners.get(route.machine.name):
                    raise ValueError(f'{other.called} and {elided(name)} are moved by one input: '
                                     'name one of them')
            except ValueError as error:
                leave_out(str(error))
                continue
            owners[route.machine.name] = route
            routes.append((route, place))
        return routes

    def _understood(self, message):
        """Return the ways of what a message has positions for, and whether it has speeds."""
        known = len(message.velocity) == len(message.name)
        return self._routes(message.name[:len(message.position)], lambda reason: self._warn(
            reason, reason)), known

    def _warn(self, about, reason):
        self._logger.warning(f'wanted_states: {reason}')
        self._said[about] = time.monotonic()

    def _hear(self, text):
        publishers = self._commands, *self._arrays.values()
        if not any(publisher.get_subscription_count() for publisher in publishers):
            return
        try:
            stamp, (routes, known), positions, speeds = self._reader.read(text)
        except Unreadable as error:
            self._logger.warning(
                f'wanted_states: {len(text)} bytes that are no joint states are passed over: '
                f'{error}', throttle_duration_sec=SECONDS_BETWEEN_WARNINGS)
            return
        commands = [self._command(route, positions[place], speeds[place] if known else None)
                    for route, place in routes]
        if commands := [command for command in commands if command]:
            self._send(pack(self._clock.now().to_msg()) if stamp == NEVER else stamp, commands)

    def _near(self, route) -> float:
        """Return where an input was last, or is; else where it starts."""
        if last := self._last.get(route.machine.name):
            return last.input
        present = self._present(route.wanted)
        return present if math.isfinite(present) else route.machine.first.start

    def _command(self, route, position, speed) -> Optional[Command]:
        """Return the command for an output, or the last good one, to be held; None without any."""
        found = route.commanded(position, speed, self._near(route))
        if math.isfinite(found[0]):
            command = Command(route.actuator, route.machine, *found)
            self._last[route.machine.name] = command
            return command
        if time.monotonic() > self._said.get(route.called, -math.inf) + SECONDS_BETWEEN_WARNINGS:
            self._warn(route.called, route.reason(position))
        last = self._last.get(route.machine.name)
        return last and last._replace(speed=0.0)

    def _send(self, stamp, commands):
        names = tuple(command.actuator for command in commands)
        values = [command.position for command in commands]
        speeds = [command.speed for command in commands]
        moving = None not in speeds and all(map(math.isfinite, speeds))
        if self._commands.get_subscription_count():
            if any(command.machine.loads for command in commands):
                efforts = [command.effort for command in commands]
                self._commands.publish(self._message.message(
                    unpack(stamp), names, values, speeds if moving else (),
                    () if any(map(math.isnan, efforts)) else efforts))
            else:
                self._wire(names, moving).send(stamp, np.array(values + speeds * moving))
        for command in commands:
            publisher = self._arrays[command.machine.name]
            if publisher.get_subscription_count():
                publisher.publish(Float64MultiArray(data=[command.position]))

    def _wire(self, names, moving) -> Wire:
        n = len(names)
        if len(self._wires) > MOST_WIRES:
            self._wires.clear()
        if (names, moving) not in self._wires:
            self._wires[names, moving] = Wire(
                self._commands, lambda stamp, values: self._message.message(
                    stamp, names, values[:n], values[n:]), (1 + moving) * n, self._logger)
        return self._wires[names, moving]

    def _plan(self, message):
        if not self._trajectories.get_subscription_count():
            return
        try:
            self._trajectories.publish(self._planned(message))
        except ValueError as error:
            self._logger.error(f'wanted_trajectory is refused: {error}')

    def _planned(self, message) -> JointTrajectory:
        """Return the actuators' trajectory; raise ValueError if one point of it cannot be."""
        n = len(message.joint_names)
        routes = self._routes(message.joint_names, _refuse)
        near = [self._near(route) for route, _ in routes]
        planned = JointTrajectory(header=message.header,
                                  joint_names=[route.actuator for route, _ in routes])
        for i, point in enumerate(message.points):
            if len(point.positions) != n or len(point.velocities) not in (0, n):
                raise ValueError(f'point {i} must have {n} positions, and as many velocities or '
                                 f'none, not {len(point.positions)} and {len(point.velocities)}')
            found = []
            for route, place in routes:
                position, speed = point.positions[place], (*point.velocities, *n * [0.0])[place]
                near[place], *actuator = route.commanded(position, speed, near[place])
                if not math.isfinite(near[place]):
                    raise ValueError(f'point {i}: {route.reason(position)}')
                if not math.isfinite(actuator[1]):
                    raise ValueError(f'point {i}: {route.called} turns back at {position:.6g} and '
                                     f'cannot have a speed of {speed:.6g} there')
                found.append(actuator)
            positions, speeds = zip(*found)
            planned.points.append(JointTrajectoryPoint(
                positions=positions, velocities=speeds if len(point.velocities) else (),
                time_from_start=point.time_from_start))
        return planned


def _refuse(reason):
    raise ValueError(reason)
