# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Robots as MJCF, SDF and URDF describe them: bodies and joints, all in the pose of the file."""

from __future__ import annotations

from dataclasses import dataclass, field
import math
from typing import Any, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple
import xml.etree.ElementTree as ElementTree

import numpy as np

from ..command import RequestError

HINGE, SLIDE, BALL, FIXED = 'hinge', 'slide', 'ball', 'fixed'
KINDS = {'revolute': HINGE, 'continuous': HINGE, 'prismatic': SLIDE, 'spherical': BALL}
# No robot has parts farther off [m], or limits [m or rad].
FARTHEST = 1e9
Element = ElementTree.Element


@dataclass(eq=False)
class Joint:
    """
    What joins two bodies: its place on each, its axis; with a name, position and limits.

    By its gap its frames on both bodies differ, in place [m] or turn [rad].
    """

    name: str
    kind: str
    bodies: Tuple[str, str]
    places: Any
    axis: Any
    position: Optional[float] = None
    limits: Optional[Tuple[float, float]] = None
    gap: float = 0.0


@dataclass
class Robot:
    """Frames of bodies, joints, which of them motors move, and which are a multiple of others."""

    root: str
    frames: Dict[str, np.ndarray] = field(default_factory=dict)
    joints: List[Joint] = field(default_factory=list)
    driven: List[str] = field(default_factory=list)
    follows: Dict[str, Tuple[str, float, float]] = field(default_factory=dict)

    def join(self, name: str, kind: str, bodies: Tuple[str, str], frame: np.ndarray,
             axis: Any = (0.0, 0.0, 1.0), other: Optional[np.ndarray] = None,
             position: Optional[float] = None, limits: Sequence[Any] = ('', '')) -> None:
        """Add a joint by its frame on the parent, and on the child where that is another."""
        for body in bodies:
            if body not in self.frames:
                raise RequestError(f'joint {name} is on {body!r}, which is no link')
        if position is not None and name in self.positions:
            raise RequestError(f'two joints are called {name!r}')
        kind, size = KINDS.get(kind, kind), np.linalg.norm(axis)
        places = frame[:3, 3], (frame if other is None else other)[:3, 3]
        if not np.all(np.abs((*places, axis)) < FARTHEST):
            raise RequestError(f'joint {name} must be within {FARTHEST:g} m')
        if kind in (HINGE, SLIDE) and not size > 0.0:
            raise RequestError(f'the axis of joint {name} has no length')
        low, high = (float(str(limit) or 'nan') for limit in limits)
        self.joints.append(Joint(
            name, kind, bodies, places, frame[:3, :3] @ axis / (size or 1.0), position,
            (low, high) if -FARTHEST < low < high < FARTHEST else None,
            0.0 if other is None else float(np.linalg.norm(frame - other))))

    def follow(self, name: str, other: str, ratio: float, offset: float) -> None:
        """Have a joint be a multiple of another, plus an offset."""
        if ratio:
            self.follows[name] = other, float(ratio), float(offset)

    @property
    def positions(self) -> Dict[str, float]:
        """The positions of all joints that have a name."""
        return {joint.name: joint.position for joint in self.joints if joint.position is not None}

    def source(self, name: str) -> Tuple[str, float, float]:
        """Return the joint that another follows, if not itself, its ratio and its offset."""
        ratio, offset, passed = 1.0, 0.0, [*self.driven]
        while name in self.follows and name not in passed:
            passed.append(name)
            name, factor, start = self.follows[name]
            ratio, offset = ratio * factor, offset + ratio * start
        if name not in self.positions:
            raise ValueError(f'{passed[-1]} follows {name!r}, which is no joint')
        return name, ratio, offset


