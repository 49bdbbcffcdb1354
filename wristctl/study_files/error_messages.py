"""One line about what is wrong in a study: what, where (file and line, key path), how to fix it."""

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any, Union, get_origin

from pydantic import ValidationError

from wristctl.config.plant import Actuator
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import Keyword, Phrase, Setting, UserError, meant, nearest
from wristctl.study_files.keys import field_at, keys_of, unit_of
from wristctl.study_files.resolved import key_below
from wristctl.study_files.strict_yaml import KeyPath


def explained(error: ValidationError, origins: Mapping[KeyPath, Phrase], command: str | None = None) -> UserError:
    """The most telling of the errors found; `origins` says the file and line (or override) of each key.

    A key that stands too high is looked for in what `command` reads, or in all.
    """
    details = error.errors(include_url=False)
    unknown = [detail for detail in details if detail["type"] == "extra_forbidden"]
    detail: Any = unknown[0] if unknown else max(details, key=lambda entry: len(entry["loc"]))
    path: KeyPath = ()
    section_path: KeyPath = ()
    for key in _location(detail):  # a location also names the alternatives of a union, which no file does
        if (*path, key) in origins:
            path = section_path = (*path, key)
        elif path and (isinstance(key, int) or field_at((*section_path, key))[1] is not field_at(section_path)[1]):
            section_path = (*section_path, key)
    where = (origins[path], f": {'.'.join(map(str, section_path))}") if path else ""
    below = key_below(str(path[0]), command) if unknown and len(path) == 1 else ""
    return UserError(_what(detail), where, f"did you mean {below!r}?" if below else _fix(detail))


def located(error: UserError, origins: Mapping[KeyPath, Phrase]) -> UserError:
    """The error with the file and line (or override) of the key path that it names; as it is where it names none.

    Of a key that nobody gave its section's, but for a section of overrides: those are of other keys.
    """
    path: KeyPath = ()
    for key in error.where.split("."):
        deeper = (*path, int(key) if key.isdigit() else key)
        if deeper not in origins:
            break
        path = deeper
    if not path or (len(path) < error.where.count(".") + 1 and isinstance(origins[path], Setting)):
        return error
    return error.at((origins[path], f": {error.where}"))


def fault_of(detail: Any) -> tuple[str, str]:
    """What is wrong, and the fix, of one of pydantic's errors, whose `loc` is the key path."""
    return _what(detail), _fix(detail)


def _location(detail: Any) -> KeyPath:
    """Key path of an error. For an unknown key of an open section, the path ends at the section."""
    return (*detail["loc"], *[key for key in [detail.get("ctx", {}).get("key")] if key is not None])


def _of_sections(detail: Any) -> bool:
    """Whether it is a wrist of several sections in series, as a list or by a key of that name."""
    path, several = detail["loc"], detail["input"]
    listed = isinstance(several, tuple) and all(isinstance(each, dict) for each in several)
    return path == ("wrist", "sections") or (path == ("wrist",) and listed)


def _what(detail: Any) -> str:
    if _of_sections(detail):
        return "several sections in series are not simulated"
    if detail["type"] == "extra_forbidden":
        return f"unknown key {_location(detail)[-1]!r}"
    if detail["type"] == "added_value":
        return str(detail["msg"])
    if detail["type"] == "value_error":
        return str(detail["ctx"]["error"])
    value = repr(_as_lists(detail["input"]))
    value = value if len(value) <= 60 else f"{value[:57]}..."
    if detail["type"] in ("model_type", "dict_type"):
        return f"{value} should have the form {_form(_location(detail))}"
    if detail["type"] == "literal_error":
        return f"{value} is not one of the choices"
    if _has_unit(detail):
        return f"{value} is a number with a unit"
    if _decimal_comma(detail):
        return f"{value} has a decimal comma"
    if detail["input"] is None and detail["type"].endswith("_type"):
        return "a value is missing"
    if _as_keys(detail):
        key = next(iter(detail["input"]))
        return f"{detail['loc'][-1]!r} is a list, and given as a whole: {key!r} is no key of it"
    if detail["type"] == "string_pattern_mismatch":
        return f"{value} has another form"
    if detail["type"] == "too_short":
        written = "[]" if value == "()" else value
        return f"{written} is too few: at least {detail['ctx']['min_length']}"
    message: str = detail["msg"].replace("tuple", "list")
    return message.replace("Input", value, 1) if message.startswith("Input") else f"{value}: {message}"


