# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Node that answers which servo angle puts a slotted lever where it is wanted."""

import sys

import numpy as np

from . import node, scene

try:
    from linkage_interfaces.srv import ServoInverse as ServoInverseType
except ImportError as error:
    raise ImportError(
        'servo_inverse needs the service type linkage_interfaces/srv/ServoInverse; build it with '
        '"colcon build" at the root of linkage_ros and source install/setup.bash') from error

MOST_NAMED = 5


class ServoInverse(node.SceneNode):
    """Serves `servo_inverse` for the slotted levers of a scene."""

    def __init__(self, **kwargs):
        super().__init__(scene.INVERSE, **kwargs)
        self.create_service(ServoInverseType, 'servo_inverse', self.answer)

    def answer(self, request, response):
        """Fill in a response; what cannot be done is said in it, never raised."""
        response.success = False
        try:
            solve(self.scene, request, response)
        except ValueError as problem:
            response.message = str(problem)
        except Exception as problem:
            # A client waits for ever for a service that raised.
            self.get_logger().error(f'{request}: {problem!r}')
            response.message = f'internal error: {problem!r}'
        return response


def solve(scene_: scene.Scene, request, response):
    """
    Answer a request for lever angles [rad].

    Raises
    ------
    ValueError
        If the request as a whole cannot be answered.

    """
    lever = _lever(scene_, request.mechanism)
    wanted = np.array(request.lever_angle, float)
    near = np.array(request.servo_near, float)
    if not wanted.size:
        raise ValueError('lever_angle is empty; give at least one angle')
    if near.size not in (0, wanted.size):
        raise ValueError(f'servo_near must be empty or have one angle for each of the '
                         f'{wanted.size} in lever_angle, not {near.size}')
    if not np.isfinite(near).all():
        raise ValueError('servo_near must be finite')
    servo = np.asarray(lever.servo_angle(wanted, near if near.size else None))
    reachable = np.isfinite(servo)
    response.servo_angle = servo.tolist()
    response.reduction = np.asarray(lever.reduction(servo)).tolist()
    response.reachable = reachable.tolist()
    response.success = bool(reachable.all())
    response.message = '' if response.success else _complaint(lever, wanted[~reachable])


def _lever(scene_, name):
    levers = {key: machine.linkage for key, machine in scene_.machines.items()
              if hasattr(machine.linkage, 'servo_angle')}
    allowed = ', '.join(levers) or 'none: the scene has no slotted_lever'
    if name in levers:
        return levers[name]
    if name in scene_.machines:
        raise ValueError(f'{name} is a {scene_.machines[name].linkage.type}, not a slotted lever; '
                         f'allowed: {allowed}')
    if name:
        raise ValueError(f'there is no mechanism {name!r}; allowed: {allowed}')
    if len(levers) != 1:
        raise ValueError(f'mechanism may be empty only where there is one slotted lever; '
                         f'allowed: {allowed}')
    return next(iter(levers.values()))


def _complaint(lever, missed):
    named = ', '.join(f'{angle:.6g}' for angle in missed[:MOST_NAMED])
    more = f' and {missed.size - MOST_NAMED} more' if missed.size > MOST_NAMED else ''
    return (f'lever angles {named}{more} rad cannot be reached; the lever reaches '
            f'{scene.in_words(lever.lever_reach())} rad')


def main(args=None):
    """Run the node; return the exit code."""
    return node.run(ServoInverse, scene.INVERSE, args)


if __name__ == '__main__':
    sys.exit(main())
