# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Robots as their files describe them: bodies, and the joints between them, in one pose."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Dict, List, Mapping, Optional, Tuple
import xml.etree.ElementTree as ElementTree

import numpy as np

from ..command import RequestError

HINGE, SLIDE, BALL, FIXED = 'hinge', 'slide', 'ball', 'fixed'
KINDS = {'revolute': HINGE, 'continuous': HINGE, 'hinge': HINGE, 'prismatic': SLIDE,
         'ball': BALL, 'spherical': BALL, 'fixed': FIXED}


@dataclass
class Joint:
    """
    What joins two bodies, seen in the world in the file's pose.

    Its place is given on the parent and on the child, which differ where a loop is open. Only a
    joint that a message can name has a position.
    """

    name: str
    kind: str
    parent: str
    child: str
    places: Tuple[np.ndarray, np.ndarray]
    axis: np.ndarray
    position: Optional[float] = None
    limits: Optional[Tuple[float, float]] = None


@dataclass
class Robot:
    """Bodies with their frames, joints, which of them motors move, and which follow others."""

    name: str
    root: str
    frames: Dict[str, np.ndarray] = field(default_factory=dict)
    joints: List[Joint] = field(default_factory=list)
    driven: List[str] = field(default_factory=list)
    follows: Dict[str, Tuple[str, float, float]] = field(default_factory=dict)

    def join(self, name: str, kind: str, ends: Tuple[str, str], frames: Tuple[Any, Any],
             axis: Any = (0.0, 0.0, 1.0), **more: Any) -> None:
        """Add a joint by its frame on each body; the axis is seen from that of the parent."""
        for end in ends:
            if end not in self.frames:
                raise RequestError(f'joint {name} is on {end!r}, which is no link of {self.name}')
        if not np.linalg.norm(axis):
            raise RequestError(f'joint {name} has an axis of no length')
        first, second = frames
        axis = first[:3, :3] @ np.asarray(axis) / np.linalg.norm(axis)
        self.joints.append(Joint(name, kind, *ends, (first[:3, 3], second[:3, 3]), axis, **more))


def read(path: str, loops: Optional[str], at: Mapping[str, float]) -> Robot:
    """Return the robot in a file, its joints at given positions; raise RequestError if none."""
    try:
        root = ElementTree.parse(path).getroot()
        if root.tag != 'robot' and loops:
            raise RequestError(f'{path} has its loops in itself; --loops is for URDF')
        if root.tag == 'mujoco':
            return _mjcf(path, at)
        if root.tag == 'sdf':
            return _sdf(root)
        if root.tag == 'robot':
            return _urdf(root, _yaml(loops) if loops else {}, at)
    except ElementTree.ParseError as error:
        raise RequestError(f'{path} is no XML: {error}') from None
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise RequestError(f'{path} cannot be read: {error!r}') from None
    raise RequestError(f'{path} is a <{root.tag}>, but must be MJCF, SDF or URDF')


def _yaml(path: str) -> Mapping[str, Any]:
    import yaml

    try:
        with open(path) as file:
            found = yaml.safe_load(file)
    except yaml.YAMLError as error:
        raise RequestError(f'{path} is no YAML: {error}') from None
    if not isinstance(found, dict) or not {'closures', 'closed_loop'} & found.keys():
        raise RequestError(f'{path} must have "closures" or "closed_loop"')
    return found


