# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Servo angles: where the crank has to be for an output, at what reduction, and which is taken.

The reduction, d output / d crank, grows without bound next to an end of the reach, where a crank
angle that is rounded no longer tells it. There it is taken from the output's side, on which it is
the reciprocal of a rate that vanishes: the closed form that leads from the output to the crank is
differentiated.

A lever that a crank pin moves by its slot has a closed form of its own, which keeps every digit
next to its limits. About its pivot Q, seen along the ground line of length b from Q to the crank's
centre O, with the crank a, the slot's distance e, the lever's angle phi and the crank's theta:

    a e^(i theta) + b = e^(i phi) (t + i e),    a e^(i theta) = e^(i phi) (W + i (e + b sin phi)),
    W^2 = a^2 - (e + b sin phi)^2,    t = b cos phi + W,    d phi / d theta = W / t.

Of W and -W those are answers that leave the pin on the lever's half of its slot.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Callable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from . import mechanism
from .compiler import Program
from .expression import (
    angle,
    arctangent,
    Complex,
    cosine,
    derivative,
    exact_sum,
    gated,
    Real,
    root,
    sine,
    square,
    where,
)
from .planar import GRAZE
from .reach import NARROWEST
from .sketch import GROUND

TURN = 2.0 * np.pi
# Rounding of an angle on its way through a closed form [rad].
ROUNDED = 8 * 2.0 ** -52 * np.pi
# Angles nearer than this [rad] may be one, if the output does not tell them apart.
CLOSE = 1e-7


class Answers(NamedTuple):
    """
    Crank angles [rad] that give an output its value, and d output / d crank there.

    Both have the answers on a last axis, filled up with NaN; `working` tells whether the first
    is the one on the branch that a lever works on.
    """

    angles: np.ndarray
    rates: np.ndarray
    working: bool = False

    def taken(self, near=None, ends: Optional[Sequence[float]] = None,
              rounding: float = 0.0) -> Tuple[np.ndarray, np.ndarray]:
        """
        Return one answer to each value, and its rate; NaN where there is none.

        Parameters
        ----------
        near : float or array-like, optional
            The answer nearest to this angle [rad] is taken, whole turns included. Default: the
            working branch or, if the answers know none, the least angle.
        ends : (float, float), optional
            The lowest and the highest angle [rad] that may be taken. Default: any with near,
            otherwise those from -pi to pi.
        rounding : float
            How exactly the output is known; tells what still counts as at an end.

        """
        low, high = (-np.inf, np.inf) if ends is None else ends
        with np.errstate(all='ignore'):
            slack = np.fmin(rounding / np.abs(self.rates), CLOSE) + 4.0 * np.spacing(
                np.pi if ends is None else max(np.pi, -low, high))
            first = np.ceil((low - slack - self.angles) / TURN)
            last = np.floor((high + slack - self.angles) / TURN)
            if near is None:
                turns = first if ends else np.zeros_like(first)
                theta = self.angles + TURN * turns
                away = np.arange(theta.shape[-1], dtype=float) if self.working else theta
            else:
                near = np.asarray(near, float)[..., None]
                turns = np.clip(np.rint((near - self.angles) / TURN), first, last)
                theta = self.angles + TURN * turns
                away = np.abs(theta - near)
            none = np.isnan(theta) | ~(first <= last)
        theta = np.where(none, np.nan, np.clip(theta, low, high))
        best = np.argmin(np.where(none, np.inf, away), axis=-1)[..., None]
        return tuple(np.take_along_axis(np.broadcast_to(part, none.shape), best, -1)[..., 0][()]
                     for part in (theta, np.where(none, np.nan, self.rates)))


