# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Pictures of scenes: what is drawn is what was solved, the same bytes each time, nothing cut."""

import csv
import itertools
import math
import os
from pathlib import Path
import re
import shutil
import subprocess
from xml.etree import ElementTree

from linkage_ros import mechanisms, palette, scene
from linkage_ros.render import layers
from linkage_ros.render.cli import main, parsed
from linkage_ros.render.cycle import Cycle
from linkage_ros.render.parts import DEFAULT, PARTS
from linkage_ros.render.picture import Picture
from matplotlib.colors import to_rgb
import numpy as np
from PIL import Image
import pytest
from scenes import alone, CASSIE, ROOT
from truth.working_modes import lever_of

CONFIG = ROOT / 'config'
TABLE = [line.split() for line in (ROOT / 'pictures' / 'pictures.txt').read_text().splitlines()
         if line and not line.startswith('#')]


def mechanism(type_, **parameters):
    return alone(type_, type_, **parameters)


def picture_of(*mechanisms, times=(0.0,), **kwargs):
    made = Picture(mechanisms, **kwargs)
    made.arrange(list(times))
    return made


def rendered(tmp_path, *args, config='jansen', ending='png'):
    out = tmp_path / f'out.{ending}'
    assert main([str(CONFIG / f'{config}.yaml'), '--out', str(out), *args]) == 0
    return out


def rows_of(file):
    with open(file, newline='') as lines:
        return [{name: float(value) for name, value in row.items()}
                for row in csv.DictReader(lines)]


@pytest.mark.nightly
@pytest.mark.parametrize('row', TABLE, ids=[Path(row[2]).name for row in TABLE])
def test_every_picture_of_the_table_is_drawn(row, tmp_path):
    scene_file, _, file, *options = row
    out = tmp_path / Path(file).name
    few = ['--frames', '3'] if out.suffix == '.gif' else []
    assert main([str(ROOT / scene_file), '--out', str(out), *options, *few]) == 0
    with Image.open(out) as image:
        assert getattr(image, 'n_frames', 1) == (3 if few else 1)


@pytest.mark.nightly
@pytest.mark.parametrize('ending, args', [
    ('png', []), ('svg', []), ('gif', ['--frames', '4', '--trace', 'fading'])])
def test_the_same_request_gives_the_same_bytes(tmp_path, ending, args):
    once = rendered(tmp_path, *args, config='all', ending=ending).read_bytes()
    assert rendered(tmp_path, *args, config='all', ending=ending).read_bytes() == once


@pytest.mark.skipif(not shutil.which('ffmpeg'), reason='ffmpeg is not installed')
def test_an_mp4_has_the_frames_asked_for_and_the_same_bytes_each_time(tmp_path):
    options = '--frames', '3', '--fps', '5', '--size', '320x240'
    once = rendered(tmp_path, *options, ending='mp4').read_bytes()
    file = rendered(tmp_path, *options, ending='mp4')
    assert file.read_bytes() == once and once[4:8] == b'ftyp'
    raw = subprocess.run(['ffmpeg', '-v', 'info', '-i', file, '-f', 'rawvideo', '-'],
                         capture_output=True, check=True)
    assert len(raw.stdout) == 3 * 320 * 240 * 3 // 2 and b'yuv420p' in raw.stderr
    assert re.search(rb'Duration: 00:00:00.60,.*\n.*h264.* 320x240.* 5 fps', raw.stderr)


@pytest.mark.parametrize('script, said', [
    ('', 'ffmpeg, which writes .mp4, is not installed: apt install ffmpeg, or choose .gif'),
    ('#!/bin/sh\necho no such codec >&2\nexit 1\n', 'ffmpeg failed: no such codec')])
def test_why_there_is_no_mp4_is_said(tmp_path, monkeypatch, capsys, script, said):
    ffmpeg = tmp_path / 'ffmpeg'
    ffmpeg.write_text(script)
    ffmpeg.chmod(0o755 if script else 0o644)
    monkeypatch.setenv('PATH', str(tmp_path), prepend=os.pathsep if script else None)
    assert main([str(CONFIG / 'jansen.yaml'), '--out', str(tmp_path / 'leg.mp4'), '--frames', '1',
                 '--size', '200x200', '--hide', 'axes,title']) == 1
    assert capsys.readouterr().err.splitlines()[-1] == f'render: {said}'
    assert [*tmp_path.iterdir()] == [ffmpeg]


