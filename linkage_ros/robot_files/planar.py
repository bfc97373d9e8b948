# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The planar loops of a robot, each in its plane, as mechanisms of a scene.

The lines of a mechanism have its inputs first, then its dyads.
"""

from __future__ import annotations

from cmath import phase
from contextlib import suppress
from dataclasses import replace
import math
from typing import Iterator, NamedTuple, Sequence

import numpy as np

from . import check, closing
from .spatial import ASKEW, CROSSING, EXACT, inclination, loops_of
from .. import mechanisms, scene
from ..linkage import bar_name, Dyads, Hinge, Pin, ROUNDING, short, Slide, theta_of
from ..robot_model.robot import at, BALL, coordinates, FIXED, HINGE, Joint, NotDriven, Robot, SLIDE

# Kinds of joints in planar loops.
_FLAT = (HINGE, SLIDE, BALL)
_OTHER = {'left': 'right', 'right': 'left', 'out': 'in', 'in': 'out'}


class Group(NamedTuple):
    """Loops that share bars: ground, joints, why not planar, and planar parts."""

    ground: str
    joints: list[Joint]
    why: str
    parts: list['Group']


def groups(robot: Robot) -> list[Group]:
    """Return the loops of a robot, with their planar parts; bodies fixed to others are one."""
    # Whatever closes a loop joins bodies as all others do.
    fixed = [replace(joint, is_cut=False) for joint in robot.joints if joint.kind == FIXED]
    link_of = {robot.root: robot.root}
    for body, (base, joint) in replace(robot, joints=fixed).spanning_tree()[0].items():
        link_of[body] = link_of[base] if joint.kind == FIXED else body
    # Several bodies that are one have the name of the first that a joint moves.
    names = {link_of[body]: body for joint in robot.joints[::-1] if joint.kind != FIXED
             for body in joint.bodies[::-1]}
    link_of = {body: names.get(first, first) for body, first in link_of.items()}
    joints = [replace(joint, bodies=(link_of[joint.bodies[0]], link_of[joint.bodies[1]]),
                      is_cut=False) for joint in robot.joints]
    robot = replace(robot, root=link_of[robot.root], joints=[
        joint for joint in joints if len({*joint.bodies}) == 2], frames={
        body: robot.frames[body] for body in link_of.values()})
    return [group._replace(parts=_parts(robot, group) if group.why else [group])
            for group in _groups(robot, _with_balls(robot))]


def _parts(robot: Robot, group: Group) -> list[Group]:
    """Return the planar parts of loops that are not planar as a whole."""
    parts: list[Group] = []
    rest = group.joints
    for joint in group.joints:
        if joint.kind == HINGE and joint in rest:
            flat = [other for other in rest
                    if other.kind in _FLAT and inclination(other, joint.axes[0]) < ASKEW]
            parts += [part for part in _groups(robot, flat) if not part.why]
            rest = [other for other in rest if not any(other in part.joints for part in parts)]
    return parts


def _groups(robot: Robot, joints: list[Joint]) -> Iterator[Group]:
    """Yield the loops of some joints, those that share bars together."""
    tree, loops = loops_of(replace(robot, joints=joints))
    for bodies, inside, _ in loops:
        # The parent of the first body is nearest to the root.
        ground = next(base for body, (base, _) in tree.items() if body in bodies)
        yield Group(ground, inside, _why_not_planar(ground, inside), [])


def _with_balls(robot: Robot) -> list[Joint]:
    """Return the joints with a ball in place of two or three hinges that cross in a point."""
    joints = robot.joints
    for body in reversed(robot.frames):
        pair = [joint for joint in joints if body in joint.bodies]
        if body == robot.root or len(pair) != 2 or any(
                joint.name in robot.driven or joint.kind not in (HINGE, BALL) for joint in pair):
            continue
        first, second = pair
        ends = first.other(body), second.other(body)
        places = first.place(ends[0]), second.place(ends[1])
        if ends[0] != ends[1] and np.linalg.norm(places[0] - places[1]) < CROSSING \
                and (BALL in (first.kind, second.kind)
                     or np.linalg.norm(np.cross(first.axes[0], second.axes[0])) > ASKEW):
            ball = Joint(f'{first.name}+{second.name}', BALL, ends, places, first.axes,
                         parts=(*chain(first, ends[0]), *chain(second, body)))
            joints = [*(joint for joint in joints if joint not in pair), ball]
    return joints


def chain(joint: Joint, start: str) -> Sequence[tuple[Joint, float]]:
    """Return the hinges of a joint from one of its bodies to the other, with their signs."""
    parts = joint.parts or [(joint, 1.0)]
    return parts if joint.bodies[0] == start else [(hinge, -sign) for hinge, sign in parts[::-1]]


def _hinges(ground: str, joints: Sequence[Joint], drives: Sequence[str] = ()) -> list[Joint]:
    """Return the hinges, of which the first has the plane's normal."""
    return sorted((joint for joint in joints if joint.kind == HINGE),
                  key=lambda joint: (joint.name not in drives, ground not in joint.bodies))


