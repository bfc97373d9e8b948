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
Crank angles that bring about a wanted value of any output.

Where the output fixes a joint that is one bar or one slot away from the crank pin, the linkage is
driven backwards, with the constructions that it is made of: `backward`. Every other output is cut
at its extremes into monotone pieces, in each of which a value is found by Newton's method kept
inside a bracket, to the last digit: `Pieces`.
"""

from __future__ import annotations

import math
from typing import Callable, Iterable, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from . import planar
from .expression import angle, arctangent, Complex, Real
from .reach import Arc, between, NARROWEST, sign_changes
from .sketch import GROUND, Link, Sketch

TURN = 2.0 * math.pi
# Samples of an arc in search of extremes, and of a piece in search of a bracket.
EXTREMES, SAMPLES = 360, 65
# Rounding of an angle on its way through a closed form [rad].
ROUNDED = 8 * 2.0 ** -52 * math.pi
# Marks nearer to each other than this [rad] are one.
CLOSE = 1e-9
# Newton's method halves its error more than once a step; bisection needs one step a bit.
STEPS = 200


def wrapped(theta):
    """Return angles [rad] in [-pi, pi)."""
    theta = theta - TURN * np.floor((theta + math.pi) / TURN)
    return np.where(theta >= math.pi, -math.pi, theta)


def in_order(answers: np.ndarray) -> np.ndarray:
    """
    Return crank angles, shape (candidates, n), as shape (n, answers).

    Each row ascends in [-pi, pi), holds no angle twice, and is filled up with NaN.
    """
    rows = np.sort(wrapped(answers), axis=0)
    if len(rows) > 1:
        rows[1:][np.diff(rows, axis=0) <= NARROWEST] = np.nan
        last = np.nanmax(rows, axis=0, initial=-np.inf)
        again = (rows == last) & (last - rows[0] >= TURN - NARROWEST)
        rows = np.sort(np.where(again, np.nan, rows), axis=0)
    most = int(np.isfinite(rows).sum(axis=0).max(initial=0))
    rows = rows[:max(most, 1)] if len(rows) else np.full((1, answers.shape[1]), np.nan)
    return np.moveaxis(rows, 0, -1)


def inside(theta: np.ndarray, arcs: Sequence[Arc]) -> np.ndarray:
    """Return angles [rad] that lie on arcs, at an end those beyond it by rounding; NaN others."""
    if any(hi - lo >= TURN for lo, hi in arcs):
        return theta
    kept = np.full(theta.shape, np.nan)
    for lo, hi in arcs:
        past = np.mod(theta - lo, TURN)
        kept = np.where(past <= hi - lo, theta, kept)
        kept = np.where((past > hi - lo) & (past - (hi - lo) <= ROUNDED), hi, kept)
        kept = np.where(past >= TURN - ROUNDED, lo, kept)
    return kept


def nearest(answers: np.ndarray, near) -> np.ndarray:
    """Return of answers, shape (..., k), the one nearest to an angle, whole turns included."""
    near = np.asarray(near, float)[..., None]
    theta = answers + TURN * np.round((near - answers) / TURN)
    away = np.where(np.isnan(theta), np.inf, np.abs(theta - near))
    best = np.argmin(away, axis=-1)[..., None]
    return np.take_along_axis(np.broadcast_to(theta, away.shape), best, -1)[..., 0][()]


def distinct(theta: Iterable[float]) -> List[float]:
    """Return angles [rad] in [-pi, pi), in order, without those next to another."""
    kept: List[float] = []
    for each in sorted(wrapped(np.array(list(theta), float)).tolist()):
        if not kept or each - kept[-1] > CLOSE and each - kept[0] < TURN - CLOSE:
            kept.append(each)
    return kept


class _Piece(NamedTuple):
    """An arc on which an output is monotone: samples of it; whether it is a whole turn."""

    theta: np.ndarray
    value: np.ndarray
    sign: float
    whole: bool


class Pieces:
    """
    An output over the reach, in monotone pieces.

    Parameters
    ----------
    curve : callable
        From crank angles, shape (n,), to the output and its rate, shape (2, n).
    reach : sequence of (float, float)
        The crank angles that can be assembled [rad].
    marks : sequence of float
        Crank angles next to which the output may change quickly.
    angular : bool
        Whether the output is an angle, compared modulo a turn.
    tolerance : float
        How far beyond an extreme a value still counts as the extreme.
    short : float
        How far short of an extreme it does.

    """

    def __init__(self, curve: Callable, reach: Sequence[Arc], marks: Sequence[float],
                 angular: bool, tolerance: float, short: float = 0.0):
        self._curve = curve
        self._angular = angular
        self._tolerance = tolerance
        self._short = short
        self._marks = distinct(marks)
        self._pieces = [piece for arc in reach for piece in self._cut(*arc)]

    @property
    def moves(self) -> bool:
        """Whether the output changes by more than rounding."""
        return bool(self._pieces)

    def answers(self, values: np.ndarray) -> np.ndarray:
        """Return the crank angles [rad] for values, shape (n,), as shape (candidates, n)."""
        found = [np.full(values.shape, np.nan)]
        for piece in self._pieces:
            for target in self._targets(piece, values):
                held = np.flatnonzero(np.isfinite(target))
                if len(held):
                    found.append(np.full(values.shape, np.nan))
                    found[-1][held] = self._solved(piece, target[held])
        return np.array(found)

    def _cut(self, lo, hi):
        whole = hi - lo >= TURN
        spread = np.ptp(self._sampled(self._grid(lo, hi, SAMPLES)))
        if not spread > self._tolerance:
            return
        ends = [end for arc in self._split(lo, hi)
                for end in sign_changes(lambda theta: self._curve(theta)[1], *arc, EXTREMES)]
        if whole and np.diff(self._curve(np.array([lo, hi]))[1] >= 0.0):
            ends.append(lo)
        arcs = between(ends) if whole else list(zip([lo, *ends], [*ends, hi]))
        for start, end in arcs:
            theta = self._grid(start, end, SAMPLES)
            value = self._sampled(theta)
            sign = 1.0 if value[-1] >= value[0] else -1.0
            yield _Piece(theta, np.maximum.accumulate(sign * value), sign, whole and not ends)

    def _split(self, lo, hi) -> List[Arc]:
        inside = [mark + TURN * math.ceil((lo - mark) / TURN) for mark in self._marks]
        ends = [lo, *sorted(mark for mark in inside if lo < mark < hi), hi]
        return list(zip(ends, ends[1:]))

    def _grid(self, lo, hi, samples):
        """Return samples of an arc, dense towards its ends and towards marks."""
        fraction = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, samples))
        parts = [start + (end - start) * fraction for start, end in self._split(lo, hi)]
        return np.unique(np.concatenate([np.clip(part, lo, hi) for part in parts]))

    def _sampled(self, theta):
        value = self._curve(theta)[0]
        return np.unwrap(value) if self._angular else value

    def _targets(self, piece, values):
        """Yield the values as the piece counts them; NaN where it does not hold them."""
        lo, hi = piece.value[0], piece.value[-1]
        values = piece.sign * values
        if piece.whole:
            turns = int(round((hi - lo) / TURN))
            first = values + TURN * np.ceil((lo - values) / TURN)
            for turn in range(turns):
                yield np.clip(first + turn * TURN, lo, hi)
            return
        slack = self._tolerance
        if not self._angular:
            held = (values >= lo - slack) & (values <= hi + slack)
            yield np.where(held, np.clip(values, lo, hi), np.nan)
            return
        first = values + TURN * np.ceil((lo - slack - values) / TURN)
        for turn in range(int((hi - lo + 2.0 * slack) // TURN) + 1):
            target = first + turn * TURN
            yield np.where(target <= hi + slack, np.clip(target, lo, hi), np.nan)

    def _solved(self, piece, target):
        """Return where the piece meets its targets, by Newton's method inside a bracket."""
        index = np.clip(np.searchsorted(piece.value, target), 1, len(piece.theta) - 1)
        lo, hi = piece.theta[index - 1], piece.theta[index]
        theta, step = 0.5 * (lo + hi), hi - lo
        best, least = theta, np.full(theta.shape, np.inf)
        done = np.zeros(theta.shape, bool)
        for _ in range(STEPS):
            value, rate = self._curve(theta)
            gap = piece.sign * value - target
            if self._angular:
                gap = gap - TURN * np.round(gap / TURN)
            closer = np.abs(gap) < least
            best, least = np.where(closer, theta, best), np.where(closer, np.abs(gap), least)
            lo, hi = np.where(gap < 0.0, theta, lo), np.where(gap < 0.0, hi, theta)
            with np.errstate(all='ignore'):
                guess = theta - gap / (piece.sign * rate)
            digit = np.spacing(np.maximum(np.abs(lo), np.abs(hi)))
            done |= (least == 0.0) | (hi - lo <= digit) | (np.abs(guess - theta) <= digit)
            if done.all():
                break
            good = (lo < guess) & (guess < hi) & (np.abs(guess - theta) < 0.5 * step)
            following = np.where(good, guess, 0.5 * (lo + hi))
            theta, step = following, np.abs(following - theta)
        best = np.where(target >= piece.value[-1] - self._short, piece.theta[-1], best)
        return np.where(target <= piece.value[0] + self._short, piece.theta[0], best)


