# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Robot models: the mechanisms of a scene as URDF, and what shows them. No ROS."""
