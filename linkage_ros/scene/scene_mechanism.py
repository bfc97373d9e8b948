# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A mechanism of a scene: linkage, scale, legs, markers and inputs, read from parameters."""

from __future__ import annotations

from dataclasses import dataclass, field as some
import math
import re
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple

from .input_settings import InputSettings, read_settings
from .joint_names import JointName, read_joint_names
from .legs import Assembly
from .loads import Load, read_loads
from .parameters import (
    ALL,
    BRANCHES,
    DIMENSIONS,
    Field,
    INVERSE,
    KINEMATICS,
    Parameter,
    refuse_unknown,
    SceneError,
    Values,
)
from .. import mechanisms
from ..cache import cached
from ..linkage import Arc, Design, Mechanism
from ..words import listed, meant, quoted

IN_SPACE = 'a linkage in space: pictures and robot models are of linkages in a plane'
TYPES = (*mechanisms.TYPES, *mechanisms.WRITTEN)

# Frame names are as free as link names in URDF; tf2 forbids a leading slash.
FRAME_NAME = (r'\w[^\x00-\x1f\x7f-\xa0\u200b-\u200f\u2028-\u202f\u2060-\u206f'
              r'\ud800-\udfff\ufeff]{0,99}')
FRAME = re.compile(f'({FRAME_NAME})?')
FRAME_RULE = 'up to 100 characters that can be seen, the first a letter, digit or _'

TYPE = Field('string', 'Type of the mechanism.', readers=ALL, read_only=True,
             rule=f'one of {", ".join(TYPES)}')
JOINTS = Field('string_array', 'The linkage, one line per joint.', readers=ALL, read_only=True)
TRACER = Field('string', 'Joint whose curve is the locus; empty: the last.', readers=ALL,
               read_only=True)
DIMENSION = Field('double', 'Dimension {0} of the {1}, before scale [{unit}].', readers=ALL,
                  unit='m', group=DIMENSIONS)
BRANCH = Field('integer', 'Assembly sign {0} of the {1}; 0: the default.', -1, 1, readers=ALL,
               group=BRANCHES)
SCALE = Field('double', 'Factor of every length.', positive=True, readers=ALL)
LEG_PAIRS = Field('integer', 'Legs on one side of the crank, evenly spread over its turn.', 1, 50,
                  readers=(KINEMATICS,))
MIRRORED = Field('bool', 'Whether each leg has a mirror image on the other side; '
                 'default: with more than one pair.', readers=(KINEMATICS,))
POINTS = Field('string_array', 'Joints that markers display.', readers=(KINEMATICS,))
POSE = Field('double_array', "Pose of the linkage's plane in frame_id: "
             'x, y, z [m], roll, pitch, yaw [rad].', rule='six of them', readers=(KINEMATICS,))
OWN_FRAME_ID = Field('string', "Frame that its pose is in; empty: the scene's.",
                     readers=(KINEMATICS,), rule=FRAME_RULE, pattern=FRAME)
JOINT_NAMES = Field(
    'string_array', "The robot's own names of joints; a joint that is not listed keeps its name.",
    readers=(KINEMATICS, INVERSE),
    rule="such as 'BC=left_shin', or 'EF=-left_ankle+0.35' for 0.35 minus its position")
ONLY_NAMED = Field('bool', 'Whether only the joints in joint_names are published.',
                   readers=(KINEMATICS,))
LOADS = Field('string_array', "Loads that the inputs balance, in the linkage's plane.",
              readers=(KINEMATICS, INVERSE),
              rule="such as 'C=0 -9.81', a force [N] at a joint, or 'EF=2.5', a moment [N m]")


