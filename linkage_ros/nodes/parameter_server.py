# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The parameter services of a node, answered without keeping its messages waiting.

What is asked for waits in a queue. A worker thread takes all that waits, judges it together, and
hands the outcome over to the executor's thread, which acts on it and sends the answers, in order.
"""

from collections import deque
from dataclasses import dataclass
from functools import partial
from itertools import islice
import threading
from typing import Any, Callable, Deque, Iterable, List, Mapping, Optional

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rcl_interfaces.srv import DescribeParameters, SetParameters, SetParametersAtomically
from rclpy.exceptions import ParameterException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_service import ParameterService

# How long the end of a node waits for its worker, and how soon the worker notices the end [s].
PATIENCE, LONGEST_WAIT = 1.0, 0.1

# A client holds ten answers that it has not taken yet; more are not sent without a pause [s].
BURST, PAUSE = 5, 0.01


class Worker:
    """
    A thread that works through a queue of what is asked for while there is something in it.

    `judge` is called there with all that waits; what it returns is called on the executor's
    thread, and after it one answer after the other. What may be done later is done bit by bit
    while nothing waits.
    """

    def __init__(self, node, judge: Callable[[list], Callable[[], None]]):
        self._node, self._judge = node, judge
        self._lock = threading.Lock()
        self._waiting: List[Asked] = []
        self._later: Deque[Callable[[], Callable[[], None]]] = deque()
        self._thread: Optional[threading.Thread] = None
        self._ended = threading.Event()

    def add(self, asked: 'Asked'):
        """Let something be worked on, after all that waits."""
        with self._lock:
            self._waiting.append(asked)
            self._start()

    def add_later(self, makes: Iterable[Callable[[], Callable[[], None]]]):
        """Let something be made there, and what that returns be called as of `judge`."""
        with self._lock:
            self._later.extend(makes)
            self._start()

    def _start(self):
        if self._thread is None and not self._ended.is_set():
            self._thread = threading.Thread(target=self._run, daemon=True)
            self._thread.start()

    def end(self):
        """Take nothing more, and wait for what is being worked on, but not for ever."""
        with self._lock:
            self._ended.set()
            thread = self._thread
        if thread is not None:
            thread.join(PATIENCE)

    def _run(self):
        while work := self._take():
            work()

    def _take(self):
        with self._lock:
            asked, self._waiting = self._waiting, []
            if self._ended.is_set() or not (asked or self._later):
                self._thread = None
                return None
            return partial(self._answer, asked) if asked else partial(
                self._make, self._later.popleft())

    def _answer(self, asked):
        self._hand_over(self._judge(asked))
        for number, one in enumerate(asked, 1):
            self._hand_over(one.answer)
            if number % BURST == 0:
                self._ended.wait(PAUSE)

    def _make(self, make):
        self._hand_over(make())

    def _hand_over(self, act):
        """Let the executor act, and wait until it has."""
        executor, done = self._node.executor, threading.Event()
        if executor is None:
            return

        def on_its_thread():
            try:
                if not self._ended.is_set():
                    act()
            finally:
                done.set()

        try:
            executor.create_task(on_its_thread)
        except (AttributeError, RuntimeError, rclpy_implementation.InvalidHandle):
            # An executor that has been shut down takes nothing, each distribution's in its way.
            return
        while not (self._ended.is_set() or done.wait(LONGEST_WAIT)):
            pass


@dataclass
class Change:
    """Parameters that are to be set together, and what became of it."""

    parameters: List[Parameter]
    followed: bool = False
    values: Optional[Mapping[str, Any]] = None
    result: Optional[SetParametersResult] = None

    def refuse(self, reason: str):
        """Note why it cannot be."""
        self.result = SetParametersResult(successful=False, reason=reason)


@dataclass
class Asked:
    """Changes that are asked for at once, and how to answer; none: parameters are described."""

    changes: List[Change]
    answer: Callable[[], None]
    names: List[str]


def declare(node: Node, parameters: Mapping[str, Parameter],
            descriptors: Mapping[str, ParameterDescriptor]) -> bool:
    """
    Declare parameters by name, all at once; return whether this client library lets that be.

    Its own way checks and announces each by itself, which takes most of the time that a node of a
    thousand mechanisms needs to start.
    """
    kept = [vars(node).get(name) for name in ('_parameters', '_descriptors')]
    if not all(isinstance(one, dict) for one in kept):
        return False
    for one, new in zip(kept, (parameters, descriptors)):
        one.update(new)
    try:
        if all(Node.get_parameter(node, name) is parameters[name]
               and Node.describe_parameter(node, name) is descriptors[name]
               for name in islice(parameters, 1)):
            return True
    except (AttributeError, ParameterException):
        # It keeps them elsewhere.
        pass
    for one in kept:
        for name in parameters:
            del one[name]
    return False


class ParameterServer(ParameterService):
    """The services of a SceneNode's parameters; what is asked for is handed to `ask`."""

    def __init__(self, node, ask: Callable[[Asked], None]):
        super().__init__(node)
        for service in node.services:
            read = {SetParameters: _each, SetParametersAtomically: _together,
                    DescribeParameters: _described}.get(service.srv_type)
            if read and service.callback.__self__ is self:
                _answer_later(service, read, node, ask)


def _answer_later(service, read: Callable[[Any, Any], Any], node, ask):
    """Let what the callback returns be sent not at once, but when it is complete."""
    send, requests = service.send_response, {}

    def callback(request, response):
        requests[id(response)] = request
        return response

    def later(response, header):
        def answer():
            complete()
            try:
                send(response, header)
            except rclpy_implementation.InvalidHandle:
                pass

        request = requests.pop(id(response))
        changes, names, complete = read(node, request, response)
        ask(Asked(changes, answer, names))

    service.callback, service.send_response = callback, later


def _each(_, request, response):
    changes = [_change([message]) for message in request.parameters]

    def complete():
        response.results = [change.result for change in changes]
    return changes, [], complete


def _together(_, request, response):
    change = _change(request.parameters)

    def complete():
        response.result = change.result
    return [change], [], complete


def _described(node, request, response):
    def complete():
        if all(map(node.has_parameter, request.names)):
            response.descriptors = node.describe_parameters(request.names)
    return [], request.names, complete


def _change(messages):
    try:
        return Change([Parameter.from_parameter_msg(message) for message in messages])
    except ValueError as error:
        change = Change([])
        change.refuse(f'a parameter has no type that there is: {error}')
        return change
