# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Shared parts of the commands other than nodes, which report an error in one sentence."""

import argparse
import io
import math
import os
import re
import sys
from typing import Any, Callable, Mapping, NoReturn, Sequence

from .scene import SceneError, SceneMechanism
from .words import did_you_mean, RequestError, sentence, suggestion


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one sentence."""

    def error(self, message: str) -> NoReturn:
        """Raise RequestError."""
        raise RequestError(message.replace(
            'one argument', 'one argument, after an = if it begins with a minus sign').replace(
            'required: SCENE', 'required: SCENE, before any --mechanism'))

    def parse_args(self, args=None, namespace=None) -> argparse.Namespace:  # type: ignore
        """Return the arguments; raise RequestError for unknown ones."""
        arguments, unknown = self.parse_known_args(args, namespace)
        if unknown:
            options = re.findall(r'--[\w-]+', self.format_usage())
            self.error(
                f'unrecognized arguments: {" ".join(unknown)}{did_you_mean(unknown[0], options)}')
        return arguments


def add_scene(parser: argparse.ArgumentParser, **scene: Any) -> None:
    """Add the arguments SCENE, with what is said of it, and --mechanism, which `chosen` reads."""
    parser.add_argument('scene', metavar='SCENE', **scene)
    parser.add_argument('--mechanism', nargs='+', default=[], metavar='NAME',
                        help='only these mechanisms of the scene')


def run(name: str, work: Callable, args: Sequence[str] | None) -> int:
    """
    Run a command; return the exit code.

    Parameters
    ----------
    name : str
        The command's name.
    work : callable
        Takes the arguments; raises RequestError, SceneError, OSError or ImportError.
    args : list of str
        The arguments; None: those of this process.

    """
    # A closed one is None, for which `print` takes the other one.
    sys.stdout, sys.stderr = (stream or open(os.devnull, 'w')
                              for stream in (sys.stdout, sys.stderr))
    if isinstance(sys.stdout, io.TextIOWrapper):
        # Robots, scenes and C are UTF-8 in every locale, and paths are bytes.
        sys.stdout.reconfigure(encoding='utf-8', errors='surrogateescape')
    try:
        work(args)
        sys.stdout.flush()
        return 0
    except BrokenPipeError:
        # The reader has closed the pipe.
        why: object = ''
    except (RequestError, SceneError, ImportError) as error:
        why = error
    except OSError as error:
        why = error if not error.filename else (
            f'{error.filename}: {error.strerror}{_similar_file(error)}')
    except KeyboardInterrupt:
        why = 'interrupted'
    try:
        sys.stdout.flush()
    except OSError:
        # Python would try to write the rest at its end, and say that it cannot.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    if why:
        lines = why.lines if isinstance(why, RequestError) else [sentence(why)]
        print(*(f'{name}: {line}' for line in lines), sep='\n', file=sys.stderr)
    return 1 if why else 0


def _similar_file(error: OSError) -> str:
    """Return the end of a sentence that suggests the file that is nearly a missing one."""
    folder, name = os.path.split(str(error.filename))
    if not isinstance(error, FileNotFoundError) or not os.path.isdir(folder or '.'):
        return ''
    return did_you_mean(name, os.listdir(folder or '.'))


def chosen(mechanisms: Mapping[str, SceneMechanism], names: Sequence[str]) -> list[SceneMechanism]:
    """Return the named mechanisms, each once, or all; raise RequestError for an unknown name."""
    for name in names:
        if name not in mechanisms:
            raise RequestError(
                f'there is no mechanism {name!r}{suggestion(name, mechanisms, 200)}')
    return [mechanisms[name] for name in dict.fromkeys(names or mechanisms)]


def within(kind: Callable[[str], Any], low: float, high: float) -> Callable[[str], Any]:
    """Return a reader of finite numbers of a kind from low to high."""
    def read(text: str) -> Any:
        value = kind(text)
        if not (low <= value <= high and math.isfinite(value)):
            raise argparse.ArgumentTypeError(f'must be from {low:g} to {high:g}, not {text}')
        return value
    read.__name__ = 'whole number' if kind is int else 'number'
    return read
