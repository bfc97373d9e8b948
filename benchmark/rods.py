# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""
An ankle on two rods: pitch and roll for two motors, run time against error.

    python -m benchmark.rods              prints the table
    python -m benchmark.rods --document   writes it to docs/rods.md, too

Numbers are kept in benchmark/results/rods.json. Besides what the library needs, it takes mujoco,
pin and llvmlite, as in benchmark/requirements.txt, and gcc; what is missing is left out.
"""

import argparse
import ctypes
import json
import math
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time

for library in ('OMP', 'OPENBLAS', 'MKL', 'NUMEXPR'):
    os.environ.setdefault(f'{library}_NUM_THREADS', '1')

from linkage_ros import mechanisms, scene  # noqa: E402
from linkage_ros.c_code import header  # noqa: E402
import numpy as np  # noqa: E402
from truth import rods  # noqa: E402

from . import document  # noqa: E402
from .machine import machine  # noqa: E402

RESULTS = Path(__file__).with_name('results') / 'rods.json'
DEGREE = math.pi / 180.0
# The ankle of a Unitree G1, and its joint limits.
G1 = rods.drawn(
    [0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -0.0176], [1.0, 0.0, 0.0],
    [[0.022, 0.0, 0.2159], [0.022, 0.0, 0.1509]], [[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
    [[0.0395, -0.0164, 0.2112], [0.035, 0.0165, 0.1469]],
    [[0.022, -0.015, -0.0096], [0.022, 0.015, -0.0096]])
LOW, HIGH = np.array([-50.0, -15.0]) * DEGREE, np.array([30.0, 15.0]) * DEGREE
POSES, STEPS = 2000, 400
# What is off by more [rad] is another pose.
ASTRAY = 1e-3
ROUNDS = 3
# By how much rods are longer than those made before [m]: an equal linkage is not made again.
MADE = []


class Ours:
    """The library: one pose after the other, arrays, machine code, C."""

    def __init__(self):
        self.linkage = mechanisms.create('rods', joints=G1.within(LOW, HIGH))
        self._one = self.linkage.function((), ('pitch', 'roll'))

    def one_by_one(self, motors):
        return np.array([self._one(*each) for each in motors.tolist()])

    def arrays(self, motors):
        return _pose(self.linkage, motors)

    def machine_code(self, motors):
        return _pose(self.linkage.accelerated(), motors)

    def c_code(self):
        """Return a method in C, with both rates."""
        ankle = scene.read({'mechanisms': ['ankle'], 'ankle.type': 'rods',
                            'ankle.joints': G1.within(LOW, HIGH)}).machines['ankle']
        loop = """
