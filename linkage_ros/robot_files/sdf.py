# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Robots in SDF: http://sdformat.org/spec, and its tutorials on poses and on joint axes."""

from __future__ import annotations

import math
from typing import Any, Iterable, Iterator, Sequence
from xml.etree.ElementTree import Element

import numpy as np

from ..cli import RequestError
from ..robot_model.robot import at, FIXED, MAX_NUMBER, pose, Robot, turned_by
from ..words import join_names


def once(parts: Iterable[tuple[str, Element]]) -> dict[str, Element]:
    """Return parts by name; raise RequestError if two have the same name."""
    named: dict[str, Element] = {}
    for name, part in parts:
        if named.setdefault(name, part) is not part:
            raise RequestError(f'there are two of <{part.tag}> for {name!r}, which may have one')
    return named


def attribute(part: Element, tag: str, key: str, otherwise: str = '') -> str:
    """Return an attribute of an element in a part."""
    element = part.find(tag)
    return otherwise if element is None else element.get(key, otherwise)


def text(part: Element, tag: str, otherwise: str = '') -> str:
    """Return the text of an element in a part."""
    return (part.findtext(tag) or otherwise).strip()


def numbers(values: str | Sequence[Any], count: int = 3) -> np.ndarray:
    """Return the numbers of a text or a list; raise ValueError if they are not `count`."""
    array = np.array(values.split() if isinstance(values, str) else values, float)
    if array.shape != (count,) or not np.all(np.abs(array) < MAX_NUMBER):
        raise ValueError(f'{values!r} must be {count} numbers within {MAX_NUMBER:g}')
    return array


def obey(robot: Robot, model: Element, name: str = '') -> None:
    """Fix links of a model's DetachableJoint to each other, and note what plugins drive."""
    for plugin in model.findall('plugin'):
        kind = f'{plugin.get("name")} {plugin.get("filename")}'.lower()
        if 'detachable' in kind:
            parent, child = (_within(name, text(plugin, tag))
                             for tag in ('parent_link', 'child_link'))
            robot.join(f'{parent}={child}', FIXED, (parent, child), robot.frames[parent])
        if 'state' not in kind:
            robot.driven += [_within(name, (joint.text or '').strip())
                             for joint in plugin.findall('joint_name')]


def read(root: Element) -> Robot:
    """Return the robot of the model with joints."""
    # Up to version 1.4 axes are in the model's frame.
    is_old = tuple(map(int, root.get('version', '1.12').split('.'))) <= (1, 4)
    models = [(model.get('name', ''), parts)
              for model in (*root.findall('model'), *root.findall('world/model'))
              for parts in [[*_parts(model, '')]] if any(part.tag == 'joint' for _, part in parts)]
    if len(models) != 1:
        raise RequestError('one model of an SDF must have joints, not '
                           + join_names(name for name, _ in models))
    return _Model(once(models[0][1]), is_old, {'world': np.eye(4)}).robot()


def join(robot: Robot, joints: Iterable[Element]) -> None:
    """Add the joints of an SDF to a robot that has their links."""
    named = [(joint.get('name', ''), joint) for joint in joints]
    links = [(name, Element('link')) for name in robot.frames]
    model = _Model(once([*links, *named]), False, {'': np.eye(4), **robot.frames})
    for name, joint in named:
        model.join(robot, name, joint, model.ends(name, joint))


def _within(model: str, name: str) -> str:
    """Return the full name of a part of a model, or of itself; that of the whole robot is ''."""
    return f'{model}::{name}'.removesuffix('::__model__').lstrip(':')


def _parts(model: Element, name: str) -> Iterator[tuple[str, Element]]:
    """Yield the parts of a model and of the models in it, with their full names."""
    if model.find('include') is not None or model.get('placement_frame'):
        raise RequestError(f'the model {model.get("name")} has an include or a placement_frame, '
                           'which are not read: write the content, and a pose, in their place')
    yield name, model
    for part in model:
        inner = _within(name, part.get('name', ''))
        if part.tag == 'model':
            yield from _parts(part, inner)
        elif part.tag in ('link', 'joint', 'frame'):
            yield inner, part