@dataclass(frozen=True)
class SceneMechanism:
    """
    A mechanism of a scene, which has one or more equal legs.

    `linkage` is that of a leg, and `reach` the reach of its first input, both before `scale`, a
    factor of all lengths. `points` are the joints that markers display; `pose` is x, y, z [m],
    roll, pitch, yaw [rad] in `frame_id`, or in the scene's frame if that is empty. `inputs` are by
    their names; `joints` are the published names by joint; `loads` are forces by joint, moments by
    link. `values` are the values that the mechanism was read from.
    """

    name: str
    linkage: Mechanism
    reach: Tuple[Arc, ...]
    scale: float
    leg_pairs: int
    mirrored: bool
    points: Tuple[str, ...]
    pose: Tuple[float, ...]
    inputs: Mapping[str, InputSettings]
    frame_id: str
    joints: Mapping[str, JointName]
    only_named: bool
    loads: Mapping[str, Load]
    values: Mapping[str, Any] = some(compare=False, repr=False)
    parameters: Tuple[Parameter, ...] = some(compare=False, repr=False)

    def is_from(self, values: Mapping[str, Any]) -> bool:
        """Return whether it was read from the same objects, and so is unchanged."""
        return self.values is values or self.values.keys() == values.keys() and all(
            self.values[key] is value for key, value in values.items())

    @property
    def in_space(self) -> bool:
        """Whether the linkage is spatial; only planar ones have pictures and robot models."""
        return len(self.linkage.axes) > 2

    @property
    def first(self) -> InputSettings:
        """Return the settings of the first input; most linkages have only one."""
        return next(iter(self.inputs.values()))

    def scale_of(self, output: str) -> float:
        """Return the factor from the linkage to the scene: the scale for a length, else 1."""
        return 1.0 if self.linkage.is_angle(output) else self.scale

    def measured(self, output: str, value: float, seed: float) -> Tuple[float, float]:
        """
        Return the input at which an output has a value [rad or m], and d output / d input.

        Of several solutions it is the one that continues from the input `seed`, or else the
        nearest. It is NaN if there is none in the reach and in the sweep that a user has set.
        """
        settings, unit = self.first, self.scale_of(output)
        scale = self.scale_of(settings.input.name)
        ends = settings.ends and (settings.ends[0] / scale, settings.ends[1] / scale)
        inverse, values, seeds = self.linkage.inverse(output), (value / unit,), (seed / scale,)
        (input_,), (rate,) = inverse.follow(values, seeds)
        if not (ends[0] <= input_ <= ends[1] if ends else input_ == input_):
            (input_,), (rate,) = inverse.nearest(values, seeds, (ends,))
        return input_ * scale, rate * unit / scale

    def from_source(self, settings: InputSettings, position: float, speed: Optional[float],
                    seed: Optional[float]) -> Tuple[float, Optional[float]]:
        """
        Return an input and its speed, from those of its source joint [rad or m, per second].

        If the source joint measures an output, the input continues from `seed`, by default its
        start, and is NaN if there is none. The speed is None if it is unknown, and NaN at an
        extreme of the output.
        """
        value = settings.ratio * position + settings.offset
        speed = None if speed is None else settings.ratio * speed
        if not settings.measures:
            return value, speed
        input_, rate = self.measured(
            settings.measures, value, settings.start if seed is None else seed)
        return input_, None if speed is None else speed / rate if rate else math.nan

    def to_source(self, settings: InputSettings, value: float, speed: float
                  ) -> Tuple[float, float]:
        """Return position and speed of an input's source joint, from those of the input."""
        if output := settings.measures:
            scale, unit = self.scale_of(settings.input.name), self.scale_of(output)
            rate = float(self.linkage.joint_rates(value / scale, [output])[output]) * unit / scale
            value = float(self.linkage.joint_angles(value / scale, [output])[output]) * unit
            speed = rate * speed
        return (value - settings.offset) / settings.ratio, speed / settings.ratio

    def efforts(self, values: Sequence[float]) -> Tuple[float, ...]:
        """Return the inputs' efforts [N m or N] that balance the loads at inputs `values`."""
        units = [self.scale_of(name) for name in self.inputs]
        inputs = [value / unit for value, unit in zip(values, units)]
        # The scale lengthens the lever arms of forces; moments do not depend on it.
        loads = {name: load if isinstance(load, float) else tuple(
            self.scale * part for part in load) for name, load in self.loads.items()}
        efforts = self.linkage.effort(inputs if len(inputs) > 1 else inputs[0], loads)
        return tuple(float(effort) / unit for effort, unit in zip(efforts, units))

    def assembly(self) -> Assembly:
        """Return the solver of all legs."""
        return Assembly(self.linkage, self.leg_pairs, self.mirrored, self.scale, self.reach)

    @property
    def tracer(self) -> str:
        """Return the joint that draws the locus: the tracer if in `points`, else their last."""
        return self.linkage.tracer if self.linkage.tracer in self.points else self.points[-1]


def read_mechanism(name: str, entries: Mapping[str, Any], old: Optional[SceneMechanism],
                   strict: bool) -> SceneMechanism:
    """Read a mechanism from its values, or return `old` if they are unchanged."""
    if old and old.is_from(entries):
        return old
    values = Values(entries)
    type_ = values.take(f'{name}.type', TYPE, name)
    if type_ not in TYPES:
        raise SceneError(f'{name}.type must be {TYPE.rule}, not {quoted(type_)}'
                         f'{meant(type_, TYPES)}')
    linkage, reach = _linkage(name, type_, values)
    scale = values.take(f'{name}.scale', SCALE, 1.0)
    leg_pairs, mirrored = _legs(name, linkage, values)
    points, pose = _points(name, linkage, values), _pose(name, values)
    old_inputs = old.inputs if old else {}
    inputs = {input_.name: read_settings(name, linkage, input_, reach, scale, values,
                                         old_inputs.get(input_.name), strict)
              for input_ in linkage.inputs}
    frame_id = values.take(f'{name}.frame_id', OWN_FRAME_ID, '')
    only_named = values.take(f'{name}.only_named', ONLY_NAMED, False)
    assembly = Assembly(linkage, leg_pairs, mirrored, scale, reach)
    angles = [linkage.is_angle(joint) for joint in assembly.joints]
    joints = read_joint_names(
        name, {**dict.fromkeys(inputs, False),
               **dict(zip(assembly.all_joints, len(assembly.legs) * angles))},
        values.take(f'{name}.joint_names', JOINT_NAMES, ()), only_named)
    loads = read_loads(name, linkage, values.take(f'{name}.loads', LOADS, ()))
    if loads and (leg_pairs > 1 or mirrored):
        raise SceneError(f'{name}.loads must be empty for more than one leg')
    refuse_unknown(values.unused(), [parameter.name for parameter in values.parameters])
    return SceneMechanism(name, linkage, reach, scale, leg_pairs, mirrored, points, pose, inputs,
                          frame_id, joints, only_named, loads, entries, tuple(values.parameters))


