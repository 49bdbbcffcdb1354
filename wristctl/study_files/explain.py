"""One line about what is wrong in a study: what, where (file and line, key path), how to fix it."""

import math
import re
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from wristctl.config.plant import Actuator
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import Phrase, UserError, meant
from wristctl.study_files.keys import field_at, keys_of, unit_of
from wristctl.study_files.strict_yaml import KeyPath


def explained(error: ValidationError, origins: Mapping[KeyPath, Phrase]) -> UserError:
    """The most telling of the errors found; `origins` says the file and line (or override) of each key."""
    details = error.errors(include_url=False)
    unknown = [detail for detail in details if detail["type"] == "extra_forbidden"]
    detail: Any = unknown[0] if unknown else max(details, key=lambda each: len(each["loc"]))
    path: KeyPath = ()
    whole: KeyPath = ()
    for key in _location(detail):  # a location also names the alternatives of a union, which no file does
        if (*path, key) in origins:
            path = whole = (*path, key)
        elif path and (isinstance(key, int) or field_at((*whole, key))[1] is not field_at(whole)[1]):
            whole = (*whole, key)
    where = (origins[path], f": {'.'.join(map(str, whole))}") if path else ""
    return UserError(_what(detail), where, _fix(detail))


def located(error: UserError, origins: Mapping[KeyPath, Phrase]) -> UserError:
    """The error with the file and line (or override) of the key path that it names; as it is where it names none."""
    path: KeyPath = ()
    for key in error.where.split("."):
        at = (*path, int(key) if key.isdigit() else key)
        if at not in origins:
            break
        path = at
    return error.at((origins[path], f": {error.where}")) if path else error


def _location(detail: Any) -> KeyPath:
    """Where it is wrong; of what an open section does not know, the key is told beside the section."""
    return (*detail["loc"], *[key for key in [detail.get("ctx", {}).get("key")] if key is not None])


def _what(detail: Any) -> str:
    if detail["type"] == "extra_forbidden":
        return f"unknown key {_location(detail)[-1]!r}"
    if detail["type"] == "added_value":
        return str(detail["msg"])
    if detail["type"] == "value_error":
        return str(detail["ctx"]["error"])
    value = repr(detail["input"])
    value = value if len(value) <= 60 else f"{value[:57]}..."
    if detail["type"] in ("model_type", "dict_type"):
        return f"{value} should be a group of keys and values"
    if _as_keys(detail):
        key = next(iter(detail["input"]))
        return f"{detail['loc'][-1]!r} is a list, and given as a whole: {key!r} is no key of it"
    if detail["type"] == "too_short":
        given = "[]" if value == "()" else value
        return f"{given} is too few: at least {detail['ctx']['min_length']}"
    message: str = detail["msg"].replace("tuple", "list")
    return message.replace("Input", value, 1) if message.startswith("Input") else f"{value}: {message}"


def _fix(detail: Any) -> str:
    path = _location(detail)
    if detail["type"] == "extra_forbidden":
        return meant(str(path[-1]), detail.get("ctx", {}).get("known") or keys_of(field_at(path[:-1])[0]))
    if detail["type"] == "literal_error":
        return meant(str(detail["input"]), re.findall(r"'([^']*)'", detail["ctx"]["expected"]))
    if _as_keys(detail):
        known = keys_of(field_at((*path, 0))[0])
        items = "{" + ", ".join(f"{key}: ..." for key in known) + "}" if known else "..."
        below = [key for value in detail["input"].values() if isinstance(value, dict) for key in value]
        unknown = next((key for key in below if known and key not in known), None)
        whole = f"{'.'.join(map(str, path))}=[{items}]"
        return f"{whole}; for {unknown!r} {meant(unknown, known)}" if unknown else whole
    if detail["type"] == "value_error":
        return str(getattr(detail["ctx"]["error"], "fix", ""))
    _, field = field_at(path)
    if field is None or not field.description:
        return ""
    unit, default = unit_of(field), repr(field.default)
    expected = f"{field.description} [{unit}]" if unit else field.description
    return f"{expected}, default {default}" if len(default) <= 40 and field.default is not None else expected


def _as_keys(detail: Any) -> bool:
    """Whether keys were given where a list stands: `rows.0.gains=...`."""
    return detail["type"] == "tuple_type" and isinstance(detail["input"], dict) and bool(detail["input"])


_TIMES = 20.0
"""Beyond so many times the default a length is asked about."""
_BELIEVED = WristParameters.model_fields | Actuator.model_fields


_SENSIBLE = {"stiffness": (1e-3, 1e3), "force": (0.0, 1e3), "load": (0.0, 1e3), "tension_limit": (0.1, 1e4)}
"""Sizes of leaves that are no lengths, beyond which they are asked about; in their units."""


def check_sizes(study: Study, origins: Mapping[KeyPath, Phrase]) -> None:
    """UserError for a length, stiffness or force that was given and cannot well be meant."""
    check_lengths(study, origins)
    for path, where in origins.items():
        _, field = field_at(path)
        low, high = _SENSIBLE.get(str(path[-1]), (0.0, math.inf))
        value = _at(study, path) if field is not None and unit_of(field) else None
        if isinstance(value, float | int) and value != 0.0 and not low <= abs(value) <= high:
            assert field is not None
            what = f"{value:g} {unit_of(field)} is not between {low:g} and {high:g}"
            raise UserError(what, (where, f": {'.'.join(map(str, path))}"), "is that meant? go on with --force")


def check_lengths(study: Study, origins: Mapping[KeyPath, Phrase]) -> None:
    """UserError, with what may have been meant, for a length that was given and is far beyond the default's size."""
    for path, where in origins.items():
        _, field = field_at(path)
        if field is None or unit_of(field) != "m":
            continue
        value, usual = _at(study, path), field.default
        override = usual is None and str(path[-1]) in _BELIEVED
        if override:
            usual = _BELIEVED[str(path[-1])].default
        if isinstance(value, float | int) and isinstance(usual, float) and 0.0 < _TIMES * usual < abs(value):
            meant = _meant(float(value), usual, override)
            key = ".".join(map(str, path))
            fix = "give it in metres, or go on with --force"
            raise UserError(f"{value:g} m is {value / usual:,.0f} times the usual: {meant}", (where, f": {key}"), fix)


def _meant(value: float, usual: float, override: bool) -> str:
    if override and 0.2 <= value <= 5.0:
        return f"did you mean x{value:g}?"
    nearest = min((value * 1e-3, value * 1e-2), key=lambda metres: abs(math.log(abs(metres) / usual)))
    return f"did you mean {nearest:.3g}?" if abs(nearest) < _TIMES * usual else "is that meant?"


def _at(study: Study, path: KeyPath) -> Any:
    found: Any = study
    for key in path:
        if isinstance(found, Mapping | tuple | list):
            found = found[key]  # type: ignore[index]
        else:
            names = {known: name for name, known in zip(type(found).model_fields, keys_of(type(found)), strict=True)}
            if key not in names:
                return None
            found = getattr(found, names[str(key)])
    return found
