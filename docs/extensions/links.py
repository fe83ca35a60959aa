"""Every link within the built site leads to a file, and to a place in it, that exists."""

from collections.abc import Iterator
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """What a page links to, and the places in it that can be linked to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.places: set[str] = {""}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take down links and places."""
        for name, value in attrs:
            if name in ("href", "src") and tag != "use":
                self.links.append(value or "")
            elif name in ("id", "name"):
                self.places.add(value or "")


@cache
def page(file: Path) -> Page:
    """Return a page, read once."""
    return Page(file.read_text(encoding="utf-8"))


def broken(folder: Path) -> Iterator[str]:
    """Yield a sentence for every link within a site that leads nowhere, or out of it by script."""
    for file in sorted(set(folder.rglob("*.html")) - set(folder.glob("_static/**/*"))):
        for link in sorted(set(page(file).links)):
            fault = _fault(folder, file, link)
            if fault:
                yield f"{file.relative_to(folder)}: the link {link!r} {fault}"


def _fault(folder: Path, file: Path, link: str) -> str:
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return ""
    target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
    if not target.is_relative_to(folder.resolve()):
        return "leaves the site"
    if not target.is_file():
        return "leads to no file"
    if target.suffix == ".html" and unquote(parts.fragment) not in page(target).places:
        return "leads to no place on that page"
    return ""


def check(app: Any, failure: Exception | None) -> None:
    """Warn of every broken link once the site is built."""
    from sphinx.util.logging import getLogger

    if failure is None and app.builder.name == "html":
        page.cache_clear()
        for sentence in broken(Path(app.outdir)):
            getLogger(__name__).warning(sentence)


def setup(app: Any) -> dict[str, bool]:
    """Check when all other extensions have written their files."""
    app.connect("build-finished", check, priority=1000)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
