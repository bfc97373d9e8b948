# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The constructions: in the plane and in space, in closed form, with their proofs."""
