# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Ways to solve a linkage, one module a family."""

from importlib import import_module

FAMILIES = (
    'ours', 'compiled_c', 'cffi_c', 'numba_functions', 'original', 'sympy_expression', 'table',
    'newton', 'scipy_solvers', 'casadi_rootfinder', 'pylinkage_step', 'planegcs_sketch',
    'solvespace_sketch', 'pinocchio_loops', 'drake_ik', 'mujoco_steps',
)


def load(families=FAMILIES):
    """Return (methods, {family: why its package is not there}) of the families that are named."""
    methods, absent = [], {}
    for family in families:
        try:
            methods.extend(import_module(f'{__package__}.{family}').METHODS)
        except ImportError as error:
            absent[family] = str(error)
    return methods, absent
