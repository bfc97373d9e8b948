# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The inverse linkage: what is left of a linkage where outputs are given their values.

A joint angle that is given makes a crank of its link, a slide a carriage or a cylinder, a distance
one more cylinder; a coordinate puts a joint on a carriage, two of them on two. What had been the
inputs' motors are free joints. If that comes apart into dyads it is written down in joint lines,
and each of its assembly modes is a linkage whose poses tell the inputs. Where outputs are seen
from moving links alone, it may stand on any of its bodies instead of the ground.
"""

from __future__ import annotations

import cmath
from itertools import product
import math
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple, TYPE_CHECKING

import numpy as np

from . import joint_lines
from .builder import GROUND, Link, UNIT
from .design import Design
from .dyads import Dyads, Hinge, Motor, Slide
from .inputs import Input, spread
from .quantities import Names, PAIR, Structure
from ..formula.expression import (
    arctangent,
    argument,
    Complex,
    derivative,
    dot,
    Real,
    real,
    spin,
    square_root,
)

if TYPE_CHECKING:
    from .mechanism import Mechanism

# Two to the power of this many assembly modes at most.
MOST_SIDES = 5
# Of the linkage's size, what is at one place; and how often it is looked for a pose.
NEAR, TRIES = 1e-9, 400
# What a sum of angles of quarter turns [rad] is rounded to.
EXACT = 4 * 2.0 ** -51
# Assembly modes, in all turns, at most.
MOST_MODES = 64


class Mode(NamedTuple):
    """
    An assembly mode of an inverse linkage.

    Attributes
    ----------
    linkage : Structure
        Its joints, as expressions of its own inputs.
    inputs : tuple of Real
        The values [rad or m] of the inputs of the linkage itself in this mode; one that is an
        output, too, is that argument of the program.
    rates : tuple of tuple of Real
        For each input its rate by each output.

    """

    linkage: Structure
    inputs: Tuple[Real, ...]
    rates: Tuple[Tuple[Real, ...], ...]


class InverseLinkage(NamedTuple):
    """
    The joint lines of an inverse linkage, and its assembly modes.

    Attributes
    ----------
    lines : tuple of str
        Its joint lines [m].
    drives : dict
        For each of its inputs, by what its line places and in the order of the lines: an output,
        and the ratio and offset that make it the input's value.
    branches : tuple of str
        The joints whose dyads have two sides.
    modes : tuple of Mode
        One for each choice of these sides.
    turns : tuple of tuple of float
        For each input what may be added to what a mode tells [rad]: 0, and whole turns of what it
        is read from, until all comes round.
    given : dict
        What stands for the inputs of the modes: outputs, as arguments of a program.
    is_own : bool
        Whether the linkage itself has no other side: then all modes are its own.

    """

    lines: Tuple[str, ...]
    drives: Dict[str, Tuple[str, float, float]]
    branches: Tuple[str, ...]
    modes: Tuple[Mode, ...]
    turns: Tuple[Tuple[float, ...], ...]
    given: Dict[Real, Real]
    is_own: bool = False

    def __str__(self) -> str:
        said = {}
        for place, (name, ratio, offset) in self.drives.items():
            said[place] = f'    # at {name}' if (ratio, offset) == (1.0, 0.0) else (
                f'    # at {ratio:g} {name} {"-" if offset < 0.0 else "+"} {abs(offset):.6g}')
        return '\n'.join(line + said.get(line.split()[0], '') for line in self.lines)


def _of_sketch(outputs: Names, sketch: _Sketch) -> InverseLinkage:
    """Return the inverse linkage that a sketch has come to; raise ValueError if it is none."""
    lines = joint_lines.parse(sketch.lines)
    used = {name for read in sketch.reads for end in read.ends for name in end.joints}
    for line in lines[::-1]:
        if used & {*line.names}:
            used |= {*line.stands_on}
    lines = [line for line in lines if used & {*line.names}]
    drives = {line.names[0]: sketch.driving[line.names[0]] for line in lines if line.drives}
    if sorted(name for name, *_ in drives.values()) != sorted(outputs):
        raise ValueError('these outputs do not tell the inputs')
    branches, turns = joint_lines.branches(lines), tuple(read.turns for read in sketch.reads)
    if len(branches) > MOST_SIDES:
        raise ValueError(f'more than {2 ** MOST_SIDES} assembly modes')
    if 2 ** len(branches) * math.prod(map(len, turns)) > MOST_MODES:
        raise ValueError('too many turns')
    design = Design('inverse', {}, tuple(line.text for line in lines), lines[-1].names[0])
    modes = tuple(_mode(Structure(design, dict(zip(branches, signs))), outputs, sketch.reads, [
        *drives.values()]) for signs in product((1, -1), repeat=len(branches)))
    given = [ratio * argument(outputs.index(name)) + offset
             for name, ratio, offset in drives.values()]
    # An argument is told from others by its place.
    return InverseLinkage(design.joints, drives, tuple(branches), modes, turns, {
        leaf: value for mode in modes for leaf, value in zip(mode.linkage.built.arguments, given)})


def _mode(structure: Structure, outputs: Names, reads: Sequence[_Read],
          driving: Sequence[Tuple[str, float, float]]) -> Mode:
    inputs, rates = [], []
    for read in reads:
        if read.name in outputs:
            value, row = argument(outputs.index(read.name)), [
                real(float(read.name == name)) for name in outputs]
        else:
            value, turning = _input_of(structure.built, *read.ends)
            found = {name: _rate(value, turning, {i: ratio})
                     for i, (name, ratio, _) in enumerate(driving)}
            row = [found[name] for name in outputs]
        inputs.append((value - read.offset) / read.ratio)
        rates.append(tuple(rate / read.ratio for rate in row))
    return Mode(structure, tuple(inputs), tuple(rates))


class _End(NamedTuple):
    """
    How a body of the linkage lies in the inverse: two joints, and where they are on the body.

    What does not move has none.
    """

    joints: Tuple[str, ...]
    places: Tuple[complex, ...] = ()


class _Read(NamedTuple):
    """How an input is read: a link and its parent; its value is ratio * input + offset."""

    name: str
    ends: Tuple[_End, ...]
    ratio: float
    offset: float
    turns: Tuple[float, ...]


def taken_apart(linkage: Mechanism, outputs: Names) -> Optional[InverseLinkage]:
    """Return the inverse linkage for outputs, None where no closed form is known."""
    # Joint lines have their lengths in metres.
    if linkage.value(UNIT) != 1.0 or len(set(outputs)) < len(outputs):
        return None
    pose = _pose(linkage)
    if pose is None:
        return None
    absolute = any(_pair(name) or name[-2:] in ('.x', '.y') for name in outputs)
    grounds = (GROUND,) if absolute else (GROUND, *(link.name for link in linkage.links))
    for ground in grounds:
        try:
            return _of_sketch(outputs, _Sketch(linkage, outputs, ground, pose))
        except ValueError:
            continue
    return None


def _pair(output: str) -> Optional[Tuple[str, ...]]:
    found = PAIR.fullmatch(output)
    return found and found.groups()


def _pose(linkage: Mechanism) -> Optional[Dict[str, float]]:
    """Return all joint angles and coordinates in some pose that has nothing special."""
    names = (*linkage.joints, *(f'{point}.{axis}' for point in linkage.points for axis in 'xy'))
    pose = linkage.posed((), names)
    if len(linkage.inputs) > 1:
        values = spread(linkage.inputs, TRIES)
    else:
        arcs = linkage.reach()
        values = [np.array([lo + part * (hi - lo) for part in (0.382, 0.7, 0.13)
                            for lo, hi in arcs])]
    if not len(values[0]):
        return None
    rows = pose.searched(*values)
    known = np.flatnonzero(np.isfinite(rows).all(axis=0))
    return dict(zip(names, rows[:, known[0]].tolist())) if len(known) else None


class _Sketch(Dyads):
    """
    The bodies of a linkage whose outputs are given, each as seen from its own link.

    Attributes
    ----------
    driving : dict
        By the joint that a line places: the output that drives it, its ratio and offset.
    reads : list of _Read
        How each input of the linkage is read.

    """

    def __init__(self, linkage: Mechanism, outputs: Names, ground: str, pose: Dict[str, float]):
        self._linkage, self._outputs, self._pose = linkage, outputs, pose
        self._links = {link.name: link for link in linkage.links}
        self.driving: Dict[str, Tuple[str, float, float]] = {}
        self._scaled: Dict[str, Tuple[float, float]] = {}
        self._noted: Optional[Tuple[str, float, float]] = None
        self._named: Dict[str, Dict[str, complex]] = {}
        self._at: Dict[str, Tuple[complex, complex]] = {}
        slides: List[Slide] = []
        motors: List[Motor] = []
        # Each link in its own frame, whose x axis is its bar.
        self._frames = {GROUND: {name: complex(pose[f'{name}.x'], pose[f'{name}.y'])
                                 for name in linkage.grounded},
                        **{name: {joint: complex(*place) for joint, place in frame.items()}
                           for name, frame in linkage.frames.items()}}
        for body, frame in self._frames.items():
            for joint, place in frame.items():
                self._named.setdefault(joint, {})[body] = place
        self._turns = {GROUND: 1.0 + 0.0j}
        for link in linkage.links:
            angle = self._zero(link) + (pose[link.name] if link.kind == 'revolute' else 0.0)
            self._turns[link.name] = self._turns[link.parent] * cmath.rect(1.0, angle)
            motion = self._motion(link)
            if link.name in outputs:
                motors.append(motion)
            elif isinstance(motion, Slide):
                slides.append(motion)
        for block, pin in linkage.yokes.items():
            slides.append(self._guided(pin, f'{block}-{pin}', block, 1j, self._turns[block]))
        for output in sorted(outputs, key=lambda name: name.startswith('angle(')):
            if output not in self._links:
                self._add(output, slides, motors)
        size = max(abs(place) for frame in self._frames.values() for place in frame.values())
        size = max(size, linkage.longest)
        bodies = [*self._frames, *(body for pin in self._named.values() for body in pin),
                  *(body for each in (*slides, *motors) for body in each.bodies)]
        # A joint of one body alone is only needed where an input is read from it.
        read = {end for name in (*linkage.geared, *(input_.name for input_ in linkage.inputs))
                if self._links[name].kind == 'prismatic'
                for end in (self._links[name].joint, self._links[name].tip)}
        self._named = {name: pin for name, pin in self._named.items()
                       if len(pin) > 1 or name in read}
        super().__init__(ground, list(dict.fromkeys(bodies)), list(self._named.values()), slides,
                         motors, size, NEAR * size)
        self.farthest = 4.0 * (sum(linkage.bar_lengths.values()) + size)
        self.take_apart()
        self.reads = [self._read(by, input_) for by, input_ in enumerate(linkage.inputs)]

    @staticmethod
    def _zero(link: Link) -> float:
        return float(np.asarray(link.zero))

    def _motion(self, link: Link) -> Motor:
        """Return how a link moves against its parent."""
        bodies, hangs = (link.parent, link.name), self._frames[link.parent][link.joint]
        if link.kind == 'revolute':
            return Hinge(bodies, (hangs, self._frames[link.name][link.joint]), 1.0,
                         self._zero(link), link.name)
        along = cmath.rect(1.0, self._zero(link))
        return Slide(bodies, (hangs, 0.0j), (along, 1.0 + 0.0j), link.name)

    def _place(self, joint: str) -> complex:
        return complex(self._pose[f'{joint}.x'], self._pose[f'{joint}.y'])

    def _pin(self, joint: str, body: str, turn: complex = 1.0 + 0.0j) -> str:
        """Add a body that hangs on a joint, and return its name."""
        self._named[joint][body] = 0.0j
        self._at[body] = self._place(joint), turn
        return body

    def _guided(self, joint: str, body: str, base: str, axis: complex,
                turn: complex = 1.0 + 0.0j) -> Slide:
        """Let a joint run on a line through the origin of a body, which is turned in the pose."""
        return Slide((base, self._pin(joint, body, turn)), (0.0j, 0.0j), (axis, axis), body)

    def _add(self, output: str, slides: List[Slide], motors: List[Motor]) -> None:
        """Add the bodies that an output which is no joint's is measured with."""
        if pair := _pair(output):
            first, second = pair
            apart = self._place(second) - self._place(first)
            along = apart / abs(apart) if apart else 1.0 + 0.0j
            if output.startswith('distance'):
                motors.append(Slide((self._pin(first, f'{output} barrel', along),
                                     self._pin(second, f'{output} rod', along)),
                                    (0.0j, 0.0j), (1.0 + 0.0j, 1.0 + 0.0j), output))
                return
            motors.append(self._aimed(output, first, second, along, slides))
            return
        joint, axis = output.split('.')
        for link in self._linkage.links:
            along = cmath.rect(1.0, self._zero(link))
            part = along.real if axis == 'x' else along.imag
            if (link.tip, link.parent, link.kind) == (joint, GROUND, 'prismatic') and \
                    abs(part) > NEAR and joint in self._frames[link.name]:
                # A block on a line of the ground: its slide tells its coordinates.
                start = self._frames[GROUND][link.joint] + along * self._frames[link.name][joint]
                self._scaled[output] = part, start.real if axis == 'x' else start.imag
                motion = next(slide for slide in slides if slide.joint == link.name)
                slides.remove(motion)
                motors.append(motion._replace(joint=output))
                return
        body, along = f'{joint}.xy', 1.0 + 0.0j if axis == 'x' else 1j
        if body in self._named[joint]:
            # The other coordinate has put it on a line: along that it is driven, too.
            other = next(slide for slide in slides if slide.bodies[1] == body)
            slides.remove(other)
            motors.append(other._replace(joint=output))
            return
        self._at[output] = self._place(joint), 1.0 + 0.0j
        motors.append(Slide((GROUND, output), (0.0j, 0.0j), (along, along), output))
        slides.append(self._guided(joint, body, output, 1j * along))

    def _aimed(self, output: str, first: str, second: str, along: complex,
               slides: List[Slide]) -> Hinge:
        """Return the motor that an angle of two joints makes, seen from the ground."""
        # Bodies that never turn: the ground, and what carries a joint whose coordinates are given.
        level = {joint: body for joint, pin in self._named.items()
                 for body in (GROUND, f'{joint}.xy') if body in pin}
        for body in self._named[first].keys() & self._named[second].keys() & self._frames.keys():
            frame = self._frames[body]
            for joint in frame.keys() & level.keys():
                places = self._named[joint][level[joint]], frame[joint]
                return Hinge((level[joint], body), places, 1.0,
                             -cmath.phase(frame[second] - frame[first]), output)
        for start, end, turn in ((first, second, along), (second, first, -along)):
            if start in level:
                body = self._pin(start, output, turn)
                slides.append(self._guided(end, f'{output} pin', body, 1.0 + 0.0j, turn))
                return Hinge((level[start], body), (self._named[start][level[start]], 0.0j), 1.0,
                             0.0 if start == first else math.pi, output)
        raise ValueError(f'{output} is seen from no joint that is known')

    def seen(self, body: str, place: complex) -> complex:
        """Return where a place on a body is in the pose."""
        if body in self._at:
            start, turn = self._at[body]
            return start + turn * place
        joint, origin = next(iter(self._frames[body].items()))
        return self._place(joint) + self._turns[body] * (place - origin)

    def turned(self, body: str, along: complex) -> complex:
        """Return a direction on a body as it is in the pose."""
        return (self._at[body][1] if body in self._at else self._turns[body]) * along

    def said(self, value: float) -> str:
        """Return a length as it is."""
        return repr(float(value) + 0.0)

    def quarters(self, start: float) -> Optional[int]:
        """Return quarter turns: what is added to an angle would cost it its last digits."""
        quarters = round(start / (0.5 * math.pi))
        return quarters % 4 if abs(start - 0.5 * math.pi * quarters) < EXACT else None

    def called(self, place: complex, body: str) -> str:
        """Return the linkage's own name of a joint, or a new one."""
        for name, pin in self._named.items():
            if body in pin and abs(pin[body] - place) < self.near:
                return name
        taken = {*self._named, *(line.split()[0] for line in self.lines)}
        return next(name for name in (f'{letter}{number or ""}' for number in range(1000)
                                      for letter in 'XYZUVW') if name not in taken)

    def name(self, place: complex, body: str, line: str) -> str:
        """Write the line that places a joint, and return its name."""
        name = super().name(place, body, line)
        if self._noted:
            self.driving[name], self._noted = self._noted, None
        return name

    def drive(self, word: str, joint: Any, ratio: float, offset: float) -> Tuple[str, str]:
        """Note an input."""
        part, start = self._scaled.get(joint, (1.0, 0.0))
        self._noted = joint, ratio / part, offset - ratio * start / part
        return self.number(word), ''

    def _read(self, by: int, input_: Input) -> _Read:
        """Return how an input is read, from its own link or from one that is geared to it."""
        counted = self._linkage.period(by) == input_.period or not input_.turns
        for name in (input_.name, *(self._linkage.geared_to(by) if counted else ())):
            try:
                ends = self._ends(self._links[name])
            except ValueError:
                continue
            ratio, offset = (1.0, 0.0) if name == input_.name else self._linkage.gear(name, by)
            held = name in self._outputs and name == input_.name
            count = round(abs(ratio) * input_.period) if input_.turns and not held else 1
            return _Read(name, ends, ratio, offset, tuple(
                turn * math.tau / abs(ratio) for turn in range(count)))
        raise ValueError(f'{input_.name} is not placed')

    def _ends(self, link: Link) -> Tuple[_End, ...]:
        """Return how an input's link and its parent lie."""
        if link.kind == 'revolute':
            return (self._end_of(link.name, cmath.rect(1.0, 0.0)),
                    self._end_of(link.parent, cmath.rect(1.0, self._zero(link))))
        tip, origin = ((self._joint(body, joint),) for body, joint in (
            (link.name, link.tip), (link.parent, link.joint)))
        parent = self._links.get(link.parent)
        if parent and len(self._frames[parent.name]) == 1 and parent.kind == 'revolute':
            # A barrel: as long as its ends are apart.
            return _End(tip), _End(origin)
        along = cmath.rect(1.0, self._zero(link))
        return _End(tip), _End(origin), self._end_of(link.parent, along)

    def _joint(self, body: str, joint: str) -> str:
        """Return a joint that the lines place; raise ValueError if they do not."""
        for name, at in self.on[body].items():
            if abs(at - self._frames[body][joint]) < self.near:
                return name
        raise ValueError(f'{joint} is not placed')

    def _end_of(self, body: str, along: complex) -> _End:
        """Return two joints that show how a body lies; places are seen along a direction."""
        if body == self.ground:
            return _End((), (along,))
        if body not in self.parts:
            raise ValueError(f'{body} is not placed')
        (one, start) = self.end(body)
        two, end = self.other(body, one)
        return _End((one, two), ((end - start) / along,))


