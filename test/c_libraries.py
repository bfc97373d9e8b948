# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""C code as a library of this process, compiled without a warning."""

import ctypes
import shutil
import subprocess

import pytest

COMPILER = shutil.which('cc') or shutil.which('gcc')
STRICT = ('-Wall', '-Wextra', '-Wpedantic', '-Wconversion', '-Wshadow', '-Werror', '-O2')


def loaded(folder, code):
    """Return the library of a text in C99, compiled in a folder of its own."""
    if not COMPILER:
        pytest.skip('there is no C compiler')
    source, library = folder / 'code.c', folder / 'code.so'
    source.write_text(code)
    subprocess.run([COMPILER, '-std=c99', *STRICT, '-shared', '-fPIC', source, '-o', library,
                    '-lm'], check=True)
    return ctypes.CDLL(str(library))