void over(long n, const double *motors, double *out)
{
    long i;
    ankle_pose p, a, b;
    for (i = 0; i < n; i++) {
        ankle_solve(motors[2 * i], motors[2 * i + 1], &p);
        ankle_rates(motors[2 * i], motors[2 * i + 1], &a, &b);
        out[2 * i] = p.angle_pitch + 0.0 * (a.angle_pitch + b.angle_roll);
        out[2 * i + 1] = p.angle_roll;
    }
}
"""
        folder = Path(tempfile.mkdtemp())
        (folder / 'ankle.c').write_text(header.written(ankle) + loop)
        subprocess.run(['gcc', '-O2', '-std=c99', '-shared', '-fPIC', 'ankle.c', '-o',
                        'ankle.so', '-lm'], cwd=folder, check=True)
        over = ctypes.CDLL(str(folder / 'ankle.so')).over
        over.argtypes = ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p

        def solve(motors):
            out, motors = np.empty(motors.shape), np.ascontiguousarray(motors)
            over(len(motors), motors.ctypes.data, out.ctypes.data)
            return out
        return solve


def _pose(linkage, motors):
    return np.stack(list(linkage.joint_angles(motors.T, ['pitch', 'roll']).values()), axis=-1)


def newton_on_motor_angles(tolerance, sides):
    """Return the solver as it is usually written: the inverse by an arc cosine, and its slopes."""
    def circle(origin, axis, point):
        origin, axis, arm = map(np.array, (origin, axis, np.subtract(point, origin)))
        across = np.cross(axis, arm)
        return [x.tolist() for x in (origin + axis * (axis @ arm), np.cross(across, axis), across)]

    legs = []
    for i in range(2):
        centre, u, v = circle(G1.motors[i], G1.motor_axes[i], G1.pivots[i])
        legs.append((circle(G1.second, G1.second_axis, G1.ends[i]), centre, u, v,
                     math.dist(G1.pivots[i], centre), G1.lengths[i], (1.0, -1.0)[sides[i]]))

    def inverse(pitch, roll):
        found, (cp, sp, cr, sr) = [], (math.cos(pitch), math.sin(pitch), math.cos(roll),
                                       math.sin(roll))
        for (k, u, v), centre, x, y, rho, length, side in legs:
            p, q, r = (a + b * cr + c * sr for a, b, c in zip(k, u, v))
            p, q, r = p * cp + r * sp - centre[0], q - centre[1], r * cp - p * sp - centre[2]
            a = p * x[0] + q * x[1] + r * x[2]
            b = p * y[0] + q * y[1] + r * y[2]
            c = 0.5 * (p * p + q * q + r * r + rho * rho - length * length)
            found.append(math.atan2(b, a) + side * math.acos(c / math.hypot(a, b)))
        return found

    def solve_one(wanted):
        pitch = roll = 0.0
        for _ in range(20):
            f, g = (x - y for x, y in zip(inverse(pitch, roll), wanted))
            if abs(f) + abs(g) < tolerance:
                break
            (a, c), (b, d) = ([(x - y) / 2e-6 for x, y in zip(
                inverse(pitch + dp, roll + dr), inverse(pitch - dp, roll - dr))]
                for dp, dr in ((1e-6, 0.0), (0.0, 1e-6)))
            det = a * d - b * c
            pitch, roll = pitch - (f * d - b * g) / det, roll - (a * g - f * c) / det
        return pitch, roll

    def solve(motors):
        found = []
        for wanted in motors.tolist():
            try:
                found.append(solve_one(wanted))
            except (ValueError, ZeroDivisionError):  # the arc cosine has left its domain
                found.append((math.nan, math.nan))
        return np.array(found)
    return solve


def table(ours, nodes, motors):
    """Return bilinear interpolation in a table over the range of the motors."""
    low, high = motors.min(axis=0), motors.max(axis=0)
    axes = [np.linspace(a, b, nodes) for a, b in zip(low, high)]
    grid = np.stack(np.meshgrid(*axes, indexing='ij'), axis=-1)
    values = _pose(ours.linkage.accelerated(), grid.reshape(-1, 2)).reshape(nodes, nodes, 2)

    def solve(motors):
        place = (motors - low) / (high - low) * (nodes - 1)
        at = np.clip(place.astype(int), 0, nodes - 2)
        (i, j), (u, v) = at.T, (place - at).T[..., None]
        return ((values[i, j] * (1 - u) + values[i + 1, j] * u) * (1 - v)
                + (values[i, j + 1] * (1 - u) + values[i + 1, j + 1] * u) * v)
    return solve


def degree_eight(motors):
    """Return the pose inside the limits among all assemblies."""
    all_ = np.stack(rods.assemblies(G1, motors.T), axis=-1)
    inside = ((all_ > LOW - 1e-9) & (all_ < HIGH + 1e-9)).all(axis=-1)
    first = np.argmax(inside, axis=1)
    rows = np.arange(len(motors))
    return np.where(inside.any(axis=1)[:, None], all_[rows, first], np.nan)


def pinocchio_loops(iterations):
    """Return Newton's method on both rods' lengths, with pinocchio's frames and Jacobians."""
    import pinocchio as pin

    def shift(place, base=(0.0, 0.0, 0.0)):
        return pin.SE3(np.eye(3), np.array(place) - base)

    model = pin.Model()
    pitch = model.addJoint(0, pin.JointModelRevoluteUnaligned(*G1.first_axis), shift(G1.first),
                           'pitch')
    roll = model.addJoint(pitch, pin.JointModelRevoluteUnaligned(*G1.second_axis),
                          shift(G1.second, G1.first), 'roll')
    frames = []
    for i in range(2):
        motor = model.addJoint(0, pin.JointModelRevoluteUnaligned(*G1.motor_axes[i]),
                               shift(G1.motors[i]), f'motor {i}')
        frames.append([model.addFrame(pin.Frame(f'{i} {name}', joint, place,
                                                pin.FrameType.OP_FRAME))
                       for name, joint, place in (
                           ('pin', motor, shift(G1.pivots[i], G1.motors[i])),
                           ('end', roll, shift(G1.ends[i], G1.second)))])
    data = model.createData()

    def solve(motors):
        q, found = np.zeros(4), []
        for q[2], q[3] in motors:
            for _ in range(iterations):
                pin.computeJointJacobians(model, data, q)
                pin.updateFramePlacements(model, data)
                gap, slope = [], []
                for (one, other), length in zip(frames, G1.lengths):
                    rod = data.oMf[one].translation - data.oMf[other].translation
                    gap.append(0.5 * (rod @ rod - length ** 2))
                    jacobian = pin.getFrameJacobian(
                        model, data, other, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)[:3, :2]
                    slope.append(-rod @ jacobian)
                q[:2] -= np.linalg.solve(slope, gap)
            found.append(q[:2].copy())
        return np.array(found)
    return solve


