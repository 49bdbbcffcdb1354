"""Lengths that were hardly meant in metres: a wrist of 80 m is one of 80 mm."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from wristctl.config.errors import UserError
from wristctl.config.keys import field_at, keys_of, unit_of
from wristctl.config.plant import Actuator
from wristctl.config.strict_yaml import KeyPath
from wristctl.config.study import Study
from wristctl.config.wording import Phrase
from wristctl.config.wrist import WristParameters

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