def test_a_gif_has_the_frames_the_rate_the_loops_and_the_size_asked_for(tmp_path):
    file = rendered(tmp_path, '--frames', '7', '--fps', '30', '--loop', '3', '--size', '320x240',
                    '--hide', 'axes', ending='gif')
    with Image.open(file) as image:
        assert image.size == (320, 240) and image.n_frames == 7
        assert image.info['loop'] == 2  # repetitions after the first time
        milliseconds = 0
        for frame in range(image.n_frames):
            image.seek(frame)
            milliseconds += image.info['duration']
        assert milliseconds == 230  # 7/30 s in hundredths


def test_a_turn_is_drawn_in_the_time_it_takes(tmp_path):
    data = tmp_path / 'joints.csv'
    rendered(tmp_path, '--fps', '2', '--turns', '2', '--size', '99x99', '--hide', 'axes,title',
             '--data', str(data), ending='gif')
    times = [row['time'] for row in rows_of(data)]
    cranks = [row['jansen_crank'] for row in rows_of(data)]
    assert len(times) == round(2 * 2 * math.tau / 2.0)  # two turns at 2 rad/s, 2 frames a second
    assert times == pytest.approx(math.tau / len(times) * np.arange(len(times)))
    assert np.allclose(np.remainder(2.0 * np.array(times), math.tau), cranks, atol=1e-12)


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('type_', list(mechanisms.TYPES))
def test_both_directions_have_one_scale_and_nothing_is_cut_off(type_):
    one = mechanism(type_)
    picture = picture_of(one, size=(640, 400))
    axes = picture.figure.axes[0]
    (x0, y0), (x1, y1) = axes.transData.transform([(0.0, 0.0), (1.0, 1.0)])
    assert x1 - x0 == pytest.approx(y1 - y0, rel=1e-9)
    places = Cycle(one).course.reshape(-1, 2)
    pixels = axes.transData.transform(places[np.isfinite(places).all(axis=1)])
    box = axes.get_window_extent()
    assert np.all(pixels > (box.x0 + 15, box.y0 + 15))
    assert np.all(pixels < (box.x1 - 15, box.y1 - 15))


@pytest.mark.nightly
@pytest.mark.parametrize('args', [[], ['--show', 'dimensions'], ['--size', '600x460']])
@pytest.mark.parametrize('config', ['all', 'slotted_lever', 'peaucellier', 'jansen'])
def test_nothing_reaches_over_the_edge_of_a_picture(tmp_path, config, args):
    with Image.open(rendered(tmp_path, *args, config=config)) as image:
        pixels = np.array(image.convert('RGB'))
    edges = [pixels[:2], pixels[-2:], pixels[:, :2], pixels[:, -2:]]
    assert all((edge == 255).all() for edge in edges)


def test_a_gif_keeps_the_colours_that_colour_blind_people_tell_apart(tmp_path):
    file = rendered(tmp_path, '--frames', '2', '--size', '400x400', ending='gif')
    with Image.open(file) as image:
        assert image.info['loop'] == 0  # without an end
        counts = image.convert('RGB').getcolors(1 << 16)
    # Paper and grid are what there is most of; a colour is that of the picture, to a hundredth.
    assert max(counts)[1] == (255, 255, 255)
    seen = np.array([colour for _, colour in counts])
    for colour in (palette.BAR, palette.DRIVEN, palette.LOCUS, palette.GREY, palette.GRID):
        apart = abs(seen - 255.0 * np.array(to_rgb(colour))).max(axis=1)
        assert apart.min() < 3.0, colour


def test_the_pairs_of_a_walker_pale_from_the_first_to_the_last(tmp_path):
    made = picture_of(mechanism('jansen', leg_pairs=3))
    legs = next(layer for layer in made.panels[0].moving if isinstance(layer, layers.Legs))
    brightness = {leg: np.mean(artists['bars'].get_colors()[0][:3]) for leg, artists in legs.legs}
    assert brightness[0] == brightness[1] < brightness[2] == brightness[3] < brightness[4]
    # The two plates of a leg are filled.
    assert [len(artists['plates'].get_paths()) for _, artists in legs.legs] == 6 * [2]