def mujoco_steps(steps):
    """Return a simulation with both rods closed by connect constraints, in time steps a pose."""
    import mujoco

    mujoco.set_mju_user_warning(lambda message: None)

    def text(vector):
        return ' '.join(map(repr, map(float, vector)))

    def less(one, other):
        return text(np.subtract(one, other))

    light = '<inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>'
    legs = ''.join(
        f'<body pos="{text(G1.motors[i])}"><joint name="m{i}" axis="{text(G1.motor_axes[i])}" '
        f'armature="1e6"/>{light}<body name="rod{i}" pos="{less(G1.pivots[i], G1.motors[i])}">'
        f'<joint type="ball" damping="0.01"/>{light}<site name="r{i}" '
        f'pos="{less(G1.ends[i], G1.pivots[i])}"/></body></body>' for i in range(2))
    feet = ''.join(f'<site name="f{i}" pos="{less(G1.ends[i], G1.second)}"/>' for i in range(2))
    closed = ''.join(f'<connect site1="r{i}" site2="f{i}" solref="1e-9 1" '
                     'solimp="0.999 0.9999 0.0001"/>' for i in range(2))
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="0 0 0" integrator="implicitfast"/><worldbody>'
        f'<body pos="{text(G1.first)}"><joint name="pitch" axis="{text(G1.first_axis)}"/>{light}'
        f'<body pos="{less(G1.second, G1.first)}"><joint name="roll" '
        f'axis="{text(G1.second_axis)}"/>{light}{feet}</body></body>{legs}</worldbody>'
        f'<equality>{closed}</equality></mujoco>')
    places = [model.joint(name).qposadr[0] for name in ('m0', 'm1', 'pitch', 'roll')]
    speeds = [model.joint(name).dofadr[0] for name in ('m0', 'm1')]

    def solve(motors):
        data, found, before = mujoco.MjData(model), [], np.zeros(2)
        for wanted in motors:
            model.opt.timestep = max(np.abs(wanted - before).max() / steps, 1e-9)
            for n in range(1, steps + 1):
                data.qvel[speeds] = (wanted - before) / (steps * model.opt.timestep)
                mujoco.mj_step(model, data)
                data.qpos[places[:2]] = before + n / steps * (wanted - before)
            before = wanted
            found.append(data.qpos[places[2:]].copy())
        return np.array(found)
    return solve


def methods(ours, motors):
    """Yield each method: its name, what it makes of motors, whether it goes from pose to pose."""
    yield 'linkage_ros, one pose after the other', ours.one_by_one, False
    yield 'linkage_ros, numpy', ours.arrays, False
    yield 'linkage_ros, machine code', ours.machine_code, False
    yield 'linkage_ros, C with both rates', ours.c_code(), False
    home = np.zeros(1)
    sides = [int(np.argmin([abs(float(x[0])) for x in rods.motor_values(G1, i, home, home)]))
             for i in (0, 1)]
    yield 'Newton on motor angles, to 1e-9', newton_on_motor_angles(1e-9, sides), False
    for nodes in (33, 129, 513):
        yield f'table of {nodes} x {nodes}, bilinear', table(ours, nodes, motors), False
    yield 'polynomial of degree 8 (the reference), numpy', degree_eight, False
    for count in (1, 2, 3):
        yield (f'pinocchio, {count} Newton steps from the preceding pose',
               pinocchio_loops(count), True)
    for count in (10, 100):
        yield f'MuJoCo, {count} time steps per pose', mujoco_steps(count), True


