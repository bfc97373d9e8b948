# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Messages are one short line, and suggest what was meant or what to install."""

import enum
import os
import subprocess
import sys
from unittest.mock import Mock

from hypothesis import given, settings, strategies as st
from linkage_ros import palette, scene
from linkage_ros.cli import RequestError, run
from linkage_ros.optional import needs
from linkage_ros.words import did_you_mean, join_names, plain_text, sentence, short_repr, truncated
import numpy as np
import pytest

ANY = st.one_of(st.text(max_size=200), st.text('ab\n\x00\u2028\ud800', max_size=300))


@settings(max_examples=20)
@given(ANY, st.integers(10, 100))
def test_a_truncated_text_is_its_beginning_on_one_line(text, most):
    escaped = ''.join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
    assert truncated(text, most) == (
        escaped if len(escaped) <= most else escaped[:most - 3] + '...')


@pytest.mark.parametrize('text, said', [
    ('no\n such \x00', r'no such \x00'), (7, '7'),
    (f' {"x" * 599}\n{"y" * 600} ', f'{"x" * 599} {"y" * 596}...'),
    ('ab ' * 7000, ('ab ' * 7000)[:19997] + '...')])
def test_a_sentence_is_one_line_of_words_of_limited_length(text, said):
    assert sentence(text) == said


@pytest.mark.parametrize('value, text', [
    ('a', "'a'"), (1.5, '1.5'), (None, 'None'), ([1, 'b'], "[1, 'b']"), (('x',), "('x',)"),
    ('x' * 100, f"'{'x' * 27}...{'x' * 28}'"), ([7] * 30, f'[{"7, " * 18}7,...'),
    pytest.param(10 ** 5000, 'a int', id='digits'), (10 ** 70, f'1{"0" * 27}...{"0" * 29}'),
    ([[[[[1]]]]], '[[[[...]]]]'), ({'k': 2}, "{'k': 2}"), ('\n', r"'\n'")])
def test_a_value_is_quoted_as_python_writes_it_shortened(value, text):
    assert short_repr(value) == text and len(text) <= 60


def test_a_value_that_cannot_write_itself_is_named_by_its_class():
    unwritable = type('Unwritable', (), {'__repr__': lambda self: 1 / 0})()
    assert short_repr(unwritable).startswith('<Unwritable instance at 0x')


@pytest.mark.parametrize('names, text', [
    ([], 'none'), (['a'], 'a'), (['a', 'bc'], 'a, bc'), (['x' * 40], 'x' * 27 + '...'),
    (['x' * 28] * 2, f'{"x" * 28}, {"x" * 28}'), (['x' * 30] * 2, f'{"x" * 30}, ... (2)'),
    ([c * 10 for c in 'abcdefg'],
     'aaaaaaaaaa, bbbbbbbbbb, cccccccccc, dddddddddd, eeeeeeeeee, ... (7)')])
def test_a_list_names_the_first_and_counts_all(names, text):
    assert join_names(iter(names)) == text
    assert join_names(names, 10 ** 6) == (', '.join(names) or 'none')


@pytest.mark.parametrize('word, names, name', [
    ('jansn', ['klann', 'jansen'], 'jansen'), ('BC', ['bc', 'BD'], 'bc'), ('x', ['jansen'], None),
    (None, ['None'], None), ('', ['a'], None), ('abcdefghij', ['abcdefg___'], 'abcdefg___'),
    ('abcdefghij', ['abcdef____'], None), ('x' * 70, ['x' * 60], 'x' * 60),
    ('ab', ['abc', 'ab'], 'ab'), ('x' * 60, ['x' * 70], f'{"x" * 57}...')])
def test_the_most_similar_name_is_meant(word, names, name):
    assert did_you_mean(word, names) == ('' if name is None else f'; did you mean {name}?')


def test_a_text_of_any_class_becomes_plain_and_all_else_stays():
    kind = enum.Enum('kind', {'leg': 'jansen'}, type=str)
    for text in (np.str_('jansen'), kind.leg, 'jansen'):
        assert type(plain_text(text)) is str and plain_text(text) == 'jansen'
    assert plain_text(7) == 7 and plain_text(None) is None


