# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Node that moves the inputs of a scene: turns its cranks, pushes and pulls its cylinders."""

import sys
from time import monotonic_ns

from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import JointState

from . import scene_node
from .messages import JointStates
from .. import scene
from ..scene.motion import Motion
from ..words import listed

# By how much the clock may run ahead of steady time between two messages [ns]: a clock is slewed.
JUMP = 10 ** 8

# In thirty years [ns] nobody waits for the next message.
LONGEST_PERIOD = 1e18


class CrankDriver(scene_node.SceneNode):
    """Publishes every input as a function of the node's time, on `crank_states`."""

    def __init__(self, **kwargs):
        super().__init__(scene.DRIVER, **kwargs)
        self._motions = {}
        self._drives, self._machines = {}, {}
        self._now = self._steady = None
        self._messages = JointStates()
        self._publisher = self.create_publisher(JointState, 'crank_states', 10)
        self._timer = self.create_timer(1.0, self._tick)
        # On system time a timer sleeps until an old time comes round again, if that is set back.
        self.create_timer(1.0, self._wake, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.begin()

    def adopt(self, new):
        """Let every input go on as the scene says: from where it is, or from a new start."""
        now = 0 if self._now is None else self._settled().nanoseconds
        drives = {(name, input_): drive for name, machine in new.machines.items()
                  for input_, drive in machine.inputs.items()}
        for key, drive in drives.items():
            old = self._drives.get(key)
            if old is None or old.start != drive.start:
                self._motions[key] = Motion.of(drive, now)
            elif (old.speed, old.sweep) != (drive.speed, drive.sweep):
                self._motions[key] = self._motions[key].changed(drive.speed, drive.sweep, now)
        self._drives, self._machines = drives, new.machines
        self._pace(new.rate)

    def _pace(self, rate):
        if not rate:
            self._timer.cancel()
            return
        period = round(min(1e9 / rate, LONGEST_PERIOD))
        if self._timer.timer_period_ns != period or self._timer.is_canceled():
            self._timer.timer_period_ns = period
            self._timer.reset()

    def _time(self):
        return self.get_clock().now()

    def _settled(self):
        """Return the time; where it jumps, every input goes on from where it is."""
        time, steady = self._time(), monotonic_ns()
        now, simulated = time.nanoseconds, self.get_clock().ros_time_is_active
        reached = 0
        if self._now is not None:
            reached = self._now if simulated else self._now + steady - self._steady
        # A simulation may leap ahead as it likes: its time is the only one that there is.
        leapt = now - reached > JUMP and not simulated
        if self._now is None or now < self._now or leapt:
            self._motions = {n: m.moved(reached, now) for n, m in self._motions.items()}
        self._now, self._steady = now, steady
        return time

    @scene_node.until_the_end
    def _tick(self):
        time = self._settled()
        now = time.nanoseconds
        if self._publisher.get_subscription_count():
            said = {drive.source: self._said(key, drive, now)
                    for key, drive in self._drives.items()}
            positions, speeds = zip(*said.values())
            self._publisher.publish(
                self._messages.message(time.to_msg(), list(said), positions, speeds))

    def _said(self, key, drive, now):
        """Return where an input is and how fast, as its source tells it."""
        value, speed = self._motions[key].at(now)
        if drive.is_plain:
            return value, speed
        return self._machines[key[0]].told(drive, value, speed)

    def serves(self):
        """Say which inputs it moves, how often."""
        sources = [drive.source for drive in self._drives.values()]
        return f'moves {listed(sources, 200)} on crank_states at {self.scene.rate:g} Hz'

    def _wake(self):
        set_back = self._now is not None and self._time().nanoseconds < self._now
        if set_back and self.scene.rate:
            self._timer.reset()


def main(args=None):
    """Run the node; return the exit code."""
    return scene_node.run(CrankDriver, scene.DRIVER, args)


if __name__ == '__main__':
    sys.exit(main())
