# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Mechanisms in C with their memories, whose actuators and joints are sent values."""

import ctypes

from c_libraries import loaded, UNWRITTEN
from linkage_ros.c_code import header
import numpy as np

# All that is given and written is an lkr_side: positions, velocities, efforts.
CALLER = """
static lkr_memory {name}_m;
void {name}_started(void) {{ lkr_begin(&{name}_model, &{name}_m); }}
int {name}_sent(int side, const lkr_side *from, lkr_side *to)
{{
    return (side ? lkr_joints_to_actuators : lkr_actuators_to_joints)(
        &{name}_model, &{name}_m, from, to);
}}
"""


def memories(requests, single=False):
    """Return the C of mechanisms, with the functions that `Memory` calls."""
    row = 'int row_size(void) { return LKR_MAX_JOINTS; }\n'
    return header.printed(requests, single) + row + ''.join(CALLER.format(
        name=request.mechanism.name) for request in requests)


def compiled(folder, mechanisms, *names, single=False):
    """Return a library with the actuators and joints of mechanisms."""
    return loaded(folder, memories([
        header.Request(mechanism, (), names) for mechanism in mechanisms], single))


class Memory:
    """The memory of one mechanism in C."""

    def __init__(self, library, mechanism, kind=float):
        self._send, self._n, self._shape, self._kind = (
            library[f'{mechanism.name}_sent'], len(mechanism.inputs), (3, library.row_size()),
            kind)
        library[f'{mechanism.name}_started']()

    def send(self, side, position, velocity=0.0, effort=0.0):
        """Return the status and the other side's positions, velocities, efforts: or UNWRITTEN."""
        arguments, found = (np.full(self._shape, each, self._kind) for each in (0.0, UNWRITTEN))
        for row, values in zip(arguments, (position, velocity, effort)):
            row[:self._n] = values
        status = self._send(side, *(ctypes.c_void_p(x.ctypes.data) for x in (arguments, found)))
        return status, found[:, :self._n]
