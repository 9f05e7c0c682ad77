"""Command-line options, made from the settings that they set.

`tests/headless/test_options.py` shows its use.
"""

from __future__ import annotations

import argparse
import math
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from types import NoneType
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from seip_addon.core.base.counts import typed_number
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.limits import Limits
from seip_addon.core.base.settings import Setting, settings_of

Options = TypeVar("Options")
Number = TypeVar("Number", int, float)
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
NUMBER = "number"
"""Name of the types of options that take a number within limits."""
_ANY = Limits(-1e15, 1e15)
"""Limits of options whose own are checked where their numbers are used."""
_MAX_PATH, _MAX_NAME = 4096, 255  # bytes, as Linux has them; others are within these


class _BriefHelp(argparse.HelpFormatter):
    """Help of a line for most options, with the default of each that has one."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=30)

    def add_usage(
        self,
        usage: str | None,
        actions: Iterable[argparse.Action],
        groups: Iterable[argparse._MutuallyExclusiveGroup],
        prefix: str | None = None,
    ) -> None:
        """Add what must be given; the options have lines of their own."""
        needed = [action for action in actions if action.required or not action.option_strings]
        super().add_usage(usage or f"%(prog)s {self._format_actions_usage(needed, [])} [options]", [], groups, prefix)

    def _format_action_invocation(self, action: argparse.Action) -> str:
        if not action.option_strings or action.nargs == 0:
            return super()._format_action_invocation(action)
        values = self._format_args(action, self._get_default_metavar_for_optional(action))
        return f"{', '.join(action.option_strings)} {values}"

    def _format_args(self, action: argparse.Action, default_metavar: str) -> str:
        several = action.nargs == "+" and isinstance(action.metavar, str)
        return f"{action.metavar} ..." if several else super()._format_args(action, default_metavar)

    def _get_help_string(self, action: argparse.Action) -> str | None:
        default = action.default
        if not action.option_strings or isinstance(default, bool) or default in (None, [], argparse.SUPPRESS, math.inf):
            return action.help
        if action.help and "(default: " in action.help:
            return action.help
        shown = default if isinstance(default, tuple | list) else [default]
        return f"{action.help} (default: {' '.join(map(_as_typed, shown))})"


def _as_typed(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


class _Parser(argparse.ArgumentParser):
    """Parser that names the option of a refused value, and takes numbers as web maps copy them: ``-31.97, 115.86``."""

    def _get_value(self, action: argparse.Action, arg_string: str) -> Any:  # noqa: ANN401 -- as argparse has it
        try:
            return super()._get_value(action, arg_string)
        except argparse.ArgumentError as error:
            if not isinstance(error.__context__, argparse.ArgumentTypeError):
                raise
            raise SeipError(f"{'/'.join(action.option_strings) or action.dest} {error.message}") from error

    def parse_known_args(  # type: ignore[override]  # of its overloads only one is called
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Parse arguments whose lists of numbers may have commas."""
        given = sys.argv[1:] if args is None else args
        return super().parse_known_args(list(self._with_numbers_apart(given)), namespace)

    def _with_numbers_apart(self, args: Sequence[str]) -> Iterator[str]:
        several = {
            option
            for action in self._actions
            if action.nargs is not None and getattr(action.type, "__name__", "") in {"float", NUMBER}
            for option in action.option_strings
        }
        takes_numbers = False
        for arg in args:
            option, equals, value = arg.partition("=")
            numbers = _numbers(value if equals else arg)
            if option in several:
                takes_numbers = True
                yield from (option, *numbers) if equals and numbers else (arg,)
            elif takes_numbers and numbers:
                yield from numbers
            else:
                takes_numbers = False
                yield arg


def _numbers(text: str) -> list[str]:
    """Return the numbers of a text that consists of them, with commas, blanks and signs of degrees; else none."""
    parts = [part for part in re.split(r"[\s,;°]+", text) if part]
    return parts if parts and all(map(_NUMBER.fullmatch, parts)) else []


def new_parser(prog: str, description: str) -> argparse.ArgumentParser:
    """Return a parser with brief help that names defaults, and that takes only finite numbers and possible paths."""
    parser = _Parser(prog=prog, description=description, formatter_class=_BriefHelp)
    for kind, read in ((float, real_number(_ANY)), (int, whole_number(_ANY)), (Path, file_path)):
        parser.register("type", kind, read)
    return parser


def real_number(limits: Limits) -> Callable[[str], float]:
    """Return a type of options that takes a number within limits; NaN and infinity are outside."""

    def read(text: str) -> float:
        return _within(limits, text, typed_number(text))

    read.__name__ = NUMBER  # argparse says "invalid number value"
    return read


def whole_number(limits: Limits) -> Callable[[str], int]:
    """Return a type of options that takes a whole number within limits."""

    def read(text: str) -> int:
        return _within(limits, text, int(text if text.isascii() else ""))

    read.__name__ = "whole number"
    return read