def _mjcf(path: str, at: Mapping[str, float]) -> Robot:
    import mujoco as mj

    try:
        model = mj.MjModel.from_xml_path(path)
    except ValueError as error:
        raise RequestError(f'{path}: {error}') from None
    data = mj.MjData(model)
    data.qpos[:] = model.key_qpos[0] if model.nkey else model.qpos0
    for name, value in at.items():
        data.qpos[model.joint(name).qposadr[0]] = value
    mj.mj_kinematics(model, data)
    bodies = [model.body(i).name or f'body{i}' for i in range(model.nbody)]
    names = [model.joint(i).name or f'{bodies[model.jnt_bodyid[i]]}_joint{i}'
             for i in range(model.njnt)]
    robot = Robot(model.names[:model.names.index(b'\0')].decode() or 'robot', bodies[0])
    for i, body in enumerate(bodies):
        robot.frames[body] = _frame(data.xpos[i], data.xmat[i].reshape(3, 3))
    kinds = {int(mj.mjtJoint.mjJNT_HINGE): HINGE, int(mj.mjtJoint.mjJNT_SLIDE): SLIDE,
             int(mj.mjtJoint.mjJNT_BALL): BALL}
    for i, body in list(enumerate(bodies))[1:]:
        above = bodies[model.body_parentid[i]]
        joints = range(model.body_jntadr[i], model.body_jntadr[i] + model.body_jntnum[i])
        if not joints:
            robot.join(f'{body}_weld', FIXED, (above, body), (robot.frames[body],) * 2)
        for j in joints:
            # Between several joints of one body there are bodies without a name.
            child = body if j == joints[-1] else f'{body}/{names[j]}'
            robot.frames.setdefault(child, robot.frames[body])
            kind = kinds.get(int(model.jnt_type[j]), 'free')
            limits = tuple(map(float, model.jnt_range[j])) if model.jnt_limited[j] else None
            robot.join(names[j], kind, (above, child), (_frame(data.xanchor[j]),) * 2,
                       data.xaxis[j] if kind in (HINGE, SLIDE) else (0.0, 0.0, 1.0), limits=limits,
                       position=float(data.qpos[model.jnt_qposadr[j]]))
            above = child
    for i in range(model.neq):
        _equality(mj, model, data, robot, names, i)
    for i in range(model.nu):
        target = int(model.actuator_trnid[i, 0])
        way = mj.mjtTrn(model.actuator_trntype[i])
        if way == mj.mjtTrn.mjTRN_TENDON:
            wraps = range(model.tendon_adr[target],
                          model.tendon_adr[target] + model.tendon_num[target])
            robot.driven += [names[model.wrap_objid[w]] for w in wraps
                             if mj.mjtWrap(model.wrap_type[w]) == mj.mjtWrap.mjWRAP_JOINT]
        elif way in (mj.mjtTrn.mjTRN_JOINT, mj.mjtTrn.mjTRN_JOINTINPARENT):
            robot.driven.append(names[target])
    return robot


def _equality(mj: Any, model: Any, data: Any, robot: Robot, names: List[str], i: int) -> None:
    """Add what an equality of MJCF ties together."""
    kind, ids, given = mj.mjtEq(model.eq_type[i]), (model.eq_obj1id[i], model.eq_obj2id[i]), model.eq_data[i]
    if not model.eq_active0[i]:
        return
    if kind == mj.mjtEq.mjEQ_JOINT and ids[1] >= 0 and not np.any(given[2:5]):
        robot.follows[names[ids[0]]] = names[ids[1]], float(given[1]), float(given[0])
    if kind not in (mj.mjtEq.mjEQ_CONNECT, mj.mjtEq.mjEQ_WELD):
        return
    bodies, places = ids, [given[:3], given[3:6]]
    if mj.mjtObj(model.eq_objtype[i]) == mj.mjtObj.mjOBJ_SITE:
        bodies = [model.site_bodyid[k] for k in ids]
        places = [model.site_pos[k] for k in ids]
    ends = [list(robot.frames)[0] if k == 0 else model.body(int(k)).name or f'body{k}'
            for k in bodies]
    robot.join(model.equality(i).name or f'equality {i}',
               BALL if kind == mj.mjtEq.mjEQ_CONNECT else FIXED, (ends[0], ends[1]),
               tuple(robot.frames[end] @ _frame(place) for end, place in zip(ends, places)))


