"""A server on this machine: where it listens, and by which names it may be called."""

import asyncio
import errno
import ipaddress
import re
import socket
from collections.abc import Callable
from contextlib import suppress

from tornado.httpserver import HTTPServer
from tornado.web import Application

LOCAL = ("127.0.0.1", "localhost", "[::1]")
EVERYWHERE = frozenset({"0.0.0.0", "[::]"})
LARGEST = 16_384  # bytes of a request's header, and of its body
HOST = re.compile(r"(\[[0-9a-fA-F:.]+\]|[0-9a-zA-Z.-]+)(?::[0-9]{1,5})?")
TRIES = 50  # ports after the one that is taken


class PortTakenError(OSError):
    """The port is in use; says which one is free."""


def allowed(host: str, names: tuple[str, ...]) -> bool:
    """Return whether a ``Host`` header names this server: one of its names, whatever the port.

    The port is not looked at, since it may be forwarded.  When the server listens everywhere
    (``0.0.0.0``) any literal address is its name: another site can have its own name pointed
    here, but not an address.
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
    """Return the names by which a server on an address may be called."""
    called = f"[{host}]" if ":" in host else host.lower()
    return (called, *LOCAL)


def serve(application: Application, listener: socket.socket, ready: Callable[[str], None]) -> None:
    """Serve until interrupted.

    Parameters
    ----------
    application : Application
    listener : socket
        As of :func:`bound`; it is closed at the end.
    ready : callable
        Called with the address of the page once it can be opened.
    """
    with suppress(KeyboardInterrupt), listener:
        asyncio.run(_serve(application, listener, ready))


async def _serve(
    application: Application, listener: socket.socket, ready: Callable[[str], None]
) -> None:
    server = HTTPServer(application, max_body_size=LARGEST, max_header_size=LARGEST)
    server.add_sockets([listener])
    host, port = listener.getsockname()[:2]
    ready(f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/")
    try:
        await asyncio.Event().wait()
    finally:
        server.stop()
        await server.close_all_connections()


def bound(host: str, port: int) -> socket.socket:
    """Return a listening socket on an address and a port; port 0 takes any that is free.

    Raises
    ------
    PortTakenError
        If the port is in use, naming one that is free.
    OSError
        If the address is none of this machine's.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen(128)
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
    """Return the next port that is free, if one of the nearest is."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for candidate in range(port + 1, min(port + TRIES, 65536)):
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            try:
                probe.bind((host, candidate))
            except OSError:
                continue
            return candidate
    return None
