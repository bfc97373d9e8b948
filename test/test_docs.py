# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The pages: what they link to is there, what they say to type works, and nothing is left out."""

import json
from pathlib import Path
import re
import shlex
import shutil
import subprocess
import sys

from linkage_ros import mechanisms, scene
from linkage_ros.linkage import joint_lines
import pytest

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob('*.md'), *(ROOT / 'docs').glob('*.md')])
LINK = re.compile(r'!?\[[^]]*\]\(([^)\s]+)\)')
RENDER = re.compile(r'\$ (?:python -m linkage_ros\.render|ros2 run linkage_ros render) (.*)')
FENCE = re.compile(r'^```(\w*)\n(.*?)^```', re.MULTILINE | re.DOTALL)


@pytest.fixture
def catalogue(monkeypatch):
    for module in ('matplotlib', 'tqdm', 'yaml'):
        pytest.importorskip(module)
    monkeypatch.syspath_prepend(ROOT / 'docs')
    import catalogue
    return catalogue


def blocks(page, language):
    return [text for name, text in FENCE.findall(page.read_text()) if name == language]


def anchors(page):
    headings = re.findall(r'^#+ +(.*)$', FENCE.sub('', page.read_text()), re.MULTILINE)
    return {re.sub(r'[^\w\- ]', '', text).strip().lower().replace(' ', '-') for text in headings}


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_every_link_inside_the_repository_leads_somewhere(page):
    for link in LINK.findall(FENCE.sub('', page.read_text())):
        if not re.match(r'\w+:', link):
            path, _, place = link.partition('#')
            target = (page.parent / path).resolve() if path else page
            assert target.exists(), link
            assert not place or target.suffix != '.md' or place in anchors(target), link


def test_nobody_is_told_to_install_a_release_that_there_is_not():
    for file in (*PAGES, *(ROOT / 'linkage_ros').rglob('*.py')):
        assert not re.search(r"pip3? install[^\n]* '?linkage.ros", file.read_text()), file


@pytest.mark.skipif(not shutil.which('git') or not (ROOT / '.git').exists(), reason='no clone')
def test_no_page_shows_a_picture_that_is_not_kept():
    kept = set(subprocess.run(['git', 'ls-files'], cwd=ROOT, check=True, text=True,
                              capture_output=True).stdout.split())
    for page in PAGES:
        for link in LINK.findall(page.read_text()):
            if link.endswith(('.png', '.gif', '.svg')) and ':' not in link:
                assert str((page.parent / link).resolve().relative_to(ROOT)) in kept, link


def test_the_pictures_that_are_kept_are_small():
    assert sum(file.stat().st_size for file in (ROOT / 'docs/images').rglob('*.*')) < 2.5e6


def test_every_word_has_its_drawing_with_the_very_lines_that_it_shows():
    pytest.importorskip('yaml')
    machines = scene.load(ROOT / 'pictures' / 'words.yaml').machines
    text = (ROOT / 'docs' / 'which-word.md').read_text()
    rows = re.findall(r'\(images/words/(\w+)\.png\)\n\n```text\n(.*?)\n```', text, re.DOTALL)
    shown = {name: lines.splitlines() for name, lines in rows}
    assert len(rows) == len(shown) and set(shown) == set(machines)
    for name, lines in shown.items():
        written = machines[name].given[f'{name}.joints']
        assert lines == [line for line in written if line in lines]
        assert lines[-1] == written[-1]
        assert any(word in lines[-1].split() for word in joint_lines.FORMS)
    drawn = {part for lines in shown.values() for line in lines for part in line.split()}
    assert set(joint_lines.FORMS) <= drawn


def test_the_tables_of_words_name_all_of_them():
    for page in ('which-word.md', 'write-your-own.md'):
        named = re.findall(r'`(\w+)`', (ROOT / 'docs' / page).read_text())
        assert set(joint_lines.FORMS) <= set(named)


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_the_pictures_that_a_page_says_to_render_can_be_asked_for(page):
    for module in ('matplotlib', 'yaml'):
        pytest.importorskip(module)
    from linkage_ros.render.command import parsed

    for line in '\n'.join(blocks(page, 'console')).splitlines():
        command = RENDER.match(line)
        if command:
            asked = parsed(shlex.split(command[1]))
            scene.load(ROOT / asked.scene)


def test_the_tour_works_as_written():
    page = ROOT / 'docs' / 'index.md'
    for code in blocks(page, 'python'):
        exec(compile(code, page.name, 'exec'), {})
    yaml = pytest.importorskip('yaml')
    for text in blocks(page, 'yaml'):
        given = yaml.safe_load(text)['/**']['ros__parameters']
        assert list(scene.read(given).machines) == given['mechanisms']


@pytest.mark.parametrize('type_', list(mechanisms.TYPES))
def test_the_page_of_a_mechanism_has_all_of_it(catalogue, type_):
    page, linkage = catalogue.page(type_), mechanisms.create(type_)
    for name, value in linkage.dimensions.items():
        assert re.search(rf'^\| `{name}` \| {re.escape(f"{value:g}")} \| `', page, re.MULTILINE)
    for name in (*linkage.joints, *(f'{joint}: {sign:+d}' for joint, sign
                                    in linkage.branches.items())):
        assert f'`{name}`' in page
    for line in mechanisms.design(type_).joints:
        assert line.split(maxsplit=1)[1].split()[-1] in page
    exec(compile(re.findall(r'```python\n(.*?)```', page, re.DOTALL)[0], type_, 'exec'), {})


def test_the_table_of_engines_is_that_of_the_last_run(monkeypatch):
    pytest.importorskip('mpmath')
    monkeypatch.syspath_prepend(ROOT)
    from benchmark import document, engines
    result = json.loads(engines.RESULTS.read_text())
    assert document.written('architecture.md') == engines.table(result)


def test_text_of_a_docstring_is_taken_for_text(catalogue):
    assert catalogue.markdown('a*b*c <d> [e] `f*g` sqrt(theta^2) -> |h|') == \
        r'a\*b\*c \<d\> \[e\] `f*g` √(θ²) → \|h\|'


def test_a_broken_link_is_found(tmp_path):
    (tmp_path / 'a.html').write_text('<p id="x"><a href="b.html#y"><a href="#x"><a href="#z">'
                                     '<img src="c.png"><a href="https://example.org/d">')
    (tmp_path / 'b.html').write_text('<p id="y"><a href="a.html#x">')
    ended = subprocess.run([sys.executable, str(ROOT / 'docs' / 'links.py'), str(tmp_path)],
                           capture_output=True, text=True, timeout=60)
    assert ended.returncode == 1
    said = [line.split(': ')[1].split()[0] for line in ended.stderr.splitlines()]
    assert said == ['#z', 'c.png']
