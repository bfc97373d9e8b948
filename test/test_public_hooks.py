# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The nodes use what the client library says that they may: nothing private, nothing replaced."""

import ast
from pathlib import Path
import re

import pytest

rclpy = pytest.importorskip('rclpy')

PACKAGE = Path(__file__).parents[1] / 'linkage_ros'
SOURCES = [path for room in ('nodes', 'web') for path in sorted((PACKAGE / room).glob('*.py'))]
# Public for all their underscores.
NAMED_TUPLE = {'_replace', '_asdict', '_fields', '_make'}


def is_private(name):
    """Tell whether an attribute begins with an underscore that is not for everybody."""
    return name.startswith('_') and not name.endswith('__') and name not in NAMED_TUPLE


def node_defines():
    """Return the attributes of a node that its own class has or sets."""
    source = Path(rclpy.node.__file__).read_text()
    return {*dir(rclpy.node.Node), *re.findall(r'self\.(\w+)\b(?=[:,= ])', source)}


def is_a_node(tree):
    """Yield the classes of a module that are nodes."""
    for one in ast.walk(tree):
        if isinstance(one, ast.ClassDef) and any(
                ast.unparse(base).endswith(('Node', 'Executor')) for base in one.bases):
            yield one


def violations(text, defined):
    """Yield what the source of a module does with what belongs to the client library."""
    tree = ast.parse(text)
    own = {one.attr for one in ast.walk(tree) if isinstance(one, ast.Attribute)
           and isinstance(one.value, ast.Name) and one.value.id in ('self', 'cls')}
    own |= {one.name for one in ast.walk(tree) if isinstance(one, ast.FunctionDef)}
    own |= {name.arg for one in ast.walk(tree) if isinstance(one, ast.arguments)
            for name in one.args}
    for one in ast.walk(tree):
        if isinstance(one, ast.Attribute) and is_private(one.attr):
            mine = isinstance(one.value, ast.Name) and one.value.id in ('self', 'cls')
            if not mine and (one.attr not in own or one.attr in defined):
                # `os._exit` is documented.
                if ast.unparse(one) != 'os._exit':
                    yield one.lineno, ast.unparse(one)
        if isinstance(one, ast.Constant) and isinstance(one.value, str) and re.fullmatch(
                r'_[a-z]\w*', one.value):
            yield one.lineno, repr(one.value)
        if isinstance(one, (ast.Assign, ast.AnnAssign, ast.AugAssign)):
            targets = one.targets if isinstance(one, ast.Assign) else [one.target]
            for target in targets:
                if isinstance(target, ast.Attribute) and target.attr in PUBLIC_METHODS and not (
                        ast.unparse(target.value) in ('self', 'shutdown')):
                    yield one.lineno, ast.unparse(target)
    for node in is_a_node(tree):
        for one in ast.walk(node):
            if (isinstance(one, ast.Attribute) and isinstance(one.value, ast.Name)
                    and one.value.id == 'self' and is_private(one.attr) and one.attr in defined):
                yield one.lineno, ast.unparse(one)
            if isinstance(one, ast.FunctionDef) and is_private(one.name) and one.name in defined:
                yield one.lineno, one.name


def methods():
    """Return the names of the methods of what the client library hands out."""
    from rclpy import client, clock, executors, node, publisher, service, subscription, timer

    kinds = (node.Node, publisher.Publisher, subscription.Subscription, service.Service,
             client.Client, timer.Timer, clock.Clock, executors.Executor)
    return {name for kind in kinds for name in dir(kind)
            if callable(getattr(kind, name, None)) and not name.startswith('_')}


PUBLIC_METHODS = methods()
DEFINED = node_defines()


@pytest.mark.parametrize('path', SOURCES, ids=lambda path: f'{path.parent.name}/{path.name}')
def test_nothing_private_of_the_client_library_is_touched_and_no_method_replaced(path):
    assert not list(violations(path.read_text(), DEFINED))


@pytest.mark.parametrize('line', [
    'node._parameters.clear()', "getattr(node, '_parameters')", 'self._parameters = {}',
    'node.set_parameters = print', 'def _set_parameters_atomically(self): pass',
    'self._service.send_response = print', 'rclpy._rclpy_pybind11'])
def test_the_search_finds(line):
    text = f'class Mine(Node):\n    def f(self, node):\n        {line}\n'
    if line.startswith('def'):
        text = f'class Mine(Node):\n    {line}\n'
    assert list(violations(text, DEFINED))
