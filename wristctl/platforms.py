"""On which systems wristctl runs, said before anything is imported that other systems have not."""

from __future__ import annotations

import sys
from importlib.util import find_spec

from wristctl.errors import UserError

NEEDED = ("fcntl", "resource")
"""Modules of Python's library that POSIX systems have: locks on files, limits and times of processes."""


def check() -> None:
    """Raise a UserError that says where wristctl runs, on a system without what locks and limits need."""
    if lacking := [name for name in NEEDED if sys.modules.get(name, name) is None or find_spec(name) is None]:
        what = f"wristctl runs on Linux: this system ({sys.platform}) has no {' and no '.join(lacking)}"
        raise UserError(what, fix="on Windows install it within WSL 2 (wsl --install), where it finds Linux")
