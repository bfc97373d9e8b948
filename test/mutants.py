# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Put random bugs into a room of the package; list those that the tests of `make test` let pass.

Cosmic Ray makes the bugs, and a few operators below make those that it lacks. They change no
docstring, no annotation and no text but single words, which are keys and names. A line is chosen
first and then one bug in it, so that no line counts more than another.

The tests run in copies of the checkout. For a bug only those files of tests run that execute its
line; their tests that do so come first. What is executed when a module is imported, and what no
test executes as far as coverage.py can see, is tested by all files that execute any function of
the module. Which test executes what is measured once for a state of the checkout.
"""

import argparse
import ast
from collections import Counter, defaultdict
import difflib
from glob import glob
import hashlib
from itertools import chain
import json
import multiprocessing
import os
from pathlib import Path
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
import warnings

from coverage import CoverageData
import hypothesis  # noqa: F401, what the processes of the tests have imported when they start
import pytest
import rclpy.node  # noqa: F401

sys.path.extend(glob('.venv-mutants/lib/python*/site-packages'))

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.operator import Operator
from cosmic_ray.operators.provider import OperatorProvider
from parso.python.tree import Name

ROOT = Path(__file__).parents[1]
PACKAGE = 'linkage_ros'
SIGNATURES = ('parameters', 'lambdef')
WORKERS = 2
# Of a worker [byte]: a bug may ask for all memory.
MEMORY = 12 << 30
# What the start of the tests takes at most [s of the processor], and how much slower than measured
# they may be; how much longer all of it may take where the machine has more to do.
START, SLOWER, BUSY = 20.0, 4.0, 4.0
CHOSEN = re.compile(
    '.*_(Add_Sub|Sub_Add|Mul_Div|Div_Mul|Mul_Add|FloorDiv_Div|Mod_FloorDiv|Pow_Mul|BitAnd_BitOr'
    '|BitOr_BitAnd|Lt_LtE|LtE_Lt|Gt_GtE|GtE_Gt|Lt_Gt|Gt_Lt|LtE_GtE|GtE_LtE|Eq_NotEq|NotEq_Eq'
    '|Is_IsNot|IsNot_Is|Delete_USub|Delete_Not|Delete_Invert)'
    '|AddNot|ZeroIteration.*|Replace[TFAOBC][a-z]+With.*|ExceptionReplacer|NumberReplacer')


class Own(Operator):
    """An operator with at most one bug at a node: `mutate` makes it where the node `fits`."""

    def mutation_positions(self, node):
        if self.fits(node):
            yield node.start_pos, node.end_pos

    @classmethod
    def examples(cls):
        return ()


class RemoveStatement(Own):
    """A call, a raise, or an assignment to what is there already, is forgotten."""

    def fits(self, node):
        if node.type != 'simple_stmt':
            return False
        first, last = node.children[0], node.children[0].get_last_leaf()
        if first.type == 'expr_stmt':
            target, sign = first.children[:2]
            return sign.type == 'operator' and (sign != '=' or target.type != 'name')
        return first.type in ('raise_stmt', 'del_stmt') or (
            first.type in ('atom_expr', 'power') and last == ')')

    def mutate(self, node, index):
        node.children[0] = Name('pass', node.start_pos, node.get_first_leaf().prefix)
        return node


class RemoveKeyword(Own):
    """A keyword argument is forgotten."""

    def fits(self, node):
        return node.type == 'argument' and node.children[1] == '='

    def mutate(self, node, index):
        after = node.get_next_sibling()
        if after == ',':
            node.parent.children.remove(after)


class ReturnNothing(Own):
    """A function returns None."""

    def fits(self, node):
        return node.type == 'return_stmt' and len(node.children) == 2

    def mutate(self, node, index):
        node.children[1] = Name('None', node.start_pos, ' ')
        return node


class Confuse(Own):
    """A name or a word is taken for another, or written wrong."""

    PAIRS = ('min max', 'minimum maximum', 'nanmin nanmax', 'argmin argmax', 'any all', 'sin cos',
             'ceil floor', 'append extend', 'lower upper', 'isfinite isnan', 'left right')
    OTHER = {pair.split()[i]: pair.split()[1 - i] for pair in PAIRS for i in (0, 1)}

    def fits(self, node):
        return (node.type == 'name' and node.value in self.OTHER and node.parent.type in (
            'trailer', 'atom_expr') or node.type == 'string'
            and re.fullmatch(r"'[\w/.-]+'", node.value))

    def mutate(self, node, index):
        node.value = self.OTHER.get(node.value) or f"{node.value[:-1]}_'"
        return node


class SwapArguments(Own):
    """The first two arguments, if they are of one kind, are swapped."""

    def fits(self, node):
        if node.type != 'arglist' or node.parent.type != 'trailer':
            return False
        one, other = node.children[:3:2]
        return one.type == other.type != 'argument'

    def mutate(self, node, index):
        node.children[:3:2] = node.children[2::-2]
        return node


def operators():
    """Return those that make bugs as people make them."""
    provided = OperatorProvider()
    return [provided[name]() for name in provided if CHOSEN.fullmatch(name)] + [
        own() for own in Own.__subclasses__()]


def changes(before, after):
    """Return line, removed and added lines of a change, or None if it is not one of code."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')
            if ast.dump(ast.parse(after)) == ast.dump(ast.parse(before)):
                return None
    except SyntaxError:
        return None
    before, after = before.splitlines(), after.splitlines()
    codes = [code for code in difflib.SequenceMatcher(None, before, after, False).get_opcodes()
             if code[0] != 'equal']
    (_, a, _, c, _), (_, _, b, _, d) = codes[0], codes[-1]
    return a + 1, before[a:b], after[c:d]


