"""The base of every configuration section and the way a leaf states its unit and source."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field
from pydantic.config import JsonDict


class Section(BaseModel):
    """A frozen group of settings: unknown keys, NaN, infinities and silent conversions are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True, populate_by_name=True)


def quantity(default: Any, unit: str, meaning: str, source: str = "", **constraints: Any) -> Any:
    """A leaf with its unit, meaning and source ("paper", "assumed", ...), which docs and config.yaml print."""
    extra: JsonDict = {"unit": unit, "source": source}
    return Field(default, description=meaning, json_schema_extra=extra, **constraints)


def choice(default: Any, meaning: str, source: str = "", **constraints: Any) -> Any:
    """A leaf without a unit (a name, a switch, a count)."""
    return quantity(default, "", meaning, source, **constraints)
