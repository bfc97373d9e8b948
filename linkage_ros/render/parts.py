# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The names of what a picture can show, as the command line takes them."""

TRACES = ('whole', 'growing', 'fading', 'stance', 'none')
PARTS = ('axes', 'title', 'dimensions', 'labels', 'links', 'joints', 'guides', 'floor')

USUAL = frozenset({'axes', 'title', 'labels', 'links', 'joints', 'guides'})
USUAL_IN_MOTION = USUAL - {'labels'}
