# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How wrong a method is: errors against the truth, and failures by kind."""

import warnings

import numpy as np

from .problems import pose, UNIT

# Further off than this share of the longest bar is no rounding: another assembly, or no answer.
ASTRAY = 0.05
# What an error is over a sensitivity of zero.
ENDLESS = 1e99
WITHIN_A_TURN = ('one turn', 'near 0', 'near pi', 'near turning', 'near a limit')


def judge(method, problem, single):
    """
    Return what a method gets wrong, as one flat mapping.

    Errors are those of the worst point of a pose, over the poses that did not fail: `uL` in units
    of u x longest bar; `sensitivity` in units of what half an ulp of every input does, after one
    ulp of the result; `scaled` in units of u x longest bar or the sensitivity, whichever is
    larger, so that reach limits, where an angle says little about the pose, do not hide everything
    else. Failures are counted over all angles: `nan` and `raised` where a pose was due, `astray`
    further off than `ASTRAY` longest bars, `made_up` a pose where there is none.
    """
    found, raised = _answers(method, problem, single)
    columns = [i for i, name in enumerate(problem.points) if name in found]
    places = np.stack([found[problem.points[i]] for i in columns], 1)
    due = problem.due[:, columns]
    with np.errstate(all='ignore'):
        error = problem.error(places, columns)
        spread = problem.sensitivity[:, columns]
        beyond_ulp = np.maximum(0.0, error - np.spacing(np.abs(places).max(-1)))
        ratio = np.where(beyond_ulp > 0, np.minimum(beyond_ulp / spread, ENDLESS), 0.0)
        scaled = error / np.maximum(UNIT * problem.longest, spread)
    reachable, unreachable = (due > 0).all(1), (due < 0).any(1)
    finite = np.isfinite(places).all((1, 2))
    astray = reachable & finite & (error > ASTRAY * problem.longest).any(1)
    good = reachable & finite & ~astray
    needed = np.isfinite(np.where(due[..., None] < 0, places, 0.0)).all((1, 2))
    inside = good & np.isin(problem.group, WITHIN_A_TURN)
    result = {
        'angles': int(reachable.sum() + unreachable.sum()),
        'failed_nan': int((reachable & ~finite & ~raised).sum()),
        'failed_raised': int((reachable & raised).sum()),
        'failed_astray': int(astray.sum()),
        'failed_made_up': int((unreachable & needed & ~raised).sum()),
    }
    in_bars = error.max(1) / (UNIT * problem.longest)
    for what, values in (('uL', in_bars), ('sensitivity', ratio.max(1)),
                         ('scaled', scaled.max(1))):
        for name, chosen in (('', inside), ('_all', good)):
            result[f'max_{what}{name}'] = _top(values[chosen])
        result[f'median_{what}'] = _middle(values[inside])
    for group in dict.fromkeys(problem.group.tolist()):
        result[f'max_uL, {group}'] = _top(in_bars[good & (problem.group == group)])
    return result


def _top(values):
    return float(values.max()) if values.size else None


def _middle(values):
    return float(np.median(values)) if values.size else None


def _answers(method, problem, single):
    """Return {point: places (angles, 2)} and which angles ended in an exception."""
    count = problem.theta.size
    raised = np.zeros(count, bool)
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        if method.follows:
            found = _followed(method, problem, raised)
        elif single:
            found = _gathered(method, count, enumerate(problem.theta.tolist()), raised)
        else:
            found = method.poses(method.solve(problem.theta))
    return found, raised


def _followed(method, problem, raised):
    found = {}
    for start, path, asked in problem.walks():
        method.start(start, pose(problem.kind, start))
        _gathered(method, problem.theta.size, zip(asked.tolist(), path.tolist()), raised, found)
    return found


def _gathered(method, count, angles, raised, found=None):
    """Ask for poses one by one; index -1 is a step on the way to the next."""
    found = {} if found is None else found
    for index, theta in angles:
        try:
            places = method.poses(method.solve_one(theta))
        except Exception:  # a package may raise what it likes
            if index >= 0:
                raised[index] = True
            continue
        if index >= 0:
            for name, place in places.items():
                if name not in found:
                    found[name] = np.full((count, 2), np.nan)
                found[name][index] = np.ravel(place)
    return found
