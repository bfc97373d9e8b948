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

"""All legs of a mechanism at one crank angle, solved again and again."""

from struct import Struct
from typing import NamedTuple, Sequence

import numpy as np

from .compiler import Batch


class Layout(NamedTuple):
    """
    How the numbers of a solution follow each other: a row for each leg, then the drive.

    A row holds so many coordinates, joint angles and joint velocities; the drive is the angle of
    each crank and, where there are velocities, the speed of each.
    """

    legs: int
    cranks: int
    coordinates: int
    joints: int
    velocities: int

    @property
    def posed(self) -> int:
        """How many numbers of a row are not velocities."""
        return self.coordinates + self.joints

    @property
    def size(self) -> int:
        """How many numbers there are."""
        return self._rows_end() + self.cranks * (2 if self.velocities else 1)

    def rows(self, values: np.ndarray) -> np.ndarray:
        """Return the rows, one for each leg."""
        return values[:self._rows_end()].reshape(self.legs, self.posed + self.velocities)

    def drive(self, values: np.ndarray) -> np.ndarray:
        """Return the cranks' angles and, where there are velocities, their speeds."""
        return values[self._rows_end():]

    def _rows_end(self):
        return self.legs * (self.posed + self.velocities)


class Solution:
    """
    The numbers of one layout, in an array that stays where it is.

    Parameters
    ----------
    layout : Layout
        What is where.
    values : float array
        Where they go.
    batch : Batch
        Solves the legs into the rows of the values; see `Mechanism.legs`.

    """

    def __init__(self, layout: Layout, values: np.ndarray, batch: Batch):
        self.layout, self.values, self.rows = layout, values, batch.rows
        self._batch = batch
        self._thetas = list(batch.given[:layout.cranks])
        self._speeds = list(batch.given[layout.cranks:2 * layout.cranks])
        self._drive = layout.drive(values)
        self._pack = Struct(f'{self._drive.size}d').pack_into

    def finish(self):
        """Wait for what makes the first solution slower than the others."""
        self._batch.finish()

    def solve(self, thetas: Sequence[float], speeds: Sequence[float] = ()):
        """Solve at crank angles [rad] and, if there are velocities, crank speeds [rad/s]."""
        if not self.layout.velocities:
            speeds = ()
        for row, theta in zip(self._thetas, thetas):
            row.fill(theta)
        for row, speed in zip(self._speeds, speeds):
            row.fill(speed)
        # Packing costs less than assigning to a part of an array.
        self._pack(self._drive, 0, *thetas, *speeds)
        self._batch.solve()
