# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0


"""
Run a scene's nodes, check what they publish from outside, and draw it to demo/out/.

Ends with an error if anything is missing, if the length of a bar is wrong, or if a node does not
end well when it is terminated.
"""

import math
from pathlib import Path
import sys
import time

try:
    from domains import Domain
    from linkage_interfaces.srv import ServoInverse
    from linkage_ros import scene
    from linkage_ros.nodes.messages import BODIES_ID, GUIDES_ID, JOINTS_ID
    from linkage_ros.render import files
    from linkage_ros.render.cycle import Configuration, Cycle
    from linkage_ros.render.parts import DEFAULT, DEFAULT_IN_MOTION
    from linkage_ros.render.picture import Picture
    import numpy as np
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from ros_harness import Graph
    from sensor_msgs.msg import JointState
    from view import DemoError, Nodes, run
    from visualization_msgs.msg import Marker, MarkerArray
except ImportError as error:
    sys.exit(f'demo: {error}; `make demo` installs and builds what is needed')

SCENE = Path(__file__).parents[1] / 'config' / 'all.yaml'
OUT = Path(__file__).parent / 'out'
SECONDS = 10.0
STILL, MOVING, FRAMES_PER_SECOND, COLOURS = (720, 720), (1040, 300), 12.0, 24
# Lever angles [degrees] for the service; the last is out of reach.
LEVER_ANGLES = (-30.0, -15.0, 0.0, 15.0, 30.0, 45.0)
# Largest errors: of a length as a part of the longest bar, and of an angle [rad].
TOLERANCE = 1e-12
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
NEXT = """
Try next:
  make view                               the same scene in the browser, to be moved and tuned
  make view SCENE=config/excavator.yaml   an arm with three cylinders; config/ has more
  docs/tutorial.md                        a gripper of your own, from paper to a servo"""


class Received(Cycle):
    """The motion of a mechanism as a Cycle whose poses are its messages."""

    def __init__(self, mechanism, graph):
        self.mechanism = mechanism
        self.states, self.markers, self.loci = (
            graph.listen(type_, f'{mechanism.name}/{topic}', qos) for type_, topic, qos in (
                (JointState, 'joint_states', 10), (MarkerArray, 'markers', 10),
                (Marker, 'locus', LATCHED)))

    def read(self):
        """Read the messages, of which each joint state has its markers."""
        states = {seconds(state): dict(zip(state.name, state.position)) for state in self.states}
        arrays = {seconds(array.markers[0]): [
            marker for marker in array.markers
            if marker.id in (JOINTS_ID, GUIDES_ID, BODIES_ID)] for array in self.markers}
        self.times = np.array(sorted(states.keys() & arrays.keys()))
        legs = len(self.mechanism.assembly().legs)
        self._poses = [
            ([states[time][f'{self.mechanism.name}_{name}'] for name in self.mechanism.inputs],
             np.concatenate([points(marker).reshape(legs, -1, 2) for marker in arrays[time]], 1))
            for time in self.times]
        super().__init__(self.mechanism)

    def pose(self, turns):
        """Return the configuration at a time [turns]: that of the latest message."""
        # A time may be rounded.
        time = self.times[0] + turns * self.period + 1e-6
        return Configuration(turns, *self._poses[int(np.searchsorted(self.times, time)) - 1])

    def locus(self, mechanism):
        """Return the received curve [m], shape (n, 2)."""
        return points(self.loci[-1])

    def length_error(self):
        """Return the largest error of a bar's length, as a part of the longest bar."""
        linkage, scale = self.mechanism.linkage, self.mechanism.scale
        places = np.array([places for _, places in self._poses])
        first, last = (places[:, :, [self.mechanism.points.index(name) for name in names]]
                       for names in zip(*linkage.bars))
        lengths = scale * np.array([linkage.bar_lengths[bar] for bar in linkage.bars])
        errors = np.hypot(*np.moveaxis(last - first, -1, 0)) - lengths
        return float(np.abs(errors).max() / (scale * linkage.longest))


def points(marker):
    """Return the points of a marker in its plane [m], shape (n, 2)."""
    return np.array([(point.x, point.y) for point in marker.points])


def seconds(message):
    """Return the stamp of a message [s]."""
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


