# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Useful ranges for sliders of parameters.

Ranges are suggestions: values beyond them are allowed. The ends are multiples of the step, because
sliders of rqt_reconfigure have a hundred steps counted from zero. No ROS is needed.
"""

from __future__ import annotations

import math
from typing import Optional, Tuple

import numpy as np

from . import Scene, SceneMechanism
from .parameters import Parameter
from ..cache import cached
from ..linkage.inputs import Arc
from ..linkage.mechanism import Mechanism

STOPS = 100
# Smallest and largest change tried, as fractions of the length, or of the longest bar if it is 0.
LEAST, MOST = 1e-4, 9.0
TRIED = 48
# Smallest step, as a fraction of the value.
FINEST = 1e-5
LARGEST = 1e300
ANGLES, FEW_ANGLES = 91, 13


def ends(scene: Scene, parameter: Parameter) -> Optional[Tuple[float, float]]:
    """Return the lowest and highest value of a parameter's slider; None without a slider."""
    field, value = parameter.field, parameter.value
    if field.low is not None and field.high is not None:
        return field.low, field.high
    if field.kind != 'double':
        return None
    name, what, key = (parameter.name.split('.') + ['', ''])[:3]
    machine = scene.machines.get(name)
    if machine and what == 'dimensions':
        return _length(machine.linkage, key, field.positive, _required_range(machine))
    if machine and what in machine.inputs and key == 'start':
        reach = machine.inputs[what].reach
        ends = [value, *(end for arc in reach for end in arc)]
        return _whole_stops(value, min(ends), max(ends))
    return _whole_stops(value, 0.1 * value, 10.1 * value)


def _required_range(machine: SceneMechanism) -> Optional[Tuple[float, float]]:
    """Return the input's range in which it must be assembled; None: at one value at least."""
    first, *others = machine.inputs.values()
    if others or not first.input.is_whole(first.reach):
        return None
    return first.sweep or first.reach[0]


@cached(16)
def _length(linkage: Mechanism, key: str, positive: bool, used: Optional[Arc]) -> Arc:
    """Return the range of a dimension in which the linkage can be assembled."""
    value = float(linkage.dimensions[key])
    size = abs(value) or float(linkage.longest)
    low, high = (_farthest(linkage, key, value, sign * size, used, positive)
                 for sign in (-1.0, 1.0))
    return _whole_stops(value, low, high)


def _farthest(linkage: Mechanism, key: str, value: float, size: float, used: Optional[Arc],
              positive: bool) -> float:
    """Return the end of the range on one side: every sample up to it can be assembled."""
    most = 0.9 * abs(size) if positive and size < 0.0 else MOST * abs(size)
    steps = np.geomspace(LEAST * abs(size), most, TRIED) * math.copysign(1.0, size)
    good, bad = 0.0, None
    for _ in range(2):
        able = _assembled(linkage, key, value + steps, used)
        if able.all():
            good = steps[-1]
            break
        first = int(np.argmin(able))
        good, bad = steps[first - 1] if first else good, steps[first]
        steps = np.linspace(good, bad, TRIED)[1:]
    return float(value + good)


def _assembled(linkage: Mechanism, key: str, values: np.ndarray,
               used: Optional[Arc]) -> np.ndarray:
    """Return for each value of a dimension whether the linkage can be assembled."""
    try:
        tried = linkage.with_dimensions(**{key: values[:, None]})
    except ValueError:
        if len(values) == 1:
            return np.array([False])
        return np.concatenate([_assembled(linkage, key, values[i:i + 1], used)
                               for i in range(len(values))])
    many = ANGLES if len(linkage.inputs) == 1 else FEW_ANGLES
    samples = [np.linspace(low, high, many) for low, high in (
        used or (input_.low, input_.high) for input_ in linkage.inputs)]
    theta = [each.ravel() for each in np.meshgrid(*samples)] if len(samples) > 1 else samples[0]
    placed = np.ones((len(values), 1), dtype=bool)
    for places in tried.solve(theta).values():
        placed = placed & np.isfinite(places).all(axis=-1)
    return np.all(placed, axis=1) if used else np.any(placed, axis=1)


def _whole_stops(value: float, low: float, high: float) -> Tuple[float, float]:
    """Round a range to a hundred whole steps that include the value."""
    low, value, high = (min(max(x, -LARGEST), LARGEST) for x in (low, value, high))
    step = max((high - low) / (STOPS + 1), FINEST * abs(value), 1.0 / LARGEST)
    first = min(math.ceil(low / step), math.floor(value / step))
    return first * step, (first + STOPS) * step
