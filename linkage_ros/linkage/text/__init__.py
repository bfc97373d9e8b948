# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The text of a linkage: its joint lines, numbers, designs and arguments."""
