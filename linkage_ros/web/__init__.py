# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The viewer's page: what it serves, what it draws from, and what its sliders do."""
