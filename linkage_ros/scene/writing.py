# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Write scenes as parameter files, which `load` and ROS can read. Needs PyYAML, but no ROS."""

from __future__ import annotations

import re
from typing import Any, Mapping

from . import Scene
from .parameter_file import is_text
from ..optional import needs

# Parameters that define a scene, which a file always has.
_DEFINES = re.compile(r'mechanisms|[^.]+\.(type|scale|dimensions\..+)')


def in_yaml(values: Mapping[str, Any]) -> str:
    """Return the text of a parameter file; `values` are by full parameter name."""
    with needs('yaml'):
        from yaml import dump, SafeDumper

    class Dumper(SafeDumper):
        """Quotes texts that ROS would read as another type, such as y, nan and 1e5."""

    Dumper.add_representer(str, lambda dumper, text: dumper.represent_scalar(
        'tag:yaml.org,2002:str', text, None if is_text(text) else "'"))
    Dumper.add_representer(list, lambda dumper, items: dumper.represent_sequence(
        'tag:yaml.org,2002:seq', items, flow_style=not isinstance(items[0], str)))
    # rcl cannot read an empty list, which is the default anyway.
    lists = {name: list(value) if isinstance(value, tuple) else value
             for name, value in values.items() if value not in ((), [])}
    return dump({'/**': {'ros__parameters': lists}}, Dumper=Dumper, width=1000, sort_keys=False)


def without_defaults(scene: Scene) -> dict[str, Any]:
    """Return what defines the mechanisms and what differs from defaults, by full name."""
    return {parameter.name: parameter.value for parameter in scene.parameters
            if parameter.value != parameter.default or _DEFINES.fullmatch(parameter.name)}
