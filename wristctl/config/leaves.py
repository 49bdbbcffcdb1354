"""The leaves of a study's sections, at whatever depth, and sections with other leaves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pydantic.fields import FieldInfo

from wristctl.config.section import Section


def with_leaves(value: Any, leaf: Callable[[FieldInfo, Any], Any]) -> Any:
    """A section, or a list or mapping of some, with `leaf(field, value)` in every field; itself where all are equal."""
    made: Any
    if isinstance(value, Section):
        fields = {name: (getattr(value, name), field) for name, field in type(value).model_fields.items()}
        made = {name: with_leaves(leaf(field, given), leaf) for name, (given, field) in fields.items()}
        changed = {name: each for name, each in made.items() if each is not fields[name][0]}
        return value.model_copy(update=changed) if changed else value
    if isinstance(value, dict):
        made = {key: with_leaves(each, leaf) for key, each in value.items()}
    elif isinstance(value, tuple):
        made = tuple(with_leaves(each, leaf) for each in value)
    else:
        return value
    return made if made != value else value
