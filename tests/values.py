"""Whether what a package hands out stays as it was: its dataclasses are frozen."""

from __future__ import annotations

import dataclasses
import inspect
import pkgutil
from importlib import import_module
from types import ModuleType


def changeable(package: ModuleType) -> list[str]:
    """Names of the package's dataclasses whose fields could be overwritten."""
    names = [each.name for each in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")]
    classes = [
        each
        for name in names
        for _, each in inspect.getmembers(import_module(name), inspect.isclass)
        if each.__module__ == name and dataclasses.is_dataclass(each)
    ]
    assert classes, "a package without dataclasses needs no such test"
    return [each.__qualname__ for each in classes if not vars(each)["__dataclass_params__"].frozen]
