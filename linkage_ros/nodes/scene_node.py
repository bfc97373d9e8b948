# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What the three nodes share: a scene as parameters that can be changed, and `main`."""

from contextlib import contextmanager
from copy import copy
from functools import partial, wraps
import gc
from itertools import groupby
from shlex import quote
import sys
from typing import Any, List, NamedTuple

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from .ownership import Announcer, Follower
from .parameter_server import Asked, Change, declare, ParameterServer, Worker
from .signals import Goodbye
from .. import scene
from ..scene import slider
from ..words import elided, listed, quoted

try:
    from rclpy.experimental import EventsExecutor as Executor
except ImportError:
    Executor = SingleThreadedExecutor

RCLError = rclpy_implementation.RCLError

# Some builds of the EventsExecutor wait well for a while, but busily and deaf to signals for ever.
LONGEST_WAIT = 1.0

# How long a thread that prepares a change may keep a message waiting [s]. Where it is less, that
# thread also takes turns amid a message, and more messages are late.
SWITCH_INTERVAL = 0.0005

SECONDS_BETWEEN_LOOKS = 2.0


def until_the_end(callback):
    """Let a callback of a node fail in silence where it fails because its context has ended."""
    @wraps(callback)
    def guarded(self, *args):
        try:
            callback(self, *args)
        except RCLError:
            # A signal ends the context at any time, even while a message is being published.
            if self.context.ok():
                raise
    return guarded


class State(NamedTuple):
    """What a node acts on: a scene, and what is made for it."""

    scene: scene.Scene
    prepared: Any


