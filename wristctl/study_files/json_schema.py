"""JSON schema of study files, by which editors complete and check them: names, types, ranges, units and meanings."""

from __future__ import annotations

import re
from typing import Any

from wristctl.config.controller_row import Row
from wristctl.config.study import Study
from wristctl.study_files.keys import LISTS_OF_ROWS, keys_of
from wristctl.study_files.keywords import NAMED_BY

# Name of the schema beside a study file, and the line with which a file names it to an editor.
SCHEMA_FILE = "study.schema.json"
NAMED = f"# yaml-language-server: $schema={SCHEMA_FILE}"
_DRAFT = "https://json-schema.org/draft/2020-12/schema"
_ROW_KEYS = set(keys_of(Row))
# A controller with its gains behind a stroke.
_WITH_GAINS = r"^[^\n]+/[^/\n]+$"


def study_schema() -> dict[str, Any]:
    """The schema (draft 2020-12) of a study file: it refuses wrong keys, types, ranges and names, and no relations.

    It has the names of the tables of choices as they are on this computer, those of installed packages too.
    """
    schema = Study.model_json_schema(by_alias=True)
    sections: dict[str, dict[str, Any]] = schema["$defs"]
    for section in (schema, *sections.values()):
        for name, leaf in section.get("properties", {}).items():
            section["properties"][name] = _for_editors(leaf)
    rows = {name for name, section in sections.items() if set(section.get("properties", ())) >= _ROW_KEYS}
    for name in rows:
        leaf = sections[name]["properties"]["controller"]
        choices = {key: leaf.pop(key) for key in ("anyOf", "enum", "type") if key in leaf}
        leaf["anyOf"] = [choices, {"type": "string", "pattern": _WITH_GAINS}]
    _short_rows(schema, {f"#/$defs/{name}" for name in rows})
    for key in LISTS_OF_ROWS:
        place = sections[schema["properties"][key]["$ref"].rpartition("/")[2]]["properties"]
        place |= {short: sections["Row"]["properties"][short] for short in keys_of(Row)}
    for name, section in sections.items():
        for named_by in NAMED_BY:
            if named_by in section.get("properties", ()):
                sections[name] = {"anyOf": [section["properties"][named_by], section]}
    for section in sections.values():
        for leaf in section.get("properties", section.get("anyOf", [{}])[-1].get("properties", {})).values():
            _or_alone(leaf, schema)
    sections["TendonPlace"] = {"anyOf": [{"type": "number"}, sections["TendonPlace"]]}
    include = {"type": "array", "items": {"type": "string"}, "description": "study files that are read before this one"}
    schema["properties"] = {"include": include} | schema["properties"]
    return {"$schema": _DRAFT, "title": "Study of wristctl", **{k: v for k, v in schema.items() if k != "title"}}


def _for_editors(leaf: dict[str, Any]) -> dict[str, Any]:
    """A leaf with its unit and source in its description, and without a section's defaults, which are its leaves'."""
    kept = {key: value for key, value in leaf.items() if key not in ("title", "unit", "source", "unsaid")}
    if isinstance(kept.get("default"), dict) or kept.get("default") is None:
        kept.pop("default", None)
    words = [f"[{leaf['unit']}]" if leaf.get("unit") else "", leaf.get("description", "")]
    words += [f"(default: {leaf['source']})" if leaf.get("source") else ""]
    text = re.sub(r"\s+", " ", " ".join(filter(None, words)))
    return kept | ({"description": text} if text else {})


def _or_alone(leaf: dict[str, Any], schema: dict[str, Any]) -> None:
    """Let a name stand for a list of one, where the items of a list are names."""
    if leaf.get("type") == "array" and _takes_a_name(leaf.get("items", {}), schema):
        of_list = {key: leaf.pop(key) for key in list(leaf) if key not in ("description", "default")}
        leaf["anyOf"] = [of_list, of_list["items"]]


def _takes_a_name(item: dict[str, Any], schema: dict[str, Any]) -> bool:
    if "$ref" in item:
        whole: Any = schema
        for key in item["$ref"].removeprefix("#/").split("/"):
            whole = whole[key]
        return _takes_a_name(whole, schema)
    parts = item.get("anyOf", item.get("oneOf", ()))
    return item.get("type") == "string" or any(_takes_a_name(part, schema) for part in parts)


def _short_rows(part: Any, rows: set[str]) -> None:
    """Let each item of a list of rows be a name too: NAME or NAME/GAINS."""
    if isinstance(part, dict):
        items = part.get("items")
        if isinstance(items, dict) and items.get("$ref") in rows:
            controller = {"$ref": f"{items['$ref']}/properties/controller"}
            part["items"] = {"anyOf": [controller, items]}
        for inner in list(part.values()):
            _short_rows(inner, rows)
    elif isinstance(part, list):
        for inner in part:
            _short_rows(inner, rows)
