# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Formulas: expressions, their derivatives, and the code generated from them."""
