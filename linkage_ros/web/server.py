# Copyright 2026 linkage_ros contributors
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
from .scene_view import SCENE, SceneView
from .. import palette
from ..words import quoted

Said = dict[str, Any]

PAGE = files(__package__) / 'page'
FOLDERS = {'': PAGE, 'vendor/': PAGE / 'vendor'}
KINDS = {'.html': 'text/html', '.css': 'text/css', '.js': 'text/javascript',
         '.svg': 'image/svg+xml'}
# Where the colours of the palette are filled in, by their names in small letters.
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
# More figures than a number of ours has; what they say to a double is enough.
MOST_FIGURES = 18
CLOSED_FOR = {
    WSCloseCode.MESSAGE_TOO_BIG: f'a message may have {MOST_BYTES} bytes'.encode(),
    WSCloseCode.INVALID_TEXT: b'a text must be UTF-8',
    WSCloseCode.PROTOCOL_ERROR: b'this is no WebSocket frame',
}


class Server:
    """
    Serves the page from a thread of its own until it is stopped.

    Parameters
    ----------
    view : SceneView
        What is shown.
    bridge : Bridge
        Is given the event loop.
    host : str
        Address or name to listen at.
    port : int
        Port to listen at; 0: any that is free.

    Raises
    ------
    OSError
        If it cannot listen there.

    """

    def __init__(self, view: SceneView, bridge: Bridge, host: str, port: int) -> None:
        self._view = view
        self._bridge = bridge
        self._host = host
        self._clients: set[Client] = set()
        started: Future[Any] = Future()
        self._thread = Thread(target=lambda: asyncio.run(self._serve(port, started)),
                              name='web', daemon=True)
        self._thread.start()
        self._loop, self._stopping, self.port = started.result()

    @property
    def url(self) -> str:
        """Where a browser on this machine finds the page."""
        host = {'0.0.0.0': '127.0.0.1', '::': '::1', '': '127.0.0.1'}.get(self._host, self._host)
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
        stopping = asyncio.Event()
        started.set_result((self._bridge.loop, stopping, runner.addresses[0][1]))
        await stopping.wait()
        await asyncio.gather(*(client.close() for client in self._clients))
        await runner.cleanup()

    @web.middleware
    async def _guard(self, request: web.Request, handler: Callable[..., Any]) -> Any:
        """
        Let nobody in but this page itself.

        A foreign page can reach an address of this machine in two ways: by its address, with an
        Origin of its own, or by a name of its own that it lets lead here, with that as the Host.
        """
        host = request.headers.get('Host', '')
        origin = request.headers.get('Origin')
        if not self._is_own(host):
            raise web.HTTPForbidden(text=f'{host!r} is not a name of this server.\n')
        if origin is not None and _parts(origin).netloc.lower() != host.lower():
            raise web.HTTPForbidden(text=f'{origin!r} is a foreign origin.\n')
        response = await handler(request)
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
        # An address in figures cannot be made to lead elsewhere.
        return address.is_loopback or self._host in ('', '0.0.0.0', '::')

    async def _connect(self, request: web.Request) -> Any:
        socket_ = Socket(
            timeout=SECONDS_TO_CLOSE, max_msg_size=MOST_BYTES, heartbeat=20.0, compress=False)
        await socket_.prepare(request)
        client = Client(self._view, socket_, self._bridge.warn)
        self._clients.add(client)
        try:
            await client.serve()
        except (ConnectionError, asyncio.TimeoutError):
            # It has left, or does not read.
            pass
        finally:
            self._clients.discard(client)
            transport = request.transport
            if transport and transport.get_write_buffer_size():
                # A connection that is closed would wait for ever until this is read.
                transport.abort()
        return socket_


class OneLineHandler(logging.Handler):
    """Says in one sentence what is logged, for what others send is no traceback of ours."""

    def __init__(self, say: Callable[[str], None]) -> None:
        super().__init__()
        self._say = say

    def emit(self, record: logging.LogRecord) -> None:
        """Say it."""
        error = record.exc_info[1] if record.exc_info else ''
        self._say(f'{record.getMessage()}: {error!r}')


class Socket(web.WebSocketResponse):
    """A WebSocket that says why it is closed."""

    async def close(self, *, code: int = WSCloseCode.OK, message: bytes = b'',
                    **kwargs: Any) -> bool:
        """Close it; raise TimeoutError if nothing is read at the other end."""
        closing = super().close(
            code=code, message=message or CLOSED_FOR.get(code, b''), **kwargs)
        return await asyncio.wait_for(closing, 2 * SECONDS_TO_CLOSE)


