"""Commands that cost nothing until they are called."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

LazyEntry = tuple[str, str | None, str]
"""Module (its `app` is a typer.Typer), panel and line in the help."""


class _OnCall(TyperCommand):
    """A command known by its line in the help; its module is imported when it is called."""

    def __init__(self, name: str, module: str, panel: str | None, line: str) -> None:
        super().__init__(name, help=line, rich_help_panel=panel)
        self._module = module

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        real = get_command(importlib.import_module(self._module).app)
        real.name = self.name
        return real.make_context(info_name, args, parent=parent, **extra)


def lazy_group(commands: Mapping[str, LazyEntry]) -> type[TyperGroup]:
    """A group of these commands, for `typer.Typer(cls=...)`."""

    class Commands(TyperGroup):
        def __init__(self, **attributes: Any) -> None:
            super().__init__(**attributes)
            for name, entry in commands.items():
                self.add_command(_OnCall(name, *entry))

    return Commands
