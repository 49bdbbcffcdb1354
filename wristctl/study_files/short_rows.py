"""A controller with its gains as it may be given in short: NAME or NAME/GAINS, and one in place of a list of them."""

import re
from collections.abc import Iterator
from typing import Any

from wristctl.config.controller_row import BY_LOOP, Row
from wristctl.errors import Phrase, Setting, UserError
from wristctl.study_files.keys import LISTS_OF_ROWS, field_at, keys_of
from wristctl.study_files.strict_yaml import Document, KeyPath

# A controller by its name or its place, a stroke, and its gains.
_WITH_GAINS = re.compile(r"(?P<controller>[^/.\n]+|[^\n]*\.py:[A-Za-z_]\w*)/(?P<gains>(?!.*\.py\b)[^/\n]+)")


def with_gains_apart(document: Document, place: Phrase) -> Document:
    """The document with each `controller: NAME/GAINS`, and each NAME of a list of rows, as a controller and its gains.

    Raises UserError where other gains stand beside.
    """
    lines = dict(document.lines)
    return Document(_apart(document.data, (), lines, place), lines)


def _apart(data: Any, path: KeyPath, lines: dict[KeyPath, int], place: Phrase) -> Any:
    if isinstance(data, tuple):
        return tuple(_apart(item, (*path, position), lines, place) for position, item in enumerate(data))
    in_list = isinstance(data, str) and path[-1:] and isinstance(path[-1], int)
    if in_list and keys_of(Row).keys() <= keys_of(field_at(path)[0]).keys():
        return row_typed(data)
    if not isinstance(data, dict):
        return data
    data = {key: _apart(item, (*path, key), lines, place) for key, item in data.items()}
    name, key = data.get("controller"), (*path, "controller")
    parts = _WITH_GAINS.fullmatch(name) if isinstance(name, str) else None
    if parts is None:
        return data
    if "gains" in data:
        line = f":{lines[key]}" if key in lines else ""
        raise UserError(f"{name} has its gains with it, and others stand beside", (place, line), "give them once")
    if key in lines:
        lines[*path, "gains"] = lines[key]
    return data | parts.groupdict()


class GainsGiven:
    """Where gains were typed, with their controller or apart from it: later ones win, but never over both at once."""

    def __init__(self) -> None:
        self._with: dict[KeyPath, bool] = {}

    def note(self, before: Any, after: Any, where: Phrase) -> None:
        """Note what one override or argument gives, before and after its gains were taken from its controller's name.

        Raises UserError where an earlier one gives the same gains in the other way.
        """
        apart = set(_places_of_gains(before, ()))
        for path in _places_of_gains(after, ()):
            if self._with.setdefault(path, path not in apart) is not (path not in apart):
                raise UserError(
                    "the controller has its gains with it, and others are given too", where, "give them once"
                )


def _places_of_gains(data: Any, path: KeyPath) -> Iterator[KeyPath]:
    for key, value in data.items() if isinstance(data, dict) else ():
        if key == "gains":
            yield (*path, key)
        else:
            yield from _places_of_gains(value, (*path, key))


def row_typed(name: str) -> dict[str, str]:
    """The row of a controller that is named as NAME or NAME/GAINS: by its name alone it has the preset of each loop."""
    parts = _WITH_GAINS.fullmatch(name)
    return dict(parts.groupdict()) if parts else {"controller": name, "gains": BY_LOOP}


def for_their_own_controller(data: dict[str, Any], origins: dict[KeyPath, Phrase]) -> bool:
    """Whether an override names the controller of `simulate` and none its gains: a file's are for its own controller.

    A file's values of gains by name are taken out of the data; a preset's name stays, which any controller may have.
    """
    overridden = {path[1:] for path, origin in origins.items() if path[0] == "simulate" and isinstance(origin, Setting)}
    if ("controller",) not in overridden:
        return False
    section = data["simulate"]
    gains = section.get("gains")
    if isinstance(gains, dict):
        section["gains"] = {name: value for name, value in gains.items() if ("gains", name) in overridden}
    if ("gains",) not in overridden and not (isinstance(gains, str) and "=" not in gains):
        section.pop("gains", None)
        forget(origins, ("simulate", "gains"))
    return ("gains",) not in overridden


def forget(origins: dict[KeyPath, Phrase], beneath: KeyPath) -> None:
    """Forget where a key, and all beneath it, was given."""
    for path in [path for path in origins if path[: len(beneath)] == beneath]:
        del origins[path]


def in_lists(data: dict[str, Any], origins: dict[KeyPath, Phrase]) -> None:
    """Put `controller` and `gains` of a section into its list of controllers.

    A controller takes the list's place, whose gains are for others; gains alone are for each controller of the list.
    """
    for name, leaf in LISTS_OF_ROWS.items():
        section = data.get(name)
        if not isinstance(section, dict):
            continue
        one = {key: section.pop(key) for key in keys_of(Row) if key in section}
        if not one:
            continue
        rows: Any = ({},)
        if "controller" not in one:
            field = field_at((name, leaf))[1]
            rows = section.get(leaf, tuple(row.model_dump() for row in field.default) if field else ())
        else:
            forget(origins, (name, leaf))
        if not isinstance(rows, tuple) or not all(isinstance(row, dict) for row in rows):
            continue  # which the validation says
        section[leaf] = tuple(row | one for row in rows)
        for path in [path for path in origins if path[0] == name and path[1:] and path[1] in one]:
            origin = origins.pop(path)
            for number in range(len(rows)):
                origins.setdefault((name, leaf), origin)
                origins.setdefault((name, leaf, number), origin)
                origins[name, leaf, number, *path[1:]] = origin
