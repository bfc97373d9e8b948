# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

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
