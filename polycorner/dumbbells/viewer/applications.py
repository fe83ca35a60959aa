"""Applications of the local server: the live page of a pair, and pages complete in themselves.

Requests with a foreign ``Host`` (DNS rebinding) and connections from a foreign ``Origin`` are
refused.  No request reads a file; the accepted messages are those of
:mod:`polycorner.dumbbells.viewer.board`.
"""

import json
import time
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from tornado.ioloop import IOLoop
from tornado.web import Application, HTTPError, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.pictures.scenes import solid_bytes
from polycorner.dumbbells.viewer.board import MESSAGE, Board, UnknownMessageError, hello, parsed
from polycorner.dumbbells.viewer.page import own_file
from polycorner.dumbbells.viewer.server import allowed, names_of
from polycorner.toolkit import checked, page_file, three_script

RATE = 300  # most messages of a page in a second
PAGES = 16  # most live pages at a time
QUIET = 0.15  # s without a message before the solid is computed again
CELLS = 18  # of the solid along each axis; its edges and corners are exact at any number
REFUSED = 1008  # policy violation in RFC 6455
HEADERS = {
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Server": "polycorner",
}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; "
    "connect-src 'self' ws://{host}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
UNFRAMED = "frame-ancestors 'none'"  # the page itself holds the rest of its policy
TYPES = {"js": "text/javascript", "css": "text/css", "html": "text/html"}

Files = Mapping[str, str]


class _Guarded(RequestHandler):
    """Security headers, and the refusal of foreign host names."""

    def initialize(self, names: tuple[str, ...], **_: Any) -> None:
        self.names = names

    def set_default_headers(self) -> None:
        for name, value in HEADERS.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        if not allowed(self.request.host, self.names):
            raise HTTPError(403, reason="This is not a name of this server.")

    def write_error(self, status_code: int, **_: Any) -> None:
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"{status_code} {self._reason}\n")


class _Missing(_Guarded):
    """All other paths."""

    def prepare(self) -> None:
        super().prepare()
        raise HTTPError(404, reason="There is no page of that name.")


class _Fixed(_Guarded):
    """A fixed text."""

    def initialize(self, names: tuple[str, ...], **given: Any) -> None:
        super().initialize(names)
        self.text, self.kind, self.policy = given["text"], given["kind"], given["policy"]

    def get(self) -> None:
        self.set_header("Content-Type", f"{TYPES[self.kind]}; charset=utf-8")
        self.set_header("Content-Security-Policy", self.policy.format(host=self.request.host))
        self.finish(self.text)


