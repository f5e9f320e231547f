"""The reference of the problem file as Markdown, from its JSON schema: every table with its keys."""

import json
import re
from collections.abc import Iterator
from typing import Any

Node = dict[str, Any]


def page(schema: Node) -> str:
    """The whole page: a section for each table of the file, in the order in which the tables occur."""
    places = _places(schema)
    parts = [HEAD, _section("The file", schema)]
    for name, paths in places.items():
        parts.append(_section(_heading(name, paths), schema, name))
    return "\n".join(parts)


HEAD = """# The problem file: every key

This page is made from the JSON schema of the package whenever the site is built. The schema itself is
`pneumorph/problem/schema.json`; editors that know it complete and check a problem file while it is written.

A value with a unit is text, such as `"80 mm"`; any unit of the same kind may be written (`"8 cm"`, `"0.6 bar"`). A key
without a default must be given. Tables may be written inline, `fold = { distance = "1 mm" }`, or with a heading,
`[limits.fold]`.
"""


def _places(schema: Node) -> dict[str, list[str]]:
    """Where each definition occurs, by dotted keys, in the order of a walk through the file."""
    found: dict[str, list[str]] = {}

    def walk(node: Node, path: str) -> None:
        for key, value in node.get("properties", {}).items():
            here = f"{path}.{key}" if path else key
            for name, in_array in _references(value):
                place = f"{here}[]" if in_array else here
                found.setdefault(name, [])
                if place not in found[name]:
                    found[name].append(place)
                    walk(table_of(schema["$defs"][name]), here)

    walk(schema, "")
    return found


def table_of(definition: Node) -> Node:
    """The table of a definition; some may also be written as a single value."""
    return next(part for part in (definition, *definition.get("anyOf", ())) if "properties" in part)


def _references(node: Node, in_array: bool = False) -> Iterator[tuple[str, bool]]:
    """Names of the definitions that a value may be, and whether as items of an array."""
    if "$ref" in node:
        yield node["$ref"].removeprefix("#/$defs/"), in_array
    for kind in ("anyOf", "oneOf"):
        for choice in node.get(kind, ()):
            yield from _references(choice, in_array)
    for values in (node.get("additionalProperties"), *node.get("patternProperties", {}).values()):
        if isinstance(values, dict):
            yield from _references(values, in_array)
    if isinstance(node.get("items"), dict):
        yield from _references(node["items"], True)


def _heading(name: str, paths: list[str]) -> str:
    """The places of a table, and its name if these do not say it."""
    said = ", ".join(f"`{path}`" for path in paths)
    last = paths[0].removesuffix("[]").rpartition(".")[2].replace("_", "-")
    return said if last == _words(name) else f"{said}: {_words(name)}"


def _words(name: str) -> str:
    """The name of a model in words: "MatchCurve" is "match-curve"."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "-", name.removesuffix("Spec")).lower()


def _anchor(name: str) -> str:
    return f"table-{name.lower()}"


def _section(heading: str, schema: Node, name: str | None = None) -> str:
    """The section of a table, or of the whole file."""
    table = schema if name is None else table_of(schema["$defs"][name])
    # What the schema says of the whole is written for Python; it stands in the API reference.
    text = "" if name is None else f"\n{table.get('description', '')}\n"
    anchor = "" if name is None else f" {{ #{_anchor(name)} }}"
    rows = [["key", "value", "unit", "default", "meaning"], ["---"] * 5]
    for key, value in table["properties"].items():
        said = _value(value, schema), _unit(value, schema), _default(key, value, table), value.get("description", "")
        rows.append([f"`{key}`", *map(_cell, said)])
    lines = (f"| {' | '.join(row)} |" for row in rows)
    return f"## {heading}{anchor}\n{text}\n" + "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    return re.sub(r"\s+", " ", text).replace("|", "\\|")


def _toml(value: Any) -> str:
    """A value as it is written in a problem file, inline."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(part)}" for key, part in value.items() if part is not None) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(_toml(part) for part in value) + "]"
    return json.dumps(value, ensure_ascii=False)


