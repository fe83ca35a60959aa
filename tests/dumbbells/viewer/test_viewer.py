"""The live page's answers are the library's; what it may be sent, and who may send it."""

import asyncio
import contextlib
import json
import math
import socket

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.httpserver import HTTPServer
from tornado.websocket import websocket_connect

from polycorner import certify, minimise, stratum_at
from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.pictures.placements import relative_placements
from polycorner.dumbbells.viewer import applications
from polycorner.dumbbells.viewer import server as viewer_server
from polycorner.dumbbells.viewer.board import Board, atlas_place, trail
from polycorner.dumbbells.viewer.sliders import (
    BUTTONS,
    MESSAGE,
    RefusedError,
    coordinates,
    hello,
    parsed,
    sliders_for,
)

DRUM, PLANE = DumbbellPair(16, 3, 1.5, 125), DumbbellPair(16, 3, 1.5)
SLIDERS = sliders_for(DRUM, 125.0)
BOARDS = {pair: Board.of(pair) for pair in (DRUM, PLANE)}


# ----------------------------------------------------------------------------------- the messages


@given(
    st.dictionaries(
        st.sampled_from(sorted(SLIDERS)), st.floats(0, 1), min_size=1, max_size=len(SLIDERS)
    )
)
def test_every_value_in_range_is_understood_and_comes_back(shares):
    values = {
        name: SLIDERS[name].low + share * (SLIDERS[name].high - SLIDERS[name].low)
        for name, share in shares.items()
    }
    assert parsed(json.dumps(values), SLIDERS) == values
    placed = {name: value for name, value in values.items() if name in coordinates()}
    for board in BOARDS.values():
        shown = board.moved(placed).values
        for name, value in placed.items():
            apart = shown[name] - value
            assert abs(math.remainder(apart, 360.0) if "heading" in name else apart) < 1e-9


def test_all_sliders_fit_in_one_message():
    longest = {name: -1 / 3 * slider.high for name, slider in SLIDERS.items()}
    assert len(json.dumps(longest)) < MESSAGE


@pytest.mark.parametrize("button", [name for name, _ in BUTTONS])
def test_buttons_are_understood(button):
    assert parsed(json.dumps(button), SLIDERS) == button


@pytest.mark.parametrize(
    "message",
    [
        "",
        "fall",  # not JSON
        '"delete"',
        "[]",
        "{}",
        "null",
        "3",
        '["fall"]',
        '{"fall": 1}',
        '{"heading_A": "1"}',
        '{"heading_A": true}',
        '{"heading_A": null}',
        '{"heading_A": NaN}',
        '{"heading_A": Infinity}',
        '{"heading_A": 1e999}',
        '{"heading_A": 180.5}',
        '{"rod_radius": 0}',
        '{"heading_A": 1, "file": "/etc/passwd"}',
        '{"heading_A": ' + "9" * 400 + "}",
        "[" * 500,
        '{"heading_A": [1]}',
        '{"__class__": 1}',
    ],
)
def test_everything_else_is_refused(message):
    with pytest.raises(RefusedError, match=r"^([a-zA-Z_]+: )?expected [a-zA-Z]"):
        parsed(message, SLIDERS)


# ------------------------------------------------------------------------------------ the answers


@given(st.sampled_from([DRUM, PLANE]), st.lists(st.floats(-1, 1), min_size=6, max_size=6))
def test_a_reading_is_what_the_library_says(pair, shares):
    board = BOARDS[pair]
    start = board.moved(
        {n: s * SLIDERS[n].high / 4 for n, s in zip(coordinates(), shares, strict=True)}
    )
    q, reading = np.array(start.q), start.reading()
    stratum = stratum_at(pair.polyhedron, q, tolerance=1e-6)
    gaps = dict(zip(pair.polyhedron.names, pair.polyhedron.values(q).tolist(), strict=True))
    assert reading["gaps"] == gaps
    np.testing.assert_array_equal(reading["centres"], pair.ball_centres(q).ravel())
    words = reading["words"]
    assert words["energy"].split()[0] == f"{pair.energy.value(q):.6f}"
    assert words["chirality"][0] == (pair.chirality(q) or "none").lower()[0]
    inside = bool(pair.polyhedron.contains(q))
    assert inside is (words["stratum"] != "outside the polyhedron")
    assert inside is (words["multipliers"] != "none: the dumbbells overlap")
    assert [name for name, _ in reading["contacts"]] == list(stratum.active)
    json.dumps(reading, allow_nan=False)


@pytest.mark.parametrize("pair", [DRUM, PLANE])
@pytest.mark.parametrize(("button", "hand"), [("right", "R"), ("left", "L")])
def test_a_fall_ends_where_the_minimiser_does(pair, button, hand):
    last, fall = BOARDS[pair].pressed(button).fall()
    corner = minimise(pair.polyhedron, pair.energy, pair.nested(hand))
    np.testing.assert_allclose(pair.heading(last.q), pair.heading(corner.point), atol=1e-9)
    assert fall["verdict"] == corner.verdict.value
    found = certify(pair.polyhedron, pair.energy, last.q)
    words = fall["last"]["words"]
    for name, value in found.multipliers.items():
        assert f"{name} {value:.6f}" in words["multipliers"]
    assert words["rest"] == corner.verdict.value
    assert words["stratum"].startswith("dimension 3, rank 3")
    heights = [float(frame["words"]["energy"].split()[0]) for frame in fall["frames"]]
    assert heights == sorted(heights, reverse=True)
    assert last.moved({"axial_A": last.values["axial_A"]}).reading()["words"] == words


