# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The whole motion of the first input: reach, dead points, extremes and curves."""
