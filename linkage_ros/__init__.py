# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Closed planar linkages, moved exactly, for ROS 2 and without it."""
