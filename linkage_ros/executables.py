# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The executables that run until a signal, which ends them without a traceback at any time."""

from collections.abc import Callable
from importlib import import_module

from .nodes import shutdown


def _executable(module: str) -> Callable[[], None]:
    return lambda: shutdown.run(lambda: import_module(f'{__package__}.{module}').main())


crank_driver = _executable('nodes.crank_driver')
kinematics = _executable('nodes.kinematics')
scene = _executable('nodes.scene_process')
servo_inverse = _executable('nodes.servo_inverse')
viewer = _executable('web.viewer')
