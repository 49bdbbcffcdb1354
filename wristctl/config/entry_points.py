"""Entry points of installed packages, by group and name: looked up when a name is asked for, loaded when it is used."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from wristctl.config.errors import UserError
from wristctl.config.foreign import Foreign, contained, installed


@cache
def _of(group: str) -> Mapping[str, Sequence[Any]]:
    """Each name's entry points, which should be one."""
    from importlib.metadata import entry_points

    found: dict[str, list[Any]] = {}
    for each in entry_points(group=group):
        if each.value not in [known.value for known in found.setdefault(each.name, [])]:
            found[each.name].append(each)
    return found


def entry_point_names(group: str) -> Sequence[str]:
    """The names of a group."""
    return tuple(_of(group))


def entry_point(group: str, name: str) -> tuple[Any, Foreign]:
    """The object behind the one entry point of this name, and where it is from.

    Raises UserError where several packages have one of this name, and where it cannot be loaded.
    """
    found = _of(group)[name]
    if len(found) > 1:
        where = ", ".join(f"{each.dist.name if each.dist else '?'} ({each.value})" for each in found)
        raise UserError(f"{len(found)} installed packages have a '{name}' in {group}", where, "uninstall all but one")
    (only,) = found
    with contained(f"loading the entry point '{name}'", f"{group}: {only.value}"):
        made = only.load()
    return made, installed(sys.modules[only.module], only.attr)