def test_the_first_colours_are_those_that_colour_blind_people_tell_apart():
    # Okabe and Ito, "Color Universal Design".
    for colour, published in (
            (palette.ORANGE, (230, 159, 0)), (palette.SKY, (86, 180, 233)),
            (palette.GREEN, (0, 158, 115)), (palette.BLUE, (0, 114, 178)),
            (palette.VERMILION, (213, 94, 0)), (palette.PURPLE, (204, 121, 167))):
        assert colour == '#%02x%02x%02x' % published
        assert palette.rgb(colour) == pytest.approx([part / 255 for part in published], abs=5e-4)


@pytest.mark.parametrize('error, text', [
    (RequestError('no\n such \x00'), r'no such \x00'),
    (scene.SceneError('a must be b'), 'a must be b'),
    (ImportError('x is not installed'), 'x is not installed'), (OSError('no device'), 'no device'),
    (PermissionError(13, 'Permission denied', '/etc/x'), '/etc/x: Permission denied'),
    (KeyboardInterrupt(), 'interrupted')])
def test_a_command_that_fails_says_why_in_one_sentence(capsys, error, text):
    assert run('draw', Mock(side_effect=error), ['a', 'b']) == 1
    assert capsys.readouterr() == ('', f'draw: {text}\n')


def test_a_command_that_works_ends_with_0_and_a_mistake_is_not_hidden(capsys):
    assert run('draw', print, ['done']) == 0
    assert capsys.readouterr() == ("['done']\n", '')
    with pytest.raises(ValueError):
        run('draw', Mock(side_effect=ValueError), ['a', 'b'])


def test_a_reader_that_has_gone_ends_a_command_quietly_and_a_full_disk_with_a_sentence():
    command = ('import sys; from linkage_ros.cli import run; '
               'sys.exit(run("draw", print, ["much"]))')
    reader, writer = os.pipe()
    os.close(reader)
    with open(writer, 'wb') as gone, open('/dev/full', 'wb') as full:
        for output, code, text in (
                (gone, 0, ''), (full, 1, 'draw: [Errno 28] No space left on device\n')):
            ended = subprocess.run(
                [sys.executable, '-c', command], stdout=output, stderr=subprocess.PIPE, text=True,
                env={**os.environ, 'PYTHONUNBUFFERED': ''})
            assert (ended.returncode, ended.stderr) == (code, text)


@pytest.mark.parametrize('work, closed, code, out, err', [
    ('lambda args: print(*args)', '', 0, '\u89d2 '.encode() + b'\xff\n', b''),
    ('print', '>&-', 0, b'', b''),
    ('lambda args: open("none/x")', '>&-', 1, b'', b'draw: none/x: No such file or directory\n'),
    ('lambda args: open("none/x")', '2>&-', 1, b'', b'')])
def test_output_is_utf_8_in_every_locale_and_each_stream_may_be_closed(
        work, closed, code, out, err):
    command = ('import sys; from linkage_ros.cli import run; '
               f'sys.exit(run("draw", {work}, ["\\u89d2", "\\udcff"]))')
    ended = subprocess.run(
        ['sh', '-c', f'exec "$@" {closed}', '-', sys.executable, '-c', command],
        capture_output=True, env={**os.environ, 'PYTHONIOENCODING': 'ascii'})
    assert (ended.returncode, ended.stdout, ended.stderr) == (code, out, err)


def test_a_file_that_is_not_there_is_suggested_by_its_name(capsys, tmp_path):
    (tmp_path / 'scene.yaml').touch()
    for error, end in (
            (FileNotFoundError(2, 'no', f'{tmp_path}/scen.yaml'), '; did you mean scene.yaml?'),
            (FileNotFoundError(2, 'no', 'none/scen.yaml'), ''),
            (PermissionError(13, 'no', f'{tmp_path}/scen.yaml'), '')):
        run('draw', Mock(side_effect=error), [])
        assert capsys.readouterr().err == f'draw: {error.filename}: no{end}\n'


def test_a_package_that_another_one_needs_is_the_one_at_fault():
    for error, fault in ((ModuleNotFoundError(name='PIL.Image'), 'PIL'),
                         (ImportError(name='PIL._imaging'), 'PIL'),
                         (ModuleNotFoundError(name='kiwi'), 'matplotlib')):
        with pytest.raises(ImportError, match=f'^{fault} is installed but'):
            with needs('matplotlib'):
                raise error
    with pytest.raises(ImportError, match='^PIL is installed but'):
        with needs('matplotlib'), needs('PIL'):
            raise OSError