def test_a_crank_on_a_moving_link_draws_no_circle():
    made = picture_of(mechanism('custom', joints=CASSIE), trace='none')
    circle, = (line.get_xydata() @ (1, 1j) for line in made.figure.axes[0].lines
               if line.get_linestyle() == '--')
    assert np.abs(circle) == pytest.approx(0.4, abs=1e-12)


def segments_of(picture):
    trace = next(layer for layer in picture.panels[0].moving if isinstance(layer, layers.Trace))
    return [np.asarray(path.vertices) for path in trace.lines.get_paths()]


def test_a_growing_trace_is_what_the_tracer_went_through_until_now():
    drop = mechanism('water_drop')
    picture = picture_of(drop, trace='growing')
    for turns in (0.1, 0.55, 1.0, 1.7):
        picture.show(turns)
        curve, = segments_of(picture)
        angles = np.linspace(0.0, math.tau * min(turns, 1.0), 500)
        way = drop.linkage.solve(angles, ('P',))['P']
        apart = np.hypot(*np.moveaxis(way[:, None] - curve, -1, 0))
        assert apart.min(axis=1).max() < 0.05 and apart.min(axis=0).max() < 0.1
        assert np.allclose(curve[-1], way[-1], atol=1e-12)


def test_a_fading_trace_ends_at_the_tracer_and_begins_where_it_was_three_tenths_of_a_turn_ago():
    drop = mechanism('water_drop')
    picture = picture_of(drop, trace='fading')
    for turns in (0.0, 0.1, 0.80125, 1.3):
        picture.show(turns)
        pieces = segments_of(picture)
        first, last = drop.linkage.solve(math.tau * np.array([turns - 0.3, turns]), ('P',))['P']
        assert np.allclose(pieces[-1][-1], last, atol=1e-12)
        assert math.dist(pieces[0][0], first) < 0.04 and len(pieces) == 216
        colours = picture.panels[0].moving[0].lines.get_colors()
        assert colours[[0, -1], :3] == pytest.approx(np.array([[1.0] * 3, to_rgb(palette.LOCUS)]))


def test_a_foot_stands_on_the_lowest_part_of_its_curve():
    leg = mechanism('jansen')
    curve = Cycle(leg).locus(leg)
    standing = layers.standing(curve)
    low, high = curve[:, 1].min(), curve[:, 1].max()
    standing = standing[np.isfinite(standing).all(axis=1)]
    assert standing[:, 1].min() == low
    assert standing[:, 1].max() - low < 0.1 * (high - low)
    assert np.ptp(standing[:, 0]) > 0.7 * np.ptp(curve[:, 0])


def test_a_scribble_is_not_drawn():
    five_bar = mechanism('five_bar', crank2__speed=math.pi)
    assert not len(Cycle(five_bar).locus(five_bar)) and picture_of(five_bar, trace='stance')


def test_a_curve_ends_where_a_motion_leaves_the_reach():
    five_bar = mechanism('five_bar', crank2__speed=2.0)
    curve = Cycle(five_bar).locus(five_bar)
    assert 0 < np.isnan(curve).sum() < curve.size
    assert layers.straight(curve) is None and picture_of(five_bar, trace='stance')
    assert np.nanmin(layers.standing(curve)[:, 1]) == np.nanmin(curve[:, 1])
    # A line is one at any scale.
    assert picture_of(mechanism('peaucellier', scale=1e27))


def test_any_motion_is_drawn_in_place_of_the_solved_one():
    leg, motion = mechanism('jansen'), Cycle(mechanism('jansen', dimensions__m=14.0))
    picture = picture_of(leg, motions=[motion])
    picture.show(0.3)
    values = picture.panels[0].values()[1:]
    assert values == motion.pose(0.3).places.ravel().tolist()
    assert values != Cycle(leg).pose(0.3).places.ravel().tolist()


def test_a_line_is_drawn_where_the_curve_is_one():
    curves = {t: Cycle(mechanism(t)).locus(mechanism(t)) for t in (
        'peaucellier', 'slider_crank', 'whitworth', 'jansen', 'hoeken', 'watt', 'pantograph')}
    straight = [t for t, curve in curves.items() if layers.straight(curve) is not None]
    assert straight == ['peaucellier', 'slider_crank', 'whitworth']