class Client:
    """
    The page in one browser.

    It is sent what is new, the newest only, and as often as it has drawn what it was sent; each
    request is answered. Nothing is gathered for one that does not read: it is disconnected.
    """

    def __init__(self, view: SceneView, socket_: Socket, warn: Callable[[str], None]) -> None:
        self._view = view
        self._socket = socket_
        self._warn = warn
        self._texts: dict[Any, Said] = {}
        self._offered: set[str] = set()
        self._looks: dict[int, Said] = {}
        self._ready = True
        self._news = asyncio.Event()
        self._requests: asyncio.Queue[Said] = asyncio.Queue(MOST_WAITING)

    def tell(self, key: Any, message: Said) -> None:
        """Send a message; of those with one key the last is enough."""
        self._texts[key] = message
        self._news.set()

    def offer(self, feed: Feed) -> None:
        """Send what a feed has, when the browser is ready to draw it."""
        self._offered.add(feed.topic)
        self._news.set()

    async def serve(self) -> None:
        """
        Serve the browser until it leaves.

        Raises
        ------
        ConnectionError, TimeoutError
            If it leaves without a word, or does not read.

        """
        self._view.add(self)
        tasks = [asyncio.ensure_future(doing)
                 for doing in (self._hear(), self._answer(), self._send())]
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

    async def _hear(self) -> None:
        async for message in self._socket:
            # Others have their turn, however much comes.
            await asyncio.sleep(0)
            said: Said = {}
            try:
                said = _parsed(message.data)
                if said['op'] == 'drawn':
                    self._ready = True
                    self._news.set()
                else:
                    self._requests.put_nowait(said)
            except ValueError as error:
                await self._say(_answer(said, f'the request is not understood: {error}'))
            except asyncio.QueueFull:
                await self._say(_answer(said, f'{MOST_WAITING} requests wait already'))

    async def _answer(self) -> None:
        while True:
            said = await self._requests.get()
            await self._say(_answer(said, **await self._done(said)))

    async def _done(self, said: Said) -> Said:
        op = said['op']
        try:
            if op == 'set':
                await self._view.set(said['mechanism'], dict(said['values']))
                return {}
            if op == 'read':
                return number(str(said['text']))
            if op in ('pose', 'tune', 'curve', 'save', 'export'):
                about = {name: value for name, value in said.items()
                         if name not in ('op', 'id', 'mechanism')}
                answer: Said = await getattr(self._view, op)(said['mechanism'], **about)
                return answer
            return {'reason': f'unknown request {quoted(op)}'}
        except Refused as reason:
            return {'reason': str(reason)}
        except KeyError as error:
            return {'reason': f'{op} is not understood: it lacks {error}'}
        except (TypeError, ValueError) as error:
            return {'reason': f'{op} is not understood: {error}'}
        except Exception as error:
            # The browser would wait for ever for what raised.
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
            key = next(iter(self._texts))
            if key == SCENE:
                # The page forgets mechanisms that are not in it.
                self._looks = {}
            await self._say(self._texts.pop(key))

    async def _send_picture(self) -> None:
        offered, self._offered = self._offered, set()
        drawn = [feed.drawn() for feed in self._view.feeds() if feed.topic in offered]
        for looks, _ in drawn:
            for id_, look in looks.items():
                if self._looks.get(id_) != look:
                    self._looks[id_] = look
                    await self._say({'op': 'look', 'number': id_, **look})
        self._ready = False
        await self._within(self._socket.send_bytes(b''.join(records for _, records in drawn)))

    async def _say(self, message: Said) -> None:
        await self._within(self._socket.send_json(message))

    async def _within(self, sending: Any) -> None:
        await asyncio.wait_for(sending, SECONDS_TO_READ)


def _parsed(text: Any) -> Said:
    """Return a request; raise ValueError if it is none."""
    if not isinstance(text, str):
        raise ValueError('it must be a text')
    try:
        said = json.loads(text, parse_int=_number)
    except RecursionError:
        raise ValueError('it is nested too deeply') from None
    if not isinstance(said, dict) or not isinstance(said.get('op'), str):
        raise ValueError('it must be a JSON object with an "op"')
    return said


def _number(text: str) -> float:
    return int(text) if len(text) <= MOST_FIGURES else float(text)


def _answer(said: Said, reason: str = '', **more: Any) -> Said:
    id_ = said.get('id')
    return {'op': 'answer', 'id': id_ if isinstance(id_, (int, str)) else None,
            'reason': reason, **more}


def _parts(url: str) -> SplitResult:
    """Return the parts of an address, nothing of one that is none."""
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
    # What follows before the answer was read would be gathered without bound.
    response.force_close()
    return response
