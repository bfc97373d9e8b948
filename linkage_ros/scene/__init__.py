# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Scenes: which mechanisms there are, how large, where, and how their inputs move.

The only place that knows the names of parameters. `read` turns given values into a Scene, or says
in one sentence which parameter is wrong and what it may be; the scene's `parameters` are what a
node declares. No ROS is needed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field as some, replace
from functools import lru_cache
import math
import re
from typing import Any, Dict, List, Optional, Tuple

from .joint_names import check_distinct, JointName, read_joint_names
from .parameters import Field, Parameter, plain, SceneError, Values
from .. import mechanisms
from ..linkage.inputs import Arc, Input
from ..linkage.servo import Mechanism
from ..linkage.walker import Assembly
from ..words import elided, listed, quoted

__all__ = ['Drive', 'Machine', 'Parameter', 'Scene', 'SceneError', 'in_words', 'load', 'plain',
           'read']

DRIVER, KINEMATICS, INVERSE = ALL = 'crank_driver', 'kinematics', 'servo_inverse'
# Whose values of the parameters that several nodes act on count.
OWNER = KINEMATICS

# What an input that swings by default leaves of its reach at each end, as a part of its width.
MARGIN = 0.01
# The narrowest sweep, of a length as a part of its size.
NARROWEST_SWEEP = 1e-6
# Angles beyond this [rad] have lost digits that a crank needs.
FARTHEST = 1e6
FASTEST = 100.0

# What the client library declares for itself.
_ROS = re.compile(r'(use_sim_time|start_type_description_service|qos_overrides\..*)$')
_NAME = re.compile(r'(?=.{1,64}$)[A-Za-z](_?[A-Za-z0-9])*')


TYPES = (*mechanisms.TYPES, mechanisms.CUSTOM)

MECHANISMS = Field(
    'string_array', 'Names of the mechanisms in the scene.', readers=ALL, read_only=True,
    rule='at least one, each once, of up to 64 letters, digits and single underscores, '
         'a letter first', pattern=_NAME)
FRAME_ID = Field('string', 'Frame that the poses are in.', readers=(KINEMATICS,),
                 rule='1 to 100 letters, digits and _ . : - /, the first a letter, digit or _',
                 pattern=re.compile(r'\w[\w.:/-]{0,99}', re.ASCII))
FRAME_PREFIX = Field(
    'string', 'Put before the frames of markers and loci, as robot_state_publisher does.',
    readers=(KINEMATICS,),
    rule='up to 100 letters, digits and _ . : - /, the first a letter, digit or _',
    pattern=re.compile(r'(\w[\w.:/-]{0,99})?', re.ASCII))
RATE = Field('double', 'Crank messages in a second [Hz]; 0: none.', 0.0, 1000.0, readers=(DRIVER,))
TYPE = Field('string', 'Type of the mechanism.', readers=ALL, read_only=True,
             rule=f'one of {", ".join(TYPES)}')
JOINTS = Field('string_array', 'The linkage, one line a joint.', readers=ALL, read_only=True)
TRACER = Field('string', 'Joint whose curve is the locus; empty: the last.', readers=ALL,
               read_only=True)
DIMENSION = Field('double', 'Dimension {0} of the {1}, before scale [m].', positive=True,
                  readers=ALL)
BRANCH = Field('integer', 'Assembly sign {0} of the {1}; 0: the usual one.', -1, 1, readers=ALL)
SCALE = Field('double', 'Factor of every length.', positive=True, readers=(KINEMATICS, INVERSE))
LEG_PAIRS = Field('integer', 'Legs on one side of the crank, evenly spread over its turn.', 1, 50,
                  readers=(KINEMATICS,))
MIRRORED = Field('bool', 'Whether each leg has a mirror image on the other side; '
                 'if never set: where there is more than one pair.', readers=(KINEMATICS,))
POINTS = Field('string_array', 'Joints that are wanted in the markers.', readers=(KINEMATICS,))
POSE = Field('double_array', "Pose of the linkage's plane in frame_id: "
             'x, y, z [m], roll, pitch, yaw [rad].', rule='six of them', readers=(KINEMATICS,))
