# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Linkages that people have: written down, and held to the lengths of their bars in 50 digits.

A case is a table: its lines, its dimensions, what its inputs run through, a sketch of its first
pose read off a drawing, and its law, which says of every bar, pin and guide what it keeps.
"""

import math
from typing import Callable, NamedTuple

from linkage_ros import mechanisms, scene
from mpmath import mp, mpc, mpf
import numpy as np
import pytest
from truth.accuracy_rule import RULE
from truth.closed_loops import cis, ClosedLoops, cross

# What a velocity or rate may be off by, as a part of its top speed, beyond what lengths tell.
SPEED = 1e-13


class Case(NamedTuple):
    """A linkage that someone has."""

    lines: str
    numbers: dict
    path: tuple
    sketch: dict
    law: Callable


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
    # Its yoke goes as far as two cranks of half its size, geared against each other.
    'Scotch yoke': Case("""
        O ground 0 0
        A crank O r/2
        B crank O r/2 geared crank -1 0
        C parallelogram O A B""",
        {'r': 0.3}, ((0.2,), (2.9,)), {'O': 0, 'A': 0.15, 'B': 0.15, 'C': 0.3},
        lambda x, n, u: (x.O, x.A - n.r * cis(u) / 2, x.B - n.r * cis(-u) / 2,
                         x.C - n.r * cis(u).real)),
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
    # The middle of the cross turns twice as fast as the shafts A and B; both slots hold it.
    'Oldham coupling': Case("""
        O ground 0 0
        Q ground e 0
        M ground e/2 0
        A crank O r
        B crank Q r geared crank 1 90deg
        C crank M e/2 geared crank 2 0""",
        {'e': 0.01, 'r': 0.04}, ((0.3,), (5.9,)),
        {'O': 0, 'Q': 0.01, 'M': 0.005, 'A': 0.04, 'B': 0.01 + 0.04j, 'C': 0.01},
        lambda x, n, u: (x.O, x.Q - n.e, x.M - n.e / 2, x.A - n.r * cis(u),
                         x.B - x.Q - 1j * n.r * cis(u), cross(x.C - x.O, cis(u)),
                         cross(x.C - x.Q, 1j * cis(u)))),
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


def made(name, size=1.0):
    """Return the linkage of a case, larger by a factor; an offset of gears stays."""
    numbers = {key: value if (name, key) == ('geared five-bar', 'c') else value * size
               for key, value in CASES[name].numbers.items()}
    return mechanisms.create('custom', joints=list(map(
        str.strip, CASES[name].lines.strip().splitlines())), **numbers)


def poses(name, count=5):
    """Return the inputs along a case's path, shape (poses, inputs)."""
    return np.linspace(*CASES[name].path, count)


def given(inputs):
    """Return inputs, with the last axis for each, as a mechanism takes them."""
    columns = list(np.moveaxis(np.asarray(inputs), -1, 0))
    return columns[0] if len(columns) == 1 else columns


def in_digits(place):
    """Return a joint as a number with many digits."""
    return mpc(*map(float, place))


@pytest.mark.parametrize('name', CASES)
def test_a_case_keeps_every_length_to_the_last_digits(name):
    case, linkage, path = CASES[name], made(name), poses(name).tolist()
    for inputs, (exact, spread) in zip(path, ClosedLoops(case.law, case.numbers).follow(
            case.sketch, path)):
        for joint, place in linkage.solve(given(inputs)).items():
            assert abs(in_digits(place) - exact[joint]) <= RULE * spread[joint], (inputs, joint)