def texts_of(picture):
    return re.split('\u2007*  |\n', picture.panels[0].moving[-1].text.get_text().rstrip('\u2007'))


def test_the_angle_is_printed_and_that_of_a_slotted_lever_with_its_ratio():
    picture = picture_of(mechanism('water_drop'))
    picture.show(0.125)
    assert texts_of(picture) == ['θ = 45.0°']
    picture = picture_of(mechanism('slotted_lever'))
    picture.show(50.0 / 360.0)
    lever = math.degrees(lever_of(math.radians(50.0)))
    assert texts_of(picture)[:3] == ['θ = 50.0°', f'φ = {lever:.1f}°', f'φ/θ = {lever / 50:.3f}']
    picture.show(310.0 / 360.0)
    assert texts_of(picture)[:2] == ['θ = −50.0°', f'φ = −{lever:.1f}°']
    picture.show(0.0)
    assert texts_of(picture)[1:] == ['φ = 0.0°', 'φ/θ = –', f'dφ/dθ = {80 / 230:.3f}']


def test_a_part_is_seen_unless_it_is_hidden():
    bar = mechanism('four_bar')
    cycle = Cycle(bar)
    whole, *without = (Picture([bar], (160, 160), parts=frozenset(PARTS) - {part}, motions=[
        cycle]).at(0.0) for part in (None, *PARTS))
    assert len(without) == 8 and all((one != whole).any() for one in without)


@pytest.mark.parametrize('given, angle', [
    ('crank.speed: -3.0', 2.0 - 4.0 * math.tau), ('crank.sweep: [-0.5, 1.0]', 0.99 + math.tau)])
def test_the_crank_is_where_it_was_asked_to_be(tmp_path, given, angle):
    file, data = tmp_path / 'bar.yaml', tmp_path / 'a.csv'
    file.write_text('/**: {ros__parameters: {mechanisms: [bar, lever], bar.type: four_bar, '
                    f'lever.type: slotted_lever, bar.{given}}}}}')
    assert main([str(file), '--out', str(tmp_path / 'a.svg'), '--angle',
                 str(math.degrees(angle)), '--data', str(data), '--hide', 'axes,labels']) == 0
    row, = rows_of(data)
    assert math.remainder(row['bar_crank'] - angle, math.tau) == pytest.approx(0.0, abs=1e-12)
    assert row['time'] == row['lever_crank'] == 0.0


def test_mechanisms_side_by_side_have_one_time():
    mechanisms = [mechanism('four_bar', crank__speed=2.0),
                  mechanism('slider_crank', crank__speed=-3.0),
                  mechanism('water_drop', crank__sweep=[-0.5, 1.0])]
    picture = Picture(mechanisms, (600, 400))
    assert [one.get_subplotspec().get_geometry() for one in picture.figure.axes] == [
        (2, 2, k, k) for k in range(3)]
    assert picture.seconds(0.4) == pytest.approx(0.4 * math.pi)
    # Beside one that stands still, the others do.
    still = Picture([mechanism('four_bar', crank__speed=0.0), mechanisms[1]])
    still.show(0.25)
    assert still.seconds(0.25) == still.panels[1].values()[0] == 0.0
    picture.show(0.4)
    first, second, third = picture.panels
    assert first.values()[0] == pytest.approx(0.8 * math.pi)
    assert second.values()[0] == pytest.approx(-1.2 * math.pi % math.tau)
    seconds, speed = 0.4 * math.pi, third.mechanism.first.speed
    place = (0.5 + seconds * speed) % 3.0
    assert third.values()[0] == pytest.approx(-0.5 + min(place, 3.0 - place))
    for panel, one in zip(picture.panels, mechanisms):
        names = [f'{joint}_{axis}' for joint in one.points for axis in 'xy']
        assert panel.moving[-1].text.get_fontsize() == 11.5
        assert panel.columns() == [f'{one.name}_{name}' for name in ('crank', *names)]
        solved = one.linkage.solve(panel.values()[0])
        assert panel.values()[1:] == pytest.approx(
            [value for joint in one.points for value in solved[joint]])


