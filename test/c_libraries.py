# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""C code as a library of this process, compiled without a warning."""

from contextlib import contextmanager
import ctypes
import fcntl
from functools import partial
import os
from pathlib import Path
import re
import shutil
import subprocess

from linkage_ros.c_code import header
from linkage_ros.c_code.axes import joints
from linkage_ros.scene.joint_names import JointName
import numpy as np
import pytest

# What nothing writes.
UNWRITTEN = 0.123456789
STAND_IN = Path(__file__).parent / 'ros2_control'
COMPILER = shutil.which('cc') or shutil.which('gcc')
SANITIZED = ('-g', '-O0', '-fsanitize=address,undefined', '-fno-sanitize-recover=all')
STRICT = ('-Wall', '-Wextra', '-Wpedantic', '-Wconversion', '-Wshadow', '-Werror')
# For what is written for ros2_control.
PLUGIN = ('-std=c++17', *STRICT, '-isystem', STAND_IN / 'include')


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
            COMPILER, '-std=c99', *STRICT, *flags, '-shared', '-fPIC', source, '-o', library,
            '-lm'], check=True)
    return ctypes.CDLL(str(library))


def counted(text):
    """Return C with a function `poses_taken`, which returns how many poses there were since."""
    counting = re.sub(r'(int \w+_at\([^;]*?\)\n{\n)', r'\1    taken++;\n', text)
    assert 'taken++' in counting
    return f"""static int taken;
{counting}
int poses_taken(void) {{ int before = taken; taken = 0; return before; }}
"""


def inverters(folder, asked):
    """
    Return the inverses of mechanisms in C: values and near inputs -> inputs or None, and poses.

    `asked` has a mechanism and outputs for each. They check that no more poses are computed than
    the header says.
    """
    callers, called = '', []
    text = header.printed([header.Request(mechanism, outputs) for mechanism, outputs in asked])
    bounds = re.findall(r'call takes at most (\d+) poses', text)
    models = re.findall(r'lkr_model (\w+_for_\w+) =', text)
    for (mechanism, outputs), model, most in zip(asked, models, bounds, strict=True):
        called.append((mechanism.name, len(outputs), int(most)))
        callers += f"""
int {mechanism.name}_inverted(const double *value, const double *near, double *inputs)
{{
    return lkr_inverse(&{model}, value, near, inputs);
}}
"""
    library = loaded(folder, counted(text) + callers)

    def invert(name, n, most, value, near):
        made = (ctypes.c_double * n)(*[UNWRITTEN] * n)
        is_there = library[f'{name}_inverted'](*((ctypes.c_double * n)(*np.ravel(each))
                                                 for each in (value, near)), made)
        assert is_there or {*made} == {UNWRITTEN}
        taken = library.poses_taken()
        assert taken <= most
        return (made[:] if n > 1 else made[0]) if is_there else None, taken

    return [partial(invert, *each) for each in called]


def outputs(mechanism, inputs, names, by=None):
    """Return outputs, or their rates by an input, in the scene's units, at such inputs."""
    units = [mechanism.scale_of(name) for name in mechanism.inputs]
    own = np.divide(inputs, units).tolist()
    ask = mechanism.linkage.joint_angles if by is None else mechanism.linkage.joint_rates
    values = ask(own if len(own) > 1 else own[0], names, *([] if by is None else [by]))
    return np.array([float(values[name]) * mechanism.scale_of(name) / (
        1.0 if by is None else units[by]) for name in names])


def expected(mechanism, inputs, chosen=()):
    """
    Return positions of actuators and joints at inputs, each with its Jacobian, from the scene.

    The joints are those of the links in `chosen`, by default the commanded ones.
    """
    by, settings = range(len(inputs)), mechanism.inputs.values()
    measured = [each.measures or name for name, each in mechanism.inputs.items()]
    ratio, offset = (np.array([getattr(each, key) for each in settings])
                     for key in ('ratio', 'offset'))
    chosen = [*chosen] or [each.output for each in joints(mechanism)]
    prefix = next(iter(mechanism.assembly().legs))
    named = [mechanism.joints[name if name in mechanism.inputs else prefix + name]
             for name in chosen]
    rates, turning = (np.array([outputs(mechanism, inputs, names, k) for k in by]).T
                      for names in (measured, chosen))
    return ((outputs(mechanism, inputs, measured) - offset) / ratio, rates / ratio[:, None],
            np.array([*map(JointName.of, named, outputs(mechanism, inputs, chosen))]),
            np.array([name.sign for name in named])[:, None] * turning)


def prove(package, mechanism, compiler, flags=PLUGIN):
    """Compile the proof for a mechanism of a package and run it, with sanitizers, too."""
    name, program = mechanism.name, package / f'proof_{mechanism.name}'
    space = re.search(r'namespace (\w+)', (package / 'src' / 'plugins.cpp').read_text())[1]
    arcs = [max(settings.arcs, key=np.ptp) for settings in mechanism.inputs.values()]
    ranges = ', '.join('{%r, %r}' % (*map(float, arc),) for arc in arcs)
    for count, more in ((100_000, ()), (5000, SANITIZED)):
        if more and subprocess.run([compiler, *more, '-xc++', '-', '-o', program],
                                   input=b'int main() {}', stderr=subprocess.DEVNULL).returncode:
            pytest.skip(f'the sanitizers of {compiler} are not installed')
        subprocess.run([
            compiler, *flags, '-O2', *more, f'-DNAME={name}', f'-DNAMESPACE={space}',
            f'-DINPUTS={len(arcs)}', f'-DRANGES={{{ranges}}}', '-I', package / 'src',
            STAND_IN / 'proof.cpp', '-o', program, *flags], check=True)
        ended = subprocess.run([program, str(count)], capture_output=True, text=True)
        assert ended.returncode == 0, ended.stdout + ended.stderr
        tried, good = map(int, re.search(r'(\d+) states, (\d+)', ended.stdout).groups())
        assert tried == count and good > 0.9 * count
