# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Robots as MJCF, SDF and URDF describe them."""

from __future__ import annotations

from collections import Counter
from contextlib import contextmanager
from graphlib import CycleError
from pathlib import Path
from typing import Iterator
from xml.parsers.expat import ExpatError

import numpy as np

from . import sdf, urdf
from .elements import parse
from ..cli import RequestError
from ..optional import needs
from ..robot_model.robot import MAX_NUMBER, Robot
from ..robot_model.urdf import write


def read(path: str, loops: str | None = None) -> Robot:
    """Return the robot in a file; raise RequestError if there is none."""
    with _blaming(path):
        root = parse(path)
        if root.tag not in ('mujoco', 'sdf', 'robot'):
            raise RequestError(f'a robot must be MJCF, SDF or URDF, not <{root.tag}>')
        if loops and root.tag != 'robot':
            raise RequestError('only a URDF has its loops in another file; omit --loops')
        if root.tag == 'mujoco':
            with needs('mujoco'):
                from . import mjcf
            robot = mjcf.read(path)
        else:
            robot = sdf.read(root) if root.tag == 'sdf' else urdf.read(root)
        names = Counter(joint.name for joint in robot.joints if joint.position is not None)
        if wrong := [name for name, count in names.items() if not name or count > 1]:
            raise RequestError(f'each joint must have a name of its own, not {wrong[0]!r}')
    if loops:
        with needs('yaml'):
            from yaml import safe_load, YAMLError
        with _blaming(loops, YAMLError), open(loops, encoding='utf-8') as file:
            urdf.close(robot, safe_load(file))
    with _blaming(path):
        if far := [joint.name for joint in robot.joints
                   if not np.all(np.abs(joint.places) < MAX_NUMBER)]:
            raise RequestError(f'joint {far[0]} must be within {MAX_NUMBER:g} m')
        for name in robot.follows:
            robot.source(name)
    return robot.cut_loops()


def description(path: str, robot: Robot) -> str:
    """Return a robot as robot_state_publisher takes it: its URDF as it is, else its tree."""
    return Path(path).read_text() if parse(path).tag == 'robot' else write(robot)


@contextmanager
def _blaming(path: str, *errors: type[Exception]) -> Iterator[None]:
    """Raise RequestError for what readers raise, and for other errors, with the file's name."""
    try:
        yield
    except RequestError as error:
        raise RequestError(f'{path}: {error}') from None
    except (RecursionError, CycleError):
        raise RequestError(f'{path} has links or frames that hang on themselves') from None
    except KeyError as error:
        raise RequestError(f'{path} names {error}, which is not there') from None
    except (ValueError, TypeError, AttributeError, RuntimeError, LookupError, ExpatError,
            *errors) as error:
        raise RequestError(f'{path} cannot be read: {error}') from None
