# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What the library is held to, worked out without it: for the tests and for the benchmark.

=====================  ============================================================================
drawing                any linkage, drawn from its joint lines in 96 digits or for many angles
drawing_accuracy       how far an answer of any linkage may be from its drawing
hard_cases             dimensions that are hard on the catalogue
random_linkages        random joint lines of every word, nearly degenerate ones, equal bars
cases                  linkages that people have
linkage_checks         everything that is asked of any linkage
inverse_judge          an output's solutions, by sampled and bisected poses
equal_bars             the limits of poses of equal bars, from both sides
rods                   linkages of rods in space, in 90 digits and by a polynomial
hostile_texts          texts that no joint line or number should be
working_modes          all inputs of linkages with several, by circles
original_formulas      the formulas of the original documents, which break the rule
=====================  ============================================================================
"""
