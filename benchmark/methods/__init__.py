# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

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
