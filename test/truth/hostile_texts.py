# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Texts that nobody should have to read: slips of the pen, other languages, attacks."""

import itertools
import random
import string

LEGAL = (
    'P ground 0.5 -g/2', 'P crank O m', 'P crank O m up', 'P dyad A Q b c left',
    'P rigid A B 3 0.5e0 right', 'P line A B -m*2', 'P mirror Q B O',
    'P parallelogram B A Q', 'P R S inversor Q A 9 b-g/4', 'P slot Q A 0 out max(g,2*g)',
    'P slider B b+c Q pi/2 in', 'P slider A b Q -30deg out', 'P rigid A B sqrt(b*b+c*c) b left',
    'P line A B (m+c)/2', 'P ground .5 1e-3', 'P slider A b Q (m+29)deg out')

NUMBERS = (
    '9' * 309, '9' * 310, '1' * 5000, '1e308*10', '1e400', '-1e400', '1e999', '1e-400', '1e71',
    '1e-71', '1e70*10', '1e-70/10', '1e40*1e40*g', 'inf', '-inf', 'inf-inf', 'nan', 'NaN',
    'Infinity', '1/0', '0/0', 'g/0', 'g/(1-1)', '1/(g-g)', '0/(g-g)', 'sqrt(-1)', 'sqrt(m-g)',
    '1_000', '1_0.5', '0x10', '0X1F', '0o17', '017', '00', '0b11', '1j', '1+2j', '2J', '1e',
    '1e+', 'e1', '.', '..', '1..2', '1.2.3', '1.2e3.4', '--', '-', '+', '*', '/', '+1', '1+',
    '*1', '1*', '1++2', '1+*2', '1**2', 'g**2', 'g//2', 'g%2', 'g@2', 'g^2', 'g&1', 'g|1', 'g<<1',
    'g>>1', '~g', 'g<1', 'g==1', 'g!=1', 'g<=1', 'g=1', '(g:=1)', 'g:1', 'g;1', 'g#', '#', 'g#1',
    'g\\', 'g`', 'g!', 'g?', '$g', '${g}', '$(g)', '`g`', 'g.', 'g.real', 'g.__class__',
    '().__class__', 'g()', 'g(1)', '2(g)', '(2)(3)', '2g', '2 g', 'gm', 'g_', '_g', '__g__',
    'max', 'max()', 'max(1)', 'max(1,)', 'max(,1)', 'max(,)', 'max(1,2,3)', 'max(1,2,key=1)',
    'max((1,2))', 'max[1,2]', 'max(*g)', 'max(1;2)', 'max(max(1,2)', 'max(1,2))', 'min(1,2)',
    'maxi(1,2)', 'Max(1,2)', 'sqrt', 'sqrt()', 'sqrt(1,2)', 'sqrt(1', 'sqrt1)', 'Sqrt(1)',
    'sqrt(sqrt)', 'sqrt[2]', 'sin(1)', 'cos(0)', 'abs(-1)', 'pow(2,3)', 'float(1)', 'int("1")',
    'eval("1")', 'exec("1")', 'pi()', 'pi(1)', 'pi2', '2pi', 'PI', 'Pi', 'pi.real', 'math.pi',
    'np.pi', 'tau', 'e', 'deg', 'deg30', 'deg(30)', '30degrees', '30Deg', '30DEG', '30degdeg',
    '30d', '30rad', '30grad', 'gdeg', 'g*deg', '30deg', '30deg*deg', "30'", '30"', '5mm', '5m',
    '5cm', '1/2in', '50%', '1,5', '1.5,', ',1', '1;', '(', ')', '()', '(())', '(1', '1)', ')(',
    '(1)(', '((1)', '[1]', '{1}', '[g]', 'g[0]', 'g["a"]', '{}', '{0}', '{g}', '{0!r}',
    '{0.__class__}', '{:>1000000}', '%s', '%d', '%n', '%(g)s', '%1000000d', 'f"{g}"', "f'{g}'",
    "'1'", '"1"', "b'1'", "r'1'", "'''1'''", '"', "'", '"""', 'lambda:0', 'lambda',
    '(lambda:0)()', 'yield', '(yield)', 'await', 'None', 'True', 'False', '...', 'Ellipsis',
    'not', 'not(g)', '1if(1)else(2)', '1or(2)', '1and(2)', 'g(m)', '[g]for', '*g', '**g',
    '__import__("os")', '__import__("os").system("true")', '1is(1)', '0is(0)', '1in(1)',
    '"a"is(1)', "'\\d'", '1.e', 'E', '1E5E5', '1e5.5', '1e1e1', '1e1000000', '1e-1000000',
    '1e9999999999999999', '0e', '0.0.0', '-.', '.e1', '-e', '1-', '-(-', '(-)', '(+)', '(,)',
    '(g,m)', 'g,m', '(g,)')