def _linkage(name: str, type_: str, values: Values) -> Tuple[Mechanism, Tuple[Arc, ...]]:
    design = _design(name, type_, values)
    dimensions = _dimensions(name, design, values)
    branches = _branches(name, design, values)
    try:
        linkage = _built(design, tuple(dimensions.items()), tuple(branches.items()))
        # The reach of one of several inputs depends on the others.
        first, *others = linkage.inputs
        reach = ((first.low, first.high),) if others else tuple(linkage.reach())
    except ValueError as error:
        raise SceneError(f'{name}.dimensions: {error}') from None
    if not reach:
        # Changed dimensions come first, since a long list is shortened.
        usual = sorted(dimensions, key=lambda key: dimensions[key] == design.dimensions[key])
        lengths = listed(f'{key}={dimensions[key]:g}' for key in usual)
        raise SceneError(f'{name}.{"dimensions" if dimensions else "joints"} must let the {type_} '
                         f'be assembled at some {linkage.inputs[0].kind}'
                         + f', which {lengths} do not' * bool(dimensions))
    return linkage, reach


def _design(name: str, type_: str, values: Values) -> Design:
    if type_ in mechanisms.TYPES:
        return mechanisms.design(type_)
    joints = values.take(f'{name}.joints', JOINTS, ())
    tracer = values.take(f'{name}.tracer', TRACER, '')
    start = f'{name}.dimensions.'
    dimensions = [key[len(start):] for key in values.unused(start)]
    try:
        return mechanisms.design(type_, joints, tracer or None, dimensions)
    except ValueError as error:
        raise SceneError(f'{name}.joints: {error}') from None


def _dimensions(name: str, design: Design, values: Values) -> Dict[str, float]:
    chosen = {}
    for key in design.dimensions:
        field = DIMENSION.about(key, design.name, positive=key not in design.signed)
        chosen[key] = values.take(f'{name}.dimensions.{key}', field, design.dimensions[key])
    return chosen


def _branches(name: str, design: Design, values: Values) -> Dict[str, int]:
    chosen = {}
    for key, sign in design.branches.items():
        field = BRANCH.about(key, design.name)
        chosen[key] = values.take(f'{name}.branches.{key}', field, sign) or sign
    return chosen


@cached(16, shared=True)
def _built(design: Design, dimensions: tuple, branches: tuple) -> Mechanism:
    """Build a linkage, or return an equal one that is cached or in use."""
    lines: Dict[str, Any] = {} if design.name in mechanisms.TYPES else {
        'joints': design.joints, 'tracer': design.tracer}
    return mechanisms.create(design.name, branches=dict(branches), **lines, **dict(dimensions))


def _legs(name: str, linkage: Mechanism, values: Values) -> Tuple[int, bool]:
    able = _can_have_more_legs(linkage)
    # A parameter of which no other value is allowed is read-only, and so has no slider.
    pairs, mirrored = (field.about(read_only=not able) for field in (LEG_PAIRS, MIRRORED))
    pairs = values.take(f'{name}.leg_pairs', pairs, 1)
    mirrored = values.take(f'{name}.mirrored', mirrored, pairs > 1)
    if (pairs > 1 or mirrored) and not able:
        what, allowed = ('leg_pairs', '1') if pairs > 1 else ('mirrored', 'false')
        raise SceneError(f'{name}.{what} must be {allowed}: only a linkage whose one crank '
                         'turns about x = 0, its angle measured from +x, can have more legs')
    return pairs, mirrored


def _can_have_more_legs(linkage: Mechanism) -> bool:
    first, *others = linkage.inputs
    if others or not first.turns or len(linkage.axes) > 2:
        return False
    crank = next(link for link in linkage.links if link.name == first.name)
    return not crank.zero and linkage.solve(0.0, (crank.joint,))[crank.joint][0] == 0.0


def _points(name: str, linkage: Mechanism, values: Values) -> Tuple[str, ...]:
    points = values.take(f'{name}.points', POINTS, linkage.points)
    if not points or len(set(points)) < len(points) or set(points) - set(linkage.points):
        raise SceneError(f'{name}.points must name some of {listed(linkage.points)}, each '
                         f'once, not {quoted(list(points))}')
    return points


def _pose(name: str, values: Values) -> Tuple[float, ...]:
    pose = values.take(f'{name}.pose', POSE, (0.0,) * 6)
    if len(pose) != 6:
        raise POSE.error(f'{name}.pose', pose)
    return pose
