# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Ways to solve a linkage: ours, C, the original formulas, and what a user would pick instead.

Each is made for a linkage and has `one`, from a crank angle [rad] to a pose, and `many`, from an
array, or None. What they return is theirs; `rows` makes x and y of each point in turn of it. The
peers are asked for Jansen's leg. Those that follow start from a pose and go on in small steps; an
array of theirs has equal steps.
"""

import cmath
import ctypes
from itertools import combinations
import math
from pathlib import Path
import platform
import subprocess
import tempfile
from typing import Callable, NamedTuple

from gmpy2 import mpfr
from linkage_ros import mechanisms
import numpy as np
from truth import original_formulas
from truth.drawing import DIGITS, draw, Linkage, precisely

LEG = 'jansen'
POINTS = {'water_drop': 'ABP', LEG: 'ACDEFG', 'peaucellier': 'ABCD', 'slotted_lever': 'AL'}
DIMENSIONS = {kind: dict(mechanisms.create(kind).dimensions) for kind in POINTS}
# The bodies of the leg: each, its parent and the joint between them. What closes the loops: two
# bodies and the point in which they meet. And the bodies that carry the points.
BODIES = (('crank', 'ground', 'O'), ('AC', 'crank', 'A'), ('BCD', 'ground', 'B'),
          ('AE', 'crank', 'A'), ('BE', 'ground', 'B'), ('EFG', 'BE', 'E'), ('DF', 'BCD', 'D'))
LOOPS = ('AC', 'BCD', 'C'), ('AE', 'BE', 'E'), ('EFG', 'DF', 'F')
CARRIERS = {'A': 'crank', 'C': 'BCD', 'D': 'BCD', 'E': 'BE', 'F': 'EFG', 'G': 'EFG'}
JOINTS = {'ground': 'ground', **{name: joint for name, _, joint in BODIES}}


class Method(NamedTuple):
    """One way to solve one linkage."""

    name: str
    one: Callable | None
    many: Callable | None
    rows: Callable = np.asarray
    follows: bool = False


@precisely
def truth(kind, theta):
    """Return the true places at a crank angle, {point: complex of many digits}."""
    linkage = Linkage(mechanisms.design(kind).joints, DIMENSIONS[kind])
    return draw(DIGITS, linkage, linkage.prepared(linkage.numbers), [mpfr(theta)]).points


def longest(kind):
    """Return the greatest distance of two points of one link [m]."""
    return max(math.dist(*ends) for frame in mechanisms.create(kind).frames.values()
               for ends in combinations(frame.values(), 2))


def ours(kind):
    """Return the library: `function` for one pose, `solve` for arrays, then in machine code."""
    names = tuple(POINTS[kind])
    linkage = mechanisms.create(kind)
    quick = linkage.accelerated()

    def rows(answer):
        return (np.concatenate([answer[name] for name in names], -1)
                if isinstance(answer, dict) else np.array(answer))

    yield Method('linkage_ros', linkage.function(names),
                 lambda theta: linkage.solve(theta, names), rows)
    yield Method('linkage_ros, machine code', None, lambda theta: quick.solve(theta, names), rows)


def compiled_c(kind):
    """Return hand-written C for this processor, then with the sines of several numbers at once."""
    lengths, width = np.array(list(DIMENSIONS[kind].values())), 2 * len(POINTS[kind])
    angle, row = ctypes.c_double(), (ctypes.c_double * width)()
    at, from_, to = lengths.ctypes.data, ctypes.addressof(angle), ctypes.addressof(row)

    def built(*flags):
        with tempfile.TemporaryDirectory() as folder:
            made = Path(folder) / 'linkages.so'
            subprocess.run(['gcc', '-O3', '-march=native', '-fno-math-errno', '-fno-trapping-math',
                            *flags, '-shared', '-fPIC', Path(__file__).with_name('linkages.c'),
                            '-o', made, '-lm'], check=True)
            solve = getattr(ctypes.CDLL(str(made)), kind)
        solve.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_long, ctypes.c_void_p]

        def one(theta):
            angle.value = theta
            solve(at, from_, 1, to)
            return row[:]

        def many(theta):
            # `lengths` has to live as long as its address is used.
            out = np.empty((theta.size, width), lengths.dtype)
            solve(at, theta.ctypes.data, theta.size, out.ctypes.data)
            return out

        return one, many

    yield Method('C', *built())
    if platform.machine() == 'x86_64':
        yield Method('C, vector sine', None, built('-DVECTOR_SINE')[1])


def original(kind):
    """Return the formulas of the original documents."""
    yield Method('original formulas', *(
        original_formulas.written(functions, kind, DIMENSIONS[kind])
        for functions in (original_formulas.FLOATS, original_formulas.ARRAYS)),
        lambda answer: np.stack(answer, -1))


def numba(_):
    """Return circle after circle, as one writes it for numba."""
    from numba import njit

    a, b, c, d, e, f, g, h, i, j, k, l, m = DIMENSIONS[LEG].values()  # noqa: E741
    base, quick = complex(-a, -l), njit(error_model='numpy')

    def corner(bar, first, second):
        along = 0.5 + (first - second) * (first + second) / (2 * bar * bar)
        return complex(along, math.sqrt((first / bar) ** 2 - along * along))

    to_d, to_g = corner(b, d, e), corner(g, i, h)

    @quick
    def circles(p, q, first, second, side):
        arm = q - p
        square = arm.real * arm.real + arm.imag * arm.imag
        area = ((first + second) ** 2 - square) * (square - (first - second) ** 2)
        return p + arm * (0.5 + (0.5 * (first - second) * (first + second)
                                 + 0.5j * side * math.sqrt(area)) / square)

    @quick
    def pose(theta):
        pin = m * complex(math.cos(theta), math.sin(theta))
        knee, heel = circles(base, pin, b, j, 1.0), circles(base, pin, c, k, -1.0)
        top = base + (knee - base) * to_d
        toe = circles(heel, top, g, f, 1.0)
        return pin, knee, top, heel, toe, heel + (toe - heel) * to_g

    @quick
    def poses(theta):
        out = np.empty((theta.size, 6), np.complex128)
        for n in range(theta.size):
            out[n] = pose(theta[n])
        return out

    yield Method('numba, circles by hand', pose, poses,
                 lambda answer: np.ascontiguousarray(answer, complex).view(float))


def newton(start):
    """Return scipy's Newton (MINPACK) on the bars of three loops, with their exact slopes."""
    from scipy.optimize import fsolve

    at = {name: complex(place) for name, place in truth(LEG, start).items()}
    a, b, c, d, e, f, g, h, i, j, k, l, m = DIMENSIONS[LEG].values()  # noqa: E741
    base, squares = complex(-a, -l), [x * x for x in (b, j, c, k, g, f)]
    to_d = (at['D'] - at['B']) / (at['C'] - at['B'])
    to_g = (at['G'] - at['E']) / (at['F'] - at['E'])
    found = [part for name in 'CEF' for part in (at[name].real, at[name].imag)]

    def arms(unknown, pin):
        x, y, u, v, p, q = unknown.tolist()
        knee, heel, toe = complex(x, y), complex(u, v), complex(p, q)
        return (knee - base, knee - pin, heel - base, heel - pin, toe - heel,
                toe - base - (knee - base) * to_d)

    def misfit(unknown, pin):
        return [z.real * z.real + z.imag * z.imag - square
                for z, square in zip(arms(unknown, pin), squares)]

    def slopes(unknown, pin):
        cb, ca, eb, ea, fe, fd = (2.0 * z for z in arms(unknown, pin))
        top = fd * to_d.conjugate()
        return [[cb.real, cb.imag, 0, 0, 0, 0], [ca.real, ca.imag, 0, 0, 0, 0],
                [0, 0, eb.real, eb.imag, 0, 0], [0, 0, ea.real, ea.imag, 0, 0],
                [0, 0, -fe.real, -fe.imag, fe.real, fe.imag],
                [-top.real, -top.imag, 0, 0, fd.real, fd.imag]]

    def one(theta):
        nonlocal found
        pin = m * complex(math.cos(theta), math.sin(theta))
        found = fsolve(misfit, found, (pin,), slopes, xtol=1e-14, full_output=True)[0]
        return pin, found

    def rows(answer):
        pin, (x, y, u, v, p, q) = answer
        heel = complex(u, v)
        top = base + (complex(x, y) - base) * to_d
        foot = heel + (complex(p, q) - heel) * to_g
        return np.array([pin.real, pin.imag, x, y, top.real, top.imag, u, v, p, q, foot.real,
                         foot.imag])

    yield Method('scipy fsolve on three loops', one, None, rows, True)


