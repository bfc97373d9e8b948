# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The inverse of a linkage: candidates, refined, distinct, and one chosen or followed."""

from .inverse import Inverse, inverse_of, Solution
from .linkage import InverseLinkage
from .segments import Segments, segments_of

# The former name of a solution; deprecated.
Answer = Solution

__all__ = ['Answer', 'Inverse', 'inverse_of', 'InverseLinkage', 'Segments', 'segments_of',
           'Solution']