OWN_FRAME_ID = Field('string', "Frame that its pose is in; empty: the scene's.",
                     readers=(KINEMATICS,), rule=FRAME_PREFIX.rule, pattern=FRAME_PREFIX.pattern)
JOINT_NAMES = Field(
    'string_array', "The robot's own names of joints; a joint that is not listed keeps its name.",
    readers=(KINEMATICS,),
    rule="such as 'BC=left_shin', or 'EF=-left_ankle+0.35' for 0.35 minus its position")
ONLY_NAMED = Field('bool', 'Whether only the joints in joint_names are published.',
                   readers=(KINEMATICS,))
SPEED = Field('double', 'Speed of the {0} [{1}/s].', -FASTEST, FASTEST, readers=(DRIVER,))
START = Field('double', 'Where the {0} starts [{1}]; a new value moves it there.',
              readers=(DRIVER,))
SOURCE = Field('string', 'Joint in messages that tells of the {0}; empty: its name, or that of '
               'what is measured, after <mechanism>_.', readers=ALL, read_only=True)
MEASURES = Field('string', 'Output that the source measures, from which the {0} follows; empty: '
                 'the {0} itself.', readers=ALL, read_only=True)
RATIO = Field('double', 'How far the {0} moves for each unit of its source [1].', readers=ALL,
              rule='not zero')
OFFSET = Field('double', 'Where the {0} is when its source is at zero [{1}].', readers=ALL)
SWEEP = Field('double_array', 'Between which values [{1}] the {0} moves to and fro; '
              'empty: through its reach, or all round.', readers=ALL,
              rule=f'the lower end and the higher end, within {FARTHEST:g} of zero, or none')


@dataclass(frozen=True)
class Drive:
    """
    How an input moves, an angle [rad] or a length [m], the scale included.

    Attributes
    ----------
    input : Input
        What moves.
    reach : tuple of (float, float)
        Where it can be.
    speed, start : float
        How fast, and from where.
    sweep : (float, float), optional
        Between which ends it moves to and fro; None: it turns all round.
    ends : (float, float), optional
        The ends that were set, beyond which no answer lies either; None: all its reach.
    source : str
        The joint in messages that tells of it.
    ratio, offset : float
        It is ratio * position + offset; so is what is measured instead.
    measures : str
        The output that is measured instead; empty: the input itself.

    """

    input: Input
    reach: Tuple[Arc, ...]
    speed: float
    start: float
    sweep: Optional[Arc]
    ends: Optional[Arc] = None
    source: str = ''
    ratio: float = 1.0
    offset: float = 0.0
    measures: str = ''

    @property
    def is_plain(self) -> bool:
        """Whether its source tells the input as it is."""
        return (self.ratio, self.offset, self.measures) == (1.0, 0.0, '')


