# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0


"""
Actuators of a scene and the outputs that they move: scale, ratios, offsets, sensors and sweeps.

The truth is the same linkage built at full size without a scene, its poses and their differences.
"""

import itertools
import math
import re

from linkage_ros import mechanisms
from linkage_ros.scene.inverse_request import InverseRequest, present_inputs
import numpy as np
import pytest
from scenes import alone, G1
from truth.working_modes import five_bar

BOOM = ('O ground 0 0', 'P ground x -y', 'B cylinder P O l right called boom',
        'A rigid O B s t right')
ARM = (*BOOM, 'C rigid O A u v left', 'D cylinder C A w left called arm', 'H rigid A D q r right')
LENGTHS = dict(zip('xylstuvwqr', (
    0.3, 0.3964, 1.04858, 2.4, 1.5, 1.45, 1.12156, 0.41031, 1.3, 1.66)))
SHORT = {key: LENGTHS[key] for key in 'xylst'}
# Type, dimensions, joint lines, parameters, outputs, and inputs at full size.
CASES = {
    'lever': ('slotted_lever', {'a': 80.0, 'b': 150.0, 'e': 10.0}, (), {
        'scale': 0.25, 'crank.ratio': -0.5, 'crank.offset': 0.3, 'crank.sweep': [-2.9, 2.8],
        'crank.start': 0.4, 'loads': ['L=3 -4', 'lever=-7']}, ('lever',), [(0.9,), (-2.2,)]),
    'pump': ('slider_crank', {'a': 40.0, 'b': 120.0, 'c': -20.0}, (), {
        'scale': 0.25, 'crank.ratio': 3.0, 'crank.offset': -0.2, 'loads': ['B=-3 2']},
        ('block',), [(0.7,), (-2.0,)]),
    'boom': ('custom', SHORT, BOOM, {
        'scale': 4.0, 'boom.ratio': 0.5, 'boom.offset': 0.25, 'boom.sweep': [2.6, 5.6],
        'boom.start': 3.5, 'loads': ['A=0 -9', 'OB=5']}, ('A.x',), [(3.7,), (5.1,)]),
    'angle': ('custom', SHORT, BOOM, {
        'scale': 4.0, 'boom.ratio': -2.0, 'boom.start': 4.0}, ('OB',), [(3.7,), (5.1,)]),
    'pair': ('five_bar', mechanisms.defaults('five_bar'), (), {
        'scale': 2.0, 'crank2.ratio': 0.5, 'crank2.offset': 0.3, 'crank.start': 1.9,
        'crank2.start': 1.24, 'loads': ['P=2 -5']}, ('P.x', 'P.y'), [(1.9, 1.24), (1.7, 1.4)]),
    'arm': ('custom', LENGTHS, ARM, {
        'scale': 0.5, 'boom.sweep': [0.3, 0.7], 'boom.start': 0.5, 'arm.sweep': [0.4, 0.75],
        'arm.start': 0.5, 'arm.ratio': -4.0, 'arm.offset': 1.0, 'loads': ['H=1 -8', 'OB=3']},
        ('H.x', 'H.y'), [(0.5, 0.6), (0.62, 0.45)]),
    'mixed': ('custom', LENGTHS, ARM, {
        'scale': 0.5, 'boom.start': 0.5, 'boom.ratio': 2.0, 'arm.start': 0.5},
        ('OB', 'H.y'), [(0.5, 0.6), (0.62, 0.45)]),
    'ankle': ('rods', {}, G1, {
        'scale': 1.0, 'right.ratio': -2.0, 'right.offset': 0.1, 'right.sweep': [-0.4, 0.4],
        'loads': ['pitch=12', 'roll=-3']}, ('pitch', 'roll'), [(0.1, -0.05), (-0.2, 0.1)])}


