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
    (cr, cp, cy), (sr, sp, sy) = np.cos((roll, pitch, yaw)), np.sin((roll, pitch, yaw))
    about_z, about_y, about_x = np.array([
        [[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]], [[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]],
        [[1, 0, 0], [0, cr, -sr], [0, sr, cr]]])
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = about_z @ about_y @ about_x, (x, y, z)
    return made


def coordinates(matrix: np.ndarray) -> Tuple[float, ...]:
    """Return x, y, z [m], roll, pitch and yaw [rad] of a pose (4, 4)."""
    a, b = matrix[:2, 0]
    yaw = math.atan2(b, a) if math.hypot(a, b) > 1e-9 else 0.0
    left = pose(0.0, 0.0, 0.0, 0.0, 0.0, -yaw) @ matrix
    return (*matrix[:3, 3].tolist(), math.atan2(-left[1, 2], left[1, 1]),
            math.atan2(-left[2, 0], left[0, 0]), yaw)


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
