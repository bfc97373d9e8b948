# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The page in a real browser: what is drawn, dragged, tuned, plotted, saved, and laid out."""

import json
import math
from pathlib import Path
import re
import time

from browser import until
from linkage_ros import mechanisms, scene
from linkage_ros.nodes.crank_driver import CrankDriver
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.web.viewer import Viewer
import numpy as np
from PIL import Image
import pytest
from scenes import example, ROOT
from sensor_msgs.msg import JointState
from truth.working_modes import lever_of
from viewer_harness import coloured, LEG, LEVER, needs_browser, RATE, Seen, spoilt, walker
from visualization_msgs.msg import MarkerArray

pytestmark = needs_browser
STILL_LEVER = {**LEVER, 'lever.crank.speed': 0.0}


@pytest.fixture(scope='module')
def seen(tmp_path_factory):
    """Return a browser."""
    with Seen(tmp_path_factory.mktemp('profile')) as page:
        yield page


@pytest.fixture
def start(show, seen):
    """Return a function that starts a scene, which the browser sees, perhaps one mechanism."""
    def started(parameters, view='', **kwargs):
        running = show(parameters, **kwargs)
        seen.visit(running.url)
        if view:
            seen.view(view)
            seen.output(view, {'lever': 'lever', 'drop': 'P.y'}[view])
        return running, seen

    yield started
    seen.leave()


# --- the picture and the view ---

@pytest.mark.nightly
def test_a_picture_of_what_is_far_off_is_drawn_and_left(start):
    # Its locus is as large as these markers.
    running, seen = start({**LEG, 'leg.scale': 0.01}, kinds=(Kinematics,))
    markers = running.graph.node.create_publisher(MarkerArray, 'leg/markers', 1)

    def is_drawn():
        markers.publish(walker(1))
        return len(coloured(seen.canvas(), 'bars')) > 100

    until(is_drawn)
    for far in (1e9, 1e17, 1e30, 3e38):
        for part in range(4):
            for _ in range(3):
                markers.publish(spoilt(part, far))
                time.sleep(0.02)
            until(is_drawn)


@pytest.mark.nightly
def test_the_picture_is_zoomed_shifted_and_turned_by_keys_and_mouse(start):
    _, seen = start({**STILL_LEVER, 'lever.crank.start': 1.0}, 'lever')

    def locus(middle=None, size=None):
        """Return the middle and the size of the locus, at rest and as it is wanted."""
        first, second = [coloured(seen.canvas(), 'locus') for _ in range(2)]
        if len(first) < 100 or not np.array_equal(first, second):
            return None
        place = first.mean(axis=0), np.ptp(first, axis=0)
        far = [abs(value - expected).max() for value, expected in zip(place, (middle, size))
               if expected is not None]
        return place if max(far, default=0.0) < 6.0 else None

    middle, size = until(locus)
    seen.value('picture.focus()')
    seen.press('-')
    until(lambda: locus(size=size / 1.2), 'zoomed')
    seen.press('0')
    until(lambda: locus(middle, size), 'whole')
    seen.drag((100.0, seen.top + 100.0), (160.0, seen.top + 70.0))
    until(lambda: locus(middle + (-30.0, 60.0), size), 'shifted')
    # Seen nearly from its edge, the plane is narrow and as high as before.
    seen.press('0')
    for _ in range(7):
        seen.press('ArrowRight', shift=True)
    until(lambda: locus(size=size * (1.0, math.cos(1.4))), 'turned')
    seen.click('document.getElementById("whole")')
    until(lambda: locus(middle, size), 'whole again')
    assert seen.value('document.getElementById("whole").hidden')


@pytest.mark.nightly
def test_a_linkage_in_space_is_drawn_whole_and_says_what_the_page_does_not(start):
    _, seen = start({**example('ankle'), 'rate': 20.0})

    def is_whole():
        picture = seen.canvas()
        places, size = coloured(picture, 'bars'), np.array(picture.shape[:2])
        low, high = places.min(axis=0, initial=size[0]), places.max(axis=0, initial=0)
        return (low > 20).all() and (high < size - 20).all() and high[0] - low[0] > 0.5 * size[0]

    until(is_whole)
    text = seen.value(f'{seen.section("ankle")}.innerText')
    assert 'ankle is a linkage in space' in text
    assert '+1' in text and '\N{MINUS SIGN}1' in text and 'Plot' not in text
    assert seen.value(f'!!{seen.button("C")}')


