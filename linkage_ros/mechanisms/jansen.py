# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Theo Jansen's leg: six constructions from a crank to a foot that walks.

The defaults are Jansen's holy numbers. Source: Jansen, "The Great Pretender"; lengths named as in
Wikipedia, "Jansen's linkage".
"""

from ..linkage import Design

HOLY_NUMBERS = {
    'a': 38.0, 'b': 41.5, 'c': 39.3, 'd': 40.1, 'e': 55.8, 'f': 39.4, 'g': 36.7,
    'h': 65.7, 'i': 49.0, 'j': 50.0, 'k': 61.9, 'l': 7.8, 'm': 15.0,
}

DESIGN = Design('jansen', HOLY_NUMBERS, tracer='G', joints=(
    'O ground 0 0',
    'B ground -a -l',
    'A crank O m',
    'C dyad B A b j left',
    'D rigid B C d e left',
    'E dyad B A c k right',
    'F dyad E D g f left',
    'G rigid E F i h left'))