def test_options_have_these_defaults_and_limits(tmp_path):
    from linkage_ros.render.cli import parsed
    given = {'scene': 'a', 'data': None, 'mechanism': [], 'trace': 'whole', 'show': frozenset(),
             'hide': frozenset(), 'size': (720, 720), 'angle': None, 'turns': None, 'fps': None,
             'frames': None, 'loop': None, 'colours': None}
    still, moving = tmp_path / 'a.SVG', tmp_path / 'a.gif'
    assert vars(parsed(['a', '--out', str(still)])) == {**given, 'out': still, 'moving': False}
    args = ['--turns', '1000', '--fps', '50', '--frames', '10000', '--loop', '65536', '--colours',
            '2', '--size', '64x8192', '--mechanism', 'b', 'c', '--show', 'floor', '--hide',
            'axes,title', '--data', str(still)]
    assert vars(parsed(['a', '--out', str(moving), *args])) == {
        **given, 'out': moving, 'moving': True, 'turns': 1000.0, 'fps': 50.0, 'frames': 10000,
        'loop': 65536, 'colours': 2, 'size': (64, 8192), 'mechanism': ['b', 'c'],
        'show': {'floor'}, 'hide': {'axes', 'title'}, 'data': still}
    for text in ('60', '+60', '60deg', 'pi/3', '2*30'):
        assert parsed(['a', '--out', str(still), '--angle', text]).angle == pytest.approx(60.0)
    # As 0.1.0 has it.
    assert parsed(['a', '--out', str(still), '--mechanisms', 'b,c']).mechanism == ['b', 'c']


def test_the_help_has_examples_that_can_be_run(capsys):
    with pytest.raises(SystemExit):
        main(['--help'])
    examples = re.findall(r'^  render (config/.*)', capsys.readouterr().out, re.M)
    assert len(examples) == 4 and all(parsed(example.split()) for example in examples)


def shapes_of(file):
    """Return what an SVG draws: fill or stroke, width [pixels], and places [points], in order."""
    for part in ElementTree.parse(file).getroot().iter():
        style = dict(pair.split(': ') for pair in (part.get('style') or '').split('; ') if pair)
        tag = part.tag.rpartition('}')[2]
        if tag == 'use':
            yield style['fill'], 0.0, [[float(part.get('x')), float(part.get('y'))]]
        elif tag == 'path' and 'stroke-width' in style and style.get('fill') == 'none':
            numbers = re.findall(r'-?[0-9.]+', part.get('d'))
            yield style['stroke'], float(style['stroke-width']), np.reshape(
                np.array(numbers, float), (-1, 2))


@pytest.mark.parametrize('size, unit', [('1080x1100', 1.5), ('1700x1500', 2.0), ('320x200', 0.4)])
def test_an_svg_has_every_part_in_its_order_where_it_was_solved(tmp_path, size, unit):
    file, data = rendered(
        tmp_path, '--angle', '50', '--hide', 'axes,labels,title', '--size', size, '--data',
        str(tmp_path / 'a.csv'), config='slotted_lever', ending='svg'), tmp_path / 'a.csv'
    (row,) = rows_of(data)
    o, q = 0.0, -0.3j
    a = 0.16 * np.exp(1j * (math.radians(50.0) + 0.5 * math.pi))
    tip = q + 0.54 * (a - q) / abs(a - q)
    assert row.pop('time') == 0.0
    assert row.pop('slotted_lever_crank') == pytest.approx(math.radians(50.0), rel=1e-15)
    assert row == pytest.approx({
        f'slotted_lever_{name}_{axis}': value for name, place in (
            ('O', o), ('Q', q), ('A', a), ('L', tip)) for axis, value in (
                ('x', place.real), ('y', place.imag))}, abs=1e-15)
    drawn = [(colour, width, np.array(places) @ (1.0, -1j)) for colour, width, places in
             shapes_of(file)]
    # Pivots are drawn first, in the order of the joints: they tell the scale.
    first, second = (places[0] for colour, _, places in drawn if colour == palette.EARTH)
    places_of = [(o + (places - first) * (q - o) / (second - first)) for *_, places in drawn]
    colours = [colour for colour, *_ in drawn]
    assert colours == [
        palette.GREY, palette.LOCUS, palette.EARTH, palette.EARTH, palette.BAR, palette.DARK,
        '#ffffff', palette.DRIVEN, palette.DARK, palette.TRACK, *['#ffffff'] * 4, palette.LOCUS]
    assert [width for _, width, _ in drawn] == pytest.approx([unit * width for width in (
        1.6, 3.0, 0.0, 0.0, 5.5, 17.0, 13.5, 5.5, 12.5, 9.0, *[0.0] * 5)])
    circle, trace, *_, bar, rim, slot, crank, edge, block = places_of[:10]
    assert np.abs(circle) == pytest.approx(0.16, abs=1e-6)
    assert np.ptp(np.angle(circle)) > 6.0
    assert np.abs(trace - q) == pytest.approx(0.54, abs=1e-6)
    assert bar == pytest.approx(np.array([q, tip]), abs=1e-6)
    assert crank == pytest.approx(np.array([o, a]), abs=1e-6)
    assert slot == pytest.approx(rim) and block == pytest.approx(edge)
    assert block.mean() == pytest.approx(a, abs=1e-6)
    along = (tip - q) / abs(tip - q)
    for piece in (block, slot):
        assert ((piece - q) / along).imag == pytest.approx(0.0, abs=1e-6)
    # As far as the block moves on the lever: from where the crank points down to where up.
    reach = ((slot - q) / along).real
    assert min(reach) < 0.14 < 0.46 < max(reach) < 0.54
    assert np.array(places_of[10:]).ravel() == pytest.approx(np.array([o, q, a, tip, tip]),
                                                             abs=1e-6)


