# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The actuators and the commanded joints of a mechanism, one of each for every input."""

import math
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from ..linkage import GROUND, Link, loaded_links, Mechanism, spread
from ..scene import SceneMechanism
from ..scene.joint_names import JointName
from ..scene.motion import Motion
from ..words import listed

# Relative size of a Jacobian below which outputs do not determine the inputs, and the poses in
# which it is looked at.
DEPENDENT, SPREAD = 1e-9, 200
# States that are tried for a first pose.
SAMPLES = 4096


class Axis(NamedTuple):
    """
    An actuator or a joint, whose position [rad or m] is factor * output + offset.

    `output` is one of the linkage, in its own units. `size` is the scale of its position; the
    position has the period `turn`, if that is not 0. If it `wraps`, it is published within half a
    turn of zero.
    """

    name: str
    output: str
    factor: float
    offset: float
    size: float
    turn: float
    wraps: bool


def axis(machine: SceneMechanism, output: str, name: str = '', factor: float = 1.0,
         offset: float = 0.0, wraps: bool = False) -> Axis:
    """Return the axis of an output, with a factor and an offset from its value in the scene."""
    linkage = machine.linkage
    factor *= machine.scale_of(output)
    counts_turns = output in (*machine.inputs, *linkage.geared) and not wraps
    angular = linkage.is_angle(output)
    return Axis(name, output, factor, offset, abs(factor) * (1.0 if angular else linkage.longest),
                math.tau * abs(factor) if angular and not counts_turns else 0.0, wraps)


def actuators(machine: SceneMechanism) -> List[Axis]:
    """Return the axes of the sources of a mechanism's inputs."""
    return [axis(machine, drive.measures or name, drive.source, 1.0 / drive.ratio,
                 -drive.offset / drive.ratio) for name, drive in machine.inputs.items()]


def joints(machine: SceneMechanism, names: Sequence[str] = ()) -> List[Axis]:
    """
    Return the joints that a controller commands, as many as there are inputs.

    Parameters
    ----------
    machine : SceneMechanism
        Its first leg is used.
    names : sequence of str
        Joints by their names in the scene, or outputs after the mechanism's name: 'leg_P.x'.
        Default: a chain of links from the ground, with preference for those in `joint_names`.

    Raises
    ------
    ValueError
        If one does not exist, they do not determine all inputs, or there is no inverse.

    """
    outputs = [output for name in names if (output := output_of(machine, name))
               ] if names else _chain(machine)
    if len({*outputs}) != len(machine.inputs):
        raise ValueError(f'{machine.name} has {len(machine.inputs)} inputs: as many of its joints '
                         f'are needed, not {listed(names)}')
    if names and not _tell(machine, outputs):
        raise ValueError(f'{listed(names)} of {machine.name} moves with none of the inputs, or '
                         'only together with another joint')
    check_inverse(machine, [axis(machine, output) for output in outputs])
    return [_joint(machine, output) for output in outputs]


def passive(machine: SceneMechanism, commanded: Sequence[Axis]) -> List[Axis]:
    """Return the joints of the first leg's links that are not commanded."""
    outputs = [each.output for each in commanded]
    return [_joint(machine, link.name) for link in machine.linkage.links
            if link.name not in outputs and _key(machine, link.name) in machine.joints]


def _joint(machine: SceneMechanism, output: str) -> Axis:
    """Return the axis of an output, with the name, sign and offset of its joint."""
    joint = machine.joints.get(_key(machine, output), JointName(f'{machine.name}_{output}'))
    return axis(machine, output, joint.name, joint.sign, joint.offset, joint.wraps)


def output_of(machine: SceneMechanism, name: str) -> Optional[str]:
    """Return the output with a name in the scene, or None."""
    for link in machine.linkage.joints:
        joint = machine.joints.get(_key(machine, link))
        if joint and joint.name == name:
            return link
    output = name.removeprefix(f'{machine.name}_')
    return output if output != name and machine.linkage.has_output(output) else None


def gears(linkage: Mechanism, axes: Sequence[Axis]) -> Dict[int, Tuple[int, float, float]]:
    """Return input, ratio and offset of the axes that count an input, maybe geared, by number."""
    return {k: (i, 1.0, 0.0) if each.output == input_.name else (i, *linkage.gear(each.output, i))
            for k, each in enumerate(axes) for i, input_ in enumerate(linkage.inputs)
            if each.output == input_.name
            or each.output in linkage.geared_to(i) and not each.wraps}


