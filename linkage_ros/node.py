# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""What the three nodes share: a scene as parameters that can be changed, and `main`."""

from functools import wraps
import gc
import signal
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.parameter import Parameter

from . import scene

try:
    from rclpy.experimental import EventsExecutor as Executor
except ImportError:
    Executor = SingleThreadedExecutor

RCLError = rclpy_implementation.RCLError

# Some builds of the EventsExecutor wait well for a while, but busily and deaf to signals for ever.
LONGEST_WAIT = 1.0


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


class SceneNode(Node):
    """
    A node that acts on a scene.

    A subclass overrides `prepare` and `adopt`, and starts with `self.adopt(self.prepare(
    self.scene))`; each new scene comes the same way. A change that makes no scene, or that cannot
    be prepared, is refused, and what was there goes on.

    Raises
    ------
    SceneError
        If the parameters that the node is started with make no scene.

    """

    def __init__(self, name: str, **kwargs):
        super().__init__(name, **kwargs)
        # rclpy has no public way to see overrides that nobody declares.
        self._given = {key: p.value for key, p in self._parameter_overrides.items()}
        try:
            self.scene = scene.read(self._given)
        except scene.SceneError:
            self.destroy_node()
            raise
        self._echoing = False
        self._own = {p.name for p in self.scene.parameters if name in p.field.readers}
        for parameter in self._shown():
            self._declare(parameter)
        self.add_on_set_parameters_callback(self._judge)
        self.add_post_set_parameters_callback(self._accept)

    def prepare(self, new: scene.Scene) -> Any:
        """
        Make all that a new scene needs, and change nothing in the node.

        It may run in a worker thread while messages are handled; SceneError refuses the scene.
        """
        return new

    def adopt(self, prepared: Any):
        """Swap in what was prepared; quick, on the executor's thread."""

    def _shown(self):
        return [p for p in self.scene.parameters if p.name in self._own]

    def _declare(self, parameter):
        # Typing is left to the scene, whose refusals name the parameter and what it may be.
        descriptor = ParameterDescriptor(
            description=parameter.field.meaning, additional_constraints=parameter.field.allowed,
            read_only=parameter.field.read_only, dynamic_typing=True)
        if parameter.range and parameter.field.kind == 'integer':
            descriptor.integer_range = [IntegerRange(
                from_value=parameter.range[0], to_value=parameter.range[1], step=1)]
        elif parameter.range:
            # A step other than 0 refuses values that are stops up to rounding.
            descriptor.floating_point_range = [FloatingPointRange(
                from_value=parameter.range[0], to_value=parameter.range[1], step=0.0)]
        self.declare_parameter(parameter.name, parameter.value, descriptor, ignore_override=True)
        if parameter.value == ():
            self.set_parameters([_typed(parameter)])

    def _changed(self, parameters):
        return {**self._given, **{p.name: p.value for p in parameters if p.name in self._own}}

    def _judge(self, parameters):
        if self._echoing:
            return SetParametersResult(successful=True)
        try:
            for parameter in parameters:
                if parameter.name in self._own and parameter.type_ == Parameter.Type.NOT_SET:
                    raise scene.SceneError(f'{parameter.name} cannot be removed')
            new = scene.read(self._changed(parameters))
            self._prepared = new, self.prepare(new)
        except scene.SceneError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _accept(self, parameters):
        if not self._echoing:
            self._given = self._changed(parameters)
            self.scene, prepared = self._prepared
            self.adopt(prepared)
            self._echo()

    def _echo(self):
        """Show the new values of parameters that nobody set and that follow from others."""
        self._echoing = True
        self.set_parameters([_typed(p) for p in self._shown() if not p.field.read_only
                             and p.value != scene.plain(self.get_parameter(p.name).value)])
        self._echoing = False


def _typed(parameter):
    """Return a parameter whose type does not depend on its value: an empty list has none."""
    kind = Parameter.Type[parameter.field.kind.upper()]
    return Parameter(parameter.name, kind, parameter.value)


def run(node_class, name: str, args=None, executor_class=Executor) -> int:
    """Run a node until it is interrupted; return the exit code of the process."""
    # An interrupt is to end the context, as it does, but not to raise amid a callback.
    signal.signal(signal.SIGINT, lambda *_: None)
    try:
        rclpy.init(args=args)
    except RCLError as error:
        return _failed(name, error)
    node = None
    try:
        node = node_class()
        # What has been made so far stays: the collector need not look through it again and again.
        gc.freeze()
        _spin(node, executor_class())
    except ExternalShutdownException:
        pass
    except scene.SceneError as error:
        return _failed(name, error)
    except RCLError:
        if rclpy.ok():
            raise
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _spin(node, executor):
    executor.add_node(node)
    try:
        while rclpy.ok():
            executor.spin_once(timeout_sec=LONGEST_WAIT)
    finally:
        executor.shutdown()


def _failed(name: str, error: Exception) -> int:
    get_logger(name).fatal(str(error))
    return 1
