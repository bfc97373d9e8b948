# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Robot models: a scene as URDF, SDF or MJCF, and RViz's configuration. No ROS."""
