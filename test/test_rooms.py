# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The rooms of the package stand on each other in one order; ls shows which of them need ROS."""

import ast
from functools import cache
from pathlib import Path
import re
import sys
from xml.etree import ElementTree

from linkage_ros import optional
import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / 'linkage_ros'
# From the ground up: a module imports from its own room and from those below.
ROOMS = ('words', 'optional', 'palette', 'cache', 'formula', 'linkage', 'mechanisms', 'scene',
         'command', 'c_code', 'robot_model', 'robot_files', 'render', 'nodes', 'web',
         'executables')
# The floors of the core, in the same order.
FLOORS = ('tolerances', 'inputs', 'geometry', 'text', 'formulas', 'kinematics', 'statics',
          'motion', 'dyads', 'inverse', 'mechanism', '__init__')
CORE = PACKAGE / 'linkage'
WITH_ROS = ('nodes', 'web')
ROS = ('rclpy', 'builtin_interfaces', 'geometry_msgs', 'rcl_interfaces', 'sensor_msgs', 'std_msgs',
       'trajectory_msgs', 'visualization_msgs', 'linkage_interfaces')
MODULES = sorted(PACKAGE.rglob('*.py'))
PAGE = PACKAGE / 'web' / 'page'
OUTSIDE = sorted([*(ROOT / 'test').rglob('*.py'), *(ROOT / 'benchmark').rglob('*.py')])
# Public for all their underscores.
PUBLIC = ('_replace', '_asdict', '_fields', '_make', '_exit')


@cache
def parsed(module):
    """Return the syntax tree of a module."""
    return ast.parse(module.read_text())


@cache
def words(module):
    """Return all words of a module."""
    return set(re.findall(r'\w+', module.read_text()))


def room(module):
    """Return the room that a module is in, '' for the package itself."""
    first = module.relative_to(PACKAGE).with_suffix('').parts[0]
    return '' if first == '__init__' else first


def imported(module):
    """Yield what a module imports, at once or later, as full names."""
    here = ('linkage_ros', *module.relative_to(PACKAGE).parent.parts)
    for node in ast.walk(parsed(module)):
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            yield from named(node, here)


def named(node, here):
    """Yield the full names in an import of a module in the package `here`."""
    base = ()
    if isinstance(node, ast.ImportFrom):
        base = here[:len(here) - node.level + 1] if node.level else ()
        base += tuple((node.module or '').split('.')) if node.module else ()
    yield from ('.'.join((*base, alias.name)) for alias in node.names)


def test_every_module_has_its_room():
    assert {room(module) for module in MODULES} == {'', *ROOMS}


def test_a_module_imports_nothing_from_above():
    for module in MODULES:
        own = room(module)
        for name in imported(module):
            top, *below = name.split('.')
            if top == 'linkage_ros' and own:
                assert ROOMS.index(below[0]) <= ROOMS.index(own), f'{module.name} imports {name}'
            assert own in WITH_ROS or top not in ROS, f'{module.name} needs ROS: {name}'


def test_other_rooms_import_the_core_by_its_public_names():
    public = ast.literal_eval(next(node.value for node in parsed(CORE / '__init__.py').body
                                   if ast.unparse(node).startswith('__all__')))
    for module in MODULES:
        for name in imported(module) if room(module) != 'linkage' else ():
            core, _, below = name.partition('linkage_ros.linkage.')
            assert core or below in public, f'{module.name} imports {name}'


@pytest.mark.parametrize('room_', ['linkage', 'linkage.inverse', 'scene', 'render'])
def test_there_are_all_names_that_a_room_makes_public(room_):
    exec(f'from linkage_ros.{room_} import *')