def candidates(module):
    """Return the bugs that a module can have, as (line, operator, occurrence)."""
    source = (ROOT / module).read_text()
    # Annotations are not computed.
    no_code = [(node.lineno, node.col_offset, node.end_lineno, node.end_col_offset)
               for owner in ast.walk(ast.parse(source))
               for node in (getattr(owner, 'annotation', None), getattr(owner, 'returns', None))
               if node]
    nodes = list(ast_nodes(get_ast(source)))
    found = []
    for operator in operators():
        positions = [(node, start) for node in nodes
                     for start, _ in operator.mutation_positions(node)]
        found += [(start[0], operator, i) for i, (node, start) in enumerate(positions)
                  # Nor is the asterisk of a signature.
                  if not (node.type == 'operator' and node.parent.type in SIGNATURES)
                  and not any(n[:2] <= start < n[2:] for n in no_code)]
    return found


def sample(room, count, seed):
    """Return random bugs, one on a line."""
    folder = ROOT / PACKAGE
    modules = sorted(str(path.relative_to(ROOT)) for path in (
        folder.glob('*.py') if room == 'top' else (folder / room).rglob('*.py')))
    lines = defaultdict(list)
    for module in modules:
        for line, operator, occurrence in candidates(module):
            lines[module, line].append((operator, occurrence))
    chance = random.Random(f'{room} {seed}')
    order = sorted(lines)
    chance.shuffle(order)
    for module, line in order:
        operator, occurrence = chance.choice(lines[module, line])
        source = (ROOT / module).read_text()
        try:
            changed = changes(source, mutate_code(source, operator, occurrence))
        except AttributeError:
            # Cosmic Ray replaces no exception with a dotted name.
            continue
        if changed and count:
            count -= 1
            first, before, after = changed
            yield {'file': module, 'line': first, 'operator': type(operator).__name__,
                   'before': before, 'after': after}


def start(folder):
    """Make a worker of this process, in a copy of the checkout of its own."""
    number = int(multiprocessing.current_process().name.rpartition('-')[2])
    here = folder / f'copy{number % WORKERS}'
    os.chdir(here)
    sys.path[:1] = [str(here), str(here / 'test')]
    os.environ['PYTHONPATH'] = os.pathsep.join([str(here), os.environ.get('PYTHONPATH', '')])
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def pool(folder):
    """Return the workers."""
    return multiprocessing.get_context('fork').Pool(WORKERS, start, (folder,))


def measured(test_file):
    """Return what the tests of a file take [s], and which of them executes which lines."""
    data = Path('coverage') / Path(test_file).stem
    environment = {**os.environ, 'COVERAGE_FILE': str(data.absolute())}
    output = subprocess.run(
        [sys.executable, '-m', 'pytest', test_file, '-m', 'not nightly', '--cov',
         '--cov-context=test', '--cov-config=coverage.ini', '--cov-report=', '--durations=0',
         '-vv', '-rfE'],
        env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True).stdout
    tests = defaultdict(float)
    for seconds, name in re.findall(r'^([\d.]+)s (?:setup|call|teardown) +(.*)$', output, re.M):
        tests[name] += float(seconds)
    for failed in re.findall(r'^(?:FAILED|ERROR) (.*?)(?: - .*)?$', output, re.M):
        print(f'fails without a bug, and is left out: {failed}', flush=True)
        tests.pop(failed, None)
    database = CoverageData(str(data))
    database.read()
    # What has no test's name runs in a process, in a fixture, or when tests are collected.
    number = {'': -1, **{name: i for i, name in enumerate(tests)}}
    return dict(tests), {module: {line: sorted({
        number[name] for name in (context.rpartition('|')[0] for context in contexts)
        if name in number}) for line, contexts in database.contexts_by_lineno(module).items()}
        for module in database.measured_files()}


