# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Linkages that users write down themselves; see `language` for the words."""

from functools import lru_cache
from typing import Optional, Sequence, Tuple

import numpy as np

from .. import language
from ..mechanism import check_bars, Design, Mechanism


@lru_cache(maxsize=64)
def design(joints: Tuple[str, ...], tracer: Optional[str], given: Tuple[str, ...]) -> Design:
    """
    Return the design that lines of joints make.

    Raises
    ------
    ValueError
        With the line and what is allowed.

    """
    lines = language.parse(joints)
    if not any(line.word == 'crank' for line in lines):
        raise ValueError('a linkage needs at least one crank line')
    for line in lines:
        for name in language.lengths([line]):
            if name not in given:
                raise line.error(f'dimension {name} has no value; '
                                 f'given: {", ".join(given) or "none"}')
    used = language.lengths(lines)
    names = [name for line in lines for name in line.names]
    if tracer is not None and tracer not in names:
        raise ValueError(f'tracer {tracer!r} is no joint; allowed: {", ".join(names)}')
    signed = frozenset(name for name, length in used.items() if not length)
    return Design('custom', dict.fromkeys(used, 1.0), joints, tracer or names[-1], signed, check)


def check(linkage: Mechanism):
    """Raise ValueError, with its line, where a bar has no length or a triangle cannot exist."""
    check_bars(linkage)
    for line, exists in linkage.triangles().items():
        if not np.all(exists):
            raise line.error('no triangle has these sides: each must be shorter than the '
                             'other two together')


def given_lines(joints: Sequence[str]) -> Tuple[str, ...]:
    """Return the joints as a tuple of lines; raise ValueError if they are none."""
    if isinstance(joints, str) or not joints:
        raise ValueError(f'joints must be a list of lines, one a joint, got {joints!r}')
    return tuple(joints)

