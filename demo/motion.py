# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What one mechanism sent, as arrays: what can be measured on it, and how it is drawn."""

import math

from linkage_ros.render.cycle import Configuration, Wheel
from nodes import DemoError
import numpy as np

# The markers of joints, guides and bodies, by their ids.
COURSE = 1, 3, 4


class Motion:
    """
    What one mechanism sent, which moves in a picture as it did when it was sent.

    Times are turns of the first input since the start, which is the first message's stamp.

    Attributes
    ----------
    machine : linkage_ros.scene.Machine
        The mechanism as the scene describes it.
    joint_states : int
        Number of joint state messages.
    times : float array (n,)
        Stamps of the markers that have joint states too [s].
    course : float array (n, legs, points, 2)
        The joints [m], and behind them the ends of what slides.
    period : float
        Seconds of a turn.
    prefixes : tuple of str
        One for each leg.

    """

    def __init__(self, machine, joint_states, markers, locus):
        states = {seconds(state.header.stamp): dict(zip(state.name, state.position))
                  for state in joint_states}
        both = [message.markers for message in markers
                if seconds(message.markers[0].header.stamp) in states]
        if not both:
            raise DemoError(f'{machine.name} sent no messages while it was listened to')
        self.machine = machine
        self.joint_states = len(joint_states)
        self.times = np.array([seconds(markers[0].header.stamp) for markers in both])
        self.start = self.times[0]
        self.inputs = [tuple(states[time][f'{machine.name}_{name}'] for name in machine.inputs)
                       for time in self.times]
        # Joints, guides and bodies in turn, each leg after leg.
        legs = len(machine.assembly().legs)
        self.course = np.concatenate([
            np.array([places(marker) for marker in markers]).reshape(len(both), legs, -1, 2)
            for markers in zip(*both) if markers[0].id in COURSE], axis=2)
        self.period = Wheel(next(iter(machine.inputs.values()))).period
        self.prefixes = ('',) * self.course.shape[1]
        self._locus = places(locus)

    @property
    def rate(self) -> float:
        """Messages in a second [Hz]."""
        return (len(self.times) - 1) / (self.times[-1] - self.times[0])

    @property
    def extent(self) -> np.ndarray:
        """Width and height of the traced curve [m]."""
        return np.ptp(self._locus, axis=0)

    def length_error(self) -> float:
        """Return the largest error of a bar's length, as a part of the longest bar."""
        linkage, scale = self.machine.linkage, self.machine.scale
        true = scale * np.array([linkage.bar_lengths[bar] for bar in linkage.bars])
        first, last = (self.course[:, :, [self.machine.points.index(name) for name in names]]
                       for names in zip(*linkage.bars))
        lengths = np.hypot(*np.moveaxis(last - first, -1, 0))
        return float(np.max(np.abs(lengths - true)) / (scale * linkage.longest))

    def turns_to(self, theta: float) -> float:
        """Return when the first input, a crank, was nearest to an angle [rad]."""
        nearest = np.argmin([abs(math.remainder(first - theta, math.tau))
                             for first, *_ in self.inputs])
        return (self.times[nearest] - self.start) / self.period

    def pose(self, turns: float) -> Configuration:
        """Return where everything was."""
        latest = self._latest(turns)
        return Configuration(turns, self.inputs[latest], self.course[latest])

    def curve(self, joint: int, start: float, end: float) -> np.ndarray:
        """Return where a joint was between two times, shape (n, legs, 2) [m]."""
        return self.course[self._latest(start):self._latest(end) + 1, :, joint]

    def locus(self, _) -> np.ndarray:
        """Return the traced curve [m], shape (n, 2)."""
        return self._locus

    def _latest(self, turns):
        """Return the index of the latest message at a time."""
        # A time may be rounded.
        time = self.start + turns * self.period + 1e-6
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
