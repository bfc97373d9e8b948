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
Run a scene's nodes, listen to them from outside, check what they sent, and draw it.

Ends with an error if anything is missing, if a bar's length is off, or if a node does not end
well when it is terminated.
"""

import math
from pathlib import Path
import signal
import sys

HERE = Path(__file__).parent

try:
    from domains import Domain
    from linkage_ros import command, scene
    from linkage_ros.render import files
    from linkage_ros.render.parts import DEFAULT, DEFAULT_IN_MOTION
    from linkage_ros.render.picture import Picture
    from listener import Listener
    from motion import lever_error, Motion
    from nodes import DemoError, Nodes
    import numpy as np
except ImportError as error:
    sys.exit(f'demo: {error}; `make demo` installs and builds what is needed')

SCENE = HERE.parent / 'config' / 'all.yaml'
OUT = HERE / 'out'
SECONDS = 10.0

PORTRAIT_SIZE, PORTRAIT_ANGLE = (720, 720), 1.0
ANIMATION_SIZE, ANIMATED_SECONDS, FRAMES_PER_SECOND, COLOURS = (1040, 300), 2.0 * math.pi, 12.0, 24

# Lever angles [degrees] for the service; the last is out of reach.
LEVER_ANGLES = (-30.0, -15.0, 0.0, 15.0, 30.0, 45.0)
LENGTH_TOLERANCE = 1e-12
ANGLE_TOLERANCE = 1e-12

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
    machines = list(scene.load(SCENE).machines.values())
    try:
        motions, answer = observe(machines)
    except RuntimeError as error:
        raise DemoError(error) from None
    report_motions(motions)
    report_answer(next(m for m in machines if m.linkage.type == 'slotted_lever'), answer)
    draw(motions)
    print(NEXT)


def observe(machines):
    """Return what the mechanisms sent, and what the service answered."""
    names = [machine.name for machine in machines]
    with Domain() as domain, Nodes(SCENE, domain.id) as nodes, \
            Listener(names, domain.id, nodes.check) as listener:
        print(f'Running three nodes on {SCENE.name}, ROS_DOMAIN_ID {domain.id} ...', flush=True)
        listener.discover()
        print(f'Listening for {SECONDS:g} s ...', flush=True)
        listener.listen(SECONDS)
        answer = listener.servo_angles([math.radians(angle) for angle in LEVER_ANGLES])
        for name, code in nodes.stop().items():
            if code != 0:
                raise DemoError(f'{name} ended with exit code {code} when it was terminated')
    return [Motion(machine, listener.joint_states[machine.name], listener.markers[machine.name],
                   listener.locus[machine.name][-1]) for machine in machines], answer


def report_motions(motions):
    """Print a line a mechanism; raise DemoError if a bar's length is off."""
    print('\nmechanism      joint states  markers  rate [Hz]  length error  traced curve [m]')
    worst = 0.0
    for motion in motions:
        error = motion.length_error()
        worst = max(worst, error)
        width, height = motion.extent
        print(f'{motion.machine.name:14} {motion.joint_states:12} {len(motion.times):8} '
              f'{motion.rate:10.1f}  {error:12.1e}  {width:.3g} x {height:.3g}')
    print('(length error: largest of all bars and messages, as a part of the longest bar)')
    if not worst <= LENGTH_TOLERANCE:
        raise DemoError(f'a bar is off by {worst:.1e} of the longest bar, more than '
                        f'{LENGTH_TOLERANCE:.0e}')


def report_answer(machine, answer):
    """Print a line a lever angle; raise DemoError if the answer is not what was asked for."""
    print('\nlever [deg]  servo [deg]  d lever / d servo  error [rad]')
    for lever, servo, reduction, reachable in zip(
            LEVER_ANGLES, answer.servo_angle, answer.reduction, answer.reachable):
        if reachable:
            error = lever_error(machine.linkage, math.radians(lever), servo)
            print(f'{lever:11.1f}  {math.degrees(servo):11.4f}  {reduction:17.6f}  {error:11.1e}')
            if not error <= ANGLE_TOLERANCE:
                raise DemoError(f'the servo angle for {lever:g} degrees puts the lever '
                                f'{error:.1e} rad off')
        else:
            print(f'{lever:11.1f}  unreachable')
    print(f'servo_inverse says: {answer.message}')
    if list(answer.reachable) != [True] * (len(LEVER_ANGLES) - 1) + [False]:
        raise DemoError('servo_inverse did not reach all lever angles but the last')


def draw(motions):
    """Draw each mechanism to a picture, and all of them moving side by side, as they were sent."""
    OUT.mkdir(exist_ok=True)
    print(f'\nDrawing what they sent to {OUT} ...', flush=True)
    for motion in motions:
        picture = Picture([motion.machine], PORTRAIT_SIZE, 'whole', DEFAULT, [motion])
        shown_at = motion.turns_to(PORTRAIT_ANGLE)
        picture.arrange([shown_at])
        files.still(picture, shown_at, OUT / f'{motion.machine.name}.png')
    # All at the same time.
    for motion in motions:
        motion.start = max(other.times[0] for other in motions)
    picture = Picture([motion.machine for motion in motions], ANIMATION_SIZE, 'whole',
                      DEFAULT_IN_MOTION - {'axes'}, motions)
    times = np.arange(0.0, ANIMATED_SECONDS, 1.0 / FRAMES_PER_SECOND) / picture.period
    picture.arrange(times)
    files.gif(picture, times, FRAMES_PER_SECOND, 0, COLOURS, OUT / 'all.gif', iter)
    print(*(f'  {file.name}' for file in sorted(OUT.iterdir())), sep='\n')


if __name__ == '__main__':
    sys.exit(main())
