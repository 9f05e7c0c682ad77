"""Settings with help, unit and limits, from which the options of commands and panel are made."""

from collections.abc import Callable, Sequence
from dataclasses import MISSING, dataclass, field, fields
from typing import Any

_KEY = "setting"


@dataclass(frozen=True)
class Setting:
    """Help, unit and limits of a setting, for commands and panel.

    Parameters
    ----------
    help : str
        Description, as in the help of commands.
    unit : str
        Unit, such as ``m``, ``°``, ``s`` or ``USD``, or "".
    minimum, maximum : float, optional
        Least and largest value that is accepted.
    option : str
        Name of the command-line option, that of the field if empty.
    metavar : str or tuple of str
        Placeholder of the value in the help of a command, or one for each of several numbers.
    read : callable, optional
        Function that parses the texts of an option, for settings that are not plain numbers.
    """

    help: str
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    option: str = ""
    metavar: str | tuple[str, ...] | None = None
    read: Callable[[Sequence[str]], Any] | None = None


def setting(default: Any, help: str, **about: Any) -> Any:  # noqa: A002, ANN401 -- a field of any type, and the word of argparse
    """Return a dataclass field with a default and a `Setting`; other parameters of it are given by name."""
    return field(default=default, metadata={_KEY: Setting(help, **about)})


def settings_of(kind: type) -> dict[str, tuple[Setting, Any]]:
    """Return the settings of a dataclass with their defaults, by field name.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class GridSettings:
    ...     spacing: float = setting(1.0, "distance between neighbouring targets", unit="m", minimum=0.1)
    >>> about, default = settings_of(GridSettings)["spacing"]
    >>> f"{about.help}, at least {about.minimum} {about.unit}", default
    ('distance between neighbouring targets, at least 0.1 m', 1.0)
    """
    return {
        each.name: (each.metadata[_KEY], None if each.default is MISSING else each.default)
        for each in fields(kind)
        if _KEY in each.metadata
    }
