# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The stable formulas in C, in a module that cffi compiles around them."""

from importlib.util import module_from_spec, spec_from_file_location
import tempfile

import cffi
import numpy as np

from .compiled_c import CompiledC, POINTS, SOURCE, THIS_CPU
from .method import Method

_built = {}


class Cffi(CompiledC):
    """C behind cffi, single poses into a buffer that is reused, batches into a new array."""

    name = 'C through cffi'
    package = 'cffi'

    def prepare(self, kind, dimensions):
        """Compile, and look the linkage up."""
        self._points = POINTS[kind]
        self._width = 2 * len(self._points)
        self._ffi, library = module(self.flags)
        self._call = getattr(library, kind)
        self._dimensions = self._ffi.new('double[]', list(map(float, dimensions.values())))
        self._angle, self._row = (self._ffi.new('double[]', size) for size in (1, self._width))

    def solve(self, theta):
        """Return rows of points."""
        out = np.empty((theta.size, self._width))
        self._call(self._dimensions, self._ffi.from_buffer('double[]', theta), theta.size,
                   self._ffi.from_buffer('double[]', out))
        return out

    def solve_one(self, theta):
        """Return one row of points as floats."""
        self._angle[0] = theta
        self._call(self._dimensions, self._angle, 1, self._row)
        return self._ffi.unpack(self._row, self._width)


def module(flags):
    """Return ffi and library of the module that is compiled with some flags."""
    if flags not in _built:
        builder = cffi.FFI()
        builder.cdef('\n'.join(f'void {kind}(const double *, const double *, long, double *);'
                               for kind in Method.mechanisms))
        builder.set_source('_linkages', SOURCE.read_text(), extra_compile_args=list(flags),
                           libraries=['m'])
        with tempfile.TemporaryDirectory() as folder:
            spec = spec_from_file_location('_linkages', builder.compile(tmpdir=folder))
            made = module_from_spec(spec)
            spec.loader.exec_module(made)
        _built[flags] = made.ffi, made.lib
    return _built[flags]


METHODS = [Cffi('gcc -O3, this CPU', *THIS_CPU)]
