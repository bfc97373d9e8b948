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

from functools import cached_property
import sys
from typing import List, NamedTuple

import numpy as np
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from . import node, reading, scene
from .planar import GRAZE
from .servo import TURN

try:
    from linkage_interfaces.srv import ServoInverse as ServoInverseType
except ImportError as error:
    raise ImportError(
        'servo_inverse needs the service type linkage_interfaces/srv/ServoInverse; build it with '
        '"colcon build" at the root of linkage_ros and source install/setup.bash') from error

# Angles beyond this [rad] have lost digits that a servo needs.
FARTHEST = 1e6
MOST_NAMED, LONGEST = 5, 299
# An extreme is searched for among so many samples of the whole, then so often next to the best.
SAMPLES, ZOOMS = 721, 4
ANY = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)


class ServoInverse(node.SceneNode):
    """Serves `servo_inverse` for the mechanisms of a scene."""

    def __init__(self, **kwargs):
        super().__init__(scene.INVERSE, **kwargs)
        self._known, self._turned = {}, {}
        self._reader = reading.Reader()
        self.create_subscription(JointState, 'crank_states', self._turn, ANY, raw=True)
        self.create_service(ServoInverseType, 'servo_inverse', self.answer)

    def adopt(self, new):
        """Forget what was asked about."""
        self._known = {}

    def _turn(self, text):
        try:
            turned = self._reader.read(text)
        except Exception:
            # Whoever moves the linkage says that it cannot be read.
            return
        self._turned.update(zip(turned.names, turned.positions))

    def answer(self, request, response):
        """Fill in a response; what cannot be done is said in it, never raised."""
        response.success = False
        try:
            asked = self._asked(request.mechanism, request.output)
            solve(asked, request, response, self._turned.get(asked.crank))
        except ValueError as problem:
            response.message = _cut(problem)
        except Exception as problem:
            # A client waits for ever for a service that raised.
            self.get_logger().error(f'internal error: {problem!r}')
            response.message = _cut(f'internal error: {problem!r}')
        return response

    def _asked(self, mechanism, output):
        key = mechanism, output
        if key not in self._known:
            machine = _machine(self.scene, mechanism, wanted=_LEVER if not output else None)
            self._known[key] = Asked(machine, output or LEVER)
        return self._known[key]
