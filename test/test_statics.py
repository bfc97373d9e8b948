# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Efforts that balance loads on every joint and link, against the work in small motions."""

from linkage_ros import mechanisms
import numpy as np
import pytest

# Every word of the joint lines moves, on the ground and on moving links.
LINKAGES = {
    'crank': ('O ground 0 0', 'A crank O 1', 'B crank A 0.7 zero O', 'C rigid A B 0.5 0.4 left'),
    'cylinder': ('O ground 0 0', 'P ground 0.5 -0.2', 'B cylinder P O 1.1 right',
                 'C rigid O B 0.6 0.8 left', 'D block B 0.3 0.1'),
    'cylinder on a link': ('O ground 0 0', 'Q ground 2 0', 'A crank O 1',
                           'B cylinder A Q 1.4 left', 'C rigid Q B 0.6 1.2 left'),
    'two cylinders': ('O ground 0 0', 'P ground 0.6 -0.3', 'B cylinder P O 1.2 right',
                      'C rigid O B 0.5 1.1 left', 'D cylinder C B 1 right'),
    'carriage': ('O ground 0 0', 'H ground 4 1', 'S carriage O along H 0.1 2',
                 'T dyad S H 2 2.5 left', 'U carriage S along T 0.2 1.5', 'V block U 0.3 -0.4'),
    'slot': ('O ground 0 0', 'Q ground 2 0', 'A crank O 0.5', 'B slot Q A 0.3 out 3',
             'C dyad B O 1.7 3.1 left', 'D slot C A 0.2 in 1'),
    'slider': ('O ground 0 0', 'G ground 0 0.1', 'A crank O 0.5', 'B slider A 1.2 G 0.2 out',
               'C block B 0.2 0.3', 'D slider C 1.5 O along A in'),
    'yoke': ('O ground 0 0', 'G ground 0 0.4', 'H ground 1 0.4', 'A crank O 0.3',
             'Y yoke A G along H', 'T block Y 0.1 0.2', 'B dyad A H 0.9 0.8 left',
             'Z yoke T H along B'),
    'dyads': ('O ground 0 0', 'Q ground 3 0.5', 'A crank O 0.6', 'B dyad A Q 2.5 1.5 left',
              'E rigid A B 1 1.8 left', 'F line A B -0.7', 'G mirror B A Q',
              'C parallelogram B A Q', 'D antiparallelogram B A Q'),
    'inversor': ('O ground 0 0', 'P ground -3 0', 'A crank O 3', 'B C D inversor P A 9 4'),
    'gears': ('O ground 0 0', 'Q ground 3 0', 'A crank O 1', 'C crank Q 1 geared crank -0.5 0.3',
              'B dyad A C 2 2 left', 'D crank B 0.4 zero A geared crank 2 0.1',
              'R ground 1 5', 'E cylinder R B 2 left', 'S ground 8 3', 'T ground 9 5',
              'F carriage S along T 0 4 geared cylinder 0.5 0.2'),
}
# Two hinges in a row, one rod on a crank, one on a cylinder.
ANKLE = (
    'pitch hinge ground at 0 0 0 axis 0 1 0 within -30deg 30deg',
    'roll hinge pitch at 0 0 -0.02 axis 1 0 0 within -15deg 15deg',
    'right motor ground at 0.022 0 0.2159 axis 1 0 0',
    'R rod right 0.0395 -0.0164 0.2112 roll 0.022 -0.015 -0.0096',
    'left cylinder ground 0.035 0.0165 0.1469 roll 0.022 0.015 -0.0096')


MADE = {**{name: (lambda lines=lines: mechanisms.create('custom', joints=lines))
           for name, lines in LINKAGES.items()},
        **{kind: (lambda kind=kind: mechanisms.create(kind)) for kind in mechanisms.TYPES},
        'ankle': lambda: mechanisms.create('rods', joints=ANKLE)}


def turning(mechanism, name):
    """Return the output with the angle of a link that its moment turns; None if none does."""
    link = next(link for link in mechanism.links if link.name == name)
    if mechanism.axes != 'xy':
        return name
    if link.kind == 'prismatic':
        return None if link.parent == 'ground' else turning(mechanism, link.parent)
    return f'angle({link.joint},{link.tip})'