@pytest.mark.parametrize('name', CASES)
def test_its_rates_by_each_input_are_those_of_its_bars(name):
    case, linkage = CASES[name], made(name)
    loops, inputs = ClosedLoops(case.law, case.numbers), poses(name)[2].tolist()
    near = {joint: complex(*place) for joint, place in linkage.solve(given(inputs)).items()}
    for by in range(len(inputs)):
        with mp.workdps(50):
            step = mpf(10) ** -20 * (1.0 if linkage.inputs[by].turns else inputs[by])
            after, before = (loops.refined(near, [
                mpf(x) + sign * step * (i == by) for i, x in enumerate(inputs)])[0]
                for sign in (1, -1))
            exact = {joint: (after[joint] - before[joint]) / (2 * step) for joint in near}
        rates, top = linkage.velocity(given(inputs), by=by), max(map(abs, exact.values()))
        for joint, rate in rates.items():
            assert abs(in_digits(rate) - exact[joint]) <= SPEED * top, (by, joint)
        turning = linkage.joint_rates(given(inputs), by=by)
        for link in linkage.links:
            if link.name in [each.name for each in linkage.inputs]:
                assert turning[link.name] == (link.name == linkage.inputs[by].name)


@pytest.mark.parametrize('name', CASES)
def test_arrays_functions_and_machine_code_say_the_same(name):
    linkage, inputs = made(name), poses(name, 6).reshape(3, 2, -1)
    whole, quick = linkage.solve(given(inputs)), linkage.accelerated().solve(given(inputs))
    pose = linkage.function(None, linkage.joints)
    angles = linkage.joint_angles(given(inputs))
    for index in np.ndindex(3, 2):
        values = pose(*map(float, inputs[index]))
        np.testing.assert_array_equal(
            values[:2 * len(whole)], np.ravel([place[index] for place in whole.values()]))
        np.testing.assert_allclose(
            values[2 * len(whole):], [angle[index] for angle in angles.values()], rtol=4e-16)
    for joint, place in whole.items():
        np.testing.assert_array_equal(quick[joint], place)


@pytest.mark.parametrize('power', [-600, -30, 40, 600])
@pytest.mark.parametrize('name', CASES)
def test_a_case_of_another_size_is_the_same_to_the_bit(name, power):
    size, plain = 2.0 ** power, made(name)
    linkage, lengths = made(name, size), np.array([
        1.0 if input_.turns else size for input_ in plain.inputs])
    inputs, held = poses(name), poses(name)[0][1:]
    for joint, place in linkage.solve(given(inputs * lengths)).items():
        np.testing.assert_array_equal(place, size * plain.solve(given(inputs))[joint])
    assert linkage.reach(*held * lengths[1:]) == [
        tuple(end * lengths[0] for end in arc) for arc in plain.reach(*held)]
    assert linkage.dead_points(*held * lengths[1:]) == [
        dead * lengths[0] for dead in plain.dead_points(*held)]


@pytest.mark.parametrize('name', CASES)
def test_the_reach_is_where_all_joints_have_a_place(name):
    linkage, held = made(name), poses(name)[0][1:].tolist()
    first, arcs = linkage.inputs[0], linkage.reach(*held)
    value = np.linspace(first.low, first.high, 4002)[1:-1]
    placed = np.all([np.isfinite(place).all(axis=-1) for place in linkage.solve(
        [value, *([x] * len(value) for x in held)] if held else value).values()], axis=0)
    assert np.array_equal(first.on(arcs, value), placed) and placed.any()
    for end in (end for arc in arcs for end in arc):
        assert np.isfinite(list(linkage.solve([end, *held] if held else end).values())).all()


@pytest.mark.parametrize('name', CASES)
def test_a_dead_point_is_where_a_transmission_angle_is_flat(name):
    linkage, held = made(name), poses(name)[0][1:].tolist()
    for angle in linkage.transmission_angles(given(poses(name, 50))).values():
        assert np.all((angle >= 0.0) & (angle <= math.pi))
    for value in linkage.dead_points(*held):
        angles = linkage.transmission_angles([value, *held] if held else value).values()
        assert any(math.isnan(angle) or math.sin(angle) < 1e-6 for angle in angles), value
        assert linkage.distance_to_dead_point(value, *held) == 0.0


