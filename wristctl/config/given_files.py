"""Files that a study names: looked for beside the study that names them, and sealed into the runs made of them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic.fields import FieldInfo

from wristctl.config.leaves import with_leaves
from wristctl.config.section import quantity, seldom


def given_file(meaning: str, default: tuple[()] | None = None) -> Any:
    """A leaf that names a file, or several; config.yaml leaves it out where none is given."""
    return quantity(default, "", meaning, marks=("file", "unsaid"))


def of_file(meaning: str) -> Any:
    """A leaf that says how a file is read; left out of config.yaml likewise."""
    return seldom(None, "", meaning)


def columns_of_file() -> Any:
    """A leaf that maps another author's columns to those of an open log."""
    return of_file(
        "columns of a log with names of its own: 'time=t [ms], bend_y=imu [deg], spool_1=enc [0.175 mm]' says name in "
        "an open log = name in the file [unit], 'tip=Hand, base=Arm' rigid bodies; or a format's name (documentation: "
        "The open log)"
    )


def names_a_file(field: FieldInfo | None) -> bool:
    """Whether a leaf names files."""
    extra = field.json_schema_extra if field else None
    return isinstance(extra, dict) and bool(extra.get("file"))


def with_files(section: Any, name: Callable[[str], str]) -> Any:
    """The section with each file that it names, at whatever depth, under another name."""

    def leaf(field: FieldInfo, value: Any) -> Any:
        if not value or not names_a_file(field):
            return value
        return name(value) if isinstance(value, str) else tuple(map(name, value))

    return with_leaves(section, leaf)


def files_of(section: Any) -> list[str]:
    """Every file that is named in a section, at whatever depth, in order."""
    names: list[str] = []

    def note(name: str) -> str:
        names.append(name)
        return name

    with_files(section, note)
    return names


def beside(folder: Path, value: Any) -> Any:
    """Names of files as they are meant in a study that stands in a folder; what is no name is left for the schema."""
    if isinstance(value, str) and value:
        return str((folder / Path(value).expanduser()).absolute())
    return tuple(beside(folder, entry) for entry in value) if isinstance(value, tuple) else value