@dataclass(frozen=True)
class Machine:
    """A mechanism in a scene: one leg, its reach and scale, its legs, its look and its inputs."""

    name: str
    linkage: Mechanism
    reach: Tuple[Arc, ...]
    scale: float
    leg_pairs: int
    mirrored: bool
    points: Tuple[str, ...]
    pose: Tuple[float, ...]
    inputs: Mapping[str, Drive]
    frame_id: str
    joints: Mapping[str, JointName]
    only_named: bool
    given: Mapping[str, Any] = some(compare=False, repr=False)
    parameters: Tuple[Parameter, ...] = some(compare=False, repr=False)

    def is_of(self, given: Mapping[str, Any]) -> bool:
        """Return whether it was read from these very values."""
        return self.given.keys() == given.keys() and all(
            self.given[key] is value for key, value in given.items())

    @property
    def first(self) -> Drive:
        """The first input, for most linkages the only one."""
        return next(iter(self.inputs.values()))

    def scale_of(self, output: str) -> float:
        """Return by what an output is multiplied to be seen in the scene."""
        return 1.0 if self.linkage.is_angle(output) else self.scale

    def measured(self, output: str, value: float, near: float) -> Tuple[float, float]:
        """
        Return the input that an output tells [rad or m], and d output / d input there.

        It goes on from where it was near, without a jump where it can; NaN outside the reach or
        the sweep that is set.
        """
        drive, own, unit = self.first, self.scale_of(self.first.input.name), self.scale_of(output)
        ends = drive.ends and (drive.ends[0] / own, drive.ends[1] / own)
        found, rate = self.linkage.follow(output, value / unit, near / own)
        if not (ends[0] <= found <= ends[1] if ends else found == found):
            found, rate = map(float, self.linkage.servo_for(
                output, value / unit, near / own, ends))
        return found * own, rate * unit / own

    def understood(self, drive: Drive, position: float, speed: Optional[float],
                   near: Optional[float]) -> Tuple[float, Optional[float]]:
        """Return an input and its speed as its source tells, going on from where it was near."""
        value, speed = drive.ratio * position + drive.offset, speed and drive.ratio * speed
        if not drive.measures:
            return value, speed
        found, rate = self.measured(drive.measures, value, drive.start if near is None else near)
        return found, speed / rate if speed is not None and rate else None

    def told(self, drive: Drive, value: float, speed: float) -> Tuple[float, float]:
        """Return an input and its speed as its source would tell it."""
        if output := drive.measures:
            own, unit = self.scale_of(drive.input.name), self.scale_of(output)
            rate = float(self.linkage.joint_rates(value / own, [output])[output]) * unit / own
            value = float(self.linkage.joint_angles(value / own, [output])[output]) * unit
            speed = rate * speed
        return (value - drive.offset) / drive.ratio, speed / drive.ratio

    def assembly(self) -> Assembly:
        """Return its legs on their inputs."""
        return Assembly(self.linkage, self.leg_pairs, self.mirrored, self.scale, self.reach)

    @property
    def tracer(self) -> str:
        """The joint whose curve is shown, the linkage's own tracer if it is wanted."""
        return self.linkage.tracer if self.linkage.tracer in self.points else self.points[-1]


@dataclass(frozen=True)
class Scene:
    """Machines by name, the frame they are in, and the rate of the crank messages [Hz]."""

    machines: Mapping[str, Machine]
    frame_id: str
    frame_prefix: str
    rate: float
    general: Tuple[Parameter, ...]

    @property
    def parameters(self) -> Tuple[Parameter, ...]:
        """All parameters, the general ones first."""
        return (*self.general, *(parameter for machine in self.machines.values()
                                 for parameter in machine.parameters))

    def changed_from(self, old: 'Scene') -> List[Parameter]:
        """Return the parameters that have not the value that they have in a scene before."""
        parts = [(self.general, old.general), *(
            (machine.parameters, old.machines[name].parameters)
            for name, machine in self.machines.items() if machine is not old.machines[name])]
        before = {parameter.name: parameter.value for _, part in parts for parameter in part}
        return [parameter for part, _ in parts for parameter in part
                if parameter.value != before.get(parameter.name)]


def load(path: str) -> Scene:
    """Read a scene from a parameter file, its `/**` section; needs PyYAML."""
    import yaml

    try:
        with open(path) as file:
            given = dict(_flattened(yaml.safe_load(file)['/**']['ros__parameters']))
    except (yaml.YAMLError, LookupError, TypeError, AttributeError, ValueError,
            RecursionError) as error:
        reason = ' '.join(str(error).split())
        raise SceneError(f"{path} must be YAML with '/**:' and below it 'ros__parameters:' "
                         f'({reason})') from None
    return read(given)