@pytest.mark.parametrize('name', CASES)
def test_the_inverse_finds_the_first_input_from_where_every_joint_is(name):
    linkage, inputs = made(name), poses(name)[1].tolist()
    first, *held = inputs
    for joint, rate in linkage.velocity(given(inputs)).items():
        for axis in np.flatnonzero(np.abs(rate) > 1e-9):
            output, value = f'{joint}.{"xy"[axis]}', linkage.solve(given(inputs))[joint][axis]
            answers = linkage.input_for(output, value, others=held)
            assert np.abs(answers - first).min() < 1e-9, output
            back = linkage.solve([answers, *(x + 0.0 * answers for x in held)]
                                 if held else answers)[joint][:, axis]
            np.testing.assert_allclose(back, value, atol=1e-12 * linkage.longest)


# --- what is published about them --------------------------------------------------------------

def turned(linkage, theta, first, second):
    """Return the angles from one joint to another [rad], without jumps."""
    name = f'angle({first},{second})'
    return np.unwrap(linkage.joint_angles(theta, (name,))[name])


def corner(one, other, opposite):
    """Return the angle between two sides of a triangle, in digits: the law of cosines."""
    return mp.acos((one ** 2 + other ** 2 - opposite ** 2) / (2 * one * other))


@pytest.mark.parametrize('piston', [-0.6, -0.3, 0.0, 0.2, 0.45])
def test_an_excavator_turns_by_the_law_of_cosines(piston):
    linkage, n = made('excavator'), {key: mpf(x) for key, x in CASES['excavator'].numbers.items()}
    boom, arm, bucket = (40 * piston + zero for zero in (98.779, 130.89, 120.459))
    place = {name: in_digits(at) for name, at in linkage.solve([boom, arm, bucket]).items()}

    def angle(pivot, one, other):
        return abs(mp.arg((place[one] - place[pivot]) / (place[other] - place[pivot])))

    idler = IDLER + corner(n['e'], n['i'], mpf(120.459)) - corner(n['e'], n['i'], bucket)
    across = mp.sqrt(n['i'] ** 2 + n['g'] ** 2 - 2 * n['i'] * n['g'] * mp.cos(idler))
    for found, exact in ((angle('O', 'P', 'B'), corner(n['p'], n['b'], boom)),
                         (angle('A', 'C', 'D'), corner(n['c'], n['d'], arm)),
                         (angle('E', 'G', 'H'), idler),
                         (angle('H', 'E', 'J'), corner(n['g'], across, n['i'])
                          + corner(across, n['m'], n['k']))):
        assert abs(found - min(exact, 2 * mp.pi - exact)) < 4e-15


def test_the_longest_piston_of_the_excavator_is_longer_than_its_triangles():
    # 40 x 0.6 + 130.89 cm are more than the 112.156 + 41.031 cm that arm and boom leave.
    linkage = made('excavator')
    longest = [40 * 0.6 + zero for zero in (98.779, 130.89, 120.459)]
    over = [length > input_.high for length, input_ in zip(longest, linkage.inputs)]
    assert over == [False, True, True]
    place = linkage.solve(longest)
    assert np.isfinite(place['B']).all() and np.isnan(place['D']).all()


def test_both_cranks_of_a_leg_on_one_shaft_hold_its_foot_between_them():
    leg, (a, b) = made('five-bar leg'), CASES['five-bar leg'].numbers.values()
    first, second = poses('five-bar leg', 40).T
    half, middle = 0.5 * (second - first), 0.5 * (second + first)
    far = a * np.cos(half) + np.sqrt(b ** 2 - (a * np.sin(half)) ** 2)
    np.testing.assert_allclose(leg.solve([first, second])['F'] @ (1, 1j),
                               far * np.exp(1j * middle), rtol=1e-14)
    assert np.isnan(leg.solve([0.3, 0.3])['F']).all()


def test_two_parallelograms_keep_the_tool_level():
    arm, inputs = made('parallelogram arm'), given(poses('parallelogram arm', 40))
    place = arm.solve(inputs)
    np.testing.assert_allclose(place['L'] - place['W'], place['G'] - place['O'], atol=1e-12)
    np.testing.assert_allclose(
        place['W'] @ (1, 1j),
        142.07 * np.exp(1j * inputs[0]) - 158.81 * np.exp(1j * inputs[1]), rtol=1e-14)
    # Driven the other way: the motor of the lower arm holds, that of the upper arm follows.
    assert not np.any(arm.velocity(inputs, by=1)['A'])


