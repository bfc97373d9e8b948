# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A mechanism of a scene: linkage, scale, legs, markers and inputs, read from parameters."""

from __future__ import annotations

from dataclasses import dataclass, field as some
from functools import cached_property
from itertools import product
import math
import re
from typing import Any, Mapping, Sequence

from .input_settings import InputSettings, reach_of, read_settings
from .joint_names import JointName, read_joint_names
from .legs import LegGroup
from .loads import Load, read_loads
from .parameters import Field, INVERSE, KINEMATICS, Parameter, SceneError, Values
from .. import mechanisms
from ..cache import cached
from ..linkage import Arc, Design, Mechanism, theta_of
from ..words import join_names

TYPES = (*mechanisms.TYPES, *mechanisms.WRITTEN)


def is_distinct(names: Sequence[str]) -> bool:
    """Return whether there are names, each of them once."""
    return 0 < len(names) == len(set(names))


def is_pose(numbers: Sequence[float]) -> bool:
    """Return whether there are the six numbers of a pose."""
    return len(numbers) == 6


TYPE = Field('string', 'Type of the mechanism.', read_only=True, choices=TYPES,
             rule=f'one of {", ".join(TYPES)}')
JOINTS = Field('string_array', 'The linkage, one line per joint.', default=(), read_only=True)
TRACER = Field('string', 'Joint whose curve is the locus; empty: the last.', default='',
               read_only=True)
DIMENSION = Field('double', 'Dimension {0} of the {1}, before scale [{unit}].', unit='m',
                  group='dimensions')
BRANCH = Field('integer', 'Assembly sign {0} of the {1}; 0: the default.', (-1, 1),
               group='branches')
SCALE = Field('double', 'Factor of every length.', default=1.0, positive=True)
# The inverse uses no legs and no `only_named`, but loads and names are valid or not by them.
LEG_PAIRS = Field('integer', 'Legs on one side of the crank, evenly spread over its turn.',
                  (1, 50), default=1, readers=(KINEMATICS, INVERSE))
MIRRORED = Field('bool', 'Whether each leg has a mirror image on the other side; '
                 'default: with more than one pair.', readers=(KINEMATICS, INVERSE))
POINTS = Field('string_array', 'Joints that markers display.', readers=(KINEMATICS,),
               holds=is_distinct, rule='each once')
POSE = Field('double_array', "Pose of the linkage's plane in frame_id: "
             'x, y, z [m], roll, pitch, yaw [rad].', default=(0.0,) * 6, readers=(KINEMATICS,),
             rule='six of them', holds=is_pose)
# Names of frames are as free as those of links in URDF; tf2 forbids a leading slash.
FRAME = Field(
    'string', "Frame that its pose is in; empty: the scene's.", default='', readers=(KINEMATICS,),
    rule='up to 100 characters that can be seen, the first a letter, digit or _',
    pattern=re.compile(r'(\w[^\x00-\x1f\x7f-\xa0\u200b-\u200f\u2028-\u202f\u2060-\u206f'
                       r'\ud800-\udfff\ufeff]{0,99})?'))
JOINT_NAMES = Field(
    'string_array', "The robot's own names of joints; a joint that is not listed keeps its name.",
    default=(), readers=(KINEMATICS, INVERSE),
    rule="such as 'BC=left_shin', or 'EF=-left_ankle+0.35' for 0.35 minus its position")
ONLY_NAMED = Field('bool', 'Whether only the joints in joint_names are published.', default=False,
                   readers=(KINEMATICS, INVERSE))
LOADS = Field('string_array', "Loads that the inputs balance, in the linkage's plane.",
              default=(), readers=(KINEMATICS, INVERSE),
              rule="such as 'C=0 -9.81', a force [N] at a joint, or 'EF=2.5', a moment [N m]")


