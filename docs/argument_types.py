"""Write wristctl/arguments.py, the types of keyword arguments in Python: `python docs/argument_types.py`.

All of it is from the schema, in its order; a comment gives the unit.
"""

from __future__ import annotations

import inspect
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import wristctl
from wristctl.config.controller_row import Row
from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Actuator, Disturbances, Push, Sensor
from wristctl.config.section import OpenSection, Section
from wristctl.config.wrist import TendonPlace, WristParameters
from wristctl.study_files.keys import field_at, keys_of, section_keys, unit_of
from wristctl.study_files.keywords import NAMED_BY
from wristctl.study_files.resolved import sections_read

FILE = Path(__file__).parents[1] / "wristctl" / "arguments.py"
COMMANDS = (
    "gen-data",
    "train",
    "tune",
    "compare",
    "study",
    "recommend",
    "simulate",
    "analyse",
    "identify",
    "hw-run",
)
"""Commands whose functions take keywords of their own section."""
TYPED = (WristParameters, TendonPlace, Reference, Loop, Disturbances, Push, Actuator, Sensor)
"""Sections within others that have types of their own; any mapping is taken for the others, as those of a bench."""
LONGEST = 6
"""Names of a choice beyond which its type is any text."""
HEAD = '''\
"""Keyword arguments of the functions of wristctl.api, by their types; `docs/argument_types.py` writes this file.

What may be a key, with meaning, default and source: documentation: Every setting. Values are in the unit behind a key.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypedDict
'''


def name_of(section: type[Section]) -> str:
    """Name of the type of a section's keys: LoopKeys of Loop, WristKeys of WristParameters."""
    return section.__name__.removesuffix("Parameters").removesuffix("Settings") + "Keys"


def typed(kind: Any, shown: dict[type[Section], None]) -> str:
    """A schema's annotation as Python's callers write it; sections that it holds are added to `shown`."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return typed(parts[0], shown)
    if origin in (Union, UnionType):
        if all(get_origin(part) is Literal for part in parts):
            return typed(Literal[tuple(value for part in parts for value in get_args(part))], shown)
        return " | ".join(dict.fromkeys(typed(part, shown) for part in parts))
    if origin is Literal and len(parts) > LONGEST:
        return "str"
    if origin is Literal:
        return f"Literal[{', '.join(f'{part!r}' for part in parts)}]".replace("'", '"')
    if origin is tuple:
        items = dict.fromkeys(typed(part, shown) for part in parts if part is not ...)
        return f"Sequence[{' | '.join(items)}]"
    if origin is dict:
        return f"Mapping[{typed(parts[0], shown)}, {typed(parts[1], shown)}]"
    if kind is NoneType:
        return "None"
    if isinstance(kind, type) and issubclass(kind, Row):
        shown.setdefault(Row)
        return f"{name_of(Row)} | str"
    if isinstance(kind, type) and issubclass(kind, Section):
        if kind not in TYPED:
            return "Mapping[str, Any]"
        shown.setdefault(kind)
        by_name = " | str" * any(name in keys_of(kind) for name in NAMED_BY) + " | float" * (kind is TendonPlace)
        return f"{name_of(kind)}{by_name}"
    if kind is Any:
        return "Any"
    return str(kind.__name__)


def leaves(keys: Sequence[tuple[str, Any]], shown: dict[type[Section], None]) -> Iterator[str]:
    """A line for each key."""
    for key, field in keys:
        unit = unit_of(field)
        yield f"    {key}: {typed(field.annotation, shown)}" + f"  # {unit}" * bool(unit)


def functions(shown: dict[type[Section], None]) -> Iterator[str]:
    """A type for each function: the keys of its section, then the sections that it reads beside."""
    for command in COMMANDS:
        name = command.replace("-", "_")
        others = inspect.signature(getattr(wristctl, name)).parameters
        keys = [(key.replace("-", "_"), field) for key, field in section_keys(command).items() if key not in others]
        own = [key for key, _ in keys]
        for section in sections_read(command):
            field = field_at((section.replace("_", "-"),))[1]
            if field is not None and section not in own and section != name:
                keys.append((section, field))
        lines = list(leaves(keys, shown))
        title = "".join(part.capitalize() for part in name.split("_"))
        text = f'class {title}Arguments(SharedArguments, total=False):\n    """Keywords of `{name}`."""\n'
        yield "\n".join([text, *lines])


def written() -> str:
    """The file."""
    shown: dict[type[Section], None] = {}
    wrist = field_at(("wrist",))[0]
    shown.setdefault(wrist)
    first = (
        'class SharedArguments(TypedDict, total=False):\n    """Keywords of every function."""\n\n'
        f"    seed: int\n    wrist: {name_of(wrist)} | str | Path"
    )
    calls = [first, *functions(shown)]
    sections: list[str] = []
    done: list[type[Section]] = []
    while rest := [section for section in shown if section not in done]:
        for section in rest:
            done.append(section)
            keys = [(field.alias or name, field) for name, field in section.model_fields.items()]
            about = inspect.cleandoc(section.__doc__ or "").partition("\n")[0]
            text = f'class {name_of(section)}(TypedDict, total=False):\n    """{about}"""\n'
            added = section.addable() if issubclass(section, OpenSection) else {}
            others = [f"    {name}: float" + f"  # {unit}" * bool(unit) for name, (_, unit, *_) in added.items()]
            sections.append("\n".join([text, *leaves(keys, shown), *others]))
    return "\n\n\n".join([HEAD.rstrip(), *sections, *calls]) + "\n"


if __name__ == "__main__":
    FILE.write_text(written(), encoding="utf-8")
    subprocess.run([sys.executable, "-m", "ruff", "format", "-q", str(FILE)], check=True)
