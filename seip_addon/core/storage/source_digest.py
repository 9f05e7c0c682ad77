"""Digests of program code, as part of the keys of stored results."""

import ast
import functools
import importlib.util
import sys
import threading
from collections.abc import Iterator
from importlib.machinery import ModuleSpec, PathFinder

from ..errors import SeipError
from .files import digest

CORE = __package__.rpartition(".")[0]  # full name of the core, which differs between Blender extensions and a checkout

_OURS = (CORE, "headless")

_ONE_AT_A_TIME = threading.Lock()  # before Python 3.11.8 parsing in two threads at once raises a SystemError


def source_digest(module: str) -> str:
    """Return a digest of the sources of a module and of all modules that it imports, directly or indirectly.

    Modules of the core and of `headless` are included, also if imported within functions, and the packages that contain
    them. Sources are read through their loaders, so that they may be in an archive; no source is executed.

    Parameters
    ----------
    module : str
        Full name of the module, such as ``__name__``.

    Raises
    ------
    SeipError
        A source is missing.
    """
    with _ONE_AT_A_TIME:
        return _digest(module)


@functools.cache
def _digest(module: str) -> str:
    sources = _sources(module)
    return digest(*(part for name in sorted(sources) for part in (name.removeprefix(CORE), sources[name])))


def _sources(module: str) -> dict[str, str]:
    """Return the sources of a module and of the modules that it imports, by full name."""
    sources: dict[str, str] = {}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name in sources or not _is_ours(name):
            continue
        spec = _spec(name)
        read = getattr(spec and spec.loader, "get_source", None)  # of files, archives and folders without a module
        source = read and read(name)
        if spec is None or source is None:
            raise SeipError(f"the source of {name} is missing: install the program again")
        sources[name] = source
        waiting += [name.rpartition(".")[0], *_imported(spec, source)]
    return sources


def _spec(name: str) -> ModuleSpec | None:
    """Find a module without importing its packages, which `importlib.util.find_spec` would do."""
    if name in sys.modules:
        return sys.modules[name].__spec__
    package = name.rpartition(".")[0]
    if not package:
        return PathFinder.find_spec(name)
    holder = _spec(package)
    if holder is None or holder.submodule_search_locations is None:
        return None
    return PathFinder.find_spec(name, holder.submodule_search_locations)


def _is_ours(name: str) -> bool:
    return any(name == part or name.startswith(f"{part}.") for part in _OURS)


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the statements of a module, those within others included, without their expressions."""
    for name in ("body", "handlers", "orelse", "finalbody", "cases"):
        inner = getattr(node, name, ())
        for statement in inner if isinstance(inner, list) else ():  # the body of a lambda is an expression
            yield statement
            yield from _statements(statement)


def _imported(spec: ModuleSpec, source: str) -> Iterator[str]:
    """Yield the full names of the project's modules that a module imports anywhere in its source."""
    package = spec.name if spec.submodule_search_locations is not None else spec.name.rpartition(".")[0]
    for node in _statements(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            name = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
            if not _is_ours(name):
                continue
            yield name
            found = _spec(name)
            if found is not None and found.submodule_search_locations is not None:  # otherwise names are not modules
                parts = (f"{name}.{alias.name}" for alias in node.names)
                yield from (part for part in parts if _spec(part) is not None)