class _Model:
    """Frames of a model's parts; a name is relative to the model in which it stands."""

    def __init__(self, parts: dict[str, Element], is_old: bool, known: dict[str, np.ndarray]):
        self._parts, self._is_old, self._known = parts, is_old, known

    def robot(self) -> Robot:
        """Return the robot of the model."""
        links = [name for name, part in self._parts.items() if part.tag == 'link']
        joints = {name: part for name, part in self._parts.items() if part.tag == 'joint'}
        ends = {name: self.ends(name, part) for name, part in joints.items()}
        children = {child for _, child in ends.values()}
        bodies = ['world'] * any('world' in pair for pair in ends.values()) + sorted(
            links, key=children.__contains__)
        robot = Robot(bodies[0], {name: self.frame(name) for name in bodies})
        for name, part in joints.items():
            self.join(robot, name, part, ends[name], 0.0)
        for name, part in self._parts.items():
            obey(robot, part, name)
        return robot

    def named(self, where: str, name: str, is_model: bool = False) -> str:
        """Return the full name of an element by its name in a part."""
        scope = where if is_model else where.rpartition('::')[0]
        if name == 'world':
            return name
        full = _within(scope, name)
        if full not in self._parts:
            raise RequestError(f'{where or "the model"} names {name!r}, which is not there')
        return full

    def ends(self, name: str, joint: Element) -> tuple[str, str]:
        """Return the links that a joint joins."""
        return self.link(name, text(joint, 'parent')), self.link(name, text(joint, 'child'))

    def link(self, where: str, name: str, is_model: bool = False) -> str:
        """Return the link that a frame is on, by the frame's name in a part."""
        name = self.named(where, name, is_model)
        part = self._parts.get(name)
        if part is None or part.tag == 'link':
            return name
        if part.tag == 'model':
            first = next((inner for tag in ('link', 'model') for inner in part.findall(tag)), part)
            return self.link(name, part.get('canonical_link', first.get('name', '')), True)
        return self.link(name, part.get('attached_to') or text(part, 'child', '__model__'))

    def frame(self, name: str) -> np.ndarray:
        """Return the pose of a part."""
        if name not in self._known:
            part = self._parts[name]
            seen = attribute(part, 'pose', 'relative_to') or part.get('attached_to') or text(
                part, 'child')
            base = self.named(name, seen or '__model__') if name else 'world'
            self._known[name] = self.frame(base) @ _pose(part)
        return self._known[name]

    def join(self, robot: Robot, name: str, part: Element, ends: tuple[str, str],
             position: float | None = None) -> None:
        """Add a joint to a robot."""
        second = part.find('axis2')
        robot.join(name, part.get('type', ''), ends, self.frame(name),
                   self._axis(name, part.find('axis')), None, position,
                   [text(part, f'axis/limit/{end}', otherwise) for end, otherwise in (
                       ('lower', '-inf'), ('upper', 'inf'))],
                   None if second is None else self._axis(name, second))
        mimic = part.find('axis/mimic')
        if mimic is not None:
            ratio, start, offset = numbers([text(mimic, *query) for query in (
                ('multiplier', '1'), ('reference', '0'), ('offset', '0'))])
            robot.follow(name, self.named(name, mimic.get('joint', '')), ratio,
                         offset - ratio * start)

    def _axis(self, name: str, axis: Element | None) -> np.ndarray:
        """Return an axis as the joint's frame has it."""
        axis = Element('axis') if axis is None else axis
        seen, way = attribute(axis, 'xyz', 'expressed_in'), numbers(text(axis, 'xyz', '0 0 1'))
        of_model = text(axis, 'use_parent_model_frame', str(self._is_old).lower())
        if not seen and of_model not in ('1', 'true'):
            return way
        base = self.named(name, seen) if seen else name.rpartition('::')[0]
        return self.frame(name)[:3, :3].T @ self.frame(base)[:3, :3] @ way


def _pose(part: Element) -> np.ndarray:
    values = text(part, 'pose', '0 0 0 0 0 0')
    if attribute(part, 'pose', 'rotation_format') == 'quat_xyzw':
        *place, x, y, z, w = numbers(values, 7)
        return at(place, turned_by((w, x, y, z)))
    unit = math.pi / 180.0 if attribute(part, 'pose', 'degrees') in ('1', 'true') else 1.0
    return pose(*numbers(values, 6) * [1.0, 1.0, 1.0, unit, unit, unit])
