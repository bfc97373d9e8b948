# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The executables that run until a signal, which ends them without a traceback at any time."""

from collections.abc import Callable
from importlib import import_module
import os
import signal
import sys


def _executable(module: str) -> Callable[[], None]:
    def start() -> None:
        # Importing ROS is too slow for a signal to wait; `ShutdownHandler` replaces this later.
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: os._exit(0))
        code = import_module(f'{__package__}.{module}').main()
        # A compiling thread would delay the end, and a second signal would change the exit code.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)

    return start


crank_driver = _executable('nodes.crank_driver')
kinematics = _executable('nodes.kinematics')
scene = _executable('nodes.scene_process')
servo_inverse = _executable('nodes.servo_inverse')
viewer = _executable('web.viewer')
