# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Texts that nobody should have to read: slips of the pen, other languages, attacks."""

import itertools
import random
import string
import unicodedata

LEGAL = (
    'P ground 0.5 -g/2', 'P crank O m', 'P crank O m up', 'P dyad A Q b c left',
    'P rigid A B 3 0.5e0 right', 'P line A B -m*2', 'P mirror Q B O',
    'P parallelogram B A Q', 'P R S inversor Q A 9 b-g/4', 'P slot Q A 0 out max(g,2*g)',
    'P slider B b+c Q pi/2 in', 'P slider A b Q -30deg out', 'P rigid A B sqrt(b*b+c*c) b left',
    'P line A B (m+c)/2', 'P ground .5 1e-3', 'P slider A b Q (m+29)deg out')

NUMBERS = (
    '9' * 309, '1e308*10', '1e400', '-1e400', '1e-400', '1e71', '1e-71', '1e70*10', '1e-70/10',
    '1e40*1e40*g', 'inf', 'nan', 'Infinity', '1/0', 'g/(1-1)', 'sqrt(-1)', 'sqrt(m-g)', '1_000',
    '0x10', '017', '00', '1j', '1e', '1e+', 'e1', '.', '..', '1.2.3', '1.2e3.4', '--', '-', '*',
    '+1', '1+', '1++2', 'g**2', 'g//2', 'g%2', 'g@2', 'g^2', '~g', 'g<1', 'g==1', 'g=1', '(g:=1)',
    'g;1', 'g#1', 'g\\', 'g`', '$g', '${g}', 'g.real', 'g.__class__', '().__class__', 'g()',
    '2(g)', '(2)(3)', '2g', '2 g', 'gm', '_g', 'max', 'max()', 'max(1)', 'max(1,)', 'max(,1)',
    'max(1,2,3)', 'max(1,2,key=1)', 'max((1,2))', 'max[1,2]', 'max(*g)', 'max(max(1,2)',
    'max(1,2))', 'min(1,2)', 'Max(1,2)', 'sqrt', 'sqrt(1,2)', 'sqrt1)', 'sqrt(sqrt)', 'sin(1)',
    'float(1)', 'eval("1")', 'pi()', 'pi2', '2pi', 'PI', 'math.pi', 'deg', 'deg30', '30Deg',
    '30degdeg', '30rad', 'gdeg', 'g*deg', '30deg', '30deg*deg', '5mm', '50%', '1,5', ',1', '1;',
    '(', ')', '()', '(1', '1)', ')(', '[1]', '{1}', 'g[0]', '{0!r}', '{:>1000000}', '%1000000d',
    "f'{g}'", "'1'", "b'1'", '"', 'lambda:0', '(yield)', 'None', 'True', '...', '1if(1)else(2)',
    '1or(2)', '[g]for', '*g', '__import__("os").system("true")', "'\\d'", '1E5E5', '1e1000000',
    '-(-', '(,)', 'g,m', '(g,)')

# One letter of each kind that Unicode knows, and some that look like what is legal.
STRANGE = (
    *{unicodedata.category(letter): letter for letter in map(chr, range(0x20000))}.values(),
    '\0', 'g\0', '\x1b[31m', '\u202eg', '\ufeff', '\ud800', '\uff47', '\uff11\uff0b\uff12',
    '\u0661', '\u221a(2)', '30\xb0', '\u221230', '2\xd73', 'm\u0430x(1,2)', 'a\u0308',
    'Z\u0351\u036b' * 9)

