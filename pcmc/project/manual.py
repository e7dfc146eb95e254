"""What the table of keys tells people and editors: the manual in Markdown, and a JSON Schema."""

from __future__ import annotations

import json

from .keys import CURVE, KINDS, OR_CURVE, REQUIRED, TABLE, Key, Schema, sections

FIRST = "First lines"  # the keys before any table


def reference() -> str:
    """All sections and keys as Markdown, a table for each section."""
    lines = []
    for section in sections():
        condition = f" with `{section.condition}`" if section.condition else ""
        title = f"`{section.name}`" if section is CURVE else f"`[{section.name}]`" if section.name else FIRST
        lines += [f"## {title}{condition}", "", section.help, ""]
        lines += ["| key | value | default | meaning |", "|---|---|---|---|"]
        for key in section.keys:
            value = ", ".join(f'`"{c}"`' for c in key.choices) or key.kind
            shown = json.dumps(key.default, ensure_ascii=False) if _has_default(key) else ""
            default = "required" if key.default is REQUIRED else shown and f"`{shown}`"
            meaning = key.help.replace("``", "`").replace("|", "\\|")
            lines.append(f"| `{key.name}` | {value} | {default} | {meaning} |")
        lines.append("")
    return "\n".join(lines)


def _has_default(key: Key) -> bool:
    return key.default is not None and key.default is not REQUIRED and key.default != ()


def json_schema() -> Schema:
    """The JSON Schema of a project file, from which editors complete keys and show what they mean.

    A key of [solve] may be that of any method.

    >>> json_schema()["properties"]["plan"]["properties"]["edge_length"]["type"]
    'number'
    """
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "pcmc project", **_table("")}


def _table(name: str) -> Schema:
    """The schema of a section, with those below it."""
    known = [section for section in sections() if section.name == name]
    keys = [*(key for section in known for key in section.keys), *(CURVE.keys if name in OR_CURVE else ())]
    properties: Schema = {}
    for key in keys:
        place = f"{name}.{key.name}".lstrip(".")
        below = {section.name for section in sections()} & {place, f"{place}.NAME"}
        entry = KINDS[key.kind]
        for one in below:
            inner = _table(one)
            entry = _filled(entry, inner if one == place else TABLE | {"additionalProperties": inner})
        entry = entry | {"description": key.help.replace("``", "`")}
        entry |= {"enum": list(key.choices)} if key.choices else {}
        properties[key.name] = entry | ({"default": key.default} if _has_default(key) else {})
    return TABLE | {"description": known[0].help, "properties": properties, "additionalProperties": False}


def _filled(schema: Schema, table: Schema) -> Schema:
    """The schema of a kind, with the keys of the tables in it."""
    if schema == TABLE:
        return table
    parts: Schema = {key: _filled(value, table) for key, value in schema.items() if key == "items"}
    parts |= {key: [_filled(one, table) for one in value] for key, value in schema.items() if key == "anyOf"}
    return schema | parts
