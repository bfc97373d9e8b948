# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Robots in MJCF, as MuJoCo reads them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
from mujoco import MjSpec
import numpy as np

from ..robot_model.robot import at, BALL, FIXED, Robot, turned_by


def read(path: str) -> Robot:
    """Return the robot in a file, in the pose of its first keyframe, or at its zero."""
    model = _compiled(path)
    data = mujoco.MjData(model)
    data.qpos[:] = model.key_qpos[0] if model.nkey else model.qpos0
    mujoco.mj_kinematics(model, data)
    bodies = [model.body(i).name or f'body{i}' for i in range(model.nbody)]
    names = [model.joint(i).name or f'joint{i}' for i in range(model.njnt)]
    robot = Robot(bodies[0], {body: at(data.xpos[i], data.xmat[i].reshape(3, 3))
                              for i, body in enumerate(bodies)})
    for i, body in list(enumerate(bodies))[1:]:
        above, joints = bodies[model.body_parentid[i]], model.body_jntadr[i] + np.arange(
            model.body_jntnum[i])
        if not joints.size:
            robot.join(body, FIXED, (above, body), robot.frames[body])
        for j in joints:
            # Several joints of one body have bodies without a name between them.
            below = body if j == joints[-1] else f'{body}/{names[j]}'
            robot.frames.setdefault(below, robot.frames[body])
            robot.join(names[j], mujoco.mjtJoint(model.jnt_type[j]).name[6:].lower(),
                       (above, below), at(data.xanchor[j]), data.xaxis[j], None,
                       float(data.qpos[model.jnt_qposadr[j]]),
                       model.jnt_range[j].tolist() if model.jnt_limited[j] else (-np.inf, np.inf))
            above = below
    for i in np.flatnonzero(model.eq_active0).tolist():
        _tie(robot, model, i, bodies, names)
    for way, target in zip(model.actuator_trntype, model.actuator_trnid[:, 0]):
        kind = mujoco.mjtTrn(way).name[6:].lower()
        wraps = model.tendon_adr[target] + np.arange(model.tendon_num[target]) \
            if kind == 'tendon' else ()
        robot.driven += [names[target]] * (kind in ('joint', 'jointinparent')) + [
            names[model.wrap_objid[i]] for i in wraps
            if mujoco.mjtWrap(model.wrap_type[i]) == mujoco.mjtWrap.mjWRAP_JOINT]
    return robot


def _compiled(path: str) -> Any:
    """Return a model without meshes, whose files may be missing."""
    # Warnings, which MuJoCo writes to a file, concern dynamics.
    mujoco.set_mju_user_warning(lambda text: None)
    # A file with another ending MuJoCo reads as a text alone, without what it includes.
    spec = MjSpec.from_file(path) if path.endswith('.xml') else MjSpec.from_string(
        Path(path).read_text(encoding='utf-8'))
    for geom in spec.geoms:
        if geom.meshname or geom.hfieldname:
            geom.type, geom.meshname, geom.hfieldname = mujoco.mjtGeom.mjGEOM_SPHERE, '', ''
            geom.size = [0.01, 0.0, 0.0]
        geom.material = ''
    for part in (*spec.meshes, *spec.hfields, *spec.skins, *spec.materials, *spec.textures):
        spec.delete(part)
    spec.compiler.boundmass = spec.compiler.boundinertia = 1e-9
    return spec.compile()


def _tie(robot: Robot, model: Any, i: int, bodies: Any, names: Any) -> None:
    """Add the constraint of an equality between two bodies or joints."""
    kind, numbers = mujoco.mjtEq(model.eq_type[i]).name[5:].lower(), model.eq_data[i]
    ends = [model.eq_obj1id[i], model.eq_obj2id[i]]
    if kind == 'joint' and ends[1] < 0:
        robot.held[names[ends[0]]] = float(numbers[0] + model.qpos0[model.jnt_qposadr[ends[0]]])
    elif kind == 'joint' and not numbers[2:5].any():
        (start, ratio), (first, second) = numbers[:2], model.qpos0[model.jnt_qposadr[ends]]
        robot.follow(names[ends[0]], names[ends[1]], ratio, start + first - ratio * second)
    if kind in ('connect', 'weld'):
        welds = kind == 'weld'
        if mujoco.mjtObj(model.eq_objtype[i]) == mujoco.mjtObj.mjOBJ_SITE:
            frames = [at(model.site_pos[end], turned_by(model.site_quat[end])) for end in ends]
            ends = model.site_bodyid[ends]
        else:
            anchor, other = (numbers[3:6], numbers[:3]) if welds else (numbers[:3], numbers[3:6])
            frames = [at(anchor, turned_by(numbers[6:10]) if welds else np.eye(3)), at(other)]
        robot.close(model.equality(i).name or f'equality{i}', FIXED if welds else BALL,
                    (bodies[ends[0]], bodies[ends[1]]), frames)
