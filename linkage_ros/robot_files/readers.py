# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Robots as MJCF, SDF and URDF describe them."""

from __future__ import annotations

from collections import Counter
from contextlib import contextmanager
from graphlib import CycleError
from pathlib import Path
from typing import Iterator
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

import numpy as np

from . import sdf, urdf
from ..cli import RequestError
from ..optional import needs
from ..robot_model.robot import MAX_NUMBER, Robot
from ..robot_model.urdf import write


def read(path: str, loops: str | None = None) -> Robot:
    """Return the robot in a file; raise RequestError if there is none."""
    with _blaming(path):
        root = _parse(path)
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
            from yaml import BaseLoader, load, YAMLError
        with _blaming(loops, YAMLError), open(loops, encoding='utf-8') as file:
            # All is text, also a name of digits.
            urdf.close(robot, load(file, BaseLoader))
    with _blaming(path):
        if far := [joint.name for joint in robot.joints
                   if not np.all(np.abs(joint.places) < MAX_NUMBER)]:
            raise RequestError(f'joint {far[0]} must be within {MAX_NUMBER:g} m')
        robot.check_names(robot.source(name)[0] for name in robot.follows)
    return robot.cut_loops()


def description(path: str, robot: Robot) -> str:
    """Return a robot as robot_state_publisher takes it: its URDF as it is, else its tree."""
    return Path(path).read_text() if _parse(path).tag == 'robot' else write(robot)


@contextmanager
def _blaming(path: str, syntax: type[Exception] = expat.ExpatError) -> Iterator[None]:
    """Raise RequestError, with the file's name, for what readers raise, and for wrong syntax."""
    try:
        yield
    except RequestError as error:
        raise RequestError(f'{path}: {error}') from None
    except (RecursionError, CycleError):
        raise RequestError(f'{path} has links or frames that hang on themselves') from None
    except KeyError as error:
        raise RequestError(f'{path} names {error}, which is not there') from None
    except (ValueError, TypeError, AttributeError, RuntimeError, LookupError, syntax) as error:
        raise RequestError(f'{path} cannot be read: {error}') from None


def _parse(path: str) -> Element:
    """Return the root element of a file; names lose the prefix of their namespace."""
    # Files use prefixes, such as Drake's, without declaring them, which ElementTree refuses.
    builder, parser = TreeBuilder(), expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    parser.CharacterDataHandler = builder.data
    parser.Parse(Path(path).read_bytes(), True)
    root = builder.close()
    for part in root.iter():
        if part.tag.startswith('xacro:') or any('${' in text for text in part.attrib.values()):
            raise RequestError(f'run xacro first, as in xacro {path} > robot.urdf')
        part.tag = part.tag.split(':')[-1]
    return root
