# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A real browser without a window, driven through its own protocol (Chrome DevTools)."""

import asyncio
import base64
import io
import itertools
import json
from pathlib import Path
import shutil
import subprocess
import threading
import time

import aiohttp
import numpy as np
from PIL import Image

NAMES = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable', 'chrome')
FLAGS = ('--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
         '--disable-background-networking', '--disable-component-update', '--disable-sync',
         '--window-size=1200,900', '--remote-debugging-port=0')
DEADLINE = 30.0


def executable():
    """Return the path of a browser, or None."""
    return next(filter(None, map(shutil.which, NAMES)), None)


_loop = asyncio.new_event_loop()
threading.Thread(target=_loop.run_forever, name='browser', daemon=True).start()
_tasks = set()


def begin(coroutine):
    """Start a coroutine in the thread of all of them; return its future."""
    return asyncio.run_coroutine_threadsafe(coroutine, _loop)


def run(coroutine):
    """Return the result of a coroutine."""
    return begin(coroutine).result(2 * DEADLINE)


def task(coroutine):
    """Start a coroutine from another one; return its task."""
    started = asyncio.ensure_future(coroutine)
    _tasks.add(started)
    started.add_done_callback(_tasks.discard)
    return started


def until(predicate, what=''):
    """Wait until something holds; return what the predicate returned."""
    end = time.monotonic() + DEADLINE
    while not (value := predicate()):
        assert time.monotonic() < end, f'did not happen in time: {what or predicate}'
        time.sleep(0.005)
    return value


