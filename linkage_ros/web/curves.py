# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Curves of outputs over a turn or a stroke, for the page, and as a table."""

import io
from typing import Any, Sequence

import numpy as np

from .poses import shown
from ..linkage import ascending, sampled, theta_of
from ..scene import SceneError, SceneMechanism

SAMPLES = 361
# The quantities, and whether they are of outputs or of joints.
KINDS = {'position': 'output', 'velocity': 'output', 'acceleration': 'output',
         'transmission angle': 'joint', 'force ratio': 'output'}
POSITION, VELOCITY, ACCELERATION, TRANSMISSION, FORCE = KINDS
# By quantity: the power of the input's speed with which it grows, and what that adds to its unit.
POWERS, PER = {VELOCITY: 1, ACCELERATION: 2}, {VELOCITY: '/s', ACCELERATION: '/s²'}
# Units of the force ratio, by the units of output and input.
FORCES = {('rad', 'm'): 'N·m/N', ('m', 'rad'): 'N/(N·m)'}


class Sweep:
    """
    A sweep of the first input over its reach at 1 rad/s or 1 m/s; the others are fixed.

    It is sampled evenly, or ever denser towards the ends of the reach: next to a dead point a
    position bends too much for even samples.
    """

    def __init__(self, mechanism: SceneMechanism, present: Sequence[float],
                 dense_ends: bool = False) -> None:
        self._mechanism, self.linkage = mechanism, mechanism.linkage
        self.input, self._size = mechanism.first.input, mechanism.scales[0]
        _, *others = np.atleast_1d(mechanism.theta(present))
        reach, dead = self.linkage.reach(*others), self.linkage.dead_points(*others)
        if not reach:
            raise SceneError(f'{mechanism.name} cannot be assembled where its other inputs are')
        is_whole = self.input.is_whole(reach)
        # A NaN separates two arcs.
        values = ascending(np.concatenate([
            *(np.linspace(low, high, SAMPLES) for low, high in reach),
            *(sampled(low, high) for low, high in reach if dense_ends and not is_whole),
            [0.5 * (before + after) for (_, before), (after, _) in zip(reach, reach[1:])]]))
        still = [0.0] * len(others)
        self._inputs, self._speeds, self._still = map(theta_of, (
            [values, *others], [1.0 / self._size, *still], [0.0, *still]))
        self.values, self.dead = values * self._size, np.multiply(dead, self._size)
        # A full rotation has no ends.
        self.ends = self._size * np.ravel([] if is_whole else reach)

    def names(self, kind: str) -> list[str]:
        """Return the joints with a transmission angle, or the outputs."""
        linkage = self.linkage
        if kind == TRANSMISSION:
            return list(linkage.transmission_angles(self._inputs))
        return [*self._mechanism.assembly().joints,
                *(f'{joint}.{axis}' for joint in linkage.points if joint not in linkage.grounded
                  for axis in 'xy')]

    def unit(self, kind: str, name: str) -> str:
        """Return the unit of a quantity; empty for a plain number."""
        unit = 'rad' if kind == TRANSMISSION or self.linkage.is_angle(name) else 'm'
        if kind == FORCE:
            return FORCES.get((unit, self.input.unit), '')
        return unit + PER.get(kind, '')

    @np.errstate(all='ignore')
    def of(self, kind: str, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Return a quantity of each name in the scene's size; not finite where there is none."""
        linkage, inputs, size = self.linkage, self._inputs, self._mechanism.scale_of
        if kind == TRANSMISSION:
            return linkage.transmission_angles(inputs, names)
        if kind == FORCE:
            return {name: 1.0 / value for name, value in self.of(VELOCITY, names).items()}
        if kind == ACCELERATION:
            values = linkage.joint_accelerations(inputs, self._speeds, self._still, names)
        elif kind == VELOCITY:
            values = linkage.joint_rates(inputs, names)
        else:
            values = linkage.joint_angles(inputs, names)
        factor = 1.0 / self._size if kind == VELOCITY else 1.0
        return {name: value * factor * size(name) for name, value in values.items()}


@np.errstate(invalid='ignore')
def curve(mechanism: SceneMechanism, present: Sequence[float], kind: str = POSITION,
          output: str | None = None) -> dict[str, Any]:
    """
    Return one of KINDS over the first input: x and y in `units`, y None where it has none.

    `ends` are those of the reach, `dead` the other dead points; y grows with the `power` of the
    input's speed.
    """
    sweep = Sweep(mechanism, present, dense_ends=True)
    names = sweep.names(kind)
    output = names[0] if names and output is None else output or ''
    x, unit, y = sweep.values, sweep.unit(kind, output), sweep.of(kind, (output,))[output]
    # No line is drawn through a pole.
    after = np.searchsorted(x, sweep.dead[(x[0] < sweep.dead) & (sweep.dead < x[-1])])
    if kind == FORCE:
        after = np.append(after, 1 + np.flatnonzero(y[:-1] * y[1:] < 0.0))
    if kind not in (POSITION, TRANSMISSION):
        y[after - 1] = y[after] = np.nan
    if (kind, unit) == (POSITION, 'rad'):
        known = np.isfinite(y)
        y[known] = np.unwrap(y[known])
    return {'input': sweep.input.name, 'output': output, 'names': names,
            'units': [sweep.input.unit, unit], 'power': POWERS.get(kind, 0), 'x': x.tolist(),
            'y': list(map(shown, y.tolist())),
            'ends': sweep.ends.tolist(), 'dead': np.setdiff1d(sweep.dead, sweep.ends).tolist()}


def table(mechanism: SceneMechanism, present: Sequence[float]) -> str:
    """Return all kinds of all outputs over the first input as CSV, in rad and m."""
    sweep, text = Sweep(mechanism, present), io.StringIO()
    columns = {f'{sweep.input.name} [{sweep.input.unit}]': sweep.values, **{
        f'{kind} {name} [{sweep.unit(kind, name) or 1}]': values for kind in KINDS
        for name, values in sweep.of(kind, sweep.names(kind)).items()}}
    np.savetxt(text, np.stack(list(columns.values()), 1), '%.12g', ',', comments='',
               header=','.join(f'"{name}"' for name in columns))
    return text.getvalue()