def pylinkage(start):
    """Return pylinkage, step by step."""
    from pylinkage import Crank, FixedDyad, Ground, Linkage, RRRDyad

    at = {name: complex(place) for name, place in truth(LEG, start).items()}
    x = DIMENSIONS[LEG]
    ground = [Ground(at[name].real, at[name].imag, name=name) for name in 'OB']
    crank = Crank(ground[0], x['m'], 1.0, start, name='A')

    def dyad(name, first, second, one, other):
        return RRRDyad(first, second, x[one], x[other], at[name].real, at[name].imag, name=name)

    def rigid(name, p, q, first, second):
        ratio = (at[name] - at[p]) / (at[q] - at[p])
        return FixedDyad(first, second, abs(at[name] - at[p]), cmath.phase(ratio), name=name)

    knee = dyad('C', ground[1], crank, 'b', 'j')
    top = rigid('D', 'B', 'C', ground[1], knee)
    heel = dyad('E', ground[1], crank, 'c', 'k')
    toe = dyad('F', heel, top, 'g', 'f')
    linkage = Linkage((*ground, crank, knee, top, heel, toe, rigid('G', 'E', 'F', heel, toe)))
    steps, before = linkage.step(iterations=10 ** 9), start

    def one(theta):
        nonlocal before
        crank.angular_velocity, before = theta - before, theta
        return next(steps)

    def many(theta):
        crank.angular_velocity = 1.0
        return linkage.step_fast(theta.size, theta[1] - theta[0])

    linkage.compile()
    yield Method('pylinkage, step() and step_fast()', one, many,
                 lambda rows: np.array(rows, float)[2:].ravel(), True)


