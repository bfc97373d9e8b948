# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Useful ranges for the page's sliders of parameters; values beyond them are allowed, too.

No ROS is needed.
"""

from __future__ import annotations

import math

import numpy as np

from . import SceneMechanism
from .parameters import Parameter
from ..cache import cached
from ..linkage import Arc, Mechanism, theta_of

# Smallest and largest change of a dimension that is tried, as fractions of it, or of the longest
# bar if it is 0; and the number of changes tried.
MIN_CHANGE, MAX_CHANGE, CHANGES = 1e-4, 9.0, 200
# Largest end of a range.
MAX_END = 1e300
# Values tried of a single input, and of each of several.
ANGLES, FEW_ANGLES = 91, 13


def ends(mechanism: SceneMechanism, parameter: Parameter) -> Arc | None:
    """Return the ends of the slider of a mechanism's parameter; None if it has no slider."""
    field, value = parameter.field, parameter.value
    if field.ends:
        return field.ends
    if field.kind != 'double':
        return None
    _, what, key = [*parameter.name.split('.'), ''][:3]
    if what == 'dimensions':
        # A crank that turns fully has to do so still.
        first, *others = mechanism.inputs.values()
        turns = not others and first.input.is_whole(first.reach)
        return _dimension_ends(mechanism.linkage, key, field.positive,
                               first.sweep or first.reach[0] if turns else None)
    if key == 'start':
        tried = [value, *(end for arc in mechanism.inputs[what].reach for end in arc)]
    elif key == 'offset':
        tried = [value + side * math.pi * mechanism.inputs[what].input.size for side in (-1, 1)]
    else:
        tried = [0.1 * value, 10.1 * value]
    return max(min(tried), -MAX_END), min(max(tried), MAX_END)


@cached(16)
def _dimension_ends(linkage: Mechanism, key: str, positive: bool, required: Arc | None) -> Arc:
    """Return the slider's ends for a dimension: up to them, all tried can be assembled."""
    value = float(linkage.dimensions[key])
    size = abs(value) or float(linkage.longest)
    ends = []
    for farthest in (-0.9 if positive else -MAX_CHANGE, MAX_CHANGE):
        changes = np.geomspace(math.copysign(MIN_CHANGE, farthest), farthest, CHANGES) * size
        able = _are_assembled(linkage, key, value + changes, required)
        ends.append(value + float(np.append(0.0, changes)[np.append(able, False).argmin()]))
    return ends[0], ends[1]


def _are_assembled(linkage: Mechanism, key: str, values: np.ndarray,
                   required: Arc | None) -> np.ndarray:
    """
    Return for each value of a dimension whether the linkage can be assembled, (values,).

    It must be at all angles tried in the range `required` [rad], or at one input if that is None.
    """
    try:
        tried = linkage.with_dimensions(**{key: values[:, None]})
    except ValueError:
        half = len(values) // 2
        return np.concatenate([_are_assembled(linkage, key, part, required) for part in (
            values[:half], values[half:])]) if half else np.array([False])
    count = ANGLES if len(linkage.inputs) == 1 else FEW_ANGLES
    ranges = [required or (input_.low, input_.high) for input_ in linkage.inputs]
    theta = [grid.ravel() for grid in np.meshgrid(
        *(np.linspace(low, high, count) for low, high in ranges))]
    placed = np.ones((len(values), 1), dtype=bool)
    for places in tried.solve(theta_of(theta)).values():
        placed = placed & np.isfinite(places).all(axis=-1)
    return np.all(placed, axis=1) if required else np.any(placed, axis=1)
