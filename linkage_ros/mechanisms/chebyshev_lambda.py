# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Chebyshev's lambda: the four-bar of his walking mechanism.

Built like Hoeken's linkage, with ground OQ = a (4 + sqrt 7)/3 and AB = QB = BP = a (3 + sqrt 7)/2.
These make the straight part of P's curve as straight as it can be over half a turn of the crank:
its height has seven extremes, equally high and low in turn.

Source: Chebyshev, "Les plus simples systemes de tiges articulees", 1878.
"""

from ..linkage import Design

DESIGN = Design('chebyshev_lambda', {'a': 1.0}, tracer='P', joints=(
    'O ground 0 0',
    'Q ground 2.2152504370215302*a 0',
    'A crank O a',
    'B dyad A Q 2.8228756555322954*a 2.8228756555322954*a left',
    'P line A B 5.6457513110645907*a'))
