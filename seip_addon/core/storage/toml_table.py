"""TOML files of users, checked against the allowed keys of their tables."""

import difflib
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeGuard

from ..base.errors import SeipError
from ..base.limits import MAP_NUMBER, Limits
from .files import check_regular

Reader = Callable[[Any], Any]  # converts a value; raises a `ValueError` that names the accepted values
REQUIRED = object()  # default of a required key


@dataclass(frozen=True)
class Key:
    """Reader and default of a key of a table."""

    read: Reader
    default: Any = REQUIRED


def toml_text(path: Path, what: str) -> str:
    """Return the text of a TOML file; ``what`` it holds is for messages.

    Raises
    ------
    SeipError
        The file cannot be read, or is not UTF-8 text.
    """
    check_regular(path)
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not UTF-8 text"
        raise SeipError(f"cannot read the {what} {path}: {reason}; name a TOML file") from error


def parse_toml(text: str, file: str) -> dict[str, Any]:
    """Return the tables of a TOML file.

    Raises
    ------
    SeipError
        The text is not valid TOML.
    """
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise SeipError(f"{file} is not valid TOML: {error}") from error


def read_table(content: Mapping[str, Any], where: str, keys: Mapping[str, Key]) -> dict[str, Any]:
    """Return the values of a table for all keys of ``keys``.

    Parameters
    ----------
    where : str
        Location for messages: the file, and the number of the table in it.

    Raises
    ------
    SeipError
        A key is missing or unknown (close ones are suggested), or has a value of the wrong type.
    """
    values = {}
    for name, key in keys.items():
        if name in content:
            try:
                values[name] = key.read(content[name])
            except ValueError as error:
                raise SeipError(f"{where}: {name} {error}") from error
        elif key.default is REQUIRED:
            close = difflib.get_close_matches(name, content.keys() - keys.keys(), n=1, cutoff=0.6)
            raise SeipError(f"{where}: {name} is missing{f' (is {close[0]!r} a slip?)' if close else ''}")
        else:
            values[name] = key.default
    for name in content:
        if name not in keys:
            close = difflib.get_close_matches(name, keys, n=3, cutoff=0.5) or sorted(keys)
            raise SeipError(f"{where}: unknown key {name!r}; did you mean {' or '.join(close)}?")
    return values


def text(value: object) -> str:
    """Return a value if it is a text and not empty."""
    if not isinstance(value, str) or not value:
        raise ValueError("must be a text in quotes")
    return value


def number(limits: Limits) -> Reader:
    """Return a reader of numbers within limits."""

    def read(value: object) -> float:
        if not is_number(value):
            raise ValueError(f"must be a number from {limits}")
        if not limits.least <= value <= limits.most:
            raise ValueError(f"must be {limits}, not {value:g}")
        return float(value)

    return read


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a finite number of plausible size; TOML allows integers of any length."""
    return (
        isinstance(value, (int, float)) and not isinstance(value, bool) and MAP_NUMBER.least < value < MAP_NUMBER.most
    )
