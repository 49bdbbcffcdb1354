"""Sections and keys of a study as arguments of a Python function: `simulate(wrist={"length": 0.095}, horizon=2.0)`."""

from collections.abc import Mapping
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from wristctl.config.controller_row import Row
from wristctl.config.section import Section
from wristctl.config.study import Study
from wristctl.errors import Keyword, UserError, meant
from wristctl.study_files.keys import field_at, home_of, keys_of, section_keys
from wristctl.study_files.resolved import check_read, key_below
from wristctl.study_files.strict_yaml import KeyPath

NAMED_BY = "kind", "level"
"""What of a group its name alone stands for: `reference: sine`, `sensor: camera`."""


def function_of(command: str) -> str:
    """Name of the Python function of a command."""
    return command.replace("-", "_")


def keyword(name: str, value: Any, command: str) -> Keyword:
    """The argument as an error names it: a number or a name as it is, anything longer as `...`."""
    short = isinstance(value, str | bool | int | float)
    return Keyword(f"{name}={value!r}" if short else f"{name}=...", function=function_of(command))


def path_of(name: str, command: str) -> KeyPath:
    """Key path of an argument: a key of the command's own section comes before a section of that name.

    Raises UserError for what is neither, with the nearest name, and for a section that the command does not read.
    """
    own, sections = section_keys(command), keys_of(Study)
    known = {key.replace("-", "_"): key for key in (*sections, *own)}
    where = Keyword(f"{name}=...", function=function_of(command))
    if name not in known:
        section, _, inner = key_below(name, command).removeprefix(f"{command}.").rpartition(".")
        fix = f"did you mean {section}={{{inner!r}: ...}}?" if section in known else meant(name, known)
        raise UserError(f"unknown argument {name!r}", where, fix)
    key = known[name]
    if key in own:
        return home_of(command, key), key
    check_read(key, command, where)
    return (key,)


def in_full(value: Any, path: KeyPath) -> Any:
    """A text where a list of names stands, or a group with a `kind` or a `level`, as such a list or group."""
    if not isinstance(value, str):
        return value
    kind = field_at(path)[0]
    if named := _named_by(kind):
        return {named: value}
    if get_origin(kind) is not tuple:
        return value
    item = field_at((*path, 0))[0]
    if named := _named_by(item):
        return ({named: value},)
    return (value,) if is_name(item) else value


def _named_by(kind: Any) -> str | None:
    """The leaf for which a group's name alone stands; None where there is none."""
    return next((name for name in NAMED_BY if name in keys_of(kind)), None)


def is_name(item: Any) -> bool:
    """Whether an item of a list is given by a name: a text, one of some choices, or a controller's row."""
    item = get_args(item)[0] if get_origin(item) is Annotated else item
    if get_origin(item) in (Union, UnionType):
        return all(map(is_name, get_args(item)))
    return item is str or get_origin(item) is Literal or (isinstance(item, type) and issubclass(item, Row))


def as_a_file_has_it(value: Any, where: Keyword) -> Any:
    """A value of Python as a study file would have it: sequences and arrays as lists, paths as text.

    Raises UserError for what no file can hold.
    """
    if isinstance(value, Section):
        return value.model_dump(by_alias=True, exclude_unset=True)
    if isinstance(value, Mapping):
        if unnamed := [key for key in value if not isinstance(key, str)]:
            raise UserError(f"{unnamed[0]!r} is no key", where, "keys are text")
        return {key: as_a_file_has_it(entry, where) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return tuple(as_a_file_has_it(entry, where) for entry in value)
    if isinstance(value, Path):
        return str(value)
    if value is None or type(value) in (str, bool, int, float):
        return value
    if hasattr(value, "tolist"):  # numpy's numbers and arrays
        return as_a_file_has_it(value.tolist(), where)
    what = type(value).__name__
    raise UserError(f"a {what} is no setting", where, "numbers, text, lists and dicts; own code as 'my.py:NAME'")
