"""Command-line options, made from the settings that they set."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterable, Sequence
from types import NoneType
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from seip_addon.core.errors import SeipError
from seip_addon.core.placement.objective import Objective
from seip_addon.core.settings import Setting, settings_of

Options = TypeVar("Options")


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
        shown = default if isinstance(default, tuple | list) else [default]
        return f"{action.help} (default: {' '.join(map(_as_typed, shown))})"


def _as_typed(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def new_parser(prog: str, description: str) -> argparse.ArgumentParser:
    """Return a parser whose help is brief and names defaults."""
    return argparse.ArgumentParser(prog=prog, description=description, formatter_class=_BriefHelp)


def add_settings(group: argparse._ActionsContainer, kind: type, *names: str) -> None:
    """Add an option for each of the named fields of a settings class, with their types, defaults and help."""
    hints, known = get_type_hints(kind), settings_of(kind)
    for name in names:
        about, default = known[name]
        group.add_argument(_option(name, about), help=about.help, **_arguments(hints[name], default, about))


def add_rolling_shutter(group: argparse._ActionsContainer) -> None:
    """Add the option that lets traffic stand still while sensors turn, to a command for which it moves."""
    group.add_argument(
        "--rolling-shutter",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="traffic moves while a sensor turns, and boxes are where their points are from (on)",
    )


def name_only(group: argparse._ArgumentGroup, reference: str) -> None:
    """Have help name the options of a group alone, and refer to where they are explained."""
    names = (action.option_strings[-1] for action in group._group_actions)  # noqa: SLF001 -- argparse has no other way
    group.description = f"{' '.join(names)} ({reference})"
    for action in group._group_actions:  # noqa: SLF001 -- as above
        action.help = argparse.SUPPRESS


def read_settings(kind: type[Options], options: argparse.Namespace, **values: Any) -> Options:  # noqa: ANN401 -- of fields of any type
    """Return the settings that options name; ``values`` are of fields that have no option of their own."""
    for name, (about, _) in settings_of(kind).items():
        dest = _option(name, about).lstrip("-").replace("-", "_")
        if name not in values and hasattr(options, dest):
            value = getattr(options, dest)
            values[name] = tuple(value) if isinstance(value, list) else value
    return kind(**values)


def add_objective(parser: argparse.ArgumentParser) -> argparse._ArgumentGroup:
    """Add what an objective is made of to a command, but for a coverage to reach, and return the group."""
    objective = parser.add_argument_group("objective")
    add_settings(objective, Objective, "count", "budget")
    objective.add_argument("--weighted", action="store_true", help="count targets by the weights of their regions")
    add_settings(objective, Objective, "central_weight", "min_distance", "forbidden", "mandatory")
    return objective


def read_objective(options: argparse.Namespace) -> Objective:
    """Return the objective that options of `add_objective` name."""
    weight = "scene" if options.weighted and options.central_weight is None else options.central_weight
    return read_settings(Objective, options, central_weight=weight)


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
    if get_origin(hint) is Literal:
        return {"default": default, "choices": tuple(parts)}
    if get_origin(hint) is tuple:
        several = "+" if Ellipsis in parts else len(parts)
        return arguments | {"nargs": several, "type": parts[0], "default": list(default) if default == () else default}
    return arguments | {"type": parts[0] if parts else hint}


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
