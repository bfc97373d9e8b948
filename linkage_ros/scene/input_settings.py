# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Settings of an input: its motion (speed, start, sweep) and its source joint in messages."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import Any, Iterable

from .parameters import DRIVER, Field, SceneError, Values
from ..linkage import Arc, Input, Mechanism
from ..words import truncated

# Distance of a default sweep from each end of the reach, as a fraction of the reach.
SWEEP_MARGIN = 0.01
# Letters of the intervals in a message, at most: gears may have hundreds.
MAX_ARCS = 200
# Largest angle [rad] whose rounding error is negligible for a crank.
MAX_POSITION = 1e6
MAX_SPEED = 100.0
# Farthest start of an angle [rad], if its period is no longer.
MAX_START = 4.0 * math.pi


def is_sweep(ends: tuple[float, ...]) -> bool:
    """Return whether there is a lower and a higher end, or none."""
    return not ends or len(ends) == 2 and -MAX_POSITION <= ends[0] < ends[1] <= MAX_POSITION


def is_ratio(ratio: float) -> bool:
    """Return whether positions of a source, input divided by ratio, are finite numbers."""
    return 1e-30 <= abs(ratio) <= 1e30


SPEED = Field('double', 'Speed of the {0} [{unit}].', (-MAX_SPEED, MAX_SPEED), readers=(DRIVER,),
              unit='{1}/s', group='speeds')
START = Field('double', 'Initial value of the {0} [{unit}]; a new value moves it there.',
              default=0.0, readers=(DRIVER,), unit='{1}', group='starts')
SWEEP = Field('double_array', "Ends of the {0}'s oscillation [{unit}]; empty: its reach, or full "
              'rotation.', default=(), unit='{1}',
              rule=f'the lower end and the higher end, within {MAX_POSITION:g} of zero, or none',
              holds=is_sweep)
SOURCE = Field('string', 'Source joint, whose position in messages gives the {0}; empty: '
               '<mechanism>_ and the name of the {0} or of the measured output.', default='',
               read_only=True)
MEASURES = Field('string', 'Output that the source joint measures; empty: the {0} itself.',
                 default='', read_only=True)
RATIO = Field('double', 'Motion of the {0} per unit of its source joint [1].', default=1.0,
              holds=is_ratio, rule='of a size from 1e-30 to 1e30')
OFFSET = Field('double', 'Value of the {0} when its source joint is at zero [{unit}].',
               default=0.0, unit='{1}')


@dataclass(frozen=True)
class InputSettings:
    """
    Motion of an input, and the joint in messages that gives its position: its source joint.

    Values of the input are in rad or m; lengths include the scale.

    Attributes
    ----------
    input : Input
        The input of the linkage.
    reach : tuple of (float, float)
        Intervals of the input in which the linkage can be assembled.
    speed : float
        Speed of the motion [rad/s or m/s].
    start : float
        Initial value of the motion; outside the sweep, this begins at its nearer end.
    sweep : (float, float), optional
        Interval in which the motion oscillates; None: it is a full rotation.
    ends : (float, float), optional
        The sweep if a user has set it. The inverse, too, is then limited to it. None: no limit
        but the reach.
    source : str
        Name of the source joint.
    ratio : float
        At a position p of the source joint, the input or measured output is ratio * p + offset.
    offset : float
        See `ratio` [rad or m].
    measures : str
        Output that the source joint, a sensor, measures; empty: it is the input itself.

    """

    input: Input
    reach: tuple[Arc, ...]
    speed: float
    start: float
    sweep: Arc | None
    ends: Arc | None
    source: str
    ratio: float
    offset: float
    measures: str

    @property
    def arcs(self) -> tuple[Arc, ...]:
        """Return the sweep that a user has set, or else the arcs of the reach."""
        return (self.ends,) if self.ends else self.reach

    @property
    def actuator(self) -> tuple[float, float]:
        """Ratio and offset from the actuator to the input; (1, 0) if the source is a sensor."""
        return (1.0, 0.0) if self.measures else (self.ratio, self.offset)


def in_words(arcs: Iterable[Arc]) -> str:
    """Return intervals as text, such as '[0, 1] or [2, 3]'; of many, the first ones."""
    return truncated(' or '.join(f'[{low:.6g}, {high:.6g}]' for low, high in arcs), MAX_ARCS)


def reach_of(linkage: Mechanism, input_: Input) -> tuple[Arc, ...]:
    """Return the reach of an input [rad or m]; that of one of several depends on the others."""
    return ((input_.low, input_.high),) if len(linkage.inputs) > 1 else tuple(linkage.reach())


def read_settings(name: str, linkage: Mechanism, input_: Input, scale: float, values: Values
                  ) -> InputSettings:
    """Read the settings of an input; its lengths are those of the linkage times `scale`."""
    key, default_speed, reach = input_.name, 1.0, reach_of(linkage, input_)
    if not input_.is_angle:
        input_ = input_._replace(low=scale * input_.low, high=scale * input_.high)
        reach = tuple((scale * low, scale * high) for low, high in reach)
        stroke = max(high - low for low, high in reach)
        default_speed = float(f'{min(stroke / 3.0, MAX_SPEED):.2g}')

    def take(setting: str, field: Field, default: Any = None, **about: Any) -> Any:
        return values.take(f'{key}.{setting}', field.about(key, input_.unit, **about), default)

    is_whole = input_.is_whole(reach)
    farthest = max(MAX_START, input_.high)
    speed = take('speed', SPEED, default_speed)
    start = take('start', START, ends=(-farthest, farthest) if input_.is_angle else None)
    sweep = ends = take('sweep', SWEEP) or None
    source, measures = take('source', SOURCE), take('measures', MEASURES)
    if ends and not is_whole and not any(input_.holds(arc, *ends) for arc in reach):
        raise SceneError(f'{name}.{key}.sweep must be inside the reach {in_words(reach)} '
                         f'{input_.unit}, not {list(ends)}')
    if measures:
        try:
            if len(linkage.inputs) > 1:
                raise ValueError('only a linkage with one input can be solved for an output, and '
                                 f'{name} has {len(linkage.inputs)}')
            linkage.check_output(measures)
        except ValueError as error:
            raise SceneError(f'{name}.{key}.measures: {error}') from None
    if not ends and not is_whole:
        low, high = next((arc for arc in reach if input_.holds(arc, start, start)), reach[0])
        sweep = low + SWEEP_MARGIN * (high - low), high - SWEEP_MARGIN * (high - low)
    return InputSettings(input_, reach, speed, start, sweep, ends,
                         source or f'{name}_{measures or key}', take('ratio', RATIO),
                         take('offset', OFFSET), measures)