def _why_not_planar(ground: str, joints: Sequence[Joint]) -> str:
    """Return why loops are not planar; '' if they are."""
    hinges = _hinges(ground, joints)
    if not hinges:
        return 'not planar: no hinge says in which plane'
    for joint in joints:
        if joint.kind not in _FLAT:
            return f'not planar: {joint.name} is a joint of type {joint.kind}'
        if (askew := inclination(joint, hinges[0].axes[0])) > ASKEW:
            return (f'not planar: the axes of {hinges[0].name} and {joint.name} are '
                    f'{np.degrees(np.arcsin(min(askew, 1.0))):.3g} degrees from it, more '
                    f'than {np.degrees(ASKEW):.2g}')
    # A body that can leave the plane: only rods may be on balls alone.
    stiff = {ground}
    joining = [joint for joint in joints if joint.kind != BALL
               or len(joint.hinges) == 2 and _pins(joint, hinges[0].axes[0])]
    # A universal joint with an axis normal to the plane is a pin, but a body can lean on it that
    # has no other pin.
    pinned = [ground, *(body for joint in joining for body in joint.bodies)]
    joining = [joint for joint in joining if joint.kind != BALL
               or min(map(pinned.count, joint.bodies)) > 1]
    while more := {end for joint in joining for end in joint.bodies
                   if stiff & {*joint.bodies}} - stiff:
        stiff |= more
    for body in dict.fromkeys(end for joint in joints for end in joint.bodies):
        ends = [joint.bodies for joint in joints if body in joint.bodies]
        if body not in stiff and (len(ends) != 2 or not all(stiff & {*pair} for pair in ends)):
            return f'not planar: {body} hangs on balls alone, and is no rod'
    return ''


def _pins(joint: Joint, normal: np.ndarray) -> list[tuple[Joint, float]]:
    """Return the hinges of a ball that turn in a plane, with their signs."""
    return [(hinge, sign) for hinge, sign in joint.parts
            if hinge.kind == HINGE and inclination(hinge, normal) < ASKEW]


