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


def slotted(axis, bodies):
    """Return a lever on a pivot, and a block on it that a crank carries, in the pose drawn."""
    pivot, pin = 2.0 + 0.0j, 0.3 + 0.4j
    on_line = pin + 0.2
    dyads = Driven(
        'ground', ['ground', 'crank', 'lever', 'block'],
        [{'crank': pin, 'block': pin}, {'ground': pivot, 'lever': pivot}],
        [Slide(bodies, (on_line, on_line), (axis, axis))],
        [Hinge(('ground', 'crank'), (0.0j, 0.0j), 1.0, 0.0)], size=1.0, near=1e-9)
    dyads.take_apart()
    return dyads


@pytest.mark.parametrize('bodies', [('lever', 'block'), ('block', 'lever')])
def test_a_slot_is_the_same_in_whichever_direction_its_slide_is_given(bodies):
    forward, backward = slotted(1.0 + 0.0j, bodies), slotted(-1.0 + 0.0j, bodies)
    assert forward.lines == backward.lines and forward.parts == backward.parts
    linkage = mechanisms.create('custom', joints=forward.lines)
    for places in forward.on.values():
        for name, place in places.items():
            x, y = linkage.solve(math.atan2(0.4, 0.3), (name,))[name]
            assert complex(x, y) == pytest.approx(place, abs=1e-14)