def read(path: str, loops: Optional[str] = None) -> Robot:
    """Return the robot in a file; raise RequestError if there is none."""
    try:
        root = ElementTree.parse(path).getroot()
        if root.tag not in ('mujoco', 'sdf', 'robot'):
            raise RequestError(f'{path} must be MJCF, SDF or URDF, not <{root.tag}>')
        if root.tag == 'robot':
            return _urdf(root, _loops(loops) if loops else {})
        if loops:
            raise RequestError(f'{path} has its own loops; --loops is for a URDF')
        return _mjcf(path) if root.tag == 'mujoco' else _sdf(root)
    except ElementTree.ParseError as error:
        raise RequestError(f'{path} is no XML: {error}') from None
    except RecursionError:
        raise RequestError(f'{path} has links or frames that hang on themselves') from None
    except LookupError as error:
        raise RequestError(f'{path} names {error}, which is not there') from None
    except (ValueError, TypeError, AttributeError) as error:
        raise RequestError(f'{path} cannot be read: {error}') from None


def _loops(path: str) -> Mapping[str, Any]:
    import yaml

    try:
        with open(path, encoding='utf-8') as file:
            found = yaml.safe_load(file)
    except yaml.YAMLError as error:
        raise RequestError(f'{path} is no YAML: {error}') from None
    if not isinstance(found, dict) or not {'closures', 'closed_loop'} & found.keys():
        raise RequestError(f'{path} must have closures: or closed_loop:')
    return found


def _mjcf(path: str) -> Robot:
    import mujoco as mj

    # What it warns of, and writes to a file, is dynamics.
    mj.set_mju_user_warning(lambda text: None)
    model = mj.MjModel.from_xml_path(path)
    data = mj.MjData(model)
    data.qpos[:] = model.key_qpos[0] if model.nkey else model.qpos0
    mj.mj_kinematics(model, data)
    bodies = [model.body(i).name or f'body{i}' for i in range(model.nbody)]
    names = [model.joint(i).name or f'joint{i}' for i in range(model.njnt)]
    robot = Robot(bodies[0], {body: _frame(data.xpos[i], data.xmat[i].reshape(3, 3))
                              for i, body in enumerate(bodies)})
    for i, body in list(enumerate(bodies))[1:]:
        above, joints = bodies[model.body_parentid[i]], model.body_jntadr[i] + np.arange(
            model.body_jntnum[i])
        if not joints.size:
            robot.join(body, FIXED, (above, body), robot.frames[body])
        for j in joints:
            # Between several joints of one body there are bodies without a name.
            below = body if j == joints[-1] else f'{body}/{names[j]}'
            robot.frames.setdefault(below, robot.frames[body])
            kind = mj.mjtJoint(model.jnt_type[j]).name[6:].lower()
            one = kind in (HINGE, SLIDE)
            robot.join(names[j], kind, (above, below), _frame(data.xanchor[j]),
                       data.xaxis[j] if one else (0.0, 0.0, 1.0), None,
                       float(data.qpos[model.jnt_qposadr[j]]) if one else None,
                       model.jnt_range[j].tolist() if model.jnt_limited[j] else ('', ''))
            above = below
    for i in np.flatnonzero(model.eq_active0).tolist():
        kind, given = mj.mjtEq(model.eq_type[i]).name[5:].lower(), model.eq_data[i]
        ends, places = [model.eq_obj1id[i], model.eq_obj2id[i]], [given[:3], given[3:6]]
        if kind == 'joint' and ends[1] >= 0 and not given[2:5].any():
            one, other = model.qpos0[model.jnt_qposadr[ends]]
            robot.follow(names[ends[0]], names[ends[1]], given[1],
                         given[0] + one - given[1] * other)
        if kind in ('connect', 'weld'):
            turned = np.zeros((2, 9))
            turns = np.array([[1.0, 0.0, 0.0, 0.0]] * 2)
            if kind == 'weld':
                places, turns[0] = places[::-1], given[6:10]
            if mj.mjtObj(model.eq_objtype[i]) == mj.mjtObj.mjOBJ_SITE:
                places, turns = model.site_pos[ends], model.site_quat[ends]
                ends = model.site_bodyid[ends]
            for quaternion, matrix in zip(turns, turned):
                mj.mju_quat2Mat(matrix, quaternion)
            first, second = (bodies[end] for end in ends)
            one, other = (robot.frames[bodies[end]] @ _frame(place, matrix.reshape(3, 3))
                          for end, place, matrix in zip(ends, places, turned))
            robot.join(model.equality(i).name or f'equality{i}',
                       BALL if kind == 'connect' else FIXED, (first, second), one, other=other)
    for way, target in zip(model.actuator_trntype, model.actuator_trnid[:, 0]):
        kind = mj.mjtTrn(way).name[6:].lower()
        wraps = model.tendon_adr[target] + np.arange(model.tendon_num[target]) \
            if kind == 'tendon' else ()
        robot.driven += [names[target]] * (kind in ('joint', 'jointinparent')) + [
            names[model.wrap_objid[i]] for i in wraps
            if mj.mjtWrap(model.wrap_type[i]) == mj.mjtWrap.mjWRAP_JOINT]
    return robot


