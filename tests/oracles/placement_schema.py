"""The JSON Schema of ``placement.json``, made from the types that read it.

    python -m tests.oracles.placement_schema

writes docs/placement.schema.json; a test asserts that the file is up to date.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from seip_addon.core.choosing.placement.objective import MOVED
from seip_addon.core.output.results.placement_record import SCHEMA, PlacementRecord

FILE = Path(__file__).resolve().parents[2] / "docs" / "placement.schema.json"
WIDTH = 118  # letters of a line
PLAIN = {str: "string", bool: "boolean", int: "integer", float: "number", NoneType: "null"}
NARROWER: dict[str, dict[str, Any]] = {
    "count": {"minimum": 1},
    "height_m": {"minimum": 0},
    "yaw_deg": {"minimum": 0},
    "tilt_deg": {"minimum": -90, "maximum": 90},
    "roll_deg": {"minimum": -180, "maximum": 180},
    "gap": {"minimum": 0},
    "status": {"enum": ["optimal", "feasible", MOVED]},
}
"""Limits of what is written, by the names of fields; what is read has types only."""
ALWAYS = {"types"}
"""Fields that are always written, though they may be left out of what is read."""


def schema() -> dict[str, Any]:
    """Return the schema."""
    record = schema_of(PlacementRecord)
    record["properties"]["settings"] = settings()
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "placement.json",
        "description": "A placement of roadside sensors with all that it takes to read it, check it and make it again.",
        **record,
        "required": ["schema", *record["required"]],
        "properties": {"schema": {"const": SCHEMA}, **record["properties"]},
    }


def settings() -> dict[str, Any]:
    """Return the schema of the settings, which a program of another version may know others of."""
    text, truth, anything = {"type": "string"}, {"type": "boolean"}, {"type": "object"}
    texts = {"type": "array", "items": text}
    shares = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
    known = {
        "grid_spacing_m": {"type": "number"},
        "candidates": {"type": "object", "properties": {"sensors": texts}},
        "visibility": anything,
        "goal": {"type": "object", "properties": {"shares": shares}},
        "catalogue": texts,
        "engine": text,
        "solver": text,
        "installed_cost": {"anyOf": [anything, {"type": "null"}]},
        "effort": {"type": "number"},
        "render": truth,
    }
    return {"type": "object", "required": ["candidates", "goal"], "properties": known}


def schema_of(kind: Any) -> dict[str, Any]:
    """Return the schema of a type that `from_json` reads."""
    parts, origin = get_args(kind), get_origin(kind)
    if is_dataclass(kind):
        made = _object(kind)
    elif origin in {Union, UnionType}:
        made = {"anyOf": [schema_of(part) for part in parts]}
    elif origin is tuple:
        lengths = {} if parts[1:] == (Ellipsis,) else {"minItems": len(parts), "maxItems": len(parts)}
        made = {"type": "array", "items": schema_of(parts[0]), **lengths}
    elif origin is Mapping:
        made = {"type": "object", "additionalProperties": {} if parts[1] is object else schema_of(parts[1])}
    elif origin is Literal:
        made = {"enum": list(parts)}
    else:
        made = {"type": PLAIN[kind]}
    return made


def _object(kind: Any) -> dict[str, Any]:
    hints = get_type_hints(kind)
    return {
        "type": "object",
        "additionalProperties": False,
        "required": [each.name for each in fields(kind) if each.default is MISSING or each.name in ALWAYS],
        "properties": {each.name: _narrowed(each.name, schema_of(hints[each.name])) for each in fields(kind)},
    }


def _narrowed(name: str, wide: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a field within what is written of it."""
    narrower = NARROWER.get(name, {})
    if "anyOf" in wide:
        first, *others = wide["anyOf"]
        return {"anyOf": [_narrowed(name, first), *others]}
    return narrower if "enum" in narrower else wide | narrower


def text() -> str:
    """Return the text of the file: what fits on a line stands on one."""
    return _text(schema(), "") + "\n"


def _text(value: Any, indent: str, used: int = 0) -> str:
    flat = json.dumps(value, ensure_ascii=False)
    if len(indent) + used + len(flat) <= WIDTH or not isinstance(value, dict | list):
        return flat
    inner = f"{indent}  "
    if isinstance(value, list):
        lines = [inner + _text(one, inner) for one in value]
        return "[\n" + ",\n".join(lines) + f"\n{indent}]"
    lines = [f"{inner}{json.dumps(key)}: {_text(one, inner, len(key) + 4)}" for key, one in value.items()]
    return "{\n" + ",\n".join(lines) + f"\n{indent}}}"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
