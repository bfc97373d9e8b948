# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Convert requested outputs to commands for actuators, one by one or as trajectories."""

from __future__ import annotations

import math
from operator import attrgetter
from typing import Any, Callable, Iterable, Mapping, NamedTuple, Sequence

from rclpy.duration import Duration
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from .log import MAX_NAMES, Once, Throttle
from .message_layout import subscribe, unpack
from .messages import joint_states
from .publishers import TrackedPublisher
from ..scene.inverse_request import ActuatorCommand, InverseRequest
from ..scene.joint_names import JointName
from ..scene.scene_mechanism import SceneMechanism
from ..words import join_names, n_inputs, truncated

# Maximum number of points of a trajectory, which take the worker some seconds.
MAX_POINTS = 10_000


class Target(NamedTuple):
    """The requested outputs of a mechanism, and their solver."""

    # Names of the outputs in the message, for texts.
    named: str
    mechanism: SceneMechanism
    request: InverseRequest
    # Index in the message, and published name with sign and offset, of each output.
    indices: tuple[int, ...]
    names: tuple[JointName, ...]

    @property
    def actuators(self) -> list[str]:
        """Names of the joints to command, per input: its source or, if that measures, itself."""
        return [f'{self.mechanism.name}_{settings.input.name}' if settings.measures
                else settings.source for settings in self.mechanism.inputs.values()]

    def command(self, positions: Sequence[float], speeds: Sequence[float] | None,
                seed: Sequence[float], jumps: bool) -> ActuatorCommand:
        """Solve for the positions and speeds in a message; see `InverseRequest.command`."""
        return self.request.command(
            self._values(positions),
            speeds and [name.sign * speeds[i] for name, i in zip(self.names, self.indices)],
            seed, jumps)

    def efforts(self, command: ActuatorCommand) -> list[float]:
        """Return the static efforts of the actuators that balance the loads [N m or N]."""
        return [settings.actuator[0] * effort for settings, effort in zip(
            self.mechanism.inputs.values(), self.mechanism.efforts(command.inputs))]

    def reason(self, positions: Sequence[float], is_searched: bool) -> str:
        """Explain why the positions in a message are out of reach; some reasons are searched."""
        values = self._values(positions)
        reason = self.request.reason(*values) if is_searched else (
            'no motion leads there from the last inputs; the service inputs_for searches for all')
        # The reason is about the linkage's outputs, without signs and offsets of the names.
        commands, outputs = ([f'{value:.6g}' for value in numbers] for numbers in (
            [positions[index] for index in self.indices], values))
        meaning = '' if outputs == commands else ' ({})'.format(join_names(
            map('{} at {}'.format, self.request.outputs, outputs)))
        return f'{self.named} cannot be {", ".join(commands)}{meaning}: {reason}'

    def _values(self, positions: Sequence[float]) -> list[float]:
        return [name.sign * (positions[index] - name.offset)
                for name, index in zip(self.names, self.indices)]


