# Copyright 2026 linkage_ros contributors
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
from typing import Dict, Iterable, Mapping, Optional, Sequence

from numpy.typing import ArrayLike

from . import custom
from ..linkage.arguments import checked_branches, checked_dimensions
from ..linkage.design import Design
from ..linkage.mechanism import Mechanism
from ..words import quoted

# What a scene shows when it names no mechanism, and its scale: from 0.5 m to 1.5 m in size.
CATALOGUE = {'water_drop': 0.1, 'jansen': 0.005, 'peaucellier': 0.1, 'slotted_lever': 0.002}

CUSTOM = 'custom'


def _found() -> Dict[str, ModuleType]:
    """Return the modules of this folder by the type that each is: those of CATALOGUE first."""
    names = [module.name for module in pkgutil.iter_modules(__path__) if module.name != CUSTOM]
    return {name: _module(name) for name in dict.fromkeys((*CATALOGUE, *sorted(names)))}


def _module(name: str) -> ModuleType:
    """Import a mechanism; raise ImportError, with its name, for what is none."""
    try:
        module = import_module(f'{__name__}.{name}')
        called = module.DESIGN.name
    except Exception as error:
        raise ImportError(f'{__name__}.{name} is no mechanism: {error}') from error
    if called != name:
        raise ImportError(f'{__name__}.{name} must have the name of its design, {quoted(called)}')
    return module


TYPES = MappingProxyType(_found())


def design(type_: str, /, joints: Optional[Sequence[str]] = None, tracer: Optional[str] = None,
           dimensions: Iterable[str] = ()) -> Design:
    """
    Return what a type is: its dimensions, joints, branches and tracer.

    For 'custom' these follow from the lines of `joints` and the names of the dimensions given.

    Raises
    ------
    ValueError
        For an unknown type or a bad line; the text says what is allowed.

    """
    if not isinstance(type_, str) or type_ not in (*TYPES, CUSTOM):
        raise ValueError(f'unknown mechanism type {quoted(type_)}; '
                         f'allowed: {", ".join((*TYPES, CUSTOM))}')
    if type_ == CUSTOM:
        return custom.given(joints, tracer, dimensions)
    if joints is not None or tracer is not None:
        raise ValueError(f'joints and tracer are for type custom, not for {type_}')
    return TYPES[type_].DESIGN


def defaults(type_: str, /) -> dict:
    """Return the dimensions [m] of a type; ValueError if it is not in the catalogue."""
    if not isinstance(type_, str) or type_ not in TYPES:
        raise ValueError(f'no defaults for type {quoted(type_)}; allowed: {", ".join(TYPES)}')
    return dict(TYPES[type_].DESIGN.dimensions)


def create(type_: str, /, *, branches: Optional[Mapping[str, int]] = None,
           joints: Optional[Sequence[str]] = None, tracer: Optional[str] = None,
           **dimensions: ArrayLike) -> Mechanism:
    """
    Make a mechanism.

    Parameters
    ----------
    type_ : str
        One of TYPES, or 'custom'.
    branches : mapping, optional
        Assembly signs, +1 or -1, by joint; what is left out is as in the catalogue or as written.
    joints : sequence of str, optional
        For type 'custom': one line a joint, as `linkage.joint_lines` describes.
    tracer : str, optional
        For type 'custom': the joint whose curve is the locus. Default: the last.
    **dimensions : float or array-like
        Lengths [m]; what is left out is as in the catalogue. Arrays are broadcast against the
        crank angle.

    Returns
    -------
    Mechanism

    Raises
    ------
    ValueError
        For an unknown type, dimension or branch, a dimension that is not a finite positive
        number, and a line that is wrong; the text says what is allowed.

    """
    chosen = design(type_, joints, tracer, dimensions)
    lengths = checked_dimensions(chosen, dimensions)
    signs = checked_branches(chosen, branches)
    kind = getattr(TYPES.get(chosen.name), 'Mechanism', Mechanism)
    made = kind(chosen, lengths, signs)
    made.check()
    return made
