"""Conversion of dataclasses from JSON, with every value checked against its field, and of settings to JSON."""

import json
import math
import reprlib
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import cache, partial
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from ..base.errors import SeipError
from ..base.settings import settings_of
from .files import parse_json

Value = TypeVar("Value")

_PLAIN: dict[type, tuple[str, tuple[type, ...]]] = {
    str: ("a text", (str,)),
    bool: ("true or false", (bool,)),
    int: ("a whole number", (int,)),
    float: ("a number", (int, float)),
    NoneType: ("null", (NoneType,)),
    tuple: ("a list", (list, tuple)),
    dict: ("an object", (dict,)),
}
"""Name of each type in messages, and the types of JSON values that are accepted for it."""


def from_json(kind: type[Value], content: object, where: str = "") -> Value:
    """Return a dataclass from a JSON value whose keys are the names of the fields.

    Fields are ``str``, ``bool``, ``int``, ``float`` (whole numbers stay as they are), ``object`` (anything), literals,
    dataclasses, and tuples, mappings by name and unions of these. Keys without a field are ignored. Settings in radians
    are in degrees in JSON, under their name with ``_deg``.

    Parameters
    ----------
    where : str
        Prefix of field names in messages.

    Raises
    ------
    ValueError
        A field without a default is missing, or a value is not of its field's type, not finite, or beyond its limits.

    Examples
    --------
    >>> from seip_addon.core.choosing.placement.returns_summary import CrossingReturns
    >>> from_json(CrossingReturns, {"name": "Main Street", "least": 12.5})
    CrossingReturns(name='Main Street', least=12.5)
    >>> from_json(CrossingReturns, {"name": "Main Street", "least": "many"}, "crossings[0]")
    Traceback (most recent call last):
    ValueError: crossings[0].least must be a number, not 'many'
    """
    read: Value = _read(kind, content, where)
    return read


def read_record(kind: type[Value], text: str | bytes, schemas: tuple[str, ...], name: str, cure: str) -> Value:
    """Return a dataclass from the text of a JSON object with one of ``schemas``, of which the first is the present one.

    Parameters
    ----------
    name, cure : str
        What the text is, and what to do if it is damaged, for messages.

    Raises
    ------
    SeipError
        The text is damaged, or has another schema.
    """
    try:
        content = parse_json(text)
        json.dumps(content, ensure_ascii=False, allow_nan=False).encode()  # refuses what cannot be written again
        found = content.get("schema") if isinstance(content, dict) else None
        if found in schemas:
            return from_json(kind, content)
    except (SeipError, ValueError, RecursionError) as error:
        raise SeipError(f"{name} is damaged: {error}; {cure}") from error
    raise SeipError(f"{name} has the schema {found!r}, not {schemas[0]!r}: {cure}, with one version of SEIP")


def as_json(value: object) -> Any:  # noqa: ANN401 -- values of any kind
    """Return a dataclass as a JSON value that `from_json` converts back to an equal one."""
    if is_dataclass(value) and not isinstance(value, type):
        return {_key(value, each): _written(value, each) for each in fields(value)}
    return [as_json(one) for one in value] if isinstance(value, tuple | list) else value


def _is_angle(kind: object, name: str) -> bool:
    kind = kind if isinstance(kind, type) else type(kind)
    return name in (known := settings_of(kind)) and known[name][0].unit == "rad"


def _key(kind: object, each: "Field[Any]") -> str:
    return f"{each.name}_deg" if _is_angle(kind, each.name) else each.name


def _written(holder: object, each: "Field[Any]") -> object:
    value = getattr(holder, each.name)
    return _degrees(value) if _is_angle(holder, each.name) else as_json(value)


def _degrees(angle: Any) -> Any:  # noqa: ANN401 -- a number, or several
    if isinstance(angle, tuple | list):
        return [_degrees(one) for one in angle]
    # rounding to a millionth of a degree hides the last bits, which differ between platforms
    return round(math.degrees(angle), 6) + 0.0


def _radians(angle: Any) -> Any:  # noqa: ANN401 -- as above
    return tuple(map(_radians, angle)) if isinstance(angle, tuple) else math.radians(angle)


def _read(kind: Any, value: Any, where: str) -> Any:  # noqa: ANN401 -- types and values of any kind
    parts = get_args(kind)
    if kind is object:
        read = value
    elif is_dataclass(kind):
        read = _object(kind, _plain(dict, value, where), where)
    elif get_origin(kind) in {Union, UnionType}:
        read = _first_of(parts, value, where)
    elif get_origin(kind) is tuple:
        read = _items(parts, _plain(tuple, value, where), where)
    elif get_origin(kind) is Mapping:
        read = {name: _read(parts[1], part, _at(where, name)) for name, part in _plain(dict, value, where).items()}
    elif get_origin(kind) is Literal:
        read = _one_of(parts, value, where)
    else:
        read = _plain(kind, value, where)
    return read


def _one_of(literals: tuple[Any, ...], value: object, where: str) -> object:
    if value not in literals:
        raise ValueError(f"{where} must be {' or '.join(map(repr, literals))}, not {reprlib.repr(value)}")
    return value


def _object(kind: Any, content: dict[str, Any], where: str) -> Any:  # noqa: ANN401 -- as above
    hints, values = _hints(kind), {}
    for each in fields(kind):
        key = _key(kind, each)
        if key in content:
            read = _read(hints[each.name], content[key], _at(where, key))
            values[each.name] = _radians(read) if key != each.name else read
        elif each.default is MISSING:
            raise ValueError(f"{_at(where, key)} is missing")
    return kind(**values)


def _first_of(kinds: tuple[Any, ...], value: object, where: str) -> Any:  # noqa: ANN401 -- as above
    problems = []
    for kind in kinds:
        try:
            return _read(kind, value, where)
        except ValueError as error:
            problems.append(error)
    raise problems[0]


def _items(kinds: tuple[Any, ...], values: Sequence[object], where: str) -> tuple[Any, ...]:
    if kinds[1:] == (Ellipsis,):
        kinds = kinds[:1] * len(values)
    if len(kinds) != len(values):
        raise ValueError(f"{where} must be a list of {len(kinds)} values, not of {len(values)}")
    return tuple(_read(kinds[at], value, f"{where}[{at}]") for at, value in enumerate(values))


def _plain(kind: type, value: Any, where: str) -> Any:  # noqa: ANN401 -- as above
    name, types = _PLAIN[kind]
    fits = isinstance(value, types) and (kind is bool or not isinstance(value, bool))
    if not fits or (isinstance(value, (int, float)) and not abs(value) <= sys.float_info.max):
        raise ValueError(f"{where or 'all'} must be {name}, not {reprlib.repr(value)}")
    return value


def _at(where: str, name: str) -> str:
    return f"{where}.{name}" if where else name


_hints: Callable[[type], dict[str, Any]] = cache(partial(get_type_hints, include_extras=True))
