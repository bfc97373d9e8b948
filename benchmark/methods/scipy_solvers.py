# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The general solvers of scipy.optimize on the bars' equations, from the pose before."""

import math

import numpy as np
from scipy.optimize import fsolve, least_squares
import sympy as sp

from .method import columns, Follower
from .. import problems
from ..assembly import assembly, Dyad, Ray, Rigid

# Loops whose equations are met to this share count as closed, whatever the solver thinks.
CLOSED = 1e-9


class Equations:
    """
    The bars' equations of a linkage: unknown are the joints of dyads and rays, x and y in turn.

    Rigid points follow from the others, so they are worked out and not solved for.
    """

    def __init__(self, kind, dimensions):
        self._assembly = assembly(kind, dimensions)
        self._ground = {n: (z.real, z.imag) for n, z in self._assembly.ground.items()}
        self.unknown = [s.name for s in self._assembly.steps if not isinstance(s, Rigid)]

    def places(self, unknowns, pin):
        """Return {point: (x, y)} for a list of unknowns and the crank pin."""
        found = {**self._ground, 'A': pin}
        given = iter(unknowns)
        for step in self._assembly.steps:
            if isinstance(step, Rigid):
                (x, y), (u, v) = found[step.base], found[step.end]
                k = step.factor
                found[step.name] = (x + (u - x) * k.real - (v - y) * k.imag,
                                    y + (u - x) * k.imag + (v - y) * k.real)
            else:
                found[step.name] = next(given), next(given)
        return found

    def residuals(self, unknowns, pin):
        """Return what is left of every equation, two an unknown joint."""
        found = self.places(unknowns, pin)
        left = []
        for step in self._assembly.steps:
            if isinstance(step, Dyad):
                x, y = found[step.name]
                for other, bar in ((step.first, step.first_bar), (step.second, step.second_bar)):
                    u, v = found[other]
                    left.append((x - u) ** 2 + (y - v) ** 2 - bar ** 2)
            elif isinstance(step, Ray):
                (x, y), (u, v) = found[step.name], found[step.pivot]
                p, q = found[step.pin]
                left.append((x - u) ** 2 + (y - v) ** 2 - step.length ** 2)
                left.append((x - u) * (q - v) - (y - v) * (p - u))
        return left

    def pin(self, theta):
        """Return the crank pin at a crank angle."""
        return self._assembly.pin(math.cos(theta), math.sin(theta))


def compiled(equations):
    """
    Return functions (unknowns, pin) of the residuals and of their exact Jacobian.

    sympy writes them out. Left to themselves the solvers take differences over a share of each
    unknown, which is all rounding where a coordinate is close to zero.
    """
    unknowns = sp.symbols(f'u:{2 * len(equations.unknown)}')
    pin = sp.symbols('x y')
    left = sp.Matrix(equations.residuals(unknowns, pin))
    residuals, slopes = (sp.lambdify((unknowns, pin), written, 'math', cse=True)
                         for written in (list(left), left.jacobian(unknowns).tolist()))
    # On Python's floats: numpy's scalars would take several times as long.
    return (lambda guess, pin: residuals(guess.tolist(), pin),
            lambda guess, pin: slopes(guess.tolist(), pin))


class Scipy(Follower):
    """One solver at one tolerance."""

    package = 'scipy'

    def __init__(self, name, knob, solver):
        self.name, self.knob, self._solver = name, knob, solver

    def prepare(self, kind, dimensions):
        """Set the equations up."""
        self._equations = Equations(kind, dimensions)
        self._left, self._slopes = compiled(self._equations)
        self._points = problems.POINTS[kind]

    def start(self, theta, pose):
        """Take a pose as the one before."""
        self._before = [part for name in self._equations.unknown
                        for part in (pose[name].real, pose[name].imag)]

    def solve_one(self, theta):
        """Return {point: (x, y)}."""
        pin = self._equations.pin(theta)
        found = self._solver(self._left, self._slopes, self._before, pin)
        self._before = found.tolist()
        return self._equations.places(self._before, pin)

    def poses(self, answer):
        """Stack x and y."""
        answers = answer if isinstance(answer, list) else [answer]
        return columns(self._points, [[found[n] for n in self._points] for found in answers])


def _fsolve(tolerance):
    def solve(left, slopes, guess, pin):
        found, info, flag, message = fsolve(
            left, guess, (pin,), fprime=slopes, xtol=tolerance, full_output=True)
        # Where there is no further progress, the last digits may well have been reached.
        size = np.abs(found).max()
        if flag != 1 and np.abs(info['fvec']).max() > CLOSED * size * size:
            raise ArithmeticError(message)
        return found
    return solve


def _least_squares(tolerance):
    def solve(left, slopes, guess, pin):
        # MINPACK's own method has by far the least to do beside the equations.
        found = least_squares(left, guess, slopes, args=(pin,), method='lm', xtol=tolerance,
                              ftol=tolerance, gtol=tolerance)
        if not found.success:
            raise ArithmeticError(found.message)
        return found.x
    return solve


METHODS = [
    *(Scipy('scipy fsolve, pose before', f'xtol {tolerance:.0e}', _fsolve(tolerance))
      for tolerance in (1e-3, 1.5e-8, 1e-14)),
    *(Scipy('scipy least_squares, pose before', f'tol {tolerance:.0e}', _least_squares(tolerance))
      for tolerance in (1e-3, 1e-10)),
]
