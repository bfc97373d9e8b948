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

"""The page's server: plain files and one WebSocket, in a thread of its own."""

import asyncio
from collections import deque
from concurrent.futures import Future
from importlib.resources import files
import ipaddress
import json
import socket
from threading import Thread
from urllib.parse import urlsplit

from aiohttp import web, WSCloseCode

from .stage import Refused

PAGE = files(__package__) / 'page'
KINDS = {'.html': 'text/html', '.css': 'text/css', '.js': 'text/javascript',
         '.svg': 'image/svg+xml'}
HEADERS = {
    'Content-Security-Policy':
        "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    'Cross-Origin-Resource-Policy': 'same-origin',
    'Cache-Control': 'no-cache',
    'Referrer-Policy': 'no-referrer',
    'X-Content-Type-Options': 'nosniff',
}
MOST_BYTES, MOST_AT_ONCE = 1 << 16, 64
SECONDS_TO_CLOSE = 1.0


class Server:
    """
    Serves the page from a thread of its own until it is stopped.

    Parameters
    ----------
    stage : Stage
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

    def __init__(self, stage, bridge, host: str, port: int):
        self._stage = stage
        self._host = host
        self._visitors = set()
        started = Future()
        self._thread = Thread(target=lambda: asyncio.run(self._serve(bridge, port, started)),
                              name='web', daemon=True)
        self._thread.start()
        self._loop, self._stopping, self.port = started.result()

    @property
    def url(self) -> str:
        """Where a browser on this machine finds the page."""
        host = {'0.0.0.0': '127.0.0.1', '::': '::1', '': '127.0.0.1'}.get(self._host, self._host)
        return f'http://{f"[{host}]" if ":" in host else host}:{self.port}/'

    def stop(self):
        """Send everybody home and end the thread."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stopping.set)
            self._thread.join()

    async def _serve(self, bridge, port, started):
        bridge.loop = asyncio.get_running_loop()
        app = web.Application(middlewares=[self._guard])
        app.add_routes([web.get('/', _file), web.get('/socket', self._visit),
                        web.get('/{name}', _file)])
        runner = web.AppRunner(app, access_log=None, shutdown_timeout=SECONDS_TO_CLOSE)
        await runner.setup()
        try:
            await web.TCPSite(runner, self._host, port).start()
        except Exception as error:
            await runner.cleanup()
            started.set_exception(error)
            return
        stopping = asyncio.Event()
        started.set_result((bridge.loop, stopping, runner.addresses[0][1]))
        await stopping.wait()
        for visitor in list(self._visitors):
            await visitor.close()
        await runner.cleanup()

    @web.middleware
    async def _guard(self, request, handler):
        """
        Let nobody in but this page itself.

        A foreign page can reach an address of this machine in two ways: by its address, with an
        Origin of its own, or by a name of its own that it lets lead here, with that as the Host.
        """
        host = request.headers.get('Host', '')
        origin = request.headers.get('Origin')
        if not self._is_own(host):
            raise web.HTTPForbidden(text=f'{host!r} is not a name of this server.\n')
        if origin is not None and urlsplit(origin).netloc.lower() != host.lower():
            raise web.HTTPForbidden(text=f'{origin!r} is a foreign origin.\n')
        response = await handler(request)
        if not response.prepared:
            response.headers.update(HEADERS)
        return response

    def _is_own(self, host) -> bool:
        try:
            name = urlsplit(f'//{host}').hostname or ''
        except ValueError:
            return False
        if name in ('localhost', self._host.lower(), socket.gethostname().lower()):
            return True
        try:
            address = ipaddress.ip_address(name)
        except ValueError:
            return False
        # An address in figures cannot be made to lead elsewhere.
        return address.is_loopback or self._host in ('', '0.0.0.0', '::')

    async def _visit(self, request):
        socket_ = web.WebSocketResponse(
            timeout=SECONDS_TO_CLOSE, max_msg_size=MOST_BYTES, heartbeat=20.0, compress=False)
        await socket_.prepare(request)
        visitor = Visitor(self._stage, socket_)
        self._visitors.add(visitor)
        try:
            await visitor.stay()
        finally:
            self._visitors.discard(visitor)
        return socket_


class Visitor:
    """
    A browser that looks.

    It is sent what is new, the newest only, and as often as it has drawn what it was sent.
    """

    def __init__(self, stage, socket_):
        self._stage = stage
        self._socket = socket_
        self._texts = {}
        self._answers = deque()
        self._feeds = {}
        self._looks = {}
        self._ready = True
        self._news = asyncio.Event()
        self._tasks = set()

    def tell(self, key, message: dict):
        """Send a message; of those with one key the last is enough."""
        self._texts[key] = message
        self._news.set()

    def offer(self, feed):
        """Send what a feed has, when the browser is ready to draw it."""
        self._feeds[id(feed)] = feed
        self._news.set()

    async def stay(self):
        """Serve the browser until it leaves."""
        self._stage.enter(self)
        sending = asyncio.ensure_future(self._send())
        try:
            async for message in self._socket:
                self._hear(message)
        finally:
            for task in (sending, *self._tasks):
                task.cancel()
            self._stage.leave(self)

    async def close(self):
        """Send the browser home."""
        await self._socket.close(code=WSCloseCode.GOING_AWAY, message=b'the viewer ended')

    def _hear(self, message):
        try:
            said = json.loads(message.data)
            op = said['op']
        except (TypeError, ValueError, KeyError):
            return
        if op == 'drawn':
            self._ready = True
            self._news.set()
        elif len(self._tasks) < MOST_AT_ONCE:
            task = asyncio.ensure_future(self._answer(op, said))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def _answer(self, op, said):
        answer = {'op': 'answer', 'id': said.get('id'), 'reason': ''}
        try:
            if op == 'set':
                await self._stage.set(said['mechanism'], dict(said['values']))
            elif op == 'drag':
                answer.update(await self._stage.drag(said['mechanism'], float(said['angle'])))
            else:
                answer['reason'] = f'unknown request {op!r}'
        except Refused as reason:
            answer['reason'] = str(reason)
        except (KeyError, TypeError, ValueError) as error:
            answer['reason'] = f'{op} is not understood: {error!r}'
        self._answers.append(answer)
        self._news.set()

    async def _send(self):
        try:
            while True:
                await self._news.wait()
                self._news.clear()
                await self._send_texts()
                if self._ready and self._feeds:
                    await self._send_picture()
        except ConnectionError:
            # It has left; whoever listens to it hears so too.
            pass

    async def _send_texts(self):
        while self._texts or self._answers:
            for key in list(self._texts):
                await self._socket.send_json(self._texts.pop(key))
            while self._answers:
                await self._socket.send_json(self._answers.popleft())

    async def _send_picture(self):
        feeds, self._feeds = self._feeds, {}
        drawn = [feed.drawn() for feed in feeds.values()]
        for looks, _ in drawn:
            for number, look in looks.items():
                if self._looks.get(number) != look:
                    self._looks[number] = look
                    await self._socket.send_json({'op': 'look', 'number': number, **look})
        self._ready = False
        await self._socket.send_bytes(b''.join(records for _, records in drawn))


async def _file(request):
    name = request.match_info.get('name', 'index.html')
    path = {file.name: file for file in PAGE.iterdir()}.get(name)
    if path is None:
        raise web.HTTPNotFound(text=f'There is no {name}.\n')
    return web.Response(body=path.read_bytes(), content_type=KINDS[name[name.rfind('.'):]],
                        charset='utf-8')
