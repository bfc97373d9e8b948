# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The viewer: a node that shows the running scene on a page in the browser, with sliders."""
