# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The reach: the values of its first input with which a linkage can be assembled.

The reach ends where a margin vanishes. For the dyad or slot of a crank the ends are closed forms
of exactly rounded gaps; other ends are bracketed. Between two neighbouring ends one pose decides
for the whole arc. At each end the linkage can still be assembled.
"""

from __future__ import annotations

import math
from typing import Any, Callable, Iterable, Sequence

import numpy as np

from .curves import ascending, extremes, HALVINGS, lowest, near_misses, refined, sampled
from ..geometry.planar import Limit
from ..inputs import Arc, CRANK, Input
from ..kinematics import Kinematics

# Fraction at which an arc is tested: in the exact middle, an arm of a symmetric linkage may have
# no length.
INSIDE = 0.49
# More ends a turn than these are rounding, of the direction of an arm without length.
MAX_ENDS = 100


def reach_of(linkage: Kinematics, others: tuple[float, ...] = ()) -> list[Arc]:
    """Implement `Mechanism.reach`."""
    return linkage.cache.get_or_make(('reach', *others), lambda: _reach(linkage, others))


def extremes_of(linkage: Kinematics, output: str, arcs: Sequence[Arc] | None,
                others: tuple[float, ...]) -> list:
    """Implement `Mechanism.extremes`."""
    linkage.check_output(output)
    pose, is_angle = linkage.compiled('output', output), linkage.is_angle(output)
    return [tuple(extremes(lambda value: pose.searched(value, *others)[0], low, high, is_angle))
            for low, high in (reach_of(linkage, others) if arcs is None else arcs)]


def over_first(linkage: Kinematics, kind: str, names: Any, others: tuple[float, ...]) -> Callable:
    """Return the function from values of the first input (n,), in its step, to numbers."""
    pose, step = linkage.compiled(kind, names), linkage.inputs[0].step
    return lambda value: pose.searched(value * step, *others)


def _reach(linkage: Kinematics, others: tuple[float, ...]) -> list[Arc]:
    margins = over_first(linkage, 'margins', (), others)
    limits, step = linkage.formulas.built.limits, linkage.inputs[0].step
    # From here on the input is in units of its step.
    input_ = linkage.inputs[0].normalized()

    def assembled(theta: Any) -> Any:
        return _failing(margins, theta) == len(limits)

    # The angle of a geared crank, or of another input, is no leaf of this one.
    closed = [limit for limit in limits if limit.ends and limit.ends.theta.args[0] == 0]
    # Without a whole period, the turns on both sides of zero.
    first, last = (0.0, input_.turn) if input_.wraps else (input_.low - math.tau / step,
                                                           input_.high + math.tau / step)
    turns = range(round(first * step / math.tau), round(last * step / math.tau))
    ends = [(end + math.tau * turn) / step for limit in closed
            for end in _crank_ends(limit, linkage.value) for turn in turns]
    if any(x.margin.varies and x not in closed for x in limits):
        # Beyond an end in closed form the limit holds for its tolerance, which moves no end.
        rows = [i for i, limit in enumerate(limits) if limit in closed]
        ends += [end for lo, hi in input_.between(ends)
                 if (margins(np.array([lo + INSIDE * (hi - lo)]))[rows] >= 0.0).all()
                 for end in _limits(margins, lo, hi)]
    arcs = reachable_arcs(ends, assembled, input_)
    if not input_.is_whole(arcs):
        arcs = _trimmed(assembled, arcs)
    return [(lo * step, hi * step) for lo, hi in arcs if lo < hi]


def _failing(margins: Callable, theta: Any) -> Any:
    """Return the index of the first violated limit, the number of limits if none is violated."""
    return _first_below(margins(np.ravel(theta))).reshape(np.shape(theta))


def _first_below(values: np.ndarray) -> np.ndarray:
    """Return the first row with a negative margin in each column, the number of rows if none."""
    with np.errstate(invalid='ignore'):
        satisfied = values >= 0.0
    return np.vstack([satisfied, np.zeros(satisfied.shape[1:], bool)]).argmin(axis=0)


def _limits(margins: Callable, lo: float, hi: float) -> list[float]:
    """
    Return the values on an arc next to which the first violated limit changes.

    A joint that depends on a limited one may itself be limited on part of a narrow arc: each arc
    that is found is searched again.
    """
    ends = [lo, hi]
    while True:
        theta = ascending(np.concatenate([
            sampled(*arc) for arc in zip(ends, ends[1:])]))
        values = margins(theta)
        touches = _touches(margins, theta, values)
        if len(touches):
            theta = ascending(np.concatenate([theta, touches]))
            values = margins(theta)
        first = _first_below(values)
        place = np.flatnonzero(first[1:] != first[:-1])
        before, after = refined(
            lambda x, as_before=first[place][:, None]: _failing(margins, x) == as_before,
            theta[place], theta[place + 1])
        known, ends = len(ends), sorted({lo, hi, *before.tolist(), *after.tolist()})
        if len(ends) == known or len(ends) > MAX_ENDS * max(1.0, (hi - lo) / math.tau):
            return ends[1:-1]


def _touches(margins: Callable, theta: np.ndarray, values: np.ndarray) -> np.ndarray:
    """
    Return the values at which margins come nearest to zero between samples, and values around.

    These get denser towards the nearest one: an arm that nearly vanishes there turns fast, and so
    do the bodies that it carries.
    """
    signs = near_misses(values)
    row, place = np.nonzero(signs)
    sign = signs[row, place, None]
    chosen = np.arange(len(row))

    def distance(angles: np.ndarray) -> np.ndarray:
        rows = margins(angles.ravel()).reshape(-1, *angles.shape)
        return sign * rows[row, chosen]

    lo, hi = theta[place], theta[place + 2]
    nearest = lowest(distance, lo, hi)[:, None]
    steps = np.outer(hi - lo, 0.5 ** np.arange(1, HALVINGS))
    return np.clip(
        np.hstack([nearest, nearest - steps, nearest + steps]).ravel(), theta[0], theta[-1])


def _trimmed(assembled: Callable, arcs: Sequence[Arc]) -> list[Arc]:
    """Return arcs shortened to ends at which the linkage can be assembled."""
    ends = np.reshape(arcs, (-1, 2))
    inside = np.broadcast_to(ends @ [[1.0 - INSIDE], [INSIDE]], ends.shape)
    beyond = ~assembled(ends)
    ends[beyond] = refined(assembled, inside[beyond], ends[beyond])[0]
    return [(low, high) for low, high in ends.tolist()]


def reachable_arcs(ends: Iterable[float], reachable: Callable[[float], bool],
                   input_: Input = CRANK) -> list[Arc]:
    """
    Return the reachable arcs between values at which reachability may change.

    Arcs that touch are merged, across -pi and pi, too.
    """
    parts = input_.between(ends)
    reached = [arc for arc in parts if bool(reachable(arc[0] + INSIDE * (arc[1] - arc[0])))]
    if reached == parts:
        return [(input_.low, input_.high)]
    merged: list[Arc] = []
    for lo, hi in reached:
        if merged and lo == merged[-1][1]:
            merged[-1] = merged[-1][0], hi
        else:
            merged.append((lo, hi))
    if input_.wraps and len(merged) > 1 and merged[0][0] + input_.turn == merged[-1][1]:
        merged[-1] = merged[-1][0], merged.pop(0)[1] + input_.turn
    return merged


def _crank_ends(limit: Limit, value: Callable) -> list[float]:
    """Return the crank angles at which the margin of a crank arm vanishes."""
    assert limit.ends
    start, end, turn = map(value, limit.ends[:3])
    tolerance = value(limit.tolerance)
    # A margin within rounding is a limit that is only touched; it may be the whole reach.
    start, end = (0.0 if abs(margin) <= tolerance else margin for margin in (start, end))
    if start * end > 0.0:
        return []
    half = math.atan2(math.sqrt(abs(start)), math.sqrt(abs(end)))
    return [float(2.0 * half - turn), float(-2.0 * half - turn)]