# --- tuning ---

@pytest.mark.nightly
def test_a_slider_sets_the_nodes_and_a_refusal_springs_back_and_is_forgotten(start):
    running, seen = start(LEVER, 'lever')

    def value(name):
        return running.value(f'lever.dimensions.{name}')

    seen.slide('lever', 'b', 0.7)
    until(lambda: value('b') > 200.0)
    until(lambda: value('b') == seen.number('lever', 'b'))
    assert seen.reason('lever', 'b') == ''
    seen.type('lever', 'e', '7000')
    until(lambda: seen.reason('lever', 'e'))
    until(lambda: abs(seen.number('lever', 'e') - value('e')) < 1e-5 * abs(value('e')) + 1e-9)
    # The number as it was typed, in its unit, and the range.
    assert re.match(r'Refused: 7000 m; the slider goes from \S+ to \S+ m\. lever.dimensions',
                    seen.reason('lever', 'e'))
    assert abs(value('e')) < 1500.0
    seen.value('workshop.click()')
    seen.type('lever', 'e', '7000000')
    until(lambda: re.match(r'Refused: 7000000 mm; the slider goes from -\S+ to \S+ mm\.',
                           seen.reason('lever', 'e')))
    seen.type('lever', 'speed', '7200')
    until(lambda: re.match(r'Refused: 7200 °/s; the slider goes from -5729.58 to 5729.58 °/s\. '
                           r'\S+ must be .* from -100 to 100 \[rad/s\], not 125\.6637',
                           seen.reason('lever', 'speed')))
    seen.value('workshop.click()')
    for good in ('150', '151', ''):
        seen.type('lever', 'b', '-150')
        until(lambda: seen.reason('lever', 'b'))
        assert seen.number('lever', 'b') == value('b')
        assert not seen.value(f'{seen.row("lever", "b")}.classList.contains("refused")')
        if good:
            seen.type('lever', 'b', good)
        else:
            # By somebody who comes later.
            running.set('lever.dimensions.b', value('b') + 1.0)
        until(lambda: seen.reason('lever', 'b') == '')


@pytest.mark.nightly
def test_numbers_are_arithmetic_in_the_unit_that_is_shown_and_branches_are_buttons(start):
    running, seen = start(LEVER, 'lever')
    for text, value in (('80,5', 80.5), ('2*(40+5)', 90.0)):
        seen.type('lever', 'a', text)
        until(lambda expected=value: running.value('lever.dimensions.a') == expected)
        assert seen.reason('lever', 'a') == ''
    for text, start in (('1,234.5', '1.234.5'), ('b/2', 'b/2'), ('1e400', '1e400')):
        seen.type('lever', 'a', text)
        assert until(lambda: seen.reason('lever', 'a')).startswith(f"Refused: '{start}")
        assert seen.number('lever', 'a') == 90.0
    seen.type('lever', 'a', '')
    assert seen.number('lever', 'a') == 90.0
    seen.value('workshop.click()')
    for text, angle in (('90deg', 0.5 * math.pi), ('pi/3', math.pi / 3.0), ('2*15', math.pi / 6)):
        seen.type('lever', 'crank', text)
        until(lambda expected=angle: running.value('lever.crank.start')
              == pytest.approx(expected, abs=1e-12))
    inward = seen.button('in')
    seen.value(f'{inward}.scrollIntoView()')
    seen.click(inward)
    until(lambda: running.value('lever.branches.L') == -1)
    seen.becomes(f'{inward}.ariaPressed === "true"')


@pytest.mark.nightly
def test_a_bar_and_its_slider_light_up(start):
    _, seen = start(LEG)

    def lit(label):
        return seen.value(f'{seen.row("leg", label)}.classList.contains("lit")')

    def where_lit():
        """Point at the slider of h until its bar is lit; return the middle of that."""
        seen.hover(f'{seen.row("leg", "h")}.querySelector("label")')
        places = coloured(seen.canvas(), 'lit bars')
        return tuple(places.mean(axis=0)) if len(places) > 300 else None

    seen.output('leg', 'BC')
    row, column = until(where_lit)
    assert lit('h') and not lit('g')
    seen.move(5.0, seen.top + 5.0)
    seen.becomes('!document.querySelector(".lit")')
    seen.move(column, seen.top + row)
    until(lambda: lit('h'))


