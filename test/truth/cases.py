# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Linkages that people have.

A case is a table: its lines and its dimensions.
"""

import cmath
import math

from scenes import example

from .random_linkages import Design


def case(lines, dimensions):
    """Return the `Design` of a table of lines, one a joint."""
    return Design(tuple(line.strip() for line in lines.strip().splitlines()), dimensions, {})


def shipped(name):
    """Return the `Design` of the one mechanism of an example."""
    parameters = example(name)
    key, = parameters['mechanisms']
    start = f'{key}.dimensions.'
    return Design(parameters[f'{key}.joints'], {
        name.removeprefix(start): value for name, value in parameters.items()
        if name.startswith(start)}, {})


# An excavator's idler stands so far from the ground bar when its piston is at zero [rad].
IDLER = math.pi / 2 - 0.4305008189
# Cassie's tarsus, seen from itself: the foot's crank and the foot [m].
CRANK, FOOT = 0.058 - 0.034j, 0.408 - 0.04j

CASES = {
    # Figures of a node for an excavator's working arm [cm]; where they leave a choice, any.
    'excavator': case("""
        O ground 0 0
        P ground 0 -p
        B cylinder P O b right
        A rigid O B l q right
        C rigid O A o c right
        D cylinder C A d left
        H rigid A D q r right
        E line H A g
        F rigid H E f e left
        G cylinder F E i right
        J dyad G H k m right""",
        {'p': 49.709, 'b': 104.858, 'l': 140.0, 'q': 80.0, 'o': 75.0, 'c': 112.156, 'd': 41.031,
         'r': 95.0, 'g': 25.639, 'i': 36.0, 'k': 30.98, 'm': 26.344, 'e': 104.039,
         'f': abs(25.639 - cmath.rect(104.039, IDLER + math.acos(
             (104.039 ** 2 + 36 ** 2 - 120.459 ** 2) / (2 * 104.039 * 36))))}),
    # Minitaur's leg: both motors on one shaft.
    'five-bar leg': case("""
        O ground 0 0
        A crank O a
        B crank O a
        F dyad A B b b right""",
        {'a': 0.1, 'b': 0.2}),
    # uArm: the second motor turns the upper arm, two parallelograms keep the tool level [mm].
    'parallelogram arm': case("""
        O ground 0 0
        G ground -c d
        A crank O l
        S crank O c
        R parallelogram O A S
        W line A R -u
        K parallelogram O A G
        L parallelogram A W K""",
        {'l': 142.07, 'u': 158.81, 'c': 40.0, 'd': 35.0}),
    # One dyad on the tarsus, which the first crank moves; a parallelogram but for 1 mm.
    "Cassie's toe": case("""
        O ground 0 0
        F crank O l
        K rigid O F k g right
        A crank K a zero F
        B dyad A F r f right""",
        {'l': abs(FOOT), 'k': abs(CRANK), 'g': abs(FOOT - CRANK), 'a': 0.055, 'r': 0.35012,
         'f': math.hypot(0.05512, 0.006)}),
    'scissor lift': shipped('scissor_lift'),
    'Scotch yoke': case("""
        O ground 0 0
        X ground r 0
        A crank O r
        C yoke A O along X
        D block C r 0""",
        {'r': 0.3}),
    'geared five-bar': case("""
        O ground 0 0
        Q ground g 0
        A crank O a
        B crank Q b geared crank -2 0.7
        P dyad A B e f left""",
        {'g': 0.3, 'a': 0.1, 'b': 0.08, 'e': 0.25, 'f': 0.22}),
    'Cardan gears': case("""
        O ground 0 0
        A crank O r
        B crank A r zero O geared crank -2 pi""",
        {'r': 0.1}),
    'trammel of Archimedes': case("""
        O ground 0 0
        X ground l 0
        A carriage O along X -l l
        B slider A l O 90deg out
        P line A B d""",
        {'l': 0.5, 'd': 0.8}),
    # The cross slides on the first shaft's O-A; the other's shaft is in a slot square to that.
    'Oldham coupling': case("""
        O ground 0 0
        Q ground e 0
        A crank O r
        C yoke Q O along A
        B block C 0 r""",
        {'e': 0.01, 'r': 0.04}),
    'rack steering': shipped('rack_steering'),
    'antiparallelogram': case("""
        O ground 0 0
        Q ground g 0
        A crank O a
        B antiparallelogram O A Q""",
        {'g': 0.1, 'a': 0.25}),
    'elbow motor': case("""
        O ground 0 0
        A crank O a
        B crank A b zero O""",
        {'a': 0.4, 'b': 0.3})}
