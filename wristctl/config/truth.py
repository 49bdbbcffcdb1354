"""What the simulated world is, where that is not what its controller believes: by value, or as a multiple.

A leaf here overrides the leaf of the same name that the controller knows: `tendon_radius: 0.021`, or `x1.05` of what it
believes. One that is not given is as believed.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Annotated, Any, Self

from pydantic import AfterValidator, Field, SerializerFunctionWrapHandler, model_serializer
from pydantic.config import JsonDict
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from wristctl.config.section import Section

_SCALE = re.compile(r"x ?([0-9]+\.?[0-9]*(?:e[+-]?[0-9]+)?)", re.IGNORECASE)


def _scale(given: str) -> str:
    found = _SCALE.fullmatch(given)
    if found is None or float(found[1]) <= 0.0:
        raise PydanticCustomError("scale", "Input should be a number, or a multiple of what is believed, as x1.05")
    return given


Scale = Annotated[str, AfterValidator(_scale)]
Positive = Annotated[float, Field(gt=0)] | Scale | None
NotNegative = Annotated[float, Field(ge=0)] | Scale | None
"""A leaf as it is: a value, a multiple of the believed one, or None where it is as believed."""


def truth(unit: str, meaning: str) -> Any:
    """A leaf as it is in the world; config.yaml leaves it out where it is as believed."""
    extra: JsonDict = {"unit": unit, "source": "", "unsaid": True}
    return Field(None, description=f"{meaning}, or x1.05 of what is believed", json_schema_extra=extra)


def fact(default: Any, unit: str, meaning: str, **constraints: Any) -> Any:
    """A leaf of the world that no controller believes anything of; config.yaml leaves it out where it is not given."""
    extra: JsonDict = {"unit": unit, "source": "assumed", "unsaid": True}
    return Field(default, description=meaning, json_schema_extra=extra, **constraints)


def unsaid(default: Overrides) -> Any:
    """A section of such leaves, left out of config.yaml where nothing in it is given."""
    return Field(default, json_schema_extra={"unsaid": True})


def actual(believed: Any, given: Any) -> Any:
    """A leaf as it is, from what is believed of it and what was given."""
    if given is None:
        return believed
    if isinstance(given, str):
        return type(believed)(believed * float(given.lower().removeprefix("x")))
    return given


def is_unsaid(field: FieldInfo) -> bool:
    """Whether a field is left out of what is written where it has its default."""
    extra = field.json_schema_extra
    return isinstance(extra, dict) and bool(extra.get("unsaid"))


@lru_cache
def _shared(facts: type[Section], believed: type[Section]) -> tuple[str, ...]:
    """Names of the leaves of facts that override one that is believed."""
    return tuple(
        name for name, field in facts.model_fields.items() if is_unsaid(field) and name in believed.model_fields
    )


class Overrides(Section):
    """Leaves that override those of the same names in another section; what is as believed is not written out."""

    @classmethod
    def between(cls, believed: Any, actual: Any) -> Self:
        """What is true of a section, where it is not as in the other."""
        own = {n: f for n, f in cls.model_fields.items() if n in type(actual).model_fields}
        known = {n: getattr(believed, n, f.default) for n, f in own.items()}
        return cls(**{n: getattr(actual, n) for n in own if getattr(actual, n) != known[n]})

    def of(self, believed: Any) -> Any:
        """The other section with what is true of it."""
        kind: type[Section] = type(believed)
        given = {name: value for name in _shared(type(self), kind) if (value := getattr(self, name)) is not None}
        changed = {name: actual(getattr(believed, name), each) for name, each in given.items()}
        return believed.model_copy(update=changed) if changed else believed

    @model_serializer(mode="wrap")
    def _without_the_unsaid(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        fields = {field.alias or name: field for name, field in type(self).model_fields.items()}
        unsaid = {key for key, field in fields.items() if is_unsaid(field)}
        written = handler(self)
        return {
            key: each for key, each in written.items() if key not in unsaid or each not in (fields[key].default, {})
        }