def read(given: Mapping[str, Any], before: Optional[Scene] = None, strict: bool = True) -> Scene:
    """
    Read a scene from the values that are given, by full parameter name.

    Parameters
    ----------
    given : mapping
        Values by full parameter name.
    before : Scene, optional
        The scene that this one follows: what is given for a mechanism as before is not read again.
    strict : bool
        Whether a start must be where its input moves. Where others change the sweep or the reach
        of an input that has long left its start, it need not.

    Raises
    ------
    SceneError
        If a parameter is unknown or cannot be what it is.

    """
    parts = _parted(given)
    values = Values(parts.pop('', {}))
    names = values.take('mechanisms', MECHANISMS, mechanisms.CATALOGUE)
    if not names or len(set(names)) < len(names):
        raise MECHANISMS.error('mechanisms', names)
    frame_id = values.take('frame_id', FRAME_ID, 'world')
    frame_prefix = values.take('frame_prefix', FRAME_PREFIX, '')
    rate = values.take('rate', RATE, 50.0)
    known = before.machines if before else {}
    machines = {name: _machine(name, parts.pop(name, {}), known.get(name), strict)
                for name in names}
    check_distinct({name: machine.joints for name, machine in machines.items()})
    allowed = ['mechanisms', 'frame_id', 'frame_prefix', 'rate', *(f'{name}.*' for name in names)]
    for left in (values.left(), *parts.values()):
        _refuse_unknown(left, allowed)
    return Scene(machines, frame_id, frame_prefix, rate, tuple(values.parameters))


def in_words(arcs) -> str:
    """Return arcs as text, for messages."""
    return ' or '.join(f'[{low:.6g}, {high:.6g}]' for low, high in arcs)


def _parted(given) -> Dict[str, Dict[str, Any]]:
    """Return the values by mechanism, those of none under an empty name."""
    if not isinstance(given, Mapping) or not all(isinstance(name, str) for name in given):
        raise SceneError(f'a scene is values by the names of parameters, not {quoted(given)}')
    parts: Dict[str, Dict[str, Any]] = {}
    for name, value in given.items():
        mechanism, dot, _ = name.partition('.')
        parts.setdefault(mechanism if dot else '', {})[name] = value
    return parts


def _refuse_unknown(names, known):
    for name in names:
        known = [f'{name}.type', *known] if f'{name}.*' in known else known
        if not _ROS.match(name):
            raise SceneError(f'{elided(name)} is not a parameter of the scene; allowed: '
                             f'{listed(known, 180)}')


def _machine(name: str, given: Mapping[str, Any], old: Optional[Machine], strict) -> Machine:
    if old and old.is_of(given):
        return old
    values = Values(given)
    type_ = values.take(f'{name}.type', TYPE, name)
    if type_ not in TYPES:
        raise SceneError(f'{name}.type must be {TYPE.rule}, not {quoted(type_)}')
    linkage, reach = _linkage(name, type_, values)
    scale = values.take(f'{name}.scale', SCALE, 1.0)
    leg_pairs, mirrored = _legs(name, linkage, values)
    points, pose = _points(name, linkage, values), _pose(name, values)
    settled = old.inputs if old else {}
    inputs = {input_.name: _drive(name, *_scaled(input_, linkage, reach, scale), values,
                                  settled.get(input_.name), strict)
              for input_ in linkage.inputs}
    for drive in inputs.values():
        _check_measures(name, linkage, drive)
    frame_id = values.take(f'{name}.frame_id', OWN_FRAME_ID, '')
    only_named = values.take(f'{name}.only_named', ONLY_NAMED, False)
    joints = read_joint_names(
        name, [*inputs, *Assembly(linkage, leg_pairs, mirrored, scale, reach).all_joints],
        values.take(f'{name}.joint_names', JOINT_NAMES, ()), only_named)
    _refuse_unknown(values.left(), [parameter.name for parameter in values.parameters])
    return Machine(name, linkage, reach, scale, leg_pairs, mirrored, points, pose, inputs,
                   frame_id, joints, only_named, given, tuple(values.parameters))


