# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Base class of the three nodes, whose parameters are a scene, and functions to run nodes."""

from __future__ import annotations

from functools import partial
import gc
import sys
import types
from typing import Any, Callable, Generator, Iterable, Mapping

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args, try_shutdown

from .log import Incidents
from .ownership import Announcer, Follower
from .parameters import SceneParameters
from .shutdown import ShutdownHandler
from .worker import Worker
from .. import scene as scenes
from ..words import join_names, short_repr, truncated

try:
    from rclpy.experimental import EventsExecutor as Executor
    from rclpy.impl.implementation_singleton import rclpy_implementation as implementation

    # `Executor` is a function that makes one. Jazzy's awaits no callback of a service, so there
    # requests are answered as they come; it has no `create_future` either.
    AWAITS = hasattr(implementation.EventsExecutor, 'create_future')
except ImportError:
    Executor, AWAITS = SingleThreadedExecutor, True

# Longest wait for an event [s], so that a signal is noticed. Some builds of the EventsExecutor do
# not wait without a limit, either.
MAX_WAIT_S = 0.25

# Longest time for which the worker thread delays a message [s]. At shorter intervals, it would
# interrupt the processing of messages, and more of them would be late.
SWITCH_INTERVAL_S = 0.0005

# Time between two checks for another node of the same name [s].
NAMESAKE_CHECK_PERIOD_S = 2.0


class SceneNode(Node):
    """
    Base class of the nodes of a scene.

    A subclass overrides `check`, `prepare` and `adopt`, and calls `begin` last in its constructor.
    A change of parameters is validated and answered at once; a worker thread prepares the changed
    scene, then the node adopts it. If further changes arrive meanwhile, only the newest scene is
    prepared. Raises SceneError if the initial parameters are invalid. Its executor must have one
    thread.
    """

    # What the node does, for its first log message.
    task = '{mechanisms}'
    # Whether the executor awaits callbacks of services.
    awaits = AWAITS

    def __init__(self, name: str, **kwargs: Any):
        super().__init__(name, automatically_declare_parameters_from_overrides=True, **kwargs)
        incidents = Incidents(self.get_logger(), lambda: not self.context.ok())
        self.guarded, self.report = incidents.guarded, incidents.report
        self.worker = Worker(self, incidents.guarded)
        self._announcer: Announcer | None = None
        # Numbers of requests to set parameters: answered, and waiting.
        self._answered = self._waiting = 0
        self._parameters_of_scene = SceneParameters(self, name, self.check, self._pass_scene)
        # The scenes that were adopted, and passed to the worker, last.
        self._adopted = self._passed = self.scene
        # The Field of each parameter that the node owns, by name; whether it was started with any
        # parameters of a scene.
        self.fields: Mapping[str, scenes.Field] = self._parameters_of_scene.fields
        self.is_given = self._parameters_of_scene.is_given
        self._role = name
        self._first_spin = self.create_timer(
            0.0, self.guarded('the first spin', self._start),
            clock=Clock(clock_type=ClockType.STEADY_TIME))

    @property
    def scene(self) -> scenes.Scene:
        """Return the scene of the present parameters."""
        return self._parameters_of_scene.scene

    @property
    def is_settled(self) -> bool:
        """Whether the scene of the present parameters has been adopted."""
        return self._adopted is self.scene

    def begin(self) -> None:
        """Adopt the first scene; then announce the node's parameters, and follow the others."""
        self.check(self.scene)
        self._adopt(self.scene, self.prepare(self.scene))
        if self.fields:
            self._announcer = Announcer(self)
        if self._role != scenes.KINEMATICS:
            Follower(self, self._parameters_of_scene)
        self._namesakes = self.create_timer(
            NAMESAKE_CHECK_PERIOD_S, self.guarded('a check of names', self._warn_of_namesake),
            clock=Clock(clock_type=ClockType.STEADY_TIME))

    def check(self, new: scenes.Scene) -> None:
        """Raise SceneError if the node does not support a scene. It delays messages: be fast."""

    def prepare(self, new: scenes.Scene) -> Any:
        """Return what `adopt` needs of a scene; run in the worker's thread, do not change self."""
        return new

    def adopt(self, prepared: Any) -> None:
        """Use the result of `prepare` from now on. It delays messages: be fast."""

    def declare_parameters(self, namespace: str, parameters: Any, ignore_override: bool = False
                           ) -> list[Parameter]:
        """Declare parameters as rclpy does, and allow empty lists in a parameter file."""
        for _, *value, descriptor in (entry for entry in parameters if len(entry) > 2):
            descriptor.dynamic_typing = descriptor.dynamic_typing or value == [None]
        return super().declare_parameters(namespace, parameters, ignore_override)

    def describe_parameter(self, name: str) -> ParameterDescriptor:
        """Return a parameter's descriptor, with the range of allowed values."""
        return self._parameters_of_scene.ranged(name, super().describe_parameter(name))

    def create_service(self, srv_type: Any, srv_name: str, callback: Callable, **kwargs: Any
                       ) -> Any:
        """Create a service; if its callback raises, the response is a failure with a reason."""
        if srv_type is SetParameters:
            callback = partial(self._set_parameters, callback)
        is_in_turn = self.awaits and srv_type in (SetParameters, SetParametersAtomically)
        respond = partial(self._respond_in_turn if is_in_turn else self._respond, callback)
        return super().create_service(srv_type, srv_name, respond, **kwargs)

    def destroy_node(self) -> None:
        """Stop the worker, and destroy the node."""
        self.worker.end()
        super().destroy_node()

    def _respond(self, callback: Callable, request: Any, response: Any) -> Any:
        try:
            return callback(request, response)
        except Exception as error:
            self.report('a request', error)
            return _refused(response, truncated(f'internal error: {error!r}', 299))

    async def _respond_in_turn(self, callback: Callable, request: Any, response: Any) -> Any:
        """
        Respond when no other request was answered since the executor's last turn.

        In a turn the executor runs all that is waiting: messages wait for one request at most.
        """
        answered, self._waiting = -1, self._waiting + 1
        while answered != self._answered:
            answered = self._answered
            await _turn()
        self._answered += 1
        response = self._respond(callback, request, response)
        self._waiting -= 1
        self._pass_scene()
        return response

    def _set_parameters(self, callback: Callable, request: Any, response: Any) -> Any:
        """Set the values that are valid by themselves together, all others by rclpy."""
        results = self._parameters_of_scene.set_together(request.parameters)
        for i, parameter in enumerate(request.parameters):
            if i not in results:
                single = SetParameters.Request(parameters=[parameter])
                results[i], = self._respond(callback, single, SetParameters.Response()).results
        response.results = [results[i] for i in range(len(results))]
        return response

    def _pass_scene(self) -> None:
        """Have the newest scene prepared and adopted, unless waiting requests may change it."""
        new = self.scene
        if not self._waiting and self._passed is not new:
            self._passed = new
            if type(self).prepare is SceneNode.prepare:
                self._adopt(new, new)
            else:
                self.worker.queue('a changed scene', lambda: partial(
                    self._adopt, new, self.prepare(new)), is_next=True)

    def _adopt(self, new: scenes.Scene, prepared: Any) -> None:
        """Adopt a prepared scene, then announce what has changed."""
        self.adopt(prepared)
        if self._announcer:
            self._announcer.announce(new.changed_from(self._adopted))
        self._adopted = new

    def _start(self) -> None:
        """Do what would delay the start."""
        self._first_spin.cancel()
        self.worker.run_next()
        if self._announcer:
            self._announcer.announce()

    def _warn_of_namesake(self) -> None:
        me = self.get_name(), self.get_namespace()
        if self.get_node_names_and_namespaces().count(me) > 1:
            self._namesakes.cancel()
            self.get_logger().warning(
                f'there is another node {self.get_fully_qualified_name()}: both publish every '
                'message and answer every request; give each its own name or namespace')