def made_anew(ours, low, high):
    """Return the least CPU time [ms] that an ankle not seen before takes, or its refusal."""
    found = []
    for _ in range(ROUNDS):
        MADE.append(1e-7)
        ankle = G1._replace(lengths=[length + sum(MADE) for length in G1.lengths])
        start = time.process_time()
        try:
            ours(mechanisms.create('rods', joints=ankle.within(low, high)))
        except ValueError:
            pass
        found.append(1e3 * (time.process_time() - start))
    return min(found)


def set_up():
    """Return what is done once, and the CPU time [ms] that it takes."""
    wide, ask = math.pi * np.ones(2) * 0.9, ('pitch', 'roll')
    made = made_anew(lambda linkage: None, LOW, HIGH)
    return {
        'a linkage, proof included': made,
        'a rejection, with the largest provable limits': made_anew(print, -wide, wide),
        'the first pose': made_anew(lambda linkage: linkage.function((), ask)(0.0, 0.0),
                                    LOW, HIGH) - made,
        'the first inverse': made_anew(lambda linkage: linkage.inputs_for(ask, (-0.1, 0.05)),
                                       LOW, HIGH) - made}


def run():
    """Return {machine, rows, once}: time a pose, worst error, wrong poses of so many."""
    ours = Ours()
    inverse = ours.linkage.driven_by('pitch', 'roll')

    def motors_of(poses):
        motors = np.stack(list(inverse.joint_angles(poses.T, ['l', 'r']).values()), axis=-1)
        there = np.isfinite(motors).all(axis=1)
        return poses[there], motors[there]

    scattered = motors_of(np.random.default_rng(1).uniform(LOW, HIGH, (POSES, 2)))
    time_ = np.linspace(0.0, 2.0 * math.pi, STEPS)
    path = motors_of(0.5 * (LOW + HIGH) + 0.45 * (HIGH - LOW) * np.stack(
        [np.sin(3.0 * time_), np.sin(2.0 * time_)], axis=-1))
    rows = []
    for name, solve, follows in methods(ours, scattered[1]):
        poses, motors = path if follows else scattered
        found, took = solve(motors), math.inf
        for _ in range(ROUNDS):
            start = time.process_time()
            solve(motors)
            took = min(took, time.process_time() - start)
        off = np.abs(found - poses).max(axis=1)
        wrong = ~(off < ASTRAY)
        rows.append({'method': name, 'us': took / len(motors) * 1e6, 'poses': len(motors),
                     'error': float(off[~wrong].max(initial=0.0)), 'wrong': int(wrong.sum())})
        print(rows[-1], file=sys.stderr)
    return {'machine': machine([]), 'rows': rows, 'once': set_up()}


def document_table(result):
    """Return the table of the page."""
    lines = ['| method | CPU time per pose [us] | worst error [rad] | wrong or none |',
             '|---|--:|--:|--:|']
    lines += [f'| {row["method"]} | {row["us"]:.3g} | {row["error"]:.1e} | '
              f'{row["wrong"]} of {row["poses"]} |' for row in result['rows']]
    if 'once' in result:
        lines += ['', '| once | CPU time [ms] |', '|---|--:|', *(
            f'| {what} | {took:.3g} |' for what, took in result['once'].items())]
    return '\n'.join(lines)


def main():
    """Run, write and print."""
    parser = argparse.ArgumentParser(description=__doc__.strip().split('\n\n')[0])
    parser.add_argument('--document', action='store_true', help='write the table to docs/')
    parser.add_argument('--tables', action='store_true',
                        help='run nothing, show the last results')
    options = parser.parse_args()
    if not options.tables:
        RESULTS.write_text(json.dumps(run(), indent=1) + '\n')
    result = json.loads(RESULTS.read_text())
    if options.document:
        document.write('rods.md', document_table(result), 'measured: rods')
    print(document_table(result))


if __name__ == '__main__':
    main()
