# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The actuators and the commanded joints of a mechanism, one of each for every input."""

from itertools import permutations
import math
from typing import Iterator, NamedTuple, Sequence

from ..linkage import GROUND, Link, loaded_links
from ..scene import SceneMechanism
from ..scene.joint_names import JointName
from ..scene.motion import Motion
from ..words import join_names, n_inputs


class Axis(NamedTuple):
    """
    An actuator or a joint, whose position [rad or m] is factor * output + offset.

    `output` is one of the linkage, in its own units. `size` and `turn` are the position's size and
    period; the period is 0 for inputs and geared links, which count turns. If it `wraps`, its
    position is published within half a turn of zero. `role` is its name in the linkage. `input` is
    the number of the input that the output counts: it is that one, or geared to it.
    """

    name: str
    output: str
    factor: float
    offset: float
    size: float
    turn: float
    wraps: bool
    role: str
    input: int | None


def axis(mechanism: SceneMechanism, output: str, name: str = '', factor: float = 1.0,
         offset: float = 0.0, wraps: bool = False) -> Axis:
    """Return the axis of an output, with a factor and an offset from its value in the scene."""
    linkage = mechanism.linkage
    is_angle = linkage.is_angle(output)
    factor *= mechanism.scale_of(output)
    index = next((i for i, input_ in enumerate(linkage.inputs)
                  if output in (input_.name, *linkage.geared_to(i))), None)
    turns = is_angle and index is None
    return Axis(name, output, factor, offset, abs(factor) * (1.0 if is_angle else linkage.longest),
                abs(factor) * math.tau * turns, wraps and turns, output, index)


def actuators(mechanism: SceneMechanism) -> list[Axis]:
    """Return the axes of the sources of a mechanism's inputs."""
    return invertible(mechanism, [
        axis(mechanism, settings.measures or name, settings.source, 1.0 / settings.ratio,
             -settings.offset / settings.ratio)._replace(role=name)
        for name, settings in mechanism.inputs.items()])


def joints(mechanism: SceneMechanism, names: Sequence[str] = ()) -> list[Axis]:
    """
    Return the joints that a controller commands, as many as there are inputs.

    Parameters
    ----------
    mechanism : SceneMechanism
        Its first leg is used.
    names : sequence of str
        Joints by their names in the scene, or outputs after the mechanism's name: 'leg_P.x'.
        Default: a chain of links from the ground, with preference for those in `joint_names`.

    Raises
    ------
    ValueError
        If one does not exist, they do not determine all inputs, or there is no inverse.

    """
    outputs = [named[0] for name in names if (named := mechanism.output_named(name))
               ] if names else _chain(mechanism)
    if len({*outputs}) != len(mechanism.inputs):
        raise ValueError(f'{mechanism.name} has {n_inputs(len(mechanism.inputs))}: as many of its '
                         f'joints are needed, not {join_names(names)}')
    return invertible(mechanism, [_joint(mechanism, output) for output in outputs])


def passive(mechanism: SceneMechanism, commanded: Sequence[Axis]) -> list[Axis]:
    """Return the joints of the first leg's links that are not commanded."""
    outputs = [joint.output for joint in commanded]
    return [_joint(mechanism, name) for name in mechanism.linkage.joints if name not in outputs]


def _joint(mechanism: SceneMechanism, output: str) -> Axis:
    """Return the axis of an output, with the name, sign and offset of its joint."""
    joint = mechanism.joints.get(mechanism.key(output), JointName(f'{mechanism.name}_{output}'))
    return axis(mechanism, output, joint.name, joint.sign, joint.offset, joint.wraps)


def invertible(mechanism: SceneMechanism, axes: list[Axis]) -> list[Axis]:
    """Return axes; raise ValueError if positions of them do not give the inputs for certain."""
    linkage, names = mechanism.linkage, [joint.output for joint in axes]
    what = f'{join_names(names)} of {mechanism.name}'
    if len({joint.input for joint in axes} - {None}) == len(axes):
        return axes
    if any(input_.is_part for input_ in linkage.inputs):
        raise ValueError(f'{what} has no inverse, since it repeats after too many turns')
    if linkage.inverse(tuple(names)).closed:
        return axes
    if len(axes) > 1:
        raise ValueError(f'{what} have no inverse in closed form, and a search of several inputs '
                         'may miss; choose other joints, or the inputs')
    if not len(linkage.monotone(names[0])):
        raise ValueError(f'{what} moves nowhere')
    return axes


def loads(mechanism: SceneMechanism) -> Iterator[tuple[str, float]]:
    """Yield outputs on which the scene's loads work, with their factors."""
    for name, load in mechanism.loads.items():
        if isinstance(load, float):
            yield from ((link, load) for link in loaded_links(mechanism.linkage, name))
        else:
            yield from ((f'{name}.{direction}', mechanism.scale * part)
                        for direction, part in zip(mechanism.linkage.axes, load))


def start(mechanism: SceneMechanism) -> list[float]:
    """Return the starts of the inputs."""
    return [Motion.of(settings).at(0)[0] for settings in mechanism.inputs.values()]


def _chain(mechanism: SceneMechanism) -> list[str]:
    """Return a chain of links that determines the inputs."""
    links = mechanism.linkage.links
    barrels = {link.parent for link in links if link.name in mechanism.inputs}
    chosen: list[str] = []

    def rank(link: Link) -> tuple:
        key = mechanism.key(link.name)
        joint = mechanism.joints[key]
        return (not joint.published, link.parent != (chosen[-1] if chosen else GROUND),
                link.name in barrels, link.name in mechanism.inputs,
                joint.name == f'{mechanism.name}_{key}')

    try:
        for _ in mechanism.inputs:
            chosen.append(min((
                link for link in links if link.name not in chosen
                and _may_determine(mechanism, [*chosen, link.name])), key=rank).name)
        invertible(mechanism, [_joint(mechanism, output) for output in chosen])
        return chosen
    except ValueError:
        # There is none, or it has no inverse.
        return list(mechanism.inputs)


def _may_determine(mechanism: SceneMechanism, outputs: Sequence[str]) -> bool:
    """Return whether each output may depend on another one of the inputs."""
    moves = mechanism.linkage.moves
    return any(all(map(moves, outputs, inputs)) for inputs in permutations(
        range(len(mechanism.inputs)), len(outputs)))
