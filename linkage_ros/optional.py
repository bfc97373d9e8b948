# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Packages that are optional: whatever is wrong with one, its import fails in one sentence."""

from contextlib import contextmanager
from traceback import walk_tb
from typing import Iterator

from .words import MESSAGE, truncated

# How to install each of them. All code imports them inside `needs`.
INSTALL = {
    'aiohttp': 'apt install python3-aiohttp, or pip install aiohttp',
    'linkage_interfaces': 'run colcon build in the workspace, which builds linkage_interfaces '
                          'too, and source install/setup.bash',
    'llvmlite': "pip install 'llvmlite>=0.44'",
    'matplotlib': 'apt install python3-matplotlib, or pip install matplotlib',
    'mujoco': 'pip install mujoco',
    'PIL': 'apt install python3-pil, or pip install pillow',
    'yaml': 'apt install python3-yaml, or pip install pyyaml',
}


@contextmanager
def needs(package: str) -> Iterator[None]:
    """
    Import a package, or names from it, or modules that do so at their top.

    A broken package raises anything: OSError for a library of another architecture, AttributeError
    for half an installation. Import the names, since an empty folder is a package without them.

    Raises
    ------
    ModuleNotFoundError
        If a package of INSTALL is not installed.
    ImportError
        If it is installed but cannot be imported.

    """
    try:
        yield
    except Exception as error:
        # An optional package may need another one: the last of them in the traceback is at fault.
        names = [package, *(frame.f_globals.get('__name__', '')
                            for frame, _ in walk_tb(error.__traceback__)),
                 getattr(error, 'name', None) or '']
        fault = [top for name in names if (top := name.partition('.')[0]) in INSTALL][-1]
        if isinstance(error, ModuleNotFoundError) and error.name == fault:
            raise ModuleNotFoundError(f'{fault} is not installed: {INSTALL[fault]}',
                                      name=fault) from error
        raise ImportError(f'{fault} is installed but cannot be used ({type(error).__name__}: '
                          f'{truncated(str(error), MESSAGE)}): {INSTALL[fault]}',
                          name=fault) from error