def test_a_finger_that_mimics_its_driver_is_off_by_two_degrees():
    finger, theta = made('2F-85 finger'), np.linspace(0.0, 0.8, 81)
    follower = np.degrees(turned(finger, theta, 'P', 'F'))
    assert np.ptp(follower) == pytest.approx(1.85, abs=0.005)
    np.testing.assert_allclose(finger.solve(0.0)['T'] @ (1, 1j), TIP, atol=1e-16)


def test_the_side_of_a_nearly_folded_dyad_is_not_that_of_its_zero_pose():
    toe, ahead_of = made("Cassie's toe"), np.angle(FOOT - CRANK)
    tarsus, heel = np.angle(FOOT), math.atan2(0.006, 0.05512)

    def foot(linkage, crank):
        pins = linkage.solve([tarsus, crank - ahead_of])
        return np.angle((pins['B'] - pins['F']) @ (1, 1j)) - heel

    # Of the keyframe the soft closure is 2 mm open, which is 0.035 rad at the foot.
    assert foot(toe, -1.52439) == pytest.approx(-1.59681, abs=0.04)
    other = mechanisms.create('custom', joints=[
        line.strip() for line in CASES["Cassie's toe"].lines.strip().splitlines()],
        branches={'B': 1}, **CASES["Cassie's toe"].numbers)
    assert foot(other, 0.0) == pytest.approx(0.0, abs=1e-12)
    assert abs(foot(toe, 0.0)) > 0.1


def test_the_closed_four_bar_of_gazebo_stays_a_parallelogram():
    four_bar, theta = made('closed SDF four-bar'), np.linspace(-math.pi, math.pi, 91)
    place = four_bar.solve(theta)
    np.testing.assert_allclose(place['B'] - place['A'], [(0.3, 0.0)] * len(theta), atol=1e-15)
    below = four_bar.solve(-0.5 * math.pi)
    (x, y), (u, v) = below['Q'] - below['A'], below['B'] - below['A']
    assert x * v - y * u < 0.0  # seen there, B is right of A -> Q; it is written left


def test_a_scissor_lift_follows_from_the_cylinder_between_its_arms():
    lines = [*map(str.strip, CASES['scissor lift'].lines.strip().splitlines()),
             'C line O M 0.4*a', 'D line M F 0.5*a']
    lift = mechanisms.create('custom', joints=lines, **CASES['scissor lift'].numbers)
    foot = np.linspace(0.3, 1.8, 31)
    height, length = (lift.joint_angles(foot, (name,))[name] for name in
                      ('E.y', 'distance(C,D)'))
    # Both triangles have the angle between the arms at M.
    np.testing.assert_allclose(height, 2 * np.sqrt(4.0 - foot ** 2) + 0.1, rtol=1e-15)
    opened = 1.0 - foot ** 2 / 2.0
    np.testing.assert_allclose(length, np.sqrt(0.36 + 0.25 - 0.6 * opened), rtol=2e-15)
    for stroke, at in zip(length, foot):
        np.testing.assert_allclose(lift.input_for('distance(C,D)', stroke), [at], rtol=1e-14)
        assert lift.follow('distance(C,D)', float(stroke), 1.0)[0] == pytest.approx(at)


def test_a_clamp_is_locked_where_handle_and_rod_are_in_line():
    clamp = made('toggle clamp')
    (_, locked), _ = clamp.extremes('QB', [(-0.5, 1.5)])[0]
    o, a, b = (clamp.solve(locked)[name] @ (1, 1j) for name in 'OAB')
    assert abs(cross(a - o, b - a)) < 1e-7 * abs(a - o) * abs(b - a)
    assert abs(clamp.joint_rates(locked)['QB']) < 1e-6
    assert clamp.transmission_angles(locked)['B'] > 0.5


@pytest.mark.parametrize('name, joint, size', [
    ('Scotch yoke', 'C', 0.3), ('Cardan gears', 'B', 0.2)])