@pytest.mark.nightly
def test_changes_are_saved_undone_and_reset(start, tmp_path):
    running, seen = start(LEG)

    def becomes(**expected):
        until(lambda: expected == {
            name: running.value(f'leg.dimensions.{name}') for name in expected})

    seen.output('leg', 'BC')
    seen.type('leg', 'h', '60.5')
    becomes(h=60.5)
    seen.type('leg', 'g', '37.25')
    becomes(g=37.25)
    # The viewer is told of what was set a moment later.
    running.page().setting('/leg', 'dimensions.g', 37.25)
    seen.downloads(tmp_path)
    seen.click(seen.button('scene file'))
    saved = tmp_path / 'leg.yaml'
    until(saved.exists)
    dimensions = scene.load(str(saved)).mechanisms['leg'].linkage.dimensions
    assert (dimensions['g'], dimensions['h'], dimensions['i']) == (37.25, 60.5, 49.0)
    seen.click(seen.button('Undo'))
    becomes(g=36.7, h=60.5)
    seen.click(seen.button('Reset'))
    becomes(g=36.7, h=65.7)
    seen.becomes(f'{seen.button("Reset")}.disabled')
    # The keys of "Undo" repeat.
    seen.value(f'for (let i = 0; i < 9; i++) {seen.button("Undo")}.click()')
    seen.becomes(f'{seen.button("Undo")}.disabled')


@pytest.mark.nightly
def test_of_another_linkage_with_the_same_name_nothing_is_undone(start):
    running, seen = start(LEG)
    seen.output('leg', 'BC')
    seen.type('leg', 'h', '60.5')
    seen.becomes(f'!{seen.button("Undo")}.disabled && !{seen.button("Reset")}.disabled')
    for node in (running.viewer, *running.nodes):
        running.graph.end(node)
    seen.becomes('/^Connection lost/.test(notice.textContent)')
    running.nodes = [running.graph.start(kind, {**LEG, 'leg.type': 'klann'})
                     for kind in (CrankDriver, Kinematics)]
    running.viewer = running.graph.start(
        Viewer, {'port': int(re.search(r'(\d+)/$', running.url)[1])})
    seen.becomes(f'{seen.section("leg")}?.querySelector(".about").textContent === "klann"')
    seen.becomes(f'{seen.button("Undo")}.disabled && {seen.button("Reset")}.disabled')
    seen.complaints.clear()


# --- dragging ---

@pytest.mark.nightly
def test_a_second_finger_neither_moves_the_joint_of_the_first_nor_takes_one(start):
    running, seen = start(STILL_LEVER, 'lever')

    def crank():
        return running.value('lever.crank.start')

    x, y = seen.upright_lever()[0]
    aside = x - 200.0, y + 100.0
    seen.touch((x, y))
    seen.touch((x - 30.0, y))
    until(lambda: crank() > 0.1)
    seen.touch((x - 30.0, y), aside)
    before = crank()
    for step in (20.0, 40.0, 60.0):
        seen.touch((x - 30.0, y), (aside[0] - step, aside[1] + step))
    # It follows the first finger still, from where it was.
    seen.touch((x - 31.0, y), (aside[0] - 60.0, aside[1] + 60.0))
    until(lambda: crank() != before)
    assert crank() == pytest.approx(before, abs=0.05)
    seen.touch((x - 31.0, y))
    seen.touch()
    before = crank()
    # Two fingers zoom, though the second is put on a joint.
    seen.touch(aside)
    seen.touch(aside, (x - 31.0, y))
    seen.touch(aside, (x + 60.0, y - 30.0))
    seen.touch()
    seen.becomes('!document.getElementById("whole").hidden')
    assert crank() == before