def _sdf(root: ElementTree.Element) -> Robot:
    models = [model for model in root.iter('model') if model.find('joint') is not None]
    if not models:
        raise RequestError('the SDF has no model with joints')
    model = models[0]
    if model.find('model') is not None or model.find('include') is not None:
        raise RequestError(f'model {model.get("name")} has models in it, which are not read')
    parts = {part.get('name', ''): part for tag in ('link', 'joint', 'frame')
             for part in model.findall(tag)}
    links = [link.get('name', '') for link in model.findall('link')]

    def frame(name: str) -> np.ndarray:
        if name in ('', 'world', '__model__'):
            return np.eye(4)
        part = parts[name]
        pose = part.find('pose')
        base = pose.get('relative_to', '') if pose is not None else ''
        if not base and part.tag == 'joint':
            base = str(part.findtext('child')).strip()
        return frame(base or part.get('attached_to', '')) @ _pose(
            pose.text if pose is not None else None)

    def body(name: Optional[str]) -> str:
        part = parts.get((name or '').strip())
        if part is None or part.tag == 'link':
            return (name or '').strip()
        return body(part.get('attached_to') if part.tag == 'frame' else part.findtext('child'))

    ends = [(joint, body(joint.findtext('parent')), body(joint.findtext('child')))
            for joint in model.findall('joint')]
    held = [parent for _, parent, _ in ends]
    base = 'world' if 'world' in held else next(
        (link for link in links if link not in [child for _, _, child in ends]), links[0])
    robot = Robot(model.get('name') or 'robot', base,
                  {name: frame(name) for name in dict.fromkeys((base, *links))})
    for joint, parent, child in ends:
        name, axis = joint.get('name', ''), joint.find('axis')
        seen = axis.find('xyz') if axis is not None else None
        own = frame(name)
        vector = own[:3, :3] @ _numbers(seen.text if seen is not None else None, '0 0 1')
        if seen is not None and seen.get('expressed_in'):
            vector = frame(str(seen.get('expressed_in')))[:3, :3] @ _numbers(seen.text, '0 0 1')
        limit = axis.find('limit') if axis is not None else None
        robot.join(name, KINDS.get(joint.get('type', ''), joint.get('type', '')), (parent, child),
                   (_frame(own[:3, 3]),) * 2, vector, position=0.0, limits=None if limit is None
                   else _limits(limit.findtext('lower'), limit.findtext('upper')))
    robot.driven = [str(name.text).strip() for plugin in model.findall('plugin')
                    for name in plugin.iter('joint_name')]
    return robot


