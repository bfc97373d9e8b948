# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Node that publishes joint angles, markers, loci and robot models of a scene's mechanisms."""

from functools import partial
import sys
from threading import Lock
import time

from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import JointState

from . import joint_state_reader, scene_node
from .mechanism_publisher import MechanismPublisher, SECONDS_BETWEEN_WARNINGS
from .message_layout import NEVER, pack, Unreadable
from .ticks import Ticks
from .whole_scene import WholeScene
from .. import scene
from ..robot_model import bodies, urdf
from ..words import listed

# How long inputs that nobody sends are waited for [s], and how many names that are no input's are
# remembered so that each is said once.
PATIENCE = 5.0
STRANGERS = 1000
# How long the end may wait for what takes the mechanisms out of the picture [s].
FAREWELL = 0.1


class Kinematics(scene_node.SceneNode):
    """Solves the mechanisms at the inputs on `crank_states`, as far as anyone listens."""

    def __init__(self, **kwargs):
        # A scene that cannot be read ends the node before there is anything to show.
        self._mechanisms, self._models = {}, {}
        self._drawing, self._ended = Lock(), False
        super().__init__(scene.KINEMATICS, **kwargs)
        # Each input that a source tells of, by the source's name.
        self._inputs = {drive.source: [] for machine in self.scene.machines.values()
                        for drive in machine.inputs.values()}
        self._ticks, self._own = Ticks(self._now), frozenset()
        self._whole = WholeScene(self, self._inputs, self._ticks.renew_soon)
        self._mechanisms = {name: MechanismPublisher(self, machine, self._whole, self._ticks)
                            for name, machine in self.scene.machines.items()}
        self._ticks.begin(self._mechanisms, self._whole)
        for name, machine in self.scene.machines.items():
            for i, drive in enumerate(machine.inputs.values()):
                self._inputs[drive.source].append((self._mechanisms[name], i))
        self._unheard, self._strangers = set(self._inputs), set()
        self._reader = joint_state_reader.Reader(self._routed)
        self._patience = self.create_timer(
            PATIENCE, self._miss, clock=Clock(clock_type=ClockType.STEADY_TIME), autostart=False)
        self.begin()
        self._later += [*(partial(self._first_picture, shown)
                          for shown in self._mechanisms.values()), self._first_robot]
        try:
            next(iter(self.scene.machines.values())).linkage.accelerated()
        except ImportError as error:
            self.get_logger().info(f'{error}; plain Python moves the legs, to the same places')
        self.create_subscription(
            JointState, 'crank_states', self._turn, joint_state_reader.ANY, raw=True)

    def serves(self):
        """Say which mechanisms it moves."""
        return f'moves {listed(self.scene.machines, 200)} by crank_states'

    def prepare(self, new):
        """Return what shows each mechanism, another for each that has changed; the whole robot."""
        models = {name: self._mechanisms[name].prepared(
            machine, machine.frame_id or new.frame_id, new.frame_prefix)
            for name, machine in new.machines.items()}
        return models, self._robot(models) if self._models else ''

    def _robot(self, models):
        """Return the robot model of the whole scene, if there is one."""
        # Where only named joints are published, they are in a robot model of somebody else's.
        robots = [model.robot for model in models.values() if not model.machine.only_named]
        try:
            return urdf.write(bodies.together(robots)) if robots else ''
        except scene.SceneError as error:
            self.get_logger().info(f'no robot_description of the whole scene: {error}', once=True)
            return ''

    def _first_picture(self, shown):
        """Make what is shown but once of a mechanism; return what publishes it."""
        shown.finish()
        return partial(self._while_drawing, shown.picture)

    def _first_robot(self):
        """Make the robot model of the scene; return what publishes it, if it is that still."""
        models = self._models
        robot = self._robot(models)
        return partial(self._while_drawing, lambda: models is self._models and
                       self._whole.describe(robot))

    def _while_drawing(self, act):
        with self._drawing:
            if not self._ended:
                act()

    def adopt(self, prepared):
        """Show the mechanisms so from now on."""
        models, robot = prepared
        with self._drawing:
            if self._ended:
                return
            sources = self._ticks.forget()
            self._own = frozenset(called.name for model in models.values()
                                  for called in model.machine.joints.values())
            self._models = models
            for name, model in models.items():
                self._mechanisms[name].adopt(model)
            self._whole.describe(robot)
            self._send_whole(self._ticks.stamp)
            self._ticks.learn(sources)

    def say_goodbye(self):
        """Take what is drawn out of the picture, for good."""
        with self._drawing:
            self._ended = True
            for shown in self._mechanisms.values():
                shown.clear()
        # What has not arrived when a process ends is lost.
        until = time.monotonic() + FAREWELL
        for shown in self._mechanisms.values():
            shown.let_arrive(until)

    def destroy_node(self):
        """Say goodbye where that is still possible, and end."""
        if self.context.ok() and not self._ended:
            self.say_goodbye()
        super().destroy_node()

    @scene_node.until_the_end
    def _turn(self, text):
        with self._drawing:
            if not self._ended and not self._ticks.run(text, self._reader):
                self._draw(text)

    def _draw(self, text):
        try:
            stamp, routes, positions, speeds = self._reader.read(text)
        except Unreadable as error:
            self.get_logger().warning(
                f'crank_states: {len(text)} bytes that are no joint states are passed over: '
                f'{error}', throttle_duration_sec=SECONDS_BETWEEN_WARNINGS)
            return
        if stamp == NEVER:
            stamp = self._now()
        self._ticks.catch_up(stamp)
        for shown, places, known in routes:
            shown.turn(stamp, places, positions, speeds if known else ())
        if routes:
            self._send_whole(stamp)
            self._ticks.learn([self._reader.source(text)])

    def _now(self):
        return pack(self.get_clock().now().to_msg())

    def _send_whole(self, stamp):
        self._whole.send(self._mechanisms.values(), stamp)

    def _routed(self, message):
        """Return the mechanisms that a message turns, where it says how far, and if how fast."""
        known = len(message.velocity) == len(message.name)
        routes = {}
        for name, place in dict(zip(message.name, range(len(message.position)))).items():
            for shown, i in self._inputs.get(name, ()):
                routes.setdefault(shown, []).append((i, place))
            if name in self._inputs:
                self._hear(name)
        self._meet(message.name)
        return [(shown, places, known) for shown, places in routes.items()]

    def _hear(self, name):
        if len(self._unheard) == len(self._inputs):
            self._patience.reset()
        self._unheard.discard(name)

    def _meet(self, names):
        """Say once which names are no input's."""
        room = STRANGERS - len(self._strangers)
        new = room and [name for name in dict.fromkeys(names) if name not in self._inputs
                        and name not in self._own and hash(name) not in self._strangers][:room]
        if new:
            # Names may be long, and many.
            self._strangers.update(map(hash, new))
            self.get_logger().warning(
                f'crank_states: nothing is called {listed(new, 150)}; the inputs are '
                f'{listed(self._inputs, 150)}'
                f'{"; no more will be named" if len(new) == room else ""}')

    def _miss(self):
        """Say once which inputs nobody sends."""
        self._patience.cancel()
        if self._unheard:
            waiting = [name for name in self._inputs if name in self._unheard]
            self.get_logger().warning(
                f'crank_states: nothing was heard of {listed(waiting, 150)}, without which '
                f'{listed(dict.fromkeys(self._inputs[name][0][0].name for name in waiting), 150)} '
                'cannot move')


def main(args=None):
    """Run the node; return the exit code."""
    return scene_node.run(Kinematics, scene.KINEMATICS, args)


if __name__ == '__main__':
    sys.exit(main())