def _input_of(built: Any, one: _End, other: _End, line: Optional[_End] = None) -> Tuple[
        Real, Sequence[Tuple[float, Complex]]]:
    """Return the value of an input, and the vectors of which its angle is the sum."""
    if one.places:
        relative, turning = Complex(1.0, 0.0), []
        for end, sign in ((one, 1.0), (other, -1.0)):
            seen = end.places[0] / abs(end.places[0])
            if end.joints:
                bar = built.arm(*end.joints).vector
                turning.append((sign, bar))
                relative = relative * (bar if sign > 0.0 else bar.conjugate())
                seen = seen.conjugate()
            relative = relative * _constant(seen if sign > 0.0 else seen.conjugate())
        return arctangent(relative.y, relative.x), turning
    (tip,), (origin,) = one.joints, other.joints
    arm = built.arm(origin, tip)
    if line is None:
        return square_root(arm.square), ()
    along = _constant(line.places[0] / abs(line.places[0]))
    if line.joints:
        along = built.arm(*line.joints).vector * along.conjugate()
        along = along / along.length()
    return dot(arm.vector, along), ()


def _constant(value: complex) -> Complex:
    """Return a direction; what rounding leaves of zero is zero."""
    exact = [0.0 if abs(part) < 1e-16 else math.copysign(1.0, part)
             if abs(abs(part) - 1.0) < 1e-16 else part for part in (value.real, value.imag)]
    return Complex(*exact)


def _rate(value: Real, turning: Sequence[Tuple[float, Complex]],
          speeds: Dict[int, Any]) -> Real:
    known: Dict[Real, Real] = {}
    if not turning:
        return derivative(value, speeds, known)
    total = real(0.0)
    for sign, bar in turning:
        turned = spin(bar)
        total = total + sign * turned.formula(*(derivative(x, speeds, known) for x in turned.of))
    return total