class SceneNode(Node):
    """
    A node that acts on a scene.

    A subclass overrides `prepare` and `adopt`, and ends its constructor with `begin`. A change
    that makes no scene, or that cannot be prepared, is refused, and what was there goes on.

    Raises
    ------
    SceneError
        If the parameters that the node is started with make no scene.

    """

    def __init__(self, name: str, **kwargs):
        super().__init__(name, start_parameter_services=False, **kwargs)
        self._role = name
        # rclpy has no public way to see overrides that nobody declares.
        given = {key: scene.plain(p.value) for key, p in self._parameter_overrides.items()}
        with self._or_destroyed():
            self.scene = scene.read(given)
        self._state = State(self.scene, None)
        own = [p for p in self.scene.parameters if name in p.field.readers]
        self.fields = {parameter.name: parameter.field for parameter in own}
        self._declare(own)
        self._worker = Worker(self, self._judge)
        self._announcer = self._follower = None
        self._later = []
        self._first_spin = self.create_timer(0.0, self._start_later,
                                             clock=Clock(clock_type=ClockType.STEADY_TIME))

    def begin(self):
        """Adopt the first scene, and let others ask for changes."""
        with self._or_destroyed():
            self._state = self._state._replace(prepared=self.prepare(self.scene))
        self.adopt(self._state.prepared)
        if self._role == scene.OWNER:
            self._announcer = Announcer(self)
            self._later.append(self._announcer.first)
        else:
            self._follower = Follower(self, self._worker.add)
        self._parameter_service = ParameterServer(self, self._worker.add)
        self._namesakes = self.create_timer(SECONDS_BETWEEN_LOOKS, self._look_for_namesakes,
                                            clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _start_later(self):
        self._first_spin.cancel()
        self._worker.add_later(self._later)

    def prepare(self, new: scene.Scene) -> Any:
        """
        Make all that a new scene needs, and change nothing in the node.

        It may run in a worker thread while messages are handled; SceneError refuses the scene.
        """
        return new

    def adopt(self, prepared: Any):
        """Swap in what was prepared; quick, on the executor's thread."""

    def serves(self) -> str:
        """Return in words what the node does, for its first message."""
        return listed(self.scene.machines, 200)

    def destroy_node(self):
        """End the worker too."""
        if hasattr(self, '_worker'):
            self._worker.end()
        super().destroy_node()

    @contextmanager
    def _or_destroyed(self):
        try:
            yield
        except scene.SceneError:
            self.destroy_node()
            raise

    def _declare(self, own):
        """Declare parameters; their ranges are no business of the client library's."""
        typed = {parameter.name: _typed(parameter) for parameter in own}
        of = {field: _descriptor(field) for field in set(self.fields.values())}
        descriptors = {parameter.name: of[parameter.field] for parameter in own}
        if not declare(self, typed, descriptors):
            for name, parameter in typed.items():
                # The type does not depend on the value: an empty list has none.
                value = parameter.value if parameter.value != () else parameter.type_
                self.declare_parameter(name, value, copy(descriptors[name]), ignore_override=True)
                if parameter.value == () and not descriptors[name].read_only:
                    super().set_parameters_atomically([parameter])

    def describe_parameter(self, name: str) -> ParameterDescriptor:
        """Describe a parameter, with the range of its slider around the present value."""
        descriptor = copy(super().describe_parameter(name))
        descriptor.name = name
        if name not in self.fields:
            return descriptor
        value = scene.plain(self.get_parameter_or(name).value)
        ends = slider.ends(self.scene, scene.Parameter(name, self.fields[name], value))
        if ends and self.fields[name].kind == 'integer':
            descriptor.integer_range = [
                IntegerRange(from_value=ends[0], to_value=ends[1], step=1)]
        elif ends:
            # A step other than 0 refuses values that are stops up to rounding.
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=ends[0], to_value=ends[1], step=0.0)]
        return descriptor

    def set_parameters(self, parameters) -> List[SetParametersResult]:
        """Set parameters one by one, at once; return what became of each."""
        return [self.set_parameters_atomically([parameter]) for parameter in parameters]

    def set_parameters_atomically(self, parameters) -> SetParametersResult:
        """Set parameters together, at once; return what became of them."""
        change = Change(list(parameters))
        state = self._outcome(self._state, [change])
        if change.result is None:
            self._take(state, [change])
        return change.result

    def _judge(self, asked: List[Asked]):
        """Judge all that is asked for, in the worker's thread; return how to act on it."""
        base = self._state
        changes = [change for one in asked for change in one.changes
                   if all(p.name in self.fields for p in change.parameters)]
        state = self._outcome(base, changes)
        for name in {name for one in asked for name in one.names if self.has_parameter(name)}:
            # What is found is remembered until the answer is written.
            self.describe_parameter(name)
        return partial(self._finish, base, state, changes, asked)

    def _finish(self, base, state, changes, asked):
        if self._state is not base:
            state = self._outcome(self._state, changes)
        accepted = [change for change in changes if change.result is None]
        if accepted:
            self._take(state, accepted)
        for one in asked:
            for change in one.changes:
                if change.result is None:
                    self._set_at_once(change)

    def _set_at_once(self, change):
        unknown = [p.name for p in change.parameters if not self.has_parameter(p.name)]
        if unknown:
            change.refuse(f'{elided(unknown[0])} is not a parameter of '
                          f'{self.get_fully_qualified_name()}')
        else:
            change.result = self.set_parameters_atomically(change.parameters)

    def _outcome(self, base, changes) -> State:
        """Return the state after changes; those that cannot be are refused."""
        for change in changes:
            try:
                change.values = self._wanted(change)
            except scene.SceneError as error:
                change.refuse(str(error))
        able = [change for change in changes if change.result is None]
        for followed, together in groupby(able, lambda change: change.followed):
            strict = not followed and self._role in scene.START.readers
            together = list(together)
            if followed:
                _leave_out(together, base.scene)
            if _merge(together) or not followed:
                base = self._merged(base, together, strict)
        return base

    def _wanted(self, change):
        values = {}
        for parameter in change.parameters:
            if parameter.name in self.fields:
                value = self._checked(parameter)
                if not change.followed:
                    self._refuse_owned(parameter.name, value)
                values[parameter.name] = value
        return values

    def _checked(self, parameter):
        name, field = parameter.name, self.fields[parameter.name]
        if parameter.type_ == Parameter.Type.NOT_SET:
            raise scene.SceneError(f'{name} cannot be removed; it must be {field.allowed}')
        value = field.checked(name, parameter.value)
        if field.read_only:
            raise scene.SceneError(f'read-only while the node runs: {name}; give it at the start')
        return value

    def _refuse_owned(self, name, value):
        owner = self._follower and self._follower.owner_of(name)
        if owner:
            raise scene.SceneError(
                f'{name} belongs to {owner} while it runs: ros2 param set {owner} {name} '
                + quote(quoted(list(value) if isinstance(value, tuple) else value)))

    def _merged(self, base, changes, strict) -> State:
        """Return the state after changes: all of them together, else half by half."""
        try:
            new = scene.changed(base.scene, _merge(changes), strict)
            return State(new, self.prepare(new))
        except scene.SceneError as error:
            reason = str(error)
        except Exception as problem:
            # Whoever asked waits for ever for a service that raised.
            self.get_logger().error(f'internal error: {problem!r}')
            reason = elided(f'internal error: {problem!r}', 299)
        if len(changes) == 1:
            changes[0].refuse(reason)
            return base
        half = len(changes) // 2
        return self._merged(self._merged(base, changes[:half], strict), changes[half:], strict)

    def _take(self, state, changes):
        """Let a state be the node's, with the parameters of the changes that brought it."""
        asked = {p.name: p for change in changes for p in change.parameters
                 if not change.followed or p.name in change.values}
        changed = state.scene.changed_from(self.scene)
        # Values that nobody set may follow from others.
        typed = {p.name: _typed(p) for p in changed
                 if p.name in self.fields and not self.fields[p.name].read_only}
        same = {name: self.get_parameter(name) if name in self.fields else parameter
                for name, parameter in asked.items()}
        together = [*{**same, **typed}.values()]
        result = super().set_parameters_atomically(together) if together else (
            SetParametersResult(successful=True))
        if not result.successful and len(changes) > 1:
            for change in changes:
                change.result = self.set_parameters_atomically(change.parameters)
            return
        for change in changes:
            change.result = result
        if result.successful and state is not self._state:
            self._state, self.scene = state, state.scene
            self.adopt(state.prepared)
            if self._announcer:
                self._announcer.announce(changed)

    def _look_for_namesakes(self):
        me = self.get_name(), self.get_namespace()
        if self.get_node_names_and_namespaces().count(me) > 1:
            self._namesakes.cancel()
            self.get_logger().warning(
                f'there is another node {self.get_fully_qualified_name()}: what one of them '
                'publishes or answers comes twice; give each a name or a namespace of its own')