class _Live(WebSocketHandler):
    """One live page: its board, and slider values received but not yet answered."""

    def initialize(self, names: tuple[str, ...], pair: DumbbellPair) -> None:
        self.names, self.board = names, Board.of(pair)
        self.waiting: dict[str, float] = {}
        self.counted, self.second = 0, 0
        self.solid: Any = None
        self.drawn: Any = None
        self.refused = False

    def prepare(self) -> None:
        origin = self.request.headers.get("Origin")
        if not allowed(self.request.host, self.names):
            raise HTTPError(403, reason="This is not a name of this server.")
        if origin is None or not self.check_origin(origin):
            raise HTTPError(403, reason="Only this server's own page may connect.")

    def check_origin(self, origin: str) -> bool:
        return origin.lower() == f"http://{self.request.host.lower()}"

    def open(self, *_: str, **__: str) -> None:
        pages: set[_Live] = self.settings["pages"]
        if len(pages) >= PAGES:
            self._refuse(f"the limit of {PAGES} open pages is reached: close one of them")
            return
        pages.add(self)
        self._tell("hello", hello(self.board.sliders))
        self._tell("reading", self.board.reading() | {"problem": ""})
        self._draw_soon()

    def on_close(self) -> None:
        self.settings["pages"].discard(self)
        if self.solid is not None:
            IOLoop.current().remove_timeout(self.solid)

    def on_message(self, message: str | bytes) -> None:
        if self.refused:
            return
        try:
            asked = self._understood(message)
        except UnknownMessageError as error:
            self._refuse(str(error))
            return
        if isinstance(asked, str):
            self._press(asked)
            return
        if not self.waiting:  # values that arrive before the answer share it
            IOLoop.current().add_callback(self._answer)
        self.waiting |= asked

    def _understood(self, message: str | bytes) -> dict[str, float] | str:
        second = int(time.monotonic())
        self.counted = self.counted + 1 if second == self.second else 1
        self.second = second
        if self.counted > RATE:
            msg = f"expected at most {RATE} messages in a second"
            raise UnknownMessageError(msg)
        if isinstance(message, bytes) or len(message) > MESSAGE:
            msg = f"expected a text of at most {MESSAGE} characters"
            raise UnknownMessageError(msg)
        return parsed(message, self.board.sliders)

    def _refuse(self, words: str) -> None:
        self.refused = True
        self.close(REFUSED, words[:120])  # the limit of a closing frame

    def _answer(self) -> None:
        values, self.waiting = self.waiting, {}
        problem = ""
        try:
            self.board = self.board.moved(values)
        except ValueError as error:
            problem = f"There are no such dumbbells: {error}."
        self._tell("reading", self.board.reading() | {"problem": problem})
        self._draw_soon()

    def _press(self, button: str) -> None:
        if button == "fall":
            self.board, fall = self.board.fall()
            self._tell("fall", fall)
        else:
            self.board = self.board.pressed(button)
            self._tell("reading", self.board.reading() | {"problem": ""})
        self._draw_soon()

    def _tell(self, kind: str, content: dict[str, Any]) -> None:
        self._send(json.dumps({"kind": kind} | content, allow_nan=False))

    def _send(self, message: str | bytes) -> None:
        with suppress(WebSocketClosedError):  # the page may have been closed meanwhile,
            sent: Any = self.write_message(message, binary=isinstance(message, bytes))
            sent.add_done_callback(lambda done: done.cancelled() or done.exception())  # or later

    def _draw_soon(self) -> None:
        """Compute the solid after ``QUIET`` seconds without messages, if it has changed."""
        loop = IOLoop.current()
        if self.solid is not None:
            loop.remove_timeout(self.solid)
        self.solid = loop.call_later(QUIET, self._draw)

    def _draw(self) -> None:
        self.solid = None
        pair = self.board.pair
        heading = None if pair.is_plane else round(self.board.mean_heading, 3)
        if self.drawn != (pair, heading):
            self.drawn = (pair, heading)
            self._send(solid_bytes(pair, mean_heading=heading, resolution=CELLS))


# ---------------------------------------------------------------------------------------- servers


@checked
def live_application(pair: DumbbellPair, host: str) -> Application:
    """Return the application of the live page of a pair, with its kernels compiled."""
    Board.of(pair).fall()
    texts = {name: page_file(name) for name in ("stage.js", "page.css")}
    texts |= {name: own_file(name) for name in ("dumbbells.js", "board.js")}
    texts |= {"": own_file("board.html"), "three.js": three_script()}
    return _application(texts, POLICY, host, [("/live", _Live, {"pair": pair})])


@checked
def page_application(page: str, host: str) -> Application:
    """Return the application that serves one page complete in itself."""
    return _application({"": page}, UNFRAMED, host, [])


def _application(texts: Files, policy: str, host: str, more: list[Any]) -> Application:
    names = names_of(host)
    routes: list[Any] = [
        (f"/{name}", _Fixed, {"names": names, "text": text, "kind": _kind(name), "policy": policy})
        for name, text in texts.items()
    ]
    routes += [(path, handler, {"names": names} | given) for path, handler, given in more]
    return Application(
        routes,
        default_handler_class=_Missing,
        default_handler_args={"names": names},
        pages=set(),
        websocket_max_message_size=8 * MESSAGE,
        compress_response=True,
        log_function=lambda _: None,
    )


def _kind(name: str) -> str:
    return name.rpartition(".")[2] or "html"
