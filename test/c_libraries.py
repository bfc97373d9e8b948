# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""C code as a library of this process, compiled without a warning."""

from contextlib import contextmanager
import ctypes
import fcntl
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys

from linkage_ros.c_code import header
import pytest

STAND_IN = Path(__file__).parent / 'ros2_control'
# What finds rcutils, whose log transmissions use; nothing if it is not installed.
ROS = next(([f'-isystem{include}', f'-L{prefix}/lib', '-lrcutils', f'-Wl,-rpath,{prefix}/lib']
            for prefix in (sys.prefix, *os.environ.get('AMENT_PREFIX_PATH', '').split(':'))
            for include in (f'{prefix}/include/rcutils', f'{prefix}/include')
            if Path(include, 'rcutils', 'logging_macros.h').is_file()), [])
COMPILER = shutil.which('cc') or shutil.which('gcc')
SAMPLE = (STAND_IN / 'sample.h').read_text()
STRICT = ('-Wall', '-Wextra', '-Wpedantic', '-Wconversion', '-Wshadow', '-Werror')


@contextmanager
def shared(tmp_path_factory, name):
    """Give one process at a time a folder that all that run the tests have."""
    folder = tmp_path_factory.getbasetemp()
    if 'PYTEST_XDIST_WORKER' in os.environ:
        folder = folder.parent
    (folder / name).mkdir(exist_ok=True)
    with open(folder / f'{name}.lock', 'w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield folder / name


def loaded(folder, code, *flags):
    """Return the library of a text in C99, compiled in a folder of its own or found there."""
    if not COMPILER:
        pytest.skip('there is no C compiler')
    source, library = folder / 'code.c', folder / 'code.so'
    if not library.exists() or source.read_text() != code:
        source.write_text(code)
        subprocess.run([
            COMPILER, '-std=c99', '-DLKR_MAX_INPUTS=3', '-DLKR_MAX_SOLUTIONS=1024', *STRICT,
            *flags, '-shared', '-fPIC', source, '-o', library, '-lm'], check=True)
    return ctypes.CDLL(str(library))


def inverter(folder, mechanism, output, single=False):
    """Return the inverse of a mechanism's only input in C: value, near -> input, None: refused."""
    number, text = 'float' if single else 'double', header.written(mechanism, [output], single)
    name, = re.findall(r'int (\w+_for_\w+)', text)
    call = loaded(folder, f"""{text}
int inverted(double value, double near, double *input)
{{
    {number} answer = 0;
    const int is_there = {name}(({number})value, ({number})near, &answer);
    *input = answer;
    return is_there;
}}
""").inverted
    answer = ctypes.c_double()

    def invert(value, near):
        is_there = call(ctypes.c_double(value), ctypes.c_double(near), ctypes.byref(answer))
        return answer.value if is_there else None

    return invert
