# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Calls from the web server's thread to the node, which only the executor's thread may touch."""

import asyncio
from typing import Any, Callable, Optional

from rclpy.node import Node

from ..nodes.log import Throttle

SECONDS_TO_ANSWER = 3.0
SECONDS_BETWEEN_TRIES = 0.02


class NoAnswer(Exception):
    """A service that is not there or does not answer; the text names it."""


class Bridge:
    """
    What the web's thread asks of a node.

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
        Have a function called in the executor's thread, after those that were asked for before.

        Returns
        -------
        asyncio.Future
            What it returns.

        """
        future = self.loop.create_future()

        def work() -> None:
            try:
                self.hand_over(_settle, future, function(*args))
            except Exception as error:
                # Raised where it was asked for, not in the executor, which would end.
                self.hand_over(_settle, future, None, error)

        self._start(work)
        return future

    def _start(self, work: Callable[[], None]) -> None:
        # Unlike a guard condition, a task works with every executor.
        executor = self.node.executor
        if executor is not None:
            executor.create_task(work)
        else:
            self.loop.call_later(SECONDS_BETWEEN_TRIES, self._start, work)

    async def call(self, client: Any, request: Any) -> Any:
        """Return a service's response; raise NoAnswer if there is none in time."""
        try:
            return await asyncio.wait_for(self._called(client, request), SECONDS_TO_ANSWER)
        except asyncio.TimeoutError:
            raise NoAnswer(f'{client.srv_name} does not answer') from None

    def warn(self, text: str, subject: str = '') -> None:
        """Log what went wrong with a subject, not too often."""
        self._throttle.warn(subject, lambda: text)

    def hand_over(self, function: Callable[..., Any], *args: Any) -> None:
        """Let a function run in the web's thread, if that is still there."""
        try:
            self.loop.call_soon_threadsafe(function, *args)
        except RuntimeError:
            pass

    async def _called(self, client: Any, request: Any) -> Any:
        while not await self.ask(client.service_is_ready):
            await asyncio.sleep(SECONDS_BETWEEN_TRIES)
        future = self.loop.create_future()
        asked = await self.ask(client.call_async, request)
        asked.add_done_callback(lambda done: self.hand_over(_settle, future, done.result()))
        try:
            return await future
        finally:
            self.ask(client.remove_pending_request, asked)


def _settle(future: asyncio.Future[Any], result: Any, error: Optional[Exception] = None) -> None:
    if future.done():
        return
    if error is None:
        future.set_result(result)
    else:
        future.set_exception(error)
