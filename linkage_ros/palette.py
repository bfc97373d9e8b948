# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The colours of markers, pictures, robot models and the viewer's page."""


# Colours that colour-blind people tell apart (Okabe and Ito, "Color Universal Design").
BLUE, ORANGE, GREEN, VERMILION = '#0072b2', '#e69f00', '#009e73', '#d55e00'
SKY, PURPLE = '#56b4e9', '#cc79a7'
# From text to faint backgrounds.
DARK, FAINT, GREY, FRAME, TRACK, GRID, SHADE = (
    '#222222', '#606060', '#8a8a8a', '#b0b0b0', '#d0d0d0', '#e6e6e6', '#f4f4f4')

# Backgrounds of dark mode: the page, and its grid; RViz's background is DUSK, too.
NIGHT, DUSK = '#161616', '#303030'

# Parts of pictures, markers, robot models and the page; visible on white, NIGHT and DUSK.
BAR, DRIVEN, JOINT, LOCUS, SLOT, EARTH = '#0081c9', '#c87800', GREY, GREEN, GREY, '#998763'
PLATE = '#5b8fae'
# The floor of pictures.
FLOOR = '#b5a27c'
# A vermilion that is legible as text.
REFUSED = '#a84300'


def rgb(colour: str) -> tuple[float, ...]:
    """Return red, green and blue, each from 0 to 1, in three digits."""
    return tuple(round(int(colour[i:i + 2], 16) / 255, 3) for i in (1, 3, 5))
