# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Linkages in the plane: joint lines, constructions, poses, reach, inverse and walkers. No ROS."""
