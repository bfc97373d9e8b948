# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Linkages that people have.

A case is a table: its lines, its dimensions, what its inputs run through, a sketch of its first
pose read off a drawing, and its law, which says of every bar, pin and guide what it keeps.
"""

import math
from typing import Callable, NamedTuple

from .closed_loops import cis, cross


class Case(NamedTuple):
    """A linkage; see above."""

    lines: str
    numbers: dict
    path: tuple
    sketch: dict
    law: Callable

    @property
    def joints(self):
        """Its lines, one a joint."""
        return [line.strip() for line in self.lines.strip().splitlines()]


def bar(first, second, length):
    """Return what vanishes where two joints are as far from each other as their bar is long."""
    return abs(second - first) - length


def ahead(start, towards, distance):
    """Return the point on a line, a distance from its start."""
    return start + distance * (towards - start) / abs(towards - start)


# An excavator's idler stands so far from the ground bar when its piston is at zero [rad].
IDLER = math.pi / 2 - 0.4305008189
# The 2F-85's finger as in MuJoCo's menagerie, y and z of its right half: where the driver with its
# coupler, the spring link and the tip of the follower are when the gripper is open [m].
DRIVER, SPRING, KNUCKLE, CORNER, TIP = (0.0306011 + 0.054904j, 0.0132 + 0.0609j, 0.0502 + 0.1049j,
                                        0.0682 + 0.0984j, 0.0493 + 0.11192j)
# Cassie's tarsus, seen from itself: the foot's crank and the foot [m].
CRANK, FOOT = 0.058 - 0.034j, 0.408 - 0.04j

CASES = {
    # Figures of a node for an excavator's working arm [cm]; where they leave a choice, any.
    'excavator': Case("""
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
         'f': abs(25.639 - 104.039 * cis(IDLER + math.acos(
             (104.039 ** 2 + 36 ** 2 - 120.459 ** 2) / (2 * 104.039 * 36))))},
        ((98.0, 118.0, 110.0), (118.0, 146.0, 128.0)),
        {'O': 0, 'P': -50j, 'B': 97 - 39j, 'A': 78 - 116j, 'C': -25 - 71j, 'D': 93 - 78j,
         'H': 147 - 157j, 'E': 125 - 144j, 'F': 29 - 104j, 'G': 111 - 177j, 'J': 141 - 182j},
        lambda x, n, s1, s2, s3: (
            x.O, x.P + 1j * n.p, bar(x.P, x.B, s1), bar(x.O, x.B, n.b), bar(x.O, x.A, n.l),
            bar(x.B, x.A, n.q), bar(x.C, x.O, n.o), bar(x.C, x.A, n.c), bar(x.C, x.D, s2),
            bar(x.A, x.D, n.d), bar(x.A, x.H, n.q), bar(x.D, x.H, n.r),
            x.E - ahead(x.H, x.A, n.g), bar(x.F, x.H, n.f), bar(x.F, x.E, n.e),
            bar(x.F, x.G, s3), bar(x.E, x.G, n.i), bar(x.G, x.J, n.k), bar(x.J, x.H, n.m))),
    # Minitaur's leg: both motors on one shaft.
    'five-bar leg': Case("""
        O ground 0 0
        A crank O a
        B crank O a
        F dyad A B b b right""",
        {'a': 0.1, 'b': 0.2}, ((-2.6, -0.5), (-1.8, -1.2)),
        {'O': 0, 'A': -0.09 - 0.05j, 'B': 0.09 - 0.05j, 'F': -0.23j},
        lambda x, n, u, v: (x.O, x.A - n.a * cis(u), x.B - n.a * cis(v), bar(x.F, x.A, n.b),
                            bar(x.F, x.B, n.b))),
    # uArm: the second motor turns the upper arm, two parallelograms keep the tool level [mm].
    'parallelogram arm': Case("""
        O ground 0 0
        G ground -c d
        A crank O l
        S crank O c
        R parallelogram O A S
        W line A R -u
        K parallelogram O A G
        L parallelogram A W K""",
        {'l': 142.07, 'u': 158.81, 'c': 40.0, 'd': 35.0}, ((1.9, 2.9), (0.7, 3.8)),
        {'O': 0, 'G': -40 + 35j, 'A': -46 + 134j, 'S': -39 + 10j, 'R': -85 + 144j,
         'W': 108 + 96j, 'K': -86 + 169j, 'L': 68 + 131j},
        lambda x, n, u, v: (
            x.O, x.G + n.c - 1j * n.d, x.A - n.l * cis(u), x.S - n.c * cis(v),
            bar(x.R, x.A, n.c), bar(x.R, x.S, n.l), x.W - ahead(x.A, x.R, -n.u),
            bar(x.K, x.G, n.l), bar(x.K, x.A, abs(x.G)), bar(x.L, x.K, n.u),
            bar(x.L, x.W, abs(x.G)))),
    '2F-85 finger': Case("""
        D ground dx dy
        Z ground zx zy
        S ground sx sy
        P crank D d zero Z
        F dyad P S f s right
        T rigid P F t r right""",
        {'dx': DRIVER.real, 'dy': DRIVER.imag, 'zx': CORNER.real, 'zy': CORNER.imag,
         'sx': SPRING.real, 'sy': SPRING.imag, 'd': abs(CORNER - DRIVER),
         'f': abs(KNUCKLE - CORNER), 's': abs(KNUCKLE - SPRING), 't': abs(TIP - CORNER),
         'r': abs(TIP - KNUCKLE)}, ((0.0,), (0.8,)),
        {'D': DRIVER, 'Z': CORNER, 'S': SPRING, 'P': CORNER, 'F': KNUCKLE, 'T': TIP},
        lambda x, n, u: (
            x.D - n.dx - 1j * n.dy, x.Z - n.zx - 1j * n.zy, x.S - n.sx - 1j * n.sy,
            x.P - ahead(x.D, x.D + (x.Z - x.D) * cis(u), n.d), bar(x.P, x.F, n.f),
            bar(x.F, x.S, n.s), bar(x.P, x.T, n.t), bar(x.T, x.F, n.r))),
    # One dyad on the tarsus, which the first crank moves; a parallelogram but for 1 mm.
    "Cassie's toe": Case("""
        O ground 0 0
        F crank O l
        K rigid O F k g right
        A crank K a zero F
        B dyad A F r f right""",
        {'l': abs(FOOT), 'k': abs(CRANK), 'g': abs(FOOT - CRANK), 'a': 0.055, 'r': 0.35012,
         'f': math.hypot(0.05512, 0.006)}, ((-0.1, -1.5), (1.2, -2.2)),
        {'O': 0, 'F': FOOT, 'K': CRANK, 'A': 0.06 - 0.09j, 'B': 0.41 - 0.1j},
        lambda x, n, u, v: (
            x.O, x.F - n.l * cis(u), bar(x.O, x.K, n.k), bar(x.K, x.F, n.g),
            x.A - ahead(x.K, x.K + (x.F - x.K) * cis(v), n.a), bar(x.A, x.B, n.r),
            bar(x.B, x.F, n.f))),
    'closed SDF four-bar': Case("""
        O ground 0 0
        Q ground b 0
        A crank O a
        B dyad A Q b a left""",
        {'a': 0.2, 'b': 0.3}, ((0.3,), (2.8,)),
        {'O': 0, 'Q': 0.3, 'A': 0.2 + 0.1j, 'B': 0.5 + 0.1j},
        lambda x, n, u: (x.O, x.Q - n.b, x.A - n.a * cis(u), bar(x.A, x.B, n.b),
                         bar(x.B, x.Q, n.a))),
    'scissor lift': Case("""
        O ground 0 0
        X ground a 0
        F carriage O along X 0.2*a 1.9*a
        M dyad O F a a left
        T line O M 2*a
        U line F M 2*a
        N dyad U T a a left
        V line T N 2*a
        E slider V h O 90deg out
        L block E 0 -w""",
        {'a': 1.0, 'h': 0.1, 'w': 1.5}, ((0.5,), (1.8,)),
        {'O': 0, 'X': 1, 'F': 0.5, 'M': 0.25 + 0.97j, 'T': 0.5 + 1.94j, 'U': 1.94j,
         'N': 0.25 + 2.9j, 'V': 3.87j, 'E': 3.97j, 'L': 1.5 + 3.97j},
        lambda x, n, u: (
            x.O, x.X - n.a, x.F - u, bar(x.O, x.M, n.a), bar(x.F, x.M, n.a), x.T - 2 * x.M,
            x.U - 2 * x.M + x.F, bar(x.U, x.N, n.a), bar(x.T, x.N, n.a), x.V - 2 * x.N + x.T,
            bar(x.V, x.E, n.h), x.E.real, x.L - x.E - n.w)),
    'toggle clamp': Case("""
        O ground 0 0
        Q ground g h
        A crank O m
        B dyad A Q b c left
        P rigid Q B e f right""",
        {'g': 0.08, 'h': 0.01, 'm': 0.03, 'b': 0.05, 'c': 0.035, 'e': 0.09, 'f': 0.07},
        ((1.5,), (-0.5,)), {'O': 0, 'Q': 0.08 + 0.01j, 'A': 0.03j, 'B': 0.05 + 0.04j,
                            'P': 0.08 + 0.1j},
        lambda x, n, u: (x.O, x.Q - n.g - 1j * n.h, x.A - n.m * cis(u), bar(x.A, x.B, n.b),
                         bar(x.B, x.Q, n.c), bar(x.Q, x.P, n.e), bar(x.B, x.P, n.f))),
    'Scotch yoke': Case("""
        O ground 0 0
        X ground r 0
        A crank O r
        C yoke A O along X
        D block C r 0""",
        {'r': 0.3}, ((0.2,), (2.9,)), {'O': 0, 'X': 0.3, 'A': 0.3, 'C': 0.3, 'D': 0.6},
        lambda x, n, u: (x.O, x.X - n.r, x.A - n.r * cis(u), x.C - x.A.real, x.D - x.C - n.r)),
    'geared five-bar': Case("""
        O ground 0 0
        Q ground g 0
        A crank O a
        B crank Q b geared crank -2 0.7
        P dyad A B e f left""",
        {'g': 0.3, 'a': 0.1, 'b': 0.08, 'e': 0.25, 'f': 0.22}, ((0.0,), (3.0,)),
        {'O': 0, 'Q': 0.3, 'A': 0.1, 'B': 0.36 + 0.05j, 'P': 0.25 + 0.2j},
        lambda x, n, u: (x.O, x.Q - n.g, x.A - n.a * cis(u), x.B - x.Q - n.b * cis(0.7 - 2 * u),
                         bar(x.P, x.A, n.e), bar(x.P, x.B, n.f))),
    'Cardan gears': Case("""
        O ground 0 0
        A crank O r
        B crank A r zero O geared crank -2 pi""",
        {'r': 0.1}, ((0.1,), (6.0,)), {'O': 0, 'A': 0.1, 'B': 0.2},
        lambda x, n, u: (x.O, x.A - n.r * cis(u), x.B - 2 * n.r * cis(u).real)),
    # openarm [mm].
    'gripper': Case("""
        O ground 0 0
        G ground 0 h
        A crank O m
        S slider A r G 0 out""",
        {'m': 40.0, 'r': 17.5, 'h': 13.0}, ((0.0,), (0.8,)),
        {'O': 0, 'G': 13j, 'A': 40, 'S': 51 + 13j},
        lambda x, n, u: (x.O, x.G - 1j * n.h, x.A - n.m * cis(u), bar(x.A, x.S, n.r),
                         x.S.imag - n.h)),
    'trammel of Archimedes': Case("""
        O ground 0 0
        X ground l 0
        A carriage O along X -l l
        B slider A l O 90deg out
        P line A B d""",
        {'l': 0.5, 'd': 0.8}, ((-0.4,), (0.45,)),
        {'O': 0, 'X': 0.5, 'A': -0.4, 'B': 0.3j, 'P': 0.24 + 0.48j},
        lambda x, n, u: (x.O, x.X - n.l, x.A - u, x.B.real, bar(x.A, x.B, n.l),
                         x.P - ahead(x.A, x.B, n.d))),
    # The cross slides on the first shaft's O-A; the other's shaft is in a slot square to that.
    'Oldham coupling': Case("""
        O ground 0 0
        Q ground e 0
        A crank O r
        C yoke Q O along A
        B block C 0 r""",
        {'e': 0.01, 'r': 0.04}, ((0.3,), (5.9,)),
        {'O': 0, 'Q': 0.01, 'A': 0.04, 'C': 0.01, 'B': 0.01 + 0.04j},
        lambda x, n, u: (x.O, x.Q - n.e, x.A - n.r * cis(u), cross(x.C - x.O, cis(u)),
                         cross(x.C - x.Q, 1j * cis(u)), x.B - x.C - 1j * n.r * cis(u))),
    'rack steering': Case("""
        G ground 0 0
        H ground t 0
        Q ground t/2 -y
        K ground -t/2 -y
        R carriage G along H w-s w+s
        L block R -2*w 0
        A dyad R Q b a right
        B dyad L K b a left
        C rigid Q A e f left
        D rigid K B e f right""",
        {'t': 1.3, 'y': 0.05, 'w': 0.35, 's': 0.08, 'b': 0.26, 'a': 0.15, 'e': 0.1, 'f': 0.2},
        ((0.28,), (0.42,)),
        {'G': 0, 'H': 1.3, 'Q': 0.65 - 0.05j, 'K': -0.65 - 0.05j, 'R': 0.28, 'L': -0.42,
         'A': 0.51 - 0.11j, 'B': -0.6 - 0.19j, 'C': 0.71 - 0.13j, 'D': -0.75 - 0.06j},
        lambda x, n, u: (
            x.G, x.H - n.t, x.Q - n.t / 2 + 1j * n.y, x.K + n.t / 2 + 1j * n.y, x.R - u,
            x.L - u + 2 * n.w, bar(x.R, x.A, n.b), bar(x.A, x.Q, n.a), bar(x.L, x.B, n.b),
            bar(x.B, x.K, n.a), bar(x.Q, x.C, n.e), bar(x.A, x.C, n.f), bar(x.K, x.D, n.e),
            bar(x.B, x.D, n.f))),
    'antiparallelogram': Case("""
        O ground 0 0
        Q ground g 0
        A crank O a
        B antiparallelogram O A Q""",
        {'g': 0.1, 'a': 0.25}, ((0.4,), (2.8,)),
        {'O': 0, 'Q': 0.1, 'A': 0.23 + 0.1j, 'B': 0.26 + 0.2j},
        lambda x, n, u: (x.O, x.Q - n.g, x.A - n.a * cis(u), bar(x.A, x.B, n.g),
                         bar(x.B, x.Q, n.a))),
    'elbow motor': Case("""
        O ground 0 0
        A crank O a
        B crank A b zero O""",
        {'a': 0.4, 'b': 0.3}, ((0.2, 1.0), (2.0, 3.0)), {'O': 0, 'A': 0.4, 'B': 0.2},
        lambda x, n, u, v: (x.O, x.A - n.a * cis(u), x.B - ahead(
            x.A, x.A - x.A * cis(v), n.b))),
}
