# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Commands for actuators from what is wanted of outputs, message by message or ahead of time."""

from itertools import chain
import math
import time
from typing import Any, Callable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from . import joint_state_reader
from .message_layout import NEVER, pack, unpack, Unreadable, Wire
from .messages import JointStates
from ..scene.inverse_request import InverseRequest
from ..scene.joint_names import JointName
from ..scene.machine import Machine
from ..words import elided

SECONDS_BETWEEN_WARNINGS, SECONDS_BETWEEN_SEARCHES = 5.0, 0.5
# So many arrangements of commands are remembered.
MOST_WIRES = 100


class Route(NamedTuple):
    """From a mechanism's outputs, as others call them, to the actuators that move them."""

    called: str
    machine: Machine
    wanted: Any
    places: Tuple[int, ...]
    names: Tuple[JointName, ...]

    @property
    def actuators(self):
        """What moves its inputs: of one that is measured elsewhere, the input itself."""
        return [f'{self.machine.name}_{drive.input.name}' if drive.measures else drive.source
                for drive in self.machine.inputs.values()]

    def commanded(self, positions, speeds, near, jumps):
        """Return what `InverseRequest.command` does, for what a message says [rad or m]."""
        return self.wanted.command(
            self._meant(positions),
            speeds and [name.sign * speeds[place] for name, place in zip(self.names, self.places)],
            near, jumps)

    def reason(self, positions):
        """Return in words why positions cannot be had."""
        said = ', '.join(f'{positions[place]:.6g}' for place in self.places)
        return f'{self.called} cannot be {said}: {self.wanted.reason(*self._meant(positions))}'

    def _meant(self, positions):
        return [name.sign * (positions[place] - name.offset)
                for name, place in zip(self.names, self.places)]


