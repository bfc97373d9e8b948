# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Robots in SDF: http://sdformat.org/spec, and its tutorials on poses and on joint axes."""

from __future__ import annotations

from functools import lru_cache
import math
from pathlib import Path
from typing import Dict, Iterator, List, Optional, Tuple
from xml.etree.ElementTree import SubElement

import numpy as np

from .elements import attribute, Element, numbers, once, parse, text, turned_by, weld
from ..command import RequestError
from ..robot_model.places import at, pose
from ..robot_model.robot import HINGE, KINDS, Robot, UNIVERSAL


def read(path: str, root: Element) -> Robot:
    """Return the robot of the first model with joints."""
    _make_axes_explicit(root)
    for model in (*root.findall('model'), *root.findall('world/model')):
        parts = [*_parts(model, '', path)]
        if any(part.tag == 'joint' for _, part in parts):
            return _Model(once(parts)).robot()
    raise RequestError('the SDF has no model with joints')


def _make_axes_explicit(root: Element) -> None:
    """Make explicit that up to version 1.4 axes are in the model's frame."""
    if tuple(map(int, root.get('version', '1.12').split('.'))) <= (1, 4):
        for axis in (*root.iter('axis'), *root.iter('axis2')):
            if not text(axis, 'use_parent_model_frame'):
                SubElement(axis, 'use_parent_model_frame').text = '1'


def _parts(model: Element, name: str, path: str) -> Iterator[Tuple[str, Element]]:
    """Yield the parts of a model and of the models in it, with their full names."""
    yield name, model
    for part in model:
        inner = f'{name}::{part.get("name", "")}'.lstrip(':')
        if part.tag == 'model':
            yield from _parts(part, inner, path)
        elif part.tag == 'include':
            yield from _included(part, name, path)
        elif part.tag in ('link', 'joint', 'frame'):
            yield inner, part


def _included(part: Element, name: str, path: str) -> Iterator[Tuple[str, Element]]:
    uri = text(part, 'uri')
    file = Path(path).parent / uri.split('://')[-1]
    file = file / 'model.sdf' if file.is_dir() else file
    if not file.is_file() or part.get('merge') in ('1', 'true'):
        raise RequestError(f'the model includes {uri!r}, which is not read: write it in its place')
    root = parse(str(file))
    _make_axes_explicit(root)
    model = root.find('model')
    if model is None:
        raise RequestError(f'{file} has no model')
    for tag in ('pose', 'placement_frame'):
        if (own := part.find(tag)) is not None:
            for old in model.findall(tag):
                model.remove(old)
            model.append(own)
    yield from _parts(model, f'{name}::{text(part, "name") or model.get("name")}'.lstrip(':'),
                      str(file))


