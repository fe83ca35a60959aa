"""Names of a server, its port, and its connections."""

import asyncio
import socket
from contextlib import suppress

import pytest

from polycorner.dumbbells.viewer import server
from polycorner.dumbbells.viewer.applications import page_application


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
    assert server.allowed(host, server.names_of(bound_to)) is expected


def test_a_port_in_use_is_a_sentence_with_one_that_is_free():
    with server.bound("127.0.0.1", 0) as first:
        port = first.getsockname()[1]
        with pytest.raises(server.PortTakenError, match=f"{port} is in use") as taken:
            server.bound("127.0.0.1", port)
        free = int(taken.value.strerror.split()[-3])
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", free))


def answers(port, *, start=b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"):
    """Open a connection and send the start of a request; return it with what is answered."""
    connection = socket.create_connection(("127.0.0.1", port))
    connection.sendall(start)
    return connection


def test_connections_that_say_nothing_are_few_and_end(monkeypatch):
    """Of twenty with half a request eight are kept, and not for long; then others are served."""
    monkeypatch.setattr(server, "MOST", 8)
    monkeypatch.setattr(server, "IDLE", 1.0)
    half = b"GET / HTTP/1.1\r\nHost:"

    def talk(port):
        open_ = [answers(port, start=half) for _ in range(20)]
        for connection in open_:
            with connection, suppress(ConnectionResetError):
                assert connection.recv(100) == b""  # closed by the server
        with answers(port) as last:
            return last.recv(100)

    async def both():
        with server.bound("127.0.0.1", 0) as listener:
            running = server.Server(page_application("page", "127.0.0.1"))
            running.add_sockets([listener])
            found = await asyncio.to_thread(talk, listener.getsockname()[1])
            running.stop()
            await running.close_all_connections()
            return found, running.open

    found, left = asyncio.run(both())
    assert found.startswith(b"HTTP/1.1 200 OK")
    assert left == 0
