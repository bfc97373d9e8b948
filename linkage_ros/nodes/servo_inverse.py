# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Node with services for inverse kinematics: inputs at which outputs have given values."""

from __future__ import annotations

from array import array
import math
from typing import Any, Callable, Mapping, Sequence

import numpy as np
from sensor_msgs.msg import JointState

from . import scene_node, shutdown
from .command_stream import CommandStream
from .message_layout import subscribe
from .. import scene
from ..cache import Cache
from ..optional import needs
from ..robot_model import bodies
from ..scene.inverse_request import InverseRequest, LEVER, present_inputs
from ..words import brief, join_names, n_inputs, short_repr, suggestion

# Other callers and messages wait for an answer: the maximum number of values in a request.
MAX_VALUES = 10_000
# Maximum number of values, and of letters of allowed names, in a message.
MAX_NAMED_VALUES, MAX_NAMES_LENGTH = 5, 150


class ServoInverse(scene_node.SceneNode):
    """Serves `servo_inverse` and `inputs_for`, and turns `wanted_states` into commands."""

    task = 'answers servo_inverse for {mechanisms}'

    def __init__(self, **kwargs: Any):
        with needs('linkage_interfaces'):
            from linkage_interfaces.srv import (
                InputsFor,
                ServoInverse as ServoInverseType,
            )
        super().__init__(scene.INVERSE, **kwargs)
        self._requests = Cache(self._request)
        self._sources = self.scene.sources
        self._positions: dict[str, float] = {}
        subscribe(self, 'crank_states', self._interpret, self._receive)
        self.create_service(ServoInverseType, 'servo_inverse', self.answer)
        self.create_service(InputsFor, 'inputs_for', self.answer_inputs_for)
        self._stream = CommandStream(self, self.scene.mechanisms, lambda mechanism: present_inputs(
            mechanism, self._positions))
        self.begin()

    def check(self, new: scene.Scene) -> None:
        """Raise SceneError for a length that `kinematics` could not publish."""
        for mechanism in new.mechanisms.values():
            bodies.size(mechanism)

    def adopt(self, new: scene.Scene) -> None:
        """Replace the scene for which requests are answered."""
        self._requests.clear()
        self._stream.adopt(new.mechanisms)

    def answer(self, request: Any, response: Any) -> Any:
        """Answer a request of `servo_inverse`; the response names an error, if any."""
        return self._filled(lambda: solve(
            self._requests[request.mechanism, request.output], request, response), response)

    def answer_inputs_for(self, request: Any, response: Any) -> Any:
        """Answer a request of `inputs_for`; the response names an error, if any."""
        return self._filled(lambda: solve_inputs_for(
            self._with_several_inputs(request.mechanism), request, response), response)

    def _request(self, key: tuple[str, str]) -> InverseRequest:
        (name, output), mechanisms = key, self.scene.mechanisms
        levers = {} if output not in ('', LEVER) else {
            name: mechanism for name, mechanism in mechanisms.items()
            if mechanism.linkage.type == 'slotted_lever'}
        mechanism = _chosen(mechanisms, name, levers or mechanisms,
                            'slotted lever' if levers else 'mechanism')
        if len(mechanism.inputs) > 1:
            raise ValueError(f'{mechanism.name} has several inputs, which one output does not '
                             'determine; call the service inputs_for')
        return InverseRequest(mechanism, [output])

    def _with_several_inputs(self, name: str) -> scene.SceneMechanism:
        mechanisms = self.scene.mechanisms
        return _chosen(mechanisms, name, {
            name: mechanism for name, mechanism in mechanisms.items()
            if len(mechanism.inputs) > 1}, 'mechanism with several inputs')

    def _filled(self, fill: Callable[[], None], response: Any) -> Any:
        response.success = False
        try:
            fill()
        except ValueError as problem:
            response.message = brief(problem)
        return response

    def _interpret(self, message: JointState) -> list[tuple[str, int]]:
        """Return the scene's sources in a message, and the indices of their positions."""
        return [(name, index) for index, name in enumerate(
            message.name[:len(message.position)], 1) if name in self._sources]

    def _receive(self, routes: list[tuple[str, int]], _: bytes, numbers: Sequence[Any]) -> None:
        self._positions.update((name, numbers[index]) for name, index in routes
                               if math.isfinite(numbers[index]))