@types.coroutine
def _turn() -> Generator[None, None, None]:
    """Wait until the executor has run all that is waiting."""
    yield


def _refused(response: Any, reason: str) -> Any:
    """Return a service's response to a request that failed."""
    result = SetParametersResult(successful=False, reason=reason)
    if hasattr(response, 'results'):
        response.results.append(result)
    elif hasattr(response, 'message'):
        response.success, response.message = False, reason
    elif isinstance(getattr(response, 'result', None), SetParametersResult):
        response.result = result
    return response


def run(node_classes: Iterable[Callable[[], Node]], name: str, args: Any = None,
        executor_class: Any = Executor) -> int:
    """
    Run nodes in one executor until SIGINT or SIGTERM; return the exit code.

    They are created in this order, so that each can have what those before it announce. `name` is
    for messages before there is a node.
    """
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    nodes: list[Node] = []
    with ShutdownHandler() as shutdown:
        try:
            rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
            if unknown := remove_ros_args(args)[1:]:
                raise scenes.SceneError(f'unknown argument {short_repr(unknown[0])}: allowed are '
                                        'only those of ROS: --ros-args --params-file SCENE')
        except (RuntimeError, scenes.SceneError) as error:
            # The message of rclpy may quote a long argument.
            try_shutdown()
            return _failed(name, truncated(f'bad arguments: {error}', 240))
        try:
            # The creation of nodes leaves no garbage; collecting would only delay it.
            gc.disable()
            for node_class in node_classes:
                node = node_class()
                nodes.append(node)
                if isinstance(node, SceneNode):
                    node.get_logger().info('ready: ' + node.task.format(
                        mechanisms=join_names(node.scene.mechanisms, 200), rate=node.scene.rate))
            # All objects so far are permanent; collections need not visit them.
            gc.freeze()
            gc.enable()
            _spin(executor_class(), nodes, shutdown, name)
        except ExternalShutdownException:
            pass
        except (scenes.SceneError, ImportError, ParameterException) as error:
            return _failed(name, error)
        finally:
            gc.enable()
            for node in nodes:
                node.destroy_node()
            # Unlike this function, `rclpy.try_shutdown` restores the default signal handlers, by
            # which the next signal would kill the process.
            try_shutdown()
    return 0


def _spin(executor: Any, nodes: list[Node], shutdown: ShutdownHandler, name: str) -> None:
    incidents = Incidents(get_logger(name), lambda: not rclpy.ok())
    try:
        for node in nodes:
            executor.add_node(node)
        while rclpy.ok() and not shutdown.is_over:
            try:
                executor.spin_once(timeout_sec=MAX_WAIT_S)
            except ExternalShutdownException:
                raise
            except Exception as error:
                # A callback of rclpy, such as a parameter service.
                incidents.report('a request', error)
    finally:
        executor.shutdown()


def _failed(name: str, error: Any) -> int:
    get_logger(name).fatal(str(error))
    return 1
