# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What the nodes cost, next to what any node costs: real processes on real topics."""
