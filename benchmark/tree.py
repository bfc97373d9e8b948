# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The four linkages as trees of bodies with loops to close, for packages that think in bodies."""

import cmath
from typing import Dict, List, NamedTuple, Tuple

from .assembly import assembly, Dyad, Ray, Rigid


class Body(NamedTuple):
    """A body on a joint at `place` of its parent; its x axis runs from `origin` to `along`."""

    name: str
    parent: str
    place: complex
    origin: str
    along: str
    slides: bool = False


class Tree(NamedTuple):
    """
    Bodies, parents before children, marks on them, and the pairs of marks that have to meet.

    A mark is (body, place in the body's frame). A crank comes first; its angle and all others
    are relative to the parent's x axis, that of the ground is x.
    """

    bodies: List[Body]
    marks: Dict[str, Tuple[str, complex]]
    loops: List[Tuple[Tuple[str, complex], Tuple[str, complex]]]
    ground: Dict[str, complex]

    def coordinates(self, pose):
        """Return the joint angle or slide of every body in a pose {point: complex}."""
        pose = {**self.ground, **pose}
        turned, found = {'ground': 1 + 0j}, []
        for body in self.bodies:
            arm = pose[body.along] - pose[body.origin]
            if body.slides:
                found.append(abs(arm))
                turned[body.name] = turned[body.parent]
            else:
                turned[body.name] = arm / abs(arm)
                found.append(cmath.phase(turned[body.name] / turned[body.parent]))
        return found


def tree(kind, dimensions):
    """Return the Tree of a linkage: one bar of every dyad hangs on each of its ends."""
    plan = assembly(kind, dimensions)
    marks = {name: ('ground', place) for name, place in plan.ground.items()}
    marks['A'] = ('crank', complex(plan.crank))
    bodies = [Body('crank', 'ground', 0j, 'O', 'A')]
    loops, bars = [], {}
    for step in plan.steps:
        if isinstance(step, Dyad):
            ends = []
            for other, length in ((step.first, step.first_bar), (step.second, step.second_bar)):
                name = other + step.name
                bodies.append(Body(name, *marks[other], other, step.name))
                bars[other, step.name] = name, length
                ends.append((name, complex(length)))
            loops.append(tuple(ends))
            marks[step.name] = ends[0]
        elif isinstance(step, Rigid):
            name, length = bars[(step.base, step.end)]
            marks[step.name] = name, length * step.factor
        elif isinstance(step, Ray):
            bodies.append(Body('lever', *marks[step.pivot], step.pivot, step.name))
            bodies.append(Body('slide', 'lever', 0j, step.pivot, step.pin, True))
            loops.append((('slide', 0j), marks[step.pin]))
            marks[step.name] = 'lever', complex(step.length)
    return Tree(bodies, marks, loops, plan.ground)