@dataclass(frozen=True)
class SceneMechanism:
    """
    A mechanism of a scene, which has one or more equal legs.

    `linkage` is that of a leg before `scale`, a factor of all lengths. `points` are the joints
    that markers display; `pose` is x, y, z [m], roll, pitch, yaw [rad] in `frame_id`, or in the
    scene's frame if that is empty. `inputs` are by their names; `joints` are the published names
    by joint; `loads` are forces by joint, moments by link.
    """

    name: str
    linkage: Mechanism
    scale: float
    leg_pairs: int
    mirrored: bool
    points: tuple[str, ...]
    pose: tuple[float, ...]
    inputs: Mapping[str, InputSettings]
    frame_id: str
    joints: Mapping[str, JointName]
    only_named: bool
    loads: Mapping[str, Load]
    parameters: tuple[Parameter, ...] = some(compare=False, repr=False)

    @property
    def in_space(self) -> bool:
        """Whether the linkage is spatial; only planar ones have pictures and robot models."""
        return len(self.linkage.axes) > 2

    def check_planar(self) -> None:
        """Raise SceneError for a linkage in space."""
        if self.in_space:
            raise SceneError(f'{self.name} is a linkage in space: pictures and robot models are '
                             'of linkages in a plane')

    @property
    def first(self) -> InputSettings:
        """Return the settings of the first input; most linkages have only one."""
        return next(iter(self.inputs.values()))

    def scale_of(self, output: str) -> float:
        """Return the factor from the linkage to the scene: the scale for a length, else 1."""
        return 1.0 if self.linkage.is_angle(output) else self.scale

    def key(self, link: str) -> str:
        """Return the key of a link of the first leg among the `joints`."""
        return link if link in self.inputs else next(iter(self.assembly().legs)) + link

    def output_named(self, name: str) -> tuple[str, JointName] | None:
        """Return the output of the first leg with a name in messages, and its published name."""
        for link in self.linkage.joints:
            joint = self.joints[self.key(link)]
            if joint.name == name:
                return link, joint
        before, _, output = name.partition(f'{self.name}_')
        return None if before or not self.linkage.has_output(output) else (output, JointName(name))

    @cached_property
    def scales(self) -> list[float]:
        """Return the factor of each input from the linkage to the scene."""
        return [self.scale_of(name) for name in self.inputs]

    def theta(self, values: Sequence[float]) -> Any:
        """Return inputs [rad or m], or their speeds, as an argument of the unscaled linkage."""
        return theta_of(divided(values, self.scales))

    def follow(self, outputs: Sequence[str], values: Sequence[float], seed: Sequence[float],
               jumps: bool = True) -> tuple[list[float], list[float]]:
        """
        Return the inputs at which outputs have values [rad or m], and the rates of the outputs.

        Of several solutions it is the one that continues from the inputs `seed`, or else, if they
        may jump, the nearest. It is NaN if there is none in the reach and in the sweeps that a
        user has set. The rates are those of each output by the first input, by the second, ...
        """
        units, scales = list(map(self.scale_of, outputs)), self.scales
        inverse = self.linkage.inverse(tuple(outputs))
        targets, seeds = divided(values, units), divided(seed, scales)
        inputs, rates = inverse.follow(targets, seeds, self.ends)
        if jumps and not math.isfinite(inputs[0]):
            inputs, rates = inverse.nearest(targets, seeds, self.ends)
        return ([input_ * scale for input_, scale in zip(inputs, scales)],
                [rate * unit / scale for rate, (scale, unit) in zip(
                    rates, product(scales, units))])

    def extremes(self, output: str) -> list[tuple[Arc, Arc]]:
        """
        Return the extremes of an output on the arcs of the only input, of a long one on a turn.

        Each arc has the minimum and the input there, then the maximum [rad or m].
        """
        scale, unit, first = self.scales[0], self.scale_of(output), self.first.input
        turn = first.turn if first.wraps else math.inf
        arcs = [(low / scale, min(high, low + turn) / scale) for low, high in self.first.arcs]
        return [((minimum * unit, low * scale), (maximum * unit, high * scale))
                for (minimum, low), (maximum, high) in self.linkage.extremes(output, arcs)]

    @cached_property
    def ends(self) -> list[Arc | None]:
        """Return the sweeps that a user has set, before scale, and None for other inputs."""
        return [settings.ends and (settings.ends[0] / scale, settings.ends[1] / scale)
                for settings, scale in zip(self.inputs.values(), self.scales)]

    def from_source(self, settings: InputSettings, position: float, speed: float | None,
                    seed: float | None) -> tuple[float, float | None]:
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
        (input_,), (rate,) = self.follow(
            [settings.measures], [value], [settings.start if seed is None else seed])
        return input_, None if speed is None else speed / rate if rate else math.nan

    def to_source(self, settings: InputSettings, value: float, speed: float
                  ) -> tuple[float, float]:
        """Return position and speed of an input's source joint, from those of the input."""
        if output := settings.measures:
            scale, unit = self.scale_of(settings.input.name), self.scale_of(output)
            rate = float(self.linkage.joint_rates(value / scale, [output])[output]) * unit / scale
            value = float(self.linkage.joint_angles(value / scale, [output])[output]) * unit
            speed = rate * speed
        return (value - settings.offset) / settings.ratio, speed / settings.ratio

    def efforts(self, values: Sequence[float]) -> tuple[float, ...]:
        """Return the inputs' efforts [N m or N] that balance the loads at inputs `values`."""
        # The scale lengthens the lever arms of forces; moments do not depend on it.
        loads = {name: load if isinstance(load, float) else tuple(
            self.scale * part for part in load) for name, load in self.loads.items()}
        return tuple(divided(self.linkage.effort(self.theta(values), loads).tolist(), self.scales))

    def assembly(self) -> LegGroup:
        """Return the solver of all legs."""
        return LegGroup(self.linkage, self.leg_pairs, self.mirrored, self.scale)

    @property
    def tracer(self) -> str:
        """Return the joint that draws the locus, the tracer if in `points`, else their last."""
        return self.linkage.tracer if self.linkage.tracer in self.points else self.points[-1]


