# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Calls from the web server's thread to the node, which only the executor's thread may touch."""

import asyncio
from typing import Any, Callable, Optional

from rclpy.node import Node

from ..nodes.log import Throttle

SECONDS_TO_ANSWER = 3.0
SECONDS_BETWEEN_TRIES = 0.02


class NoAnswer(Exception):
    """A service that is missing or does not answer; the text names it."""


class Bridge:
    """
    Calls from the web's thread to a node.

    Parameters
    ----------
    node : rclpy.node.Node
        A node that some executor spins.

    Attributes
    ----------
    loop : asyncio.AbstractEventLoop
        The web's event loop, which its server sets.

    """

    def __init__(self, node: Node) -> None:
        self.node = node
        self._throttle = Throttle(node.get_logger())
        self.loop: asyncio.AbstractEventLoop

    def ask(self, function: Callable[..., Any], *args: Any) -> asyncio.Future[Any]:
        """
        Call a function in the executor's thread, in the order of requests.

        Returns
        -------
        asyncio.Future
            The function's result.

        """
        future = self.loop.create_future()

        def work() -> None:
            try:
                self.hand_over(_settle, future, function(*args))
            except Exception as error:
                # Raised in the web's thread: in the executor it would end the node.
                self.hand_over(_settle, future, None, error)

        self._start(work)
        return future

    def _start(self, work: Callable[[], None]) -> None:
        # A task works with every executor, a guard condition does not.
        executor = self.node.executor
        if executor is not None:
            executor.create_task(work)
        else:
            self.loop.call_later(SECONDS_BETWEEN_TRIES, self._start, work)

    async def call(self, client: Any, request: Any) -> Any:
        """Return a service's response; raise NoAnswer if there is none in time."""
        try:
            return await asyncio.wait_for(self._response(client, request), SECONDS_TO_ANSWER)
        except asyncio.TimeoutError:
            raise NoAnswer(f'{client.srv_name} does not answer') from None

    def warn(self, text: str, subject: str = '') -> None:
        """Log a throttled warning about a subject."""
        self._throttle.warn(subject, lambda: text)

    def hand_over(self, function: Callable[..., Any], *args: Any) -> None:
        """Run a function in the web's thread, if that is still running."""
        try:
            self.loop.call_soon_threadsafe(function, *args)
        except RuntimeError:
            pass

    async def _response(self, client: Any, request: Any) -> Any:
        while not await self.ask(client.service_is_ready):
            await asyncio.sleep(SECONDS_BETWEEN_TRIES)
        future = self.loop.create_future()
        pending = await self.ask(client.call_async, request)
        pending.add_done_callback(lambda done: self.hand_over(_settle, future, done.result()))
        try:
            return await future
        finally:
            self.ask(client.remove_pending_request, pending)


def _settle(future: asyncio.Future[Any], result: Any, error: Optional[Exception] = None) -> None:
    if future.done():
        return
    if error is None:
        future.set_result(result)
    else:
        future.set_exception(error)
