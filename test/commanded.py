# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What was just measured can be commanded, over the catalogue and random linkages.

    python test/commanded.py [--seeds 200] [--poses 300]

Each question measures a pose, then commands the joints to be where they are, or where they are
beside it: at inputs that differ by 1e-3 rad or sizes. It counts questions that are refused, and
answers with another pose: not the one asked for, and farther away. As a script it prints a table
for C in double and single precision, and for the transmission.
"""

import argparse
from contextlib import suppress
import ctypes
from pathlib import Path
import re
import subprocess
import tempfile
from typing import NamedTuple, Tuple

from c_libraries import ROS, STAND_IN
from linkage_ros import mechanisms, scene
from linkage_ros.c_code import header
from linkage_ros.c_code.axes import joints
from linkage_ros.c_code.package import package
import numpy as np
from truth import random_linkages

KINDS = 'double', 'float', 'transmission'
# Linkages for which a fault was found: a closed form was missing an assembly mode.
FOUND = (
    ('DE', ['A ground 0 0', 'B ground 0 1.4', 'C cylinder B A 1.0157 right',
            'D E F inversor B C 1.2375 0.3369']),)
# Counts of a mechanism: what it was asked, how often it refused, and gave another pose.
COUNTS = ('measured', 'refused', 'other pose', 'beside', 'refused', 'other pose')
# The same text for C and C++; START and SEND differ.
QUESTIONS = """
static void {name}_asked(long poses, long *counts)
{{
    static const {number} slack = {slack};
    long i;
    int k, side;
    START({name});
    for (i = 1; i <= poses; i++) {{
        {number} q[{n}], beside[{n}], gap[{n}], least;
        lkr_point p, goal;
        lkr_side measured = {{ {{ 0 }}, {{ 0 }}, {{ 0 }} }};
        lkr_side asked = measured, found = measured;
        lkr_sample(&{name}_model, i, q);
        if (!{name}_at(q, 1, &p))
            continue;
        for (k = 0; k < {n}; k++)
            beside[k] = q[k] + (i & 1 << k ? 1 : -1) * ({number})1e-3;
        for (side = 0; side < 2; side++) {{
            goal = p;
            if (side && !{name}_at(beside, 1, &goal))
                continue;
            for (k = 0; k < {n}; k++)
                measured.position[k] = p.position[0][k];
            if (SEND(0, {name}, measured, asked) & 1)
                continue;
            counts[3 * side]++;
            for (k = 0; side && k < {n}; k++)
                asked.position[k] = goal.position[1][k];
            if (SEND(1, {name}, asked, found) & 1) {{
                counts[3 * side + 1]++;
                continue;
            }}
            least = lkr_gap(&{name}_model, 0, found.position, &goal, gap);
            if (least > slack && lkr_gap(&{name}_model, 0, found.position, &p, gap)
                > slack + 2 * lkr_gap(&{name}_model, 0, goal.position[0], &p, beside))
                counts[3 * side + 2]++;
        }}
    }}
}}
"""
IN_C = """
#define START(name) static name##_memory m; if (!name##_begin(&m)) return
#define SEND(side, name, from, to) ((side) ? name##_joints_to_actuators(&m, &from, &to) \\
    : name##_actuators_to_joints(&m, &from, &to))