def test_the_floors_of_the_core_stand_on_each_other():
    modules = [module for module in MODULES if CORE in module.parents]
    used = {module: {next(filter(modules.__contains__, map(file_of, (
        name, name.rpartition('.')[0]))), None) for name in imported(module)} - {None}
        for module in modules}
    floor = {module: FLOORS.index(module.relative_to(CORE).with_suffix('').parts[0])
             for module in modules}
    for module, others in used.items():
        for other in others:
            assert floor[other] <= floor[module], f'{module} imports {other}'
    # Take away those that import no other, until none is left: imports for types count too.
    while ground := [module for module, others in used.items() if not others & {*used}]:
        used = {module: used[module] for module in used if module not in ground}
    assert not used, f'in a circle, or above one: {[module.name for module in used]}'


def file_of(name):
    """Return the file of a module of a full name, whether it exists or not."""
    path = ROOT.joinpath(*name.split('.'))
    return path / '__init__.py' if path.is_dir() else path.with_suffix('.py')


def unguarded(module):
    """Yield what a module imports outside `needs`, at once or later, as full names."""
    guarded = {id(each) for node in ast.walk(parsed(module)) if isinstance(node, ast.With)
               and ast.unparse(node.items[0].context_expr).startswith('needs(')
               for each in ast.walk(node)}
    here = ('linkage_ros', *module.relative_to(PACKAGE).parent.parts)
    for node in ast.walk(parsed(module)):
        if id(node) not in guarded and isinstance(node, (ast.Import, ast.ImportFrom)):
            yield from named(node, here)


def test_whoever_starts_without_an_optional_package_imports_it_inside_needs():
    imports = {'.'.join(('linkage_ros', *module.relative_to(PACKAGE).with_suffix('').parts)): [
        *unguarded(module)] for module in MODULES}
    # Those that cannot be imported without one, and those that import them.
    without, before = set(optional.INSTALL), None
    while without != before:
        before = set(without)
        without |= {name for name, others in imports.items() for other in others
                    if {other, other.rpartition('.')[0], other.partition('.')[0]} & without}
    assert {name.rpartition('.')[2] for name in without - {*optional.INSTALL}} == {
        'llvm_code', 'mjcf', 'files', 'layers',
        'picture', 'server'}


def test_every_foreign_package_is_declared():
    manifest = ElementTree.parse(ROOT / 'package.xml').getroot()
    declared = {one.text.removeprefix('python3-') for one in manifest.iter('exec_depend')}
    for module in MODULES:
        tops = {name.partition('.')[0] for name in imported(module)}
        foreign = tops - {'linkage_ros', '__future__'} - sys.stdlib_module_names
        assert foreign <= declared | {*optional.INSTALL}, module


def test_who_tests_or_measures_uses_what_everybody_may():
    for module in OUTSIDE:
        if not re.search(r'(?<!self)\._[a-z]', module.read_text()):
            continue
        for node in ast.walk(parsed(module)):
            if isinstance(node, ast.Attribute) and node.attr not in PUBLIC:
                private = node.attr.startswith('_') and not node.attr.endswith('__')
                assert not private or ast.unparse(node.value) == 'self', f'{module}:{node.lineno}'


def test_a_module_begins_with_what_it_is_for():
    for module in MODULES:
        assert ast.get_docstring(parsed(module)), module


def test_every_colour_is_in_the_palette():
    files = [path for path in PAGE.iterdir() if path.suffix in ('.css', '.js', '.svg')]
    for file in (*MODULES, *files):
        colours = re.findall("#[0-9a-f]{6}|'#[0-9a-f]{3}'", file.read_text())
        assert not colours or file == PACKAGE / 'palette.py', f'{file.name} has {colours}'


def test_what_other_folders_import_from_the_package_is_there():
    others = [file for folder in ('benchmark', 'demo', 'docs', 'examples')
              for file in (ROOT / folder).rglob('*.py')]
    for file in others:
        for node in ast.walk(parsed(file)):
            if not isinstance(node, ast.ImportFrom) or not f'{node.module}.'.startswith(
                    f'{PACKAGE.name}.'):
                continue
            path = ROOT.joinpath(*node.module.split('.'))
            module = path / '__init__.py' if path.is_dir() else path.with_suffix('.py')
            for name in (alias.name for alias in node.names):
                assert name in words(module) or (path / name).is_dir() or (
                    path / f'{name}.py').exists(), (file, node.module, name)
