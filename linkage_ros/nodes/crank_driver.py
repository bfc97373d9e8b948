# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Node that moves the inputs of a scene: cranks, cylinders and carriages."""

from __future__ import annotations

from time import monotonic_ns, time_ns
from typing import Any

from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import JointState

from . import scene_node, shutdown
from .message_layout import pack_time, PatchedMessages
from .messages import joint_states
from .publishers import TrackedPublisher
from .. import scene
from ..scene.motion import Motion

# If system time gains more than this on steady time between two messages [ns], it has jumped.
MIN_JUMP_NS = 10 ** 8

# Longest period of a timer that does not overflow [ns]: thirty years.
MAX_PERIOD_NS = 1e18


class CrankDriver(scene_node.SceneNode):
    """Publishes the scene's source joints on `crank_states`, as functions of the node's time."""

    task = 'drives {mechanisms} at {rate:g} Hz'
    # System time [ns], used unless `use_sim_time` is set.
    system_time = staticmethod(time_ns)

    def __init__(self, **kwargs: Any):
        super().__init__(scene.DRIVER, **kwargs)
        self._motions: dict[tuple[str, str], Motion] = {}
        self._settings: dict[tuple[str, str], scene.InputSettings] = {}
        self._sent: dict[str, tuple[tuple[str, str], scene.InputSettings]] = {}
        self._now: int | None = None
        self._steady = 0
        self._publisher = TrackedPublisher(self, JointState, 'crank_states', 10)
        sources = list(self.scene.sources)
        n = len(sources)
        self._message = PatchedMessages(
            [(self._publisher.publish, lambda stamp, values: joint_states(
                stamp, sources, values[:n], values[n:]))], 2 * n)
        # After system time is set back, a timer on it would sleep until the old time returns.
        clock = self.get_clock()
        self._timer = self.create_timer(
            1.0, self.guarded('a crank message', self._tick),
            clock=clock if clock.ros_time_is_active else Clock(clock_type=ClockType.STEADY_TIME))
        self.begin()

    def adopt(self, new: scene.Scene) -> None:
        """Adopt a scene; an input continues from its value, or from its start if that is new."""
        now = 0 if self._now is None else self._follow_clock()
        all_settings = {(name, input_): settings for name, mechanism in new.mechanisms.items()
                        for input_, settings in mechanism.inputs.items()}
        for key, settings in all_settings.items():
            old = self._settings.get(key)
            if old is None or old.start != settings.start:
                self._motions[key] = Motion.of(settings, now)
            elif old != settings:
                # A dimension may change the period.
                self._motions[key] = self._motions[key].changed(
                    settings.speed, settings.sweep, settings.input.period, now)
        self._settings = all_settings
        # If several inputs have one source joint, it moves as the last of them.
        self._sent = {settings.source: (key, settings) for key, settings in all_settings.items()}
        self._set_rate(new.rate)

    def _set_rate(self, rate: float) -> None:
        if not rate:
            self._timer.cancel()
            return
        period = round(min(1e9 / rate, MAX_PERIOD_NS))
        if self._timer.timer_period_ns != period or self._timer.is_canceled():
            self._timer.timer_period_ns = period
            self._timer.reset()

    def _follow_clock(self) -> int:
        """Return the time [ns]; if it has jumped, shift the motions, so that no input jumps."""
        clock, steady = self.get_clock(), monotonic_ns()
        simulated = clock.ros_time_is_active
        now = clock.now().nanoseconds if simulated else self.system_time()
        reached = 0
        if self._now is not None:
            reached = self._now if simulated else self._now + steady - self._steady
        # Simulated time may advance by any amount.
        is_ahead = now - reached > MIN_JUMP_NS and not simulated
        if self._now is None or now < self._now or is_ahead:
            self._motions = {n: m.moved(reached, now) for n, m in self._motions.items()}
        self._now, self._steady = now, steady
        return now

    def _tick(self) -> None:
        now = self._follow_clock()
        if self._publisher.has_subscribers:
            positions, speeds = zip(*[self._position(*sent, now) for sent in self._sent.values()])
            for publish, data in self._message.patched(pack_time(now), positions + speeds):
                publish(data)

    def _position(self, key: tuple[str, str], settings: scene.InputSettings,
                  now: int) -> tuple[float, float]:
        """Return position [rad or m] and speed [rad/s or m/s] of an input's source joint."""
        return self.scene.mechanisms[key[0]].to_source(settings, *self._motions[key].at(now))


def main(args: Any = None) -> int:
    """Run the node with command-line arguments `args`; return the exit code."""
    return scene_node.run([CrankDriver], scene.DRIVER, args)


if __name__ == '__main__':
    shutdown.run(main)
