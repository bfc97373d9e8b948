# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The web server of the viewer's page: its files and a WebSocket for each open page."""

from __future__ import annotations

import asyncio
from concurrent.futures import Future
from contextlib import suppress
from importlib.resources import files
import ipaddress
import json
import logging
import socket
from string import Template
from threading import Thread
from typing import Any, Callable
from urllib.parse import SplitResult, urlsplit

from aiohttp import web, WSCloseCode

from .bridge import Bridge
from .feed import Feed
from .poses import number, Refused
from .scene_view import SceneView
from .. import palette
from ..words import quoted

Message = dict[str, Any]

PAGE = files(__package__) / 'page'
FOLDERS = {'': PAGE, 'vendor/': PAGE / 'vendor'}
KINDS = {'.html': 'text/html', '.css': 'text/css', '.js': 'text/javascript',
         '.svg': 'image/svg+xml'}
# Files with placeholders for the palette's colours, which are their names in lower case.
COLOURED = ('.css', '.svg')
COLOURS = {name.lower(): colour for name, colour in vars(palette).items() if name.isupper()}
HEADERS = {
    'Content-Security-Policy':
        "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    'Cross-Origin-Resource-Policy': 'same-origin',
    'Cache-Control': 'no-cache',
    'Referrer-Policy': 'no-referrer',
    'X-Content-Type-Options': 'nosniff',
}
MOST_BYTES, MOST_WAITING = 1 << 16, 64
SECONDS_TO_CLOSE = 1.0
SECONDS_TO_READ = 10.0
# An integer with more digits is read as a float.
MOST_FIGURES = 18
CLOSED_FOR = {
    WSCloseCode.MESSAGE_TOO_BIG: f'a message may have {MOST_BYTES} bytes'.encode(),
    WSCloseCode.INVALID_TEXT: b'a text must be UTF-8',
    WSCloseCode.PROTOCOL_ERROR: b'this is not a WebSocket frame',
}


