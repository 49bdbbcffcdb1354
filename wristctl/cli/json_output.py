"""What `--json` prints on stdout: one object, which is a result, an error, or a result with the error in it."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping
from typing import Any

from wristctl.errors import UserError

_KINDS = {1: "bug", 2: "usage", 3: "check", 4: "hardware", 5: "safety-stop", 130: "interrupted"}
"""Kinds of errors by exit code."""


class Shown(UserError):
    """An error that stands in the object that was printed."""


class Interrupted(UserError):
    """Ctrl-C in a command that has told where what was found is, if anything was, and how to go on."""

    def __init__(self, where: str = "", fix: str = "") -> None:
        super().__init__("interrupted", where, fix, 130)


def print_json(shown: Mapping[str, Any], error: UserError | None = None) -> None:
    """Print a result as one object. Where the command fails all the same, the error is in it, and raised."""
    from wristctl.records.journal import jsonable

    facts = {"error": _facts(error)} if error else {}
    print(json.dumps(jsonable({**shown, **facts}), indent=2, allow_nan=False))
    if error:
        raise Shown(error.what, error.where, error.fix, error.exit_code) from error


def print_error(error: UserError) -> None:
    """Where `--json` was typed, print an error as one object. A reader that has left, or a full disk, is no other."""
    if "--json" not in sys.argv or isinstance(error, Shown):
        return
    try:
        print(json.dumps({"schema": "wristctl.error/1", **_facts(error)}, indent=2), flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def _facts(error: UserError) -> dict[str, Any]:
    kind = _KINDS.get(error.exit_code, "check")
    return {"kind": kind, "exit_code": error.exit_code, "what": error.what, "where": error.where, "fix": error.fix}
