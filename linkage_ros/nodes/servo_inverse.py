# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Node that answers where inputs have to be to put a lever, or any outputs, where it is wanted."""

from array import array
import math
import sys

import numpy as np
from sensor_msgs.msg import JointState

from . import joint_state_reader, scene_node
from .command_stream import CommandStream
from .message_layout import Unreadable
from .. import scene
from ..robot_model import bodies
from ..scene.inverse_request import InverseRequest, LEVER, present
from ..words import elided, listed, MESSAGE, quoted

try:
    from linkage_interfaces.srv import InputsFor, ServoInverse as ServoInverseType
except ImportError as error:
    raise ImportError(
        'servo_inverse needs the service types of linkage_interfaces: run colcon '
        'build in the workspace, which builds linkage_interfaces too, and source '
        'install/setup.bash') from error

# More values than this at once would keep other callers waiting.
MOST_VALUES = 1_000_000
# Values named, and letters of names allowed, in a message.
MOST_NAMED, MOST = 5, 150


class ServoInverse(scene_node.SceneNode):
    """Serves `servo_inverse` for the mechanisms of a scene."""

    def __init__(self, **kwargs):
        super().__init__(scene.INVERSE, **kwargs)
        self._heard = {}
        self._reader = joint_state_reader.Reader(self._inputs_in)
        self.create_subscription(
            JointState, 'crank_states', self._turn, joint_state_reader.ANY, raw=True)
        self.create_service(ServoInverseType, 'servo_inverse', self.answer)
        self.create_service(InputsFor, 'inputs_for', self.answer_together)
        self._stream = CommandStream(self, self.scene.machines, lambda machine: present(
            machine, self._heard))
        self.begin()

    def serves(self):
        """Say of which mechanisms it answers."""
        return f'answers servo_inverse for {listed(self.scene.machines, 200)}'

    def prepare(self, new):
        """Refuse lengths that `kinematics` could not publish; SceneError says which."""
        for machine in new.machines.values():
            bodies.size(machine)
        return new

    def adopt(self, new):
        """Forget what was asked about."""
        self._known = {}
        self._stream.adopt(new.machines)
        self._inputs = {drive.source for machine in new.machines.values()
                        for drive in machine.inputs.values()}

    def _inputs_in(self, message):
        """Return the names of the scene's inputs in a message, and their places."""
        return [(name, place) for place, name in enumerate(message.name[:len(message.position)])
                if name in self._inputs]

    def _turn(self, text):
        try:
            turned = self._reader.read(text)
        except Unreadable:
            # `kinematics` says so.
            return
        self._heard.update((name, turned.positions[place]) for name, place in turned.source)

    def answer(self, request, response):
        """Fill in a response; what cannot be done is said in it, never raised."""
        return self._filled(self._answer, request, response)

    def _answer(self, request, response):
        key = request.mechanism, request.output
        asked = self._known.get(key) or InverseRequest(
            _machine(self.scene, *key), [request.output])
        solve(asked, request, response)
        self._known[key] = asked

    def answer_together(self, request, response):
        """Fill in a response about several inputs; what cannot be done is said in it."""
        return self._filled(self._answer_together, request, response)

    def _answer_together(self, request, response):
        solve_together(_machine_together(self.scene, request.mechanism), request, response,
                       self._heard)

    def _filled(self, fill, request, response):
        response.success = False
        try:
            fill(request, response)
        except ValueError as problem:
            response.message = elided(str(problem), MESSAGE)
        except Exception as problem:
            # A client waits for ever for a service that raised.
            response.message = elided(f'internal error: {problem!r}', MESSAGE)
            self.get_logger().error(response.message)
        return response