def test_circles_in_circles_draw_an_exact_straight_line(name, joint, size):
    linkage, theta = made(name), np.linspace(-math.pi, math.pi, 361)
    place, rate = linkage.solve(theta)[joint], linkage.velocity(theta)[joint]
    np.testing.assert_allclose(place[:, 0], size * np.cos(theta), atol=1e-16)
    np.testing.assert_allclose(rate[:, 0], -size * np.sin(theta), atol=2e-16)
    assert max(np.abs(place[:, 1]).max(), np.abs(rate[:, 1]).max()) < 2e-16


def test_a_gripper_opens_as_a_slider_crank_does_and_its_servo_has_a_ratio():
    gripper, theta = made('gripper'), np.linspace(0.0, 0.8, 41)
    opened = 40 * np.cos(theta) + np.sqrt(17.5 ** 2 - (40 * np.sin(theta) - 13) ** 2)
    np.testing.assert_allclose(gripper.solve(theta)['S'][:, 0], opened, rtol=1e-15)
    lines = [line.strip() for line in CASES['gripper'].lines.strip().splitlines()]
    lines[2:3] = ['H ground 60 0', 'M crank H 5', 'A crank O m geared crank -0.4 15deg']
    geared = mechanisms.create('custom', joints=lines, **CASES['gripper'].numbers)
    servo = (math.radians(15.0) - theta) / 0.4
    np.testing.assert_allclose(geared.solve(servo)['S'][:, 0], opened, rtol=1e-15)
    ends = [(math.radians(15.0) - end) / 0.4 for end in gripper.reach()[0][::-1]]
    assert geared.reach()[0] == pytest.approx(ends)
    np.testing.assert_allclose(geared.input_for('S.x', opened[5]), sorted(
        (math.radians(15.0) - gripper.input_for('S.x', opened[5])) / 0.4))


def test_a_trammel_draws_an_ellipse():
    trammel = made('trammel of Archimedes')
    x, y = trammel.solve(np.linspace(-0.5, 0.5, 101))['P'].T
    np.testing.assert_allclose((x / 0.3) ** 2 + (y / 0.8) ** 2, 1.0, rtol=1e-14)
    assert trammel.dead_points() == [-0.5, 0.5]


def test_a_rack_steers_both_wheels_alike_and_the_inner_one_more():
    steering, turn = made('rack steering'), np.linspace(-0.07, 0.07, 29)
    right, left = (np.degrees(turned(steering, 0.35 + turn, *bar)) for bar in ('QC', 'KD'))
    right, left = right - right[14], left - left[14]
    np.testing.assert_allclose(left, -right[::-1], atol=1e-12)
    assert np.all(np.abs(right[:10]) < np.abs(left[:10]) - 0.2) or np.all(
        np.abs(right[:10]) > np.abs(left[:10]) + 0.2)


def test_the_long_bars_of_an_antiparallelogram_cross_on_an_ellipse():
    linkage, theta = made('antiparallelogram'), np.linspace(0.1, 3.0, 59)
    o, q, a, b = (linkage.solve(theta)[name] @ (1, 1j) for name in 'OQAB')
    part = cross(b - q, q - o) / cross(b - q, a - o)
    meet = o + part * (a - o)
    np.testing.assert_allclose(abs(meet - o) + abs(meet - q), 0.25, rtol=1e-13)


def test_an_elbow_has_a_motor_of_its_own():
    arm, inputs = made('elbow motor'), given(poses('elbow motor', 40))
    np.testing.assert_allclose(arm.solve(inputs)['B'] @ (1, 1j), 0.4 * np.exp(1j * inputs[0])
                               - 0.3 * np.exp(1j * (inputs[0] + inputs[1])), atol=1e-15)
    far = arm.joint_angles(inputs, ('distance(O,B)',))['distance(O,B)']
    np.testing.assert_allclose(
        far, np.sqrt(0.4 ** 2 + 0.3 ** 2 - 2 * 0.4 * 0.3 * np.cos(inputs[1])), rtol=1e-14)