def _sdf(root: Element) -> Robot:
    model = next((model for model in root.iter('model') if model.find('joint') is not None), None)
    if model is None:
        raise RequestError('the SDF has no model with joints')
    if model.find('model') is not None or model.find('include') is not None:
        raise RequestError(f'model {model.get("name")} has models in it, which are not read')
    parts = _once((part.get('name', ''), part) for part in model
                  if part.tag in ('link', 'joint', 'frame'))

    def above(name: str) -> str:
        return parts[name].get('attached_to') or _text(parts[name], 'child')

    def frame(name: str) -> np.ndarray:
        if name in ('', 'world', '__model__'):
            return np.eye(4)
        base = _attribute(parts[name], 'pose', 'relative_to') or above(name)
        return frame(base) @ _sdf_pose(parts[name].find('pose'))

    def body(name: str) -> str:
        return name if name not in parts or parts[name].tag == 'link' else body(above(name))

    def is_seen_from_model(axis: Optional[Element]) -> bool:
        # As all axes were up to version 1.4.
        text = _text(axis, 'use_parent_model_frame') if axis is not None else ''
        return text in ('1', 'true') or not text and version <= (1, 4)

    version = tuple(int(part) for part in root.get('version', '1.12').split('.'))
    joints = {name: (body(_text(part, 'parent')), body(_text(part, 'child')))
              for name, part in parts.items() if part.tag == 'joint'}
    parents, children = zip(*joints.values())
    links = [name for name, part in parts.items() if part.tag == 'link']
    bodies = ['world'] * ('world' in parents) + sorted(links, key=children.__contains__)
    robot = Robot(bodies[0], {name: frame(name) for name in bodies})
    for name, ends in joints.items():
        turned, part = frame(name), parts[name]
        axis = _numbers(_text(part, 'axis/xyz', '0 0 1'))
        if seen := _attribute(part, 'axis/xyz', 'expressed_in'):
            axis = turned[:3, :3].T @ frame(seen)[:3, :3] @ axis
        elif is_seen_from_model(part.find('axis')):
            axis = turned[:3, :3].T @ axis
        robot.join(name, part.get('type', ''), ends, turned, axis, None, 0.0,
                   [_text(part, f'axis/limit/{end}') for end in ('lower', 'upper')])
    robot.driven = [str(name.text).strip() for name in model.findall('plugin/joint_name')]
    return robot