@pytest.mark.nightly(all_but=6)
@pytest.mark.parametrize('name', MADE)
def test_efforts_balance_a_force_on_each_joint_and_a_moment_on_each_link(name):
    mechanism, rng, compared = MADE[name](), np.random.default_rng(2), 0
    step, n = 2.0 ** -17, len(mechanism.inputs)
    while compared < 2:
        values = np.array([0.07, 0.158]) if name == 'ankle' else np.array([
            rng.uniform(x.low, x.high) for x in mechanism.inputs])
        near = [values + side * step * np.eye(n)[:, by] for by in range(n) for side in (-1, 1)]
        near = [row.tolist() if n > 1 else row[0] for row in near]
        if not np.isfinite([[*mechanism.joint_angles(row).values()] for row in near]).all():
            continue
        compared += 1
        for part in (*mechanism.points, *mechanism.joints):
            load = rng.uniform(-9.0, 9.0, len(mechanism.axes)) if part in mechanism.points \
                else rng.uniform(-9.0, 9.0)
            output = '' if part in mechanism.points else turning(mechanism, part)
            at = [mechanism.joint_angles(row, (output,))[output] if output else
                  mechanism.solve(row, (part,))[part] if output == '' else 0.0 for row in near]
            moved = [np.subtract(after, before) for before, after in zip(at[::2], at[1::2])]
            wanted = [-np.sum(load * (np.remainder(x + np.pi, 2 * np.pi) - np.pi if output else x))
                      / (2.0 * step) for x in moved]
            found = mechanism.effort(values.tolist() if n > 1 else values[0], {part: load})
            np.testing.assert_allclose(found, wanted, rtol=1e-5, atol=1e-5 * mechanism.longest)


@pytest.mark.parametrize('shape', [(), (1,), (3, 2), (0,)])
def test_loads_may_differ_from_pose_to_pose(shape):
    arm, rng = mechanisms.create('five_bar'), np.random.default_rng(6)
    theta = rng.uniform(1.5, 2.0, shape), rng.uniform(0.5, 1.0, shape)
    loads = {'P': rng.uniform(-1.0, 1.0, (*shape, 2)), 'AP': rng.uniform(-1.0, 1.0, shape)}
    found = arm.effort(theta, loads)
    assert found.shape == (*shape, 2)
    for place in np.ndindex(shape):
        own = arm.effort([x[place] for x in theta], {name: x[place] for name, x in loads.items()})
        np.testing.assert_allclose(found[place], own, rtol=1e-12)


def test_what_is_not_loaded_needs_no_effort_even_at_a_dead_point():
    stretched = mechanisms.create('custom', joints=(
        'O ground 0 0', 'Q ground 1 2', 'A crank O 1', 'B dyad A Q 1 1 left'))
    assert not np.isfinite(stretched.effort(0.0, {'B': (1.0, 0.0)}))
    assert not np.isfinite(stretched.effort(0.0, {'AB': 1.0}))
    assert stretched.effort(0.0, {'B': (0.0, 0.0), 'AB': 0.0, 'A': (0.0, 4.0)}) == -4.0
    assert stretched.effort(0.0, {}) == 0.0
    assert np.array_equal(stretched.effort(np.zeros((2, 3)), {}), np.zeros((2, 3, 1)))


def test_the_effort_of_an_output_asks_for_one_input_and_an_output_that_moves():
    with pytest.raises(ValueError, match='five_bar has several inputs'):
        mechanisms.create('five_bar').output_effort('P.x', (1.9, 0.4), 1.0)
    for output, problem in (('Q.x', 'does not move'), ('Z.x', 'has no output'),
                            (7, 'has no output')):
        with pytest.raises(ValueError, match=problem):
            mechanisms.create('four_bar').output_effort(output, 0.4, 1.0)


class Loud(str):
    """A text that prints in its own way, as a member of an enum does."""

    def __str__(self):
        return f'Loud.{super().__str__()}'


def test_the_names_of_loads_are_texts_of_any_class():
    bars = mechanisms.create('four_bar')
    for text in (np.str_, Loud):
        assert bars.effort(0.4, {text('B'): (0.0, 1.0), text('QB'): 2.0}) == bars.effort(
            0.4, {'B': (0.0, 1.0), 'QB': 2.0})
    with pytest.raises(ValueError, match='the load on the joint B must be a force'):
        bars.effort(0.4, {Loud('B'): 3.0})


@pytest.mark.parametrize('output', ['QB', 'P.x', 'B.y', 'distance(O,B)', 'angle(O,B)'])
@pytest.mark.parametrize('theta', [0.4, [[0.4, 1.0], [2.2, -1.0]]])
def test_the_effort_of_an_output_has_the_power_of_the_input(output, theta):
    bars, step = mechanisms.create('four_bar'), 2.0 ** -17
    before, after = (bars.joint_angles(np.array(theta) + side * step, (output,))[output]
                     for side in (-1.0, 1.0))
    found = bars.output_effort(output, theta, 6.0)
    assert np.shape(found) == np.shape(theta)
    np.testing.assert_allclose(found * (after - before) / (2.0 * step), 6.0, rtol=1e-7)
