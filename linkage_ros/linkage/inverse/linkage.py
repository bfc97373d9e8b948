# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The inverse linkage: a linkage driven by the values of its outputs.

The value of a joint angle makes its link a crank, that of a slide a carriage or a cylinder, that
of a distance one more cylinder. A coordinate puts a joint on a carriage, two coordinates on two.
The motors of the inputs become free joints. If the result decomposes into dyads, it is written in
joint lines, and the poses of each assembly mode give the inputs. If the outputs are measured
between moving links only, any body can be its ground.
"""

from __future__ import annotations

import cmath
from itertools import product
import math
from typing import Any, Callable, NamedTuple

import numpy as np

from ..dyads import Dyads, Hinge, Motor, Slide
from ..formulas import LinkageFormulas, Names, PAIR
from ..geometry.builder import GROUND, Link
from ..inputs import Input, spread
from ..kinematics import Kinematics
from ..text import joint_lines
from ..text.design import Design
from ..tolerances import CLOSE, TOLERANCE
from ...formula.expression import (
    arctangent,
    argument,
    Complex,
    dot,
    Real,
    square_root,
    substituted,
)

# Assembly modes at most, in all turns.
MAX_MODES = 64
# Poses tried to find one that can be assembled.
TRIES = 400


class InverseLinkage(NamedTuple):
    """
    The joint lines of an inverse linkage, and its assembly modes.

    Attributes
    ----------
    lines : tuple of str
        Its joint lines [m].
    drives : dict
        By the joint that an input's line places, in the order of the lines: the output that
        drives it, and the ratio and offset from that output to the input's value.
    branches : tuple of str
        The joints whose dyads have two sides.
    modes : dict
        For each choice of these sides, +1 left, the values [rad or m] of the original linkage's
        inputs as expressions of the outputs, which are arguments of a program. An input that is
        also an output is that argument.
    turns : tuple of tuple of float
        For each input, the angles [rad] that may be added to its value in a mode: 0, and whole
        turns of the link that it is read from, up to the input's period.

    """

    lines: tuple[str, ...]
    drives: dict[str, tuple[str, float, float]]
    branches: tuple[str, ...]
    modes: dict[tuple[float, ...], tuple[Real, ...]]
    turns: tuple[tuple[float, ...], ...]

    def solutions(self) -> list[list[Real]]:
        """Return the inputs in each mode and its turns, as expressions of the outputs."""
        return [[value + turn for value, turn in zip(inputs, turns)]
                for inputs in self.modes.values() for turns in product(*self.turns)]

    def __str__(self) -> str:
        comments = {}
        for place, (name, ratio, offset) in self.drives.items():
            comments[place] = f'    # at {name}' if (ratio, offset) == (1.0, 0.0) else (
                f'    # at {ratio:g} {name} {"-" if offset < 0.0 else "+"} {abs(offset):.6g}')
        return '\n'.join(line + comments.get(line.split()[0], '') for line in self.lines)


def _of_sketch(outputs: Names, sketch: _Sketch) -> InverseLinkage:
    """Return the inverse linkage of a sketch; raise ValueError if the sketch is incomplete."""
    lines = joint_lines.parse(sketch.lines)
    # They are in the order of what drives them.
    driven = [line for line in lines if line.drives]
    used = {name for read in sketch.reads for name in read.joints}
    for line in lines[::-1]:
        if used & {*line.names}:
            used |= {*line.depends_on}
    lines = [line for line in lines if used & {*line.names}]
    drives = {line.names[0]: drive for line, drive in zip(driven, sketch.drives) if line in lines}
    if sorted(name for name, *_ in drives.values()) != sorted(outputs):
        raise ValueError('the inputs do not depend on all of these outputs')
    branches, turns = joint_lines.branches(lines), tuple(read.turns for read in sketch.reads)
    if 2 ** len(branches) * math.prod(map(len, turns)) > MAX_MODES:
        raise ValueError(f'more than {MAX_MODES} assembly modes')
    design = Design('inverse', {}, tuple(line.text for line in lines), lines[-1].names[0])
    values = [ratio * argument(outputs.index(name)) + offset
              for name, ratio, offset in drives.values()]
    modes = {}
    for signs in product((1.0, -1.0), repeat=len(branches)):
        built = LinkageFormulas(design, dict(zip(branches, signs))).built
        replaced = dict(zip([*built.arguments, *map(built.positive.get, built.arguments)],
                            [*values, *values]))
        modes[signs] = tuple(substituted([read.value(built) for read in sketch.reads], replaced))
    return InverseLinkage(design.joints, drives, tuple(branches), modes, turns)


class _Read(NamedTuple):
    """
    An input as it is read from the inverse linkage.

    `joints` are those that it depends on, `value` is its function of that linkage's `Builder`,
    and `turns` are the angles [rad] that may be added.
    """

    joints: tuple[str, ...]
    value: Callable[[Any], Real]
    turns: tuple[float, ...]


def decompose(linkage: Kinematics, outputs: Names) -> InverseLinkage | None:
    """Return the inverse linkage for outputs, None where no closed form is known."""
    pose = _pose(linkage)
    if pose is None:
        return None
    for ground in (GROUND, *(link.name for link in linkage.links)):
        try:
            return _of_sketch(outputs, _Sketch(linkage, outputs, ground, pose))
        except ValueError:
            continue
    return None


def _pose(linkage: Kinematics) -> dict[str, float] | None:
    """Return all joint angles and coordinates in a generic pose, away from dead points."""
    names = (*linkage.joints, *(f'{point}.{axis}' for point in linkage.points for axis in 'xy'))
    rows = linkage.compiled_pose((), names).searched(*spread(linkage.inputs, TRIES))
    known = rows[:, np.isfinite(rows).all(axis=0)]
    return dict(zip(names, known[:, 0].tolist())) if known.size else None


class _Sketch(Dyads):
    """
    The bodies of a linkage driven by its outputs, each in the coordinates of its own link.

    Attributes
    ----------
    drives : list of tuple
        For each line that drives, in their order: the output that drives it, its ratio and offset.
    reads : list of _Read
        Where each input of the linkage is read.

    """

    def __init__(self, linkage: Kinematics, outputs: Names, ground: str, pose: dict[str, float]):
        self._linkage, self._outputs, self._pose = linkage, outputs, pose
        self._links = {link.name: link for link in linkage.links}
        # Each link in its own frame, whose x axis is its bar.
        self._frames = {GROUND: {name: complex(pose[f'{name}.x'], pose[f'{name}.y'])
                                 for name in linkage.grounded},
                        **{name: {joint: complex(*place) for joint, place in frame.items()}
                           for name, frame in linkage.frames.items()}}
        size = max(linkage.longest, *(
            abs(place) for frame in self._frames.values() for place in frame.values()))
        super().__init__(ground, (), (), (), (), size, CLOSE * size)
        self.farthest = 4.0 * (sum(linkage.bar_lengths.values()) + size)
        self.drives: list[tuple[str, float, float]] = []
        self._scaled: dict[str, tuple[float, float]] = {}
        self._named: dict[str, dict[str, complex]] = {}
        # The origin and the direction of each body in the pose.
        self._at: dict[str, tuple[complex, complex]] = {GROUND: (0.0j, 1.0 + 0.0j)}
        for body, frame in self._frames.items():
            for joint, place in frame.items():
                self._named.setdefault(joint, {})[body] = place
        for link in linkage.links:
            angle = link.zero + (pose[link.name] if link.kind == 'revolute' else 0.0)
            turn = self._at[link.parent][1] * cmath.rect(1.0, angle)
            joint, origin = next(iter(self._frames[link.name].items()))
            self._at[link.name] = self._place(joint) - turn * origin, turn
            motion = self._motion(link)
            if motion.joint in outputs:
                self.motors.append(motion)
            elif isinstance(motion, Slide):
                self.slides.append(motion)
        for block, pin in linkage.yokes.items():
            self.slides.append(self._guided(pin, f'{block}-{pin}', block, 1j, self._at[block][1]))
        for output in sorted(outputs, key=lambda name: name.startswith('angle(')):
            if output not in [motor.joint for motor in self.motors]:
                self._add(output)
        # A joint on a single body is placed only if an input is read from it.
        self.pins = [pin for pin in self._named.values() if len(pin) > 1]
        self.on = {body: {} for body in self._at}
        self.decompose()
        self.reads = [self._read(by, input_) for by, input_ in enumerate(linkage.inputs)]

    def _motion(self, link: Link) -> Motor:
        """Return the motion of a link relative to its parent."""
        bodies, hangs = (link.parent, link.name), self._frames[link.parent][link.joint]
        if link.kind == 'revolute':
            return Hinge(bodies, (hangs, self._frames[link.name][link.joint]), 1.0, link.zero,
                         link.name)
        along, name = cmath.rect(1.0, link.zero), link.name
        for axis, part, start in ('x', along.real, hangs.real), ('y', along.imag, hangs.imag):
            # The slide of a block on a fixed line determines the coordinates of the block.
            output = f'{link.tip}.{axis}'
            if link.parent == GROUND and output in self._outputs and abs(part) > CLOSE:
                name, self._scaled[output] = output, (part, start)
        return Slide(bodies, (hangs, 0.0j), (along, 1.0 + 0.0j), name)

    def _place(self, joint: str) -> complex:
        return complex(self._pose[f'{joint}.x'], self._pose[f'{joint}.y'])

    def _pin(self, joint: str, body: str, turn: complex = 1.0 + 0.0j) -> str:
        """Add a body that turns about a joint, and return its name."""
        self._named[joint][body] = 0.0j
        self._at[body] = self._place(joint), turn
        return body

    def _guided(self, joint: str, body: str, base: str, axis: complex,
                turn: complex = 1.0 + 0.0j) -> Slide:
        """Put a joint on a line through the origin of a body; `turn` is the body's direction."""
        return Slide((base, self._pin(joint, body, turn)), (0.0j, 0.0j), (axis, axis), body)

    def _add(self, output: str) -> None:
        """Add bodies that measure an output other than a joint's value."""
        if pair := PAIR.fullmatch(output):
            first, second = pair.groups()
            vector = self._place(second) - self._place(first)
            along = vector / abs(vector) if vector else 1.0 + 0.0j
            self.motors.append(self._aimed(output, first, second, along) if output.startswith(
                'angle') else Slide((self._pin(first, f'{output} barrel', along),
                                     self._pin(second, f'{output} rod', along)),
                                    (0.0j, 0.0j), (1.0 + 0.0j, 1.0 + 0.0j), output))
            return
        joint, axis = output.split('.')
        along, other = (1.0 + 0.0j, f'{joint}.y') if axis == 'x' else (1j, f'{joint}.x')
        self._at[output] = self._place(joint), 1.0 + 0.0j
        self.motors.append(Slide((GROUND, output), (0.0j, 0.0j), (along, along), output))
        # Along the other axis, whose coordinate may drive it.
        across = self._guided(joint, f'{joint}.xy', output, 1 + 1j - along)._replace(joint=other)
        (self.motors if other in self._outputs else self.slides).append(across)

    def _aimed(self, output: str, first: str, second: str, along: complex) -> Hinge:
        """Return the motor for the angle of two joints, relative to the ground."""
        # Bodies that never turn: the ground, and carriages of joints with known coordinates.
        level = {joint: body for joint, pin in self._named.items()
                 for body in (GROUND, f'{joint}.xy') if body in pin}
        for body, frame in self._frames.items():
            for joint in [joint for joint in level if {joint, first, second} <= frame.keys()]:
                places = self._named[joint][level[joint]], frame[joint]
                return Hinge((level[joint], body), places, 1.0,
                             -cmath.phase(frame[second] - frame[first]), output)
        for start, end in ((first, second), (second, first)):
            if start in level:
                body = self._pin(start, output, along)
                self.slides.append(self._guided(end, f'{output} pin', body, 1.0 + 0.0j, along))
                return Hinge((level[start], body), (self._named[start][level[start]], 0.0j), 1.0,
                             0.0, output)
        raise ValueError(f'neither joint of {output} is on a body that never turns')

    def place_in_pose(self, body: str, place: complex) -> complex:
        """Return a place on a body, in the coordinates of the pose."""
        start, turn = self._at[body]
        return start + turn * place

    def direction_in_pose(self, body: str, along: complex) -> complex:
        """Return a direction on a body, in the coordinates of the pose."""
        return self._at[body][1] * along

    def length_text(self, value: float) -> str:
        """Return a length with all its digits."""
        return repr(float(value) + 0.0)

    def quarters(self, start: float) -> int | None:
        """Return 0 to 3 quarter turns: an offset added to the angle would cost its last digits."""
        quarters = round(start / (0.5 * math.pi))
        return quarters % 4 if abs(start - 0.5 * math.pi * quarters) < 2.0 * TOLERANCE else None

    def new_name(self, place: complex, body: str) -> str:
        """Return the linkage's own name of a joint, or a new name."""
        for name, pin in self._named.items():
            if body in pin and abs(pin[body] - place) < self.near:
                return name
        taken = {*self._named, *(line.split()[0] for line in self.lines)}
        return next(name for name in (f'{letter}{number or ""}' for number in range(1000)
                                      for letter in 'XYZUVW') if name not in taken)

    def drive(self, word: str, joint: Any, ratio: float, offset: float) -> tuple[str, str]:
        """Record an input, which the next line drives."""
        part, start = self._scaled.get(joint, (1.0, 0.0))
        self.drives.append((joint, ratio / part, offset - ratio * start / part))
        return self.number(word), ''

    def _read(self, by: int, input_: Input) -> _Read:
        """Return where an input is read: from its own link, or from one that is geared to it."""
        names = (input_.name, *(() if input_.is_part else self._linkage.geared_to(by)))
        placed = [name for name in names if {name, self._links[name].parent} <= self.parts.keys()]
        if not placed:
            raise ValueError(f'{input_.name} is not placed')
        name, (joints, value) = placed[0], self._value(self._links[placed[0]])
        ratio, offset = (1.0, 0.0) if name == input_.name else self._linkage.gear(name, by)
        is_output = name in self._outputs and name == input_.name
        count = round(abs(ratio) * input_.period) if input_.wraps and not is_output else 1
        output = argument(self._outputs.index(name)) if name in self._outputs else None
        return _Read(joints, lambda built: ((output or value(built)) - offset) / ratio, tuple(
            turn * math.tau / abs(ratio) for turn in range(count)))

    def _value(self, link: Link) -> tuple[tuple[str, ...], Callable]:
        """Return the joints that tell the position of a link on its parent, and its formula."""
        zero = cmath.rect(1.0, link.zero)
        if link.kind == 'revolute':
            ends, ahead = self._direction(link.name, 1.0 + 0.0j)
            others, back = self._direction(link.parent, zero)

            def angle(built: Any) -> Real:
                turned = ahead(built) * back(built).conjugate()
                return arctangent(turned.y, turned.x)
            return ends + others, angle
        (tip, _), (origin, _) = (self.fixed(body, self._frames[body][joint]) for body, joint in (
            (link.name, link.tip), (link.parent, link.joint)))
        parent = self._links.get(link.parent)
        if parent and len(self._frames[parent.name]) == 1 and parent.kind == 'revolute':
            # A cylinder: its length is the distance of its ends.
            return (tip, origin), lambda built: square_root(built.arm(origin, tip).square)
        ends, along = self._direction(link.parent, zero)

        def slide(built: Any) -> Real:
            line = along(built) / along(built).length() if ends else along(built)
            return dot(built.arm(origin, tip).vector, line)
        return (tip, origin, *ends), slide

    def _direction(self, body: str, along: complex) -> tuple[tuple[str, ...], Callable]:
        """Return the joints that tell the direction of a body, and the formula of that vector."""
        if body == self.ground:
            return (), lambda built: _constant(along)
        first, start = self.end(body)
        second, end = self.other(body, first)
        turn = _constant(along * (end - start).conjugate() / abs(end - start))
        return (first, second), lambda built: built.arm(first, second).vector * turn


def _constant(value: complex) -> Complex:
    """Return a direction with parts next to 0 and +-1 set to these."""
    exact = [0.0 if abs(part) < 1e-16 else math.copysign(1.0, part)
             if abs(abs(part) - 1.0) < 1e-16 else part for part in (value.real, value.imag)]
    return Complex(*exact)