def _linkage(name, type_, values):
    design = _design(name, type_, values)
    dimensions = _dimensions(name, design, values)
    branches = _branches(name, design, values)
    try:
        linkage, reach = _built(design, tuple(dimensions.items()), tuple(branches.items()))
    except ValueError as error:
        raise SceneError(f'{name}.dimensions: {error}') from None
    if not reach:
        # Those that are not the usual ones first: of many only some are named.
        usual = sorted(dimensions, key=lambda key: dimensions[key] == design.dimensions[key])
        lengths = listed(f'{key}={dimensions[key]:g}' for key in usual)
        raise SceneError(f'{name}.dimensions must let the {type_} be assembled at some '
                         f'{linkage.inputs[0].kind}, which {lengths} do not')
    return linkage, reach


def _design(name, type_, values):
    if type_ in mechanisms.TYPES:
        return mechanisms.design(type_)
    joints = values.take(f'{name}.joints', JOINTS, ())
    tracer = values.take(f'{name}.tracer', TRACER, '')
    start = f'{name}.dimensions.'
    dimensions = [key[len(start):] for key in values.left(start)]
    try:
        return mechanisms.design(type_, joints, tracer or None, dimensions)
    except ValueError as error:
        raise SceneError(f'{name}.joints: {error}') from None


def _dimensions(name, design, values):
    taken = {}
    for key in design.dimensions:
        field = replace(_about(DIMENSION, key, design.name), positive=key not in design.signed)
        taken[key] = values.take(f'{name}.dimensions.{key}', field, design.dimensions[key])
    return taken


def _branches(name, design, values):
    taken = {}
    for key, sign in design.branches.items():
        field = _about(BRANCH, key, design.name)
        taken[key] = values.take(f'{name}.branches.{key}', field, sign) or sign
    return taken


def _about(field, *words):
    return replace(field, meaning=field.meaning.format(*words))


@lru_cache(maxsize=16)
def _built(design, dimensions, branches):
    """Return a linkage and its reach; the same ones for the same dimensions."""
    own = {} if design.name in mechanisms.TYPES else {
        'joints': design.joints, 'tracer': design.tracer}
    linkage = mechanisms.create(design.name, branches=dict(branches), **own, **dict(dimensions))
    # How far one of several inputs reaches depends on the others: only a pose tells.
    first, *others = linkage.inputs
    return linkage, ((first.low, first.high),) if others else tuple(linkage.reach())


def _legs(name, linkage, values):
    able = _can_have_more_legs(linkage)
    # A slider for what cannot be changed would only be refused.
    pairs, mirrored = (replace(field, read_only=not able) for field in (LEG_PAIRS, MIRRORED))
    pairs = values.take(f'{name}.leg_pairs', pairs, 1)
    mirrored = values.take(f'{name}.mirrored', mirrored, pairs > 1)
    if (pairs > 1 or mirrored) and not able:
        what, allowed = ('leg_pairs', '1') if pairs > 1 else ('mirrored', 'false')
        raise SceneError(f'{name}.{what} must be {allowed}: only a linkage whose one crank '
                         'turns about x = 0, its angle counted from +x, can have more legs')
    return pairs, mirrored


def _can_have_more_legs(linkage) -> bool:
    first, *others = linkage.inputs
    if others or not first.turns:
        return False
    crank = next(link for link in linkage.links if link.name == first.name)
    return not crank.zero and linkage.solve(0.0, (crank.joint,))[crank.joint][0] == 0.0


def _points(name, linkage, values):
    points = values.take(f'{name}.points', POINTS, linkage.points)
    if not points or len(set(points)) < len(points) or set(points) - set(linkage.points):
        raise SceneError(f'{name}.points must name some of {listed(linkage.points)}, each '
                         f'once, not {quoted(list(points))}')
    return points


def _pose(name, values):
    pose = values.take(f'{name}.pose', POSE, (0.0,) * 6)
    if len(pose) != 6:
        raise POSE.error(f'{name}.pose', pose)
    return pose


def _scaled(input_: Input, linkage: Mechanism, reach: Tuple[Arc, ...],
            scale: float) -> Tuple[Input, Tuple[Arc, ...]]:
    """Return an input and its reach, a length times the scale."""
    if len(linkage.inputs) > 1:
        # How far one of several reaches depends on the others.
        reach = ((input_.low, input_.high),)
    if input_.turns:
        return input_, reach
    return (input_._replace(low=scale * input_.low, high=scale * input_.high),
            tuple((scale * low, scale * high) for low, high in reach))


