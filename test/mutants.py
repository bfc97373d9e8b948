# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Put random bugs into a room of the package; list those that the tests of `make test` let pass.

Cosmic Ray makes the bugs, and a few operators below make those that it lacks. They change no
docstring, no annotation and no text but single words, which are keys and names. A line is chosen
first and then one bug in it, so that no line counts more than another.

The tests run in copies of the checkout: for a bug those files that execute its line, the fastest
first. For what runs when a module is imported, or never as far as coverage.py can see, all files
run that call any function of the module. What each file executes is measured when it has changed.
"""

import argparse
import ast
from collections import Counter, defaultdict
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
import difflib
from glob import glob
import hashlib
from itertools import islice
import json
import math
import os
from pathlib import Path
from queue import SimpleQueue
import random
import re
import shutil
import signal
import subprocess
import sys
import time
import warnings

from coverage import CoverageData

sys.path.extend(glob('.venv-mutants/lib/python*/site-packages'))

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.operator import Operator
from cosmic_ray.operators.provider import OperatorProvider
from parso.python.tree import Name
from pytest import ExitCode

ROOT = Path(__file__).parents[1]
PACKAGE = 'linkage_ros'
WORKERS = 2
# Of a run of the tests [byte]: a bug may ask for all memory.
MEMORY = 12 << 30
# What the start of the tests takes at most [s of the processor], how much slower than measured
# they may be, and how much longer all of it may take where the machine has more to do.
START, SLOWER, BUSY = 20.0, 4.0, 4.0
CHOSEN = re.compile(
    '.*_(Add_Sub|Sub_Add|Mul_Div|Div_Mul|Mul_Add|FloorDiv_Div|Mod_FloorDiv|Pow_Mul|BitAnd_BitOr'
    '|BitOr_BitAnd|Lt_LtE|LtE_Lt|Gt_GtE|GtE_Gt|Lt_Gt|Gt_Lt|LtE_GtE|GtE_LtE|Eq_NotEq|NotEq_Eq'
    '|Is_IsNot|IsNot_Is|Delete_USub|Delete_Not|Delete_Invert)'
    '|AddNot|ZeroIteration.*|Replace[TFAOBC][a-z]+With.*|ExceptionReplacer|NumberReplacer')
CONFIGURATION = """
[run]
source = linkage_ros
patch = subprocess, _exit
core = ctrace
relative_files = true
disable_warnings = no-data-collected, module-not-imported
"""


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


def code(source):
    """Return what a source computes: annotations are not."""
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        tree = ast.parse(source)
    for node in ast.walk(tree):
        for name in {'annotation', 'returns'} & {*node._fields}:
            setattr(node, name, None)
    return ast.dump(tree)


def bug(module, operator, occurrence):
    """Return what an operator changes in a module, or None if that is nothing."""
    source = (ROOT / module).read_text()
    try:
        changed = mutate_code(source, operator, occurrence)
        if code(changed) == code(source):
            return None
    # Cosmic Ray replaces no exception with a dotted name.
    except (AttributeError, SyntaxError):
        return None
    before, after = source.splitlines(), changed.splitlines()
    codes = [each for each in difflib.SequenceMatcher(None, before, after, False).get_opcodes()
             if each[0] != 'equal']
    (_, a, _, c, _), (_, _, b, _, d) = codes[0], codes[-1]
    return {'file': module, 'line': a + 1, 'operator': type(operator).__name__,
            'before': before[a:b], 'after': after[c:d]}


def sample(room, count, seed):
    """Return random bugs, one on a line."""
    folder, lines, chance = ROOT / PACKAGE, defaultdict(list), random.Random(f'{room} {seed}')
    for path in sorted(folder.glob('*.py') if room == 'top' else (folder / room).rglob('*.py')):
        nodes = [*ast_nodes(get_ast(path.read_text()))]
        for operator in operators():
            positions = (start for node in nodes for start, _ in operator.mutation_positions(node))
            for i, (line, _) in enumerate(positions):
                lines[str(path.relative_to(ROOT)), line].append((operator, i))
    order = sorted(lines)
    chance.shuffle(order)
    bugs = (bug(module, *chance.choice(lines[module, line])) for module, line in order)
    return [*islice(filter(None, bugs), count)]


def run(copy, *arguments, seconds=None, **environment):
    """Run tests in a copy; return the exit code, below 0 if they have no end, and the output."""
    limits = ['prlimit', f'--as={MEMORY}', f'--cpu={round(seconds)}'] if seconds else []
    with open(copy / 'output.txt', 'w+', encoding='utf-8', errors='replace') as output:
        process = subprocess.Popen(
            [*limits, sys.executable, '-m', 'pytest', '-m', 'not nightly', *arguments], cwd=copy,
            stdout=output, stderr=output, start_new_session=True,
            env={**os.environ, **environment,
                 'PYTHONPATH': os.pathsep.join([str(copy), os.environ.get('PYTHONPATH', '')])})
        try:
            status = process.wait(BUSY * seconds if seconds else None)
        except subprocess.TimeoutExpired:
            status = -signal.SIGALRM
        # And all that it has started.
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        output.seek(0)
        return status, output.read()


def measured(copy, file):
    """Return how long the tests of a file take [s], and the lines of modules that they execute."""
    start, data = time.monotonic(), copy / 'coverage' / Path(file).stem
    status, output = run(copy, file, '-q', '--cov', '--cov-config=coverage.ini', '--cov-report=',
                         COVERAGE_FILE=str(data))
    if status:
        # Of a file with nightly tests alone none is collected.
        if status != ExitCode.NO_TESTS_COLLECTED:
            print(f'{file} is left out: it fails without a bug.\n{output[-500:]}', flush=True)
        return math.inf, {}
    database = CoverageData(str(data))
    database.read()
    return time.monotonic() - start, {
        module: database.lines(module) for module in database.measured_files()}


def prepare(folder):
    """Renew the copies; return what each file of tests executes, measured where it has changed."""
    names = subprocess.run(['git', 'ls-files', '-z'], cwd=ROOT, check=True, stdout=subprocess.PIPE,
                           text=True).stdout.split('\0')
    paths = [name for name in names if (ROOT / name).is_file()]
    copies = [folder / f'copy{number}' for number in range(WORKERS)]
    for copy in copies:
        for path in paths:
            (copy / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / path, copy / path)
        (copy / 'coverage.ini').write_text(CONFIGURATION)
        (copy / 'coverage').mkdir(exist_ok=True)
    common = hashlib.sha256()
    for path in paths:
        if re.match(rf'{PACKAGE}/|test/(?!test_|mutants|equivalent)', path):
            common.update(path.encode() + (ROOT / path).read_bytes())
    states = {file: hashlib.sha256(common.digest() + (ROOT / file).read_bytes()).hexdigest()
              for file in paths if re.fullmatch(r'test/test_\w+\.py', file)}
    stored = folder / 'measured.json'
    known = json.loads(stored.read_text()) if stored.exists() else {}
    known = {file: known[file] for file in states if known.get(file, [None])[0] == states[file]}
    missing = [file for file in states if file not in known]
    if missing:
        print(f'Measuring what the tests of {len(missing)} files execute.', flush=True)
    for file, found in zip(missing, in_copies(copies, measured, missing)):
        known[file] = [states[file], *found]
        stored.write_text(json.dumps(known))
    return copies, {file: found[1:] for file, found in known.items() if found[1] < math.inf}


def in_copies(copies, work, jobs):
    """Yield the results of jobs, each done in one of the copies, in their order."""
    free = SimpleQueue()
    for copy in copies:
        free.put(copy)

    def do(job):
        copy = free.get()
        try:
            return work(copy, job)
        finally:
            free.put(copy)

    with ThreadPoolExecutor(len(copies)) as workers:
        yield from workers.map(do, jobs)


def tests(mutant, measurement):
    """Return the files of tests that execute a bug, and those that call its module otherwise."""
    statements, functions = set(), set()
    first, last = mutant['line'], mutant['line'] + max(len(mutant['before']), 1) - 1
    for node in ast.walk(ast.parse((ROOT / mutant['file']).read_text())):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            functions.update(range(node.body[0].lineno, node.end_lineno + 1))
        if isinstance(node, ast.stmt) and node.lineno <= first <= node.end_lineno:
            statements = {*range(node.lineno, last + 1)}
    for lines in (statements & functions, functions):
        files = [file for file, (_, executed) in measurement.items()
                 if lines & {*executed.get(mutant['file'], ())}]
        if files:
            break
    return sorted(files or measurement, key=lambda file: measurement[file][0])


def tested(copy, job):
    """Return a bug with what the tests say to it."""
    mutant, files, seconds = job
    path = copy / mutant['file']
    source = path.read_text()
    lines = source.splitlines()
    lines[mutant['line'] - 1:mutant['line'] - 1 + len(mutant['before'])] = mutant['after']
    path.write_text('\n'.join(lines) + '\n')
    try:
        # What is compiled now is of no use later.
        status, output = run(copy, *files, *'-x -q -p no:cacheprovider -p no:cov --tb=no'.split(),
                             seconds=START + SLOWER * seconds, PYTHONDONTWRITEBYTECODE='1')
    finally:
        path.write_text(source)
    state = 'hung or crashed' if status < 0 else 'killed' if status else 'survived'
    killers = re.findall('^(?:FAILED|ERROR) (.*)$', output, re.M)
    return {**mutant, 'state': state, 'tests': len(files), 'by': killers or output[-200:]}


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
    equivalent = {*map(key, (ROOT / 'test' / 'equivalent_mutants.txt').read_text().split('\n\n'))}
    copies, measurement = prepare(options.out.absolute() / 'work')
    for room in options.room.split():
        chosen = [*filter(None, (
            placed(mutant) for mutant in json.loads(options.again.read_text())
            if mutant['state'] == 'survived'))] if options.again else sample(
                room, options.count, options.seed)
        mutants = [mutant for mutant in chosen if key(diff(mutant)) not in equivalent]
        jobs = []
        for mutant in mutants:
            files = tests(mutant, measurement)
            jobs.append((mutant, files, sum(measurement[file][0] for file in files)))
        results, out = [], options.out / (
            room.replace('/', '-') + '-again' * bool(options.again) + '.json')
        for result in in_copies(copies, tested, jobs):
            results.append(result)
            out.write_text(json.dumps(results, indent=1))
            if result['state'] == 'survived':
                print(f'\n{diff(result)}\n# {result["tests"]} files of tests', flush=True)
        states = Counter(mutant['state'] for mutant in results)
        states['equivalent'] = len(chosen) - len(mutants)
        caught = states['killed'] + states['hung or crashed']
        print(f'\n{room}: ' + ', '.join(f'{count} {state}' for state, count in states.items())
              + f'; {100.0 * caught / max(caught + states["survived"], 1):.0f} % found: {out}\n')


if __name__ == '__main__':
    main()
