"""Guards of the live page: its own origin and names only, few and small messages."""

import asyncio
import contextlib
import gc
import json

import pytest
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.httpserver import HTTPServer
from tornado.websocket import WebSocketClosedError, websocket_connect

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.viewer import applications
from polycorner.dumbbells.viewer.board import (
    MESSAGE,
    hello,
    sliders_for,
)
from polycorner.dumbbells.viewer.server import bound

DRUM, PLANE = DumbbellPair(16, 3, 1.5, 125), DumbbellPair(16, 3, 1.5)
SLIDERS = sliders_for(DRUM, 125.0)


@contextlib.asynccontextmanager
async def serving(application):
    server = HTTPServer(application)
    listener = bound("127.0.0.1", 0)
    server.add_sockets([listener])
    try:
        yield listener.getsockname()[1]
    finally:
        server.stop()
        await server.close_all_connections()


@pytest.fixture(scope="module")
def application():
    return applications.live_application(DRUM, "127.0.0.1")


@contextlib.asynccontextmanager
async def connected(port, *, origin=None, host=None):
    headers = {"Origin": origin or f"http://127.0.0.1:{port}"}
    if host:
        headers["Host"] = host
    if origin == "":
        del headers["Origin"]
    socket_ = await websocket_connect(HTTPRequest(f"ws://127.0.0.1:{port}/live", headers=headers))
    try:
        yield socket_
    finally:
        socket_.close()


async def ended(socket_):
    """Read until the connection is closed."""
    while await asyncio.wait_for(socket_.read_message(), 20) is not None:
        pass


async def read(socket_, kind):
    while True:
        message = await asyncio.wait_for(socket_.read_message(), 20)
        assert message is not None, (socket_.close_code, socket_.close_reason)
        if isinstance(message, str) and json.loads(message)["kind"] == kind:
            return json.loads(message)


def test_a_page_of_this_server_may_connect_and_is_answered(application):
    async def talk():
        async with serving(application) as port, connected(port) as socket_:
            first = await read(socket_, "hello")
            assert first == {"kind": "hello"} | json.loads(json.dumps(hello(SLIDERS)))
            await read(socket_, "reading")
            # What comes at once is answered together: one answer, the last values.
            for angle in (1.0, 2.0, 3.0):
                await socket_.write_message(json.dumps({"heading_A": angle}))
            answer = await read(socket_, "reading")
            while answer["sliders"]["heading_A"] != pytest.approx(3.0):
                answer = await read(socket_, "reading")
            await socket_.write_message(json.dumps({"rod_radius": 4.0}))
            refused = await read(socket_, "reading")
            assert "rod_radius: expected a number" in refused["problem"]
            assert refused["sliders"]["rod_radius"] == 1.5

    asyncio.run(talk())


@pytest.mark.parametrize(
    ("origin", "host"),
    [
        ("http://evil.example", None),
        ("http://127.0.0.1:1", None),  # another server on this machine
        ("null", None),
        ("", None),  # no Origin at all
        ("http://evil.example:80", "evil.example:80"),  # a name that was pointed here
        (None, "evil.example"),
        (None, "127.0.0.1.evil.example"),
    ],
)
def test_other_origins_and_hosts_are_refused(application, origin, host):
    async def knock():
        async with serving(application) as port:
            with pytest.raises(HTTPClientError) as refused:
                async with connected(port, origin=origin, host=host):
                    pass
            assert refused.value.code == 403
            if host:
                page = HTTPRequest(f"http://127.0.0.1:{port}/", headers={"Host": host})
                answer = await AsyncHTTPClient().fetch(page, raise_error=False)
                assert answer.code == 403
                assert b"<" not in answer.body

    asyncio.run(knock())


@pytest.mark.parametrize(
    ("message", "code", "words"),
    [
        ("garbage", 1008, "expected JSON"),
        ('{"heading_A": 1e9}', 1008, "heading_A: expected a number from -180 to 180"),
        ('{"../../etc/passwd": 1}', 1008, "expected the name of a slider"),
        (b"\x00\x01", 1008, "expected a text of at most 512 characters"),
        ('"' + "x" * MESSAGE + '"', 1008, "expected a text of at most 512 characters"),
        ("x" * 100_000, 1009, ""),  # not even read
    ],
)
def test_garbage_closes_the_connection_with_a_sentence(application, message, code, words):
    async def throw():
        async with serving(application) as port, connected(port) as socket_:
            await socket_.write_message(message, binary=isinstance(message, bytes))
            await ended(socket_)
            assert socket_.close_code in ({code, None} if code == 1009 else {code})
            assert words in (socket_.close_reason or "")

    asyncio.run(throw())


def test_a_flood_is_stopped(application, monkeypatch):
    monkeypatch.setattr(applications, "RATE", 20)

    async def flood():
        async with serving(application) as port, connected(port) as socket_:
            for _ in range(60):
                await socket_.write_message('{"axial_A": 0}')
            await ended(socket_)
            assert socket_.close_reason == "expected at most 20 messages in a second"

    asyncio.run(flood())


def test_only_so_many_pages_at_a_time(application, monkeypatch):
    monkeypatch.setattr(applications, "PAGES", 1)

    async def crowd():
        async with serving(application) as port:
            async with connected(port) as first:
                await read(first, "reading")
                async with connected(port) as second:
                    assert await asyncio.wait_for(second.read_message(), 20) is None
                    assert second.close_reason.startswith("the limit of 1 open pages is reached")
            while application.settings["pages"]:
                await asyncio.sleep(0.01)

    asyncio.run(crowd())


def test_headers_keep_the_page_to_itself(application):
    async def look():
        async with serving(application) as port:
            client = AsyncHTTPClient()
            for path in ("", "stage.js", "board.js", "page.css", "three.js"):
                answer = await client.fetch(f"http://localhost:{port}/{path}")
                policy = answer.headers["Content-Security-Policy"]
                assert policy.startswith("default-src 'none'; script-src 'self'")
                assert "frame-ancestors 'none'" in policy
                assert "unsafe" not in policy
                assert answer.headers["X-Frame-Options"] == "DENY"
                assert answer.headers["X-Content-Type-Options"] == "nosniff"
            for path in ("favicon.ico", "../pyproject.toml", "%2e%2e/x", "stage.js/", "live/x"):
                missing = await client.fetch(f"http://localhost:{port}/{path}", raise_error=False)
                assert missing.code == 404
            posted = HTTPRequest(f"http://localhost:{port}/", method="POST", body="x")
            assert (await client.fetch(posted, raise_error=False)).code == 405

    asyncio.run(look())


def test_a_page_that_was_closed_meanwhile_leaves_no_trace():
    """The message is on its way as the page closes: its future fails, and nobody waits for it."""
    said = []

    class Page(applications._Live):
        def __init__(self):
            pass

        def write_message(self, _message, **_options):
            sent = asyncio.get_running_loop().create_future()
            sent.set_exception(WebSocketClosedError())
            return sent

    async def tell():
        asyncio.get_running_loop().set_exception_handler(lambda _, context: said.append(context))
        Page()._send("hello")
        await asyncio.sleep(0)
        gc.collect()

    asyncio.run(tell())
    assert not said
