# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The web server of the viewer's page: its files and a WebSocket for each open page."""

from __future__ import annotations

import asyncio
from concurrent.futures import Future
from contextlib import suppress
import ipaddress
import json
from pathlib import Path
import re
import socket
from string import Template
from threading import Thread
from typing import Any, Callable

from aiohttp import web, WSCloseCode, WSMsgType

from .feed import Feed
from .scene_view import JsonObject, SceneView
from .. import palette
from ..words import brief, short_repr, truncated

PAGE = Path(__file__).parent / 'page'
# Files with placeholders for the palette's colours, which are their names in lower case.
COLOURED = {'/style.css': 'text/css', '/icon.svg': 'image/svg+xml'}
COLOURS = {name.lower(): colour for name, colour in vars(palette).items() if name.isupper()}
HEADERS = {
    'Content-Security-Policy':
        "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    'Cross-Origin-Resource-Policy': 'same-origin',
    'Cache-Control': 'no-cache',
    'Referrer-Policy': 'no-referrer',
    'X-Content-Type-Options': 'nosniff',
}
# What the browser sends when it has drawn a picture, and its requests: methods of SceneView.
DRAWN = '"drawn"'
REQUESTS = 'set', 'pose', 'tune', 'curve', 'export', 'read'
# Size of a request; requests that wait; time in which a browser reads a message, and closes.
MAX_BYTES, MAX_WAITING, MAX_READ_S, MAX_CLOSE_S = 1 << 16, 64, 10.0, 1.0


