# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Settings of an input: its motion (speed, start, sweep) and its source joint in messages."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import Iterable, Optional, Tuple

from .parameters import ALL, DRIVER, Field, SceneError, SPEEDS, STARTS, Values
from ..linkage import Arc, Input, Mechanism
from ..words import quoted

# Distance of a default sweep from each end of the reach, as a fraction of the reach.
MARGIN = 0.01
# Narrowest sweep [rad]; of a length, as a fraction of `Input.size`.
NARROWEST_SWEEP = 1e-6
# Turns of an input that never repeats, before they are counted from zero again.
NEVER = 1e12
# Intervals in a message, at most: gears may have hundreds.
MOST_ARCS = 8
# Largest angle [rad] whose rounding error is negligible for a crank.
FARTHEST = 1e6
FASTEST = 100.0

SPEED = Field('double', 'Speed of the {0} [{unit}].', -FASTEST, FASTEST, readers=(DRIVER,),
              unit='{1}/s', group=SPEEDS)
# Farthest start of an angle [rad], if its period is no longer.
FARTHEST_START = 4.0 * math.pi
START = Field('double', 'Initial value of the {0} [{unit}]; a new value moves it there.',
              readers=(DRIVER,), unit='{1}', group=STARTS)
SOURCE = Field('string', 'Source joint, whose position in messages gives the {0}; empty: '
               '<mechanism>_ and the name of the {0} or of the measured output.', readers=ALL,
               read_only=True)
MEASURES = Field('string', 'Output that the source joint measures; empty: the {0} itself.',
                 readers=ALL, read_only=True)
RATIO = Field('double', 'Motion of the {0} per unit of its source joint [1].', readers=ALL,
              rule='other than zero')
OFFSET = Field('double', 'Value of the {0} when its source joint is at zero [{unit}].',
               readers=ALL, unit='{1}')
SWEEP = Field('double_array', "Ends of the {0}'s oscillation [{unit}]; empty: its reach, or full "
              'rotation.', readers=ALL, unit='{1}',
              rule=f'the lower end and the higher end, within {FARTHEST:g} of zero, or none')


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
    speed, start : float
        Speed of the motion [rad/s or m/s], and its initial value.
    sweep : (float, float), optional
        Interval in which the motion oscillates; None: it is a full rotation.
    ends : (float, float), optional
        The sweep if a user has set it. The inverse, too, is then limited to it. None: no limit
        but the reach.
    source : str
        Name of the source joint.
    ratio, offset : float
        At a position p of the source joint, the input or the measured output is ratio * p + offset
        [rad or m].
    measures : str
        Output that the source joint, a sensor, measures; empty: it is the input itself.

    """

    input: Input
    reach: Tuple[Arc, ...]
    speed: float
    start: float
    sweep: Optional[Arc]
    ends: Optional[Arc]
    source: str
    ratio: float
    offset: float
    measures: str

    @property
    def period(self) -> int:
        """Return the turns of a crank after which poses repeat; above one with gears."""
        return int(min(self.input.period, NEVER))

    @property
    def default_speed(self) -> float:
        """Return the default of the speed [rad/s or m/s]."""
        return _default_speed(self.input, self.reach)

    @property
    def actuator(self) -> Tuple[float, float]:
        """Ratio and offset from the actuator to the input; (1, 0) if the source is a sensor."""
        return (1.0, 0.0) if self.measures else (self.ratio, self.offset)


def in_words(arcs: Iterable[Arc]) -> str:
    """Return intervals as text, such as '[0, 1] or [2, 3]'."""
    texts = [f'[{low:.6g}, {high:.6g}]' for low, high in arcs]
    return ' or '.join(texts if len(texts) <= MOST_ARCS else [
        *texts[:MOST_ARCS], f'{len(texts) - MOST_ARCS} more'])


def _scaled(input_: Input, linkage: Mechanism, reach: Tuple[Arc, ...],
            scale: float) -> Tuple[Input, Tuple[Arc, ...]]:
    """Return an input and its reach in the scene's units: lengths times the scale."""
    if len(linkage.inputs) > 1:
        # The reach of one of several inputs depends on the others.
        reach = ((input_.low, input_.high),)
    if input_.turns:
        return input_, reach
    return (input_._replace(low=scale * input_.low, high=scale * input_.high),
            tuple((scale * low, scale * high) for low, high in reach))