class CommandStream:
    """
    Publishes `servo_commands`, `<mechanism>/commands` and `servo_trajectory`.

    Requests arrive on `wanted_states` and `wanted_trajectory`. Each solution continues the last
    one; if an output is out of reach, its actuator holds the last valid command. The node's worker
    solves a trajectory, which a newer one replaces. `present(mechanism)` returns the present
    inputs of a SceneMechanism [rad or m], or their starts.
    """

    def __init__(self, node: Any, mechanisms: Iterable[str],
                 present: Callable[[SceneMechanism], list[float]]):
        self._present, self._logger = present, node.get_logger()
        self._commands = TrackedPublisher(node, JointState, 'servo_commands', 10)
        self._arrays = {name: TrackedPublisher(node, Float64MultiArray, f'{name}/commands', 10)
                        for name in mechanisms}
        self._trajectories = TrackedPublisher(node, JointTrajectory, 'servo_trajectory', 10)
        self._throttle, self._reasons = Throttle(self._logger), Once(MAX_NAMES)
        self._mechanisms: Mapping[str, SceneMechanism] = {}
        self._last: dict[str, ActuatorCommand] = {}
        self._worker, self._newest = node.worker, JointTrajectory()
        self._topic = node.resolve_topic_name('wanted_states')
        self._reader = subscribe(node, 'wanted_states', self._interpret, self._receive)
        node.create_subscription(JointTrajectory, 'wanted_trajectory', node.guarded(
            'wanted_trajectory', self._receive_trajectory), 10)

    def adopt(self, mechanisms: Mapping[str, SceneMechanism]) -> None:
        """Replace the mechanisms."""
        # With several inputs, the changed geometry may have no pose that continues the last one.
        geometry = attrgetter('linkage', 'scale', 'inputs')
        self._last = {name: last for name, last in self._last.items() if len(last.inputs) == 1
                      or geometry(self._mechanisms[name]) == geometry(mechanisms[name])}
        self._mechanisms = mechanisms
        self._reader.forget()

    def _output(self, named: str) -> tuple[SceneMechanism, str, JointName] | None:
        """Return the mechanism, output and published name for a name in messages, or None."""
        for mechanism in self._mechanisms.values():
            if output := mechanism.output_named(named):
                return mechanism, *output
        return None

    def _targets(self, names: Sequence[str]) -> tuple[list[Target], list[str]]:
        """
        Return the targets of the output names in a message, and what is wrong with other names.

        Of a repeated name the last counts.
        """
        groups: dict[tuple[str, int], list[tuple]] = {}
        targets: list[Target] = []
        unknown, reasons = [], []
        for named, index in dict(zip(names, range(len(names)))).items():
            if output := self._output(named):
                mechanism, *joint = output
                # Only the outputs of several inputs are solved together.
                group = index if len(mechanism.inputs) == 1 else -1
                groups.setdefault((mechanism.name, group), []).append((index, *joint))
            else:
                unknown.append(named)
        if unknown:
            reasons.append(f'no output is called {join_names(unknown, 150)}; an output is called '
                           '<mechanism>_<link>, <mechanism>_<joint>.x, or as joint_names has it')
        for (name, _), outputs in groups.items():
            mechanism, (indices, joints, published) = self._mechanisms[name], zip(*outputs)
            n, called = len(mechanism.inputs), ' and '.join(truncated(names[i]) for i in indices)
            try:
                if len(outputs) != n:
                    raise ValueError(f'{name} has {n_inputs(n)}: name {n} of its outputs, not '
                                     f'{called}')
                target = Target(called, mechanism, InverseRequest(mechanism, joints), indices,
                                published)
                for other in targets:
                    if shared := {*target.actuators} & {*other.actuators}:
                        raise ValueError(f'{other.named} and {called} are moved by one actuator, '
                                         f'{join_names(sorted(shared))}: name one of them')
                targets.append(target)
            except ValueError as error:
                reasons.append(str(error))
        return targets, reasons

    def _interpret(self, message: JointState) -> tuple[list[Target], int, bool]:
        """Return a sender's targets, its count of positions, and whether it has velocities."""
        targets, reasons = self._targets(message.name[:len(message.position)])
        for reason in self._reasons.new(reasons):
            self._logger.warning(f'{self._topic}: {reason}{self._reasons.ending}')
        return targets, len(message.position), len(message.velocity) == len(message.name)

    def _receive(self, routes: tuple[list[Target], int, bool], stamp: bytes,
                 numbers: Sequence[Any]) -> None:
        if not self._commands.has_subscribers and not any(
                array.has_subscribers for array in self._arrays.values()):
            return
        (targets, count, known), (_, *numbers) = routes, numbers
        commands = [(target, command) for target in targets if (command := self._command(
            target, numbers, numbers[count:] if known else None))]
        if commands:
            self._send(stamp, commands)

    def _seed(self, target: Target) -> Sequence[float]:
        """Return the inputs to continue from: of the last command, else present, else starts."""
        last = self._last.get(target.mechanism.name)
        return last.inputs if last else self._present(target.mechanism)

    def _command(self, target: Target, positions: Sequence[float],
                 speeds: Sequence[float] | None) -> ActuatorCommand | None:
        """Return the command for a target or, out of reach, the last valid one, if any."""
        name, seed = target.mechanism.name, self._seed(target)
        last, is_quick = self._last.get(name), target.request.inverse.is_quick
        # Only the first command, which continues no other, may jump; it is not searched.
        command = target.command(positions, speeds, seed, jumps=not last and is_quick)
        if command.is_valid:
            self._last[name] = command
            return command
        self._throttle.warn(
            target.named, lambda: f'{self._topic}: {target.reason(positions, is_quick)}')
        return last and last._replace(speeds=[0.0] * len(last.inputs))

    def _send(self, stamp: bytes, commands: Sequence[tuple[Target, ActuatorCommand]]) -> None:
        if self._commands.has_subscribers:
            speeds = [speed for _, command in commands for speed in command.speeds or [math.nan]]
            efforts = [effort for target, command in commands for effort in target.efforts(command)
                       ] if any(target.mechanism.loads for target, _ in commands) else ()
            self._commands.publish(joint_states(
                unpack(stamp), [name for target, _ in commands for name in target.actuators],
                [position for _, command in commands for position in command.positions],
                *(rates if all(map(math.isfinite, rates)) else () for rates in (speeds, efforts))))
        for target, command in commands:
            publisher = self._arrays[target.mechanism.name]
            if publisher.has_subscribers:
                publisher.publish(Float64MultiArray(data=command.positions))

    def _receive_trajectory(self, message: JointTrajectory) -> None:
        if not self._trajectories.has_subscribers:
            return
        try:
            if len(message.points) > MAX_POINTS:
                raise ValueError(f'it has {len(message.points)} points; send up to {MAX_POINTS}')
            if len({*message.joint_names}) < len(message.joint_names):
                raise ValueError('joint_names has a name twice')
            targets, reasons = self._targets(message.joint_names)
            if reasons:
                raise ValueError(reasons[0])
            if message.points and not targets:
                raise ValueError('joint_names is empty: name at least one output')
        except ValueError as error:
            self._refuse(error)
            return
        seeds = [self._seed(target) for target in targets]
        jumps = [target.mechanism.name not in self._last for target in targets]
        self._newest = message
        self._worker.queue('wanted_trajectory', lambda: self._solve(
            message, targets, seeds, jumps), is_next=True)

    def _refuse(self, error: ValueError) -> None:
        self._logger.error(f'wanted_trajectory is refused: {error}')

    def _solve(self, message: JointTrajectory, targets: Sequence[Target],
               seeds: list[Sequence[float]], jumps: list[bool]) -> Callable[[], None] | None:
        """Solve a trajectory; return a function to publish it, or None if it is dropped."""
        solved = JointTrajectory(header=message.header, joint_names=[
            name for target in targets for name in target.actuators])
        time_ = 0
        try:
            for i, point in enumerate(message.points):
                before, time_ = time_, Duration.from_msg(point.time_from_start).nanoseconds
                if time_ < before:
                    raise ValueError(f'point {i} is at {time_ / 1e9:g} s, before '
                                     f'{before / 1e9:g} s: time_from_start must not decrease')
                if message is not self._newest or self._worker.has_ended:
                    return None
                solved.points.append(_solved_point(
                    i, point, len(message.joint_names), targets, seeds, jumps))
                jumps = [False] * len(targets)
        except ValueError as error:
            self._refuse(error)
            return None
        return lambda: self._trajectories.publish(solved)


