# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
A scene: a set of mechanisms with their sizes, poses and input motions.

This package alone defines the names of parameters. `read` turns their values into a Scene, or
raises an error that names the wrong parameter and its allowed values. Nodes declare the scene's
`parameters`. No ROS is needed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
import re
from typing import Any, Iterable, Mapping

from .input_settings import in_words, InputSettings, MAX_POSITION
from .joint_names import check_distinct
from .parameter_file import overrides, sections
from .parameters import DRIVER, Field, INVERSE, KINEMATICS, Parameter, plain, SceneError, Values
from .scene_mechanism import FRAME, is_distinct, read_mechanism, SceneMechanism
from .. import mechanisms
from ..words import plain_text, short_repr

__all__ = ['changed', 'InputSettings', 'DRIVER', 'MAX_POSITION', 'Field', 'in_words', 'INVERSE',
           'KINEMATICS', 'load', 'SceneMechanism', 'Parameter', 'plain', 'read', 'Scene',
           'SceneError']

_NAME = re.compile(r'(?=.{1,64}$)[A-Za-z](_?[A-Za-z0-9])*')

# The parameters that belong to no mechanism.
GENERAL = {
    'mechanisms': Field(
        'string_array', 'Names of the mechanisms in the scene.', default=(*mechanisms.CATALOGUE,),
        read_only=True, pattern=_NAME, holds=is_distinct,
        rule='at least one, each once, of up to 64 letters, digits and single underscores, '
             'a letter first'),
    'frame_id': replace(
        FRAME, meaning='Frame of the poses.', default='world', holds=bool,
        rule='1 to 100 characters that can be seen, the first a letter, digit or _'),
    'frame_prefix': replace(FRAME, meaning='Prefix of the frames of markers and loci, as in '
                                           'robot_state_publisher.'),
    'rate': Field('double', 'Rate of crank messages [Hz]; 0: none.', (0.0, 1000.0), default=50.0,
                  readers=(DRIVER,), unit='Hz')}


@dataclass(frozen=True)
class Scene:
    """Mechanisms by name, their common frame, and the rate of the crank messages [Hz]."""

    mechanisms: Mapping[str, SceneMechanism]
    frame_id: str
    frame_prefix: str
    rate: float
    # Parameters that belong to no mechanism.
    general: tuple[Parameter, ...]

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters, the general ones first."""
        return (*self.general, *(parameter for mechanism in self.mechanisms.values()
                                 for parameter in mechanism.parameters))

    @property
    def sources(self) -> dict[str, list[tuple[str, int]]]:
        """The inputs of each source joint: their mechanism's name and their index in it."""
        sources: dict[str, list[tuple[str, int]]] = {}
        for name, mechanism in self.mechanisms.items():
            for i, settings in enumerate(mechanism.inputs.values()):
                sources.setdefault(settings.source, []).append((name, i))
        return sources

    def changed_from(self, old: 'Scene') -> list[Parameter]:
        """Return the parameters whose values differ from an older scene of the same mechanisms."""
        # No change adds or removes a parameter.
        return [parameter for parameter, before in zip(self.parameters, old.parameters)
                if parameter.value != before.value]


def load(path: str) -> Scene:
    """
    Read a scene from a parameter file, as nodes without a namespace do; needs PyYAML.

    Each parameter has the value that the file gives to the parameter's owner.
    """
    all_sections = sections(path)
    values = {node: overrides(all_sections, f'/{node}') for node in (DRIVER, INVERSE, KINEMATICS)}
    if not any(values.values()):
        raise SceneError(f"{path} must be YAML with '/**:' and below it 'ros__parameters:'")
    scene = read({name: value for part in values.values() for name, value in part.items()})
    return read({parameter.name: values[parameter.field.owner][parameter.name]
                 for parameter in scene.parameters
                 if parameter.name in values[parameter.field.owner]})


def read(values: Mapping[str, Any]) -> Scene:
    """
    Read a scene from values by full parameter name.

    Raises SceneError if one is unknown or not allowed.
    """
    parts = _by_mechanism(values)
    if 'mechanisms' not in parts.get('', {}):
        for name, scale in mechanisms.CATALOGUE.items():
            parts[name] = {f'{name}.scale': scale, **parts.get(name, {})}
    return _read(parts, {}, ())


def changed(before: Scene, values: Mapping[str, Any]) -> Scene:
    """
    Return the scene `before` with some other values, by full parameter name.

    All other parameters keep their values, defaults, too. Mechanisms without a changed value are
    reused. Raises SceneError as `read` does.
    """
    parts = {name: part for name, part in _by_mechanism(values).items()
             if name not in before.mechanisms or not part.items() <= {
                 parameter.name: parameter.value
                 for parameter in before.mechanisms[name].parameters}.items()}
    return _read(parts, before.mechanisms, before.general)


def _read(parts: Mapping[str, Mapping[str, Any]], known: Mapping[str, SceneMechanism],
          general: Iterable[Parameter]) -> Scene:
    values = Values(parts.get('', {}), known=general)
    names, frame_id, frame_prefix, rate = (
        values.take(name, field) for name, field in GENERAL.items())
    mechanisms = {name: known[name] if name in known and name not in parts
                  else read_mechanism(name, parts.get(name, {}), known.get(name))
                  for name in names}
    joints = {name: mechanism.joints for name, mechanism in mechanisms.items()}
    if joints != {name: mechanism.joints for name, mechanism in known.items()}:
        check_distinct(joints)
    allowed = [*GENERAL, *(f'{name}.*' for name in names)]
    for rest in (values, *(Values(parts[name]) for name in parts if name not in ('', *names))):
        rest.refuse_unknown(allowed)
    return Scene(mechanisms, frame_id, frame_prefix, rate, tuple(values.parameters))


def _by_mechanism(values: Any) -> dict[str, dict[str, Any]]:
    """Return {mechanism: {full name: value}}, with '' as the mechanism of general parameters."""
    if not isinstance(values, Mapping) or not all(isinstance(name, str) for name in values):
        raise SceneError('a scene must map names of parameters to their values, not be '
                         f'{short_repr(values)}')
    parts: dict[str, dict[str, Any]] = {}
    for name, value in values.items():
        mechanism, dot, _ = name.partition('.')
        parts.setdefault(mechanism if dot else '', {})[plain_text(name)] = plain(value)
    return parts
