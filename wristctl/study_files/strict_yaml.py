"""YAML without its traps: YAML 1.2 numbers, no repeated keys, no tags, no aliases; keys know their lines.

PyYAML reads 1e-3 as a string and `no` as False, and lets the last of two equal keys win in silence.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import yaml

from wristctl.errors import UserError

KeyPath = tuple[str | int, ...]

_INTEGER = re.compile(r"[-+]?[0-9]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_WORDS: dict[str, Any] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf"), float("inf")),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), float("-inf")),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
}
_PLAIN_TAGS = {f"tag:yaml.org,2002:{kind}" for kind in ("str", "seq", "map")}


@dataclass(frozen=True)
class Document:
    """Content of a YAML text, sequences as tuples, and the line of each key and item."""

    data: Any
    lines: Mapping[KeyPath, int]


class _Loader(yaml.BaseLoader):
    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            raise yaml.composer.ComposerError(None, None, "aliases are not supported", mark)
        return super().compose_node(parent, index)


def parse_yaml(text: str | bytes, source: str) -> Document:
    """Read one document (None where empty); UserError with `source` and line where it is not strict YAML."""
    try:
        node = yaml.compose(text, Loader=_Loader)
        lines: dict[KeyPath, int] = {}
        return Document(_read(node, (), lines, source) if node else None, lines)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{source}:{mark.line + 1}" if mark else source
        raise UserError(f"not valid YAML: {error.problem or error.context}", where) from error
    except yaml.YAMLError as error:
        raise UserError(f"not valid YAML: {error}", source) from error
    except RecursionError as error:
        raise UserError("not valid YAML: nested too deeply", source) from error


def _read(node: Any, path: KeyPath, lines: dict[KeyPath, int], source: str) -> Any:
    where = f"{source}:{node.start_mark.line + 1}"
    if node.tag not in _PLAIN_TAGS:
        raise UserError(f"tag {node.tag} is not supported", where, "write the plain value")
    if isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            lines[*path, index] = item.start_mark.line + 1
        return tuple(_read(item, (*path, index), lines, source) for index, item in enumerate(node.value))
    if isinstance(node, yaml.MappingNode):
        return _mapping(node, path, lines, source)
    return node.value if node.style else _plain(node.value, where)


def _mapping(node: yaml.MappingNode, path: KeyPath, lines: dict[KeyPath, int], source: str) -> dict[str, Any]:
    mapping: dict[str, Any] = {}
    for key, value in node.value:
        line = key.start_mark.line + 1
        if not isinstance(key, yaml.ScalarNode):
            raise UserError("a key must be a word", f"{source}:{line}")
        if key.value in mapping:
            fix = f"keep one (the first is on line {lines[*path, key.value]})"
            raise UserError(f"key {key.value!r} is repeated", f"{source}:{line}", fix)
        lines[*path, key.value] = line
        mapping[key.value] = _read(value, (*path, key.value), lines, source)
    return mapping


def _plain(text: str, where: str) -> Any:
    if text in _WORDS:
        return _WORDS[text]
    try:
        if _INTEGER.fullmatch(text):
            return int(text)
        return float(text) if _FLOAT.fullmatch(text) else text
    except ValueError as error:
        raise UserError("number with too many digits", where) from error