def _fix(detail: Any) -> str:
    if _of_sections(detail):
        return "one section from base to hand; tendons that end inside it have ends_at"
    # pydantic puts the alternatives of a union, `tuple[...]`, between the keys
    path = tuple(key for key in _location(detail) if "[" not in str(key))
    if detail["type"] == "extra_forbidden":
        return meant(str(path[-1]), detail.get("ctx", {}).get("known") or keys_of(field_at(path[:-1])[0]))
    if detail["type"] == "literal_error":
        return _of_choices(str(detail["input"]), detail["ctx"]["expected"]) + _or_a_list(path)
    if _as_keys(detail):
        allowed = keys_of(field_at((*path, 0))[0])
        items = "{" + ", ".join(f"{key}: ..." for key in allowed) + "}" if allowed else "..."
        below = [key for value in detail["input"].values() if isinstance(value, dict) for key in value]
        unknown = next((key for key in below if allowed and key not in allowed), None)
        example = f"{'.'.join(map(str, path))}=[{items}]"
        return f"{example}; for {unknown!r} {meant(unknown, allowed)}" if unknown else example
    if detail["type"] == "value_error":
        return str(getattr(detail["ctx"]["error"], "fix", ""))
    if advice := detail.get("ctx", {}).get("fix"):
        return str(advice)
    _, field = field_at(path)
    if _has_unit(detail):
        unit = unit_of(field) if field else ""
        return "give the number without its unit" + f", in {unit}" * bool(unit)
    if _decimal_comma(detail):
        return f"with a point: {detail['input'].replace(',', '.')}"
    if field is None or not field.description:
        return ""
    unit, default = unit_of(field), repr(field.default)
    told = len(default) <= 40 and not (field.is_required() or field.default is None)
    return field.description + f" [{unit}]" * bool(unit) + f", default {default}" * told


def _or_a_list(path: KeyPath) -> str:
    """The list of groups that may stand in the place of a name; empty where none may."""
    items = keys_of(field_at((*path, 0))[0]) if get_origin(field_at(path)[0]) is Union else {}
    needed = [key for key, field in items.items() if field.is_required()]
    return f"; or a list, [{{{', '.join(f'{key}: ...' for key in needed)}}}, ...]" if needed else ""


def _of_choices(name: str, expected: str) -> str:
    """What was meant, and then all there is; `expected` is pydantic's list, whose items may be numbers."""
    choices = re.findall(r"'([^']*)'", expected) or re.split(r", | or ", expected)
    best = nearest(name, choices)
    return f"did you mean {best!r}? All: {', '.join(sorted(choices))}" if best else meant(name, choices)


def _form(path: KeyPath) -> str:
    """How the group of keys at this path is written: the first of its keys."""
    kind, _ = field_at(path)
    keys = list(keys_of(kind)) or ["NAME"]
    more = ", ..." * (len(keys) > _KEYS)
    return f"{{{', '.join(f'{key}: ...' for key in keys[:_KEYS])}{more}}}"


def _as_lists(value: Any) -> Any:
    """As a file has it, which has no tuples."""
    if isinstance(value, dict):
        return {key: _as_lists(entry) for key, entry in value.items()}
    return list(map(_as_lists, value)) if isinstance(value, tuple) else value


def _has_unit(detail: Any) -> bool:
    """Whether a text was given where a number stands, and is one with its unit: 0.095m."""
    number = detail["type"].startswith(("float_", "int_")) and isinstance(detail["input"], str)
    return number and _NUMBER_WITH_UNIT.match(detail["input"]) is not None


def _decimal_comma(detail: Any) -> bool:
    """Whether a text was given where a number stands, and is one with a comma: 0,095."""
    number = detail["type"].startswith(("float_", "int_")) and isinstance(detail["input"], str)
    return number and re.fullmatch(r"[-+]?\d+,\d+(e[-+]?\d+)?", detail["input"], re.IGNORECASE) is not None