class Backward(NamedTuple):
    """The crank angles [rad] that an output allows, and the joint whose branch tells which is."""

    angles: Tuple[Real, ...]
    joint: Optional[str]


def backward(sketch: Sketch, output: str, value: Real,
             branches: Mapping[str, int]) -> Optional[Backward]:
    """
    Drive a linkage with one crank from one of its outputs.

    Parameters
    ----------
    sketch : Sketch
        The linkage.
    output : str
        A link's name, or a joint's name with .x or .y.
    value : Real
        The value it is to have, an expression of angle 0.
    branches : mapping
        The joints with an assembly sign.

    Returns
    -------
    Backward or None
        None where no single dyad, slot or circle leads from the output to the crank.

    """
    return _Reversed(sketch, value, branches).driven_by(output)


class ClosedForm:
    """
    The crank angles that an output allows, of which the linkage's branch takes some.

    Parameters
    ----------
    backward : callable
        From values, shape (n,), to candidates [rad], shape (k, n).
    curve : callable
        From crank angles to the output and its rate.
    twin : callable, optional
        The same of the linkage on its other branch: a candidate belongs to the branch that
        gives the value back more nearly.
    reach : sequence of (float, float)
        The crank angles that can be assembled [rad].
    angular : bool
        Whether the output is an angle, compared modulo a turn.

    """

    def __init__(self, backward: Callable, curve: Callable, twin: Optional[Callable],
                 reach: Sequence[Arc], angular: bool):
        self._backward = backward
        self._reach = reach
        self._curve = curve
        self._twin = twin
        self._angular = angular

    def answers(self, values: np.ndarray) -> np.ndarray:
        """Return the crank angles [rad] for values, shape (n,), as shape (candidates, n)."""
        theta = inside(self._backward(values), self._reach)
        miss = self._miss(self._curve, theta, values)
        if self._twin is None:
            return np.where(np.isfinite(miss), theta, np.nan)
        return np.where(miss <= self._miss(self._twin, theta, values), theta, np.nan)

    def _miss(self, curve, theta, values):
        miss = curve(theta)[0] - values
        if self._angular:
            miss = miss - TURN * np.round(miss / TURN)
        return np.where(np.isnan(miss), np.inf, np.abs(miss))


