# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The rooms of the package stand on each other in one order; ls shows which of them need ROS."""

import ast
from functools import cache
import re
import sys
from xml.etree import ElementTree

from linkage_ros import optional
import pytest
from scenes import ROOT

PACKAGE = ROOT / 'linkage_ros'
# From the ground up: a module imports from its own room and from those below.
ROOMS = ('words', 'optional', 'palette', 'cache', 'formula', 'linkage', 'mechanisms', 'scene',
         'cli', 'c_code', 'robot_model', 'robot_files', 'render', 'nodes', 'web',
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


@cache
def parsed(module):
    """Return the syntax tree of a module."""
    return ast.parse(module.read_text())


def room(module):
    """Return the room that a module is in, '' for the package itself."""
    first = module.relative_to(PACKAGE).with_suffix('').parts[0]
    return '' if first == '__init__' else first


@cache
def imports(module):
    """Return what a module imports, at once or later, as full names: whether inside `needs`."""
    nodes = [*ast.walk(parsed(module))]
    guarded = {each for node in nodes if isinstance(node, ast.With)
               and ast.unparse(node.items[0].context_expr).startswith('needs(')
               for each in ast.walk(node)}
    here, imports_ = ['linkage_ros', *module.relative_to(PACKAGE).parent.parts], {}
    for node in nodes:
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            level = getattr(node, 'level', 0)
            base = [*(here[:len(here) - level + 1] if level else []),
                    *filter(None, [getattr(node, 'module', None)])]
            for alias in node.names:
                name = '.'.join([*base, alias.name])
                imports_[name] = node in guarded and imports_.get(name, True)
    return imports_


def file_of(name):
    """Return the file of a module of a full name, whether it exists or not."""
    path = ROOT.joinpath(*name.split('.'))
    return path / '__init__.py' if path.is_dir() else path.with_suffix('.py')


def test_every_module_has_its_room():
    assert {room(module) for module in MODULES} == {'', *ROOMS}


def test_a_module_imports_nothing_from_above():
    for module in MODULES:
        own = room(module)
        for name in imports(module):
            top, *below = name.split('.')
            if top == 'linkage_ros' and own:
                assert ROOMS.index(below[0]) <= ROOMS.index(own), f'{module.name} imports {name}'
            assert own in WITH_ROS or top not in ROS, f'{module.name} needs ROS: {name}'


def test_other_rooms_import_the_core_by_its_public_names():
    public = ast.literal_eval(next(node.value for node in parsed(CORE / '__init__.py').body
                                   if ast.unparse(node).startswith('__all__')))
    for module in MODULES:
        for name in imports(module) if room(module) != 'linkage' else ():
            core, _, below = name.partition('linkage_ros.linkage.')
            assert core or below in public, f'{module.name} imports {name}'


@pytest.mark.parametrize('room_', ['linkage', 'linkage.inverse', 'scene', 'render'])
def test_there_are_all_names_that_a_room_makes_public(room_):
    exec(f'from linkage_ros.{room_} import *')


def test_the_floors_of_the_core_stand_on_each_other_and_no_module_on_itself():
    used = {module: {next(filter(MODULES.__contains__, map(file_of, (
        name, name.rpartition('.')[0]))), None) for name in imports(module)} - {None}
        for module in MODULES}
    floor = {module: FLOORS.index(module.relative_to(CORE).with_suffix('').parts[0])
             for module in MODULES if CORE in module.parents}
    for module in floor:
        for other in used[module] & {*floor}:
            assert floor[other] <= floor[module], f'{module} imports {other}'
    # Take away those that import no other, until none is left: imports for types count too.
    while ground := [module for module, others in used.items() if not others & {*used}]:
        used = {module: used[module] for module in used if module not in ground}
    assert not used, f'in a circle, or above one: {[module.name for module in used]}'


def test_whoever_starts_without_an_optional_package_imports_it_inside_needs():
    needed = {'.'.join(module.relative_to(ROOT).with_suffix('').parts): [
        name for name, guarded in imports(module).items() if not guarded] for module in MODULES}
    # Those that cannot be imported without one, and those that import them.
    without, before = set(optional.INSTALL), None
    while without != before:
        before = set(without)
        without |= {name for name, others in needed.items() for other in others
                    if {other, other.rpartition('.')[0], other.partition('.')[0]} & without}
    assert {name.rpartition('.')[2] for name in without - {*optional.INSTALL}} == {
        'llvm_code', 'mjcf', 'files', 'layers', 'picture', 'server'}


def test_every_foreign_package_is_declared():
    manifest = ElementTree.parse(ROOT / 'package.xml').getroot()
    declared = {one.text.removeprefix('python3-') for one in manifest.iter('exec_depend')}
    for module in MODULES:
        tops = {name.partition('.')[0] for name in imports(module)}
        foreign = tops - {'linkage_ros', '__future__'} - sys.stdlib_module_names
        assert foreign <= declared | {*optional.INSTALL}, module


def test_a_module_begins_with_what_it_is_for():
    for module in MODULES:
        assert ast.get_docstring(parsed(module)), module


def test_every_colour_is_in_the_palette():
    files = [path for path in PAGE.iterdir() if path.suffix in ('.css', '.js', '.svg')]
    for file in (*MODULES, *files):
        colours = re.findall("#[0-9a-f]{6}|'#[0-9a-f]{3}'", file.read_text())
        assert not colours or file == PACKAGE / 'palette.py', f'{file.name} has {colours}'


def test_what_other_folders_use_of_the_package_is_there():
    for file in (path for folder in ('benchmark', 'demo', 'docs', 'examples', 'launch')
                 for path in (ROOT / folder).rglob('*.py')):
        nodes, used = [*ast.walk(parsed(file))], []
        for node in nodes:
            if isinstance(node, ast.ImportFrom) and f'{node.module}.'.startswith('linkage_ros.'):
                for name in (alias.name for alias in node.names):
                    module = file_of(f'{node.module}.{name}')
                    used += [(module, each.attr) for each in nodes if isinstance(
                        each, ast.Attribute) and getattr(each.value, 'id', '') == name] \
                        if module.exists() else [(file_of(node.module), name)]
        for module, name in used:
            assert name == '__doc__' or re.search(rf'\b{name}\b', module.read_text()), (
                file, module, name)