@pytest.mark.nightly
def test_what_is_refused_is_said_where_one_looks_and_leaves_the_picture_free(start):
    running, seen = start(
        {'mechanisms': ['lever'], 'lever.type': 'slotted_lever'}, kinds=(Kinematics,))
    crank_states = running.graph.node.create_publisher(JointState, 'crank_states', 10)

    def has_moved():
        crank_states.publish(JointState(name=['lever_crank'], position=[0.0]))
        return seen.value(f'!!{seen.section("lever")}.querySelector("tbody tr")')

    def reason():
        return seen.value(f'[...{seen.section("lever")}.querySelectorAll(".reason")].filter('
                          'line => !line.hidden).map(line => line.textContent).join()')

    until(has_moved)
    (x, y), _ = seen.upright_lever()
    seen.drag((x, y), (x + 30.0, y))
    why = 'the crank cannot be moved: no crank_driver is running'
    seen.becomes(f'notice.textContent === "{why}"')
    assert reason() == why
    seen.becomes('notice.hidden')
    assert reason() == why
    seen.write(f'{seen.section("lever")}.querySelector("td input")', 'foo')
    until(lambda: reason() == "Refused: 'foo' is not a number: foo is unknown")


@pytest.mark.nightly
def test_a_click_on_a_bar_goes_to_its_slider_and_a_drag_from_it_does_not(start):
    _, seen = start(STILL_LEVER, 'lever')
    tip, pivot = seen.upright_lever()
    bar = tip[0], 0.8 * pivot[1] + 0.2 * tip[1]
    seen.drag(bar, (bar[0] + 80.0, bar[1]))
    seen.becomes('!document.getElementById("whole").hidden')
    assert seen.value('document.activeElement.type') != 'range'
    seen.click('document.getElementById("whole")')

    def is_there():
        seen.drag(bar, bar)
        return seen.value('document.activeElement.type') == 'range'

    until(is_there)


def test_a_joint_follows_the_mouse_and_stops_at_its_reach(start):
    running, seen = start(STILL_LEVER, 'lever')
    tip, pivot = seen.upright_lever()
    length = pivot[1] - tip[1]

    def at(phi):
        return pivot[0] - length * math.sin(phi), pivot[1] - length * math.cos(phi)

    def lever():
        return lever_of(running.value('lever.crank.start'))

    end = math.asin(80.0 / 150.0)
    for places, angle, close in (((tip, at(0.2), at(0.4)), 0.4, 0.02),
                                 ((at(0.4), at(0.5), at(1.2)), end, 1e-4)):
        until(seen.is_still)
        seen.drag(*places)
        until(lambda angle=angle, close=close: abs(lever() - angle) < close, f'at {angle}')
        until(lambda: abs(seen.output('lever', 'lever') - lever()) < 0.001)
    assert running.value('lever.crank.speed') == 0.0


@pytest.mark.nightly
def test_an_input_is_moved_with_the_keys_by_steps_and_in_degrees(start):
    running, seen = start({**LEVER, 'lever.crank.speed': 1.5}, 'lever')

    def servo():
        return running.value('lever.crank.start')

    def follows():
        return abs(seen.number('lever', 'crank') - math.degrees(servo())) < 0.001

    seen.click('document.getElementById("workshop")')
    seen.type('lever', 'crank', '30')
    until(lambda: servo() == pytest.approx(math.radians(30.0), abs=1e-12))
    assert running.value('lever.crank.speed') == 0.0
    until(follows)
    seen.click(f'{seen.row("lever", "crank")}.querySelectorAll("button")[1]')
    until(lambda: servo() == pytest.approx(math.radians(31.0), abs=1e-4))
    until(follows)
    seen.value(f'{seen.row("lever", "crank")}.querySelector("input").focus()')
    before = servo()
    seen.press('ArrowLeft')
    until(lambda: before - 0.02 < servo() < before)
    seen.write(f'{seen.section("lever")}.querySelector("td input")', '80')
    end = math.degrees(math.asin(80.0 / 150.0))
    seen.becomes(f'{seen.section("lever")}.innerText.includes('
                 f'"lever reaches [-{end:.3f}, {end:.3f}] \N{DEGREE SIGN}")')
    seen.click(f'{seen.section("lever")}.querySelector("button")')
    until(lambda: running.value('lever.crank.speed') == 1.5)


