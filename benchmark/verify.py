# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Compare with foreign material that anyone can get: how many numbers, and the largest difference.

    python -m benchmark.verify [--pmks FOLDER] [--linkages 100] [--document]

| source | what is compared |
|---|---|
| PMKS_Verification (github.com/PMKS-Web/PMKS_Verification) | places, velocities, accelerations |
| pylinkage (pip) | places of random four-bars and their couplers |
| MuJoCo (pip) | how far loops are open where it puts the joints of the catalogue's MJCF |

PMKS' data have no licence to be kept here: clone them, and name the folder with --pmks. A source
that is missing is left out. Differences are relative to the linkage's size, of velocities times
the input's speed, or to the number itself where that is larger.
"""

import csv
import json
import math
from pathlib import Path
import sys

from linkage_ros import mechanisms, scene
from linkage_ros.robot_model import bodies, mjcf
import numpy as np

from . import document

# A foreign number further away than this is a difference to look into.
FAR = 1e-9
# What is no further beside the line of two joints, of their distance, is on it.
STRAIGHT = 1e-12


def pmks(folder, _):
    """Yield the differences of one number after the other to both engines of PMKS."""
    for path in sorted(Path(folder).glob('reference-data/v1/cases/*/case.json')):
        case = json.loads(path.read_text())
        linkage = mechanisms.create('custom', joints=lines_of(case))
        speed, size = case['input']['speed_rad_s'], case['characteristic_length']
        # Their third, MotionGen's, agrees with these to some 1e-4.
        for samples in (path.parent / engine / 'samples.csv' for engine in ('matlab', 'pmks')):
            used = [row for row in table(samples) if row['eligibility'] == 'eligible']
            theta = np.array([float(row['input_angle_rad']) for row in used])
            rate = speed * np.array([float(row['input_direction']) for row in used])
            ours = [linkage.solve(theta), {
                name: each * rate[:, None] for name, each in linkage.velocity(theta).items()},
                linkage.acceleration(theta, rate, np.zeros(len(theta)))]
            for what, names in (('joints', '{}'), ('points', '{}'), ('com', 'M{}')):
                for file in samples.parent.glob(f'{what}/*.csv'):
                    rows = {row['sample_id']: row for row in table(file)}
                    name = names.format(file.stem)
                    if name not in linkage.points:
                        continue
                    for order, axes in enumerate((('x', 'y'), ('vx', 'vy'), ('ax', 'ay'))):
                        theirs = np.array([[float(rows[row['sample_id']][axis] or 'nan')
                                            for axis in axes] for row in used])
                        scale = np.maximum(size * abs(speed) ** order, np.abs(theirs))
                        difference = np.abs(ours[order][name] - theirs) / scale
                        yield from difference[np.isfinite(theirs)]


def table(path):
    """Return the rows of a file."""
    with open(path, newline='') as file:
        return list(csv.DictReader(file))


def lines_of(case):
    """Return the joint lines of a case: its crank, then whatever two known joints carry."""
    joints = {joint['id']: joint for joint in case['topology']['joints']}
    at = {name: complex(*joint['initial']) for name, joint in joints.items()}
    links = {link['id']: list(link['joints']) for link in case['topology']['links']}
    for point in case['topology']['points']:
        if 'coincident_with' not in point:
            at[point['id']] = complex(*point['initial'])
            links[point['link']].append(point['id'])
    for link, body in case['mass_properties'].items():
        if link in links:
            at[f'M{link}'] = complex(*body['com_initial'])
            links[link].append(f'M{link}')
    base, crank = case['input']['joint'], case['input']['link']
    known = {name: f'{name} ground {z.real!r} {z.imag!r}' for name, z in at.items()
             if 'ground' in joints.get(name, {'links': ()})['links']
             and joints[name]['type'] == 'R'}
    pin = next(name for name in links[crank] if name != base)
    known[pin] = f'{pin} crank {base} {abs(at[pin] - at[base])!r}'
    while left := [name for name in at if name not in known]:
        for name in left:
            if line := line_of(name, joints.get(name), at, links, known):
                known[name] = line
    return [*known.values()]


def line_of(name, joint, at, links, known):
    """Return the line of a joint, if what carries it is known."""
    ends = [[p for p in carried if p in known] for carried in links.values() if name in carried]
    for first, second in (pair[:2] for pair in ends if len(pair) > 1):
        arm = (at[name] - at[first]) / (at[second] - at[first])
        if abs(arm.imag) < STRAIGHT:
            along = arm.real * abs(at[second] - at[first])
            return f'{name} line {first} {second} {along!r}'
        return f'{name} rigid {first} {second} {bars(name, first, second, at)}'
    if joint and joint['type'] == 'P' and ends[0]:
        pin, axis = ends[0][0], complex(*joint['guide_axis'])
        guide = f'{name}G'
        at[guide], known[guide] = at[name], f'{guide} ground {at[name].real!r} {at[name].imag!r}'
        ahead = ((at[name] - at[pin]) / axis).real > 0.0
        return (f'{name} slider {pin} {abs(at[name] - at[pin])!r} {guide} '
                f'{math.atan2(axis.imag, axis.real)!r} {"out" if ahead else "in"}')
    if len(ends) > 1 and all(ends):
        (first, *_), (second, *_) = ends
        return f'{name} dyad {first} {second} {bars(name, first, second, at)}'
    return None


def bars(name, first, second, at):
    """Return the lengths of two bars of a joint, and on which side of their ends it is."""
    one, other = at[name] - at[first], at[name] - at[second]
    side = 'left' if (one / (at[second] - at[first])).imag > 0.0 else 'right'
    return f'{abs(one)!r} {abs(other)!r} {side}'


def pylinkage(_, count):
    """Yield the differences to random four-bars that pylinkage steps through."""
    from pylinkage import Crank, FixedDyad, Ground, Linkage, RRRDyad

    rng = np.random.default_rng(1)
    for _ in range(count):
        crank, ground = (rng.uniform(0.2, 1.0, 2) + (0.0, 1.0)).tolist()
        # Not too short together and not too different, so that the crank turns.
        middle = 0.5 * (crank + ground) * rng.uniform(1.05, 1.9)
        unlike = 0.45 * (ground - crank) * rng.uniform(-1.0, 1.0)
        coupler, rocker = float(middle + unlike), float(middle - unlike)
        arm, angle = rng.uniform(0.2, 2.0), rng.uniform(-3.0, 3.0)
        linkage = mechanisms.create('custom', joints=(
            'O ground 0 0', f'Q ground {ground!r} 0', f'A crank O {crank!r}',
            f'B dyad A Q {coupler!r} {rocker!r} left'))
        theta = np.arange(0.0, 2.0 * math.pi, 0.1)
        pin, end = (each[:, 0] + 1j * each[:, 1] for each in map(linkage.solve(theta).get, 'AB'))
        point = pin + arm * np.exp(1j * angle) * (end - pin) / np.abs(end - pin)
        parts = [Ground(0.0, 0.0, name='O'), Ground(ground, 0.0, name='Q')]
        parts.append(Crank(parts[0], crank, 0.1, -0.1, name='A'))
        parts.append(RRRDyad(parts[2], parts[1], coupler, rocker, end[0].real, end[0].imag,
                             name='B'))
        parts.append(FixedDyad(parts[2], parts[3], arm, angle, name='P'))
        for row, ours in zip(Linkage(parts).step(iterations=len(theta)), zip(pin, end, point)):
            yield from (abs(complex(*theirs) - own) for theirs, own in zip(row[2:], ours))


def mujoco(_, count):
    """Yield how far the loops of the catalogue are open in MuJoCo at our joint angles."""
    import mujoco as mj

    for kind in mechanisms.TYPES:
        mechanism = scene.read({'mechanisms': ['m'], 'm.type': kind}).mechanisms['m']
        linkage, size = mechanism.linkage, bodies.size(mechanism)
        robot = bodies.robot([mechanism], 'world', density=bodies.DENSITY)
        model = mj.MjModel.from_xml_string(mjcf.write(robot))
        data, names = mj.MjData(model), [model.joint(i).name for i in range(model.njnt)]
        outputs = [name.removeprefix('m_') for name in names]
        if not set(outputs) <= set(linkage.joints):
            continue
        rng = np.random.default_rng(1)
        given = [rng.uniform(input_.low, input_.high, count) for input_ in linkage.inputs]
        found = linkage.joint_angles(given if len(given) > 1 else given[0], outputs)
        for row in zip(*found.values()):
            if np.isfinite(row).all():
                for name, value in zip(names, row):
                    data.joint(name).qpos = value
                mj.mj_fwdPosition(model, data)
                yield from np.abs(data.efc_pos[:data.ne]) / size


SOURCES = {'PMKS_Verification': pmks, 'pylinkage': pylinkage, 'MuJoCo': mujoco}


def main():
    """Compare, print the table; return the exit code."""
    parser = document.parser(__doc__)
    parser.add_argument('--pmks', metavar='FOLDER', help='a clone of PMKS_Verification')
    parser.add_argument('--linkages', type=int, default=100, help='of pylinkage; poses in MuJoCo')
    options = parser.parse_args()
    rows, is_far = [], False
    for name, compare in SOURCES.items():
        if compare is pmks and not options.pmks:
            rows.append([name, 'not compared: --pmks', '', ''])
            continue
        try:
            found = np.array([*compare(options.pmks, options.linkages)])
        except ImportError as missing:
            rows.append([name, f'not compared: {missing}', '', ''])
            continue
        far = int((~(found < FAR)).sum())
        is_far |= bool(far) or not len(found)
        rows.append([name, len(found), f'{np.nanmax(found, initial=0.0):.1e}', far])
    text = document.table(['source', 'numbers', 'largest difference', f'above {FAR:.0e}'], rows)
    text += '\n\n' + document.machine('pylinkage', 'mujoco')
    document.show(options, 'design/accuracy.md', text, 'measured: foreign')
    return int(is_far)


if __name__ == '__main__':
    sys.exit(main())