def _default(key: str, value: Node, table: Node) -> str:
    if key in table.get("required", ()):
        return "must be given"
    choices = (part.get(kind, ()) for part in (table, *table.get("allOf", ())) for kind in ("oneOf", "anyOf"))
    for alternatives in ([one for choice in each for one in choice.get("required", ())] for each in choices):
        if key in alternatives and "default" not in value:
            return f"this or {', '.join(f'`{other}`' for other in alternatives if other != key)} must be given"
    default = value.get("default", value.get("const"))
    if isinstance(default, dict):
        return "those of its keys"
    return "none" if default is None else f"`{_toml(default)}`"


def _unit_of(quantity: str) -> str:
    return re.sub(r"^\s*[-+\d.eE]+\s*", "", quantity)


def _unit(value: Node, schema: Node) -> str:
    """The unit in the example of a quantity; empty for anything else."""
    units = []
    for part in _parts(value, schema):
        for example in part.get("examples", ()) if "pattern" in part else ():
            units.append(f"`{_unit_of(example)}`")
    return ", ".join(dict.fromkeys(units))


def _parts(value: Node, schema: Node) -> Iterator[Node]:
    """A value and everything it may consist of, except for the keys of tables."""
    yield value
    for key in ("anyOf", "oneOf", "prefixItems"):
        for part in value.get(key, ()):
            yield from _parts(part, schema)
    for part in (value.get("items"), value.get("additionalProperties"), *value.get("patternProperties", {}).values()):
        if isinstance(part, dict):
            yield from _parts(part, schema)
    if "$ref" in value:
        yield from _parts(schema["$defs"][value["$ref"].removeprefix("#/$defs/")], schema)


def _value(value: Node, schema: Node) -> str:
    """What may be written for a key."""
    if "$ref" in value:
        name = value["$ref"].removeprefix("#/$defs/")
        values = [part for part in schema["$defs"][name].get("anyOf", ()) if "properties" not in part]
        return " or ".join([*(_value(part, schema) for part in values), f"[{_words(name)}](#{_anchor(name)})"])
    for kind in ("anyOf", "oneOf"):
        if kind in value:
            said = [_value(part, schema) for part in value[kind] if part.get("type") != "null"]
            return " or ".join(dict.fromkeys(said))
    if "const" in value:
        return f"`{_toml(value['const'])}`"
    if "enum" in value:
        return ", ".join(f"`{_toml(choice)}`" for choice in value["enum"])
    kind = value.get("type")
    if kind == "object" and "properties" in value:
        return f"a table with {' and '.join(f'`{key}`: {_value(v, schema)}' for key, v in value['properties'].items())}"
    if kind == "object":
        inner = [value.get("additionalProperties"), *value.get("patternProperties", {}).values()]
        return "a table of " + " or ".join(_value(part, schema) for part in inner if isinstance(part, dict))
    if kind == "array" and "prefixItems" in value:
        return "[" + ", ".join(_value(part, schema) for part in value["prefixItems"]) + "]"
    if kind == "array":
        return f"list{_bounds(value, 'minItems', 'maxItems')} of {_value(value['items'], schema)}"
    if kind in ("number", "integer"):
        return ("number" if kind == "number" else "whole number") + _bounds(value, "minimum", "maximum")
    if kind == "boolean":
        return "`true`, `false`"
    if "examples" in value:
        return f'`"… {_unit_of(value["examples"][0])}"`' + (
            "" if value["pattern"].startswith(r"^\s*[+-]") else ", not negative"
        )
    return "text"


def _bounds(value: Node, least: str, most: str) -> str:
    said = []
    if least in value:
        said.append(f"at least {value[least]}")
    if "exclusiveMinimum" in value:
        said.append(f"above {value['exclusiveMinimum']}")
    if most in value:
        said.append(f"at most {value[most]}")
    if "exclusiveMaximum" in value:
        said.append(f"below {value['exclusiveMaximum']}")
    return f" ({', '.join(said)})" if said else ""