# --- plots, arrows, files ---

@pytest.mark.nightly
def test_a_plot_follows_what_is_tuned_and_all_can_be_downloaded(start, tmp_path):
    parameters = {**LEG, 'leg.scale': 0.01, 'leg.leg_pairs': 2, 'leg.crank.speed': -2.0}
    running, seen = start(parameters)
    section = seen.section('leg')
    plot = f'{section}.querySelector(".plot")'

    def plotted(m):
        leg = mechanisms.create('jansen', m=m)
        rates = leg.joint_rates(np.radians(np.arange(-180.0, 181.0)), ['G.x'])['G.x']
        low, high = sorted((f'{-20.0 * rate:.4g}' for rate in (rates.min(), rates.max())),
                           key=float)
        seen.value(f'({plot}).closest("details").open = true')
        for label, choice in (('Quantity', 'velocity'), ('Output', 'G.x')):
            seen.becomes(f'[...{section}.querySelector("select[aria-label={label}]").options]'
                         f'.some(option => option.value === "{choice}")')
            seen.choose(section, label, choice)
        seen.becomes(f"{plot}.ariaLabel?.startsWith('Velocity of G.x with the crank at "
                     f"-114.6 °/s: from {low} to {high} mm/s.')")

    def feet_on_both_sides():
        columns = coloured(picture := seen.canvas(), 'locus')[:, 1]
        middle = picture.shape[1] / 2
        return (columns < middle - 20).sum() > 50 and (columns > middle + 20).sum() > 50

    def is_known():
        # The viewer is told of what was set a moment later, and downloads are what it knows.
        settings = running.page().mechanisms('/leg')['/leg']['settings']
        start, = (about['value'] for about in settings if about['name'] == 'crank.start')
        return start == running.value('leg.crank.start') and abs(start - 0.5 * math.pi) < 0.1

    seen.output('leg', 'BC')
    seen.value('workshop.click()')
    plotted(15.0)
    until(feet_on_both_sides)
    seen.type('leg', 'm', '160')
    plotted(16.0)
    seen.value(f'{plot}.scrollIntoView()')
    x, y, width = seen.middle(f'{plot}.querySelector(".u-over")')
    seen.drag((x, y), (x + width / 4, y))
    until(is_known)
    seen.downloads(tmp_path)
    for form in ('CSV', 'PNG', 'URDF', 'C'):
        seen.value(f'{seen.button(form)}.click()')
    files = [tmp_path / f'leg.{ending}' for ending in ('csv', 'png', 'urdf', 'h')]
    until(lambda: all(file.exists() for file in files))
    assert list(Image.open(files[1]).size) == seen.value('[picture.width, picture.height]')
    page = running.page()
    for form in ('csv', 'urdf', 'h'):
        assert (tmp_path / f'leg.{form}').read_text() == page.ask(
            'export', key='/leg', form=form)['text']


@pytest.mark.nightly
def test_a_plot_is_not_drawn_through_a_pole_and_fits_any_window(start):
    _, seen = start(LEG)
    section = seen.section('leg')
    plot = f'{section}.querySelector(".plot")'
    seen.resize(390, 844, 'light')
    seen.value(f'({plot}).closest("details").open = true')
    seen.becomes(f'/^Position/.test({plot}.ariaLabel)')
    seen.choose(section, 'Quantity', 'force ratio')
    seen.becomes(f'/^Force ratio of BC: .* and beyond/.test({plot}.ariaLabel)')
    # In each column, the part of the plot's height that is blue, however pale.
    blue = seen.value(f"""(() => {{
        const canvas = {plot}.querySelector('canvas'), {{ width, height }} = canvas;
        const {{ data }} = canvas.getContext('2d').getImageData(0, 0, width, height);
        return Array.from({{ length: width }}, (_, x) => Array.from({{ length: height }},
            (_, y) => data.subarray(4 * (x + y * width), 4 * (x + y * width) + 4)).filter(
            ([red, , blue, seen]) => seen && blue > red + 8).length / height);
    }})()""")
    assert max(blue) < 0.6 and sum(part > 0.0 for part in blue) > 200
    seen.resize(1200, 900, 'light')
    seen.value(f'{seen.button("Enlarge")}.scrollIntoView()')
    seen.click(seen.button('Enlarge'))
    seen.becomes('!!document.fullscreenElement')
    for width, height in ((1400, 900), (390, 844), (844, 390)):
        seen.resize(width, height, 'light')
        until(lambda width=width: 0.8 * width < seen.value(
            f'{plot}.querySelector("canvas").clientWidth') < width)
        assert seen.value('document.fullscreenElement.scrollWidth') <= width


