"""Sweeps: a leaf of a study at many values, as a list, a range or a distribution."""

import math
import re
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import product
from typing import Any, NamedTuple

from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from wristctl.config.families import Range
from wristctl.config.foreign import is_reference
from wristctl.config.former_names import LOOPS, key_today
from wristctl.config.section import OpenSection, Section
from wristctl.config.study import Study
from wristctl.errors import Argument, Phrase, UserError, meant
from wristctl.study_files.error_messages import check_size, check_sizes, fault_of
from wristctl.study_files.keys import keys_of, unit_of, whole_key
from wristctl.study_files.resolved import check_read, sections_read
from wristctl.study_files.strict_yaml import KeyPath, parse_yaml

MOST_POINTS = 1_000_000
_EXAMPLE = "KEY=1,2,3 or KEY=0.05..0.12:20, KEY=8e3..4e4 log:20, KEY=~0..3:100, KEY=~normal(0.6, 0.05):100"
_COUNTED = re.compile(r"(~?)\s*(.+?)\s*:\s*([0-9]+)")
_NORMAL = re.compile(r"normal\(\s*([-+0-9.e]+)\s*,\s*([-+0-9.e]+)\s*\)", re.IGNORECASE)


class SweepAxis(NamedTuple):
    """A leaf and what it is set to in turn."""

    key: str
    """With its section, as simulate.loop.control_period."""
    values: tuple[Any, ...]
    drawn: bool
    """At random: such axes are drawn together, point by point; all others are multiplied."""
    text: str
    """As it was given."""

    @property
    def where(self) -> Argument:
        """The option."""
        return Argument("sweep", self.text)

    @property
    def path(self) -> tuple[str, ...]:
        """The key's parts."""
        return tuple(self.key.split("."))


def axes_of(study: Study, command: str) -> list[SweepAxis]:
    """The axes of the study's `sweep`. UserError for one that cannot be read, and for more points than MOST_POINTS."""
    axes, counted = list[SweepAxis](), list[tuple[int, bool]]()
    for text in study.sweep:
        key, equals, values = text.partition("=")
        if not equals or not key.strip() or not values.strip():
            raise UserError("a sweep is KEY=VALUES", Argument("sweep", text), _EXAMPLE)
        name = ".".join(map(str, key_today(tuple(whole_key(key.strip(), command).split(".")))))
        check_read(name, command, Argument("sweep", text))
        if name in [axis.key for axis in axes]:
            raise UserError(f"{name} is swept twice", Argument("sweep", text), "give all its values at once")
        counted.append(_count(text, values))
        if (many := _points(counted, text)) > MOST_POINTS:
            problem = f"a sweep of {many:.3g} points is more than {MOST_POINTS:g}"
            raise UserError(problem, Argument("sweep", text), "fewer values, or drawn ones with ~ in place of all")
        axes.append(SweepAxis(name, _values(text, values, name, study.seed), counted[-1][1], text))
    return axes


def check_all_sizes(study: Study, origins: Mapping[KeyPath, Phrase], command: str) -> None:
    """UserError, as of check_sizes, for what was given, and for the values of a sweep that the command makes.

    Controllers of one's own, which may not be loaded yet, have no size.
    """
    check_sizes(study, origins)
    values = {text: text.partition("=")[2].split(",") for text in study.sweep}
    sized = [text for text, each in values.items() if not any(is_reference(value.strip()) for value in each)]
    swept = study.model_copy(update={"sweep": tuple(sized)})
    for axis in axes_of(swept, command) if "sweep" in sections_read(command) and ("sweep",) in origins else ():
        sizes = [value for value in axis.values if isinstance(value, float | int) and value != 0.0]
        for value in (min(sizes, key=abs), max(sizes, key=abs)) if sizes else ():
            check_size(axis.path, value, axis.where)


def points_of(axes: Sequence[SweepAxis]) -> list[tuple[Any, ...]]:
    """The values of all axes at every point: drawn ones together, all others multiplied, the last the fastest."""
    grids = [axis for axis in axes if not axis.drawn]
    drawn = [axis for axis in axes if axis.drawn]
    together = list(zip(*(axis.values for axis in drawn), strict=True)) if drawn else [()]
    points = []
    for grid in product(*(axis.values for axis in grids)):
        for drawn_values in together:
            values = {axis.key: value for axis, value in zip([*grids, *drawn], [*grid, *drawn_values], strict=True)}
            points.append(tuple(values[axis.key] for axis in axes))
    return points


def study_at(study: Study, axes: Sequence[SweepAxis], values: Sequence[Any]) -> Study:
    """The study at a point. UserError, naming the leaf, for one that it does not have and a value that cannot be."""
    for axis, value in zip(axes, values, strict=True):
        try:
            study = _changed(study, axis.path, value, axis)
        except (ValidationError, PydanticCustomError) as error:
            if isinstance(error, ValidationError):
                detail: Any = error.errors(include_url=False)[0]
            else:
                detail = {"type": error.type, "msg": error.message(), "ctx": error.context or {}, "input": value}
            why, fix = fault_of({**detail, "loc": axis.path})
            raise UserError(f"{axis.key} cannot be {value!r}: {why}", axis.where, fix or "other values") from error
    return study


