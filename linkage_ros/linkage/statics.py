# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Forces and torques that balance loads on a linkage.

They follow from velocities by the principle of virtual work: the power of inputs and loads is zero
in every motion of the linkage.
"""

from __future__ import annotations

from collections import abc
from itertools import chain
from typing import Any, Iterator, Mapping

import numpy as np
from numpy.typing import ArrayLike

from .kinematics import Inputs, Kinematics
from .text.arguments import numbers
from ..words import join_names, plain_text, short_repr


def effort(linkage: Kinematics, theta: Inputs, loads: Mapping[str, ArrayLike]) -> np.ndarray:
    """Implement `Mechanism.effort`."""
    if not isinstance(loads, abc.Mapping):
        raise ValueError('loads must be a mapping from joints to forces and from links to '
                         f'moments, got {short_repr(loads)}')
    shape = np.broadcast_shapes(linkage.shape, *map(np.shape, linkage.each_input(theta)))
    with np.errstate(invalid='ignore', over='ignore'):
        return np.stack([0.0 - sum(_powers(linkage, theta, loads, by), np.zeros(shape))
                         for by in range(len(linkage.inputs))], -1)


def _powers(linkage: Kinematics, theta: Inputs, loads: Mapping[str, ArrayLike],
            by: int) -> Iterator[np.ndarray]:
    """Yield each load's work per unit of an input."""
    loads = {plain_text(name): load for name, load in loads.items()}
    chains = {name: [*loaded_links(linkage, name)] for name in loads if name in linkage.joints}
    velocities = linkage.velocity(theta, [name for name in loads if name in linkage.points], by)
    rates = linkage.joint_rates(theta, sorted({*chain.from_iterable(chains.values())}), by)
    for name, load in loads.items():
        force = numbers(f'the load on {name}', load)
        if name in velocities:
            if force.shape[-1:] != (len(linkage.axes),):
                raise ValueError(f'the load on the joint {name} must be a force '
                                 f'{", ".join(linkage.axes)} [N], not {short_repr(load)}')
            # A zero load does no work, even at an infinite velocity.
            yield np.where(force == 0.0, 0.0, force * velocities[name]).sum(axis=-1)
        elif name in chains:
            rate = sum((rates[link] for link in chains[name]), np.zeros(()))
            yield np.where(force == 0.0, 0.0, force * rate)
        else:
            raise ValueError(f'{linkage.type} has no joint or link {short_repr(name)} to load; '
                             f'allowed: {join_names((*linkage.points, *linkage.joints))}')


def loaded_links(linkage: Kinematics, name: str) -> Iterator[str]:
    """Yield the links that a moment on a link works on: it and its parents, down to the ground."""
    links = {link.name: link for link in linkage.links}
    if linkage.axes != 'xy':  # each turns about its own axis, and is loaded about that
        yield name
        return
    while name in links:
        if links[name].kind != 'prismatic':
            yield name
        name = links[name].parent


def output_effort(linkage: Kinematics, output: str, theta: Inputs, effort: ArrayLike) -> Any:
    """Implement `Mechanism.output_effort`."""
    if len(linkage.inputs) > 1:
        raise ValueError(f'{linkage.type} has several inputs; the effort of an output needs '
                         'a linkage with one input')
    linkage.check_output(output)
    with np.errstate(divide='ignore', invalid='ignore'):
        return numbers('effort', effort) / linkage.joint_rates(theta, (output,))[output]
