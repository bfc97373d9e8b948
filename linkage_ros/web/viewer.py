# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Node that serves a page with the running scene and sliders to change it."""

from errno import EADDRINUSE
from typing import Any

from rcl_interfaces.msg import IntegerRange, ParameterDescriptor
from rclpy.exceptions import ParameterException
from rclpy.node import Node

from .scene_view import SceneView
from .. import scene
from ..nodes import scene_node, shutdown
from ..optional import needs

VIEWER = 'viewer'
PORT = 8020
# Name, default, description and ranges.
PARAMETERS = [
    ('host', '127.0.0.1', 'Address to listen at; 127.0.0.1: for browsers on this machine alone. '
     'Whoever reaches it can move the scene.', []),
    ('port', PORT, 'Port to listen at; 0: any that is free.', [
        IntegerRange(from_value=0, to_value=65535, step=1)]),
    ('or_any_port', False, 'Whether to listen at any free port where that one is taken.', [])]


class Viewer(Node):
    """
    Serves a page with the mechanisms of the graph; it subscribes only while a page is open.

    Raises
    ------
    SceneError
        If it cannot listen at its host and port.
    ImportError
        Without an aiohttp that works.

    """

    def __init__(self, **kwargs: Any) -> None:
        with needs('aiohttp'):
            from .server import Server
        super().__init__(VIEWER, **kwargs)
        try:
            self._server = self._served(Server)
        except (OSError, ParameterException) as error:
            super().destroy_node()
            in_use = getattr(error, 'errno', None) == EADDRINUSE
            raise scene.SceneError(f'the viewer cannot be started: {error}' + in_use * (
                '; for another port use -p port:=8021, with ros2 launch port:=8021, with make '
                'view PORT=8021; port 0 is any free one')) from None
        self.url = self._server.url
        self.get_logger().info(f'Look at {self.url}')

    def destroy_node(self) -> None:
        """Stop the server, then end."""
        self._server.stop()
        super().destroy_node()

    def _served(self, server: Any) -> Any:
        host, port, or_any_port = (self.declare_parameter(name, default, ParameterDescriptor(
            description=description, read_only=True, integer_range=ranges)).value
            for name, default, description, ranges in PARAMETERS)
        try:
            return server(SceneView(self), host, port)
        except OSError as error:
            if not or_any_port or error.errno != EADDRINUSE:
                raise
            return server(SceneView(self), host, 0)


def main(args: list[str] | None = None) -> int:
    """Run the node; return the exit code."""
    return scene_node.run([Viewer], VIEWER, args)


if __name__ == '__main__':
    shutdown.run(main)