@pytest.mark.parametrize('args, said', [
    (['nowhere.yaml', '--out', 'a.png'], 'nowhere.yaml: No such file'),
    (['stil.yaml', '--out', 'a.png'], 'No such file or directory; did you mean still.yaml?'),
    (['jansen.yaml', '--out', 'a.png', '--trce', 'none'], '--trce none; did you mean --trace?'),
    (['.', '--out', 'a.png'], '.: Is a directory'),
    (['jansen.yaml', '--out', 'a.bmp'], '--out must end in .png, .svg, .gif, .mp4, not a.bmp'),
    (['jansen.yaml'], '--out'),
    (['jansen.yaml', '--out', 'no/a.png'], 'there is no folder no'),
    (['jansen.yaml', '--out', 'a.png', '--data', 'no/a.csv'], 'there is no folder no'),
    (['jansen.yaml', '--out', 'a.png', '--fps', '30'], '--fps is for .gif and .mp4 only'),
    (['jansen.yaml', '--out', 'a.gif', '--fps', '60'], '--fps must be at most 50'),
    # For longer than a GIF can show a picture.
    (['jansen.yaml', '--out', 'a.png', '--data', 'a.png'], '--data must be another file than'),
    (['still.yaml', '--out', 'a.png', '--data', './still.yaml'], '--data must be another file'),
    (['link.yaml', '--out', 'a.png', '--data', 'still.yaml'], '--data must be another file'),
    (['jansen.yaml', '--out', 'a.gif', '--frames', '1', '--fps', '0.001'], 'lasts 655 s at most'),
    (['jansen.yaml', '--out', 'a.png', '--angle', '-pi/6'], 'an = if it begins with a minus'),
    (['jansen.yaml', '--out', 'a.gif', '--fps', 'x'], "--fps: invalid number value: 'x'"),
    (['jansen.yaml', '--out', 'a.gif', '--fps', '241'], 'must be from 0.001 to 240, not 241'),
    (['jansen.yaml', '--out', 'a.gif', '--turns', '1001'], 'must be from 0.001 to 1000, not 1001'),
    (['jansen.yaml', '--out', 'a.gif', '--frames', '0'], 'must be from 1 to 10000, not 0'),
    (['jansen.yaml', '--out', 'a.gif', '--frames', '1.5'], "invalid whole number value: '1.5'"),
    (['jansen.yaml', '--out', 'a.gif', '--colours', '256'], 'must be from 2 to 255, not 256'),
    (['jansen.yaml', '--out', 'a.mp4', '--colours', '9'], '--colours is for .gif only, not for'),
    (['jansen.yaml', '--out', 'a.mp4', '--size', '99x98'], '--size must be two even numbers'),
    (['jansen.yaml', '--out', 'a.svg', '--size', '64x8193'], 'must be from 64 to 8192, not 8193'),
    (['jansen.yaml', '--out', 'a.svg', '--size', '720'], "--size: invalid WxH value: '720'"),
    (['excavator.yaml', '--out', 'a.svg', '--angle', '1'], '--angle is for a crank: excavator is'),
    (['jansen.yaml', '--out', 'a.gif', '--turns', 'nan'], 'from 0.001'),
    (['jansen.yaml', '--out', 'a.gif', '--turns', '999'], 'frames, more than'),
    (['all.yaml', '--out', 'a.png', '--size', '99x99'], 'size is too small'),
    (['jansen.yaml', '--out', 'a.png', '--trace', 'x'], 'growing'),
    (['jansen.yaml', '--out', 'a.png', '--mechanism', 'x'], 'allowed: jansen'),
    (['peaucellier.yaml', '--out', 'a.png', '--angle', '180'], 'stays inside'),
    (['jansen.yaml', '--out', 'a.png', '--angle', 'r/2'], 'such as 30, pi/6 or 30deg, not r/2'),
    (['jansen.yaml', '--out', 'a.png', '--angle', 'inf'], 'such as 30, pi/6 or 30deg, not inf'),
    (['jansen.yaml', '--out', 'a.png', '--show', 'lables'], 'did you mean labels?'),
    (['picture.png', '--out', 'a.png'], 'picture.png'),
    (['--mechanism', 'jansen', 'all.yaml', '--out', 'a.png'], ': SCENE, before any --mechanism'),
    (['still.yaml', '--out', 'a.gif'], 'speed is 0, and its turns are what an animation shows')])