def read_settings(name: str, linkage: Mechanism, input_: Input, reach: Tuple[Arc, ...],
                  scale: float, values: Values, old: Optional[InputSettings],
                  strict: bool) -> InputSettings:
    """Read the settings of an input; its lengths are those of the linkage times `scale`."""
    settings = _read(name, *_scaled(input_, linkage, reach, scale), values, old, strict)
    _check_measures(name, linkage, settings)
    return settings


def _read(name: str, input_: Input, reach: Tuple[Arc, ...], values: Values,
          old: Optional[InputSettings], strict: bool) -> InputSettings:
    speed_field, start_field, sweep_field = (
        field.about(input_.name, input_.unit) for field in (SPEED, START, SWEEP))
    if input_.turns:
        farthest = max(FARTHEST_START, input_.high)
        start_field = start_field.about(low=-farthest, high=farthest)
    name = f'{name}.{input_.name}'
    speed = values.take(f'{name}.speed', speed_field, _default_speed(input_, reach))
    has_start = values.unused(f'{name}.start')
    start = values.take(f'{name}.start', start_field, 0.0)
    sweep = values.take(f'{name}.sweep', sweep_field, ())
    source = _source(name, input_, values)
    if sweep:
        _check_sweep(f'{name}.sweep', sweep, input_, reach)
    elif input_.is_whole(reach):
        return InputSettings(input_, reach, speed, start, None, None, *source)
    arcs = [sweep] if sweep else reach
    around_start = [arc for arc in arcs if input_.holds(arc, start, start)]
    low, high = (around_start or arcs)[0]
    margin = 0.0 if sweep else MARGIN * (high - low)
    settings = InputSettings(input_, reach, speed, start, (low + margin, high - margin),
                             tuple(sweep) or None, *source)
    is_free = not strict or old and (old.start, old.sweep) == (settings.start, settings.sweep)
    if has_start and not around_start and not is_free:
        raise SceneError(f'{name}.start must be inside the {"sweep" if sweep else "reach"} '
                         f'{in_words(arcs)} {input_.unit}, not {start}')
    return settings


def _source(name: str, input_: Input, values: Values) -> Tuple[str, float, float, str]:
    """Read source, ratio, offset and measures of an input."""
    source, measures, ratio, offset = (
        values.take(f'{name}.{key}', field.about(input_.name, input_.unit), default)
        for key, field, default in (('source', SOURCE, ''), ('measures', MEASURES, ''),
                                    ('ratio', RATIO, 1.0), ('offset', OFFSET, 0.0)))
    if not ratio:
        raise RATIO.error(f'{name}.ratio', ratio)
    mechanism = name.partition('.')[0]
    return source or f'{mechanism}_{measures or input_.name}', ratio, offset, measures


def _check_measures(name: str, linkage: Mechanism, settings: InputSettings) -> None:
    if not settings.measures:
        return
    key = f'{name}.{settings.input.name}.measures'
    if len(linkage.inputs) > 1:
        raise SceneError(f'{key} must be empty: only a linkage with one input can be solved for '
                         f'an output, and {name} has {len(linkage.inputs)}')
    try:
        linkage.check_output(settings.measures)
    except ValueError as error:
        raise SceneError(f'{key}: {error}') from None


def _default_speed(input_: Input, reach: Tuple[Arc, ...]) -> float:
    """Return the default speed: 1 rad/s, or about three seconds for a stroke."""
    if input_.turns:
        return 1.0
    return float(f'{min(max(high - low for low, high in reach) / 3.0, FASTEST):.2g}')


def _check_sweep(name: str, sweep: Tuple[float, ...], input_: Input,
                 reach: Tuple[Arc, ...]) -> None:
    if (len(sweep) != 2 or not sweep[0] + NARROWEST_SWEEP * input_.size <= sweep[1]
            or max(map(abs, sweep)) > FARTHEST):
        raise SWEEP.error(name, sweep)
    if not input_.is_whole(reach) and not any(input_.holds(arc, *sweep) for arc in reach):
        raise SceneError(f'{name} must be inside the reach {in_words(reach)} {input_.unit}, '
                         f'not {quoted(list(sweep))}')