def demo():
    """Observe the nodes, report and draw; raise DemoError if something is wrong."""
    mechanisms = scene.load(SCENE).mechanisms
    try:
        motions, answer = observe(mechanisms.values())
    except (AssertionError, RuntimeError) as error:
        raise DemoError(error) from None
    report_motions(motions)
    report_answer(next(mechanism.linkage.dimensions for mechanism in mechanisms.values()
                       if mechanism.linkage.type == 'slotted_lever'), answer)
    draw(motions)
    print(NEXT)


def observe(mechanisms):
    """Return the motions of the mechanisms, and the response of the service."""
    with Domain() as domain, Nodes(SCENE, domain.id) as nodes, Graph(domain.id) as graph:
        print(f'Running three nodes on {SCENE.name}, ROS_DOMAIN_ID {domain.id} ...', flush=True)
        motions = [Received(mechanism, graph) for mechanism in mechanisms]
        inverse = graph.node.create_client(ServoInverse, 'servo_inverse')

        def has_all():
            nodes.check()
            return all(motion.states and motion.markers and motion.loci for motion in motions)

        graph.until(has_all)
        end = time.monotonic() + SECONDS
        graph.until(lambda: has_all() and time.monotonic() > end, 2.0 * SECONDS)
        answer = graph.call(inverse, ServoInverse.Request(
            lever_angle=list(map(math.radians, LEVER_ANGLES))))
        for name, code in nodes.stop().items():
            if code != 0:
                raise DemoError(f'{name} ended with exit code {code} when it was terminated')
    for motion in motions:
        motion.read()
    return motions, answer


def report_motions(motions):
    """Print a line for each mechanism; raise DemoError if the length of a bar is wrong."""
    print('\nmechanism        messages  rate [Hz]  length error  traced curve [m]')
    for motion in motions:
        count, error = len(motion.times), motion.length_error()
        size = ' x '.join(f'{side:.3g}' for side in np.ptp(points(motion.loci[-1]), axis=0))
        print(f'{motion.mechanism.name:14} {count:10} {(count - 1) / np.ptp(motion.times):10.1f}  '
              f'{error:12.1e}  {size}')
        if not error <= TOLERANCE:
            raise DemoError(f'the length of a bar is wrong by {error:.1e} of the longest bar')
    print('(length error: largest of all bars and messages, as a part of the longest bar)')


def report_answer(dimensions, answer):
    """Print a line for each lever angle; raise DemoError if a response is wrong."""
    a, b, e = (dimensions[key] for key in 'abe')
    print('\nlever [deg]  servo [deg]  d lever / d servo  error [rad]')
    for lever, servo, reduction, reachable in zip(
            LEVER_ANGLES, answer.servo_angle, answer.reduction, answer.reachable):
        if not reachable:
            print(f'{lever:11.1f}  unreachable')
            continue
        pin = a * complex(math.cos(servo), math.sin(servo)) + b
        error = abs(math.atan2(pin.imag, pin.real) - math.asin(e / abs(pin)) - math.radians(lever))
        print(f'{lever:11.1f}  {math.degrees(servo):11.4f}  {reduction:17.6f}  {error:11.1e}')
        if not error <= TOLERANCE:
            raise DemoError(f'the servo angle for {lever:g} degrees is wrong by {error:.1e} rad')
    print(f'servo_inverse says: {answer.message}')
    if list(answer.reachable) != [True] * (len(LEVER_ANGLES) - 1) + [False]:
        raise DemoError('servo_inverse did not reach all lever angles but the last')


def draw(motions):
    """Draw a picture of each mechanism, and an animation of all, from their messages."""
    OUT.mkdir(exist_ok=True)
    print(f'\nDrawing the messages to {OUT} ...', flush=True)
    for motion in motions:
        picture = Picture([motion.mechanism], STILL, 'whole', DEFAULT, [motion])
        picture.arrange([1 / 6])
        files.still(picture, 1 / 6, OUT / f'{motion.mechanism.name}.png')
    picture = Picture([motion.mechanism for motion in motions], MOVING, 'whole',
                      DEFAULT_IN_MOTION - {'axes'}, motions)
    times = np.arange(0.0, 1.0, 1.0 / (FRAMES_PER_SECOND * picture.period))
    picture.arrange(times)
    files.gif(picture, times, FRAMES_PER_SECOND, 0, COLOURS, OUT / 'all.gif')
    print(*(f'  {file.name}' for file in sorted(OUT.iterdir())), sep='\n')


if __name__ == '__main__':
    sys.exit(run('demo', demo))
