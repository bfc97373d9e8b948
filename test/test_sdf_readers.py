# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Random robots in SDF: their frames and axes are known before they are written in one of many ways.

Source of what each way means: the SDFormat specification (sdformat.org/spec) and its proposals on
pose frame semantics, nested models, `expressed_in`, `degrees` and `mimic`.
"""

from itertools import count
import math
from xml.sax.saxutils import quoteattr

from linkage_ros.robot_files import readers
import numpy as np
import pytest
from robots import turned, words

VERSIONS = '1.4', '1.5', '1.6', '1.7', '1.9', '1.11'


def frame(rng):
    """Return a random pose."""
    return turned(*rng.normal(size=3), *rng.uniform(-math.pi, math.pi, 3))


def euler(turned):
    """Return roll, pitch, yaw about fixed axes."""
    return (math.atan2(turned[2, 1], turned[2, 2]), -math.asin(turned[2, 0]),
            math.atan2(turned[1, 0], turned[0, 0]))


def quaternion(turned):
    """Return x, y, z, w: the axis that a matrix leaves as it is, and half its angle."""
    values, ways = np.linalg.eig(turned)
    axis = ways[:, np.argmin(np.abs(values - 1.0))].real
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    angle = math.atan2(axis @ np.cross(across, turned @ across), across @ (turned @ across))
    return *(axis * math.sin(0.5 * angle)), math.cos(0.5 * angle)


class Writer:
    """
    Writes a model of links whose poses are known.

    Attributes
    ----------
    links : dict
        Where each link is, by its whole name.
    axes, places : dict
        Of each joint its axis and its place.
    follows : dict
        Of joints that follow another: that, the multiplier, the offset and the reference.
    main : dict
        The link that each model stands for.

    """

    def __init__(self, rng, version):
        self.rng = rng
        self.numbers = count()
        self.links, self.axes, self.places, self.bodies, self.follows, self.main = (
            {} for _ in range(6))
        text = self.model('', 'robot', frame(rng), version, 2, np.eye(4))
        text = f'<world name="w">{text}</world>' if rng.random() < 0.5 else text
        self.text = f'<?xml version="1.0"?><sdf version="{version}">{text}</sdf>'

    def pose(self, at, base, version, known=(), relative=True):
        """Return a pose in one of the ways of a version; the frames in `known` may be said."""
        said = ''
        if known and relative and version >= (1, 7) and self.rng.random() < 0.6:
            name = list(known)[self.rng.integers(len(known))]
            base, said = known[name], f' relative_to={quoteattr(name)}'
        seen = np.linalg.inv(base) @ at
        way = self.rng.integers(3) if version >= (1, 9) else 0
        if way == 1:
            return (f'<pose{said} rotation_format="quat_xyzw">'
                    f'{words([*seen[:3, 3], *quaternion(seen[:3, :3])])}</pose>')
        angles = np.degrees(euler(seen[:3, :3])) if way else euler(seen[:3, :3])
        said += ' degrees="true"' * bool(way)
        return f'<pose{said}>{words([*seen[:3, 3], *angles])}</pose>'

    def model(self, scope, name, at, version, depth, base, known=()):
        """Return a model and note what is in it."""
        number = tuple(map(int, version.split('.')))
        rng, inner = self.rng, f'{scope}::{name}'.lstrip(':') if depth < 2 else ''

        def whole(one):
            return f'{inner}::{one}'.lstrip(':')

        here, bodies = {'__model__': at}, {}
        is_nested = depth and number >= (1, 7)
        parts = [self.pose(at, base, number, known)]
        for _ in range(rng.integers(0 if depth == 1 and is_nested else 2, 5)):
            link = f'link {next(self.numbers)}'
            there = frame(rng)
            parts.append(f'<link name="{link}">{self.pose(there, at, number, here)}</link>')
            here[link] = self.links[whole(link)] = there
            bodies[link] = whole(link)
        # A model stands for the link that it names, its first one, or that of its first model.
        main, said = next(iter(bodies), ''), ''
        if main and is_nested and rng.random() < 0.5:
            main = [*bodies][rng.integers(len(bodies))]
            said = f' canonical_link="{main}"'
        if is_nested:
            child = f'inner {next(self.numbers)}'
            there = frame(rng)
            parts.insert(1, self.model(inner, child, there, version, depth - 1, at, here))
            inside = [link[len(whole('')):] for link in self.links
                      if link.startswith(whole(child))]
            here.update({link: self.links[whole(link)] for link in inside})
            bodies.update({link: whole(link) for link in inside})
            here[child], bodies[child] = there, self.main[whole(child)]
        bodies['__model__'] = self.main[inner] = bodies[main or child]
        for _ in range(rng.integers(3) if number >= (1, 7) else 0):
            own, there = f'frame-{next(self.numbers)}', frame(rng)
            on = [*here][rng.integers(len(here))] if rng.random() < 0.5 else ''
            attached = f' attached_to="{on}"' if on else ''
            parts.append(f'<frame name="{own}"{attached}>'
                         f'{self.pose(there, here[on] if on else at, number, here)}</frame>')
            here[own], bodies[own] = there, bodies[on or '__model__']
        ends = [*bodies]
        rng.shuffle(ends)
        for parent, child in zip(['world', *ends] if depth == 2 else ends,
                                 ends if depth == 2 else ends[1:]):
            parts.append(self.joint(whole, parent, child, at, here, number, bodies))
        return f'<model name="{name}"{said}>{"".join(parts)}</model>'

    def joint(self, whole, parent, child, at, here, number, bodies):
        """Return a joint of any pose, axis and way to say it."""
        rng, name, there = self.rng, f'joint {next(self.numbers)}', frame(self.rng)
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        seen, said = there, ''
        if number <= (1, 4):
            seen, said = [(at, ''), (there, '<use_parent_model_frame>0</use_parent_model_frame>')][
                rng.integers(2)]
        elif number <= (1, 6) and rng.random() < 0.5:
            seen, said = at, '<use_parent_model_frame>true</use_parent_model_frame>'
        elif number >= (1, 7) and rng.random() < 0.5:
            other = [*here][rng.integers(len(here))]
            seen, said = here[other], quoteattr(other)
        xyz = f'<xyz{" expressed_in=" + said if said[:1] == chr(34) else ""}>' \
              f'{words(seen[:3, :3].T @ axis * rng.uniform(0.5, 2.0))}</xyz>'
        more = said if said[:1] == '<' else ''
        before = [one for one in self.axes if one.startswith(whole('')) and '::' not in one[
            len(whole('')):]]
        if number >= (1, 11) and before and rng.random() < 0.5:
            leader = before[rng.integers(len(before))]
            numbers = rng.normal(size=3).tolist()
            more += (f'<mimic joint="{leader[len(whole("")):]}"><multiplier>{numbers[0]!r}'
                     f'</multiplier><offset>{numbers[1]!r}</offset><reference>{numbers[2]!r}'
                     '</reference></mimic>')
            self.follows[whole(name)] = leader, *numbers
        self.axes[whole(name)], self.places[whole(name)] = axis, there[:3, 3]
        self.bodies[whole(name)] = bodies.get(parent, 'world'), bodies[child]
        kind = 'prismatic' if rng.random() < 0.3 else 'revolute'
        return (f'<joint name="{name}" type="{kind}"><parent>{parent}</parent>'
                f'<child>{child}</child>{self.pose(there, here[child], number, here)}'
                f'<axis>{xyz}{more}</axis></joint>')


@pytest.mark.parametrize('seeds', [
    *([seed] for seed in range(10)), pytest.param(range(10, 1500), marks=pytest.mark.nightly)])
def test_links_are_where_they_were_before_they_were_written(tmp_path, seeds):
    for seed in seeds:
        rng = np.random.default_rng(seed)
        made = Writer(rng, VERSIONS[seed % len(VERSIONS)])
        file = tmp_path / 'robot.sdf'
        file.write_text(made.text)
        robot = readers.read(str(file))
        # A joint that closes a loop moves a body of its own, welded to the other.
        named = [joint for joint in robot.joints if joint.name]
        welds = {joint.bodies[1]: joint.bodies[0] for joint in robot.joints if not joint.name}
        assert {*robot.frames} - {'world', *welds} == {*made.links}
        for name, there in made.links.items():
            assert robot.frames[name] == pytest.approx(there, abs=1e-12), name
        assert {joint.name for joint in named} == {*made.axes}
        for joint in named:
            base, body = joint.bodies
            assert (base, welds.get(body, body)) == made.bodies[joint.name]
            assert joint.axes[0] == pytest.approx(made.axes[joint.name], abs=1e-12), joint.name
            assert joint.places[0] == pytest.approx(made.places[joint.name], abs=1e-12)
        assert robot.follows.keys() == made.follows.keys()
        for name, (leader, ratio, offset, reference) in made.follows.items():
            assert robot.follows[name][0] == leader
            for position in (-1.0, 0.0, 2.0):
                followed = robot.follows[name][1] * position + robot.follows[name][2]
                assert followed == pytest.approx(ratio * (position - reference) + offset)
