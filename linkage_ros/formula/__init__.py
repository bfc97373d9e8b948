# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Formulas written once: expressions, their rates, and the code that is made from them."""
