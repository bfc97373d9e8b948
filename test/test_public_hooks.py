# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The nodes use what the client library says that they may: nothing private, nothing replaced."""

import ast
import inspect
from pathlib import Path
import re

import pytest
from rclpy import client, clock, executors, node, publisher, service, subscription, timer

PACKAGE = Path(__file__).parents[1] / 'linkage_ros'
SOURCES = [path for room in ('nodes', 'web') for path in sorted((PACKAGE / room).glob('*.py'))]
KINDS = (node.Node, publisher.Publisher, subscription.Subscription, service.Service,
         client.Client, timer.Timer, clock.Clock, executors.Executor)
METHODS = {name for kind in KINDS for name, value in inspect.getmembers(kind, callable)
           if not name.startswith('_')}
# What a node has or sets that begins with an underscore.
PRIVATE = {name for name in (*dir(node.Node), *re.findall(
    r'self\.(\w+)', Path(inspect.getfile(node.Node)).read_text())) if re.match('_(?!.*__$)', name)}


def offences(text):
    """Yield where a module uses a private name of the client library's, or replaces a method."""
    tree = ast.parse(text)
    nodes = {one for each in ast.walk(tree) if isinstance(each, ast.ClassDef)
             and any(ast.unparse(base).endswith('Node') for base in each.bases)
             for one in ast.walk(each)}
    for one in ast.walk(tree):
        name = getattr(one, 'attr', getattr(one, 'name', None))
        is_private = name in PRIVATE and one in nodes
        if isinstance(one, ast.Constant):
            is_private = one.value in PRIVATE
        replaces = (isinstance(one, ast.Attribute) and isinstance(one.ctx, ast.Store)
                    and name in METHODS and ast.unparse(one.value) != 'self')
        if is_private or replaces:
            yield f'{one.lineno}: {ast.unparse(one)}'


@pytest.mark.parametrize('path', SOURCES, ids=lambda path: f'{path.parent.name}/{path.name}')
def test_nothing_private_of_the_client_library_is_touched_and_no_method_replaced(path):
    assert not [*offences(path.read_text())]


@pytest.mark.parametrize('line', [
    'node._parameters.clear()', "getattr(node, '_parameters')", 'self._parameters = {}',
    'node.set_parameters = print', 'def _set_parameters_atomically(self): pass',
    'self._service.send_response = print', 'self.timers[0].cancel = print'])
def test_the_search_finds(line):
    assert [*offences(f'class Mine(Node):\n    {line}\n')]
