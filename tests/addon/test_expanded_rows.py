"""Rows that show each item of an enumeration as a segment of its own: Blender leaves it blank if the text is empty."""

import ast
from pathlib import Path

ADD_ON = Path(__file__).resolve().parents[2] / "seip_addon"


def nameless_rows(source):
    """Return the lines of a source at which a property may be expanded and has an empty text."""
    calls = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call)]
    options = [{one.arg: one.value for one in call.keywords} for call in calls]
    return [
        call.lineno
        for call, option in zip(calls, options, strict=True)
        if isinstance(option.get("text"), ast.Constant)
        and option["text"].value == ""
        and not (
            isinstance(option.get("expand"), ast.Constant | None) and not getattr(option.get("expand"), "value", 0)
        )
    ]


def test_no_panel_expands_a_property_without_its_names():
    faults = {path.name: nameless_rows(path.read_text(encoding="utf-8")) for path in ADD_ON.rglob("*.py")}
    assert {name: lines for name, lines in faults.items() if lines} == {}