def solve(asked, request, response):
    """
    Answer a request for values of an output: on the working branch, or near where it is asked.

    Raises
    ------
    ValueError
        If the request as a whole cannot be answered.

    """
    wanted, near = request.lever_angle, request.servo_near
    n = len(wanted)
    if not n:
        raise ValueError('lever_angle is empty; give at least one value')
    if n > MOST_VALUES:
        raise ValueError(f'lever_angle has {n} values; give up to {MOST_VALUES} at once')
    if len(near) not in (0, 1, n):
        raise ValueError(f'servo_near must be empty, have one angle, or one for each of the '
                         f'{n} in lever_angle, not {len(near)}')
    # One angle is the usual question, and floats answer it sooner than arrays.
    values = np.array(wanted) if n > 1 else wanted[0]
    start = None
    if near:
        start = [np.array(near) if len(near) > 1 else near[0]]
        if not np.all(np.abs(start[0]) <= scene.FARTHEST):
            raise ValueError(f'servo_near must be finite and within {scene.FARTHEST:g} '
                             f'{asked.units[0]} of zero')
    (theta,), (rate,) = asked.positions([values], start)
    if n > 1:
        finite = np.isfinite(theta)
        response.servo_angle = array('d', theta.tobytes())
        response.reduction = array('d', rate.tobytes())
        response.success = bool(finite.all())
        response.reachable = [True] * n if response.success else finite.tolist()
    else:
        response.servo_angle, response.reduction = [theta], [rate]
        response.success = math.isfinite(theta)
        response.reachable = [response.success]
    if not response.success:
        response.message = elided(_complaint(asked, [
            value for value, reached in zip(wanted, response.reachable) if not reached]), MESSAGE)


def _machine(scene_, name, output):
    """Return a mechanism by its name, or the only one, or for a lever the only slotted lever."""
    levers = {key: machine for key, machine in scene_.machines.items()
              if machine.linkage.type == 'slotted_lever'}
    machines = scene_.machines if output else levers
    if name in machines:
        return machines[name]
    if not name:
        for only in (machines, levers if output in ('', LEVER) else {}):
            if len(only) == 1:
                return next(iter(only.values()))
    allowed = listed(machines, MOST) if machines else 'none: the scene has no slotted_lever'
    if name in scene_.machines:
        raise ValueError(f'{name} is a {scene_.machines[name].linkage.type}, not a slotted lever; '
                         f'name an output, or take one of: {allowed}')
    if name:
        raise ValueError(f'there is no mechanism {quoted(name)}; allowed: {allowed}')
    what = '' if output else ' slotted lever'
    raise ValueError(f'mechanism may be empty only where there is one{what}; allowed: {allowed}')


def solve_together(machine, request, response, heard):
    """Answer a request for several outputs; raise ValueError if it cannot be answered."""
    asked, values, near = InverseRequest(machine, request.outputs), request.values, request.near
    n = len(machine.inputs)
    if len(values) != n or len(near) not in (0, n):
        raise ValueError(f'values must have {n} numbers and near as many or none, not '
                         f'{len(values)} and {len(near)}')
    if not all(-scene.FARTHEST <= position <= scene.FARTHEST for position in near):
        raise ValueError(f'near must be finite and within {scene.FARTHEST:g} of zero')
    start = asked.inputs_of(near) if near else [
        place if abs(place) <= scene.FARTHEST else drive.start
        for place, drive in zip(present(machine, heard), machine.inputs.values())]
    answers = asked.answers(values, start)
    response.names = [drive.source for drive in machine.inputs.values()]
    response.positions = [place for answer in answers
                          for place in asked.positions_of(answer.inputs)]
    response.modes = [answer.mode for answer in answers]
    response.singular = [answer.is_singular for answer in answers]
    response.success = bool(answers)
    response.message = '' if answers else elided(asked.reason(*values), MESSAGE)


def _machine_together(scene_, name):
    """Return a mechanism by its name, or the only one with several inputs."""
    able = {key: machine for key, machine in scene_.machines.items() if len(machine.inputs) > 1}
    found = scene_.machines.get(name) or (
        next(iter(able.values())) if not name and len(able) == 1 else None)
    if found is None:
        raise ValueError(f'mechanism must be one of {listed(scene_.machines, MOST)}, or empty '
                         f'where one has several inputs, not {quoted(name)}')
    return found


def _complaint(asked, missed):
    named = ', '.join(f'{value:.6g}' for value in missed[:MOST_NAMED])
    more = f' and {len(missed) - MOST_NAMED} more' if len(missed) > MOST_NAMED else ''
    # The reason is that of the first value that is one.
    first = next(filter(math.isfinite, missed), math.nan)
    return f'{asked.what} {named}{more} cannot be reached; {asked.reason(first)}'


def main(args=None):
    """Run the node; return the exit code."""
    return scene_node.run(ServoInverse, scene.INVERSE, args)


if __name__ == '__main__':
    sys.exit(main())
