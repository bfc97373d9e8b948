# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The four-bar: crank OA = a, coupler AB = b, rocker QB = c, ground OQ = d along x.

P is a point on the coupler's line, p from A towards B. Branch B is the open (+1, left of A -> Q)
or the crossed assembly. The defaults are Norton's example, with P in the middle of the coupler;
with a coupler of your own give p as well: it does not follow b.

Source: Norton, "Design of Machinery", sec. 2.13 (Grashof's condition) and 4.5 (position).
"""

from math import fsum

from .. import linkage
from ..linkage import Design

DESIGN = Design('four_bar', {'a': 40.0, 'b': 120.0, 'c': 80.0, 'd': 100.0, 'p': 60.0},
                tracer='P', signed=frozenset('p'), joints=(
    'O ground 0 0',
    'Q ground d 0',
    'A crank O a',
    'B dyad A Q b c left',
    'P line A B p'))


def grashof(crank: float, coupler: float, rocker: float, ground: float) -> str:
    """
    Return Grashof's class of a four-bar from its lengths [m].

    With the shortest and longest bar s and l and the others p and q: s + l > p + q is a
    'triple-rocker', in which no bar turns all round; s + l = p + q is a 'change point' linkage;
    below that the shortest bar decides: the crank 'crank-rocker', the ground 'double-crank', the
    coupler 'double-rocker', the rocker 'rocker-crank'. Sums that differ by less than the rounding
    of the lengths count as equal.
    """
    lengths = crank, coupler, rocker, ground
    shortest, *middle, longest = sorted(lengths)
    excess = fsum([shortest, longest, *(-length for length in middle)])
    if abs(excess) <= 2.0 ** -52 * longest:
        return 'change point'
    if excess > 0.0:
        return 'triple-rocker'
    names = 'crank-rocker', 'double-rocker', 'rocker-crank', 'double-crank'
    return names[lengths.index(shortest)]


class Mechanism(linkage.Mechanism):
    """A four-bar: also classified."""

    def grashof(self) -> str:
        """Return Grashof's class; see the function of this name."""
        return grashof(*(self.dimensions[name] for name in 'abcd'))