def _as_keys(detail: Any) -> bool:
    """Whether keys were given where a list stands: `rows.0.gains=...`."""
    return detail["type"] == "tuple_type" and isinstance(detail["input"], dict) and bool(detail["input"])


# Keys of a group that the form shows.
_KEYS = 3
_NUMBER_WITH_UNIT = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)? ?[^\W\d_]|[-+]?[\d.]+ ?[%°]", re.IGNORECASE)

# Beyond so many times the default a length is asked about.
_TIMES = 20.0
_BELIEVED = WristParameters.model_fields | Actuator.model_fields
# Usual sizes of lengths that are null by default; `radius` is a tendon's own.
_USUAL = {name: field.default for name, field in _BELIEVED.items()}
_USUAL["radius"] = _USUAL["tendon_radius"]


# Sizes of leaves that are no lengths, beyond which they are asked about; in their units. Other springs than the wrist's
# own count what elastic tendons add.
_SENSIBLE = {"stiffness": (1e-3, 1e3), "force": (0.0, 1e3), "load": (0.0, 1e3), "tension_limit": (0.1, 1e4)}
_SENSIBLE |= dict.fromkeys(("wrist.stiffness", "plant.stiffness"), (1e-3, 1e2)) | {"damping": (0.0, 10.0)}
_SENSIBLE |= dict.fromkeys(("mass", "hand_mass", "payload"), (0.0, 20.0))
_FORCE = Keyword("..., force=True", option="--force", function="load_study")


def check_sizes(study: Study, origins: Mapping[KeyPath, Phrase]) -> None:
    """UserError, with what may have been meant, for a length, mass, stiffness, damping or force that is hardly one."""
    for path, where in _with_items(study, origins):
        check_size(path, _at(study, path), (where, f": {'.'.join(map(str, path))}"))


def check_size(path: KeyPath, value: Any, where: Phrase) -> None:
    """UserError, as of check_sizes, for the value of a leaf; what is no number passes."""
    _, field = field_at(path)
    unit, name = unit_of(field) if field is not None else "", str(path[-1])
    if field is None or not unit or not isinstance(value, float | int):
        return
    if unit == "m":
        usual = _USUAL.get(name) if field.default is None else field.default
        if isinstance(usual, float) and 0.0 < _TIMES * usual < abs(value):
            meant = _meant(float(value), usual, field.default is None and name in _BELIEVED)
            problem = f"{value:g} m is {value / usual:,.0f} times the usual: {meant}"
            raise UserError(problem, where, ("give it in metres, or go on with ", _FORCE))
    low, high = _SENSIBLE.get(".".join(map(str, path[-2:])), _SENSIBLE.get(name, (0.0, math.inf)))
    if value != 0.0 and not low <= abs(value) <= high:
        problem = f"{value:g} {unit} is not between {low:g} and {high:g}"
        raise UserError(problem, where, ("is that meant? go on with ", _FORCE))


def _with_items(study: Study, origins: Mapping[KeyPath, Phrase]) -> Iterator[tuple[KeyPath, Phrase]]:
    """All that was given and where, also within the sections of lists that were given as one."""
    for path, where in origins.items():
        yield path, where
        items = _at(study, path)
        for number, item in enumerate(items if isinstance(items, tuple) else ()):
            for key in keys_of(type(item)):
                inner = (*path, number, key)
                if inner not in origins:
                    yield inner, where


def _meant(value: float, usual: float, override: bool) -> str:
    if override and 0.2 <= value <= 5.0:
        return f"did you mean x{value:g}?"
    nearest = min((value * 1e-3, value * 1e-2), key=lambda metres: abs(math.log(abs(metres) / usual)))
    return f"did you mean {nearest:.3g}?" if abs(nearest) < _TIMES * usual else "is that meant?"


def _at(study: Study, path: KeyPath) -> Any:
    node: Any = study
    for key in path:
        if isinstance(node, Mapping | tuple | list):
            node = node[key]  # type: ignore[index]
        else:
            names = dict(zip(keys_of(type(node)), type(node).model_fields, strict=True))
            if key not in names:
                return None
            node = getattr(node, names[str(key)])
    return node
