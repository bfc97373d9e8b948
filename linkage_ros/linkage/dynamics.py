# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Accelerations, and the forces and torques that hold a linkage against loads.

Forces follow from velocities by virtual work: what the inputs give and what the loads take adds up
to nothing in every motion that the linkage allows.
"""

from __future__ import annotations

from typing import Any, Iterator, Mapping, Optional, Sequence

import numpy as np
from numpy.typing import ArrayLike

from .arguments import numbers
from .mechanism import Inputs, Mechanism
from ..words import listed, meant, plain_text, quoted


class Driven(Mechanism):
    """A mechanism that also answers questions about accelerations and forces."""

    def acceleration(self, theta: Inputs, rate: Inputs, rate_rate: Inputs,
                     points: Optional[Sequence[str]] = None) -> dict:
        """
        Return the joints' accelerations, by differentiating twice.

        Parameters
        ----------
        theta, rate, rate_rate : float or array-like
            What `solve` takes: each input [rad or m], how fast it moves, and how that changes.
        points : sequence of str, optional
            The joints wanted. Default: all.

        Returns
        -------
        dict
            For each joint an array [m/s^2] of their broadcast shape and a last axis for x and y;
            infinite or NaN at a dead point.

        Raises
        ------
        ValueError
            If a joint does not exist.

        """
        names, pose = self._ready('point accelerations', points)
        values = pose.over(*self._motion(theta, rate, rate_rate))
        pairs = np.moveaxis(values.reshape(len(names), 2, *values.shape[1:]), 1, -1)
        return dict(zip(names, pairs))

    def joint_accelerations(self, theta: Inputs, rate: Inputs, rate_rate: Inputs,
                            joints: Optional[Sequence[str]] = None) -> dict:
        """Return how the joint rates change [rad/s^2 or m/s^2]; see `acceleration`."""
        names, pose = self._ready('joint accelerations', joints)
        return dict(zip(names, pose.over(*self._motion(theta, rate, rate_rate))))

    def _motion(self, *each: Inputs) -> Sequence[np.ndarray]:
        return [values for inputs in each for values in self._each_input(inputs)]

    def effort(self, theta: Inputs, loads: Mapping[str, ArrayLike]) -> np.ndarray:
        """
        Return what holds the linkage at rest against loads.

        Parameters
        ----------
        theta : float or array-like
            What `solve` takes.
        loads : mapping
            By name: for a joint a force (x, y) [N], for a link a moment [N m], counterclockwise
            positive; each may have axes of its own in front, in theta's shape.

        Returns
        -------
        array
            Of theta's shape and a last axis for the inputs: the torque of a crank [N m], the force
            of a cylinder [N], positive where it acts the way the input grows. It grows without
            bound next to a dead point, and is infinite or NaN there.

        Raises
        ------
        ValueError
            If there is no such joint or link, or a load has another shape.

        """
        shape = np.broadcast_shapes(*map(np.shape, self._each_input(theta)))
        efforts = [np.zeros(shape) for _ in self.inputs]
        for by in range(len(self.inputs)):
            with np.errstate(invalid='ignore', over='ignore'):
                for power in self._powers(theta, loads, by):
                    efforts[by] = efforts[by] - power
        return np.stack(np.broadcast_arrays(*efforts), -1)

    def _powers(self, theta: Inputs, loads: Mapping[str, ArrayLike],
                by: int) -> Iterator[np.ndarray]:
        """Yield what each load gives for each unit that an input moves."""
        for name, load in loads.items():
            name = plain_text(name)
            force = numbers(f'the load on {name}', load)
            if name in self.points:
                if force.shape[-1:] != (2,):
                    raise ValueError(f'the load on the joint {name} must be a force x, y [N], not '
                                     f'{quoted(load)}')
                velocity = self.velocity(theta, (name,), by)[name]
                # A load of nothing takes nothing, however fast its joint moves.
                yield np.where(force == 0.0, 0.0, force * velocity).sum(axis=-1)
            elif name in self.joints:
                chain = list(self._chain(name))
                rates = self.joint_rates(theta, chain, by)
                turning = sum((rates[link] for link in chain), np.zeros(()))
                yield np.where(force == 0.0, 0.0, force * turning)
            else:
                allowed = *self.points, *self.joints
                raise ValueError(f'{self.type} has no joint or link {quoted(name)} to load; '
                                 f'allowed: {listed(allowed)}{meant(name, allowed)}')

    def _chain(self, name: str) -> Iterator[str]:
        """Yield the links that turn a link, itself first, down to the ground."""
        links = {link.name: link for link in self.links}
        while name in links:
            if links[name].kind != 'prismatic':
                yield name
            name = links[name].parent

    def output_effort(self, output: str, theta: Inputs, effort: ArrayLike) -> Any:
        """
        Return the force or torque that an output exerts where the input gives an effort.

        Parameters
        ----------
        output : str
            What `input_for` takes, of a linkage with one input.
        theta : float or array-like
            What `solve` takes.
        effort : float or array-like
            Of the input [N m or N].

        Returns
        -------
        float or array
            [N m] of an angle, [N] of a length or a coordinate; infinite where the output turns
            back, 0 at a dead point.

        Raises
        ------
        ValueError
            If there is no such output, or there are several inputs.

        """
        if len(self.inputs) > 1:
            raise ValueError(f'{self.type} has several inputs; the effort of an output is there '
                             'for one')
        with np.errstate(divide='ignore', invalid='ignore'):
            return (numbers('effort', effort) / self.joint_rates(theta, (output,))[output])[()]
