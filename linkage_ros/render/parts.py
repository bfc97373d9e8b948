# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What users name when they say what a picture shows."""

TRACES = ('whole', 'growing', 'fading', 'stance', 'none')
PARTS = ('axes', 'title', 'dimensions', 'labels', 'links', 'joints', 'guides', 'floor')

USUAL = frozenset({'axes', 'title', 'labels', 'links', 'joints', 'guides'})
USUAL_IN_MOTION = USUAL - {'labels'}
