# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Limits of the commanded joints that follow from the sweeps and the reach."""

import math
from typing import Iterator, List, Sequence, Tuple
from xml.sax.saxutils import quoteattr

import numpy as np

from .axes import Axis, joints, start
from ..scene import SceneMechanism

# Poses of several inputs at which the joints are looked at.
SAMPLES = 200_000


def text(machine: SceneMechanism, names: Sequence[str] = ()) -> str:
    """Return the limits of the commanded joints as elements of a URDF; see `axes.joints`."""
    lines = []
    for name, low, high in joint_limits(machine, names):
        limit = f'<limit lower="{low:.9g}" upper="{high:.9g}"/>' if math.isfinite(
            high - low) else '<!-- it turns without an end: continuous -->'
        lines.append(f'<joint name={quoteattr(name)}>{limit}</joint>')
    return '\n'.join(lines)


def joint_limits(machine: SceneMechanism, names: Sequence[str] = ()
                 ) -> Iterator[Tuple[str, float, float]]:
    """Yield the name of each commanded joint, and its limits [rad or m]; infinite: it turns."""
    for axis in joints(machine, names):
        ends = _of_one(machine, axis) if len(machine.inputs) == 1 else _of_several(machine, axis)
        low, high = sorted(axis.factor * end + axis.offset for end in ends)
        is_turning = axis.turn and high - low >= axis.turn * (1.0 - 1e-9)
        yield (axis.name, -math.inf, math.inf) if is_turning else (axis.name, low, high)


def _arcs(machine: SceneMechanism) -> List[Tuple[Tuple[float, float], ...]]:
    """Return the arcs of each input, in the linkage's own units."""
    return [tuple((low / machine.scale_of(name), high / machine.scale_of(name))
                  for low, high in ([drive.ends] if drive.ends else drive.reach))
            for name, drive in machine.inputs.items()]


def _of_one(machine: SceneMechanism, axis: Axis) -> Tuple[float, float]:
    input_, (arcs,) = machine.linkage.inputs[0], _arcs(machine)
    if axis.output == input_.name:
        return (-math.inf, math.inf) if input_.is_whole(arcs) and machine.first.ends is None \
            else (min(low for low, _ in arcs), max(high for _, high in arcs))
    found = np.array(machine.linkage.extremes(axis.output, arcs))
    return float(found[:, 0, 0].min()), float(found[:, 1, 0].max())


def _of_several(machine: SceneMechanism, axis: Axis) -> Tuple[float, float]:
    """Return the limits at many poses, the corners of the sweeps among them."""
    linkage, rng = machine.linkage, np.random.default_rng(1)
    arcs = [(min(low for low, _ in own), max(high for _, high in own)) for own in _arcs(machine)]
    parts = rng.uniform(-0.1, 1.1, (len(arcs), SAMPLES)).clip(0.0, 1.0)
    inputs = [low + part * (high - low) for part, (low, high) in zip(parts, arcs)]
    values = linkage.joint_angles(inputs, [axis.output])[axis.output]
    if axis.turn:
        first = float(linkage.joint_angles(start(machine), [axis.output])[axis.output])
        turned = values - first
        values = first + turned - math.tau * np.round(turned / math.tau)
    return float(np.nanmin(values)), float(np.nanmax(values))