class _Reversed:
    """A linkage that one of its outputs drives."""

    def __init__(self, sketch, value, branches):
        self._sketch = sketch
        self._value = value
        self._branches = branches
        self._links = {link.name: link for link in sketch.links}
        self._pin = next(name for name, point in sketch.points.items() if point.crank)
        self._crank = sketch.points[self._pin].crank

    def driven_by(self, output):
        name, _, axis = output.rpartition('.')
        if not name:
            link = self._links[output]
            if link.parent != GROUND or output == 'crank':
                return None
            if link.kind == 'prismatic':
                return self._through_place(link.tip, self._on_line(link, self._value))
            return self._through_link(link, [self._turned(link)])
        point = self._sketch.points[name]
        if name in self._sketch.corners:
            return self._through_inversor(axis, *self._sketch.corners[name])
        home = self._links.get(point.home)
        if home and home.parent == GROUND and home.kind == 'revolute':
            bars = self._across(home, name, axis)
            return self._cranks(bars) if home.name == 'crank' else self._through_link(home, bars)
        for link in self._links.values():
            if link.kind == 'prismatic' and (link.parent, link.tip) == (GROUND, name):
                start, along = self._line(link)
                slide = (self._value - getattr(start, axis)) / getattr(along, axis)
                return self._through_place(name, start + along * slide)
        return None

    def _cranks(self, bars, joint=None):
        """Return the crank angles for vectors along the crank."""
        bars = [bar * self._crank.zero.conjugate() for bar in bars]
        return Backward(tuple(arctangent(bar.y, bar.x) for bar in bars), joint)

    def _turned(self, link) -> Complex:
        """Return the unit vector of a link on the ground that is turned by the value."""
        return self._follower(link, Complex(1.0, 0.0)).bar()

    def _follower(self, link, local: Complex) -> planar.Crank:
        """Return a point of a link on the ground as the pin of a crank."""
        upright = link.zero.value != 0.0
        zero = Complex(0.0, 1.0) if upright else Complex(1.0, 0.0)
        centre, length = self._sketch.points[link.joint].place, local.length()
        return planar.Crank(centre, length, zero * (local / length), angle(0))

    def _across(self, link, name, axis) -> List[Complex]:
        """Return the unit vectors of a link on the ground that put a joint's coordinate there."""
        local = self._sketch.frames[link.name][name]
        start, along = ((Complex(self._value, 0.0), Complex(0.0, 1.0)) if axis == 'x' else
                        (Complex(0.0, self._value), Complex(1.0, 0.0)))
        centre = self._sketch.points[link.joint]
        rail = planar.Rail(centre.place, start, along, centre.span)
        found = [planar.slider(rail, local.length(), side) for side in (1.0, -1.0)]
        return [each.rod * local.conjugate() / local.squared() for each in found]

    def _through_link(self, link: Link, bars: List[Complex]):
        """Go from unit vectors of a link on the ground to the crank, by a bar or a slot."""
        centre = self._sketch.points[link.joint].place
        for slide in self._links.values():
            if slide.parent == link.name and slide.kind == 'prismatic' and slide.tip == self._pin:
                offset = self._sketch.frames[slide.name][self._pin].y
                rails = [planar.Rail(self._crank.centre, centre + bar.turned() * offset, bar,
                                     self._span()) for bar in bars]
                return self._cranks([planar.slider(rail, self._crank.length, side).rod
                                     for rail in rails for side in (1.0, -1.0)], link.tip)
        for tip, local in self._sketch.frames[link.name].items():
            radius = self._rod(tip)
            if radius is None or tip == link.joint:
                continue
            arms = ([planar.CrankArm(self._crank.centre, self._follower(link, local))]
                    if len(bars) == 1 else [self._arm(centre + bar * local) for bar in bars])
            return self._through_rod(tip, radius, arms)
        return None

    def _through_place(self, tip, place):
        """Go from the place of a joint to the crank, by a bar."""
        radius = self._rod(tip)
        return None if radius is None else self._through_rod(tip, radius, [self._arm(place)])

    def _through_rod(self, tip, radius, arms):
        dyads = [planar.dyad(arm, self._crank.length, radius, side, smooth=False)
                 for arm in arms for side in (planar.LEFT, planar.RIGHT)]
        return self._cranks([dyad.first for dyad in dyads], tip)

    def _through_inversor(self, axis, pole, pin, power):
        arm = self._sketch.arm(pole, pin)
        if pin != self._pin or not isinstance(arm, planar.CrankArm):
            return None
        bar = arm.crank_of_inverse(axis, self._value, power)
        return bar and self._cranks([bar * self._crank.zero])

    def _rod(self, tip) -> Optional[Real]:
        """Return the length of the bar from the pin to a joint that has a branch, if any."""
        for bar in self._sketch.bars:
            if {bar.first, bar.second} == {self._pin, tip} and tip in self._branches:
                return bar.length
        return None

    def _line(self, link) -> Tuple[Complex, Complex]:
        """Return the start and unit vector of the line that a block slides on."""
        return self._sketch.points[link.joint].place, self._sketch.lines[link.name]

    def _on_line(self, link, slide) -> Complex:
        start, along = self._line(link)
        return start + along * slide

    def _arm(self, place) -> planar.Arm:
        return planar.Arm(self._crank.centre, place - self._crank.centre, self._span())

    def _span(self) -> Real:
        return self._sketch.points[self._links['crank'].joint].span
