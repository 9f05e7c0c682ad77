"""Digests of the program's sources, as part of the keys of stored results."""

import functools
from collections.abc import Iterator
from importlib.resources import files
from importlib.resources.abc import Traversable

from .files import digest

CORE = __package__.rpartition(".")[0]  # full name of the core, which differs between Blender extensions and a checkout


@functools.cache
def source_digest(*packages: str) -> str:
    """Return a digest of all sources of the core, and of further packages.

    Sources may be in an archive; none is executed. Any change of the program gives its results other keys.

    Examples
    --------
    >>> source_digest() == source_digest("headless.charts")
    False
    """
    sources = [part for name in (CORE, *packages) for part in _sources(files(name), "")]
    return digest(*sources)


def _sources(folder: Traversable, path: str) -> Iterator[str]:
    """Yield path and text of each module in a folder, in the order of their names."""
    for entry in sorted(folder.iterdir(), key=lambda one: one.name):
        if entry.is_dir():
            yield from _sources(entry, f"{path}/{entry.name}")
        elif entry.name.endswith(".py"):
            yield from (f"{path}/{entry.name}", entry.read_text(encoding="utf-8"))
