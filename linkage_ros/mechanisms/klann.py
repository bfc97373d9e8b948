# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Klann's leg: six bars from a crank to a foot that steps over things.

The rod from the crank pin A carries the elbow D, held by the lower rocker BD, and the knee E; the
leg from the knee to the hip F, held by the upper rocker CF, ends in the foot G. The defaults are
the distances between the joints of the patent's example, in its unit.

Source: Klann, "Walking device", US patent 6,260,862, 2001.
"""

from ..linkage import Design

DESIGN = Design('klann', {
    'm': 0.268, 'a': 0.590, 'b': 0.3206, 'c': 0.5221, 'd': 1.1051, 'e': 0.5177, 'f': 0.8966,
    'g': 0.8966, 'h': 1.732, 'i': 0.590, 'j': 0.176, 'k': 0.233, 'l': 0.616,
}, tracer='G', joints=(
    'O ground 0 0',
    'B ground -i -j',
    'C ground -k l',
    'A crank O m',
    'D dyad A B a b right',
    'E rigid A D d c right',
    'F dyad E C f e left',
    'G rigid E F g h right'))
