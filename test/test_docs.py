# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The pages: what they link to is there, what they say to type works, and nothing is left out."""

import doctest
import json
from pathlib import Path
import re
import sys

from benchmark import calls, document
from benchmark.nodes import report
from linkage_ros import mechanisms, scene
from linkage_ros.linkage import joint_lines, Mechanism
import pytest

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob('*.md'), *(ROOT / 'docs').glob('*.md'), *(
    page for folder in ('how-to', 'design') for page in (ROOT / 'docs' / folder).glob('*.md'))])
# Pages of the catalogue, which are made when the others are built.
MADE = {ROOT / 'docs' / 'mechanisms' / f'{name}.md'
        for name in ('index', 'constructions', *mechanisms.TYPES)}
LINK = re.compile(r'!?\[[^]]*\]\(([^)\s]+)\)')
FENCE = re.compile(r'^```(\w*)\n(.*?)^```', re.MULTILINE | re.DOTALL)
JOURNEYS = {
    'The life of a crank message': lambda graph, node, crank, received: crank([0.4], received),
    'A change of a parameter': lambda graph, node, crank, received: graph.set(node, m__scale=2.0)}


@pytest.fixture
def catalogue():
    for module in ('matplotlib', 'yaml'):
        pytest.importorskip(module)
    import catalogue
    return catalogue


def blocks(page, language):
    return [text for name, text in FENCE.findall(page.read_text()) if name == language]


def anchors(page):
    headings = re.findall(r'^#+ +(.*)$', FENCE.sub('', page.read_text()), re.MULTILINE)
    return {re.sub(r'[^\w\- ]', '', text).strip().lower().replace(' ', '-') for text in headings}


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_every_link_inside_the_repository_leads_somewhere(page, tracked):
    for link in LINK.findall(FENCE.sub('', page.read_text())):
        if not re.match(r'\w+:', link):
            path, _, place = link.partition('#')
            target = (page.parent / path).resolve() if path else page
            assert target.exists() or target in MADE, link
            assert target.suffix not in ('.png', '.gif', '.svg') or target in tracked, link
            assert not place or target.suffix != '.md' or place in anchors(target), link


def test_what_a_page_says_to_type_is_there():
    def files(*patterns):
        return {str(file.relative_to(ROOT)) for each in patterns for file in ROOT.glob(each)}

    makefile, setup = ((ROOT / name).read_text() for name in ('Makefile', 'setup.py'))
    launch = files('launch/*.launch.py', 'examples/*.launch.py')
    modules = {re.sub(r'(/__main__|/__init__)?\.py$', '', file).replace('/', '.')
               for file in files('linkage_ros/**/*.py', 'benchmark/**/*.py')}
    there = {
        r'(?:^ +|`|[$&] )make ([a-z]+)': re.findall(r'^([a-z]+):', makefile, re.MULTILINE),
        r'ros2 run linkage_ros ([a-z]\w*)': re.findall(r"'(\w+)': '[\w.]+:\w+'", setup),
        r'ros2 launch linkage_ros (\S+)': {Path(file).name for file in launch},
        r'(?<!-[rp]) (\w+):=': re.findall(
            r"'(\w+)'", ''.join((ROOT / file).read_text() for file in launch)),
        r'python3? -m ((?:linkage_ros|benchmark)[\w.]*)': modules,
        r'python3? (\w+/\S+\.py)': files('*/*.py'),
        # A recipe writes one of them.
        r'((?:config|examples)/[\w/]+(?:\.[a-z]+)+)': files('config/*', 'examples/**/*') | {
            'config/roberts.yaml'}}
    for page in PAGES:
        for what, known in there.items():
            typed = set(re.findall(what, page.read_text(), re.MULTILINE))
            assert typed <= set(known), (page, what, typed - set(known))


def test_nobody_is_told_to_install_a_release_that_there_is_not():
    for file in (*PAGES, *(ROOT / 'linkage_ros').rglob('*.py')):
        assert not re.search(r"pip3? install[^\n]* '?linkage.ros", file.read_text()), file


def test_the_pictures_that_are_kept_are_small_and_shown():
    pictures, text = [*(ROOT / 'docs/images').rglob('*.*')], ''.join(map(Path.read_text, PAGES))
    assert sum(file.stat().st_size for file in pictures) < 2.5e6
    assert not [file.name for file in pictures if f'/{file.name}' not in text]


def test_every_word_has_its_drawing_with_the_very_lines_that_it_shows():
    pytest.importorskip('yaml')
    mechanisms = scene.load(ROOT / 'pictures' / 'words.yaml').mechanisms
    text = (ROOT / 'docs' / 'which-word.md').read_text()
    rows = re.findall(r'\(images/words/(\w+)\.png\)\n\n```text\n(.*?)\n```', text, re.DOTALL)
    shown = {name: lines.splitlines() for name, lines in rows}
    assert len(rows) == len(shown) and set(shown) == set(mechanisms)
    for name, lines in shown.items():
        written = mechanisms[name].linkage.design.joints
        assert lines == [line for line in written if line in lines]
        assert lines[-1] == written[-1]
    drawn = {part for lines in shown.values() for part in lines[-1].split()}
    in_the_table = set(re.findall(r'`(\w+)`', text))
    assert set(joint_lines.FORMS) <= drawn & in_the_table


def test_the_library_on_the_page_of_forces_works_as_written():
    exec(''.join(blocks(ROOT / 'docs' / 'forces.md', 'python')), {})


API = [ROOT / 'docs' / 'api.rst', *sorted((ROOT / 'docs' / 'api').glob('*.rst'))]


