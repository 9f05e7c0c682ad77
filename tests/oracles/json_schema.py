"""The part of JSON Schema (draft 2020-12) that docs/placement.schema.json uses."""

from __future__ import annotations

from typing import Any

TYPES = {
    "object": dict,
    "array": (list, tuple),
    "string": str,
    "boolean": bool,
    "integer": int,
    "number": (int, float),
    "null": type(None),
}
KNOWN = {"$schema", "title", "description", "$defs", "$ref", "type", "const", "enum", "anyOf", "properties"}
KNOWN |= {"additionalProperties", "required", "items", "minItems", "maxItems", "minimum", "maximum"}


def violations(value: Any, schema: dict[str, Any], root: dict[str, Any] | None = None, where: str = "$") -> list[str]:
    """Return where and how a value breaks a schema."""
    root = schema if root is None else root
    assert set(schema) <= KNOWN, f"unknown keywords {set(schema) - KNOWN}"
    if "$ref" in schema:
        return violations(value, root["$defs"][schema["$ref"].removeprefix("#/$defs/")], root, where)
    if "anyOf" in schema:
        tried = [violations(value, option, root, where) for option in schema["anyOf"]]
        return [] if [] in tried else min(tried, key=len)
    found = [f"{where}: {problem}" for problem in _own_violations(value, schema)]
    if isinstance(value, dict):
        found += _members(value, schema, root, where)
    if isinstance(value, (list, tuple)) and "items" in schema:
        for index, item in enumerate(value):
            found += violations(item, schema["items"], root, f"{where}[{index}]")
    return found


def _own_violations(value: Any, schema: dict[str, Any]) -> list[str]:
    kind = schema.get("type")
    if kind and (not isinstance(value, TYPES[kind]) or (isinstance(value, bool) and kind != "boolean")):
        return [f"{value!r} is no {kind}"]
    checks = {
        "const": lambda limit: value == limit,
        "enum": lambda limit: value in limit,
        "minimum": lambda limit: value >= limit,
        "maximum": lambda limit: value <= limit,
        "minItems": lambda limit: len(value) >= limit,
        "maxItems": lambda limit: len(value) <= limit,
        "required": lambda limit: set(limit) <= set(value),
    }
    return [f"{name} {schema[name]!r}" for name, holds in checks.items() if name in schema and not holds(schema[name])]


def _members(value: dict[str, Any], schema: dict[str, Any], root: dict[str, Any], where: str) -> list[str]:
    found = []
    properties, others = schema.get("properties", {}), schema.get("additionalProperties", {})
    for name, member in value.items():
        if name in properties:
            found += violations(member, properties[name], root, f"{where}.{name}")
        elif others is False:
            found.append(f"{where}.{name}: not in the schema")
        else:
            found += violations(member, others, root, f"{where}.{name}")
    return found
