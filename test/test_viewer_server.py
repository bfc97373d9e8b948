# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The viewer's server: who may look, what it answers to anything, how it starts and ends."""

import asyncio
from concurrent.futures import wait
import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from urllib.parse import urlsplit

import aiohttp
import browser
from browser import until
from linkage_ros import palette, scene
from linkage_ros.web.viewer import Viewer
import pytest
from scenes import ROOT
from viewer_harness import LEG, PAGE, Page, resident

NONSENSE = [
    '', '[]', 'null', '\x00', '{"op": 1}', '{"op": {}}', '["op"]', '[' * 60000, '{"a":' * 10000,
    '9' * 60000, '{"op": "drag", "angle": ' + '[' * 3000 + ']' * 3000 + '}', b'\xff\xfe', b'{}']


def test_nonsense_is_answered(lever):
    with Page(lever.url) as page:
        for text in NONSENSE:
            page.send(text, aiohttp.WSMsgType.BINARY if isinstance(text, bytes) else
                      aiohttp.WSMsgType.TEXT)
        assert 'unknown request' in page.ask('fly')['reason']
        answers = [one for one in page.messages if one['op'] == 'answer' and one['id'] is None]
        assert len(answers) == len(NONSENSE) and all(one['reason'] for one in answers)


# What is set, and how a refusal says that it is not a number that can be set.
VALUES = [
    ('leg_pairs', '1e20', r'1e\+20'), ('leg_pairs', 19 * '9', 19 * '9'),
    ('leg_pairs', '-1e400', '-inf'), ('leg_pairs', 'true', 'True'), ('leg_pairs', '2.5', '2.5'),
    ('dimensions.a', 400 * '9', '9+[.]{3}9+'), ('dimensions.a', '1e400', 'inf'),
    ('dimensions.a', 'NaN', 'nan'), ('dimensions.a', '[[[1]]]', r'\[\[\[1\]\]\]'),
    ('dimensions.a', '{"a": NaN}', '{.*}'), ('dimensions.a', 'null', 'None'),
    ('dimensions.a', f'"{50000 * "x"}"', "'x*[.]{3}x*'"), ('crank.speed', '1e300', r'1e\+300'),
    ('crank.start', 17 * '9', '[19e+.]+'), ('mirrored', '1', '1'),
    ('dimensions.b', '-150.0', '-150.0'), ('branches.L', '5', '5')]
REQUESTS = [
    *(('set', f'"values": {{"{name}": {value}}}', f'^lever.{name} must be .*, not {shown}$')
      for name, value, shown in VALUES),
    *(('set', f'"values": {values}', 'the request fails') for values in (
        f'{{"{50000 * "x"}": 1}}', '{"\\ud800": 1}', '3', '[[[], 1]]')),
    ('set', '"values": {"type": "jansen"}', 'read-only parameter: lever.type'),
    ('set', '"values": {"dimensions.a": 10.0, "dimensions.e": 700.0}', 'be assembled'),
    ('set', '"values": {}, "key": {}', 'the request fails'),
    ('set', '"a": 1', 'the request fails'),
    *(('pose', f'"want": {want}', '.') for want in (
        '{"output": "crank", "value": 1e400}', '{"output": "crank", "value": NaN}',
        '{"output": "crank", "value": [1]}', '{"output": "crank", "value": "1"}', '{}', '3',
        '{"output": [], "value": 1}', '{"joint": [], "place": [1, 2]}', '{"joint": "A", "up": 2}',
        '{"joint": "A", "place": [1]}', '{"joint": "A", "place": [1, 2], "leg": 1}')),
    ('pose', '"want": {"output": "Z", "value": 1}', "no output 'Z'"),
    ('pose', '"want": {"joint": "Z", "place": [0, 0]}', "has no point 'Z'; allowed: O, Q, "),
    ('pose', '"key": []', 'the request fails'), ('tune', '"key": ""', "no mechanism ''$"),
    ('curve', '"output": "Z.x"', "no output 'Z.x'; allowed: distance.*crank, lever, .*A.x"),
    ('curve', '"kind": "transmission angle", "output": "L.x"', 'lever'),
    ('curve', '"colour": 1', 'the request fails'), ('export', '"a": 1', 'the request fails'),
    (50000 * 'x', '"a": 1', "unknown request 'x*[.]{3}x*'$"),
    ('pose', '"arrows": "torque"', "^the request fails: KeyError.'torque'")]