class Case:
    """A mechanism of a scene, and the same linkage at full size."""

    def __init__(self, name, **more):
        type_, lengths, lines, parameters, self.outputs, self.inputs = CASES[name]
        self.parameters, self.scale = {**parameters, **more}, parameters['scale']
        own = {'joints': list(lines)} if lines else {}
        self.mechanism = alone({'type': type_, **own, **self.parameters, **{
            f'dimensions.{key}': value for key, value in lengths.items()}})
        self.linkage = mechanisms.create(type_, **own, **{
            key: self.scale * value for key, value in lengths.items()})
        self.settings = [*self.mechanism.inputs.values()]
        self.ratios = [self.parameters.get(f'{key}.ratio', 1.0) for key in self.mechanism.inputs]
        self.offsets = [self.parameters.get(f'{key}.offset', 0.0) for key in self.mechanism.inputs]

    def at(self, inputs, outputs=()):
        """Return outputs at inputs at full size, each a number or an array."""
        theta = inputs if len(self.settings) > 1 else inputs[0]
        outputs = outputs or self.outputs
        values = self.linkage.joint_angles(theta, outputs)
        return [values[name][()] for name in outputs]

    def jacobian(self, inputs, outputs=()):
        """Return d output / d input, (outputs, inputs), by differences."""
        columns = []
        for i, settings in enumerate(self.settings):
            step = 1e-5 * (1.0 if settings.input.is_angle else self.scale)
            beside = [[*inputs[:i], inputs[i] + side * step, *inputs[i + 1:]] for side in (1, -1)]
            high, low = (np.array(self.at(each, outputs)) for each in beside)
            columns.append((high - low) / (2.0 * step))
        return np.transpose(columns)

    def positions(self, inputs):
        """Return the actuators' positions at inputs."""
        return [(value - offset) / ratio for value, ratio, offset in zip(
            inputs, self.ratios, self.offsets)]


@pytest.fixture(params=[(name, i) for name in CASES for i in (0, 1)],
                ids=lambda each: f'{each[0]}{each[1]}')
def posed(request):
    """Return each case, inputs, the outputs there, and the solver of the inverse."""
    name, i = request.param
    case = Case(name)
    inputs = case.inputs[i]
    return case, inputs, case.at(inputs), InverseRequest(case.mechanism, case.outputs)


def agree(values, expected):
    """Assert that numbers are equal up to rounding."""
    np.testing.assert_allclose(np.array(values, float), np.array(expected, float), 1e-9, 1e-9)


def test_the_positions_for_outputs_are_those_that_give_them_and_rates_are_slopes(posed):
    case, inputs, values, request = posed
    positions = case.positions(inputs)
    agree(request.positions_of(inputs), positions)
    agree(request.inputs_of(positions), inputs)
    slopes = (case.jacobian(inputs) * case.ratios).T.ravel()
    for shape in ((), (1,), (3,)):
        targets, beside = ([np.full(shape, each) if shape else float(each) for each in numbers]
                           for numbers in (values, [p + 1e-3 for p in positions]))
        for start in (beside, [np.ravel(each)[:1] if shape else each for each in beside]):
            solved, rates = request.positions(targets, start)
            assert [np.shape(each) for each in (*solved, *rates)] == (
                len(solved) + len(rates)) * [shape]
            agree(np.moveaxis(solved, 0, -1), np.broadcast_to(positions, (*shape, len(solved))))
            np.testing.assert_allclose(np.moveaxis(rates, 0, -1), np.broadcast_to(
                slopes, (*shape, len(rates))), 1e-6, 1e-6)
    solved, _ = request.positions(values)
    agree(case.at(request.inputs_of(solved)), values)


def test_efforts_do_the_work_of_the_loads(posed):
    case, inputs, _, _ = posed
    work = np.zeros(len(inputs))
    for load in case.parameters.get('loads', ()):
        name, _, figures = load.partition('=')
        outputs = [f'{name}.x', f'{name}.y'] if ' ' in figures else [name]
        work += np.array([*map(float, figures.split())]) @ case.jacobian(inputs, outputs)
    np.testing.assert_allclose(case.mechanism.efforts(inputs), -work, 1e-6, 1e-7)


