# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Bodies, hinges and slides that are decomposed into dyads are the linkage of the joint lines."""

import math

from linkage_ros import mechanisms
from linkage_ros.linkage.dyads import Dyads, Hinge, Slide
import pytest


class Driven(Dyads):
    """Dyads whose inputs need no names."""

    def drive(self, word, joint, ratio, offset):
        return '', ''


PIN = 0.3 + 0.4j
CRANK = Hinge(('ground', 'crank'), (0.0j, 0.0j), 1.0, 0.0)


def slot(axis, bodies):
    """Return a lever on a pivot, and a block on it that a crank carries, in the pose drawn."""
    pivot, on_line = 2.0 + 0.0j, PIN + 0.2
    return Driven('ground', ['ground', 'crank', 'lever', 'block'],
                  [{'crank': PIN, 'block': PIN}, {'ground': pivot, 'lever': pivot}],
                  [Slide(bodies, (on_line, on_line), (axis, axis))], [CRANK], 1.0, 1e-9)


def yoke(axis, bodies):
    """Return a block on the ground, with a slot across it in which a crank's pin slides."""
    on_slot = PIN + 0.2
    return Driven('ground', ['ground', 'crank', 'lever', 'block'],
                  [{'ground': 1.0 + 0.0j}, {'crank': PIN, 'block': PIN}],
                  [Slide(('ground', 'lever'), (0.0j, 0.0j), (axis, axis)),
                   Slide(bodies, (on_slot, on_slot), (1.0j, 1.0j))],
                  [CRANK], 1.0, 1e-9)


def carriage(axis, bodies):
    """Return a block that a motor moves along the ground."""
    ends = tuple('ground' if body == 'lever' else body for body in bodies)
    return Driven('ground', ['ground', 'block'], [{'ground': 1.0 + 0.0j}, {'block': 0.25 + 0.0j}],
                  [], [Slide(ends, (0.0j, 0.0j), (axis, axis))], 1.0, 1e-9)


@pytest.mark.parametrize('drawn, value', [
    (slot, math.atan2(0.4, 0.3)), (yoke, math.atan2(0.4, 0.3)), (carriage, 0.0)])
@pytest.mark.parametrize('bodies', [('lever', 'block'), ('block', 'lever')])
def test_a_slide_is_the_same_in_whichever_direction_it_is_given(drawn, value, bodies):
    forward, backward = drawn(1.0 + 0.0j, bodies), drawn(-1.0 + 0.0j, bodies)
    for dyads in (forward, backward):
        dyads.decompose()
        assert not dyads.left
    assert forward.lines == backward.lines and forward.parts == backward.parts
    linkage = mechanisms.create('custom', joints=forward.lines)
    for places in forward.on.values():
        for name, place in places.items():
            x, y = linkage.solve(value, (name,))[name]
            assert complex(x, y) == pytest.approx(place, abs=1e-14)