CONFIGURATION = """
[run]
source = linkage_ros
patch = subprocess, _exit
core = ctrace
relative_files = true
disable_warnings = no-data-collected, module-not-imported
"""


def prepare(folder):
    """Renew the copies; return what each file of tests executes, measured where it has changed."""
    names = subprocess.run(['git', 'ls-files', '-z'], cwd=ROOT, check=True, stdout=subprocess.PIPE,
                           text=True).stdout.split('\0')
    paths = [name for name in names if (ROOT / name).is_file()]
    files = [path for path in paths if re.fullmatch(r'test/test_\w+\.py', path)]
    for number in range(WORKERS):
        for path in paths:
            copy = folder / f'copy{number}' / path
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / path, copy)
        (folder / f'copy{number}' / 'coverage.ini').write_text(CONFIGURATION)
        (folder / f'copy{number}' / 'coverage').mkdir(exist_ok=True)
    common = hashlib.sha256()
    for path in paths:
        if re.match(rf'{PACKAGE}/|test/(?!test_|mutants|equivalent)', path):
            common.update(path.encode() + (ROOT / path).read_bytes())
    states = {file: hashlib.sha256(common.digest() + (ROOT / file).read_bytes()).hexdigest()
              for file in files}
    stored = folder / 'measured.json'
    known = json.loads(stored.read_text()) if stored.exists() else {}
    missing = [file for file in files if known.get(file, [None])[0] != states[file]]
    if missing:
        print(f'Measuring what the tests of {len(missing)} files execute.', flush=True)
    with pool(folder) as workers:
        for file, found in zip(missing, workers.imap(measured, missing)):
            known[file] = [states[file], *found]
            stored.write_text(json.dumps(known))
    known = json.loads(stored.read_text())
    return {file: known[file][1:] for file in files}


def statement(mutant):
    """Return the lines whose execution executes a bug; none where an import does."""
    last = mutant['line'] + max(len(mutant['before']), 1) - 1
    inner, in_function = None, False
    for node in ast.walk(ast.parse((ROOT / mutant['file']).read_text())):
        if isinstance(node, ast.stmt) and node.lineno <= mutant['line'] <= node.end_lineno:
            inner = node
            if (isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
                    and mutant['line'] >= node.body[0].lineno):
                in_function = True
    return [str(line) for line in range(inner.lineno, last + 1)] if inner and in_function else []


def functions(module):
    """Return the lines of a module that run when its functions are called."""
    return {str(line) for node in ast.walk(ast.parse((ROOT / module).read_text()))
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
            for line in range(node.body[0].lineno, node.end_lineno + 1)}


def batches(mutant, measurement):
    """Yield the tests that may find a bug, in three batches; the most promising come first."""
    wanted = statement(mutant)
    for where in (wanted, functions(mutant['file']), None):
        ranked = []
        for tests, lines in measurement.values():
            found = lines.get(mutant['file'], {})
            names = [*tests]
            hits = {test for line in (found if where is None else where)
                    for test in found.get(line, ())}
            covering = {names[test] for test in hits if test >= 0}
            first = sorted(tests if -1 in hits else covering,
                           key=lambda test: (test not in covering, tests[test]))
            if first:
                cost = sum(map(tests.get, first))
                ranked.append((len(first) / (1.0 + cost), first, [*tests.keys() - {*first}]))
        if ranked:
            break
    ranked.sort(key=lambda rank: -rank[0])
    duration = {name: time for tests, _ in measurement.values() for name, time in tests.items()}
    covering, rest = ([rank[i] for rank in ranked] for i in (1, 2))
    for part in (covering[:1], covering[1:4], covering[4:] + rest):
        if batch := [*chain(*part)]:
            yield batch, round(START + SLOWER * sum(map(duration.get, batch)))