@pytest.mark.parametrize('name, output', [
    ('lever', 'lever'), ('lever', 'slide'), ('pump', 'block'), ('boom', 'OB'), ('boom', 'A.x'),
    ('angle', 'B.y')])
def test_a_sensor_gives_the_input_and_an_input_the_sensor(name, output):
    case = Case(name)
    key, = case.mechanism.inputs
    case = Case(name, **{f'{key}.measures': output, f'{key}.ratio': 2.0, f'{key}.offset': 0.125})
    settings, = case.settings
    assert settings.source == f'm_{output}' and settings.actuator == (1.0, 0.0)
    for (value,), speed in itertools.product(case.inputs, (0.0, -0.6)):
        (read,), (slope,) = case.at([value], [output]), case.jacobian([value], [output])[0]
        position, rate = case.mechanism.to_source(settings, value, speed)
        agree([position], [(read - 0.125) / 2.0])
        assert rate == pytest.approx(slope * speed / 2.0, rel=1e-6, abs=1e-9)
        agree(case.mechanism.from_source(settings, position, rate, value + 1e-3), [value, speed])
        assert case.mechanism.from_source(settings, position, None, value)[1] is None
        # Without the last input the start counts; another source is not known.
        first, _ = case.mechanism.from_source(settings, position, None, None)
        agree(first, case.mechanism.from_source(settings, position, None, settings.start)[0])
        assert present_inputs(case.mechanism, {settings.source: position, 'other': 9.0}) == [first]
        assert present_inputs(case.mechanism, {}) == [settings.start]
    # At an extreme of the output nobody knows how fast the input is.
    engine = alone('slider_crank', dimensions__c=0.0, crank__measures='block')
    assert np.isnan(engine.from_source(engine.first, 160.0, 1.0, 0.1)[1])
    if not case.mechanism.linkage.is_angle(output):
        assert math.isnan(case.mechanism.from_source(settings, 1e6, 1.0, 0.0)[0])
        assert present_inputs(case.mechanism, {settings.source: 1e6}) == [settings.start]


def test_where_the_way_leads_out_of_the_sweep_one_input_jumps_into_it():
    """A crank slider without offset has its block where it is at the opposite crank angle."""
    block = 40.0 * math.cos(0.9) + math.sqrt(120.0 ** 2 - (40.0 * math.sin(0.9)) ** 2)
    for sweep, near_, expected in (
            ([0.2, 1.5], -0.5, 0.9), ([-1.5, -0.2], 0.5, -0.9), ([-1.5, 1.5], -0.5, -0.9),
            ([-1.5, 0.9], 0.5, 0.9), ([0.9, 1.5], -0.5, 0.9), ([-0.8, 0.8], 0.5, math.nan),
            ([5.0, 6.0], 0.5, math.tau - 0.9)):
        mechanism = alone('slider_crank', scale=0.5, dimensions__c=0.0, crank__sweep=sweep)
        for jumps in (False, True):
            agree(InverseRequest(mechanism, ['block']).command(
                [0.5 * block], None, [near_], jumps).inputs, [expected])
        agree(mechanism.follow(['block'], [0.5 * block], [near_])[0][0], expected)
        # An end of the sweep is an answer, however the output is rounded.
        answers = [InverseRequest(mechanism, ['block']).answers(
            [0.5 * block * (1.0 + rounding)], [near_]) for rounding in (-2e-16, 0.0, 2e-16)]
        agree([[found for (found,), _ in some[:1]] for some in answers],
              3 * [[expected] * math.isfinite(expected)])


