# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The tolerances of the core: what counts as equal, from the rounding of one sum upwards.

All are without a unit: parts of a size, or angles [rad]; inputs and outputs count in their sizes.
"""

# Angles below this [rad] are zero: the rounding of any other angle is coarser.
MIN_ANGLE = 1e-18
# A margin or a sum counts as zero within rounding: eight half ulps of the scale.
TOLERANCE = 8 * 2.0 ** -53
# Inputs, or values of an output, no farther apart than this are one: the rounding of many sums.
ONE = 1e-13
# Rounding that a whole linkage of joints has piled up.
ROUNDING = 1e-12
# What differs by less is one where nothing else tells: roots of rounding are ten times as far.
CLOSE = 1e-9
# Next to a singular pose half of all digits are lost: no sine or margin below this is trusted.
SINGULAR = 1e-6
