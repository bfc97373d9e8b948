# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Servo angles: where the input has to be for an output, at what reduction, and which is taken.

The reduction, d output / d input, grows without bound next to an end of the reach, where a crank
angle that is rounded no longer tells it. A lever that a crank pin moves by its slot has a closed
form for both that starts from the lever, and keeps every digit next to its limits. About its pivot
Q, seen along the ground line of length b from Q to the crank's centre O, with the crank a, the
slot's distance e, the lever's angle phi and the crank's theta:

    a e^(i theta) + b = e^(i phi) (t + i e),    a e^(i theta) = e^(i phi) (W + i (e + b sin phi)),
    W^2 = a^2 - (e + b sin phi)^2,    t = b cos phi + W,    d phi / d theta = W / t.

Of W and -W those are answers that leave the pin on the lever's half of its slot.
"""

from __future__ import annotations

from functools import reduce
import math
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import ArrayLike

from .arguments import numbers
from .builder import Builder, GROUND, Link
from .inputs import Arc
from .inverse import in_order
from .planar import Crank, GRAZE
from .quantities import Structure
from .several import Several
from ..cache import cached
from ..formula.expression import (
    arctangent,
    argument,
    Complex,
    cosine,
    exact_sum,
    gated,
    nearest_integer,
    Real,
    real,
    root,
    sine,
    square,
    where,
)
from ..formula.program import Pose, Program

# Angles nearer than this [rad] may be one, if the output does not tell them apart.
CLOSE = 1e-7
# How much rounding takes an angle beyond the ends that it is to be between, as a part of them.
ULPS = 4 * 2.0 ** -52
# Rounding of an angle on its way through a closed form [rad].
ROUNDED = 8 * 2.0 ** -52 * math.pi
# More than any angle.
LARGE = 1e300

Ends = Optional[Tuple[float, float]]


class Answer(NamedTuple):
    """A value of the input that an output allows if it is `held`, and d output / d input there."""

    theta: Real
    rate: Real
    held: Real


class Mechanism(Several):
    """
    A linkage whose dimensions are set; make one with `linkage_ros.mechanisms.create`.

    A pose depends on the inputs alone: any value, in any order, gives the same numbers. Joint
    angles in arrays may differ by two ulps from those asked for one by one.

    Attributes
    ----------
    type : str
        The name of its type.
    dimensions : dict
        Its dimensions [m] by name.
    branches : dict
        The assembly sign, +1 or -1, of each joint that has two.
    inputs : tuple of Input
        What drives it: cranks by their angles [rad], cylinders by their lengths [m].
    points : tuple of str
        The linkage's joints, in the order in which they are placed.
    joints : tuple of str
        Its moving links, whose joint angles there are.
    links : tuple of Link
        What each joint angle is: name, parent, joint, kind, zero [rad] and tip.
    bars : tuple of (str, str)
        The joints at the ends of each bar.
    cylinders : tuple of (str, str)
        The joints at the ends of each cylinder, its base first.
    tracer : str
        The joint whose curve is the locus.

    """

    def input_for(self, output: str, value: ArrayLike, near: Optional[ArrayLike] = None,
                  others: Sequence[float] = ()) -> Any:
        swept = any(np.ndim(length) for length in self.dimensions.values())
        if swept or others or not self._has_lever(output):
            return super().input_for(output, value, near, others)
        if near is not None:
            return self.servo_for(output, numbers('value', value), near)[0][()]
        theta, _ = self.servos(output, numbers('value', value))
        answers = in_order(theta.reshape(-1, 2).T, self.inputs[0])
        return answers.reshape(*theta.shape[:-1], answers.shape[-1])

    def servos(self, output: str, value: ArrayLike) -> Tuple[np.ndarray, np.ndarray]:
        """
        Return all values of the input that give an output a value, and d output / d input there.

        Parameters
        ----------
        output : str
            What `input_for` takes, of a linkage with one input.
        value : float or array-like
            What the output is to be.

        Returns
        -------
        (array, array)
            Crank angles in [-pi, pi] or lengths [m], and rates, on a last axis that is filled up
            with NaN; a lever's answer on the working branch comes first, else they ascend.

        Raises
        ------
        ValueError
            As `input_for` does.

        """
        if not self._has_lever(output):
            value = np.where(np.isfinite(np.asarray(value)), value, np.nan)
            theta = np.asarray(self.input_for(output, value))
            return theta, self._rates_at(output, theta)
        found = np.moveaxis(self._solved_by(_lever_all, output).over(value), 0, -1)
        theta, rates = found[..., ::2], found[..., 1::2]
        theta = theta if self._is_free else _inside(theta, self.reach())
        return theta, np.where(np.isnan(theta), np.nan, rates)

    def servo_for(self, output: str, value: ArrayLike, near: Optional[ArrayLike] = None,
                  ends: Ends = None) -> Sequence:
        """
        Return one value of the input that gives an output a value, and d output / d input there.

        Parameters
        ----------
        output, value
            As for `servos`.
        near : float or array-like, optional
            The answer nearest to this is taken, a crank's with whole turns included. Default: of
            a lever the one on the working branch, on which lever and crank turn the same way; of
            any other output the least.
        ends : (float, float), optional
            The lowest and the highest value [rad or m] that may be taken. Default: any; of a
            crank without near, those of one turn from -pi.

        Returns
        -------
        (float or array, float or array)
            In the shape of value and near broadcast; NaN where there is none.

        """
        limits: Tuple[Any, ...] = (() if near is None else (near,)) + (ends or ())
        return self.servo_solver(output, near is not None, ends is not None)(value, *limits)

    def servo_solver(self, output: str, follows: bool, ended: bool) -> Callable:
        """Return `servo_for` of an output: a function of value and, if so, near and the ends."""
        lever = self._has_lever(output)
        if lever and self._is_free:
            return self._solved_by(_lever_taken, output, follows, ended)
        first = self.inputs[0]
        size, rounding = first.size, GRAZE * (
            math.pi if self._structure.turns(output) else self.longest)

        def solve(value: ArrayLike, *limits: Any) -> Sequence:
            theta, rates = self.servos(output, value)
            choice = _choice(theta.shape[-1], lever, first.turns, follows, ended)
            taken, rate = choice.over(*np.moveaxis(theta / size, -1, 0),
                                      *np.moveaxis(rates * size, -1, 0), rounding,
                                      *(np.divide(limit, size) for limit in limits))
            return taken * size, rate / size
        return solve

    def _has_lever(self, output: str) -> bool:
        return (len(self.inputs) == 1 and isinstance(output, str)
                and output in _levers(self._structure))

    @property
    def _is_free(self) -> bool:
        """Whether nothing but its lever's slot limits the crank."""
        return len(self._structure.built.limits) == 1

    def _solved_by(self, draw: Callable, *args: Any) -> Pose:
        """Return the code that solves for a lever in some way."""
        return self.cache.get_or_make((draw, *args), lambda: draw(
            self._structure, *args).bind(self._lengths, self._evaluated, self._accelerate))

    def _rates_at(self, output: str, theta: np.ndarray) -> np.ndarray:
        """Return d output / d input."""
        return self.joint_rates(theta, (output,))[output]


