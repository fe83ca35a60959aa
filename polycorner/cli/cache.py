"""``polycorner cache``: the folder of compiled code and unfinished searches."""

from typing import Any

from polycorner.cli.options import command, examples, option
from polycorner.cli.output import deliver, shown, timed

EPILOG = (
    examples("cache", "cache --clear")
    + """
The folder holds compiled code, and searches and runs that were interrupted without --out.  The
environment variable POLYCORNER_CACHE_DIR names another folder.
"""
)


@command(epilog=EPILOG)
@option("--clear", is_flag=True, help="Delete all files in it, unfinished work included.")
@option("--json", "as_json", is_flag=True, group="Output", help="Print JSON, not tables.")
def cache(clear: bool, as_json: bool) -> None:
    """Show the cache folder and its size, or clear it."""
    from polycorner.formulas.cache import cache_folder, cache_size, clear_cache

    with timed("clearing" if clear else "counting"):
        count, size = clear_cache() if clear else cache_size()
    answer = {"folder": str(cache_folder()), "files": count, "bytes": size, "cleared": clear}
    deliver(answer, lambda: _text(answer), as_json=as_json)


def _text(answer: dict[str, Any]) -> str:
    from polycorner.printing import Sheet, facts

    size = f"{answer['files']} files, {answer['bytes'] / 1e6:.1f} MB"
    row = ("deleted" if answer["cleared"] else "contents", size)
    return shown(Sheet("", (facts((("folder", answer["folder"]), row)),)))
