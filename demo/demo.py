# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.


"""
Run a scene's nodes, check what they publish from outside, and draw it to demo/out/.

Ends with an error if anything is missing, if the length of a bar is wrong, or if a node does not
end well when it is terminated.
"""

import math
from pathlib import Path
import signal
import sys
import time

HERE = Path(__file__).parent

try:
    from domains import Domain
    from linkage_interfaces.srv import ServoInverse
    from linkage_ros import command, scene
    from linkage_ros.render import files
    from linkage_ros.render.parts import DEFAULT, DEFAULT_IN_MOTION
    from linkage_ros.render.picture import Picture
    from nodes import DemoError, Nodes
    import numpy as np
    from received import Received
    from ros_harness import Graph
except ImportError as error:
    sys.exit(f'demo: {error}; `make demo` installs and builds what is needed')

SCENE = HERE.parent / 'config' / 'all.yaml'
OUT = HERE / 'out'
SECONDS = 10.0

PORTRAIT_SIZE, PORTRAIT_TURNS = (720, 720), 1 / 6
ANIMATION_SIZE, ANIMATED_SECONDS, FRAMES_PER_SECOND, COLOURS = (1040, 300), 2.0 * math.pi, 12.0, 24

# Lever angles [degrees] for the service; the last is out of reach.
LEVER_ANGLES = (-30.0, -15.0, 0.0, 15.0, 30.0, 45.0)
# Largest errors: of a length as a part of the longest bar, and of an angle [rad].
TOLERANCE = 1e-12

NEXT = """
Try next:
  make view                               the same scene in the browser, to be moved and tuned
  make view SCENE=config/excavator.yaml   an arm with three cylinders; config/ has more
  docs/tutorial.md                        a gripper of your own, from paper to a servo"""


def main() -> int:
    """Run the demo; return the exit code of the process."""
    # However it ends, no node is left behind.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    return command.run('demo', lambda _: show(), None)


def show():
    """Observe the nodes, report and draw; raise DemoError if something is wrong."""
    mechanisms = scene.load(SCENE).machines
    try:
        received, answer = observe(mechanisms)
    except (AssertionError, RuntimeError) as error:
        raise DemoError(error) from None
    report_motions(received)
    report_answer(next(one for one in mechanisms.values() if one.linkage.type == 'slotted_lever'),
                  answer)
    draw(received)
    print(NEXT)


def observe(mechanisms):
    """Return the messages of the mechanisms, and the response of the service."""
    with Domain() as domain, Nodes(SCENE, domain.id) as nodes, Graph(domain.id) as graph:
        print(f'Running three nodes on {SCENE.name}, ROS_DOMAIN_ID {domain.id} ...', flush=True)
        received = [Received(mechanism, graph) for mechanism in mechanisms.values()]
        inverse = graph.node.create_client(ServoInverse, 'servo_inverse')

        def wait(held):
            nodes.check()
            return held()

        graph.until(lambda: wait(lambda: all(one.is_complete for one in received)))
        print(f'Listening for {SECONDS:g} s ...', flush=True)
        end = time.monotonic() + SECONDS
        graph.until(lambda: wait(lambda: time.monotonic() > end), 2.0 * SECONDS)
        answer = graph.call(inverse, ServoInverse.Request(
            lever_angle=list(map(math.radians, LEVER_ANGLES))))
        for name, code in nodes.stop().items():
            if code != 0:
                raise DemoError(f'{name} ended with exit code {code} when it was terminated')
    start = max(one.read() for one in received)
    for one in received:
        one.start = start
    return received, answer


def report_motions(received):
    """Print a line for each mechanism; raise DemoError if the length of a bar is wrong."""
    print('\nmechanism        messages  rate [Hz]  length error  traced curve [m]')
    for one in received:
        print(f'{one.mechanism.name:14} {len(one.times):10} {one.rate:10.1f}  '
              f'{one.length_error():12.1e}  {" x ".join(f"{side:.3g}" for side in one.extent)}')
    print('(length error: largest of all bars and messages, as a part of the longest bar)')
    worst = max(one.length_error() for one in received)
    if not worst <= TOLERANCE:
        raise DemoError(f'the length of a bar is wrong by {worst:.1e} of the longest bar')


def report_answer(mechanism, answer):
    """Print a line for each lever angle; raise DemoError if a response is wrong."""
    a, b, e = (mechanism.linkage.dimensions[key] for key in 'abe')
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


def draw(received):
    """Draw a picture of each mechanism, and an animation of all, from their messages."""
    OUT.mkdir(exist_ok=True)
    print(f'\nDrawing the messages to {OUT} ...', flush=True)
    for one in received:
        picture = Picture([one.mechanism], PORTRAIT_SIZE, 'whole', DEFAULT, [one])
        picture.arrange([PORTRAIT_TURNS])
        files.still(picture, PORTRAIT_TURNS, OUT / f'{one.mechanism.name}.png')
    picture = Picture([one.mechanism for one in received], ANIMATION_SIZE, 'whole',
                      DEFAULT_IN_MOTION - {'axes'}, received)
    times = np.arange(0.0, ANIMATED_SECONDS, 1.0 / FRAMES_PER_SECOND) / picture.period
    picture.arrange(times)
    files.gif(picture, times, FRAMES_PER_SECOND, 0, COLOURS, OUT / 'all.gif', iter)
    print(*(f'  {file.name}' for file in sorted(OUT.iterdir())), sep='\n')


if __name__ == '__main__':
    sys.exit(main())
