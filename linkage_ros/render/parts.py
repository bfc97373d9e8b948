# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Names of traces and parts of a picture, as the command line has them."""

TRACES = ('whole', 'growing', 'fading', 'stance', 'none')
PARTS = ('axes', 'title', 'dimensions', 'labels', 'links', 'joints', 'guides', 'floor')

DEFAULT = frozenset({'axes', 'title', 'labels', 'links', 'joints', 'guides'})
DEFAULT_IN_MOTION = DEFAULT - {'labels'}
