# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The stable formulas in C, compiled on the spot: the limit of what this machine can do."""

import atexit
import ctypes
from pathlib import Path
import platform
import shutil
import subprocess
import tempfile

import numpy as np

from .method import columns, Method

if not shutil.which('gcc'):
    raise ImportError('gcc is not installed')

SOURCE = Path(__file__).with_name('linkages.c')
POINTS = {
    'water_drop': ('A', 'B', 'P'),
    'jansen': ('A', 'C', 'D', 'E', 'F', 'G'),
    'peaucellier': ('A', 'B', 'C', 'D'),
    'slotted_lever': ('A', 'L'),
}


class CompiledC(Method):
    """C behind ctypes, single poses into a buffer that is kept, batches into a new array."""

    name = 'C through ctypes'
    kind = 'limit'

    def __init__(self, knob, *flags):
        self.knob = knob
        self.flags = flags

    def prepare(self, kind, dimensions):
        """Compile, and look the linkage up."""
        self._points = POINTS[kind]
        self._width = 2 * len(self._points)
        self._lengths = np.array(list(dimensions.values()), float)
        self._function = getattr(ctypes.CDLL(str(library(self.flags))), kind)
        self._function.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_long,
                                   ctypes.c_void_p]
        self._function.restype = None
        self._at = self._lengths.ctypes.data
        self._angle = ctypes.c_double()
        self._row = (ctypes.c_double * self._width)()
        self._angle_at = ctypes.addressof(self._angle)
        self._row_at = ctypes.addressof(self._row)

    def solve(self, theta):
        """Return rows of points."""
        out = np.empty((theta.size, self._width))
        self._function(self._at, _address(theta), theta.size, _address(out))
        return out

    def solve_one(self, theta):
        """Return one row of points as floats."""
        self._angle.value = theta
        self._function(self._at, self._angle_at, 1, self._row_at)
        return self._row[:]

    def poses(self, answer):
        """Name the columns."""
        return columns(self._points, answer)


def _address(array):
    return array.__array_interface__['data'][0]


_built = {}


def library(flags):
    """Return the path of the library that the compiler makes with some flags."""
    if flags not in _built:
        folder = tempfile.mkdtemp(prefix='linkages-')
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        _built[flags] = Path(folder, 'linkages.so')
        subprocess.run(['gcc', *flags, '-shared', '-fPIC', SOURCE, '-o', _built[flags], '-lm'],
                       check=True)
    return _built[flags]


THIS_CPU = '-O3', '-march=native', '-fno-math-errno', '-fno-trapping-math'
METHODS = [CompiledC('gcc -O3', '-O3'), CompiledC('gcc -O3, this CPU', *THIS_CPU)]
if platform.machine() == 'x86_64':
    METHODS.append(CompiledC('gcc -O3, this CPU, vector sine', *THIS_CPU,
                             '-DVECTOR_SINE'))