def check_inverse(machine: SceneMechanism, axes: Sequence[Axis]) -> None:
    """Raise ValueError if positions of axes give the inputs neither in closed form nor safely."""
    linkage, names = machine.linkage, [each.output for each in axes]
    if len(gears(linkage, axes)) == len(axes) or linkage.inverse(tuple(names)).closed:
        return
    if len(axes) > 1:
        raise ValueError(f'{listed(names)} of {machine.name} have no inverse in closed form, and '
                         'a search of several inputs may miss; choose other joints, or the inputs')
    if linkage.inputs[0].is_part:
        raise ValueError(f'{names[0]} of {machine.name} has no inverse in closed form, and '
                         'repeats after too many turns for a search')
    if not pieces(linkage, names[0]):
        raise ValueError(f'{names[0]} of {machine.name} moves nowhere')


def pieces(linkage: Mechanism, output: str) -> List[Tuple[float, ...]]:
    """Return parts of the reach in which an axis only rises or falls: inputs, and outputs."""
    # In a piece an angle changes by half a turn at most, so that its gaps are known.
    parts, _ = linkage.monotone(output, math.pi if linkage.is_angle(output) else math.inf)
    return [part for part in parts if part[2] != part[3]]


def loads(machine: SceneMechanism) -> Iterator[Tuple[str, float]]:
    """Yield outputs on which the scene's loads work, with their factors."""
    for name, load in machine.loads.items():
        if isinstance(load, float):
            yield from ((link, load) for link in loaded_links(machine.linkage, name))
        else:
            yield from ((f'{name}.{direction}', machine.scale * part)
                        for direction, part in zip(machine.linkage.axes, load))


def start(machine: SceneMechanism) -> List[float]:
    """Return the starts of the inputs, in the linkage's own units; elsewhere if it has no pose."""
    linkage = machine.linkage
    first = [Motion.of(drive).at(0)[0] / machine.scale_of(name)
             for name, drive in machine.inputs.items()]
    samples = np.vstack([first, np.transpose(spread(linkage.inputs, SAMPLES))])
    values = linkage.posed(linkage.points, ()).over(*samples.T)
    return samples[np.isfinite(values).all(axis=0).argmax()].tolist()


def _key(machine: SceneMechanism, link: str) -> str:
    """Return the key of a link of the first leg among the joints' names."""
    return link if link in machine.inputs else next(iter(machine.assembly().legs)) + link


def _chain(machine: SceneMechanism) -> List[str]:
    """Return a chain of links that determines the inputs."""
    links = machine.linkage.links
    barrels = {link.parent for link in links if link.name in machine.inputs}
    chosen: List[str] = []

    def rank(link: Link) -> tuple:
        key = _key(machine, link.name)
        joint = machine.joints.get(key, JointName(link.name))
        return (not joint.published, link.parent != (chosen[-1] if chosen else GROUND),
                link.name in barrels, link.name in machine.inputs,
                joint.name == f'{machine.name}_{key}')

    try:
        for _ in machine.inputs:
            chosen.append(min((link for link in links if link.name not in chosen
                               and _tell(machine, [*chosen, link.name])), key=rank).name)
        check_inverse(machine, [axis(machine, output) for output in chosen])
        return chosen
    except ValueError:
        # There is none, or it has no inverse.
        return list(machine.inputs)


def _tell(machine: SceneMechanism, outputs: Sequence[str]) -> bool:
    """Return whether outputs determine the inputs in any of many poses."""
    linkage = machine.linkage
    rates = np.reshape(linkage.posed((), (), tuple(outputs)).over(*spread(
        linkage.inputs, SPREAD)), (len(linkage.inputs), len(outputs), -1))
    if not np.isfinite(rates).all(axis=(0, 1)).any():
        return True
    sizes = np.array([1.0 if linkage.is_angle(each) else linkage.longest for each in outputs])
    units = np.array([each.size for each in linkage.inputs])
    scaled = np.moveaxis(np.nan_to_num(rates * units[:, None, None] / sizes[:, None]), -1, 0)
    values = np.linalg.svd(scaled, compute_uv=False)
    return values.shape[1] == len(outputs) and bool(
        (values[:, -1] > DEPENDENT * np.maximum(1.0, values[:, 0])).any())
