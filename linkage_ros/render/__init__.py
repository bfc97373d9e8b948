# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Pictures of scenes: PNG, SVG, GIF and MP4, with Matplotlib and without ROS.

    python -m linkage_ros.render config/jansen.yaml --out leg.gif
"""
