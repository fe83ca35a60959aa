"""Names of a server, and its port."""

import socket

import pytest

from polycorner.dumbbells.viewer import server


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