def test_a_request_is_answered_whatever_it_holds(lever, page):
    for number, (op, fields, reason) in enumerate(REQUESTS):
        page.send(f'{{"op": "{op}", "id": "{number}", "key": "/lever", {fields}}}')
        answer = page.message('answer', id=str(number))
        assert re.search(reason, answer['reason']), (op[:20], reason, answer['reason'])
        assert len(answer['reason']) < 600 and answer.keys() == {'op', 'id', 'reason'}
    assert [lever.value(f'lever.{name}') for name in (
        'crank.speed', 'leg_pairs', 'dimensions.a', 'dimensions.b')] == [1.0, 1, 80.0, 150.0]


@pytest.mark.parametrize('kind, data, code', [
    (aiohttp.WSMsgType.TEXT, b'[' * 100000, 1009), (aiohttp.WSMsgType.TEXT, b'\xff\xfe', 1007),
    (aiohttp.WSMsgType.CONTINUATION, b'', 1002), (3, b'', 1002)])
def test_what_is_no_message_closes_the_connection(lever, kind, data, code):
    with Page(lever.url) as page:
        page.message('scene')
        page.send(data, kind)
        assert until(lambda: page.end)[0] == code


@contextlib.contextmanager
def deaf(url):
    """Yield a function that sends as a page that reads nothing: what, and how long."""
    async def opened():
        session = aiohttp.ClientSession()
        page = await session.ws_connect(url.replace('http', 'ws') + 'socket')
        return session, page, page.get_extra_info('socket')

    def flood(send, goes_on):
        """Send as long as that holds; return whether it was let to the end."""
        while goes_on():
            sending = browser.begin(send(page))
            while goes_on() and not wait([sending], 0.2).done:
                pass
            if sending.done() and isinstance(sending.exception(), ConnectionError):
                return False
        return True

    session, page, line = browser.run(opened())
    try:
        yield flood
    finally:
        # What was not read is not waited for.
        with contextlib.suppress(OSError):
            line.shutdown(socket.SHUT_RDWR)
        browser.run(session.close())


async def ping(page):
    """Send a hundred pings."""
    for _ in range(100):
        await page.ping(125 * b'x')


FLOODS = {
    'answers': lambda page: page.send_str('{"op": "fly", "id": "' + 60000 * 'x' + '"}'),
    'settings': lambda page: page.send_str(
        '{"op": "set", "key": "/leg", "values": {"crank.speed": 1}, "id": 1}'),
    'pings': ping,
    'drawn': lambda page: page.send_str('"drawn"')}


@pytest.mark.nightly
@pytest.mark.parametrize('what', FLOODS)
def test_a_client_that_does_not_read_costs_little_and_harms_nobody(show, what):
    running = show({**LEG, 'leg.crank.speed': 1.0})
    page = running.page()
    until(lambda: page.pictures)
    before, pictures, over = resident(), page.pictures, threading.Event()
    with deaf(running.url) as flood:
        flooding = threading.Thread(target=flood, args=(FLOODS[what], lambda: not over.is_set()))
        flooding.start()
        try:
            time.sleep(15.0)
            until(lambda: page.pictures > pictures + 5)
            assert page.set('/leg', crank__speed=2.0) == ''
        finally:
            over.set()
            flooding.join()
        assert resident() - before < 30.0


@pytest.mark.nightly
def test_requests_on_one_connection_whose_answers_nobody_reads_are_few(lever):
    host, port = urlsplit(lever.url).netloc.split(':')
    with socket.create_connection((host, int(port))) as other, pytest.raises(ConnectionError):
        other.settimeout(browser.DEADLINE)
        for _ in range(10_000):
            other.sendall(100 * f'GET /panel.js HTTP/1.1\r\nHost: {host}:{port}\r\n\r\n'.encode())