@pytest.mark.nightly
def test_arrows_are_asked_for_wherever_their_mechanism_s_part_of_the_panel_is(start):
    _, seen = start(LEVER)
    # Outputs have their values at once when they are unfolded.
    folded = f'{seen.section("lever")}.querySelector("details:has(table):not([open])")'
    seen.becomes(f'!!{folded}.querySelector("td input")')
    assert seen.value(f'(folding => new Promise(done => {{ folding.open = true; folding.'
                      f'addEventListener("toggle", () => done(folding.querySelector("td input")'
                      f'.value)); }}))({folded})')
    seen.resize(1200, 200, 'light')
    seen.value("""(() => {
        const { send } = WebSocket.prototype;
        window.requested = new Set();
        WebSocket.prototype.send = function (text) {
            const { key, arrows } = JSON.parse(text);
            if (arrows) window.requested.add(key);
            send.call(this, text);
        };
        document.getElementById('arrows').value = 'velocity';
        document.getElementById('arrows').onchange();
    })()""")
    seen.becomes('window.requested.size === 2')


# --- connection ---

@pytest.mark.nightly
def test_a_reload_and_another_viewer_keep_what_is_seen_and_a_lost_connection_is_said(start):
    running, seen = start({**LEVER, 'drop.scale': 0.1}, 'drop')
    url, play = running.url, f'{seen.section("drop")}.querySelector("button")'

    def is_fast():
        return running.value('drop.crank.speed') == pytest.approx(math.radians(100.0))

    seen.value('(workshop.click(), arrows.value = "velocity",'
               ' arrows.dispatchEvent(new Event("change")))')
    # A bar of 1, scale 0.1, is 100 mm long in the picture.
    assert seen.number('drop', 'a') == 100.0
    seen.type('drop', 'speed', '100')
    until(is_fast)
    seen.value(f'{play}.click()')
    until(lambda: running.value('drop.crank.speed') == 0.0)
    seen.value('picture.focus()')
    for _ in range(3):
        seen.press('+')
    seen.open(url)
    seen.becomes('document.querySelectorAll("section").length === 1 && '
                 f'!!{seen.section("drop")}?.querySelector("tbody tr")')
    assert seen.value('[workshop.checked, arrows.value, notice.hidden]') == [
        True, 'velocity', True]
    seen.value(f'{play}.click()')
    until(is_fast)
    running.graph.end(running.viewer)
    seen.becomes('/^Connection lost/.test(notice.textContent)')
    running.viewer = running.graph.start(Viewer, {'port': int(re.search(r'(\d+)/$', url)[1])})
    seen.becomes('notice.hidden')
    seen.becomes(f'document.querySelectorAll("section").length === 1 && !!{seen.section("drop")}')
    # It is zoomed still: there is a way back to the whole picture.
    seen.click('document.getElementById("whole")')
    seen.becomes('document.getElementById("whole").hidden')
    seen.complaints.clear()


@pytest.mark.nightly
def test_a_phone_may_reload_the_page_as_often_as_it_likes(start):
    running, seen = start({**example('all'), 'rate': 20.0})
    seen.resize(390, 844, 'light')
    for _ in range(180):
        seen.open(running.url)
        seen.becomes('document.querySelectorAll("section").length === 4 && '
                     'document.querySelectorAll("section tbody tr").length > 3')


# --- layout ---