def _solved_point(i: int, point: JointTrajectoryPoint, n: int, targets: Sequence[Target],
                  seeds: list[Sequence[float]], jumps: Sequence[bool]) -> JointTrajectoryPoint:
    """Return trajectory point `i` of the actuators, and update `seeds` to its inputs."""
    if len(point.positions) != n or len(point.velocities) not in (0, n):
        raise ValueError(f'point {i} must have {n} positions, and as many velocities or '
                         f'none, not {len(point.positions)} and {len(point.velocities)}')
    if not all(map(math.isfinite, point.velocities)):
        raise ValueError(f'point {i}: a velocity must be finite')
    commands = []
    for k, target in enumerate(targets):
        command = target.command(
            point.positions, list(point.velocities) or [0.0] * n, seeds[k], jumps[k])
        if not command.is_valid:
            raise ValueError(f'point {i}: {target.reason(point.positions, True)}')
        if not all(map(math.isfinite, command.speeds)):
            raise ValueError(f'point {i}: the motion of {target.named} reverses there; its speed '
                             'must be zero')
        seeds[k] = command.inputs
        commands.append(command)
    return JointTrajectoryPoint(
        positions=[position for command in commands for position in command.positions],
        velocities=[speed for command in commands for speed in command.speeds
                    if len(point.velocities)],
        time_from_start=point.time_from_start)
