"""Families of worlds: a loop whose leaves are drawn anew for each world, so that nothing is tuned or judged on one."""

import hashlib
import json
import math
import re
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, Self

from pydantic import ValidationError, model_validator
from pydantic_core import PydanticCustomError

from wristctl.config.loop import Loop, Reference
from wristctl.config.section import Section, choice, quantity

SplitName = Literal["test", "sealed"]
_NUMBER = r"([-+]?[0-9]+\.?[0-9]*(?:e[+-]?[0-9]+)?)"
_RANGE = re.compile(rf"(x?){_NUMBER} ?\.\. ?x?{_NUMBER}( log)?", re.IGNORECASE)
_OF_REFERENCE = "reference."
TOGETHER = "together"
"""Share that chooses the row of settings that are drawn together."""

# Source of a drawn leaf: `0..3` evenly, `8e3..4e4 log` evenly in the logarithm, `x0.7..1.3` as multiples of the
# believed value, or a list to choose from.
Drawn = str | tuple[bool | int | float | str, ...]


class Range(NamedTuple):
    """An interval that a leaf is drawn from."""

    low: float
    high: float
    logarithmic: bool
    multiple: bool

    @classmethod
    def read(cls, text: str) -> Self:
        """From `x0.7..1.3`, `0..3` or `8e3..4e4 log`; PydanticCustomError for what is none of them."""
        match = _RANGE.fullmatch(text.strip())
        low, high = (float(match[2]), float(match[3])) if match else (0.0, 0.0)
        logarithmic, multiple = bool(match and match[4]), bool(match and match[1])
        if match is None or not low < high or ((logarithmic or multiple) and low <= 0.0):
            expected = "a range as 0..3, 8e3..4e4 log or x0.7..1.3, its lower end first, or a list of values"
            raise PydanticCustomError(
                "range", "should be {expected}, not {given}", {"expected": expected, "given": text}
            )
        return cls(low, high, logarithmic, multiple)

    def at(self, share: float) -> float | str:
        """The value at a share of the interval."""
        if self.logarithmic:
            value = math.exp(math.log(self.low) + share * (math.log(self.high) - math.log(self.low)))
        else:
            value = self.low + share * (self.high - self.low)
        return f"x{value:.12g}" if self.multiple else value


def cannot_draw(key: str, why: str) -> PydanticCustomError:
    """The error of a leaf that cannot be drawn."""
    return PydanticCustomError("draw", "cannot draw {key}: {why}", {"key": key, "why": why})


def drawn_value(source: Drawn, share: float) -> Any:
    """Value of a leaf at a share in [0, 1)."""
    if isinstance(source, str):
        return Range.read(source).at(share)
    return source[min(int(share * len(source)), len(source) - 1)]


