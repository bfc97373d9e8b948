# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Elements, numbers and poses in robot descriptions in XML."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Iterable, Sequence
import xml.etree.ElementTree as ElementTree
from xml.parsers import expat

import numpy as np

from ..cli import RequestError
from ..robot_model.robot import FIXED, MAX_NUMBER, pose, Robot

Element = ElementTree.Element


def parse(path: str) -> Element:
    """
    Return the root element of a file; names lose the prefix of their namespace.

    Raises RequestError for xacro, and what expat raises for other files that are no XML.
    """
    # Files use prefixes, such as Drake's, without declaring them, which ElementTree refuses.
    builder, parser = ElementTree.TreeBuilder(), expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    parser.CharacterDataHandler = builder.data
    parser.Parse(Path(path).read_bytes(), True)
    root = builder.close()
    for part in root.iter():
        if part.tag.startswith('xacro:') or any('${' in text for text in part.attrib.values()):
            raise RequestError(f'run xacro first, as in xacro {path} > robot.urdf')
        part.tag = part.tag.split(':')[-1]
    return root


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


def obey(robot: Robot, plugins: Iterable[Element]) -> None:
    """Fix the links of Gazebo's DetachableJoint to each other, and note what others drive."""
    for plugin in plugins:
        kind = f'{plugin.get("name")} {plugin.get("filename")}'.lower()
        if 'detachable' in kind:
            parent, child = (text(plugin, tag) for tag in ('parent_link', 'child_link'))
            robot.join(f'{parent}={child}', FIXED, (parent, child), robot.frames[parent])
        if 'state' not in kind:
            robot.driven += [(joint.text or '').strip() for joint in plugin.findall('joint_name')]


def origin(part: Element) -> np.ndarray:
    """Return the pose in the attributes xyz and rpy of a part's origin, or of the part."""
    place = next(part.iterfind('origin'), part)
    return pose(*numbers(f'{place.get("xyz", "0 0 0")} {place.get("rpy", "0 0 0")}', 6))


def turned_by(quaternion: Any) -> np.ndarray:
    """Return the rotation matrix of a quaternion w, x, y, z."""
    w, *axis = np.asarray(quaternion) / np.linalg.norm(quaternion)
    across = np.cross(np.eye(3), axis)
    return np.eye(3) + 2.0 * (w * across + across @ across)
