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

"""Node that answers which servo angle puts a lever, or any other output, where it is wanted."""

import math
from operator import itemgetter
import sys

import numpy as np

from . import node, scene

try:
    from linkage_interfaces.srv import ServoInverse as ServoInverseType
except ImportError as error:
    raise ImportError(
        'servo_inverse needs the service type linkage_interfaces/srv/ServoInverse: run colcon '
        'build in the workspace, which builds linkage_interfaces too, and source '
        'install/setup.bash') from error

MOST_NAMED = 5
SAMPLES = 721


class ServoInverse(node.SceneNode):
    """Serves `servo_inverse` for the mechanisms of a scene."""

    def __init__(self, **kwargs):
        super().__init__(scene.INVERSE, **kwargs)
        self._known = {}
        self.create_service(ServoInverseType, 'servo_inverse', self.answer)

    def adopt(self, new):
        """Forget what was asked about."""
        self._known = {}

    def answer(self, request, response):
        """Fill in a response; what cannot be done is said in it, never raised."""
        response.success = False
        try:
            key = request.mechanism, request.output
            asked = self._known.get(key) or self._asked(*key)
            solve(asked, request, response)
            self._known[key] = asked
        except ValueError as problem:
            response.message = str(problem)
        except Exception as problem:
            # A client waits for ever for a service that raised.
            self.get_logger().error(f'{request}: {problem!r}')
            response.message = f'internal error: {problem!r}'
        return response

    def _asked(self, mechanism, output):
        if output:
            return Output(_machine(self.scene, mechanism), output)
        return Lever(_lever(self.scene, mechanism))


def solve(asked, request, response):
    """
    Answer a request for angles of a Lever [rad], or for values of an Output.

    Raises
    ------
    ValueError
        If the request as a whole cannot be answered.

    """
    wanted, near = request.lever_angle, request.servo_near
    if not wanted:
        raise ValueError('lever_angle is empty; give at least one value')
    if near and len(near) != len(wanted):
        raise ValueError(f'servo_near must be empty or have one angle for each of the '
                         f'{len(wanted)} in lever_angle, not {len(near)}')
    if not all(map(math.isfinite, near)):
        raise ValueError('servo_near must be finite')
    # One angle is the usual question, and floats answer it sooner than arrays.
    given = np.array if len(wanted) > 1 else itemgetter(0)
    found = asked.servo(given(wanted), given(near) if near else None)
    response.servo_angle, response.reduction = map(_listed, found)
    response.reachable = list(map(math.isfinite, response.servo_angle))
    response.success = all(response.reachable)
    response.message = '' if response.success else _complaint(asked, [
        value for value, reached in zip(wanted, response.reachable) if not reached])


def _listed(found):
    return np.ravel(found).tolist() if isinstance(found, np.ndarray) else [float(found)]


class Lever:
    """The lever of a slotted lever, in closed form."""

    what = 'lever angles'

    def __init__(self, linkage):
        self.servo = linkage.servo
        self._linkage = linkage

    def reach(self) -> str:
        """Return in words where the lever gets."""
        return f'the lever reaches {scene.in_words(self._linkage.lever_reach())} rad'


class Output:
    """
    Any output of a linkage with one crank: a link's joint angle or slide, a joint's coordinate.

    Raises
    ------
    ValueError
        If there is no such output.

    """

    def __init__(self, machine: scene.Machine, name: str):
        self.what = f'values of {name}'
        self._linkage, self._name = machine.linkage, name
        self._joint, _, self._axis = name.partition('.')
        slides = [link.name for link in machine.linkage.links if link.kind == 'prismatic']
        self._unit = machine.scale if self._axis or name in slides else 1.0
        if len(machine.linkage.cranks) > 1:
            raise ValueError(f'{machine.name} has several cranks; only a linkage with one can be '
                             'solved for an output')

    def servo(self, wanted, near):
        """Return for each value the crank angle [rad] and d output / d crank angle there."""
        found = self._linkage.crank_angle(self._name, wanted / self._unit, near)
        theta = found[..., 0] if near is None else found
        return theta, self._slope(theta) * self._unit

    def _slope(self, theta):
        if not self._axis:
            return self._linkage.joint_rates(theta, (self._name,))[self._name]
        moving = self._linkage.velocity(theta, (self._joint,))[self._joint]
        return moving[..., 'xy'.index(self._axis)]

    def reach(self) -> str:
        """Return in words where the output gets."""
        theta = np.concatenate([np.linspace(*arc, SAMPLES) for arc in self._linkage.reach()])
        found = (self._linkage.solve(theta, (self._joint,))[self._joint][
            ..., 'xy'.index(self._axis)] if self._axis
            else self._linkage.joint_angles(theta, (self._name,))[self._name])
        span = np.nanmin(found) * self._unit, np.nanmax(found) * self._unit
        return f'{self._name} lies within about {scene.in_words([span])}'


def _machine(scene_, name):
    machines = scene_.machines
    if name in machines:
        return machines[name]
    if name:
        raise ValueError(f'there is no mechanism {name!r}; allowed: {", ".join(machines)}')
    if len(machines) != 1:
        raise ValueError('mechanism may be empty only where there is one; '
                         f'allowed: {", ".join(machines)}')
    return next(iter(machines.values()))


def _lever(scene_, name):
    levers = {key: machine.linkage for key, machine in scene_.machines.items()
              if hasattr(machine.linkage, 'servo')}
    if name in levers:
        return levers[name]
    if not name and len(levers) == 1:
        return next(iter(levers.values()))
    allowed = ', '.join(levers) or 'none: the scene has no slotted_lever'
    if name in scene_.machines:
        raise ValueError(f'{name} is a {scene_.machines[name].linkage.type}, not a slotted lever; '
                         f'name an output, or take one of: {allowed}')
    if name:
        raise ValueError(f'there is no mechanism {name!r}; allowed: {allowed}')
    raise ValueError(f'mechanism may be empty only where there is one slotted lever; '
                     f'allowed: {allowed}')


def _complaint(asked, missed):
    named = ', '.join(f'{value:.6g}' for value in missed[:MOST_NAMED])
    more = f' and {len(missed) - MOST_NAMED} more' if len(missed) > MOST_NAMED else ''
    return f'{asked.what} {named}{more} cannot be reached; {asked.reach()}'


def main(args=None):
    """Run the node; return the exit code."""
    return node.run(ServoInverse, scene.INVERSE, args)


if __name__ == '__main__':
    sys.exit(main())