class Family(Section):
    """Worlds of one kind: a loop, what is drawn of it, and the motions that each world is asked for."""

    loop: Loop = Loop()
    draw: dict[str, Drawn] = choice(
        {},
        "settings of the loop, or of its references as reference.angle_deg, of those that have it, and what each is "
        "drawn from",
    )
    together: tuple[dict[str, float], ...] = choice(
        (), "rows of settings that are drawn together, one row a world, as an identification's posterior has them"
    )
    homed: bool = choice(
        False,
        "whether controllers know of each world what check and homing of a rig measure: how far tendons stretch for a "
        "bend, and how old pictures are",
    )
    references: tuple[Reference, ...] = choice((Reference(),), "motions, each followed in every world", min_length=1)
    horizon: float = quantity(3.0, "s", "duration of one rollout", "assumed", gt=0)
    about: str = choice("", "what is asked of a controller here, in a few words")

    def world(self, shares: Mapping[str, float]) -> Loop:
        """The loop with its leaves at these shares of what they are drawn from."""
        data = self.loop.model_dump(exclude_unset=True)
        for key, source in self.draw.items():
            if not key.startswith(_OF_REFERENCE):
                put_leaf(data, key, drawn_value(source, shares[key]))
        if self.together:
            for key, value in self.together[int(shares.get(TOGETHER, 0.0) * len(self.together))].items():
                put_leaf(data, key, value)
        return Loop.model_validate(data)

    def motion(self, number: int, shares: Mapping[str, float]) -> Reference:
        """The reference of this number at these shares."""
        data = self.references[number].model_dump(exclude_unset=True)
        for key in self.drawn_of(number):
            put_leaf(data, key.removeprefix(_OF_REFERENCE), drawn_value(self.draw[key], shares[key]))
        return Reference.model_validate(data)

    def settings_hash(self) -> str:
        """SHA-256 of all in it that is no default, but `about`, in any order: alike families have the same."""
        content = self.model_dump(mode="json", by_alias=True, exclude_defaults=True, exclude={"about"})
        return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()

    def drawn_of(self, number: int) -> list[str]:
        """The drawn settings that the reference of this number has."""
        reference = self.references[number]
        has = {*Reference.model_fields, *reference.added()}
        return [key for key in self.draw if key.startswith(_OF_REFERENCE) and key.split(".")[1] in has]

    @model_validator(mode="after")
    def _all_worlds_can_be(self) -> Self:
        """Check the worlds with one leaf at either end and the others in the middle."""
        for number in range(len(self.together)):
            try:
                self.world(dict.fromkeys(self.draw, 0.5) | {TOGETHER: (number + 0.5) / len(self.together)})
            except ValidationError as error:
                context = {"number": str(number + 1), "why": error.errors()[0]["msg"]}
                raise PydanticCustomError("draw", "row {number} of together is no world: {why}", context) from error
        for key, source in self.draw.items():
            if key.startswith(_OF_REFERENCE) and not any(key in self.drawn_of(n) for n in range(len(self.references))):
                raise cannot_draw(key, "there is no such leaf")
            if not isinstance(source, str) and not source:
                raise PydanticCustomError("empty_draw", "{key} is drawn from nothing", {"key": key})
            for share in (0.0, 1.0 - 1e-12):
                shares = dict.fromkeys(self.draw, 0.5) | {key: share}
                try:
                    self.world(shares)
                    for number in range(len(self.references)):
                        self.motion(number, shares)
                except PydanticCustomError:
                    raise
                except ValidationError as error:
                    first = error.errors()[0]
                    why = "there is no such leaf" if first["type"] == "extra_forbidden" else first["msg"]
                    raise cannot_draw(key, why) from error
        return self


def put_leaf(data: dict[str, Any], key: str, value: Any) -> None:
    """Set a leaf by its dotted name."""
    *sections, leaf = key.split(".")
    for section in sections:
        data = data.setdefault(section, {})
    data[leaf] = value


class TuningWorlds(Section):
    """Worlds on which gains are searched and chosen."""

    family: str = choice("", "name of a family in `families`; empty: none")
    draws: int = choice(16, "worlds drawn of it to search on", ge=1, le=10_000)
    validation: int = choice(20, "other worlds of it to choose by", ge=1, le=10_000)


# Share of the worlds in which a controller may fail, swing or chatter; shown to do so in more, it is not ranked.
TOLERATED = 0.01


class Worlds(Section):
    """Worlds on which rows are ranked: draws that no search has seen."""

    family: str = choice("", "name of a family in `families`; empty: none")
    draws: int = choice(100, "worlds drawn of it", ge=2, le=100_000)
    split: SplitName = choice("test", "which of its draws: test, or sealed with a seed of its own")
    sealed: int | None = choice(None, "seed of the split `sealed`, kept elsewhere", ge=0)

    @model_validator(mode="after")
    def _sealed_has_a_seed(self) -> Self:
        if (self.split == "sealed") != (self.sealed is not None):
            raise ValueError("split: sealed goes with its seed, sealed: NUMBER, and test with none")
        return self