class Drawing(Dyads):
    """
    Joint lines of a planar loop, with the lengths of its bodies.

    Attributes
    ----------
    frame : array
        The pose of its plane on the ground.
    joints : list of Joint
        Joints whose places are complex [m], and so are the axes of slides; the axis of a hinge is
        1 or -1. Of a ball in the plane it is the hinge that turns.
    opening, inclination : float
        The distance that cannot be closed [m], and the inclination of axes [rad].
    drives : list of Source
        The inputs.
    driven : list of Joint
        The joints of the inputs.

    Raises
    ------
    ValueError
        If it is not closed.

    """

    def __init__(self, robot: Robot, group: Group, drives: Sequence[str]):
        self._robot = robot
        self._flatten(group, drives)
        self.drives: list[check.Source] = []
        self.driven = [joint for joint in self.joints if joint.name in drives]
        places = [place for joint in self.joints for place in joint.places]
        size = max(abs(place - other) for place in places for other in places)
        if size < CROSSING:
            raise ValueError('all its joints are at one place')
        if self.opening > closing.OPEN * size:
            raise ValueError('its loops cannot be closed: they stay open by '
                             f'{self.opening:.3g} m, more than {closing.OPEN:g} of their size')
        near = size * min(max(ROUNDING, 10.0 * self.opening / size), 1e-6)
        pins: list[dict[str, complex]] = []
        for pin in (dict(zip(joint.bodies, joint.places)) for joint in self.joints
                    if joint.kind != SLIDE):
            same = [other for other in pins if any(
                abs(other[body] - pin[body]) < near for body in other.keys() & pin.keys())]
            pins = [other for other in pins if other not in same]
            pins.append({body: place for other in (*same, pin) for body, place in other.items()})
        slides = {joint: Slide(
            joint.bodies, (joint.places[1] - joint.axes[0] * joint.start, joint.places[1]),
            joint.axes, joint) for joint in self.joints if joint.kind == SLIDE}
        super().__init__(
            group.ground, [body for joint in self.joints for body in joint.bodies], pins,
            [slide for joint, slide in slides.items() if joint not in self.driven],
            [slides.get(joint) or Hinge(joint.bodies, joint.places, joint.axes[0],
                                        -joint.axes[0] * joint.start, joint)
             for joint in self.driven], size, near)
        self.farthest += max([0.0, *(abs(joint.start) for joint in slides)])
        self.decompose()

    def _flatten(self, group: Group, drives: Sequence[str]) -> None:
        """Set the plane, and the joints in it."""
        ground = group.ground
        hinges = _hinges(ground, group.joints, drives)
        base, up = self._robot.frames[ground], hinges[0].axes[0]
        self.inclination = max(inclination(joint, up) for joint in group.joints)
        normal = base[:3, :3].T @ up
        right = np.eye(3)[int(abs(normal[0]) > 0.9)]
        right = (right - right @ normal * normal) / np.linalg.norm(np.cross(right, normal))
        turned = np.column_stack([right, np.cross(normal, right), normal])
        origin = next((joint for joint in hinges if ground in joint.bodies), hinges[0])
        self.frame = at(base[:3, :3].T @ (origin.places[0] - base[:3, 3]), turned)
        seen = np.linalg.inv(base @ self.frame)
        self.joints: list[Joint] = []
        self.opening = 0.0
        stiff = {body for joint in group.joints for body in joint.bodies
                 if len(joint.hinges) == 2 and not _pins(joint, up)}
        for joint in group.joints:
            # A rod turns in the plane about one hinge of the ball at its end; the others stay,
            # unless its other end needs them.
            if (pins := _pins(joint, up)) and not stiff & {*joint.bodies}:
                hinge, sign = pins[0]
                joint = replace(joint, name=hinge.name, kind=HINGE, position=hinge.position,
                                axes=(sign * hinge.axes[0],) * 2)
            first, second = (complex(*(seen @ [*place, 1.0])[:2]) for place in joint.places)
            axis, slides = seen[:3, :3] @ joint.axes[0], joint.kind == SLIDE
            along = complex(*axis[:2]) / np.hypot(*axis[:2]) if slides else float(np.sign(axis[2]))
            self.joints.append(replace(joint, places=(first, second), axes=[along] * 2))
            vector = second - first
            self.opening = max(self.opening, abs((vector / along).imag if slides else vector))

    def error(self, lines: Sequence[str], name: str) -> float:
        """Return how far lines have a joint from where the file has it [m]."""
        linkage = mechanisms.create('custom', joints=lines)
        place = linkage.solve(theta_of([drive.value for drive in self.drives]), name)[name]
        return max(abs(complex(*place) - on[name]) for on in self.on.values() if name in on)

    def measured_by(self, joint: Joint) -> tuple[str, float, float]:
        """
        Return the link whose angle is a joint's position, with sign and position.

        Raises ValueError if there is none, as no word places a second joint on a block or barrel.
        """
        parent, child = joint.bodies
        if joint.kind == SLIDE:
            block, = (body for body in joint.bodies if self.parts[body].slide is joint)
            part = self.parts[block]
            sign = math.copysign(1.0, (part.along / joint.motion(block)).real)
            way = (self.on[block][part.joint] - part.start) / part.along
            return part.link, sign, way.real
        pin = self.joint_at(child, joint.places[1]) or ''
        base, body = (parent, child) if self.placed_on[pin] == parent else (child, parent)
        link, hangs, along, slide, _ = self.parts[body]
        # A motor on a pin of three bodies may turn this one against the third.
        is_turned = {base, body} in [{*motor.bodies} for motor in self.driven]
        if self.placed_on[pin] != base or hangs != pin or slide or not link \
                or link.startswith('crank') and not is_turned:
            link, along = self._measuring(pin, base, body)
        return link, joint.motion(body), phase(along / self.parts[base].along)

    def _measuring(self, pin: str, base: str, body: str) -> tuple[str, complex]:
        """Add a bar that turns on one body as another does; return its link and direction."""
        (other, end), start = self.other(body, pin), self.on[body][pin]
        along = end - start
        corner = along * complex(0.5, 0.75 ** 0.5)
        if self.placed_on[pin] == base:
            # A triangle that is a dyad, so that it hangs on the pin.
            side, foot, along = self.length_text(abs(along)), pin, corner
            line = f'dyad {pin} {other} {side} {side} left'
        else:
            # Of three bodies on a pin, a bar parallel to that of one, on another one.
            foot = next((name for name in self.on[base] if self.placed_on[name] == base), '') \
                or self.fixed(base, self.on[base][pin] + corner)[0]
            line = f'parallelogram {pin} {foot} {other}'
        name = self.name(self.on[base][foot] + along, body, line)
        # Its link turns as the body does, but is another: nothing is placed on it.
        del self.on[body][name]
        return bar_name(foot, name), along

    def drive(self, word: str, joint: Joint, ratio: float, offset: float) -> tuple[str, str]:
        """Add an input, as `Dyads` requires; inputs of one source are geared to the first."""
        source, factor, start = self._robot.source(joint.name)
        ratio, offset, number = ratio * factor, offset + ratio * start, self.number(word)
        for other in self.drives:
            if other.source == source and (word == 'crank') == (other.name[:5] == 'crank'):
                gear = ratio / other.ratio
                offset -= gear * other.offset
                angle_or_length = self.length_text(offset) if word != 'crank' else short(
                    math.remainder(offset, math.tau))
                return number, f' geared {other.name} {gear!r} {angle_or_length}'
        value = ratio * (self._robot.positions.get(source) or 0.0) + offset
        self.drives.append(check.Source(word + number, source, ratio, offset, value))
        return number, ''

    def special_line(self, place: complex, other: complex, *pins: Pin) -> str | None:
        """Return the start of a line for bars that mirror others, and so pass dead points."""
        (first, start), (second, end) = pins
        for corner, corner_at in [item for body in self.parts for item in self.on[body].items()]:
            links = [{body for body in self.parts
                      if {corner, name} <= self.on[body].keys()} for name in (first, second)]
            if corner in (first, second) or not all(links) or links[0] == links[1]:
                continue
            opposite, along = start + end - corner_at, end - start
            mirrored, crossed = (start + along * ((point - start) / along).conjugate()
                                 for point in (corner_at, opposite))
            for word, seen in (('parallelogram', opposite), ('mirror', mirrored),
                               ('antiparallelogram', crossed)):
                if max(abs(seen - place), abs(seen - other)) < self.near < abs(corner_at - place):
                    return f'{word} {corner} {first} {second}'
        return None


