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
Jansen's leg by the formula engine and by what could stand in its place.

CasADi and numba are handed the very operations of `linkage_ros.formula`, with the dimensions as
constants, so that only the engines differ; the plain functions are written by hand.
"""

import cmath
import math
import resource

import casadi as ca
import numpy as np

from .method import Method
from .numba_functions import Numba, OnOurs, Plain
from .. import problems

POINTS = problems.POINTS['jansen']


class MachineCode(Plain):
    """Machine code for arrays."""

    knob = 'LLVM'
    package = 'llvmlite'
    batches = Method.batches[1:]

    def prepare(self, kind, dimensions):
        """Make the machine code, too."""
        super().prepare(kind, dimensions)
        self._mechanism = self._mechanism.accelerated()
        self.solve(np.zeros(2))


class CasADi(OnOurs):
    """CasADi: its own interpreter, or C that it writes, on memory that both sides know."""

    package = 'casadi'
    operations = {
        'add': ca.plus, 'subtract': ca.minus, 'multiply': ca.times, 'divide': ca.rdivide,
        'negative': lambda x: -x, 'absolute': ca.fabs, 'less': ca.lt, 'less_equal': ca.le,
        'sin': ca.sin, 'cos': ca.cos, 'sqrt': ca.sqrt, 'where': ca.if_else,
        'root': lambda x, tolerance: ca.sqrt(ca.if_else(
            x > 0.0, x, ca.if_else(x >= -tolerance, 0.0, math.nan))),
        'gated': lambda x, margin, tolerance: ca.if_else(margin >= -tolerance, x, math.nan)}

    def __init__(self, knob, **options):
        self.knob, self._options = knob, options

    def make(self, listing, constants):
        """Build the function, and have it compiled."""
        operations, given, outputs = listing.operations()
        theta = ca.SX.sym('theta')
        values = dict(zip(given, constants))
        for number, name, args in operations:
            values[number] = (
                theta if name == 'angle' else args[0] if name == 'constant'
                else self.operations[name](*(values[arg] for arg in args)))
        row = ca.vertcat(*(values[number] for number in outputs))
        self._function = ca.Function('leg', [theta], [row], self._options)
        self._one, self._run_one = self._buffers(1)
        self._many = {}

    def _buffers(self, count):
        """Return the arrays for so many angles and their poses, and what runs on them."""
        function = self._function if count == 1 else self._function.map(count)
        buffer, run = function.buffer()
        theta, rows = np.zeros(count), np.zeros((count, 2 * len(POINTS)))
        buffer.set_arg(0, memoryview(theta))
        buffer.set_res(0, memoryview(rows))
        return (theta, rows, buffer), run

    def solve(self, theta):
        """Return rows of points."""
        if theta.size not in self._many:
            self._many[theta.size] = self._buffers(theta.size)
        (given, rows, _), run = self._many[theta.size]
        given[:] = theta
        run()
        return rows

    def solve_one(self, theta):
        """Return one row of points as floats."""
        given, rows, _ = self._one
        given[0] = theta
        self._run_one()
        return rows[0].tolist()


class ByHand(Method):
    """The leg alone, as complex functions: what one would write without an engine."""

    name, knob = 'by hand', 'complex functions'
    mechanisms = ('jansen',)

    def prepare(self, kind, dimensions):
        """Make a function for one pose and one for arrays."""
        self.solve_one = leg(cmath.exp, math.sqrt, **dimensions)
        self._many = leg(np.exp, np.sqrt, **dimensions)

    def solve(self, theta):
        """Return the complex places of the points."""
        return self._many(theta)

    def poses(self, answer):
        """Turn complex places into pairs."""
        return {name: np.stack([np.real(place), np.imag(place)], -1).reshape(-1, 2)
                for name, place in zip(POINTS, answer)}


def leg(exp, root, a, b, c, d, e, f, g, h, i, j, k, l, m):  # noqa: E741
    """Return Jansen's leg as a function of the crank angle [rad], for floats or arrays."""
    def dyad(first, second, side):
        long, short = (first + second) ** 2, (first - second) ** 2
        half = (first - second) * (first + second)
        side = 0.5j * side

        def joint(p, q):
            arm = q - p
            square = arm.real * arm.real + arm.imag * arm.imag
            return p + arm * (0.5 + (0.5 * half + side * root(
                (long - square) * (square - short))) / square)
        return joint

    def corner(base, first, second):
        u = 0.5 + (first - second) * (first + second) / (2 * base * base)
        return complex(u, math.sqrt((first / base) ** 2 - u * u))

    B, to_d, to_g = complex(-a, -l), corner(b, d, e), corner(g, i, h)
    to_c, to_e, to_f = dyad(b, j, 1), dyad(c, k, -1), dyad(g, f, 1)

    def pose(theta):
        A = m * exp(1j * theta)
        C = to_c(B, A)
        E = to_e(B, A)
        D = B + (C - B) * to_d
        F = to_f(E, D)
        return A, C, D, E, F, E + (F - E) * to_g
    return pose


def cpu():
    """Return the CPU time [s] of this process, its threads, and the compilers that it called."""
    return sum(used.ru_utime + used.ru_stime for used in map(
        resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))


def make_time(method, dimensions, rounds):
    """Return the least time [s] from the joint lines to the first pose."""
    took = []
    for _ in range(rounds):
        start = cpu()
        method.prepare('jansen', dimensions)
        method.solve_one(0.5)
        took.append(cpu() - start)
    return min(took)


COMPILED = {'jit': True, 'compiler': 'shell',
            'jit_options': {'flags': ['-O3', '-march=native'], 'verbose': False}}
METHODS = [Plain(), MachineCode(), CasADi('CasADi'), CasADi('CasADi, C by gcc -O3', **COMPILED),
           Numba(), ByHand()]
