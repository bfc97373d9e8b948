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

"""
The catalogue: mechanisms by the names that users type.

    from linkage_ros import mechanisms
    leg = mechanisms.create('jansen', m=15.0)
    leg.solve(0.5, points=('G',))
"""

from functools import lru_cache
from types import MappingProxyType

from . import jansen, peaucellier, slotted_lever, water_drop
from ..mechanism import Mechanism, Structure, checked_branches, checked_dimensions

TYPES = MappingProxyType({m.DESIGN.name: m for m in (
    water_drop, jansen, peaucellier, slotted_lever)})


@lru_cache(maxsize=None)
def _structure(type_, branches):
    return Structure(TYPES[type_].DESIGN, dict(branches))


def _module(type_):
    if type_ not in TYPES:
        raise ValueError(f'unknown mechanism type {type_!r}; allowed: {", ".join(TYPES)}')
    return TYPES[type_]


def defaults(type_: str, /) -> dict:
    """Return the catalogue dimensions [m] of a type; ValueError if there is no such type."""
    return dict(_module(type_).DESIGN.dimensions)


def create(type_: str, /, *, branches=None, **dimensions) -> Mechanism:
    """
    Make a mechanism of the catalogue.

    Parameters
    ----------
    type_ : str
        One of TYPES.
    branches : mapping, optional
        Assembly signs, +1 or -1, by name; what is left out is as in the catalogue.
    **dimensions : float or array-like
        Lengths [m]; what is left out is as in the catalogue. Arrays are broadcast against the
        crank angle.

    Returns
    -------
    Mechanism

    Raises
    ------
    ValueError
        For an unknown type, dimension or branch, and for a dimension that is not a finite
        positive number; the text says what is allowed.

    """
    module = _module(type_)
    design = module.DESIGN
    signs = checked_branches(design, branches)
    lengths = checked_dimensions(design, dimensions)
    structure = _structure(type_, tuple(signs.items()))
    return getattr(module, 'Mechanism', Mechanism)(design, structure, lengths, signs)