class Browser:
    """
    One page of a browser with a fresh profile.

    Attributes
    ----------
    complaints : list
        What the page wrote to the console, exceptions included.
    requests : list
        The addresses that the page asked for.

    """

    def __init__(self, profile: Path):
        self._profile = profile
        self._numbers = itertools.count(1)
        self._answers = {}
        self._fingers = 0
        self.complaints = []
        self.requests = []

    def __enter__(self):
        self._process = subprocess.Popen(
            [executable(), *FLAGS, f'--user-data-dir={self._profile}', 'about:blank'],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            written = self._profile / 'DevToolsActivePort'
            run(self._connect(until(lambda: written.exists() and written.read_text().split())[0]))
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(self, *_):
        run(self._close())
        self._end()

    async def _connect(self, port):
        self._session = aiohttp.ClientSession()
        async with self._session.get(f'http://127.0.0.1:{port}/json') as response:
            page = next(page for page in await response.json() if page['type'] == 'page')
        self._socket = await self._session.ws_connect(page['webSocketDebuggerUrl'], max_msg_size=0)
        self._reading = task(self._read())
        for domain in ('Page', 'Runtime', 'Log', 'Network'):
            await self._request(f'{domain}.enable')

    async def _close(self):
        self._reading.cancel()
        await self._session.close()

    def _end(self):
        self._process.terminate()
        try:
            self._process.wait(DEADLINE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    async def _read(self):
        async for message in self._socket:
            said = json.loads(message.data)
            if 'id' in said:
                self._answers.pop(said['id']).set_result(said)
            elif said['method'] in ('Runtime.exceptionThrown', 'Runtime.consoleAPICalled',
                                    'Log.entryAdded'):
                self.complaints.append(said['params'])
            elif said['method'] == 'Network.requestWillBeSent':
                self.requests.append(said['params']['request']['url'])

    def _do(self, method, **params):
        return run(self._request(method, **params))

    async def _request(self, method, **params):
        number = next(self._numbers)
        answer = self._answers[number] = asyncio.get_running_loop().create_future()
        await self._socket.send_json({'id': number, 'method': method, 'params': params})
        said = await asyncio.wait_for(answer, DEADLINE)
        assert 'result' in said, said
        return said['result']

    def open(self, url: str):
        """Go to a page."""
        self._do('Page.navigate', url=url)
        until(lambda: self.value('document.readyState === "complete"'), url)

    def resize(self, width: int = 0, height: int = 0, scheme: str = 'light'):
        """Look as a screen of this size [pixels] does that prefers light or dark; 0: the own."""
        self._do('Emulation.setDeviceMetricsOverride', width=width, height=height,
                 deviceScaleFactor=1, mobile=0 < width < 600)
        self._do('Emulation.setEmulatedMedia', features=[
            {'name': 'prefers-color-scheme', 'value': scheme}])

    def value(self, expression: str):
        """Return the value of an expression in the page; wait for it if it is a promise."""
        reply = self._do('Runtime.evaluate', expression=expression, awaitPromise=True,
                              returnByValue=True)
        assert 'exceptionDetails' not in reply, reply['exceptionDetails']
        return reply['result'].get('value')

    def middle(self, expression: str):
        """Return the middle x, y and the width of an element, as the page's pixels."""
        return self.value(
            f'(() => {{ const {{x, y, width, height}} = ({expression}).getBoundingClientRect();'
            'return [x + width / 2, y + height / 2, width]; })()')

    def click(self, expression: str):
        """Press and release the mouse on an element."""
        x, y, _ = self.middle(expression)
        self._mouse('mousePressed', x, y)
        self._mouse('mouseReleased', x, y)

    def write(self, expression: str, text: str):
        """Write a text in place of what an element says, key by key, and press Enter."""
        def reached():
            self.click(expression)
            return self.value(f'document.activeElement === ({expression})')

        self.value(f'({expression}).scrollIntoView()')
        until(reached, f'{expression} has the focus')
        self.value(f'({expression}).select()')
        for key in (*text, '\r'):
            self._do('Input.dispatchKeyEvent', type='keyDown', text=key,
                           key={'\r': 'Enter'}.get(key, key))
            self._do('Input.dispatchKeyEvent', type='keyUp')

    def drag(self, *places):
        """Press the mouse at the first place, go to the others, release it at the last."""
        self._mouse('mousePressed', *places[0])
        for start, end in zip(places, places[1:]):
            for part in (0.25, 0.5, 0.75, 1.0):
                self._mouse('mouseMoved', *(a + part * (b - a) for a, b in zip(start, end)))
        self._mouse('mouseReleased', *places[-1])

    def touch(self, *fingers):
        """Put fingers down, move those that are down, lift those that are not given."""
        kind = ('touchEnd' if len(fingers) < self._fingers else
                'touchStart' if len(fingers) > self._fingers else 'touchMove')
        self._fingers = len(fingers)
        self._do('Input.dispatchTouchEvent', type=kind, touchPoints=[
            {'x': x, 'y': y, 'id': number} for number, (x, y) in enumerate(fingers)])

    def move(self, x, y):
        """Go to a place with the mouse, no button pressed."""
        self._do('Input.dispatchMouseEvent', type='mouseMoved', x=x, y=y)

    def hover(self, expression: str):
        """Go to an element with the mouse, from beside it."""
        self.value(f'({expression}).scrollIntoView({{block: "nearest"}})')
        x, y, _ = self.middle(expression)
        self.move(1.0, 1.0)
        self.move(x, y)

    def press(self, key: str, shift: bool = False):
        """Press a key that writes nothing, with Shift or without."""
        for kind in ('keyDown', 'keyUp'):
            self._do('Input.dispatchKeyEvent', type=kind, key=key, code=key, modifiers=8 * shift)

    def downloads(self, folder: Path):
        """Let what is downloaded go to a folder."""
        self._do('Browser.setDownloadBehavior', behavior='allow', downloadPath=str(folder))

    def _mouse(self, kind, x, y):
        self._do('Input.dispatchMouseEvent', type=kind, x=x, y=y, button='left',
                       buttons=int(kind != 'mouseReleased'), clickCount=1)

    def picture(self) -> np.ndarray:
        """Return what is seen: red, green and blue, shape (height, width, 3)."""
        data = self._do('Page.captureScreenshot', format='png', optimizeForSpeed=True)['data']
        return np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert('RGB'), int)