STRANGE = (
    '\0', 'g\0', '\0g', '\x01', '\x07', '\x08', '\x1b[31m', '\x1b]0;x\x07', '\x7f', '\x80',
    '\x9b', '\xa0', '\xad', '\u061c', '\u200b', '\u200d', '\u200e', '\u200f', '\u2028', '\u2029',
    '\u202a', '\u202e', '\u202eg', '\u2060', '\u2066', '\ufeff', '\ufeffg', '\ufffd', '\uffff',
    '\ud800', '\udfff', '\U0010ffff', '\U000e0001', '\uff47', '\uff11', '\uff11\uff0b\uff12',
    '\uff08g\uff09', '\u0661', '\u0967', '\xb2', 'g\xb2', '\xbd', '\u2153', '\u2160', '\u3007',
    '\u221e', '\u03c0', '\u03c0/2', '\u221a2', '\u221a(2)', '30\xb0', '\u221230', '\u20131',
    '\u20141', '2\xd73', '2\u22c53', '4\xf72', '1\u20442', '\u2044', '\u01c5', '\ufb01', '\u017f',
    'm\u0430x(1,2)', '\u0430', '\u0394', '\xe4', 'a\u0308', '\u4e2d', '\u05d0', '\u0627',
    '\U0001d465', '\U0001f600', '\U0001f468\u200d\U0001f469\u200d\U0001f467',
    '\U0001f1e9\U0001f1ea', '\u2705', 'Z\u0351\u036b' * 9)

WORDS = (
    '', ' ', '\t', '\n', '\r', '\r\n', '\x0b', '\x0c', 'ground', 'crank', 'dyad', 'left', 'right',
    'up', 'None', 'null', '~', 'yes', 'no', 'on', 'off', 'true', 'false',
    '!!python/object:os.system', '!!int 1', '&a *a', '*a', '&a', '- a', '- - a', '? a', ': a',
    'a: b', 'a: [b', '[a, b]', '{a: b}', '| a', '> a', '---', '...', '%YAML 1.2', '@a', '# a',
    '<<: *a', '<a>', '</a>', '&amp;', '&lt;', '<!-- a -->', '<![CDATA[a]]>',
    '<script>alert(1)</script>', "'; DROP TABLE joints; --", '../../etc/passwd', '/dev/null', '/',
    '//', '\\', '\\\\', 'C:\\a', 'file:///a', 'http://a', '~/a', '$HOME', '$(true)', '`true`',
    '| true', '; true', '&& true', '--help', '-h', '--ros-args', '-p', 'a b', ' a', 'a ', 'a.b',
    'a.x', 'a.x.y', '.x', 'x.', 'a.', 'A.', 'A.z', 'A.X', 'B.x.', '.', 'A..x', 'A.x ', ' A.x',
    'A,x', 'A:x', 'A/x', 'a/b', 'a-b', 'a:b', 'a+b', '1a', '9', '_', '__', '_a', '__init__',
    '__class__', '__dict__', 'self', 'class', 'def', 'import', 'type_', 'joints', 'tracer',
    'branches', 'deg', 'pi', 'max', 'sqrt', 'dimension', 'constant', '[m]', 'x', 'y', 'X', 'A',
    'a', 'o', 'Crank', 'crank1', 'crank2', 'lever', 'slide', 'block', 'world', 'OA', 'QB',
    'custom', 'jansen', 'Jansen', 'JANSEN', ' jansen', 'jansen ', 'jansen\n', 'jansen\0',
    'four-bar', 'four bar', 'water_drop.', 'A\nB', 'A\n', '\nA', 'A\t', 'A\0B', 'a' * 64,
    'a' * 65, 'a' * 255, 'a' * 256, 'a' * 300, 'a_' * 200, 'A' * 1000)


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