class Server:
    """
    Serves the page from a thread of its own until it is stopped.

    Parameters
    ----------
    view : SceneView
        The scene.
    bridge : Bridge
        Receives the event loop.
    host : str
        Address or name to listen at.
    port : int
        Port to listen at; 0: any free port.

    Raises
    ------
    OSError
        If it cannot listen there.

    """

    def __init__(self, view: SceneView, bridge: Bridge, host: str, port: int) -> None:
        self._view = view
        self._bridge = bridge
        # Listening at '' in both families of addresses, each would have a free port of its own.
        self._host = host or '0.0.0.0'
        self._clients: set[Client] = set()
        # The connections whose request is being answered.
        self._answered: set[Any] = set()
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
        self._bridge.loop = asyncio.get_running_loop()
        app = web.Application(middlewares=[self._guard])
        app.add_routes([web.get('/', _file), web.get('/socket', self._connect),
                        web.get('/{name:.+}', _file)])
        logger = logging.Logger('web', logging.WARNING)
        logger.addHandler(OneLineHandler(self._bridge.warn))
        runner = web.AppRunner(
            app, access_log=None, logger=logger, shutdown_timeout=SECONDS_TO_CLOSE)
        await runner.setup()
        try:
            await web.TCPSite(runner, self._host, port).start()
        except Exception as error:
            await runner.cleanup()
            started.set_exception(error)
            return
        sweeping = asyncio.ensure_future(self._end_half_requests(runner))
        stopping = asyncio.Event()
        started.set_result((self._bridge.loop, stopping, runner.addresses[0][1]))
        await stopping.wait()
        sweeping.cancel()
        await asyncio.gather(*(client.close() for client in self._clients))
        await runner.cleanup()

    async def _end_half_requests(self, runner: web.AppRunner) -> None:
        """Close connections that do not send a whole request in time."""
        since: dict[Any, float] = {}
        while runner.server:
            now = self._bridge.loop.time()
            since = {one: since.get(one, now) for one in runner.server.connections
                     if one not in self._answered}
            for one, start in since.items():
                if now > start + SECONDS_TO_READ:
                    one.force_close()
            await asyncio.sleep(SECONDS_TO_CLOSE)

    @web.middleware
    async def _guard(self, request: web.Request, handler: Callable[..., Any]) -> Any:
        """
        Refuse all requests except those of this page.

        A foreign page can reach this server in two ways: by its address, with the page's Origin,
        or by a host name that the page's owner directs to this machine, with that as the Host.
        """
        host = request.headers.get('Host', '')
        origin = request.headers.get('Origin')
        if not self._is_own(host):
            raise web.HTTPForbidden(text=f'{host!r} is not a name of this server.\n')
        if origin is not None and _parts(origin).netloc.lower() != host.lower():
            raise web.HTTPForbidden(text=f'{origin!r} is a foreign origin.\n')
        self._answered.add(request.protocol)
        try:
            response = await handler(request)
        finally:
            self._answered.discard(request.protocol)
        if not response.prepared:
            response.headers.update(HEADERS)
        return response

    def _is_own(self, host: str) -> bool:
        name = _parts(f'//{host}').hostname or ''
        if name in ('localhost', self._host.lower(), socket.gethostname().lower()):
            return True
        try:
            address = ipaddress.ip_address(name)
        except ValueError:
            return False
        # A numeric address cannot be directed to another machine.
        return address.is_loopback or self._host in ('0.0.0.0', '::')

    async def _connect(self, request: web.Request) -> Any:
        socket_ = Socket(
            timeout=SECONDS_TO_CLOSE, max_msg_size=MOST_BYTES, heartbeat=20.0, compress=False)
        await socket_.prepare(request)
        client = Client(self._view, socket_, self._bridge.warn)
        self._clients.add(client)
        try:
            await client.serve()
        except (ConnectionError, asyncio.TimeoutError):
            # The browser has left, or does not read.
            pass
        finally:
            self._clients.discard(client)
            transport = request.transport
            if transport and transport.get_write_buffer_size():
                # Closing the connection would wait forever for the browser to read this.
                transport.abort()
        return socket_


class OneLineHandler(logging.Handler):
    """Logs a record in one sentence: an invalid request of a client deserves no traceback."""

    def __init__(self, log: Callable[[str], None]) -> None:
        super().__init__()
        self._log = log

    def emit(self, record: logging.LogRecord) -> None:
        """Log a record."""
        error = record.exc_info[1] if record.exc_info else ''
        self._log(f'{record.getMessage()}: {error!r}')


class Socket(web.WebSocketResponse):
    """A WebSocket that sends the reason when it is closed."""

    async def close(self, *, code: int = WSCloseCode.OK, message: bytes = b'',
                    **kwargs: Any) -> bool:
        """Close it; raise TimeoutError if the other end does not read."""
        closing = super().close(
            code=code, message=message or CLOSED_FOR.get(code, b''), **kwargs)
        return await asyncio.wait_for(closing, 2 * SECONDS_TO_CLOSE)


