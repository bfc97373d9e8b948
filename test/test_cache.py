# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A cache: what it lacks is made, its size is bounded, and threads may do what they like."""

from functools import partial
import random
import sys
import threading

from linkage_ros import mechanisms
from linkage_ros.cache import Cache, cached
import numpy as np
import pytest

THREADS = 6


class Value:
    """Something that can be told from its equals."""

    def __init__(self, key):
        self.key = key


def at_once(*tasks):
    """Do tasks in threads that change hands as often as Python lets them; return what they do."""
    results, errors = [None] * len(tasks), []
    start = threading.Barrier(len(tasks))

    def do(index, task):
        try:
            start.wait(20.0)
            results[index] = task()
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=do, args=each, daemon=True) for each in enumerate(tasks)]
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(100.0)
    finally:
        sys.setswitchinterval(before)
    assert not errors and not any(thread.is_alive() for thread in threads), errors
    return results


def test_what_is_there_is_not_made_again():
    cache = Cache(Value)
    assert cache['a'] is cache['a'] is cache.get_or_make('a', Value) and cache['b'].key == 'b'
    assert cache.get_or_make(None, lambda: None) is cache.get_or_make(None, Value) is None


def test_a_cache_that_makes_nothing_says_what_it_lacks():
    with pytest.raises(KeyError, match='a'):
        Cache()['a']


def test_the_oldest_go_first():
    cache = Cache(Value, size=2)
    first, second = cache[1], cache[2]
    assert cache[3] and cache[2] is second and list(cache) == [2, 3]
    assert cache[1] is not first


def test_what_fails_is_tried_again():
    cache = Cache(lambda key: 1 / key)
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            cache[0]
    assert not cache


def test_what_is_in_use_is_shared_though_it_was_dropped():
    @cached(1, shared=True)
    def shared(key):
        return Value(key)

    held = shared('held')
    gone = id(shared('gone')), shared('last')
    assert len(shared.cache) == 1 and shared('held') is held and gone


def test_two_threads_that_make_the_same_get_one_and_wait_for_nobody():
    both = threading.Barrier(2)

    def make(key):
        both.wait(20.0)
        return Value(key)

    cache = Cache(make)
    one, other = at_once(*2 * [lambda: cache['a']])
    assert one is other is cache['a']


def test_what_is_put_in_may_be_looked_for_by_what_is_dropped():
    class Last(Value):
        def __del__(self):
            cache[self.key + 1000]

    cache = Cache(Value, size=1)
    cache.get_or_make(0, lambda: Last(0))
    at_once(lambda: cache[1])
    assert len(cache) == 1


@pytest.mark.parametrize('shared', [False, True])
def test_threads_hammer_it(shared):
    cache = Cache(Value, size=4, shared=shared)

    def hammer(seed):
        pick, held = random.Random(seed), {}
        for turn in range(2000):
            key = pick.randrange(12)
            value = cache[key] if turn % 2 else cache.get_or_make(key, partial(Value, key))
            assert value.key == key
            assert not shared or held.setdefault(key, value) is value
            if turn % 100 == 0:
                held.clear()

    at_once(*(lambda seed=seed: hammer(seed) for seed in range(THREADS)))
    assert len(cache) <= 4


@pytest.mark.nightly
def test_threads_are_the_first_to_ask_a_linkage_all_at_once():
    theta = np.linspace(-3.0, 3.0, 40)
    questions = [
        lambda leg: leg.solve(0.4)['G'], lambda leg: leg.solve(theta)['G'],
        lambda leg: leg.joint_angles(theta, ('distance(O,G)', 'angle(A,G)'))['angle(A,G)'],
        lambda leg: leg.joint_rates(theta, leg.joints)[leg.joints[-1]],
        lambda leg: leg.acceleration(0.4, 1.0, 0.5)['G'], lambda leg: leg.reach(),
        lambda leg: leg.dead_points(), lambda leg: leg.input_for('G.x', -60.0),
        lambda leg: leg.function(('F',), leg.joints)(0.3), lambda leg: leg.with_dimensions(
            m=14.0).solve(theta)['G'], lambda leg: leg.effort(0.2, {'G': (1.0, -2.0)})]
    joints = mechanisms.design('jansen').joints

    def fresh(number):
        return mechanisms.create('custom', joints=(*joints, f'X{number} ground 0 {number}'),
                                 **mechanisms.defaults('jansen'))

    expected = [question(fresh(0)) for question in questions]
    for number in range(1, 3):
        for legs in ([fresh(number) for _ in questions], [fresh(number + 10)] * len(questions)):
            for results, true in zip(at_once(*map(partial, questions, legs)), expected):
                assert np.array_equal(results, true, equal_nan=True)