@pytest.mark.nightly
def test_mechanisms_are_in_their_natural_order_and_those_of_one_name_told_apart(graph, start):
    for space in ('left', 'right'):
        for kind in (CrankDriver, Kinematics):
            graph.start(kind, {'mechanisms': ['arm'], 'arm.type': 'four_bar',
                               'frame_prefix': f'{space}/'}, namespace=space)
    _, seen = start({}, kinds=())
    titles = ('[...document.querySelectorAll("#views button, section h2")].map('
              'title => title.textContent).join()')
    seen.becomes(f'{titles} === "all,left/arm,right/arm,left/arm,right/arm"')

    def are_beside():
        """Return whether two loci are seen beside each other: the frames are two."""
        columns = np.unique(coloured(seen.canvas(), 'locus')[:, 1])
        return len(columns) and (np.diff(columns) > 30).sum() == 1

    until(are_beside)
    for kind in (CrankDriver, Kinematics):
        graph.start(kind, {**RATE, 'mechanisms': ['m10', 'm1', 'm2'], **{
            f'm{number}.type': 'four_bar' for number in (1, 2, 10)}})
    shown = 'left/arm,m1,m2,m10,right/arm'
    seen.becomes(f'{titles} === "all,{shown},{shown}"')


@pytest.mark.nightly
@pytest.mark.parametrize('path', sorted((ROOT / 'config').glob('*.yaml')), ids=lambda p: p.stem)
def test_the_page_is_for_everybody(start, path):
    checker = pytest.importorskip('axe_core_python')
    axe = (Path(checker.__file__).parent / 'axe.min.js').read_text('utf-8')
    # A picture now and then leaves the browser time to look through the page.
    _, seen = start({**example(path.stem), 'rate': 5.0})
    for width, height, scheme in ((1200, 900, 'light'), (390, 844, 'dark')):
        seen.resize(width, height, scheme)
        seen.becomes(
            '[...document.querySelectorAll(".plot")].every(plot =>'
            ' (plot.closest("details").open = true) && /^Position of /.test(plot.ariaLabel) &&'
            f' plot.querySelector("canvas").clientWidth < {width}) &&'
            ' !!document.querySelector("section tbody tr")')
        assert seen.value('document.documentElement.scrollWidth') <= width
        assert json.loads(seen.value(
            f'(() => {{ {axe} }})(), axe.run().then(found => JSON.stringify('
            'found.violations.map(v => [v.id, ...v.nodes.map(node => node.html)])))')) == []


# A crank and a rocker whose names are as long as names may be.
LONG = {'mechanisms': ['m' * 64], **{f'{"m" * 64}.{name}': value for name, value in {
    'type': 'custom', 'crank' + 'k' * 59 + '.speed': 1.0, 'dimensions.r': 1.234567,
    'loads': ['D=100 20', f'B{"y" * 63}=-4 200'],
    'joints': [
        'O ground 0 0', 'Q ground 3 0', f'A{"x" * 63} crank O r called crank{"k" * 59}',
        f'B{"y" * 63} dyad A{"x" * 63} Q 2.5 2 left', f'D line O A{"x" * 63} 2'],
}.items()}}


@pytest.mark.nightly
@pytest.mark.parametrize('scale', [1e-6, 1.0, 1e6])
def test_nothing_is_cut_in_a_narrow_window_however_long(start, scale):
    name, = LONG['mechanisms']
    _, seen = start({**RATE, **LONG, f'{name}.scale': scale})
    seen.value('arrows.value = "force", arrows.onchange()')
    for width, click in ((320, False), (1200, False), (320, True)):
        seen.resize(width, 568, 'light')
        if click:
            seen.value('workshop.click()')
        seen.output(name, 'D.x')
        assert seen.value('document.documentElement.scrollWidth') <= width
        assert seen.value(
            '[...document.querySelectorAll("button, th, td, h2, input[type=text], .row > *")]'
            '.filter(part => part.offsetParent && part.scrollWidth > part.clientWidth + 1 &&'
            ' getComputedStyle(part).display !== "inline").map(part => part.outerHTML)') == []


@pytest.fixture
def blank(lever, seen):
    """Return the browser with a page whose modules are called alone."""
    seen.visit(lever.url)
    yield seen
    seen.leave()