class Command(NamedTuple):
    """What a mechanism's actuators are to do, and its inputs there [rad or m]; speeds if known."""

    route: Route
    inputs: Sequence[float]
    positions: Sequence[float]
    speeds: Optional[Sequence[float]]

    @property
    def efforts(self) -> List[float]:
        """What actuators give at rest against the loads [N m or N]; 0 where there are none."""
        machine = self.route.machine
        if not machine.loads:
            return [0.0] * len(self.inputs)
        return [drive.actuator[0] * effort for drive, effort in zip(
            machine.inputs.values(), machine.efforts(self.inputs))]


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
        From a Machine to where its inputs are; infinite where that is not known.

    """

    def __init__(self, node, mechanisms, present: Callable[[Machine], List[float]]):
        self._present, self._logger, self._clock = present, node.get_logger(), node.get_clock()
        self._commands = node.create_publisher(JointState, 'servo_commands', 10)
        self._arrays = {name: node.create_publisher(Float64MultiArray, f'{name}/commands', 10)
                        for name in mechanisms}
        self._trajectories = node.create_publisher(JointTrajectory, 'servo_trajectory', 10)
        self._message, self._last, self._said, self._next = JointStates(), {}, {}, {}
        node.create_subscription(JointState, 'wanted_states', self._hear, joint_state_reader.ANY,
                                 raw=True)
        node.create_subscription(JointTrajectory, 'wanted_trajectory', self._plan, 10)

    def adopt(self, machines):
        """Act on these mechanisms from now on."""
        self._machines, self._wires = machines, {}
        # The last pose of several inputs may be none of another geometry.
        self._last = {name: last for name, last in self._last.items() if len(last.inputs) == 1
                      or last.route.machine is machines.get(name)}
        self._reader = joint_state_reader.Reader(self._understood)

    def _output(self, called: str) -> Tuple[Machine, str, JointName]:
        """Return whose output others call so, its own name and how that differs."""
        for machine in self._machines.values():
            own = {name.name: (joint, name) for joint, name in machine.joints.items()}
            joint, name = own.get(called) or (
                called.removeprefix(f'{machine.name}_'), JointName(called))
            if joint != called and machine.linkage.has_output(joint):
                return machine, joint, name
        raise ValueError(f'nothing is called {elided(called)}; an output is called '
                         '<mechanism>_<link>, <mechanism>_<joint>.x, or as joint_names has it')

    def _routes(self, names, leave_out) -> List[Route]:
        """Return the ways of outputs; tell `leave_out` why of the others."""
        found, routes = {}, []
        for place, called in enumerate(names):
            try:
                machine, *output = self._output(called)
            except ValueError as error:
                leave_out(str(error))
                continue
            found.setdefault(machine.name, []).append((place, *output))
        for mechanism, outputs in found.items():
            machine = self._machines[mechanism]
            n = len(machine.inputs)
            called = ' and '.join(elided(names[place]) for place, *_ in outputs)
            try:
                if len(outputs) > n == 1:
                    leave_out(f'{called} are moved by one input: name one of them')
                elif len(outputs) != n:
                    raise ValueError(f'{mechanism} has {n} inputs: name as many outputs of it, '
                                     f'not {called}')
                places, joints, own = zip(*outputs[:n])
                routes.append(Route(' and '.join(elided(names[place]) for place in places),
                                    machine, InverseRequest(machine, joints), places, own))
            except ValueError as error:
                leave_out(str(error))
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
        commands = [self._command(route, positions, speeds if known else None)
                    for route in routes]
        if commands := [command for command in commands if command]:
            self._send(pack(self._clock.now().to_msg()) if stamp == NEVER else stamp, commands)

    def _near(self, route) -> List[float]:
        """Return where inputs were last, or are; else where they start."""
        if last := self._last.get(route.machine.name):
            return last.inputs
        return [place if math.isfinite(place) else drive.start for place, drive in zip(
            self._present(route.machine), route.machine.inputs.values())]

    def _command(self, route, positions, speeds) -> Optional[Command]:
        """Return the command for outputs, or the last good one, to be held; None without any."""
        last = self._last.get(route.machine.name)
        # Before the first command, which may be anywhere: that takes a search, so now and then.
        jumps = not last and time.monotonic() > self._next.get(route.machine.name, -math.inf)
        command = Command(route, *route.commanded(positions, speeds, self._near(route), jumps))
        if jumps:
            self._next[route.machine.name] = time.monotonic() + SECONDS_BETWEEN_SEARCHES
        if all(map(math.isfinite, command.inputs)):
            self._last[route.machine.name] = command
            return command
        if time.monotonic() > self._said.get(route.called, -math.inf) + SECONDS_BETWEEN_WARNINGS:
            self._warn(route.called, route.reason(positions))
        return last and last._replace(speeds=[0.0] * len(last.inputs))

    def _send(self, stamp, commands):
        names = tuple(name for command in commands for name in command.route.actuators)
        values = [position for command in commands for position in command.positions]
        speeds = [speed for command in commands for speed in command.speeds or [math.nan]]
        moving = all(map(math.isfinite, speeds))
        if self._commands.get_subscription_count():
            if any(command.route.machine.loads for command in commands):
                efforts = [effort for command in commands for effort in command.efforts]
                self._commands.publish(self._message.message(
                    unpack(stamp), names, values, speeds if moving else (),
                    () if any(map(math.isnan, efforts)) else efforts))
            else:
                self._wire(names, moving).send(stamp, np.array(values + speeds * moving))
        for command in commands:
            publisher = self._arrays[command.route.machine.name]
            if publisher.get_subscription_count():
                publisher.publish(Float64MultiArray(data=command.positions))

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
        near = [self._near(route) for route in routes]
        planned = JointTrajectory(header=message.header, joint_names=[
            name for route in routes for name in route.actuators])
        for i, point in enumerate(message.points):
            if len(point.positions) != n or len(point.velocities) not in (0, n):
                raise ValueError(f'point {i} must have {n} positions, and as many velocities or '
                                 f'none, not {len(point.positions)} and {len(point.velocities)}')
            found = []
            for k, route in enumerate(routes):
                near[k], *actuator = route.commanded(
                    point.positions, list(point.velocities) or [0.0] * n, near[k],
                    not (i or route.machine.name in self._last))
                if not all(map(math.isfinite, near[k])):
                    raise ValueError(f'point {i}: {route.reason(point.positions)}')
                if not all(map(math.isfinite, actuator[1])):
                    raise ValueError(f'point {i}: {route.called} turns back there and cannot have '
                                     'a speed other than zero')
                found.append(actuator)
            positions, speeds = (list(chain.from_iterable(part)) for part in zip(*found))
            planned.points.append(JointTrajectoryPoint(
                positions=positions, velocities=speeds if len(point.velocities) else (),
                time_from_start=point.time_from_start))
        return planned


def _refuse(reason):
    raise ValueError(reason)