WORDS = (
    '', ' ', '\t', '\n', '\r\n', '\x0b', 'ground', 'crank', 'dyad', 'left', 'up', 'None', 'null',
    '~', 'yes', 'on', 'true', '!!python/object:os.system', '&a *a', '- a', '? a', 'a: b', 'a: [b',
    '{a: b}', '| a', '---', '%YAML 1.2', '@a', '# a', '<a>', '&lt;', '<![CDATA[a]]>',
    '<script>alert(1)</script>', "'; DROP TABLE joints; --", '../../etc/passwd', '/', '\\',
    'file:///a', '$HOME', '$(true)', '`true`', '; true', '--help', '--ros-args', 'a b', ' a', 'a ',
    'a.b', 'a.x.y', '.x', 'a.', 'A.z', 'A.X', 'A..x', 'A.x ', 'A,x', 'a/b', 'a-b', '1a', '_',
    '_a', '__init__', '__dict__', 'self', 'class', 'type_', 'joints', 'tracer', 'branches', 'deg',
    'pi', 'max', 'dimension', '[m]', 'x', 'X', 'A', 'a', 'o', 'Crank', 'crank1', 'crank2',
    'lever', 'world', 'OA', 'custom', 'jansen', 'Jansen', ' jansen', 'jansen\n', 'jansen\0',
    'four-bar', 'water_drop.', 'A\nB', '\nA', 'A\0B', 'a' * 64, 'a' * 65, 'a' * 300, 'A' * 1000)


def long_texts():
    """Yield texts of a hundred thousand letters and more."""
    for count in (300, 20_000, 1_000_000):
        yield from (letter * count for letter in (
            'a', '9', '(', ')', '-', '+', '*', '.', ' ', '\n', '\0', '\u202e', '\U0001f600', 'P ',
            '{', '%s'))
    many = 100_000
    yield '(' * many + '1' + ')' * many
    yield '-' * many + '1'
    yield '+'.join('1' * many)
    yield '+'.join('g' * many)
    yield '*'.join('2' * many)
    yield 'max(1,' * many + '1' + ')' * many
    yield 'sqrt(' * many + '2' + ')' * many
    yield '1' + 'deg' * many
    yield '0.' + '0' * many + '1'
    yield ', '.join(['P ground 0 0'] * many)
    yield '\n'.join(['P ground 0 0'] * many)
    yield 'P ' * many + 'inversor Q A 3 1'
    yield 'P ground ' + '0 ' * many
    yield from ('(' * deep + 'g' + ')' * deep for deep in (50, 200, 2000, 6000))
    yield from ('(' * deep + 'g' for deep in (1, 200, 6000))


def mutations(count, seed):
    """Yield legal lines with slips: letters and words lost, doubled, swapped, put in."""
    rng = random.Random(seed)
    pieces = (*NUMBERS[:60], *STRANGE[:30], *string.printable)
    for _ in range(count):
        text = rng.choice(LEGAL)
        for _ in range(rng.randint(1, 4)):
            at, end = sorted(rng.randint(0, len(text)) for _ in range(2))
            words = text.split(' ')
            one, two = (rng.randrange(len(words)) for _ in range(2))
            words[one], words[two] = words[two], words[one]
            text = rng.choice((
                text[:at] + text[min(at + 1, end):], text[:at] + text[at:end] * 2 + text[end:],
                text[:at] + rng.choice(pieces) + text[at:], ' '.join(words),
                text[:at] + rng.choice(pieces) + text[at + 1:], text[:at] + ' ' + text[at:],
                ' '.join((*words[:one], rng.choice(pieces), *words[one + 1:])),
                text.replace(' ', rng.choice((', ', '\t', '  ', '')), 1)))
        yield text


def pairs():
    """Yield two numbers or words that are legal alone, joined by what is not."""
    joined = '', '(', ')', ',', '.', '**', '//', '%', '=', '_', '\xa0', '\u2212'
    for parts in itertools.product(('2', 'g', '(1)', 'pi', '30deg', 'max(1,2)', 'sqrt(g)'),
                                   joined, ('3', 'm', '(g)', 'pi')):
        yield ''.join(parts)


TEXTS = tuple(dict.fromkeys((*NUMBERS, *STRANGE, *WORDS, *long_texts(), *pairs())))