@pytest.mark.nightly
@pytest.mark.parametrize('what', ['answers', 'pings'])
def test_a_client_that_does_not_read_is_sent_home(show, what):
    with deaf(show(LEG).url) as flood:
        end = time.monotonic() + 4.0 * browser.DEADLINE
        assert not flood(FLOODS[what], lambda: time.monotonic() < end)


@pytest.mark.nightly
def test_a_client_that_does_not_read_does_not_keep_the_viewer_from_ending(show):
    running = show(LEG)
    with deaf(running.url) as flood:
        some = iter(range(200))
        assert flood(FLOODS['answers'], lambda: next(some, None) is not None)
        ending = threading.Thread(target=running.viewer.destroy_node, daemon=True)
        ending.start()
        ending.join(browser.DEADLINE)
        assert not ending.is_alive()


def test_what_is_no_request_is_refused_and_not_logged(lever, capfd):
    with socket.create_connection(('127.0.0.1', urlsplit(lever.url).port)) as other:
        other.sendall(b'\x16\x03\x01 is how https begins\r\n\r\n')
        assert other.recv(100).startswith(b'HTTP/1.0 400')
    assert 'Traceback' not in capfd.readouterr().err


def answer(url, **headers):
    """Return the status, the headers and the text of an answer."""
    async def fetched():
        async with aiohttp.ClientSession() as session:
            async with session.get(url, headers=headers) as response:
                return response.status, response.headers, await response.text()

    return asyncio.run(fetched())


@pytest.mark.parametrize('name', ['', *sorted(
    path.relative_to(PAGE).as_posix() for path in PAGE.rglob('*') if path.is_file())])
def test_the_page_is_served_with_nothing_from_outside(lever, name):
    code, headers, served = answer(lever.url + name)
    assert code == 200
    assert {key: value for key, value in headers.items()
            if key not in ('Date', 'Server', 'Content-Length', 'Content-Type', 'Etag',
                           'Last-Modified', 'Accept-Ranges')} == {
        'Content-Security-Policy':
            "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
        'Cross-Origin-Resource-Policy': 'same-origin', 'Cache-Control': 'no-cache',
        'Referrer-Policy': 'no-referrer', 'X-Content-Type-Options': 'nosniff',
        'Connection': 'close'}
    kind = (name or '.html').rpartition('.')[2]
    assert (kind if kind in ('html', 'css', 'svg') else
            'javascript' if kind == 'js' else 'octet-stream') in headers['Content-Type']
    text = (PAGE / (name or 'index.html')).read_text()
    for colour, code in vars(palette).items() if kind in ('css', 'svg') else ():
        text = re.sub(rf'\${colour.lower()}\b', code, text) if colour.isupper() else text
    assert served == text
    named = re.findall(r"""(?:src|href|from|url\()\s*=?\s*["']([^"']+)["']""", text)
    assert all((PAGE / path).is_file() for path in named)
    addresses = set(re.findall(r'https?://[^\s"\'`]+', text))
    assert addresses <= {'http://www.apache.org/licenses/LICENSE-2.0',
                         'http://www.w3.org/2000/svg', 'https://github.com/leeoniya/uPlot'}


@pytest.mark.parametrize('name', [
    '%2e%2e%2fserver.py', 'vendor%2f..%2f..%2fserver.py', 'server.py', 'none.html',
    'page/main.js'])
def test_only_the_page_is_served(lever, name):
    code, headers, _ = answer(lever.url + name)
    assert code == 404 and headers['Connection'] == 'close' and 'Referrer-Policy' in headers


def test_a_refused_address_says_what_was_asked(lever):
    assert [answer(lever.url, **headers)[2] for headers in (
        {'Host': 'evil.example'}, {'Origin': 'null'})] == [
        "'evil.example' is not a name of this server.\n", "'null' is a foreign origin.\n"]


@pytest.mark.parametrize('host, own', [
    ('localhost:{port}', True), ('127.0.0.1:{port}', True), ('[::1]:{port}', True),
    ('localhost', True), ('evil.example', False), ('evil.example:{port}', False),
    ('localhost.evil.example', False), ('10.1.2.3:{port}', False), ('[', False), ('', False),
    ('evil.example:80@localhost', False), ('[::1].evil.example', False)])
def test_a_foreign_host_is_refused(lever, host, own):
    host = host.format(port=urlsplit(lever.url).port)
    assert answer(lever.url, Host=host)[0] == (200 if own else 403)


