# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Scenes from robot descriptions: MJCF, SDF and URDF with closed planar loops."""
