"""A layout that records what a panel draws, in place of Blender's."""

from types import SimpleNamespace
from typing import Any


class DrawnLayout:
    """Layout that notes texts, properties, operators and lists; sections are drawn as their properties say.

    Parameters
    ----------
    labels : list of (text, icon)
    properties : list of (name, options)
    operators : list of (operator, text)
    buttons : list of (operator, options, properties)
        Operators again, with the options of the button and the properties that were set.
    bars : list of (factor, text)
    """

    def __init__(self) -> None:
        self.labels: list[tuple[str, str]] = []
        self.properties: list[tuple[str, dict[str, Any]]] = []
        self.operators: list[tuple[str, str | None]] = []
        self.buttons: list[tuple[str, dict[str, Any], SimpleNamespace]] = []
        self.bars: list[tuple[float, str]] = []
        self.lists: list[dict[str, Any]] = []

    def label(self, text: str = "", icon: str = "NONE", **_: Any) -> None:
        self.labels.append((text, icon))

    def prop(self, _data: Any, name: str, **options: Any) -> None:
        self.properties.append((name, options))

    def prop_search(self, data: Any, name: str, *_: Any, **options: Any) -> None:
        self.prop(data, name, **options)

    def operator(self, name: str, text: str | None = None, **options: Any) -> SimpleNamespace:
        self.operators.append((name, text))
        properties = SimpleNamespace()
        self.buttons.append((name, options, properties))
        return properties

    def progress(self, *, factor: float, text: str) -> None:
        self.bars.append((factor, text))

    def template_list(self, *_: Any, **options: Any) -> None:
        self.lists.append(options)

    def panel_prop(self, data: Any, name: str) -> "tuple[DrawnLayout, DrawnLayout | None]":
        return self, self if getattr(data, name) else None

    def __getattr__(self, name: str) -> Any:
        if name in {"row", "column", "box", "split", "grid_flow"}:
            return lambda **_: self
        return lambda *_, **__: None

    @property
    def text(self) -> str:
        """All labels, one after another."""
        return " ".join(text for text, _ in self.labels)