"""
CALL = """
void {name}_counts(long poses, long *counts) {{ {name}_asked(poses, counts); }}
"""
# The side of a generated class, for one transmission of each mechanism.
IN_CPP = """
template <class Class, class Side> struct Robot
{
  static constexpr std::size_t n = Class::Code::size;
  double actuator[n] = {}, joint[n] = {};
  Class transmission;

  static hardware_interface::TransmissionInfo info()
  {
    hardware_interface::TransmissionInfo made;
    for (std::size_t i = 0; i < n; ++i) {
      made.actuators.emplace_back();
      made.actuators.back().role = Class::Code::actuators[i].role;
      made.joints.emplace_back();
      made.joints.back().role = Class::Code::joints[i].role;
      made.actuators.back().name = "a" + std::to_string(i);
      made.joints.back().name = "j" + std::to_string(i);
    }
    return made;
  }

  Robot() : transmission(info())
  {
    std::vector<transmission_interface::JointHandle> joints;
    std::vector<transmission_interface::ActuatorHandle> actuators;
    for (std::size_t i = 0; i < n; ++i) {
      actuators.emplace_back("a" + std::to_string(i), "position", &actuator[i]);
      joints.emplace_back("j" + std::to_string(i), "position", &joint[i]);
    }
    transmission.configure(joints, actuators);
  }

  int send(int side, const Side & from, Side & to)
  {
    std::copy_n(from.position, n, side ? joint : actuator);
    side ? transmission.joint_to_actuator() : transmission.actuator_to_joint();
    std::copy_n(side ? actuator : joint, n, to.position);
    return transmission.status();
  }
};
#define START(name) \\
  static std::unique_ptr<Robot<name##_class, lkr_side>> started; \\
  try { started = std::make_unique<Robot<name##_class, lkr_side>>(); } \\
  catch (const transmission_interface::Exception & refusal) { \\
    if (std::string(refusal.what()).find("it cannot be assembled") == std::string::npos) throw; \\
    return; \\
  } \\
  auto & robot = *started
#define SEND(side, name, from, to) robot.send(side, from, to)
"""


class Case(NamedTuple):
    """A mechanism and the names of its commanded joints."""

    machine: scene.SceneMechanism
    names: Tuple[str, ...]


def read(name, joint_lines, names=(), **given):
    """Return the case of a mechanism of joint lines."""
    machine, = scene.read({
        'mechanisms': [name], f'{name}.type': 'custom', f'{name}.joints': list(joint_lines),
        **{f'{name}.{key}': value for key, value in given.items()}}).machines.values()
    joints(machine, names)
    return Case(machine, tuple(names))


def found():
    """Yield the linkages of known faults."""
    for i, (output, joint_lines) in enumerate(FOUND):
        yield read(f'found{i}', joint_lines, [f'found{i}_{output}'])


def catalogue():
    """Yield the catalogue."""
    machines = scene.read({'mechanisms': [*mechanisms.TYPES], **{
        f'{name}.type': name for name in mechanisms.TYPES}}).machines.values()
    for machine in machines:
        yield Case(machine, ())


def drawn(seeds):
    """Yield random linkages, each with its default joints and with other outputs."""
    for seed in seeds:
        rng = np.random.default_rng(seed)
        design = random_linkages.design(rng)
        given = {f'dimensions.{key}': float(value) for key, value in design.dimensions.items()}
        names = [()]
        for i in range(3):
            name = f'm{seed}_{i}'
            with suppress(scene.SceneError, ValueError):  # no pose, or not these outputs
                case = read(name, design.joints, names[i] if i < len(names) else (), **given)
                yield case
                if not i:
                    linkage = case.machine.linkage
                    others = [*linkage.joints, *(f'{point}.{axis}' for point in linkage.points
                                                 for axis in 'xy')]
                    names += [[f'm{seed}_{k}_{output}' for output in rng.choice(
                        others, len(linkage.inputs), replace=False)] for k in (1, 2)]


def asked(folder, cases, kind, poses):
    """Return the counts of each case, shape (cases, 6), in C or through the transmission."""
    folder.mkdir(parents=True, exist_ok=True)
    names = [case.machine.name for case in cases]
    number = 'float' if kind == 'float' else 'double'
    questions = [QUESTIONS.format(
        name=case.machine.name, number=number, n=len(case.machine.inputs),
        slack='1e-2f' if kind == 'float' else '1e-6')
        for case in cases]
    calls = ''.join(CALL.format(name=name) for name in names)
    library = folder / 'asked.so'
    if kind == 'transmission':
        files = package('asked', 'asked.yaml', [*cases])
        for path, text in files.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text, encoding='utf-8')
        classes = re.findall(r' type="(.*?)Loader"', files[Path('plugins.xml')])
        code = ''.join(f'#include "{name}.hpp"\n' for name in names) + IN_CPP + ''.join(
            f'using {name}_class = {class_}Transmission;'
            for name, class_ in zip(names, classes)) + ''.join(questions) + (
                f'extern "C" {{{calls}}}\n')
        compiler = ['g++', '-std=c++17', '-isystem', STAND_IN / 'include', '-I', folder / 'src',
                    '-I', folder / 'include', *ROS]
        source = folder / 'asked.cpp'
    else:
        code = header.printed([header.Request(case.machine, (), case.names) for case in cases],
                              number == 'float') + IN_C + ''.join(questions) + calls
        compiler, source = ['cc', '-std=c99'], folder / 'asked.c'
    source.write_text(code)
    subprocess.run([*compiler, '-O1', '-shared', '-fPIC', source, '-o', library, '-lm',
                    *(ROS if kind == 'transmission' else [])],
                   check=True)
    loaded, counts = ctypes.CDLL(str(library)), []
    for name in names:
        own = (ctypes.c_long * 6)()
        loaded[f'{name}_counts'](ctypes.c_long(poses), own)
        counts.append([*own])
    return np.array(counts)


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--seeds', type=int, default=200, help='random linkages')
    parser.add_argument('--poses', type=int, default=300, help='poses of each')
    parser.add_argument('--kinds', nargs='+', default=KINDS, choices=KINDS)
    parser.add_argument('--each', action='store_true', help='print those that miss any')
    chosen = parser.parse_args()
    groups = {'catalogue': [*catalogue(), *found()], 'random': [*drawn(range(chosen.seeds))]}
    print('| linkages | code |', ' | '.join(COUNTS), '|\n|---|---|' + '--:|' * len(COUNTS))
    for group, cases in groups.items():
        for kind in chosen.kinds:
            counts = []
            for i in range(0, len(cases), 25):
                with tempfile.TemporaryDirectory() as folder:
                    counts += [*asked(Path(folder), cases[i:i + 25], kind, chosen.poses)]
            print(f'| {group}, {len(cases)} | {kind} |',
                  ' | '.join(map(str, np.sum(counts, axis=0))), '|', flush=True)
            for case, own in zip(cases, counts):
                if chosen.each and any(own[[1, 2, 4, 5]]):
                    print(case.machine.name, case.names, *own, flush=True)


if __name__ == '__main__':
    main()