def _urdf(root: ElementTree.Element, loops: Mapping[str, Any], at: Mapping[str, float]) -> Robot:
    links = [link.get('name', '') for link in root.findall('link')]
    joints = {_end(joint, 'child'): joint for joint in root.findall('joint')}
    tops = [link for link in links if link not in joints]
    robot = Robot(root.get('name') or 'robot', tops[0] if tops else '')
    if len(tops) != 1:
        raise RequestError(f'{robot.name} must have one root link, not {len(tops)}')

    def motion(joint: ElementTree.Element) -> np.ndarray:
        kind, value = KINDS.get(joint.get('type', '')), at.get(joint.get('name', ''), 0.0)
        axis = _vector(joint, 'axis', '1 0 0')
        if kind == SLIDE:
            return _frame(axis / np.linalg.norm(axis) * value)
        return _frame((0.0, 0.0, 0.0), _turned(axis, value) if kind == HINGE else np.eye(3))

    def frame(link: str) -> np.ndarray:
        if link not in robot.frames:
            joint = joints.get(link)
            robot.frames[link] = np.eye(4) if joint is None else (
                frame(_end(joint, 'parent')) @ _origin(joint.find('origin')) @ motion(joint))
        return robot.frames[link]

    for link in links:
        frame(link)
    for child, joint in joints.items():
        name, limit, parent = joint.get('name', ''), joint.find('limit'), _end(joint, 'parent')
        own = robot.frames[parent] @ _origin(joint.find('origin'))
        where = own[:3, 3] if KINDS.get(joint.get('type', '')) == HINGE else (
            robot.frames[child][:3, 3])
        robot.join(name, KINDS.get(joint.get('type', ''), joint.get('type', '')), (parent, child),
                   (_frame(where, own[:3, :3]),) * 2, _vector(joint, 'axis', '1 0 0'),
                   position=at.get(name, 0.0), limits=None if limit is None else
                   _limits(limit.get('lower'), limit.get('upper')))
        if (mimic := joint.find('mimic')) is not None:
            robot.follows[name] = (mimic.get('joint', ''), float(mimic.get('multiplier', 1.0)),
                                   float(mimic.get('offset', 0.0)))
    for cut in (*root.findall('constraint'), *root.findall('loop_joint')):
        ends = _end(cut, 'parent'), _end(cut, 'child')
        frames = (robot.frames[ends[0]] @ _origin(cut.find('parent_origin')),
                  robot.frames[ends[1]] @ _origin(cut.find('child_origin')))
        tag = 'axis' if cut.find('parent_axis') is None else 'parent_axis'
        robot.join(cut.get('name', ''), KINDS.get(cut.get('type', ''), cut.get('type', '')), ends,
                   frames, _vector(cut, tag, '0 0 1'))
    _add_loops(robot, loops)
    robot.driven = [*loops.get('independent', ()), *loops.get('name_mot', ()), *(
        joint.get('name', '') for way in ('transmission', 'ros2_control')
        for part in root.findall(way) for joint in part.findall('joint')
        if way == 'transmission' or joint.find('command_interface') is not None)]
    return robot


def _add_loops(robot: Robot, loops: Mapping[str, Any]) -> None:
    """Add the joints of a file beside the URDF, in either form."""
    for i, closure in enumerate(loops.get('closures', ())):
        # A point and an axis in the root link, all joints at zero: a tree closed there.
        robot.join(f'closure {i + 1}', HINGE, (closure['link_a'], closure['link_b']),
                   (_frame(closure['point']),) * 2, closure['axis'])
    for (first, second), kind in zip(loops.get('closed_loop', ()), loops.get('type', ())):
        robot.join(f'{first}={second}', FIXED if str(kind).lower() == '6d' else BALL,
                   (first, second), (robot.frames[first], robot.frames[second]))


def _end(joint: ElementTree.Element, tag: str) -> str:
    end = joint.find(tag)
    if end is None:
        raise RequestError(f'joint {joint.get("name")} has no {tag}')
    return end.get('link', '')


def _numbers(text: Optional[str], otherwise: str) -> np.ndarray:
    return np.array([float(part) for part in (text or otherwise).split()])


def _vector(part: ElementTree.Element, tag: str, otherwise: str) -> np.ndarray:
    found = part.find(tag)
    return _numbers(found.get('xyz') if found is not None else None, otherwise)


def _limits(low: Optional[str], high: Optional[str]) -> Optional[Tuple[float, float]]:
    return (float(low), float(high)) if low and high and float(low) < float(high) else None


def _frame(place: Any, turned: Any = None) -> np.ndarray:
    made = np.eye(4)
    made[:3, 3] = place
    if turned is not None:
        made[:3, :3] = turned
    return made


def _origin(part: Optional[ElementTree.Element]) -> np.ndarray:
    if part is None:
        return np.eye(4)
    return _pose(f'{part.get("xyz", "0 0 0")} {part.get("rpy", "0 0 0")}')


def _pose(text: Optional[str]) -> np.ndarray:
    x, y, z, roll, pitch, yaw = _numbers(text, '0 0 0 0 0 0')
    return _frame((x, y, z), _turned((0, 0, 1), yaw) @ _turned((0, 1, 0), pitch)
                  @ _turned((1, 0, 0), roll))


def _turned(axis: Any, angle: float) -> np.ndarray:
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across