def test_a_fall_from_an_overlap_begins_at_a_place_without():
    board = BOARDS[DRUM].moved(dict.fromkeys(coordinates(), 0.0))
    assert board.reading()["words"]["contacts"] == "none"
    last, fall = board.fall()
    if fall["frames"][0]["words"]["stratum"] == "outside the polyhedron":
        assert "no point of the polyhedron was reached" in fall["verdict"]
        assert last.q == board.q
    else:
        assert DRUM.polyhedron.implicit(last.q) > -1e-8


def test_on_a_face_where_the_weight_is_not_balanced_the_multipliers_are_called_a_fit():
    apart = PLANE.side_by_side()  # ball on ball twice, at the same height
    board = BOARDS[PLANE]
    q = dict(zip(coordinates(), (apart * board.units).tolist(), strict=True))
    words = board.moved({k: v + (20.0 if "lateral" in k else 0) for k, v in q.items()}).words
    assert words["contacts"] == "A1B1, A2B2"
    assert words["multipliers"].endswith("(least squares: the contacts do not balance the weight)")
    assert words["rest"].startswith("not a minimum")


def test_the_shape_changes_and_places_along_the_wall_stay():
    board = BOARDS[DRUM]
    other = board.moved({"drum_radius": 60.0, "length": 20.0})
    assert (other.pair.drum_radius, other.pair.length) == (60.0, 20.0)
    flat = other.pressed("plane")
    assert flat.pair.is_plane
    back = flat.moved({"ball_radius": 2.5, "drum_radius": 70.0}).pressed("drum")
    assert (back.pair.drum_radius, back.pair.ball_radius) == (70.0, 2.5)
    for one in (other, flat, back):
        for name in coordinates():
            assert one.values[name] == pytest.approx(board.values[name])
    with pytest.raises(ValueError, match="rod_radius: expected less than the ball radius"):
        board.moved({"rod_radius": 4.0})


@given(st.sampled_from([DRUM, PLANE]), st.integers(0, 2**32 - 1))
def test_a_place_in_the_atlas_is_where_the_same_bodies_are(pair, seed):
    """Back from the atlas there are the same gaps, up to the names of balls."""
    q = pair.placements(np.random.default_rng(seed), 1)[0]
    place = atlas_place(pair, q) / [1, 1, pair.length / 2]
    heading = None if pair.is_plane else (q[2] + q[5]) / 2
    same = relative_placements(pair, place, mean_heading=heading)
    assert pair.polyhedron.implicit(same) == pytest.approx(pair.polyhedron.implicit(q), abs=1e-9)


def test_a_trail_is_cut_where_it_leaves_the_atlas():
    q = np.zeros((9, 6))
    q[:, 4], q[:, 5] = 30.0, np.linspace(1.0, 2.0, 9)  # past a quarter turn
    pieces = trail(PLANE, q)
    assert [len(piece) for piece in pieces] == [5, 4]
    assert sum(pieces[0][:, 2] > 0) == 5
    assert sum(pieces[1][:, 2] < 0) == 4


# ------------------------------------------------------------------------------------- the server


@contextlib.asynccontextmanager
async def serving(application):
    server = HTTPServer(application)
    listener = viewer_server.bound("127.0.0.1", 0)
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
            assert "rod_radius: expected less than the ball radius 3 mm" in refused["problem"]
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
                    assert second.close_reason.startswith(
                        "as many pages are open as there may be, 1"
                    )
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


@pytest.mark.parametrize(
    ("host", "bound_to", "expected"),
    [
        ("127.0.0.1:8760", "127.0.0.1", True),
        ("LOCALHOST", "127.0.0.1", True),
        ("[::1]:80", "::1", True),
        ("192.168.1.5:8760", "127.0.0.1", False),
        ("192.168.1.5:8760", "0.0.0.0", True),
        ("[fe80::1]:8760", "::", True),
        ("evil.example", "0.0.0.0", False),
        ("lab.example:1", "lab.example", True),
        ("", "0.0.0.0", False),
        ("127.0.0.1:80; script-src *", "127.0.0.1", False),  # it is repeated in a header
        ("127.0.0.1:", "127.0.0.1", False),
    ],
)
def test_names_of_a_server(host, bound_to, expected):
    assert viewer_server.allowed(host, viewer_server.names_of(bound_to)) is expected


def test_a_port_in_use_is_a_sentence_with_one_that_is_free():
    with viewer_server.bound("127.0.0.1", 0) as first:
        port = first.getsockname()[1]
        with pytest.raises(viewer_server.PortTakenError, match=f"{port} is in use") as taken:
            viewer_server.bound("127.0.0.1", port)
        free = int(taken.value.strerror.split()[-3])
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", free))
