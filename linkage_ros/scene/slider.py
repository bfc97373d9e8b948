# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Useful ranges for the page's sliders of parameters; values beyond them are allowed, too.

The ends are multiples of a hundredth of the range, so that they are round numbers. No ROS is
needed.
"""

from __future__ import annotations

import math
from typing import Optional, Tuple

import numpy as np

from . import Scene, SceneMechanism
from .parameters import Parameter
from ..cache import cached
from ..linkage import Arc, Mechanism

# Steps of a slider, and the smallest step as a fraction of the value.
STEPS, FINEST = 100, 1e-5
# Smallest and largest change of a dimension that is tried, as fractions of it, or of the longest
# bar if it is 0; and the number of changes tried at a time.
LEAST, MOST, TRIED = 1e-4, 9.0, 48
# Largest end of a range.
LARGEST = 1e300
# Values tried of a single input, and of each of several.
ANGLES, FEW_ANGLES = 91, 13


def ends(scene: Scene, parameter: Parameter) -> Optional[Tuple[float, float]]:
    """Return the lower and upper end of a parameter's slider; None if it has no slider."""
    field, value = parameter.field, parameter.value
    if field.low is not None and field.high is not None:
        return field.low, field.high
    if field.kind != 'double':
        return None
    name, what, key = (parameter.name.split('.') + ['', ''])[:3]
    mechanism = scene.machines.get(name)
    if mechanism and what == 'dimensions':
        return _dimension_ends(mechanism.linkage, key, field.positive, _required_range(mechanism))
    if mechanism and what in mechanism.inputs and key == 'start':
        reach = mechanism.inputs[what].reach
        ends = [value, *(end for arc in reach for end in arc)]
        return _in_whole_steps(value, min(ends), max(ends))
    if mechanism and key == 'offset':
        half = math.pi * mechanism.inputs[what].input.size
        return _in_whole_steps(value, value - half, value + half)
    return _in_whole_steps(value, *sorted((0.1 * value, 10.1 * value)))


def _required_range(mechanism: SceneMechanism) -> Optional[Arc]:
    """Return the angles [rad] that a fully rotatable crank passes; None for other inputs."""
    first, *others = mechanism.inputs.values()
    if others or not first.input.is_whole(first.reach):
        return None
    return first.sweep or first.reach[0]


@cached(16)
def _dimension_ends(linkage: Mechanism, key: str, positive: bool, required: Optional[Arc]) -> Arc:
    """Return the slider's ends for a dimension; between them the linkage can be assembled."""
    value = float(linkage.dimensions[key])
    size = abs(value) or float(linkage.longest)
    low, high = (_farthest(linkage, key, value, sign * size, required, positive)
                 for sign in (-1.0, 1.0))
    return _in_whole_steps(value, low, high)


def _farthest(linkage: Mechanism, key: str, value: float, size: float, required: Optional[Arc],
              positive: bool) -> float:
    """Return the farthest value on one side: up to it, all values tried can be assembled."""
    most = 0.9 * abs(size) if positive and size < 0.0 else MOST * abs(size)
    steps = np.geomspace(LEAST * abs(size), most, TRIED) * math.copysign(1.0, size)
    good, bad = 0.0, None
    for _ in range(2):
        able = _are_assembled(linkage, key, value + steps, required)
        if able.all():
            good = steps[-1]
            break
        first = int(np.argmin(able))
        good, bad = steps[first - 1] if first else good, steps[first]
        steps = np.linspace(good, bad, TRIED)[1:]
    return float(value + good)


def _are_assembled(linkage: Mechanism, key: str, values: np.ndarray,
                   required: Optional[Arc]) -> np.ndarray:
    """
    Return for each value of a dimension whether the linkage can be assembled, (values,).

    It must be at all inputs tried in the range `required`, or at one input if that is None.
    """
    try:
        tried = linkage.with_dimensions(**{key: values[:, None]})
    except ValueError:
        if len(values) == 1:
            return np.array([False])
        return np.concatenate([_are_assembled(linkage, key, values[i:i + 1], required)
                               for i in range(len(values))])
    many = ANGLES if len(linkage.inputs) == 1 else FEW_ANGLES
    samples = [np.linspace(low, high, many) for low, high in (
        required or (input_.low, input_.high) for input_ in linkage.inputs)]
    theta = [grid.ravel() for grid in np.meshgrid(*samples)] if len(samples) > 1 else samples[0]
    placed = np.ones((len(values), 1), dtype=bool)
    for places in tried.solve(theta).values():
        placed = placed & np.isfinite(places).all(axis=-1)
    return np.all(placed, axis=1) if required else np.any(placed, axis=1)


def _in_whole_steps(value: float, low: float, high: float) -> Arc:
    """Round the ends of a range to multiples of its step, so that the value lies between them."""
    low, value, high = (min(max(x, -LARGEST), LARGEST) for x in (low, value, high))
    step = max((high - low) / (STEPS + 1), FINEST * abs(value), 1.0 / LARGEST)
    first = min(math.ceil(low / step), math.floor(value / step))
    return first * step, (first + STEPS) * step
