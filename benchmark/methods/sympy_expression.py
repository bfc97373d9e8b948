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
A closed form derived by sympy and turned into code by it.

sympy solves the two circles of a dyad; the chain is put together from that solution, with common
subexpressions taken out.
"""

import numpy as np
import sympy as sp

from .method import columns, Method
from ..assembly import assembly, Dyad, Ray, Rigid


class Lambdified(Method):
    """Single poses through the math module, batches through numpy."""

    name = 'sympy, lambdified'
    knob = 'cse'
    package = 'sympy'

    def prepare(self, kind, dimensions):
        """Derive and generate."""
        linkage = assembly(kind, dimensions)
        self._points = linkage.points
        theta = sp.Symbol('theta', real=True)
        outputs = [part for name in self._points for part in _places(linkage, theta)[name]]
        self.solve_one = sp.lambdify(theta, outputs, 'math', cse=True)
        self._batch = sp.lambdify(theta, outputs, 'numpy', cse=True)

    def solve(self, theta):
        """Return the columns, as the generated code does."""
        return self._batch(theta)

    def poses(self, answer):
        """Name the columns."""
        return columns(self._points, np.stack(np.broadcast_arrays(*answer), -1))


def _places(linkage, theta):
    sine, cosine = sp.sin(theta), sp.cos(theta)
    found = {name: (z.real, z.imag) for name, z in linkage.ground.items()}
    found['A'] = linkage.pin(cosine, sine)
    for step in linkage.steps:
        if isinstance(step, Dyad):
            side = step.side or sp.Piecewise((1, sine >= 0), (-1, True))
            found[step.name] = _dyad(step, found[step.first], found[step.second], side)
        elif isinstance(step, Rigid):
            k = step.factor
            found[step.name] = _along(found[step.base], found[step.end], k.real, k.imag)
        elif isinstance(step, Ray):
            (x, y), (u, v) = found[step.pivot], found[step.pin]
            ratio = step.length / sp.sqrt((u - x) ** 2 + (v - y) ** 2)
            found[step.name] = x + (u - x) * ratio, y + (v - y) * ratio
    return found


def _dyad(step, first, second, side):
    """Put a dyad's bars into the solution of |X - P|^2 = p^2, |X - Q|^2 = q^2 for X."""
    d2 = sp.Symbol('d2', positive=True)
    u, v, p, q = sp.symbols('u v p q', real=True)
    circles = [(u ** 2 + v ** 2) * d2 - p ** 2, ((u - 1) ** 2 + v ** 2) * d2 - q ** 2]
    solution = max(sp.solve(circles, [u, v], dict=True),
                   key=lambda s: s[v].subs({d2: 1, p: 1, q: 1}))
    (x, y), (s, t) = first, second
    given = {p: step.first_bar, q: step.second_bar, d2: (s - x) ** 2 + (t - y) ** 2}
    return _along(first, second, solution[u].subs(given), side * solution[v].subs(given))


def _along(base, end, u, v):
    x, y = end[0] - base[0], end[1] - base[1]
    return base[0] + x * u - y * v, base[1] + x * v + y * u


METHODS = [Lambdified()]