def solve(inverse: InverseRequest, request: Any, response: Any) -> None:
    """
    Answer a request for values of an output, on the working branch or next to `servo_near`.

    Raises
    ------
    ValueError
        If the request as a whole cannot be answered.

    """
    values, seeds = request.lever_angle, request.servo_near
    n = len(values)
    if not n:
        raise ValueError('lever_angle is empty; give at least one value')
    if n > MAX_VALUES:
        raise ValueError(f'lever_angle has {n} values; give up to {MAX_VALUES} at once')
    if len(seeds) not in (0, 1, n):
        raise ValueError(f'servo_near must be empty, have one angle, or one for each of the '
                         f'{n} in lever_angle, not {len(seeds)}')
    # Most requests have one angle, for which floats are faster than arrays.
    seed = [np.array(seeds) if len(seeds) > 1 else seeds[0]] if seeds else None
    if seed and not np.all(np.abs(seed[0]) <= scene.MAX_POSITION):
        raise ValueError(f'servo_near must be finite and within {scene.MAX_POSITION:g} '
                         f'{inverse.inverse.inputs[0].unit} of zero')
    (positions,), (rates,) = inverse.positions([np.array(values) if n > 1 else values[0]], seed)
    response.servo_angle = array('d', np.ravel(positions).tobytes())
    response.reduction = array('d', np.ravel(rates).tobytes())
    response.reachable = np.isfinite(np.ravel(positions)).tolist()
    response.success = all(response.reachable)
    if not response.success:
        response.message = brief(_unreachable(inverse, [
            value for value, reached in zip(values, response.reachable) if not reached]))


def solve_inputs_for(mechanism: scene.SceneMechanism, request: Any, response: Any) -> None:
    """Answer a request for several outputs; raise ValueError if it cannot be answered."""
    values, near, n = request.values, request.near, len(mechanism.inputs)
    if len(request.outputs) != n:
        raise ValueError(f'{mechanism.name} has {n_inputs(n)}: as many outputs are needed, not '
                         f'{len(request.outputs)}')
    inverse = InverseRequest(mechanism, request.outputs)
    if len(values) != n or len(near) not in (0, n):
        raise ValueError(f'values must have {n} numbers and near as many or none, not '
                         f'{len(values)} and {len(near)}')
    if not all(-scene.MAX_POSITION <= position <= scene.MAX_POSITION for position in near):
        raise ValueError(f'near must be finite and within {scene.MAX_POSITION:g} of zero')
    answers = inverse.answers(values, inverse.inputs_of(near) if near else None)
    response.names = [settings.source for settings in mechanism.inputs.values()]
    response.positions = [position for inputs, _ in answers
                          for position in inverse.positions_of(inputs)]
    response.modes = [solution.mode for _, solution in answers]
    response.singular = [solution.is_singular for _, solution in answers]
    response.success = bool(answers)
    response.message = '' if answers else brief(inverse.reason(*values))


def _chosen(mechanisms: Mapping[str, scene.SceneMechanism], name: str,
            default: Mapping[str, scene.SceneMechanism], what: str) -> scene.SceneMechanism:
    """Return a mechanism by its name or, if that is empty, the only one in `default`."""
    if name in mechanisms:
        return mechanisms[name]
    if not name and len(default) == 1:
        return next(iter(default.values()))
    problem = (f'there is no mechanism {short_repr(name)}' if name else
               f'mechanism may be empty only if the scene has a single {what}')
    raise ValueError(f'{problem}{suggestion(name, mechanisms, MAX_NAMES_LENGTH)}')


def _unreachable(inverse: InverseRequest, values: Sequence[float]) -> str:
    """Return a message with unreachable values, and the reason for the first finite one."""
    named = ', '.join(f'{value:.6g}' for value in values[:MAX_NAMED_VALUES])
    more = f' and {len(values) - MAX_NAMED_VALUES} more' if len(values) > MAX_NAMED_VALUES else ''
    first = next(filter(math.isfinite, values), math.nan)
    return f'{join_names(inverse.outputs)} cannot be {named}{more}; {inverse.reason(first)}'


def main(args: Any = None) -> int:
    """Run the node; return the exit code."""
    return scene_node.run([ServoInverse], scene.INVERSE, args)


if __name__ == '__main__':
    shutdown.run(main)