def passed(arguments, limit):
    """Return whether tests pass, None if they have no end, and what they print."""
    process = os.fork()
    if not process:
        os.setsid()
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
        output = os.open('output.txt', os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(output, 1)
        os.dup2(output, 2)
        # What is compiled now is of no use later.
        sys.dont_write_bytecode, os.environ['PYTHONDONTWRITEBYTECODE'] = True, '1'
        code = pytest.main(arguments)
        sys.stdout.flush()
        os._exit(code)
    deadline, ended = time.monotonic() + BUSY * limit, 0
    while not ended and time.monotonic() < deadline:
        time.sleep(0.02)
        ended, status = os.waitpid(process, os.WNOHANG)
    # And all that it has started.
    try:
        os.killpg(process, signal.SIGKILL)
    except ProcessLookupError:
        pass
    if not ended:
        os.waitpid(process, 0)
    crashed = not ended or os.WIFSIGNALED(status)
    return None if crashed else not status, Path('output.txt').read_text(errors='replace')


def tested(job):
    """Return a bug with what the tests say to it."""
    mutant, tests = job
    path = Path(mutant['file'])
    source, times = path.read_text(), path.stat()
    lines = source.splitlines()
    lines[mutant['line'] - 1:mutant['line'] - 1 + len(mutant['before'])] = mutant['after']
    path.write_text('\n'.join(lines) + '\n')
    mutant = {**mutant, 'state': 'survived', 'tests': 0}
    options = '-x -q --no-header -p no:cacheprovider -p no:cov --tb=no -rfE'.split()
    try:
        for names, limit in tests:
            Path('tests.txt').write_text('\n'.join(names))
            mutant['tests'] += len(names)
            found, output = passed([*options, '@tests.txt'], limit)
            if 'ERROR: not found' in output:
                # The bug has changed the names of tests.
                files = {name.partition('::')[0] for name in names}
                found, output = passed([*options, '-m', 'not nightly', *files], limit)
            if not found:
                killer = re.search('^(?:FAILED|ERROR) (.*)$', output, re.M)
                mutant['state'] = 'hung or crashed' if found is None else 'killed'
                mutant['by'] = killer.group(1)[:200] if killer else output[-200:]
                break
    finally:
        path.write_text(source)
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    return mutant


def placed(mutant):
    """Return an earlier bug where its lines are now, None if they are gone."""
    lines, before = (ROOT / mutant['file']).read_text().splitlines(), mutant['before']
    places = [i + 1 for i in range(len(lines)) if lines[i:i + len(before)] == before]
    return places and {**mutant, 'line': min(places, key=lambda i: abs(i - mutant['line']))}


def diff(mutant):
    """Return a bug as people read it."""
    lines = [*(f'-{line}' for line in mutant['before']), *(f'+{line}' for line in mutant['after'])]
    return '\n'.join([f'{mutant["file"]}:{mutant["line"]}', *lines])


def key(text):
    """Return which bug a diff is, wherever its lines are now."""
    file, *lines = text.splitlines()
    return file.partition(':')[0], *(f'{line[0]}{line[1:].strip()}' for line in lines
                                     if line[0] in '+-')


def main():
    """Test the bugs of a room, and list what survives."""
    parser = argparse.ArgumentParser(description=__doc__.strip().partition('\n')[0])
    parser.add_argument('--room', required=True, help="a folder of the package, 'top', or several")
    parser.add_argument('--count', type=int, default=40, help='how many bugs')
    parser.add_argument('--seed', default='1', help='another chooses others')
    parser.add_argument('--again', type=Path, help='a file of an earlier run: its survivors only')
    parser.add_argument('--out', type=Path, required=True, help='the folder of the results')
    options = parser.parse_args()
    equivalent = {key(block) for block in
                  (ROOT / 'test' / 'equivalent_mutants.txt').read_text().split('\n\n')}
    folder = options.out.absolute() / 'work'
    measurement = prepare(folder)
    for room in options.room.split():
        chosen = [*filter(None, (
            placed(mutant) for mutant in json.loads(options.again.read_text())
            if mutant['state'] == 'survived'))] if options.again else [
                *sample(room, options.count, options.seed)]
        mutants = [mutant for mutant in chosen if key(diff(mutant)) not in equivalent]
        jobs = ((mutant, [*batches(mutant, measurement)]) for mutant in mutants)
        results = []
        out = options.out / f'{room}-again.json' if options.again else options.out / f'{room}.json'
        with pool(folder) as workers:
            for result in workers.imap_unordered(tested, jobs):
                results.append(result)
                out.write_text(json.dumps(results, indent=1))
                if result['state'] == 'survived':
                    print(f'\n{diff(result)}\n# {result["tests"]} tests', flush=True)
        states = Counter(mutant['state'] for mutant in results)
        states['equivalent'] = len(chosen) - len(mutants)
        caught = states['killed'] + states['hung or crashed']
        print(f'\n{room}: ' + ', '.join(f'{count} {state}' for state, count in states.items())
              + f'; {100.0 * caught / max(caught + states["survived"], 1):.0f} % found: {out}\n')


if __name__ == '__main__':
    main()
