# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0


"""
Arrays of poses by torch and JAX, beside numpy and machine code, on one core.

    python -m benchmark.namespaces               prints the table, within two minutes
    python -m benchmark.namespaces --document    writes it to docs/design/performance.md, too

Besides what the library needs, it takes torch, JAX and llvmlite. Times are CPU times, the least
of several calls; those of a first call, which compiles, are not in it.
"""

from collections import namedtuple
import os
from pathlib import Path

from linkage_ros import mechanisms, scene
import numpy as np

from . import document
from .calls import times

SIZES = 1_000, 100_000, 1_000_000
Task = namedtuple('Task', 'title linkage requested ends')
# How many poses a method has memory for: torch keeps every operation for its gradients.
Method = namedtuple('Method', 'title package make most', defaults=[max(SIZES)])


def tasks():
    """Return what is computed: a linkage, points, joints and rates, and ends of the inputs."""
    ankle = Path(__file__).parents[1] / 'examples' / 'ankle.yaml'
    return [
        Task("Jansen's leg, all points", mechanisms.create('jansen'), (None, (), ()), 3.1),
        Task('ankle, pitch, roll and rates', scene.load(ankle).mechanisms['ankle'].linkage,
             ((), ('pitch', 'roll'), ('pitch', 'roll')), 0.2)]


def by_torch(task, given):
    """Return the call of torch, without compilation."""
    import torch
    torch.set_num_threads(1)
    function = task.linkage.function(*task.requested, xp=torch)
    arrays = [torch.tensor(x) for x in given]
    return lambda: function(*arrays)


def by_torch_backwards(task, given):
    """Return the call of torch, and all the gradients of the sum of its results."""
    import torch
    function = task.linkage.function(*task.requested, xp=torch)
    arrays = [torch.tensor(x, requires_grad=True) for x in given]
    return lambda: torch.autograd.grad(torch.stack(function(*arrays)).sum(), arrays)


def by_jax(task, given):
    """Return the call of JAX, compiled."""
    import jax
    jax.config.update('jax_enable_x64', True)
    function = jax.jit(task.linkage.function(*task.requested, xp=jax.numpy))
    arrays = [jax.numpy.asarray(x) for x in given]
    return lambda: jax.block_until_ready(function(*arrays))


METHODS = (
    Method('numpy', 'numpy', lambda task, given: lambda: task.linkage.compiled_pose(
        *task.requested).over(*given)),
    Method('`accelerated()`', 'llvmlite', lambda task, given: lambda: task.linkage.accelerated(
        ).compiled_pose(*task.requested).over(*given)),
    Method('torch', 'torch', by_torch),
    Method('with gradients', 'torch', by_torch_backwards, 100_000),
    Method('JAX, `jit`', 'jax', by_jax))


def measured(task, size):
    """Return the CPU time of each method [ns per pose] as text."""
    rng = np.random.default_rng(1)
    given = [rng.uniform(-task.ends, task.ends, size) for _ in task.linkage.inputs]
    return [f'{1e3 / size * times([method.make(task, given)])[0]:.0f}'
            if size <= method.most else '-' for method in METHODS]


def main():
    """Run and print."""
    options = document.parser(__doc__).parse_args()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    text = document.table(
        ['CPU time of one core [ns per pose]', 'poses',
         *(method.title for method in METHODS)],
        [[task.title, size, *measured(task, size)]
         for task in tasks() for size in SIZES])
    text += '\n\n' + document.machine('llvmlite', 'torch', 'jax')
    document.show(options, 'design/performance.md', text, 'measured: namespaces')


if __name__ == '__main__':
    main()
