# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Scenes as parameter files: what `load` reads. Needs PyYAML, no ROS."""

from __future__ import annotations

import re
from textwrap import indent
from typing import Any, Dict, Mapping

from . import read, Scene, SceneError
from .parameter_file import plain, TEXT


def in_yaml(given: Mapping[str, Any]) -> str:
    """Return a parameter file with these values, by full parameter name."""
    import yaml

    class Dumper(yaml.SafeDumper):
        """Quotes texts that ROS would read as something else, such as y, nan and 1e5."""

    Dumper.add_representer(str, lambda dumper, text: dumper.represent_scalar(
        TEXT, text, None if isinstance(plain(text), str) else "'"))
    texts = ['/**:', '  ros__parameters:']
    for name, value in given.items():
        shown = list(value) if isinstance(value, tuple) else value
        if shown == []:
            # ROS reads no empty list, and it is what is there without.
            continue
        numbers = isinstance(shown, list) and not any(isinstance(one, str) for one in shown)
        text = yaml.dump({name: shown}, Dumper=Dumper, width=1000,
                         default_flow_style=numbers and None)
        texts.append(indent(text.rstrip(), '    '))
    return '\n'.join(texts) + '\n'


NOTHING = re.compile(r'(?!)')


def without_defaults(scene: Scene, always: re.Pattern = NOTHING) -> Dict[str, Any]:
    """
    Return the values that tell a scene from what it is without them.

    Values whose whole name matches `always` are returned even so.

    Raises
    ------
    SceneError
        If the nodes would not start with them: a start that is not where its input moves.

    """
    kept = {parameter.name: parameter.value for parameter in scene.parameters}
    whole = dict(kept)
    for name in whole:
        if always.fullmatch(name):
            continue
        fewer = {key: value for key, value in kept.items() if key != name}
        try:
            same = read(fewer, scene, strict=False).parameters
        except SceneError:
            continue
        if {parameter.name: parameter.value for parameter in same} == whole:
            kept = fewer
    read(kept)
    return kept