class Server:
    """
    Serves the page from a thread of its own until it is stopped.

    Parameters
    ----------
    view : SceneView
        The scene, which receives the event loop.
    host : str
        Address or name to listen at.
    port : int
        Port to listen at; 0: any free port.

    Raises
    ------
    OSError
        If it cannot listen there.

    """

    def __init__(self, view: SceneView, host: str, port: int) -> None:
        self._view = view
        # Listening at '' in both families of addresses, each would have a free port of its own.
        self._host = host or '0.0.0.0'
        self._clients: set[Client] = set()
        started: Future[Any] = Future()
        self._thread = Thread(target=lambda: asyncio.run(self._serve(port, started)),
                              name='web', daemon=True)
        self._thread.start()
        self._loop, self._stopping, self.port = started.result()

    @property
    def url(self) -> str:
        """Return the page's address for a browser on this machine."""
        host = {'0.0.0.0': '127.0.0.1', '::': '::1'}.get(self._host, self._host)
        return f'http://{f"[{host}]" if ":" in host else host}:{self.port}/'

    def stop(self) -> None:
        """Close all connections and end the thread."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stopping.set)
            self._thread.join()

    async def _serve(self, port: int, started: Future[Any]) -> None:
        self._view.loop = asyncio.get_running_loop()
        app = web.Application(middlewares=[self._guard])
        # A route for each file, so that no path leads out of the folder.
        files = ['', *(path.relative_to(PAGE).as_posix() for path in PAGE.rglob('*')
                       if path.is_file())]
        app.add_routes([web.get('/socket', self._connect),
                        *(web.get(f'/{path}', _file) for path in files)])
        runner = web.AppRunner(app, access_log=None, shutdown_timeout=MAX_CLOSE_S)
        await runner.setup()
        try:
            await web.TCPSite(runner, self._host, port).start()
        except Exception as error:
            await runner.cleanup()
            started.set_exception(error)
            return
        stopping = asyncio.Event()
        started.set_result((self._view.loop, stopping, runner.addresses[0][1]))
        await stopping.wait()
        await asyncio.gather(*(client.close() for client in self._clients))
        await runner.cleanup()

    @web.middleware
    async def _guard(self, request: web.Request, handler: Callable[..., Any]) -> Any:
        """
        Refuse all requests except those of this page.

        A foreign page can reach this server in two ways: by its address, with the page's Origin,
        or by a host name that the page's owner directs to this machine, with that as the Host.
        """
        host = request.headers.get('Host', '')
        origin = request.headers.get('Origin', f'http://{host}')
        try:
            if not self._is_own(host):
                raise web.HTTPForbidden(text=f'{host!r} is not a name of this server.\n')
            if origin.lower() not in (f'http://{host.lower()}', f'https://{host.lower()}'):
                raise web.HTTPForbidden(text=f'{origin!r} is a foreign origin.\n')
            response = await handler(request)
        except web.HTTPException as refusal:
            response = web.Response(status=refusal.status, text=refusal.text)
        if not response.prepared:
            response.headers.update(HEADERS)
            # On an open connection, pipelined requests would accumulate without limit.
            response.force_close()
        return response

    def _is_own(self, host: str) -> bool:
        # Without port, and without the brackets of a numeric address.
        name = re.sub(r'^\[|\]?(:\d*)?$', '', host.lower())
        is_own = name in ('localhost', self._host.lower(), socket.gethostname().lower())
        with suppress(ValueError):
            # A numeric address cannot be directed to another machine.
            is_own |= ipaddress.ip_address(name).is_loopback or self._host in ('0.0.0.0', '::')
        return is_own

    async def _connect(self, request: web.Request) -> Any:
        socket_ = web.WebSocketResponse(
            timeout=MAX_CLOSE_S, max_msg_size=MAX_BYTES, heartbeat=20.0, compress=False,
            autoping=False)
        await socket_.prepare(request)
        client = Client(self._view, socket_)
        self._clients.add(client)
        try:
            # The browser may leave, or not read.
            with suppress(ConnectionError, asyncio.TimeoutError):
                await client.serve()
        finally:
            self._clients.discard(client)
            transport = request.transport
            if transport and transport.get_write_buffer_size():
                # Closing the connection would wait forever for the browser to read this.
                transport.abort()
        return socket_


class Client:
    """
    The page in one browser.

    It receives the newest state only, and markers no faster than it draws them. Each request is
    answered. A browser that does not read is disconnected, so that no messages accumulate.
    """

    def __init__(self, view: SceneView, socket_: web.WebSocketResponse) -> None:
        self._view, self._socket = view, socket_
        self._texts: dict[Any, JsonObject] = {}
        self._offered: set[Feed] = set()
        self._ready = True
        self._news = asyncio.Event()
        self._requests: asyncio.Queue[str] = asyncio.Queue(MAX_WAITING)

    def tell(self, key: Any, message: JsonObject) -> None:
        """Send a message; it replaces a waiting one with the same key."""
        self._texts.pop(key, None)
        self._texts[key] = message
        self._news.set()

    def offer(self, feed: Feed) -> None:
        """Send a feed's newest message when the browser is ready to draw it."""
        self._offered.add(feed)
        self._news.set()

    async def serve(self) -> None:
        """
        Serve the browser until it leaves.

        Raises
        ------
        ConnectionError, TimeoutError
            If it leaves without closing the connection, or does not read.

        """
        self._view.add(self)
        tasks = [asyncio.ensure_future(doing)
                 for doing in (self._receive(), self._answer(), self._send())]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            self._view.remove(self)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def close(self) -> None:
        """Tell the browser that the viewer ends."""
        with suppress(asyncio.TimeoutError):
            await asyncio.wait_for(self._socket.close(
                code=WSCloseCode.GOING_AWAY, message=b'the viewer ended'), 2 * MAX_CLOSE_S)

    async def _receive(self) -> None:
        async for message in self._socket:
            if message.type == WSMsgType.PING:
                # What aiohttp sends by itself waits forever for the browser to read it.
                await asyncio.wait_for(self._socket.pong(message.data), MAX_READ_S)
            elif message.data == DRAWN:
                self._ready = True
                self._news.set()
            elif message.type != WSMsgType.PONG:
                await self._requests.put(message.data)
            # Other tasks get their turn, however many messages arrive.
            await asyncio.sleep(0)

    async def _answer(self) -> None:
        while True:
            number, text = None, await self._requests.get()
            try:
                request = dict(json.loads(text))
                number, op = request.pop('id', None), request.pop('op', None)
                if op not in REQUESTS:
                    raise ValueError(f'unknown request {short_repr(op)}')
                answer = await getattr(self._view, op)(**request)
            except ValueError as reason:
                answer = {'reason': brief(reason)}
            except Exception as error:
                # Without an answer the browser would wait forever.
                answer = {'reason': f'the request fails: {truncated(repr(error), 200)}'}
                self._view.warn(answer['reason'])
            await self._send_message({'op': 'answer', 'reason': '', **answer, 'id': number})

    async def _send(self) -> None:
        while True:
            await self._news.wait()
            self._news.clear()
            while self._texts:
                await self._send_message(self._texts.pop(next(iter(self._texts))))
            if self._ready and self._offered:
                offered, self._offered = self._offered, set()
                picture = b''.join(feed.frame() for feed in offered)
                if picture:
                    self._ready = False
                    await asyncio.wait_for(self._socket.send_bytes(picture), MAX_READ_S)

    async def _send_message(self, message: JsonObject) -> None:
        await asyncio.wait_for(self._socket.send_json(message), MAX_READ_S)


async def _file(request: web.Request) -> web.StreamResponse:
    path = PAGE / (request.path[1:] or 'index.html')
    if request.path not in COLOURED:
        return web.FileResponse(path)
    return web.Response(text=Template(path.read_text('utf-8')).substitute(COLOURS),
                        content_type=COLOURED[request.path])
