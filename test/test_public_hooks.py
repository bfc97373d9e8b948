# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The nodes use what the client library says that they may: nothing private, nothing replaced."""

import ast
import inspect
from pathlib import Path
import re

import pytest

pytest.importorskip('rclpy')

from rclpy.node import Node  # noqa: E402

PACKAGE = Path(__file__).parents[1] / 'linkage_ros'
SOURCES = [path for room in ('nodes', 'web') for path in sorted((PACKAGE / room).glob('*.py'))]
# Public for all their underscores.
NAMED_TUPLE = {'_replace', '_asdict', '_fields', '_make'}


def is_private(name):
    """Tell whether an attribute begins with an underscore that is not for everybody."""
    return name.startswith('_') and not name.endswith('__') and name not in NAMED_TUPLE


def methods():
    """Return the names of the methods of what the client library hands out."""
    from rclpy import client, clock, executors, node, publisher, service, subscription, timer

    kinds = (node.Node, publisher.Publisher, subscription.Subscription, service.Service,
             client.Client, timer.Timer, clock.Clock, executors.Executor)
    return {name for kind in kinds for name in dir(kind)
            if callable(getattr(kind, name, None)) and not name.startswith('_')}


METHODS = methods()
# What a node has or sets that begins with an underscore.
PRIVATE = {name for name in (*dir(Node), *re.findall(
    r'self\.(\w+)', Path(inspect.getfile(Node)).read_text())) if is_private(name)}


def touched(tree):
    """Yield the attributes of others that begin with an underscore, also where text names them."""
    for one in ast.walk(tree):
        if isinstance(one, ast.Attribute) and is_private(one.attr):
            if ast.unparse(one.value) not in ('self', 'cls') and ast.unparse(one) != 'os._exit':
                yield one
        elif isinstance(one, ast.Constant) and one.value in PRIVATE:
            yield one


def replaced(tree):
    """Yield what is assigned to an attribute of others that is called as one of their methods."""
    for one in ast.walk(tree):
        if isinstance(one, ast.Attribute) and isinstance(one.ctx, ast.Store):
            if one.attr in METHODS:
                if not isinstance(one.value, ast.Name) or one.value.id != 'self':
                    yield one


def taken(tree):
    """Yield what a node of ours has under a private name of the client library's."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef) and any(
                ast.unparse(base).endswith('Node') for base in node.bases):
            for one in ast.walk(node):
                name = getattr(one, 'attr', getattr(one, 'name', ''))
                if isinstance(one, (ast.Attribute, ast.FunctionDef)) and name in PRIVATE:
                    yield one


def found(text):
    """Return the places where a module does what it must not."""
    tree = ast.parse(text)
    return [f'{one.lineno}: {ast.unparse(one)}'
            for search in (touched, replaced, taken) for one in search(tree)]


@pytest.mark.parametrize('path', SOURCES, ids=lambda path: f'{path.parent.name}/{path.name}')
def test_nothing_private_of_the_client_library_is_touched_and_no_method_replaced(path):
    assert not found(path.read_text())


@pytest.mark.parametrize('line', [
    'node._parameters.clear()', "getattr(node, '_parameters')", 'self._parameters = {}',
    'node.set_parameters = print', 'def _set_parameters_atomically(self): pass',
    'self._service.send_response = print', 'self.timers[0].cancel = print'])
def test_the_search_finds(line):
    assert found(f'class Mine(Node):\n    {line}\n')
