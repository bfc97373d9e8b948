# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""
The four linkages as the peers see them: bars, rigid triangles and a slot, in an order to build.

Peers are given the same data, and each makes of it what its own way of thinking wants: circles,
constraints, bodies or equations.
"""

import math
from typing import Dict, NamedTuple, Tuple, Union

LEFT, RIGHT = 1, -1
# The kite of the water drop folds through its ground line twice a turn.
FLIPS = 0


class Dyad(NamedTuple):
    """A joint held by two bars, on a side of the line between the joints that carry them."""

    name: str
    first: str
    second: str
    first_bar: float
    second_bar: float
    side: int


class Rigid(NamedTuple):
    """A point that is fixed to the bar from `base` to `end`: base + (end - base) * factor."""

    name: str
    base: str
    end: str
    factor: complex


class Ray(NamedTuple):
    """The tip of a lever that turns about `pivot` and points at `pin`, which slides along it."""

    name: str
    pivot: str
    pin: str
    length: float


class Assembly(NamedTuple):
    """A linkage: joints on the ground, a crank about O that carries A, and what hangs on them."""

    ground: Dict[str, complex]
    crank: float
    upright: bool           # the crank angle is measured from +y, not from +x
    steps: Tuple[Union[Dyad, Rigid, Ray], ...]

    @property
    def points(self):
        """Return the joints that move, in the order in which they can be found."""
        return ('A', *(step.name for step in self.steps))

    def pin(self, cosine, sine):
        """Return x and y of the crank pin."""
        across, up = self.crank * cosine, self.crank * sine
        return (-up, across) if self.upright else (across, up)

    def side(self, dyad, sine):
        """Return the side that a dyad is on; `sine` is that of the crank angle."""
        return dyad.side or (LEFT if sine >= 0 else RIGHT)


def assembly(kind, dimensions):
    """Return the Assembly of a linkage of the catalogue."""
    return _BUILDERS[kind](**dimensions)


def _corner(base, other, opposite):
    """Return the factor of a triangle's third corner, left of the bar, from its three sides."""
    along = (base * base + other * other - opposite * opposite) / (2 * base * base)
    return complex(along, math.sqrt((other / base) ** 2 - along ** 2))


def _water_drop(a):
    return Assembly(
        {'O': 0j, 'C': -2j * a}, a, True,
        (Dyad('B', 'C', 'A', 2 * a, a, FLIPS), Rigid('P', 'A', 'B', -3 + 0j)))


def _jansen(a, b, c, d, e, f, g, h, i, j, k, l, m):  # noqa: E741
    return Assembly(
        {'O': 0j, 'B': complex(-a, -l)}, m, False,
        (Dyad('C', 'B', 'A', b, j, LEFT), Rigid('D', 'B', 'C', _corner(b, d, e)),
         Dyad('E', 'B', 'A', c, k, RIGHT), Dyad('F', 'E', 'D', g, f, LEFT),
         Rigid('G', 'E', 'F', _corner(g, i, h))))


def _peaucellier(r, a, b):
    return Assembly(
        {'O': 0j, 'P': complex(-r)}, r, False,
        (Dyad('B', 'P', 'A', a, b, RIGHT), Dyad('D', 'P', 'A', a, b, LEFT),
         Dyad('C', 'B', 'D', b, b, RIGHT)))


def _slotted_lever(a, b, e):
    if e:
        raise ValueError('the peers are asked for the slot through the pivot, e = 0')
    return Assembly({'O': 0j, 'Q': -1j * b}, a, True,
                    (Ray('L', 'Q', 'A', max(9 * b / 5, a + b)),))


_BUILDERS = {
    'water_drop': _water_drop,
    'jansen': _jansen,
    'peaucellier': _peaucellier,
    'slotted_lever': _slotted_lever,
}