class _Model:
    """Frames of a model's parts; a name is relative to the model in which it stands."""

    def __init__(self, parts: Dict[str, Element]):
        self._parts = parts
        self.frame = lru_cache(None)(self._frame)

    def robot(self) -> Robot:
        """Return the robot of the model."""
        links = [name for name, part in self._parts.items() if part.tag == 'link']
        joints = {name: part for name, part in self._parts.items() if part.tag == 'joint'}
        ends = {name: (self.body(self.named(name, text(part, 'parent'))),
                       self.body(self.named(name, text(part, 'child'))))
                for name, part in joints.items()}
        children = {child for _, child in ends.values()}
        bodies = ['world'] * any('world' in pair for pair in ends.values()) + sorted(
            links, key=children.__contains__)
        robot = Robot(bodies[0], {name: self.frame(name) for name in bodies})
        # A gearbox refers to other joints.
        gears = [name for name, part in joints.items() if part.get('type') == 'gearbox']
        for name in sorted(joints, key=gears.__contains__):
            add = self._gear if name in gears else self._join
            add(robot, name, joints[name], ends[name])
        for model in (part for part in self._parts.values() if part.tag == 'model'):
            for plugin in model.findall('plugin'):
                kind = f'{plugin.get("name")} {plugin.get("filename")}'.lower()
                if 'state' not in kind:
                    robot.driven += [(one.text or '').strip()
                                     for one in plugin.findall('joint_name')]
            weld(robot, model.findall('plugin'))
        return robot

    def named(self, where: str, name: str, is_model: bool = False) -> str:
        """Return the full name of an element by its name in a part."""
        scope = where if is_model else where.rpartition('::')[0]
        if name == 'world':
            return name
        full = scope if name == '__model__' else f'{scope}::{name}'.lstrip(':')
        full = full[:-len('::__model__')] if full.endswith('::__model__') else full
        if full not in self._parts:
            raise RequestError(f'{where or "the model"} names {name!r}, which is not there')
        return full

    def body(self, name: str) -> str:
        """Return the link that a frame is on."""
        if name == 'world' or self._parts[name].tag == 'link':
            return name
        part = self._parts[name]
        if part.tag == 'model':
            first = part.get('canonical_link') or next(
                (one.get('name', '') for one in part if one.tag in ('link', 'model')), '')
            return self.body(self.named(name, first, True))
        return self.body(self.named(name, part.get('attached_to') or text(
            part, 'child', '__model__')))

    def _frame(self, name: str) -> np.ndarray:
        if name == 'world':
            return np.eye(4)
        part = self._parts[name]
        seen = attribute(part, 'pose', 'relative_to') or part.get('attached_to') or text(
            part, 'child')
        base = self.named(name, seen or '__model__') if name else 'world'
        made = self.frame(base) @ _pose(part.find('pose'))
        placed = part.get('placement_frame') or text(part, 'placement_frame')
        if part.tag != 'model' or not placed:
            return made
        raise RequestError(f'the model {name or part.get("name")} has a placement_frame, '
                           'which is not read: give it a pose of its own')

    def _join(self, robot: Robot, name: str, part: Element, ends: Tuple[str, str]) -> None:
        kind, second = part.get('type', ''), None
        if KINDS.get(kind, kind) == UNIVERSAL:
            second = self._axis(name, part.find('axis2'))
        robot.join(name, kind, ends, self.frame(name), self._axis(name, part.find('axis')), None,
                   0.0, [text(part, f'axis/limit/{end}', otherwise) for end, otherwise in (
                       ('lower', '-inf'), ('upper', 'inf'))], second)
        mimic = part.find('axis/mimic')
        if mimic is not None:
            ratio, start, offset = (float(text(mimic, tag, otherwise)) for tag, otherwise in (
                ('multiplier', '1'), ('reference', '0'), ('offset', '0')))
            robot.follow(name, self.named(name, mimic.get('joint', '')), ratio,
                         offset - ratio * start)

    def _axis(self, name: str, axis: Optional[Element]) -> np.ndarray:
        """Return an axis as the joint's frame has it."""
        if axis is None:
            return np.array([0.0, 0.0, 1.0])
        way, turned = numbers(text(axis, 'xyz', '0 0 1')), self.frame(name)[:3, :3]
        if seen := attribute(axis, 'xyz', 'expressed_in'):
            return turned.T @ self.frame(self.named(name, seen))[:3, :3] @ way
        if text(axis, 'use_parent_model_frame') in ('1', 'true'):
            return turned.T @ self.frame(name.rpartition('::')[0])[:3, :3] @ way
        return way

    def _gear(self, robot: Robot, name: str, part: Element, ends: Tuple[str, str]) -> None:
        """Make the second of two hinges on one body depend on the first."""
        body = self.body(self.named(name, text(part, 'gearbox_reference_body')))
        turns: List[Tuple[str, float]] = []
        for end, tag in zip(ends, ('axis', 'axis2')):
            joint = next((each for each in robot.joints if each.kind == HINGE
                          and {*each.bodies} == {body, end}), None)
            if joint is None:
                raise RequestError(f'gearbox {name} turns {end} against {body}, on no joint')
            axis = self.frame(name)[:3, :3] @ self._axis(name, part.find(tag))
            turns.append((joint.name, math.copysign(1.0, axis @ joint.motion(end))))
        (first, sign), (second, other) = turns
        ratio = float(text(part, 'gearbox_ratio', '1'))
        robot.follow(second, first, -ratio * sign * other, 0.0)


def _pose(part: Optional[Element]) -> np.ndarray:
    text = (part.text or '').strip() if part is not None else ''
    if part is None or not text:
        return np.eye(4)
    if part.get('rotation_format') == 'quat_xyzw':
        x, y, z, *turn = numbers(text, 7)
        return at((x, y, z), turned_by((turn[3], *turn[:3])))
    unit = math.pi / 180.0 if part.get('degrees') in ('1', 'true') else 1.0
    return pose(*numbers(text, 6) * [1.0, 1.0, 1.0, unit, unit, unit])