def _drive(name: str, input_: Input, reach, values: Values, old: Optional[Drive],
           strict: bool) -> Drive:
    speed_field, start_field, sweep_field = (
        _about(field, input_.name, input_.unit) for field in (SPEED, START, SWEEP))
    if input_.turns:
        start_field = replace(start_field, low=-4.0 * math.pi, high=4.0 * math.pi)
    name = f'{name}.{input_.name}'
    speed = values.take(f'{name}.speed', speed_field, _usual_speed(input_, reach))
    chosen = values.left(f'{name}.start')
    start = values.take(f'{name}.start', start_field, 0.0)
    sweep = values.take(f'{name}.sweep', sweep_field, ())
    told = _told(name, input_, values)
    if sweep:
        _check_sweep(f'{name}.sweep', sweep, input_, reach)
    elif input_.is_whole(reach):
        return Drive(input_, reach, speed, start, None, None, *told)
    arcs = [sweep] if sweep else reach
    home = [arc for arc in arcs if input_.holds(arc, start, start)]
    low, high = (home or arcs)[0]
    trimmed = 0.0 if sweep else MARGIN * (high - low)
    drive = Drive(input_, reach, speed, start, (low + trimmed, high - trimmed),
                  tuple(sweep) or None, *told)
    settled = not strict or old and (old.start, old.sweep) == (drive.start, drive.sweep)
    if chosen and not home and not settled:
        raise SceneError(f'{name}.start must be inside the {"sweep" if sweep else "reach"} '
                         f'{in_words(arcs)} {input_.unit}, not {start}')
    return drive


def _told(name: str, input_: Input, values: Values) -> Tuple[str, float, float, str]:
    """Return how messages tell of an input: source, ratio, offset, and what is measured."""
    source, measures, ratio, offset = (
        values.take(f'{name}.{key}', _about(field, input_.name, input_.unit), default)
        for key, field, default in (('source', SOURCE, ''), ('measures', MEASURES, ''),
                                    ('ratio', RATIO, 1.0), ('offset', OFFSET, 0.0)))
    if not ratio:
        raise RATIO.error(f'{name}.ratio', ratio)
    mechanism = name.partition('.')[0]
    return source or f'{mechanism}_{measures or input_.name}', ratio, offset, measures


def _check_measures(name, linkage: Mechanism, drive: Drive):
    if not drive.measures:
        return
    key = f'{name}.{drive.input.name}.measures'
    if len(linkage.inputs) > 1:
        raise SceneError(f'{key} must be empty: only a linkage with one input can be solved for '
                         f'an output, and {name} has {len(linkage.inputs)}')
    try:
        linkage.check_output(drive.measures)
    except ValueError as error:
        raise SceneError(f'{key}: {error}') from None


def _usual_speed(input_: Input, reach) -> float:
    """Return the speed where none is given: a stroke takes about three seconds."""
    if input_.turns:
        return 1.0
    return float(f'{min(max(high - low for low, high in reach) / 3.0, FASTEST):.2g}')


def _check_sweep(name, sweep, input_: Input, reach):
    if (len(sweep) != 2 or not sweep[0] + NARROWEST_SWEEP * input_.size <= sweep[1]
            or max(map(abs, sweep)) > FARTHEST):
        raise SWEEP.error(name, sweep)
    if not input_.is_whole(reach) and not any(input_.holds(arc, *sweep) for arc in reach):
        raise SceneError(f'{name} must be inside the reach {in_words(reach)} {input_.unit}, '
                         f'not {quoted(list(sweep))}')


def _flattened(values, prefix=''):
    for key, value in values.items():
        if isinstance(value, dict):
            yield from _flattened(value, f'{prefix}{key}.')
        else:
            yield f'{prefix}{key}', value