@pytest.mark.nightly
def test_a_number_has_room_in_its_field_and_all_the_digits_that_have(blank):
    values = [sign * value * 10.0 ** power for sign in (1.0, -1.0)
              for value in (1.0, 1.234567891, 9.99999999) for power in range(-300, 300)]
    texts = blank.value('import("/control.js").then(({ figures }) =>'
                        f' {values}.map(value => figures(value, 6)))')
    for value, text in zip(values, texts):
        assert len(text) <= 9
        digits = 3 if abs(math.log10(abs(value))) > 99.0 else 4
        assert float(text) == pytest.approx(value, rel=10.0 ** (1 - digits))
        if 1.0 <= abs(value) < 1e5:
            assert float(text) == float(f'{value:.6g}')


# What is written in pictures of random places.
LABELS = """
import('/picture.js').then(({ Picture }) => {
  let seed = 7;
  const random = () => (seed = seed * 16807 % 2147483647) / 2147483647;
  return Array.from({ length: COUNT }, () => {
    const picture = new Picture(document.getElementById('picture')), written = [], places = [];
    Object.assign(picture, { scale: 1, middle: [0, 0], centre: [0, 0],
      canvas: { clientWidth: WIDTH, clientHeight: HEIGHT } });
    picture.text = (name, x, y) => written.push(
      [x, y, picture.context.measureText(name).width, Number(name.match(/\\d+$/))]);
    BODY
    return [places, written];
  });
})"""
# Mechanisms wherever they are; at a quarter of all heights (y + 18) - y < 18.
TITLES = """
picture.mechanisms = Array.from({ length: 16 }, (_, i) => (
  { key: i, title: 'linkage'.slice(i % 5) + i }));
const y = 4 ** (5 * random()), x = 4 ** (5 * random());
for (const { key } of picture.mechanisms) {
  const [left, top] = [x * random(), -y * (random() < 0.5 || random())];
  picture.boxes.set(key, { low: [left, top], high: [left, top] });
  places.push([left + picture.aside(picture.mechanisms[key]), -top]);
}
picture.titles();"""
NAMES = """
while (places.length < 8) {
  const [x, y] = [390 * random(), 380 * random()];
  if (places.every(([a, b]) => Math.hypot(x - a, y - b) > 70)) places.push([x, y]);
}
picture.names({ mechanism: { joints: { width: 6 } },
  seen: new Map(places.map((place, i) => ['joint'.slice(i % 4) + i, place])) });"""


def labelled(page, body, count, width, height, high, slack=0.0):
    """Yield how many labels a picture has: none is cut, on another, or nearer to another's."""
    script = LABELS.replace('BODY', body).replace('COUNT', str(count)).replace(
        'WIDTH', str(width)).replace('HEIGHT', str(height))
    for places, written in page.value(script):
        x, y, wide, number = np.transpose(written or np.empty((0, 4)))
        seen = (x >= 0.0) & (x <= width)
        assert (x - 0.5 * wide)[seen].min(initial=width) > 0.0
        assert (x + 0.5 * wide)[seen].max(initial=0.0) < width
        assert y.max(initial=0.0) + 0.5 * high < height
        apart = np.maximum(abs(y[:, None] - y) / high,
                           2.0 * abs(x[:, None] - x) / (wide[:, None] + wide))
        assert apart[~np.eye(len(x), dtype=bool)].min(initial=1.0) > 1.0 - 1e-9
        gaps = np.hypot(*(np.maximum(abs(at[:, None] - of) - half, 0.0) for at, of, half in zip(
            (x, y), np.transpose(places), (0.5 * wide[:, None], 0.5 * high))))
        own = gaps[np.arange(len(x)), number.astype(int)]
        assert (own <= gaps.min(axis=1, initial=math.inf) + slack).all()
        yield len(x)


@pytest.mark.nightly
@pytest.mark.parametrize('width, height', [(1e5, 1e5), (390, 380)])
def test_titles_are_written_apart_and_next_to_their_own(blank, width, height):
    # They have 4 px of room on both sides.
    counts = [*labelled(blank, TITLES, 2000, width, height, 18.0, slack=4.0)]
    assert 2 < np.mean(counts) < 16


@pytest.mark.nightly
def test_names_of_joints_are_whole_apart_and_beside_their_own(blank):
    assert {*labelled(blank, NAMES, 300, 390, 380, 16.0)} == {8}