class Client:
    """
    The page in one browser.

    It receives the newest state only, and markers no faster than it draws them. Each request is
    answered. A browser that does not read is disconnected, so that no messages accumulate.
    """

    def __init__(self, view: SceneView, socket_: Socket, warn: Callable[[str], None]) -> None:
        self._view = view
        self._socket = socket_
        self._warn = warn
        self._texts: dict[Any, Message] = {}
        self._offered: set[Feed] = set()
        self._ready = True
        self._news = asyncio.Event()
        self._requests: asyncio.Queue[Message] = asyncio.Queue(MOST_WAITING)

    def tell(self, key: Any, message: Message) -> None:
        """Send a message; it replaces a waiting one with the same key."""
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
            await self._socket.close(
                code=WSCloseCode.GOING_AWAY, message=b'the viewer ended')

    async def _receive(self) -> None:
        async for message in self._socket:
            # Other tasks get their turn, however many messages arrive.
            await asyncio.sleep(0)
            request: Message = {}
            try:
                request = _parsed(message.data)
                if request['op'] == 'drawn':
                    self._ready = True
                    self._news.set()
                else:
                    self._requests.put_nowait(request)
            except ValueError as error:
                await self._send_message(
                    _answer(request, f'the request is not understood: {error}'))
            except asyncio.QueueFull:
                await self._send_message(
                    _answer(request, f'{MOST_WAITING} requests wait already'))

    async def _answer(self) -> None:
        while True:
            request = await self._requests.get()
            await self._send_message(_answer(request, **await self._result(request)))

    async def _result(self, request: Message) -> Message:
        op = request['op']
        try:
            if op == 'set':
                await self._view.set(request['mechanism'], dict(request['values']))
                return {}
            if op == 'read':
                return number(str(request['text']))
            if op in ('pose', 'tune', 'curve', 'save', 'export'):
                arguments = {name: value for name, value in request.items()
                             if name not in ('op', 'id', 'mechanism')}
                answer: Message = await getattr(self._view, op)(
                    request['mechanism'], **arguments)
                return answer
            return {'reason': f'unknown request {quoted(op)}'}
        except Refused as reason:
            return {'reason': str(reason)}
        except KeyError as error:
            return {'reason': f'{op} is not understood: it lacks {error}'}
        except (TypeError, ValueError) as error:
            return {'reason': f'{op} is not understood: {error}'}
        except Exception as error:
            # Without an answer the browser would wait forever.
            self._warn(f'{op}: {error!r}')
            return {'reason': f'internal error: {error!r}'}

    async def _send(self) -> None:
        while True:
            await self._news.wait()
            self._news.clear()
            await self._send_texts()
            if self._ready and self._offered:
                await self._send_picture()

    async def _send_texts(self) -> None:
        while self._texts:
            await self._send_message(self._texts.pop(next(iter(self._texts))))

    async def _send_picture(self) -> None:
        offered, self._offered = self._offered, set()
        picture = b''.join(feed.frame() for feed in offered)
        if picture:
            self._ready = False
            await self._within(self._socket.send_bytes(picture))

    async def _send_message(self, message: Message) -> None:
        await self._within(self._socket.send_json(message))

    async def _within(self, sending: Any) -> None:
        await asyncio.wait_for(sending, SECONDS_TO_READ)


def _parsed(text: Any) -> Message:
    """Return the request in a text; raise ValueError if it is invalid."""
    if not isinstance(text, str):
        raise ValueError('it must be a text')
    try:
        request = json.loads(text, parse_int=_number)
    except RecursionError:
        raise ValueError('it is nested too deeply') from None
    if not isinstance(request, dict) or not isinstance(request.get('op'), str):
        raise ValueError('it must be a JSON object with an "op"')
    return request


def _number(text: str) -> float:
    return int(text) if len(text) <= MOST_FIGURES else float(text)


def _answer(request: Message, reason: str = '', **more: Any) -> Message:
    id_ = request.get('id')
    return {'op': 'answer', 'id': id_ if isinstance(id_, (int, str)) else None,
            'reason': reason, **more}


def _parts(url: str) -> SplitResult:
    """Return the parts of an address; empty parts if it is invalid."""
    try:
        return urlsplit(url)
    except ValueError:
        return urlsplit('')


async def _file(request: web.Request) -> web.Response:
    name = request.match_info.get('name', 'index.html')
    path = {start + file.name: file for start, folder in FOLDERS.items()
            for file in folder.iterdir() if file.is_file()}.get(name)
    if path is None:
        raise web.HTTPNotFound(text=f'There is no {name!r}.\n')
    ending, text = name[name.rfind('.'):], path.read_text('utf-8')
    if ending in COLOURED:
        text = Template(text).substitute(COLOURS)
    response = web.Response(text=text, charset='utf-8',
                            content_type=KINDS.get(ending, 'text/plain'))
    # On an open connection, pipelined requests would accumulate without limit.
    response.force_close()
    return response