def test_every_method_that_a_page_calls_is_in_the_reference():
    called = {name for page in PAGES if page.parent.name != 'design'
              for name in re.findall(r'\w\.([a-z_]+)\(', page.read_text())}
    methods = {name for name in called if hasattr(Mechanism, name)}
    described = ''.join(page.read_text() for page in API)
    assert len(methods) > 10
    assert not [name for name in methods if f'Mechanism.{name}\n' not in described]


@pytest.mark.usefixtures('catalogue')
@pytest.mark.parametrize('page', API, ids=lambda page: page.stem)
def test_the_examples_of_the_reference_work_as_written(page, monkeypatch):
    monkeypatch.chdir(ROOT)
    failed, tried = doctest.testfile(str(page), module_relative=False)
    assert tried and not failed


@pytest.mark.parametrize('page', ['forces', 'scene-files'])
def test_the_example_of_a_scene_file_is_a_scene(page):
    yaml = pytest.importorskip('yaml')
    text, = blocks(ROOT / 'docs' / f'{page}.md', 'yaml')
    given = yaml.safe_load(text)['/**']['ros__parameters']
    assert list(scene.read(given).mechanisms) == given['mechanisms']


@pytest.mark.parametrize('type_', list(mechanisms.TYPES))
def test_the_page_of_a_mechanism_has_all_of_it(catalogue, type_):
    page, linkage = catalogue.page(type_), mechanisms.create(type_)
    assert type_ in catalogue.USES
    for name, value in linkage.dimensions.items():
        assert f'\n| `{name}` | {value:g} |\n' in page
    for name in (*linkage.joints, *(f'{joint}: {sign:+d}' for joint, sign
                                    in linkage.branches.items())):
        assert f'`{name}`' in page
    for line in mechanisms.design(type_).joints:
        assert line.split(maxsplit=1)[1].split()[-1] in page
    exec(compile(re.findall(r'```python\n(.*?)```', page, re.DOTALL)[0], type_, 'exec'), {})


def test_the_page_of_constructions_has_every_formula(catalogue):
    page = catalogue.construction_page()
    assert set(re.findall(r'^### (\w+)', page, re.MULTILINE)) == set(catalogue.FORMULAS)


def test_text_of_a_docstring_becomes_markdown(catalogue):
    text = '\nWhat it is.\n\n    Y line\n\nIn a*b*c <d> [e] `f*g`: sqrt(theta^2) -> |h|\n'
    assert list(catalogue.doc_blocks(text)) == [
        'What it is.', '```text\nY line\n```', r'In a\*b\*c \<d\> \[e\] `f*g`: √(θ²) → \|h\|']


def test_what_a_scene_costs_is_what_was_measured():
    results = json.loads((ROOT / 'benchmark' / 'results' / 'nodes.json').read_text())
    assert document.written('design/performance.md') == report.document(results).strip()


def test_what_is_measured_is_of_a_commit():
    parts = [part.partition('<!-- end of')[0] for page in (ROOT / 'docs').rglob('*.md')
             for part in page.read_text().split('<!-- measured')[1:]]
    assert len(parts) >= 6 and not [part for part in parts if 'dirty' in part]


@pytest.mark.parametrize('heading', JOURNEYS)
def test_the_files_of_a_journey_are_those_that_run(graph, heading):
    pytest.importorskip('rclpy')
    from linkage_ros.nodes import ownership
    from linkage_ros.nodes.kinematics import Kinematics
    from sensor_msgs.msg import JointState
    from std_msgs.msg import String

    page = (ROOT / 'docs' / 'design' / 'architecture.md').read_text()
    steps = re.findall(r'^\d\. .*(?:\n   .*)*', page.partition(f'## {heading}')[2].partition(
        '\n## ')[0], re.MULTILINE)
    named = {file for step in steps for file in re.findall(r'`((?:nodes|scene)/\w+\.py)`', step)}
    node = graph.start(Kinematics, {'mechanisms': ['m'], 'm.type': 'jansen'})
    crank, received = graph.crank(['m_crank']), graph.listen(JointState, 'm/joint_states')
    # The last that the worker does at a start.
    described = graph.listen(String, 'robot_description', ownership.LATCHED)
    graph.until(lambda: described)
    for angle in (0.2, 0.3):
        crank([angle], received)
    ran, room = set(), str(ROOT / 'linkage_ros') + '/'

    def called(frame, event, _):
        if event == 'call' and frame.f_code.co_filename.startswith(room):
            ran.add(frame.f_code.co_filename.removeprefix(room))

    sys.setprofile(called)
    try:
        JOURNEYS[heading](graph, node, crank, received)
    finally:
        sys.setprofile(None)
    assert len(named) >= 5 and named <= ran, named - ran
    if heading == 'The life of a crank message':
        assert ran == named


def test_every_file_that_the_architecture_names_is_there():
    page = FENCE.sub('', (ROOT / 'docs' / 'design' / 'architecture.md').read_text())
    files = set(re.findall(r'`([a-z_/]+\.(?:py|md|rst|srv|txt|yaml|h|cfg))`', page))
    rooms = ROOT, ROOT / 'linkage_ros', ROOT / 'linkage_ros' / 'c_code'
    # The recipes write these two.
    assert len(files) > 60 and {
        file for file in files if not any((room / file).exists() for room in rooms)} == {
            'linkage_ros/mechanisms/roberts.py', 'config/roberts.yaml'}


def test_every_call_that_the_pages_show_is_timed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shown = [[page, f'`{calls.short(call)}`', calls.below(call, known)[0]]
             for page, code in calls.code_of_pages().items() for call, known in calls.calls(code)]
    timed = [[page, call, below] for _, page, call, _, below, *_ in (
        re.split(r' ?\| ', line) for line in document.written(
            'design/performance.md', 'measured: calls').splitlines()[2:] if line.startswith('|'))]
    assert timed == shown and len(shown) > 20
