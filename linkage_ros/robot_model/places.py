# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Places of bodies: poses and displacements as matrices (4, 4)."""

from __future__ import annotations

import math
from typing import Any, Tuple

import numpy as np


def at(place: Any, turned: Any = ((1, 0, 0), (0, 1, 0), (0, 0, 1))) -> np.ndarray:
    """Return a pose by its place and its rotation matrix."""
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = turned, place
    return made


def pose(x: float, y: float, z: float, roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Return a pose as a matrix (4, 4), by its place [m] and its angles about fixed axes [rad]."""
    (cr, cp, cy), (sr, sp, sy) = map(math.cos, (roll, pitch, yaw)), map(math.sin, (
        roll, pitch, yaw))
    return np.array([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, x],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, y],
        [-sp, cp * sr, cp * cr, z], [0.0, 0.0, 0.0, 1.0]])


def coordinates(matrix: np.ndarray) -> Tuple[float, ...]:
    """Return x, y, z [m], roll, pitch and yaw [rad] of a pose (4, 4)."""
    (a, d, g, x), (b, e, h, y), (c, _, _, z), _ = matrix.tolist()
    yaw = math.atan2(b, a) if math.hypot(a, b) > 1e-9 else 0.0
    sin, cos = math.sin(yaw), math.cos(yaw)
    return (x, y, z, math.atan2(sin * g - cos * h, cos * e - sin * d),
            math.atan2(-c, cos * a + sin * b), yaw)


def screws(axes: np.ndarray, places: np.ndarray, slides: Any = False) -> np.ndarray:
    """Return the velocities (..., 4, 4) of unit motions about axes at places, or along them."""
    made = np.zeros((*axes.shape[:-1], 4, 4))
    slides = np.asarray(slides)[..., None]
    made[..., :3, :3] = np.where(slides[..., None], 0.0, np.cross(np.eye(3), axes[..., None, :]))
    made[..., :3, 3] = np.where(slides, axes, np.cross(places, axes))
    return made


def displacements(screw: np.ndarray, by: np.ndarray, slides: Any = False) -> np.ndarray:
    """Return displacements by positions [rad or m] of screws: their exponentials."""
    sine, less = np.where(slides, by, np.sin(by)), 1.0 - np.cos(by)
    return np.eye(4) + sine[..., None, None] * screw + less[..., None, None] * (screw @ screw)
