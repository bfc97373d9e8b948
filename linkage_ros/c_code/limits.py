# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Limits of actuators and joints that follow from the sweeps and the reach."""

from __future__ import annotations

import math
from typing import Iterator, Sequence
from xml.sax.saxutils import quoteattr

import numpy as np

from .axes import Axis, joints, start
from ..scene import SceneMechanism

# Poses of several inputs at which the joints are looked at.
SAMPLES = 200_000


def lines(mechanism: SceneMechanism, names: Sequence[str] = ()) -> Iterator[str]:
    """Yield each commanded joint with its limits as an element of a URDF; see `axes.joints`."""
    for axis in joints(mechanism, names):
        limits = ends(mechanism, axis)
        limit = f'<limit lower="{limits[0]!r}" upper="{limits[1]!r}"/>' if limits else \
            '<!-- it turns without an end: continuous -->'
        yield f'<joint name={quoteattr(axis.name)}>{limit}</joint>'


def middle(mechanism: SceneMechanism, axis: Axis) -> float:
    """Return the middle of positions that pass half a turn from zero, but do not turn; else 0."""
    low, high = axis.turn and ends(mechanism, axis) or (0.0, 0.0)
    return 0.5 * (low + high) if max(-low, high) > 0.5 * axis.turn else 0.0


def ends(mechanism: SceneMechanism, axis: Axis) -> tuple[float, float] | None:
    """
    Return the lowest and the highest position of an actuator or a joint; None if it turns on.

    If it does not count turns, their middle is within half a turn of zero.
    """
    linkage, inputs = mechanism.linkage, mechanism.inputs
    # The arcs of each input, in the linkage's own units.
    arcs = [np.divide(settings.arcs, mechanism.scale_of(name))
            for name, settings in inputs.items()]
    values = np.array(linkage.extremes(axis.output, arcs[0].tolist()))[..., 0] if len(
        arcs) == 1 else _values(mechanism, axis, arcs)
    if np.isnan(values).all():
        raise ValueError(f'{mechanism.name} cannot be assembled in its sweep')
    low, high = sorted(float(axis.factor * end + axis.offset)
                       for end in (np.nanmin(values), np.nanmax(values)))
    # What counts turns may do so in a sweep only.
    turns = axis.turn or linkage.is_angle(axis.output) and not any(
        settings.ends for settings in inputs.values())
    if turns and high - low >= math.tau * abs(axis.factor) * (1.0 - 1e-9):
        return None
    shift = axis.turn and axis.turn * round(0.5 * (low + high) / axis.turn)
    return low - shift, high - shift


def _values(mechanism: SceneMechanism, axis: Axis, arcs: Sequence[np.ndarray]) -> np.ndarray:
    """Return an output at the start and at many poses, the corners of the sweeps among them."""
    linkage, rng = mechanism.linkage, np.random.default_rng(1)
    parts = rng.uniform(-0.1, 1.1, (len(arcs), SAMPLES)).clip(0.0, 1.0)
    inputs = [np.append(first, arc.min() + part * np.ptp(arc))
              for first, part, arc in zip(start(mechanism), parts, arcs)]
    values = linkage.compiled('checked', (axis.output,)).over(*inputs)[0]
    first = values[np.isfinite(values).argmax()]
    return first + np.remainder(values - first + math.pi, math.tau) - math.pi if axis.turn \
        else values
