"""Validated access to OpenDRIVE's XML."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import ParseError, fromstring

from ...base.errors import SeipError
from ...base.limits import MAP_NUMBER
from ..other_formats import other_format

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element


_MAX_BYTES = 1 << 30  # of a map at most: 1 GiB


@dataclass(frozen=True, eq=False)
class Node:
    """An XML element, with its location for messages.

    Parameters
    ----------
    place : str
        Location of the element, such as ``town.xodr, road 17``.
    """

    element: Element
    place: str

    @property
    def tag(self) -> str:
        """Name of the element without its namespace."""
        return str(self.element.tag).rpartition("}")[2]

    def children(self, *path: str) -> Iterator[Node]:
        """Yield the elements reached by going down ``path``, in the order of the file."""
        first, *rest = path
        for element in self.element:
            child = Node(element, self.place)
            if child.tag == first:
                yield from child.children(*rest) if rest else (child,)

    def child(self, *path: str) -> Node | None:
        """Return the first element reached by going down ``path``, None if there is none."""
        return next(self.children(*path), None)

    def within(self, place: str) -> Node:
        """Return the same element with a more specific location."""
        return Node(self.element, f"{self.place}, {place}")

    def text(self, name: str, default: str | None = None) -> str:
        """Return an attribute; it is required if there is no default."""
        value = self.element.get(name, default)
        if value is None:
            raise SeipError(f"{self.place}: <{self.tag}> has no {name!r}; OpenDRIVE asks for it, export the map again")
        return value.strip()

    def number(self, name: str, default: float | None = None, *, most: float = MAP_NUMBER.most) -> float:
        """Return an attribute as a number of plausible size; it is required if there is no default.

        Parameters
        ----------
        name : str
            Name of the attribute.
        default : float, optional
            Value of a missing attribute.
        most : float
            Largest absolute value, if this is known more closely.
        """
        if default is not None and name not in self.element.attrib:
            return default
        text = self.text(name)
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not MAP_NUMBER.allow(value):
            raise SeipError(f"{self.place}: {name}={text!r} of <{self.tag}> is not a plausible number; correct the map")
        if abs(value) > most:
            raise SeipError(
                f"{self.place}: {name}={value:g} of <{self.tag}> is beyond {most:g} m; correct it in the map"
            )
        return value

    def length(self, name: str) -> float:
        """Return an attribute as a length above zero."""
        value = self.number(name)
        if value <= 0.0:
            raise SeipError(f"{self.place}: {name}={value:g} of <{self.tag}> must be above zero; correct it in the map")
        return value

    def whole_number(self, name: str) -> int:
        """Return an attribute as an integer."""
        value = self.number(name)
        if value != int(value):
            raise SeipError(f"{self.place}: {name}={value:g} of <{self.tag}> must be a whole number; correct the map")
        return int(value)

    def flag(self, name: str, *, default: bool = False) -> bool:
        """Return an attribute as a bool, in any of the spellings that exporters use."""
        return self.text(name, str(default)).lower() in ("true", "yes", "1")


def read_document(path: str | os.PathLike[str]) -> Node:
    """Parse an XML file and return its root.

    Raises
    ------
    SeipError
        The file cannot be read, is not well-formed, or declares a document type: OpenDRIVE needs none, and through one
        a file can read other files or exhaust memory.
    """
    name = os.path.basename(os.fspath(path))  # noqa: PTH119 - works for any path-like, existing or not
    try:
        with open(path, "rb") as file:  # noqa: PTH123 - as above
            if other := other_format(file.read(1000), "OpenDRIVE: choose an .xodr file"):
                raise SeipError(f"{name} {other}")
        if (size := os.stat(path).st_size) > _MAX_BYTES:  # noqa: PTH116 - as above
            raise SeipError(f"{name} has {size / 1e9:.1f} GB, more than a map of a city; cut the place out of it")
        content = Path(path).read_bytes()
        # All at once: given in pieces, expat would read a huge tag again with each piece.
        root = fromstring(content, forbid_dtd=True, forbid_entities=True, forbid_external=True)
    except FileNotFoundError as error:
        raise SeipError(f"no such file: {path}; check the path of the map") from error
    except OSError as error:
        raise SeipError(f"cannot read {path}: {error.strerror or error}; check that it is a readable file") from error
    except ParseError as error:
        raise SeipError(f"{name} is broken XML: {error}; export the map again") from error
    except DefusedXmlException as error:
        raise SeipError(f"{name} declares a document type or entities, which a map may not; remove them") from error
    except (LookupError, ValueError) as error:
        raise SeipError(f"{name} is in an encoding that cannot be read ({error}); save it as UTF-8") from error
    return Node(root, name)