def described(robot: Robot, group: Group, others: Sequence[check.Imported],
              fault: ValueError | None) -> check.Imported:
    """
    Return a mechanism; raise ValueError for loops that are no dyads.

    `fault` is why motors do not determine all of them, if they do not.
    """
    drawing = _drawn(robot, group)
    joints = _joints(drawing) if drawing.drives else []
    if not joints:
        raise NotDriven(_why(drawing))
    name, parameters, mechanism = check.mechanism(
        others, drawing.driven[0].name, 'custom', drawing.lines, drawing.drives, joints,
        frame_id=drawing.ground,
        pose=[float(short(value)) for value in coordinates(drawing.frame)])
    limits, reports = robot.limits(drawing.driven)
    if drawing.left:
        reports.append(f'Left out: {", ".join(drawing.left)}: {fault or _why(drawing)}.')
    for drive in [drive for drive in drawing.drives if drive.source in limits]:
        ends, settings = limits[drive.source], mechanism.inputs[drive.name]
        low, high = _sweep(drive, ends, settings)
        if -scene.MAX_POSITION < low < high - 1e-6 * settings.input.size < scene.MAX_POSITION:
            parameters[f'{name}.{drive.name}.sweep'] = [low, high]
        else:
            reports.append(f'Left out: the limits of {drive.source}, from {ends[0]:.4g} to '
                           f'{ends[1]:.4g}: its loops do not reach them.')
    slack = drawing.inclination + drawing.opening / drawing.size
    if slack > EXACT:
        reports.append('Warning: the file is not exact: axes lean by '
                       f'{drawing.inclination:.2g} rad, and loops stay open '
                       f'by {drawing.opening:.2g} m; so is what is published.')
    driven = [joint.name for joint in drawing.driven]
    return check.Imported(name, parameters, reports, driven, slack)


