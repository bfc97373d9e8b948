# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What one mechanism sent, as arrays, and what can be measured on it."""

import math

from nodes import DemoError
import numpy as np


class Motion:
    """
    What one mechanism sent.

    Attributes
    ----------
    machine : linkage_ros.scene.Machine
        The mechanism as the scene describes it.
    joint_states : int
        Number of joint state messages.
    times : float array (n,)
        Stamps of the marker messages [s].
    bars : float array (n, legs * bars, 2, 2)
        Ends of each bar [m].
    points : float array (n, legs, points, 2)
        The joints [m].
    locus : float array (m, 2)
        The traced curve [m].

    """

    def __init__(self, machine, joint_states, markers, locus):
        if not joint_states or not markers:
            raise DemoError(f'{machine.name} sent no messages while it was listened to')
        links, joints = zip(*(message.markers for message in markers))
        self.machine = machine
        self.joint_states = len(joint_states)
        self.times = np.array([seconds(marker.header.stamp) for marker in links])
        self.bars = np.array([places(marker) for marker in links])
        self.bars = self.bars.reshape(len(links), -1, 2, 2)
        self.points = np.array([places(marker) for marker in joints])
        self.points = self.points.reshape(len(joints), -1, len(machine.points), 2)
        self.locus = places(locus)

    @property
    def traced(self) -> np.ndarray:
        """The traced joint of the first leg [m], shape (n, 2)."""
        return self.points[:, 0, self.machine.points.index(self.machine.tracer)]

    @property
    def rate(self) -> float:
        """Messages in a second [Hz]."""
        return (len(self.times) - 1) / (self.times[-1] - self.times[0])

    @property
    def extent(self) -> np.ndarray:
        """Width and height of the traced curve [m]."""
        return np.ptp(self.locus, axis=0)

    def length_error(self) -> float:
        """Return the largest error of a bar's length, as a part of the longest bar."""
        linkage, scale = self.machine.linkage, self.machine.scale
        true = scale * np.array([linkage.bar_lengths[bar] for bar in linkage.bars])
        ends = self.bars.reshape(len(self.times), -1, len(true), 2, 2)
        lengths = np.hypot(*np.moveaxis(ends[..., 1, :] - ends[..., 0, :], -1, 0))
        return float(np.max(np.abs(lengths - true)) / (scale * linkage.longest))

    def at(self, time: float) -> int:
        """Return the index of the latest marker message at a time [s]."""
        return max(int(np.searchsorted(self.times, time, side='right')) - 1, 0)


def places(marker) -> np.ndarray:
    """Return the points of a marker [m], shape (n, 2): what it draws is in the plane z = 0."""
    return np.array([(point.x, point.y) for point in marker.points])


def seconds(stamp) -> float:
    """Return a stamp [s]."""
    return stamp.sec + 1e-9 * stamp.nanosec


def lever_error(linkage, lever: float, servo: float) -> float:
    """Return how far [rad] a servo angle puts a slotted lever from a lever angle."""
    a, b, e = (linkage.dimensions[key] for key in 'abe')
    pin = a * complex(math.cos(servo), math.sin(servo)) + b
    return abs(math.atan2(pin.imag, pin.real) - math.asin(e / abs(pin)) - lever)