@pytest.mark.parametrize('origin, own', [
    *((origin, False) for origin in (
        'http://evil.example', 'https://127.0.0.1', 'http://127.0.0.1:1', 'null', 'file://',
        'http://localhost:{port}', 'http://127.0.0.1:{port}.evil.example', '')),
    ('http://127.0.0.1:{port}', True)])
def test_a_foreign_origin_is_refused(lever, origin, own):
    page = Page(lever.url, headers={'Origin': origin.format(port=urlsplit(lever.url).port)})
    with contextlib.nullcontext() if own else pytest.raises(
            aiohttp.WSServerHandshakeError, match='403'), page:
        page.message('scene')


def test_the_viewer_describes_its_parameters(graph):
    viewer = graph.start(Viewer, {'or_any_port': True})
    for name, value, end in (
            ('host', '127.0.0.1', 'Whoever reaches it can move the scene.'),
            ('port', 8020, '0: any that is free.'), ('or_any_port', True, 'that one is taken.')):
        about = viewer.describe_parameter(name)
        assert viewer.get_parameter(name).value == value
        assert about.read_only and about.description.endswith(end)
        assert [(ends.from_value, ends.to_value) for ends in about.integer_range] == [
            (0, 65535)] * (name == 'port')


def test_where_a_port_is_taken_another_is_used_or_the_viewer_says_how(graph):
    with socket.socket() as taken:
        taken.bind(('127.0.0.1', 0))
        taken.listen()
        port = taken.getsockname()[1]
        other = graph.start(Viewer, {'port': port, 'or_any_port': True})
        assert answer(other.url)[0] == 200
        # Ports below are for the administrator.
        assert port != int(re.search(r':(\d+)/', other.url)[1]) >= 1024
        with pytest.raises(scene.SceneError, match='^the viewer cannot be started: .*in use; for '
                           'another port use .* make view PORT=8021; port 0 is any free one$'):
            graph.start(Viewer, {'port': port})
    for given in ({'port': 0, 'host': '192.0.2.1', 'or_any_port': True}, {'port': 70000},
                  {'port': 'eighty'}):
        with pytest.raises(scene.SceneError, match='^the viewer cannot be started: .*[^e]$'):
            graph.start(Viewer, given)
    graph.end(other)


@pytest.mark.parametrize('host, shown, numbers', [
    ('0.0.0.0', '127.0.0.1', True), ('', '127.0.0.1', True), ('localhost', 'localhost', False)])
def test_a_viewer_answers_by_the_names_and_numbers_of_its_mechanism(graph, host, shown, numbers):
    viewer = graph.start(Viewer, {'port': 0, 'host': host})
    url = re.fullmatch(rf'http://{shown}:\d+/', viewer.url)[0]
    assert [answer(url, Host=name)[0] == 200 for name in (
        'evil.example', '10.1.2.3', socket.gethostname().upper(), 'LOCALHOST', '127.0.0.2')] == [
        False, numbers, True, True, True]
    graph.end(viewer)


def test_a_viewer_that_ends_says_so_to_its_pages(show):
    running = show({}, kinds=())
    page = running.page()
    running.graph.end(running.viewer)
    assert until(lambda: page.end) == (1001, 'the viewer ended')


@pytest.mark.nightly
@pytest.mark.parametrize('stop', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_make_view_says_where_to_look_and_ends_all_that_it_started(stop):
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)}
    environment.pop('ROS_DOMAIN_ID', None)
    process = subprocess.Popen(
        [sys.executable, ROOT / 'demo' / 'view.py', ROOT / 'config' / 'jansen.yaml', '0'],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)
    try:
        address, = re.findall(r'Look at (http:\S+)', next(
            line for line in process.stdout if 'Look at' in line))
        with Page(address) as page:
            page.mechanisms('/jansen')
            process.send_signal(stop)
            until(lambda: page.end)
        # The output ends when the last of those who have it does.
        printed, _ = process.communicate(timeout=browser.DEADLINE)
        assert process.returncode == 0 and 'Traceback' not in printed
    finally:
        process.terminate()
        process.wait(browser.DEADLINE)