def file_path(text: str) -> Path:
    """Read a path: not empty, which would mean the working folder, and not longer than file systems allow."""
    if not text:
        raise argparse.ArgumentTypeError("must not be empty: name a file or folder")
    if (
        "\0" in text
        or len(os.fsencode(text)) >= _MAX_PATH
        or any(len(os.fsencode(part)) > _MAX_NAME for part in Path(text).parts)
    ):
        raise argparse.ArgumentTypeError(
            f"is {text[:60]!r}…, longer than a path ({_MAX_PATH:,} bytes) or a name ({_MAX_NAME} bytes) can be"
        )
    return Path(text)


def _within(limits: Limits, text: str, value: Number) -> Number:
    if not limits.allow(value):
        raise argparse.ArgumentTypeError(f"must be {limits.broken_by(value)}, not {text[:40]}")
    return value


def add_settings(group: argparse._ActionsContainer, kind: type, *names: str) -> None:
    """Add an option for each of the named fields of a settings class, with their types, defaults and help."""
    hints, known = get_type_hints(kind), settings_of(kind)
    for name in names:
        about, default = known[name]
        group.add_argument(_option(name, about), help=about.help, **_arguments(hints[name], default, about))


def add_weather(group: argparse._ActionsContainer) -> None:
    """Add the option of the weather."""
    group.add_argument(
        "--weather", nargs="+", default=[], metavar="WHAT", help="weather: rain=MM/H, visibility=M in fog, wet"
    )


def refuse_idle(parser: argparse.ArgumentParser, options: argparse.Namespace, idle: Sequence[str], use: str) -> None:
    """Raise SeipError if an option was given that does nothing here; ``use`` says what it is for."""
    given = [name for name in idle if getattr(options, name) != parser.get_default(name)]
    if given:
        raise SeipError(f"--{given[0].replace('_', '-')} is for {use}: leave it out")


def read_settings(kind: type[Options], options: argparse.Namespace, **values: Any) -> Options:  # noqa: ANN401 -- of fields of any type
    """Return the settings that options name; ``values`` are of fields that have no option of their own."""
    for name, (about, _) in settings_of(kind).items():
        dest = _option(name, about).lstrip("-").replace("-", "_")
        if name not in values and hasattr(options, dest):
            value = getattr(options, dest)
            values[name] = tuple(value) if isinstance(value, list) else value
    return kind(**values)


def _option(name: str, about: Setting) -> str:
    return f"--{about.option or name.replace('_', '-')}"


def _arguments(hint: Any, default: Any, about: Setting) -> dict[str, Any]:  # noqa: ANN401 -- any type, any value
    """Return what argparse is to know of an option: flags, choices, numbers, or several of them."""
    if hint is bool:
        return {"action": "store_true"}
    arguments: dict[str, Any] = {"default": default, "metavar": about.metavar}
    if about.read is not None:
        return arguments | {"nargs": "+", "action": _reading(about.read)}
    parts = [part for part in get_args(hint) if part is not NoneType]
    if NoneType in get_args(hint) and get_origin(parts[0]) is tuple:  # several numbers, or none
        hint, parts = parts[0], list(get_args(parts[0]))
    if get_origin(hint) is Literal:
        return {"default": default, "choices": tuple(parts)}
    if get_origin(hint) is tuple:
        several = "+" if Ellipsis in parts else len(parts)
        if get_origin(parts[0]) is Literal:
            return arguments | {"nargs": several, "choices": get_args(parts[0]), "default": list(default)}
        kind = _type(parts[0], about)
        return arguments | {"nargs": several, "type": kind, "default": list(default) if default == () else default}
    return arguments | {"type": _type(parts[0] if parts else hint, about)}


def _type(kind: type, about: Setting) -> Callable[[str], Any]:
    """Return the type of an option: numbers keep the limits of their setting."""
    if kind not in {int, float}:
        return file_path if kind is Path else kind
    least = -_ANY.most if about.minimum is None else about.minimum
    most = _ANY.most if about.maximum is None else about.maximum
    if about.unit == "rad":  # options take degrees
        limits = Limits(round(math.degrees(least), 1), round(math.degrees(most), 1), "degrees")
    else:
        limits = Limits(least, most, about.unit)
    return real_number(limits) if kind is float else whole_number(limits)


def _reading(read: Callable[[Sequence[str]], Any]) -> type[argparse.Action]:
    """Return what stores the value that several texts name."""

    class Reading(argparse.Action):
        def __call__(
            self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: object, *_: object
        ) -> None:
            try:
                setattr(namespace, self.dest, read(values if isinstance(values, list) else []))
            except SeipError as error:
                parser.error(f"argument {'/'.join(self.option_strings)}: {error}")

    return Reading