def unit_at(begin: Section, path: Sequence[str]) -> str:
    """The unit of the leaf on this path from a section; 1 where it has none."""
    section: Any = begin
    field = None
    for part in path:
        if not isinstance(section, Section):
            return "1"
        field = keys_of(type(section)).get(part)
        if field is None:
            added = section.added() if isinstance(section, OpenSection) else {}
            return (added[part].unit if part in added else "") or "1"
        section = getattr(section, _names(type(section))[part])
    return (unit_of(field) if field else "") or "1"


def _changed(section: Any, path: tuple[str, ...], value: Any, axis: SweepAxis) -> Any:
    """The section with a leaf at another value; only what lies on the way to it is made anew, and checked."""
    head, *below_head = path

    def changed(current: Any) -> Any:
        return _changed(current, tuple(below_head), value, axis) if below_head else _alike(current, value)

    if isinstance(section, Section):
        fields = _names(type(section))
        extra = section.model_extra or {}
        if head not in fields and head not in extra and not (hasattr(section, "added") and head in section.added()):
            raise UserError(f"there is no setting {axis.key}", axis.where, meant(head, fields))
        name = fields.get(head, head)
        current = getattr(section, name, None)
        new = changed(current)
        if not below_head and isinstance(current, Section):
            fix = f"one of {', '.join(keys_of(type(current)))}"
            raise UserError(f"{axis.key} is a group of settings", axis.where, fix)
        if below_head and not type(section).__pydantic_decorators__.model_validators:  # what is new has been checked
            return section.model_copy(update={name: new})
        # all that it has, since what is left out would be a default, copied deeply
        copy = type(section).model_validate({**section.__dict__, **extra, name: new}, by_name=True)
        object.__setattr__(copy, "__pydantic_fields_set__", section.model_fields_set | {name})
        return copy
    if isinstance(section, Mapping) and (head in section or below_head):
        head = head if head in section else LOOPS.get(head, head)
        if head not in section:
            raise UserError(f"there is no setting {axis.key}", axis.where, meant(head, map(str, section)))
        return {**section, head: changed(section[head])}
    if isinstance(section, tuple) and head.isdigit() and int(head) < len(section):
        return (*section[: int(head)], changed(section[int(head)]), *section[int(head) + 1 :])
    raise UserError(f"there is no setting {axis.key}", axis.where, "one that `--dry-run --all` shows")


@cache
def _names(kind: type[Section]) -> dict[str, str]:
    """The names of a section's fields by the keys that they have in a file."""
    return {field.alias or name: name for name, field in kind.model_fields.items()}


def _alike(current: Any, value: Any) -> Any:
    """A whole number where the leaf holds one, and a number with a point where it holds such."""
    if isinstance(current, float) and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if isinstance(current, int) and not isinstance(current, bool) and isinstance(value, float) and value.is_integer():
        return int(value)
    return value


def _count(text: str, values: str) -> tuple[int, bool]:
    """Number of values of an axis, and whether they are drawn."""
    match = _COUNTED.fullmatch(values.strip())
    if match is None:
        return len(_listed(text, values)), False
    many = int(match[3])
    if many < 1:
        raise UserError("a sweep of no values", Argument("sweep", text), _EXAMPLE)
    return many, bool(match[1])


def _points(counts: Sequence[tuple[int, bool]], text: str) -> int:
    drawn = {many for many, drawn in counts if drawn}
    if len(drawn) > 1:
        problem = f"drawn settings go together, and {' and '.join(map(str, sorted(drawn)))} values do not"
        raise UserError(problem, Argument("sweep", text), "the same number of each")
    return math.prod([many for many, drawn in counts if not drawn]) * (drawn.pop() if drawn else 1)


def _values(text: str, values: str, key: str, seed: int) -> tuple[Any, ...]:
    match = _COUNTED.fullmatch(values.strip())
    if match is None:
        return _listed(text, values)
    drawn, source, many = bool(match[1]), match[2], int(match[3])
    shares: Any
    import numpy as np

    from wristctl.seeds import stream

    rng = np.random.default_rng(stream(seed, f"sweep {key}"))
    if drawn and (normal := _NORMAL.fullmatch(source)):
        return tuple(map(float, rng.normal(float(normal[1]), abs(float(normal[2])), many)))
    shares = rng.random(many) if drawn else np.linspace(0.0, 1.0, many)
    try:
        between = Range.read(source)
    except PydanticCustomError as error:
        raise UserError(
            f"{source!r} is neither a range nor a distribution", Argument("sweep", text), _EXAMPLE
        ) from error
    return tuple(between.at(float(share)) for share in shares)


def _listed(text: str, values: str) -> tuple[Any, ...]:
    if ".." in values:
        raise UserError("a range says how many values it has", Argument("sweep", text), _EXAMPLE)
    try:
        items = tuple(parse_yaml(item.strip(), "").data for item in values.split(","))
    except UserError as error:
        raise error.at(Argument("sweep", text)) from error
    if own := next((item for item in items if isinstance(item, str) and is_reference(item)), None):
        fix = "run the command once for each, and hold the results against each other with `wristctl runs diff`"
        raise UserError(f"of one's own code a sweep takes controllers only: {own}", Argument("sweep", text), fix)
    if any(item is None for item in items):
        raise UserError("a value is missing", Argument("sweep", text), _EXAMPLE)
    return items