def _merge(changes):
    return {name: value for change in changes for name, value in change.values.items()}


def _leave_out(changes, old):
    """Leave out of changes what together they leave as it is in a scene."""
    new = _merge(changes)
    machines = {name.partition('.')[0] for name in new} & old.machines.keys()
    here = {p.name: p.value for name in machines for p in old.machines[name].parameters}
    for change in changes:
        change.values = {name: value for name, value in change.values.items()
                         if new[name] != here.get(name)}


def _typed(parameter):
    """Return a parameter whose type does not depend on its value: an empty list has none."""
    kind = Parameter.Type[parameter.field.kind.upper()]
    return Parameter(parameter.name, kind, parameter.value)


def _descriptor(field):
    """Return how a kind of parameter is described, whatever its name."""
    return ParameterDescriptor(description=field.meaning, read_only=field.read_only,
                               type=Parameter.Type[field.kind.upper()].value,
                               additional_constraints=field.allowed)


def run(node_class, name: str, args=None, executor_class=Executor) -> int:
    """Run a node until it is interrupted; return the exit code of the process."""
    return run_together(lambda: [node_class()], name, args, executor_class)


def run_together(make, name: str, args=None, executor_class=Executor) -> int:
    """Run the nodes that are made, in one executor, until they are interrupted; as `run`."""
    with Goodbye() as goodbye:
        return _run(make, name, args, executor_class, goodbye)


def _run(make, name, args, executor_class, goodbye):
    sys.setswitchinterval(SWITCH_INTERVAL)
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        _refuse_arguments(args)
    except (RuntimeError, scene.SceneError) as error:
        # What the client library makes of an argument may be as long as that.
        rclpy.try_shutdown()
        unknown = isinstance(error, rclpy_implementation.UnknownROSArgsError)
        what = 'nothing after --ros-args is called ' if unknown else ''
        hint = '; allowed: -p, -r, --params-file, --log-level, ...' if unknown else ''
        return _failed(name, elided(f'bad arguments: {what}{error}', 240) + hint)
    try:
        # Nothing of what is made is dropped: there is nothing to collect.
        gc.disable()
        for node in make():
            _refuse_namesake(node, goodbye.nodes)
            goodbye.nodes.append(node)
            if isinstance(node, SceneNode):
                node.get_logger().info(f'ready: {node.serves()}')
        # What has been made so far stays: the collector need not look through it again and again.
        gc.freeze()
        gc.enable()
        _spin(executor_class(), goodbye)
    except ExternalShutdownException:
        pass
    except scene.SceneError as error:
        return _failed(name, error)
    except RCLError:
        if rclpy.ok():
            raise
    finally:
        gc.enable()
        for node in goodbye.nodes:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _refuse_namesake(node, others):
    name = node.get_name()
    if name in {other.get_name() for other in others}:
        node.destroy_node()
        raise scene.SceneError(f'two nodes would be called {name}; to rename one of them: '
                               '-r kinematics:__node:=NAME')


def _spin(executor, goodbye):
    try:
        # `wake` wakes not every executor.
        goodbye.wake = lambda: executor.create_task(lambda: None)
        for node in goodbye.nodes:
            executor.add_node(node)
        while rclpy.ok() and not goodbye.is_over:
            executor.spin_once(timeout_sec=LONGEST_WAIT)
    finally:
        executor.shutdown()
        goodbye.left.set()


def _refuse_arguments(args):
    unknown = remove_ros_args(args)[1:]
    if unknown:
        raise scene.SceneError(f'unknown argument {quoted(unknown[0])}: there are none but '
                               'those of ROS, after --ros-args')


def _failed(name: str, error) -> int:
    get_logger(name).fatal(str(error))
    return 1
