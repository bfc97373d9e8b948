# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The catalogue: mechanisms by the names that users type.

::

    from linkage_ros import mechanisms
    leg = mechanisms.create('jansen', m=15.0)
    leg.solve(0.5, points=('G',))

    mechanisms.create('custom', d=0.08, joints=(
        'O ground 0 0', 'Q ground d 0', 'A crank O 0.03', 'B dyad A Q 0.07 0.05 left'))
"""

from importlib import import_module
import pkgutil
from types import MappingProxyType, ModuleType
from typing import Iterable, Mapping, Sequence

from numpy.typing import ArrayLike

from . import custom
from ..linkage import checked_branches, checked_dimensions, Design, Mechanism
from ..words import plain_text, short_repr, suggestion

# The mechanisms of a scene without names, and their scales: they are 0.5 m to 1.5 m in size.
CATALOGUE: Mapping[str, float] = MappingProxyType({
    'water_drop': 0.1, 'jansen': 0.005, 'peaucellier': 0.1, 'slotted_lever': 0.002})

WRITTEN = tuple(custom.WORDS)
# The modules of this folder by type, those of CATALOGUE first.
TYPES: Mapping[str, ModuleType] = MappingProxyType({
    name: import_module(f'{__name__}.{name}') for name in dict.fromkeys((*CATALOGUE, *sorted(
        module.name for module in pkgutil.iter_modules(__path__) if module.name != 'custom')))})


def design(type_: str, /, joints: Sequence[str] | None = None, tracer: str | None = None,
           dimensions: Iterable[str] = ()) -> Design:
    """
    Return the design of a type: its dimensions, joints, branches and tracer.

    For 'custom' and 'rods' these follow from the lines of `joints` and the names of
    `dimensions`.

    Raises
    ------
    ValueError
        For an unknown type or an invalid line; the text names what is allowed.

    """
    if not isinstance(type_, str) or type_ not in (*TYPES, *WRITTEN):
        raise ValueError(f'unknown mechanism type {short_repr(type_)}'
                         f'{suggestion(type_, (*TYPES, *WRITTEN), 200)}')
    if type_ in WRITTEN:
        return custom.checked_design(plain_text(type_), joints, tracer, dimensions)
    if joints is not None or tracer is not None:
        raise ValueError(f'joints and tracer are for type '
                         f'{" or ".join(WRITTEN)}, not for {type_}')
    return TYPES[type_].DESIGN


def defaults(type_: str, /) -> dict:
    """Return the dimensions [m] of a type; ValueError if it is not in the catalogue."""
    if not isinstance(type_, str) or type_ not in TYPES:
        raise ValueError(f'no defaults for type {short_repr(type_)}; allowed: {", ".join(TYPES)}')
    return dict(TYPES[type_].DESIGN.dimensions)


def create(type_: str, /, *, branches: Mapping[str, int] | None = None,
           joints: Sequence[str] | None = None, tracer: str | None = None,
           **dimensions: ArrayLike) -> Mechanism:
    """
    Create a mechanism.

    Parameters
    ----------
    type_ : str
        One of TYPES, 'custom' or, for linkages in space, 'rods'.
    branches : mapping, optional
        Assembly signs, +1 or -1, by joint. Default: those of the catalogue or of the joint lines.
    joints : sequence of str, optional
        One line per joint: for type 'custom' as the page "Joint lines" of the documentation
        describes, for type 'rods' as "Rods in space" does.
    tracer : str, optional
        For type 'custom' or 'rods': the joint whose curve is the locus. Default: the last.
    **dimensions : float or array-like
        Lengths [m]. Default: those of the catalogue. Arrays are broadcast against the crank
        angle.

    Returns
    -------
    Mechanism

    Raises
    ------
    ValueError
        For an unknown type, dimension or branch, a dimension that is out of range, and an invalid
        line; the text names what is allowed.

    """
    chosen = design(type_, joints, tracer, dimensions)
    lengths = checked_dimensions(chosen, dimensions)
    signs = checked_branches(chosen, branches)
    kind = getattr(TYPES.get(chosen.name), 'Mechanism', Mechanism)
    made = kind(chosen, lengths, signs)
    made.check()
    return made