def pinocchio(start):
    """Return Newton's method on the gaps of the loops, with pinocchio's frames and Jacobians."""
    import pinocchio as pin

    at = {'ground': 0j, **{name: complex(z) for name, z in truth(LEG, start).items()}}
    model, joints = pin.Model(), {'ground': 0}

    def shift(point, body):
        place = at[point] - at[JOINTS[body]]
        return pin.SE3(np.eye(3), np.array([place.real, place.imag, 0.0]))

    def frame(body, point):
        return model.addFrame(pin.Frame(f'{point} of {body}', joints[body], shift(point, body),
                                        pin.FrameType.OP_FRAME))

    for name, parent, joint in BODIES:
        joints[name] = model.addJoint(joints[parent], pin.JointModelRZ(), shift(joint, parent),
                                      name)
    marks = [frame(body, point) for point, body in CARRIERS.items()]
    loops = [(frame(one, point), frame(other, point)) for one, other, point in LOOPS]
    data, q, world = model.createData(), np.zeros(len(BODIES)), pin.LOCAL_WORLD_ALIGNED

    def one(theta):
        q[0] = theta - start
        for _ in range(3):
            pin.computeJointJacobians(model, data, q)
            pin.updateFramePlacements(model, data)
            gaps = [(data.oMf[p].translation - data.oMf[r].translation)[:2] for p, r in loops]
            slopes = [(pin.getFrameJacobian(model, data, p, world)
                       - pin.getFrameJacobian(model, data, r, world))[:2, 1:] for p, r in loops]
            q[1:] -= np.linalg.solve(np.concatenate(slopes), np.concatenate(gaps))
        pin.framesForwardKinematics(model, data, q)
        return [data.oMf[mark].translation[:2].copy() for mark in marks]

    yield Method('Pinocchio, 3 Newton steps', one, None, np.ravel, True)


def mujoco(start, steps=10):
    """Return a simulation whose loops are closed by MuJoCo's connect constraints."""
    import mujoco as mj

    at = {'ground': 0j, **{name: complex(z) for name, z in truth(LEG, start).items()}}
    size, heavy, damped = max(DIMENSIONS[LEG].values()), 'armature="1e6"', 'damping="0.1"'

    def place(point, body):
        z = (at[point] - at[JOINTS[body]]) / size
        return f'pos="{z.real:.17g} {z.imag:.17g} 0"'

    def inside(body):
        points = {p for p, carrier in CARRIERS.items() if carrier == body} | {
            point for *both, point in LOOPS if body in both}
        sites = [f'<site name="{point}{body}" {place(point, body)}/>' for point in points]
        return ''.join(sites + [
            f'<body {place(joint, body)}><joint name="{name}" '
            f'{heavy if name == "crank" else damped}/>'
            f'<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>{inside(name)}</body>'
            for name, parent, joint in BODIES if parent == body])

    loops = ''.join(f'<connect site1="{point}{one}" site2="{point}{other}" solref="1e-9 1" '
                    'solimp="0.999 0.9999 0.0001"/>' for one, other, point in LOOPS)
    model = mj.MjModel.from_xml_string(
        '<mujoco><option gravity="0 0 0" integrator="implicitfast"/><worldbody>'
        f'{inside("ground")}</worldbody><equality>{loops}</equality></mujoco>')
    data, before = mj.MjData(model), start
    marks = [model.site(point + body).id for point, body in CARRIERS.items()]

    def one(theta):
        nonlocal before
        move = theta - before
        model.opt.timestep = max(abs(move) / steps, 1e-12)
        for n in range(1, steps + 1):
            data.qvel[0] = 1.0
            mj.mj_step(model, data)
            data.qpos[0] = before - start + n / steps * move
        mj.mj_kinematics(model, data)
        before = theta
        return data.site_xpos[marks, :2] * size

    yield Method(f'MuJoCo, {steps} time steps', one, None, np.ravel, True)


KINDS = ours, compiled_c, original
PEERS = {'numba': numba, 'scipy': newton, 'pylinkage': pylinkage, 'pin': pinocchio,
         'mujoco': mujoco}