@cached(32)
def _levers(structure: Structure) -> Dict[str, List[Answer]]:
    """Return for each lever that an input crank's pin moves both answers to its angle."""
    built = structure.built
    links = {link.name: link for link in built.links}
    return {slide.parent: list(_lever(built, crank, slide,
                                      structure.branches[links[slide.parent].tip]))
            for slide in built.links if slide.kind == 'prismatic' and slide.parent != GROUND
            and links[slide.parent].parent == GROUND
            and (crank := built.points[slide.tip].crank) and crank.angle in built.arguments}


def _lever(built: Builder, crank: Crank, slide: Link, half: int) -> Iterator[Answer]:
    """Yield both crank angles for a lever's angle, that on the working branch first."""
    e = built.frames[slide.name][slide.tip].y
    line = crank.centre - built.points[slide.joint].place
    a, b, along = crank.length, line.length(), line.direction()
    lever = argument(0)
    bar = Complex(cosine(lever), sine(lever)) * (Complex(0.0, 1.0) * along.conjugate())
    cos, sin = bar.x, bar.y
    # Next to a limit at +-90 degrees the gap is small: it is formed from what is small.
    upper = where(0.7 < sin, exact_sum(a, -e, -b) + b * square(cos) / (1.0 + sin),
                  exact_sum(a, -e) - b * sin)
    lower = where(sin < -0.7, exact_sum(a, e, -b) + b * square(cos) / (1.0 - sin),
                  exact_sum(a, e) + b * sin)
    grazed = GRAZE * (a + b + abs(e))
    height = root(upper, grazed) * root(lower, grazed)
    # With the pin on the pivot the lever points anywhere.
    least = where(abs(e) <= grazed, grazed, -grazed)
    for share in (half * height, -half * height):
        pin = bar * Complex(share, e + b * sin) * (along * crank.zero.conjugate())
        slide_ = half * (b * cos + share)
        yield Answer(arctangent(pin.y, pin.x), half * share / where(0.0 < slide_, slide_, 0.0),
                     least <= slide_)


