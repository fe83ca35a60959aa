"""A page in headless Chromium, spoken to through a pipe: what it asks for, and what it measures."""

import base64
import fcntl
import json
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--remote-debugging-pipe",
)
FLAT = ("--disable-gpu",)
DEEP = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")  # WebGL without a graphics card
PATIENCE = 30.0  # s


def needed() -> str:
    """Return a browser of this family; skip the test if there is none on this machine."""
    name = next(filter(None, map(shutil.which, NAMES)), None)
    if name is None:
        pytest.skip("no Chromium on this machine")
    return name


class Page:
    """An empty page in a browser of its own."""

    def __init__(self, reading: int, writing: int) -> None:
        self._reading, self._writing = reading, writing
        self._buffer = b""
        self._count = 0
        self._session: str | None = None
        self.events: list[dict[str, Any]] = []
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.ask("Target.attachToTarget", targetId=target, flatten=True)[
            "sessionId"
        ]
        for domain in ("Page", "Network", "Log", "Runtime"):
            self.ask(f"{domain}.enable")

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command and return its result."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._writing, json.dumps(message).encode() + b"\0")
        while (answer := self._next()).get("id") != self._count:
            self.events.append(answer)
        assert "result" in answer, answer
        return answer["result"]

    def open(self, place: Path | str, *, width: int, dark: bool = False) -> None:
        """Open a file, or an address, on a screen of some width and wait until it is loaded."""
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=900, deviceScaleFactor=1, mobile=width < 600,
        )  # fmt: skip
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.ask("Emulation.setEmulatedMedia", features=[scheme])
        self.events.clear()
        self.ask("Page.navigate", url=place if isinstance(place, str) else place.as_uri())
        while not any(event.get("method") == "Page.loadEventFired" for event in self.events):
            self.events.append(self._next())

    def value(self, expression: str) -> Any:
        """Return the value of a JavaScript expression on the page."""
        result = self.ask(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def wait(self, expression: str, seconds: float = PATIENCE) -> Any:
        """Wait until a JavaScript expression is true and return its value."""
        end = time.monotonic() + seconds
        while not (value := self.value(expression)):
            assert time.monotonic() < end, f"{expression} is still {value!r}"
            time.sleep(0.02)
        return value

    def click(self, selector: str) -> None:
        """Press the middle of an element with the mouse, scrolling to it if need be."""
        x, y = self.middle(selector)
        for kind in ("mousePressed", "mouseReleased"):
            self._mouse(kind, x, y, button="left", clickCount=1)

    def middle(self, selector: str) -> tuple[float, float]:
        """Return where the middle of an element is on the screen, scrolling to it if need be."""
        element = f"document.querySelector({json.dumps(selector)})"
        box = f"{element}.getBoundingClientRect()"
        self.value(f"{element}.scrollIntoView({{block: 'center'}})")
        x, y = self.value(f"[{box}.left + {box}.width / 2, {box}.top + {box}.height / 2]")
        return x, y

    def drag(self, selector: str, right: float, down: float) -> None:
        """Drag the middle of an element by so many pixels with the left button."""
        x, y = self.middle(selector)
        self._mouse("mouseMoved", x, y)
        self._mouse("mousePressed", x, y, button="left", clickCount=1)
        for part in (0.5, 1.0):
            self._mouse("mouseMoved", x + part * right, y + part * down, button="left", buttons=1)
        self._mouse("mouseReleased", x + right, y + down, button="left", clickCount=1)

    def wheel(self, selector: str, down: float) -> None:
        """Turn the wheel over the middle of an element."""
        x, y = self.middle(selector)
        self._mouse("mouseWheel", x, y, deltaX=0, deltaY=down)

    def _mouse(self, kind: str, x: float, y: float, **more: Any) -> None:
        self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def press(self, key: str, code: int = 0) -> None:
        """Press and release a key by its name, such as ``ArrowRight``; a letter is typed."""
        text = {"text": key} if len(key) == 1 else {}
        named = {"key": key, "windowsVirtualKeyCode": code}
        self.ask("Input.dispatchKeyEvent", type="keyDown", **named, **text)
        self.ask("Input.dispatchKeyEvent", type="keyUp", **named)

    def slide(self, selector: str, value: float) -> None:
        """Set a slider or a field as a hand would: its value changes and it says so."""
        element = f"document.querySelector({json.dumps(selector)})"
        self.value(f"{element}.value = {value!r}")
        self.value(f"{element}.dispatchEvent(new Event('input', {{bubbles: true}}))")

    def picture(self, file: Path | None = None, *, whole: bool = False) -> bytes:
        """Return the screen, or the whole page, as PNG, and write it to a file if one is given."""
        shot = self.ask("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        content = base64.b64decode(shot["data"])
        if file is not None:
            file.write_bytes(content)
        return content

    def requests(self) -> list[str]:
        """Return the addresses that were asked for since the page was opened."""
        return [
            event["params"]["request"]["url"]
            for event in self.events
            if event.get("method") == "Network.requestWillBeSent"
        ]

    def complaints(self) -> list[str]:
        """Return what the browser, or a script, had to say about the page."""
        return [words for event in self.events for words in _said(event)]

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            part = os.read(self._reading, 1 << 16)
            assert part, "the browser has closed the connection"
            self._buffer += part
        message, self._buffer = self._buffer.split(b"\0", 1)
        return json.loads(message)


def _said(event: dict[str, Any]) -> list[str]:
    """Return the complaint that an event is: of the browser, an exception, or on the console."""
    given = event.get("params", {})
    match event.get("method"):
        case "Log.entryAdded":
            return [given["entry"]["text"]]
        case "Runtime.exceptionThrown":
            details = given["exceptionDetails"]
            return [details.get("exception", {}).get("description", details["text"])]
        case "Runtime.consoleAPICalled" if given["type"] in ("error", "warning"):
            return [str([part.get("value") for part in given["args"]])]
    return []


@contextmanager
def page(browser: str, profile: Path, *, graphics: bool = False) -> Iterator[Page]:
    """Start a browser with a fresh profile, with WebGL if asked for, and end it afterwards."""
    # The browser reads commands from descriptor 3 and answers on 4.
    ends = [
        fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10)
        for pair in (os.pipe(), os.pipe())
        for end in pair
    ]
    commands, writing, reading, answers = ends
    actions = [(os.POSIX_SPAWN_DUP2, commands, 3), (os.POSIX_SPAWN_DUP2, answers, 4)]
    actions += [(os.POSIX_SPAWN_OPEN, 2, os.devnull, os.O_WRONLY, 0)]
    flags = (*FLAGS, *(DEEP if graphics else FLAT))
    arguments = [browser, *flags, f"--user-data-dir={profile}"]
    process = os.posix_spawn(browser, arguments, os.environ, file_actions=actions)
    os.close(commands)
    os.close(answers)
    try:
        opened = Page(reading, writing)
        yield opened
        opened._session = None
        opened.ask("Browser.close")
    finally:
        os.close(writing)
        os.close(reading)
        os.waitpid(process, 0)