class Mechanism(mechanism.Mechanism):
    """A linkage that is solved from its outputs, its levers by a closed form of their own."""

    def crank_angle(self, output, value, near=None, others=()):
        """Return the crank angles that give an output a value; see `Analysis.crank_angle`."""
        if len(self.cranks) > 1 or others or not self._program(lever_inverse, output):
            return super().crank_angle(output, value, near, others)
        found = self.servos(output, value)
        if near is not None:
            return found.taken(near)[0]
        theta = np.sort(np.where(found.angles >= np.pi, -np.pi, found.angles), axis=-1)
        theta[..., 1][np.diff(theta)[..., 0] <= NARROWEST] = np.nan
        return theta if np.isfinite(theta[..., 1]).any() else theta[..., :1]

    def servos(self, output: str, value) -> Answers:
        """
        Return all servo angles for an output, with the reductions.

        Parameters
        ----------
        output : str
            What `crank_angle` takes, of a linkage with one crank.
        value : float or array-like
            What the output is to be.

        Raises
        ------
        ValueError
            As `crank_angle` does.

        """
        lever = self._program(lever_inverse, output)
        if not lever:
            theta = np.asarray(self.crank_angle(output, value))
            return Answers(theta, self._rates_at(output, theta, np.asarray(value, float)))
        found = np.moveaxis(lever.over(value), 0, -1)
        theta, rates = found[..., :2], found[..., 2:]
        if len(self._structure.sketch.limits) > 1:
            theta = _inside(theta, self._arcs())
        return Answers(theta, np.where(np.isnan(theta), np.nan, rates), working=True)

    def _arcs(self):
        """Return the reach, worked out once."""
        if 'arcs' not in self._poses:
            self._poses['arcs'] = self.reach()
        return self._poses['arcs']

    def _rates_at(self, output, theta, value):
        """Return d output / d crank at answers, from the side on which it is the smaller one."""
        joint, _, axis = output.rpartition('.')
        rates = (self.velocity(theta, (joint,))[joint][..., 'xy'.index(axis)] if joint
                 else self.joint_rates(theta, (output,))[output])
        backward = self._program(backward_rates, output)
        steep = np.abs(rates) > (1.0 if self._structure.turns(output) else self.longest)
        if not backward or not steep.any():
            return rates
        angles, inverse = np.split(backward.over(value)[..., None], 2)
        away = np.abs(_wrapped(angles - theta))
        away = np.where(np.isnan(away), np.inf, away)
        best = np.argmin(away, axis=0)[None]
        with np.errstate(all='ignore'):
            there = 1.0 / np.take_along_axis(np.broadcast_to(inverse, away.shape), best, 0)[0]
        return np.where(steep & (away.min(axis=0) < CLOSE), there, rates)

    def _program(self, draw: Callable, output: str):
        """Return the code that solves for an output in some way, None if there is none."""
        if output not in self.joints and output.rpartition('.')[0] not in self.points:
            return None
        key = draw, output
        if key not in self._poses:
            program = _compiled(draw, self._structure, output)
            self._poses[key] = program and program.bind(self._lengths, self._evaluated)
        return self._poses[key]


@lru_cache(maxsize=256)
def _compiled(draw, structure, output):
    outputs = draw(structure, output)
    return outputs and Program(outputs)


def lever_inverse(structure, name: str) -> Optional[List[Real]]:
    """
    Return both crank angles for a lever's angle, the working branch first, and the reductions.

    None for what is no lever that the first crank's pin moves by its slot.
    """
    sketch = structure.sketch
    links = {link.name: link for link in sketch.links}
    slide = next((link for link in sketch.links if link.kind == 'prismatic'
                  and link.parent == name), None)
    crank = slide and sketch.points[slide.tip].crank
    if not crank or links[name].parent != GROUND or crank.angle.args[0]:
        return None
    half, e = structure.branches[links[name].tip], sketch.frames[slide.name][slide.tip].y
    line = crank.centre - sketch.points[slide.joint].place
    a, b, along = crank.length, line.length(), line.direction()
    upright = Complex(0.0, 1.0) * along.conjugate()
    bar = Complex(cosine(angle(0)), sine(angle(0))) * upright
    cos, sin = bar.x, bar.y
    # Next to a limit at +-90 degrees the gap is small: it is formed from what is small.
    upper = where(0.7 < sin, exact_sum(a, -e, -b) + b * square(cos) / (1.0 + sin),
                  exact_sum(a, -e) - b * sin)
    lower = where(sin < -0.7, exact_sum(a, e, -b) + b * square(cos) / (1.0 - sin),
                  exact_sum(a, e) + b * sin)
    grazed = GRAZE * (a + b + abs(e))
    height = root(upper, grazed) * root(lower, grazed)
    turn, angles, rates = along * crank.zero.conjugate(), [], []
    for share in (half * height, -half * height):
        pin = bar * Complex(share, e + b * sin) * turn
        t = half * (b * cos + share)
        # On the pivot the slot's line is anywhere; at the slot's end the crank turns no further.
        held = where(abs(e) <= grazed, t - grazed, t + grazed)
        angles.append(gated(arctangent(pin.y, pin.x), held, 0.0))
        rates.append(gated(half * share / where(0.0 < t, t, 0.0), held, 0.0))
    return angles + rates


def backward_rates(structure, output: str) -> Optional[List[Real]]:
    """Return the crank angles that a value may have, and their rates, by its closed form."""
    backward = structure.backward(output)
    if backward is None:
        return None

    def rate(theta):
        y, x = theta.args
        dy, dx = (derivative(part, {0: 1.0}, known) for part in (y, x))
        return (x * dy - y * dx) / (square(x) + square(y))

    known = {}
    return [*backward.angles, *map(rate, backward.angles)]


def _wrapped(theta):
    """Return angles [rad] within half a turn of zero."""
    return theta - TURN * np.round(theta / TURN)


def _inside(theta, arcs):
    """Return angles [rad] that lie on arcs, those beyond an end by rounding at it; NaN others."""
    kept = np.full(theta.shape, np.nan)
    for low, high in arcs:
        turns = TURN * np.round((0.5 * (low + high) - theta) / TURN)
        held = (theta + turns >= low - ROUNDED) & (theta + turns <= high + ROUNDED)
        ended = np.clip(theta + turns, low, high)
        kept = np.where(held, np.where(ended == theta + turns, theta, ended - turns), kept)
    return kept