@pytest.mark.parametrize('scale', [0.5, 4.0])
def test_several_inputs_jump_only_if_they_may(scale):
    foot = 0.06 + 0.12j
    modes = [inputs for inputs, _ in five_bar(mechanisms.defaults('five_bar'), foot)]
    start = max(modes)
    ends = [min(inputs[0] for inputs in modes) - 0.1, start[0] - 0.1]
    swept = {'crank.sweep': ends, 'crank.start': ends[0]}
    values = [scale * foot.real, scale * foot.imag]
    for more in ({}, swept):
        request = InverseRequest(alone('five_bar', scale=scale, **more), ['P.x', 'P.y'])
        inside = [mode for mode in modes if not more or mode[0] < ends[1]]
        expected = sorted(inside, key=lambda mode: math.dist(mode, start))
        for jumps in (False, True):
            command = request.command(values, [0.1, 0.0], start, jumps)
            agree(command.inputs, expected[0] if jumps or not more else 2 * [math.nan])
        agree(sorted(inputs for inputs, _ in request.answers(values)), sorted(inside))
    assert inside and len(inside) < len(modes)
    # The end of a sweep is not beyond it, however the outputs are rounded.
    for second in np.linspace(start[1] - 0.3, start[1] + 0.3, 9):
        places = mechanisms.create('five_bar').solve([ends[1], second], ['P'])['P'] * scale
        agree(request.command(places.tolist(), None, [ends[1] - 0.01, second]).inputs,
              [ends[1], second])


@pytest.mark.parametrize('name, sweep, value, reason', [
    ('lever', None, -0.65, 'lever reaches [-0.643501, 0.485518] rad'),
    ('lever', (-1.2, 1.8), 0.49, 'lever reaches [-0.446314, 0.468422] rad in '
     'crank.sweep [-1.2, 1.8]'),
    ('lever', (-1.2, 1.8), -0.47, '-0.47 needs the crank at -1.27982 rad, outside '
     'crank.sweep [-1.2, 1.8]'),
    ('pump', None, 19.1, 'block reaches [19.3649, 39.6863] m'),
    ('boom', (3.4, 5.4), 9.7, 'A.x reaches [7.28913, 9.6] m in boom.sweep [3.4, 5.4]'),
    ('boom', (3.4, 5.4), 7.2, '7.2 needs the boom at 5.41934 m, outside boom.sweep [3.4, 5.4]'),
    ('angle', (3.4, 5.4), 1.2, '1.2 needs the boom at 5.50417 m, outside boom.sweep [3.4, 5.4]'),
    ('angle', None, -1.0, 'OB reaches [-0.92295, 2.21864] rad'),
    *((name, None, value, 'a value must be finite')
      for name in ('lever', 'boom') for value in (math.nan, math.inf))])
def test_a_value_out_of_reach_is_told_the_range_or_the_input_that_it_needs(
        name, sweep, value, reason):
    key, = Case(name).mechanism.inputs
    case = Case(name, **{f'{key}.sweep': sweep or [], f'{key}.start': sweep[0] if sweep else 0.3})
    assert InverseRequest(case.mechanism, case.outputs).reason(value) == reason
    if 'needs' in reason:
        place = float(re.search(rf'{key} at (\S+)', reason)[1])
        near_, = case.at([place])
        assert near_ == pytest.approx(value, rel=1e-4) and not sweep[0] <= place <= sweep[1]
    elif 'reaches' in reason:
        ends = sweep or case.settings[0].reach[0]
        values, = case.at([np.linspace(*ends, 20001)])
        texts = re.search(r'\[(\S+), (\S+)\]', reason).groups()
        agree([*map(float, texts)], [float(f'{end:.6g}') for end in (values.min(), values.max())])


@pytest.mark.parametrize('name, output', [
    # The coordinate across its line, of which rounding is all that moves.
    ('peaucellier', 'C.x'), ('slider_crank', 'B.y')])
def test_an_output_that_stands_still_is_not_told_to_reach_the_wanted_value(name, output):
    mechanism = alone(name)
    value = float(mechanism.linkage.joint_angles(0.3, (output,))[output])
    request = InverseRequest(mechanism, [output])
    assert math.isnan(request.positions([value])[0][0])
    assert request.reason(value) == (
        f'{output} stands still, so that no value of it determines the input')