def _sweep(drive: check.Source, limits: tuple[float, float], settings: scene.InputSettings
           ) -> tuple[float, float]:
    """Return the limits of an input within its reach, no range if they are apart."""
    low, high = (float(short(drive.ratio * end + drive.offset, 1e-15))
                 for end in limits[::1 if drive.ratio > 0.0 else -1])
    for start, end in () if settings.input.is_whole(settings.reach) else settings.reach:
        turns = math.tau * math.floor((drive.value - start) / math.tau) * settings.input.is_angle
        if start + turns <= drive.value <= end + turns:
            # An end that is a dead point is not quite reached.
            edge = ROUNDING * (end - start)
            low, high = max(low, start + turns + edge), min(high, end + turns - edge)
    return low, high


def _drawn(robot: Robot, group: Group) -> Drawing:
    """Return the lines of loops, with the inputs that place the most bodies."""
    names = [joint.name for joint in group.joints if joint.position is not None]
    motors = [name for name in names if name in robot.driven]
    followers = [name for name in names if name in motors + robot.followers(names)]
    tries: list[tuple[Sequence[str], str]] = [(motors, group.ground), (followers, group.ground)]
    if not robot.driven:
        tries += (([name], group.ground) for name in names)
    # Angles between bodies are the same in the frame of a body that a motor moves.
    tries += ((motors, body) for joint in group.joints if joint.name in motors
              for body in joint.bodies if body != group.ground)
    drawings: list[Drawing] = []
    for drives, ground in tries:
        drawings.append(Drawing(robot, group._replace(ground=ground), drives))
        if not drawings[-1].left:
            break
    best = min(drawings, key=lambda drawing: len(drawing.left))
    for i, line in enumerate(best.lines if best.drives else ()):
        # With a change point, the side in this pose may be the wrong one.
        name, *_, side = line.split()
        if side in _OTHER and not best.error(best.lines, name) <= best.near:
            other = [*best.lines]
            other[i] = line[:-len(side)] + _OTHER[side]
            best.lines = min(best.lines, other, key=lambda lines: best.error(lines, name))
    return best


def _why(drawing: Drawing) -> str:
    """Return why bodies are left."""
    if not drawing.left:
        return 'no passive joint of it has a position that moves'
    holders = [joint for joint in drawing.joints if {*joint.bodies} & {*drawing.left}]
    freedom = 3 * len(drawing.left) - 2 * len(holders) - sum(
        joint in drawing.driven for joint in holders)
    if freedom < 0:
        return 'held more than once by ' + ', '.join(
            joint.name for joint in holders if joint.position is not None)
    return (f'not of dyads: {", ".join(drawing.left)} hold each other, as on a platform on three '
            'bars (an Assur group of class III or higher)')


def _joints(drawing: Drawing) -> list[tuple[str, float, str, float]]:
    """Return the link, the sign, the name and the position of each joint that links measure."""
    measured = []
    read = {joint.name for joint in drawing.driven} | {drive.source for drive in drawing.drives}
    for joint in [joint for joint in drawing.joints if drawing.parts.keys() >= {*joint.bodies}]:
        with suppress(ValueError):
            if joint.position is not None and joint.name not in read:
                measured.append((joint, *drawing.measured_by(joint)))
    links = {link.name: link for link in mechanisms.create('custom', joints=drawing.lines).links}
    joints = []
    for joint, link, sign, angle in measured:
        if links[link].kind != 'prismatic':
            angle = math.remainder(angle - float(np.asarray(links[link].zero)), math.tau)
        joints.append((link, sign, joint.name, joint.start - sign * angle))
    return joints
