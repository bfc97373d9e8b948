# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The page's requests to the library: requested poses, and ranges of dimensions."""

from itertools import combinations
import math
from typing import Any, Mapping, Sequence

import numpy as np

from .nearest_pose import nearest_inputs
from ..linkage import Formula, Mechanism, theta_of
from ..robot_model.shapes import ground_frame
from ..scene import InputSettings, Parameter, SceneError, SceneMechanism, slider
from ..words import join_names, short_repr

ARROWS = {'velocity': 'm/s', 'acceleration': 'm/s²', 'force': 'N'}
_, ACCELERATION, FORCE = ARROWS
# Kinds of parameters with a control.
CONTROLLED = 'double', 'integer', 'bool'
# Change of a dimension that detects dependent bars, as a fraction of the longest bar.
NUDGE = 1e-6
# Tolerance of an input at its end.
CLOSE = 1e-9
# What is rounding, as a fraction of a linkage's size, or in rad.
ROUNDING = 1e-12


# A request's inputs, and what is reached if they do not meet it exactly: name of the input or
# output, its `arcs` and their `unit`.
Reached = tuple[list[float], dict[str, Any] | None]


def shown(value: Any) -> Any:
    """Return a value for JSON: None for a number that is not finite."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def setting(name: str, parameter: Parameter) -> dict[str, Any]:
    """
    Describe a parameter for the page, by its name in its mechanism.

    The page has a control for it in a `group`, or none if that is empty.
    """
    field = parameter.field
    has_control = not field.read_only and field.kind in CONTROLLED
    return {'name': name, 'value': parameter.value, 'kind': field.kind,
            'meaning': field.meaning, 'allowed': field.allowed, 'unit': field.unit,
            'group': (field.group or 'more') if has_control else ''}


def drawn(mechanism: SceneMechanism, speeds: Mapping[str, float]) -> dict[str, Any]:
    """
    Describe what the page needs to know of a mechanism beside its parameters and markers.

    `points` are the joints of a leg in markers; `legs` has for each leg the number of its pair,
    from the front. Each input has its unit, `ends` of its slider [rad or m], `turn` [rad] after
    which its poses repeat (None: never), and speed when it plays. `sides` are the words for a
    branch of +1 and of -1.
    """
    return {
        'space': mechanism.in_space, 'points': mechanism.points,
        'legs': sorted((1 + mechanism.mirrored) * [*range(mechanism.leg_pairs)]),
        'sides': {name: mechanism.linkage.line_of(name).sides or ('+1', '−1')
                  for name in mechanism.linkage.branches},
        'inputs': {name: {
            'unit': settings.input.unit, 'speed': speeds[name],
            'ends': [min(low for low, _ in settings.arcs), max(high for _, high in settings.arcs)],
            'turn': settings.input.turn if settings.input.wraps else None}
            for name, settings in mechanism.inputs.items()}}


def described(mechanism: SceneMechanism, present: Sequence[float]) -> dict[str, Any]:
    """
    Describe a mechanism at inputs `present` [rad or m], in the scene's size.

    Each input has its value; each output of the first leg has value, unit, and d output / d input
    for each input, zero where it is rounding.
    """
    linkage, tracer = mechanism.linkage, mechanism.tracer
    names = [*mechanism.assembly().joints, f'{tracer}.x', f'{tracer}.y']
    theta = mechanism.theta(present)
    values = linkage.joint_angles(theta, names)
    rates = {input_: linkage.joint_rates(theta, names, i)
             for i, input_ in enumerate(mechanism.inputs)}
    # Sizes of quantities beside which rounding is seen.
    size = {name: mechanism.scale_of(name) * (1.0 if linkage.is_angle(name) else linkage.longest)
            for name in (*names, *mechanism.inputs)}
    return {
        'inputs': dict(zip(mechanism.inputs, present)),
        'outputs': {name: {
            'value': _rounded(float(values[name]) * mechanism.scale_of(name), size[name]),
            'unit': 'rad' if linkage.is_angle(name) else 'm',
            'rates': [_rounded(
                float(by[name]) * mechanism.scale_of(name) / mechanism.scale_of(input_),
                size[name] / size[input_]) for input_, by in rates.items()]} for name in names}}


def _rounded(value: float, size: float) -> Any:
    """Return a value as JSON can say it; zero where it is rounding beside a size."""
    return shown(0.0 if abs(value) < ROUNDING * size else value)


def arrows(mechanism: SceneMechanism, present: Sequence[float], kind: str,
           speeds: Mapping[str, float]) -> dict[str, Any]:
    """
    Return one of ARROWS at each joint of the first leg: `unit`, and x, y in its plane by joint.

    Speeds [rad/s or m/s] are by input. Forces are the loads; `efforts` by input [N m or N] balance
    them.
    """
    if kind == FORCE:
        efforts = mechanism.efforts(present) if mechanism.loads else ()
        return {'unit': 'N', 'at': {
            name: load for name, load in mechanism.loads.items() if not isinstance(load, float)},
            'efforts': {name: [shown(effort), 'N·m' if settings.input.is_angle else 'N']
                        for (name, settings), effort in zip(mechanism.inputs.items(), efforts)}}
    linkage, theta = mechanism.linkage, mechanism.theta(present)
    rates = mechanism.theta([speeds[name] for name in mechanism.inputs])
    if kind == ACCELERATION:
        vectors = linkage.acceleration(theta, rates, theta_of([0.0] * len(speeds)))
    else:
        velocities = [linkage.velocity(theta, None, by) for by in range(len(speeds))]
        vectors = {name: sum(rate * velocity[name] for rate, velocity in zip(
            np.atleast_1d(rates), velocities)) for name in linkage.points}
    return {'unit': ARROWS[kind], 'at': {
        name: [shown(float(part) * mechanism.scale) for part in vector]
        for name, vector in vectors.items() if name not in linkage.grounded}}


def number(text: str) -> dict[str, Any]:
    """Return the `value` of arithmetic such as pi/2, and whether it is in rad (`turns`)."""
    # A number may have a decimal comma; arithmetic has commas in parentheses only.
    formula = Formula(text if '(' in text else text.replace(',', '.'))
    if formula.names:
        raise SceneError(
            f'{short_repr(text)} is not a number: {join_names(formula.names)} is unknown')
    return {'value': float(formula.value({})), 'turns': formula.is_angle}


def reached(mechanism: SceneMechanism, present: Sequence[float],
            want: Mapping[str, Any]) -> Reached:
    """
    Return the inputs [rad or m] for a request, or the nearest possible ones and what is reached.

    Parameters
    ----------
    mechanism : SceneMechanism
        The mechanism.
    present : sequence of float
        Its inputs.
    want : dict
        `output` (an input's name too) and `value`; or `joint`, of which `leg`, and `place`, x and
        y in the linkage's plane [m].

    Raises
    ------
    ValueError
        If the output or the joint does not exist, or has no solution.

    """
    if 'joint' in want:
        return _joint_at(mechanism, present, **want), None
    name, value = want['output'], want['value']
    if not math.isfinite(value):
        raise SceneError(f'a value must be finite, not {value}')
    if name in mechanism.inputs:
        return _input_at(mechanism, present, name, value)
    return _output_at(mechanism, present, name, value)


def inside(settings: InputSettings, value: float) -> float:
    """Return the value on an input's arcs [rad or m] that is nearest to another."""
    arcs, input_ = settings.arcs, settings.input
    nearest = [input_.wrapped(value)] if input_.is_whole(arcs) else [
        min(max(input_.nearest_equivalent(value, 0.5 * (low + high)), low), high)
        for low, high in arcs]
    return float(min(nearest, key=lambda end: input_.distance(end, value)))


def _input_at(mechanism: SceneMechanism, present: Sequence[float], name: str,
              value: float) -> Reached:
    arcs, input_ = mechanism.inputs[name].arcs, mechanism.inputs[name].input
    new = inside(mechanism.inputs[name], value)
    inputs = [new if key == name else old for key, old in zip(mechanism.inputs, present)]
    places = mechanism.linkage.solve(mechanism.theta(inputs))
    if not all(math.isfinite(part) for place in places.values() for part in place):
        raise SceneError(f'{mechanism.name} cannot be assembled there')
    is_outside = input_.distance(new, input_.wrapped(value)) > CLOSE * input_.size
    return inputs, {'name': name, 'arcs': arcs, 'unit': input_.unit} if is_outside else None


def _output_at(mechanism: SceneMechanism, present: Sequence[float], name: str,
               value: float) -> Reached:
    solution, _ = mechanism.follow((name,), (value,), present)
    if math.isfinite(solution[0]):
        return solution, None
    arcs, is_angle = mechanism.extremes(name), mechanism.linkage.is_angle(name)
    turn = math.tau if is_angle else math.inf
    _, nearest = min((abs(math.remainder(extreme - value, turn)), at)
                     for arc in arcs for extreme, at in arc)
    return [nearest], {'name': name, 'unit': 'rad' if is_angle else 'm',
                       'arcs': [(low, high) for (low, _), (high, _) in arcs]}


def _joint_at(mechanism: SceneMechanism, present: Sequence[float], joint: str, place: Any,
              leg: int = 0) -> list[float]:
    # The inputs of this leg and back: for a single leg, those of the linkage in the scene's size.
    lag, start, side, _ = list(mechanism.assembly().legs.values())[leg]
    sizes = mechanism.scales
    inputs = nearest_inputs(
        mechanism.linkage, joint,
        [side * place[0] / mechanism.scale, place[1] / mechanism.scale],
        [start + side * (value / size - lag) for value, size in zip(present, sizes)],
        [[sorted(start + side * (end / size - lag) for end in arc) for arc in settings.arcs]
         for settings, size in zip(mechanism.inputs.values(), sizes)])
    return [float(lag + side * (value - start)) * size for value, size in zip(inputs, sizes)]


def tunable(mechanism: SceneMechanism) -> dict[str, Any]:
    """
    Return the `travel` of a mechanism's parameters, and `bars` that follow its dimensions.

    By parameter, these are the ends of its slider, or None, and pairs of joints. `fixed` are the
    joints that cannot be dragged. This is slow.
    """
    linkage = mechanism.linkage
    return {'travel': {parameter.name.partition('.')[2]: slider.ends(mechanism, parameter)
                       for parameter in mechanism.parameters},
            'fixed': mechanism.points if mechanism.in_space else linkage.grounded,
            'bars': {f'dimensions.{key}': _bars(linkage, key) for key in linkage.dimensions}}


def _bars(linkage: Mechanism, key: str) -> list[tuple[str, str]]:
    """Return the pairs of joints whose distance depends on a dimension."""
    size = NUDGE * float(linkage.longest)
    for step in (size, -size):
        try:
            other = linkage.with_dimensions(**{key: linkage.dimensions[key] + step})
        except ValueError:
            continue
        after = _distances(other)
        return [pair for pair, distance in _distances(linkage).items()
                if abs(after[pair] - distance) > 1e-3 * size]
    return []


def _distances(linkage: Mechanism) -> dict[tuple[str, str], float]:
    frames = [ground_frame(linkage), *linkage.frames.values()]
    return {(a, b): math.dist(frame[a], frame[b])
            for frame in frames for a, b in combinations(frame, 2)}
