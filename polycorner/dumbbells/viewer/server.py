"""The local server: listening sockets, and the host names it answers to."""

import asyncio
import errno
import ipaddress
import re
import socket
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.iostream import IOStream
from tornado.web import Application

from polycorner.toolkit import checked, refuse, whole

LOCAL = ("127.0.0.1", "localhost", "[::1]")
EVERYWHERE = frozenset({"0.0.0.0", "[::]"})
LARGEST = 16_384  # most bytes of a request's header, and of its body
MOST = 64  # connections at a time
IDLE = 20.0  # s to wait for a request, or for the rest of one
HOST = re.compile(r"(\[[0-9a-fA-F:.]+\]|[0-9a-zA-Z.-]+)(?::[0-9]{1,5})?")
PORTS = 65535  # the last one
TRIES = 50  # ports tried after one that is in use


class PortTakenError(OSError):
    """The port is in use; the message names one that is free."""


def allowed(host: str, names: tuple[str, ...]) -> bool:
    """Return whether a ``Host`` header names this server: one of its names, whatever the port.

    The port is ignored, since it may be forwarded.  A server that listens on all interfaces
    (``0.0.0.0``) answers to every literal address: DNS rebinding works with names only.
    """
    found = HOST.fullmatch(host)
    if found is None:
        return False
    name = found.group(1).lower()
    if name in names:
        return True
    return bool(EVERYWHERE & set(names)) and _literal(name)


def _literal(name: str) -> bool:
    try:
        ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return False
    return True


def names_of(host: str) -> tuple[str, ...]:
    """Return the host names of a server on an address."""
    called = f"[{host}]" if ":" in host else host.lower()
    return (called, *LOCAL)


def serve(application: Application, listener: socket.socket, ready: Callable[[str], None]) -> None:
    """Serve until interrupted.

    Parameters
    ----------
    application : Application
    listener : socket
        From :func:`bound`; it is closed at the end.
    ready : callable
        Called with the address of the page once it can be opened.
    """
    with suppress(KeyboardInterrupt), listener:
        asyncio.run(_serve(application, listener, ready))


class Server(HTTPServer):
    """A server that takes ``MOST`` connections at a time, and waits ``IDLE`` seconds for each."""

    def initialize(self, *arguments: Any, **options: Any) -> None:
        """Take the arguments of ``HTTPServer``, which asks for this method in place of another."""
        limits = {"max_body_size": LARGEST, "max_header_size": LARGEST}
        waits = {"idle_connection_timeout": IDLE, "body_timeout": IDLE}
        super().initialize(*arguments, **limits | waits | options)
        self.open = 0  # connections that are not pages, whose number is limited elsewhere

    def handle_stream(self, stream: IOStream, address: Any) -> None:
        """Serve a connection, or close it at once where there are too many."""
        if self.open >= MOST:
            stream.close()
            return
        self.open += 1
        super().handle_stream(stream, address)

    def on_close(self, server_conn: object) -> None:
        """Note that a connection has ended, or has become that of a page."""
        self.open -= 1
        super().on_close(server_conn)


async def _serve(
    application: Application, listener: socket.socket, ready: Callable[[str], None]
) -> None:
    server = Server(application)
    server.add_sockets([listener])
    host, port = listener.getsockname()[:2]
    ready(f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/")
    try:
        await asyncio.Event().wait()
    finally:
        server.stop()
        await server.close_all_connections()


@checked
def bound(host: str, port: int) -> socket.socket:
    """Return a listening socket on an address and a port; port 0 is any free one.

    Raises
    ------
    TypeError, ValueError
        For anything but text and a port, and for a name that no machine has.
    PortTakenError
        If the port is in use, naming one that is free.
    OSError
        If the address does not belong to this machine.
    """
    whole("port", port, least=0, most=PORTS)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen(128)
    except (socket.gaierror, UnicodeError):
        listener.close()
        refuse("host", "an address or a name of this machine", host)
    except OSError as error:
        listener.close()
        if error.errno != errno.EADDRINUSE:
            raise
        free = _free_after(host, port)
        hint = f"; {free} is free" if free else ""
        msg = f"expected a port that is free; {port} is in use{hint}"
        raise PortTakenError(error.errno, msg) from error
    listener.setblocking(False)
    return listener


def _free_after(host: str, port: int) -> int | None:
    """Return the next free port within ``TRIES``, or None."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for candidate in range(port + 1, min(port + TRIES, PORTS + 1)):
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            try:
                probe.bind((host, candidate))
            except OSError:
                continue
            return candidate
    return None