def _urdf(root: Element, loops: Mapping[str, Any]) -> Robot:
    links = _once((link.get('name', ''), link) for link in root.findall('link'))
    joints = _once((_attribute(joint, 'child', 'link'), joint) for joint in root.findall('joint'))

    def frame(link: str) -> np.ndarray:
        joint = joints.get(link)
        return np.eye(4) if joint is None else (
            frame(_attribute(joint, 'parent', 'link')) @ _origin(joint, 'origin'))

    tops = [link for link in links if link not in joints]
    if len(tops) != 1:
        raise RequestError(f'a URDF has one root link, not {len(tops)}')
    robot = Robot(tops[0], {link: frame(link) for link in links})
    for child, joint in joints.items():
        name, mimic = joint.get('name', ''), joint.find('mimic')
        robot.join(name, joint.get('type', ''), (_attribute(joint, 'parent', 'link'), child),
                   frame(child), _numbers(_attribute(joint, 'axis', 'xyz', '1 0 0')), None, 0.0,
                   [_attribute(joint, 'limit', end) for end in ('lower', 'upper')])
        if mimic is not None:
            ratio, start = _numbers(f'{mimic.get("multiplier", 1)} {mimic.get("offset", 0)}', 2)
            robot.follow(name, mimic.get('joint', ''), ratio, start)
    for cut in (*root.findall('constraint'), *root.findall('loop_joint')):
        ends = _attribute(cut, 'parent', 'link'), _attribute(cut, 'child', 'link')
        first, second = (robot.frames[end] @ _origin(cut, f'{tag}_origin')
                         for end, tag in zip(ends, ('parent', 'child')))
        axis = _numbers(_attribute(cut, 'parent_axis', 'xyz',
                                   _attribute(cut, 'axis', 'xyz', '0 0 1')))
        robot.join(cut.get('name', ''), cut.get('type', ''), ends, first, axis, second)
    for i, cut in enumerate(loops.get('closures', ())):
        point, axis = (_numbers(' '.join(map(str, cut[key]))) for key in ('point', 'axis'))
        robot.join(f'closures[{i}]', HINGE, (cut['link_a'], cut['link_b']), _frame(point), axis)
    for (first, second), kind in zip(loops.get('closed_loop', ()), loops.get('type', ())):
        robot.join(f'{first}={second}', FIXED if str(kind).lower() == '6d' else BALL,
                   (first, second), robot.frames.get(first, np.eye(4)),
                   other=robot.frames.get(second))
    robot.driven = [*loops.get('independent', ()), *loops.get('name_mot', ()), *(
        joint.get('name', '') for joint in (
            *root.findall('transmission/joint'),
            *root.findall('ros2_control/joint[command_interface]')))]
    return robot


def _once(parts: Iterable[Tuple[str, Element]]) -> Dict[str, Element]:
    """Return parts by name; raise RequestError if two have one name, or one child."""
    found: Dict[str, Element] = {}
    for name, part in parts:
        if found.setdefault(name, part) is not part:
            raise RequestError(f'there are two of <{part.tag}> for {name!r}, which may have one')
    return found


def _attribute(part: Element, tag: str, key: str, otherwise: str = '') -> str:
    found = part.find(tag)
    return otherwise if found is None else found.get(key, otherwise)


def _text(part: Element, tag: str, otherwise: str = '') -> str:
    return (part.findtext(tag) or otherwise).strip()


def _numbers(text: str, count: int = 3) -> np.ndarray:
    found = np.array(text.split(), float)
    if len(found) != count or not np.all(np.abs(found) < FARTHEST):
        raise ValueError(f'{text!r} must be {count} numbers within {FARTHEST:g}')
    return found


def _origin(part: Element, tag: str) -> np.ndarray:
    return _pose(' '.join(_attribute(part, tag, key, '0 0 0') for key in ('xyz', 'rpy')))


def _sdf_pose(pose: Optional[Element]) -> np.ndarray:
    text = (pose.text or '').strip() if pose is not None else ''
    if pose is None or not text:
        return np.eye(4)
    if (form := pose.get('rotation_format', 'euler_rpy')) != 'euler_rpy':
        raise RequestError(f'a pose has the rotation_format {form}, which is not read')
    unit = math.pi / 180.0 if pose.get('degrees') in ('1', 'true') else 1.0
    return _pose(text, unit)


def _pose(text: str, unit: float = 1.0) -> np.ndarray:
    x, y, z, roll, pitch, yaw = _numbers(text, 6)
    angles = np.multiply((roll, pitch, yaw), unit)
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles), np.sin(angles)
    about_z, about_y, about_x = np.array([
        [[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]], [[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]],
        [[1, 0, 0], [0, cr, -sr], [0, sr, cr]]])
    return _frame((x, y, z), about_z @ about_y @ about_x)


def _frame(place: Any, turned: Any = ((1, 0, 0), (0, 1, 0), (0, 0, 1))) -> np.ndarray:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = turned, place
    return made
