# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A linkage and its image in a mirror line: every joint is where the mirror shows it."""

from linkage_ros import mechanisms
import numpy as np
import pytest

# One of every construction, by two inputs; the mirror line O-H is askew and joints lie on it.
ALL = ('O ground 0 0', 'H ground 1 2', 'K ground 1 0', 'Q ground 1.5 -0.3', 'A crank K 0.2',
       'B dyad A Q 0.7 0.6 left', 'T rigid B Q 0.5 0.6 right', 'I line Q B 0.9',
       'S slider B 0.9 Q 0.3 out', 'U block S 0.1 0.2', 'L slot Q A 0.05 out 1.0',
       'E crank A 0.1 zero K', 'M mirror K A Q', 'P parallelogram Q B T',
       'N antiparallelogram Q B I', 'R V W inversor Q A 1.5 0.6', 'G line K Q 0.3',
       'F cylinder K G 0.4 left geared carriage 1 0', 'm mirrored O H')
CARRIAGE = ('O ground 0 0', 'H ground 1 2', 'C carriage O along H 0.1 0.6')


def seen(places, first='O', second='H'):
    """Return each place as it is seen in the mirror line, as complex numbers."""
    at = {name: complex(*place) for name, place in places.items()}
    along = (at[second] - at[first]) / abs(at[second] - at[first])
    return at, {name: at[first] + along ** 2 * (place - at[first]).conjugate()
                for name, place in at.items()}


@pytest.mark.parametrize('up', ['', ' up'])
def test_every_construction_has_its_image(up):
    lines = [line + up if line == 'A crank K 0.2' else line for line in (*CARRIAGE, *ALL[2:])]
    linkage = mechanisms.create('custom', joints=lines)
    assert [input_.name for input_ in linkage.inputs] == ['carriage', 'crank', 'crank2']
    count = 0
    for values in np.random.default_rng(3).uniform((0.15, -3.0, -3.0), (0.55, 3.0, 3.0), (40, 3)):
        places, images = seen(linkage.solve(values.tolist()))
        for name, image in images.items():
            if f'{name}m' in places:
                assert np.isnan(image) == np.isnan(places[f'{name}m'])
                assert np.isnan(image) or abs(image - places[f'{name}m']) < 1e-13
                count += not np.isnan(image)
    assert count > 400 and 'Om' not in linkage.points and 'Cm' not in linkage.points


def test_an_image_may_be_mirrored_again():
    linkage = mechanisms.create('custom', joints=(
        'O ground 0 0', 'H ground 1 0', 'V ground 0 1', 'K ground 2 1', 'A crank K 0.5 up',
        'x mirrored O H', 'y mirrored O V'))
    place = {name: complex(*at) for name, at in linkage.solve(0.4).items()}
    assert place['Ax'] == pytest.approx(place['A'].conjugate())
    assert place['Ay'] == pytest.approx(-place['A'].conjugate())
    assert place['Axy'] == pytest.approx(-place['A'])


def check_images(lines, inputs, **dimensions):
    """Hold each joint of a linkage against where an askew mirror line shows it."""
    linkage = mechanisms.create('custom', joints=(
        *lines, 'y1 ground 0.3 0.1', 'y2 ground 0.5 0.9', 'm mirrored y1 y2'), **dimensions)
    for values in inputs:
        places, images = seen(linkage.solve(values[0] if len(values) == 1 else values), 'y1', 'y2')
        near = 1e-14 * max(map(abs, places.values()))
        assert all(abs(images[name] - place) < near for name, place in (
            (name[:-1], place) for name, place in places.items() if name.endswith('m')))


@pytest.mark.nightly(all_but=8)
@pytest.mark.parametrize('zero', ['', ' up', ' zero Z'])
@pytest.mark.parametrize('ground', ['0.6 0', '0 0.6', '-0.48 0.36', '0.36 -0.48', '-0.6 0'])
@pytest.mark.parametrize('line', ['B dyad A Q 0.6 0.2 left', 'B dyad A Q 0.9 0.5 right',
                                  'B slider A 0.2 O 0.4 out', 'B slider A 0.2 O 90deg in'])
def test_an_image_passes_change_points_as_what_it_shows_does(line, ground, zero):
    check_images(('O ground 0 0', 'Z ground 0.1 -0.2', f'Q ground {ground}',
                  f'A crank O 0.2{zero}', line), [[x] for x in np.linspace(-3.1, 3.1, 13)])