@cached(32)
def _lever_all(structure: Structure, name: str) -> Program:
    """Return the code for both crank angles for a lever's angle, each with its rate."""
    return Program([gated(part, where(answer.held, 1.0, -1.0), 0.0)
                    for answer in _levers(structure)[name] for part in answer[:2]])


@cached(64)
def _lever_taken(structure: Structure, name: str, follows: bool, ended: bool) -> Program:
    """Return the code for the crank angle that is taken for a lever's angle, and its rate."""
    if not (follows or ended):
        # Chosen before its angle is worked out, which takes longest.
        first, other = _levers(structure)[name]
        theta = arctangent(*(where(first.held, *sides) for sides in zip(
            first.theta.operands, other.theta.operands)))
        found = where(first.held, 1.0, where(other.held, 1.0, -1.0))
        return Program([gated(theta, found, 0.0),
                        gated(where(first.held, first.rate, other.rate), found, 0.0)])
    return _taken(_levers(structure)[name], True, True, real(GRAZE * math.pi), follows, ended, 1)


@cached(256)
def _choice(count: int, working: bool, turns: bool, follows: bool, ended: bool) -> Pose:
    """Return the code that takes one of some answers: from these, their rates, rounding."""
    theta, rates = ([argument(start + i) for i in range(count)] for start in (0, count))
    answers = [Answer(value, rate, value <= value) for value, rate in zip(theta, rates)]
    return _taken(answers, working, turns, argument(2 * count), follows, ended,
                  2 * count + 1).bind({}, {})


def _taken(answers: Sequence[Answer], working: bool, turns: bool, rounding: Real, follows: bool,
           ended: bool, given: int) -> Program:
    """
    Return the code for the answer that is taken, and its rate.

    With `follows` it is the nearest to a value, with `ended` between two: these are given from
    number `given` on. What is beyond an end by so little that the output, known up to `rounding`,
    does not tell is at the end. If the input `turns`, whole turns are all one.
    """
    near, *ends = (argument(given + i) for i in (0, follows, follows + 1))
    beside = _turned if turns else lambda theta, near: theta
    choices = []
    for rank, (theta, rate, held) in enumerate(answers):
        place, misses = beside(theta, near) if follows else theta, []
        if ended:
            speed = abs(rate)
            slack = ULPS * (4.0 + abs(ends[0]) + abs(ends[1])) + where(
                rounding < CLOSE * speed, rounding / speed, CLOSE)
            low, high = ends[0] - slack, ends[1] + slack
            first, last = (beside(theta, end) for end in ends)
            if turns:
                first = where(first < low, first + math.tau, first)
                last = where(high < last, last - math.tau, last)
            place = where(place < low, first, where(high < place, last, place)) \
                if follows else first
            misses = [place < low, high < place]
            place = where(place < ends[0], ends[0], where(ends[1] < place, ends[1], place))
        away = abs(place - near) if follows else real(rank) if working else place
        away = reduce(lambda away, miss: where(miss, math.inf, away), misses, away)
        choices.append([where(held, away, math.inf), place, rate])
    away, *taken = reduce(lambda best, other: [
        where(other[0] < best[0], mine, its) for mine, its in zip(other, best)], choices)
    return Program([gated(part, LARGE - away, 0.0) for part in taken],
                   given + follows + 2 * ended)


def _turned(theta: Real, near: Real) -> Real:
    """Return an angle plus the whole turns that take it next to another."""
    return theta + math.tau * nearest_integer((near - theta) / math.tau)


def _inside(theta: np.ndarray, arcs: Sequence[Arc]) -> np.ndarray:
    """Return angles [rad] that lie on arcs, those beyond an end by rounding at it; NaN others."""
    kept = np.full(theta.shape, np.nan)
    for low, high in arcs:
        turns = math.tau * np.round((0.5 * (low + high) - theta) / math.tau)
        beyond = np.maximum(low - (theta + turns), (theta + turns) - high)
        at_end = np.clip(theta + turns, low, high) - turns
        kept = np.where(beyond <= 0.0, theta, np.where(beyond <= ROUNDED, at_end, kept))
    return kept