def test_what_cannot_be_is_said_in_one_line_and_no_file_is_left(
        args, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    scene_file = CONFIG / args[0]
    (tmp_path / 'still.yaml').write_text(
        '/**: {ros__parameters: {mechanisms: [leg], leg.type: jansen, leg.crank.speed: 0.0}}')
    (tmp_path / 'link.yaml').symlink_to('still.yaml')
    (tmp_path / 'picture.png').write_bytes(b'\x89PNG\r\n\xff')
    before = set(tmp_path.iterdir())
    assert main([str(scene_file) if scene_file.is_file() else args[0], *args[1:]]) == 1
    error = capsys.readouterr().err
    assert error.startswith('render: ') and error.count('\n') == 1 and said in error
    assert set(tmp_path.iterdir()) == before


@pytest.mark.nightly
def test_what_a_link_leads_to_is_replaced_and_a_device_is_written(tmp_path):
    link, fifo = tmp_path / 'link.png', tmp_path / 'data.csv'
    link.symlink_to('leg.png')
    os.mkfifo(fifo)
    reader = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
    assert main([str(CONFIG / 'jansen.yaml'), '--out', str(link), '--data', str(fifo)]) == 0
    assert os.read(reader, 4) == b'time' and fifo.is_fifo()
    os.close(reader)
    assert link.is_symlink() and (tmp_path / 'leg.png').is_file()


def test_the_readings_of_one_picture_are_not_written_over_those_of_another():
    mechanisms = [*scene.load(str(CONFIG / 'excavator.yaml')).mechanisms.values(),
                  *scene.load(str(CONFIG / 'scissor_lift.yaml')).mechanisms.values(),
                  mechanism('five_bar')]
    picture = picture_of(*mechanisms, size=(900, 400))
    picture.at(0.0)
    boxes = [panel.moving[-1].text.get_window_extent() for panel in picture.panels]
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


@pytest.mark.nightly(all_but=4)
@pytest.mark.parametrize('name', scene.load(str(ROOT / 'pictures' / 'words.yaml')).mechanisms)
def test_no_name_is_on_a_joint_or_on_another(name):
    shown = scene.load(str(ROOT / 'pictures' / 'words.yaml')).mechanisms[name]
    picture = picture_of(shown, size=(360, 270), trace='none', parts=DEFAULT - {'axes', 'title'})
    picture.show(0.0)
    names = picture.panels[0].moving[-1].artists
    boxes = [text.get_window_extent(picture.figure.canvas.get_renderer()) for text in names]
    joints = [text.axes.transData.transform(text.xy) for text in names]
    assert not any(box.contains(*joint) for box in boxes for joint in joints)
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))