def divided(values: Sequence[Any], units: Sequence[float]) -> list[Any]:
    """Return values in units of their own."""
    return [value / unit for value, unit in zip(values, units)]


def read_mechanism(name: str, entries: Mapping[str, Any],
                   before: SceneMechanism | None = None) -> SceneMechanism:
    """Read a mechanism from its values by full parameter name, other values as `before`."""
    values = Values(entries, f'{name}.', before.parameters if before else ())
    take = values.take
    linkage = _linkage(name, take('type', TYPE, name), values)
    scale, (leg_pairs, mirrored) = take('scale', SCALE), _legs(name, linkage, values)
    points = take('points', POINTS.about(
        rule=f'some of {join_names(linkage.points)}, each once', choices=linkage.points),
        linkage.points)
    pose = take('pose', POSE)
    inputs = {input_.name: read_settings(name, linkage, input_, scale, values)
              for input_ in linkage.inputs}
    frame_id, only_named = take('frame_id', FRAME), take('only_named', ONLY_NAMED)
    joints = dict(read_joint_names(
        name, linkage, leg_pairs, mirrored, take('joint_names', JOINT_NAMES), only_named))
    loads = read_loads(name, linkage, take('loads', LOADS))
    if loads and (leg_pairs > 1 or mirrored):
        raise SceneError(f'{name}.loads must be empty for more than one leg')
    values.refuse_unknown()
    return SceneMechanism(name, linkage, scale, leg_pairs, mirrored, points, pose, inputs,
                          frame_id, joints, only_named, loads, tuple(values.parameters))


def _linkage(name: str, type_: str, values: Values) -> Mechanism:
    try:
        design = mechanisms.design(type_) if type_ in mechanisms.TYPES else mechanisms.design(
            type_, values.take('joints', JOINTS), values.take('tracer', TRACER) or None,
            values.keys('dimensions.'))
    except ValueError as error:
        raise SceneError(f'{name}.joints: {error}') from None
    dimensions = {key: values.take(f'dimensions.{key}', DIMENSION.about(
        key, type_, positive=key not in design.signed), value)
        for key, value in design.dimensions.items()}
    branches = {key: values.take(f'branches.{key}', BRANCH.about(key, type_), sign) or sign
                for key, sign in design.branches.items()}
    try:
        linkage = _built(design, tuple(dimensions.items()), tuple(branches.items()))
        reaches = [reach_of(linkage, input_) for input_ in linkage.inputs]
    except ValueError as error:
        raise SceneError(f'{name}.dimensions: {error}') from None
    if not all(reaches):
        raise SceneError(f'{name}.{"dimensions" if dimensions else "joints"} must let the {type_} '
                         f'be assembled at some {linkage.inputs[0].kind}')
    return linkage


@cached(16, shared=True)
def _built(design: Design, dimensions: tuple, branches: tuple) -> Mechanism:
    """Build a linkage, or return an equal one that is cached or in use."""
    lines: dict[str, Any] = {} if design.name in mechanisms.TYPES else {
        'joints': design.joints, 'tracer': design.tracer}
    return mechanisms.create(design.name, branches=dict(branches), **lines, **dict(dimensions))


def _legs(name: str, linkage: Mechanism, values: Values) -> tuple[int, bool]:
    first, *others = linkage.inputs
    able = first.is_angle and not others and len(linkage.axes) == 2
    if able:
        crank = next(link for link in linkage.links if link.name == first.name)
        able = not crank.zero and linkage.solve(0.0, (crank.joint,))[crank.joint][0] == 0.0
    # A parameter of which no other value is allowed is read-only, and so has no slider.
    pairs = values.take('leg_pairs', LEG_PAIRS.about(read_only=not able))
    mirrored = values.take('mirrored', MIRRORED.about(read_only=not able), pairs > 1)
    if (pairs > 1 or mirrored) and not able:
        raise SceneError(f'{name}.leg_pairs must be 1 and mirrored false: only a linkage whose '
                         'one crank turns about x = 0, its angle measured from +x, can have more '
                         'legs')
    return pairs, mirrored
