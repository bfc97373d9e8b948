# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The pose that brings a joint nearest to a place, for dragging by a pointer."""

from __future__ import annotations

from typing import Any, Sequence

import numpy as np

from ..linkage import Mechanism, theta_of

DRAG_SAMPLES = 721
# Penalty for moving the input through its whole arc, as a fraction of the path's width: where a
# path crosses itself, the joint stays on its branch.
LEASH = 0.1
GAUSS_NEWTON_STEPS, STEP_HALVINGS = 60, 12


def nearest_inputs(linkage: Mechanism, joint: str, place: Sequence[float],
                   present: Sequence[float], arcs: Sequence[Sequence[Sequence[float]]]
                   ) -> np.ndarray:
    """
    Return the inputs (inputs,) [rad or m] that bring a joint nearest to a place (x, y) [m].

    Of equally good poses, the result is near the inputs `present`. Each input is on one of
    its `arcs`, a sequence of (low, high). Raises ValueError if the joint does not exist, or the
    linkage cannot be assembled on these arcs.
    """
    goal, sizes = np.asarray(place, float), np.array([input_.size for input_ in linkage.inputs])
    if len(sizes) > 1:
        low, high = np.array([input_arcs[0] for input_arcs in arcs]).T
        value = np.clip(present, low, high)
    else:
        value, low, high = _nearest_sample(linkage, joint, goal, present[0], arcs[0])

    def error_at(inputs: np.ndarray) -> Any:
        return goal - linkage.solve(theta_of(inputs), (joint,))[joint]

    error = error_at(value)
    for _ in range(GAUSS_NEWTON_STEPS):
        rates = np.stack([linkage.velocity(theta_of(value), (joint,), by)[joint]
                          for by in range(len(value))], axis=1) * sizes
        if not np.isfinite(rates).all():
            break
        # An input at its end stays there if the error pulls it beyond.
        descent = error @ rates
        free = ~((value <= low) & (descent < 0.0) | (value >= high) & (descent > 0.0))
        step = sizes * np.linalg.lstsq(rates * free, error, rcond=None)[0]
        for part in 0.5 ** np.arange(STEP_HALVINGS):
            tried = np.clip(value + part * step, low, high)
            if np.hypot(*error_at(tried)) < np.hypot(*error):
                break
        else:
            break
        value, error = tried, error_at(tried)
    return value


def _nearest_sample(linkage: Mechanism, joint: str, goal: np.ndarray, present: float,
                    arcs: Sequence[Sequence[float]]) -> Sequence[np.ndarray]:
    """Return the best of many samples of the only input, and the ends of its arc."""
    samples = np.array([np.linspace(low, high, DRAG_SAMPLES) for low, high in arcs])
    path = linkage.solve(samples, (joint,))[joint]
    if not np.isfinite(path).any():
        raise ValueError('the linkage cannot be assembled here')
    width = np.nanmax(np.nanmax(path, axis=(0, 1)) - np.nanmin(path, axis=(0, 1)))
    moved = linkage.inputs[0].distance(samples, present) / np.ptp(samples)
    distances = np.hypot(*np.moveaxis(path - goal, -1, 0)) + LEASH * width * moved
    row, column = divmod(int(np.nanargmin(distances)), DRAG_SAMPLES)
    return [np.array([value]) for value in (samples[row, column], *arcs[row])]
