"""Tags of runs: in `tags.json` beside the run directories, because a sealed directory does not change."""

from __future__ import annotations

import fcntl
import json
import re
from collections.abc import Iterable
from pathlib import Path

from wristctl.config.errors import UserError
from wristctl.records.files import write_text

TAGS = "tags.json"


def read_tags(results: Path) -> dict[str, list[str]]:
    """Tags by run id; UserError where the file is damaged."""
    try:
        found = json.loads((results / TAGS).read_bytes())
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise UserError(f"cannot read the tags: {error}", str(results / TAGS), "mend or delete it") from error
    if isinstance(found, dict) and all(isinstance(tags, list) for tags in found.values()):
        return found
    raise UserError("the tags are no lists by run id", str(results / TAGS), "mend or delete it")


def change_tags(results: Path, run: str, add: Iterable[str] = (), remove: Iterable[str] = ()) -> list[str]:
    """Add and remove tags of a run; returns those it has now, sorted. Raises UserError for a tag with spaces."""
    add = list(add)
    for tag in add:
        if not re.fullmatch(r"[A-Za-z0-9_.:/-]{1,60}", tag):
            raise UserError("a tag holds letters, digits and _ . : / -", repr(tag), "respell it")
    with (results / ".tags.lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        tags = read_tags(results)
        remaining = sorted((set(tags.pop(run, ())) | set(add)) - set(remove))
        if remaining:
            tags[run] = remaining
        write_text(results / TAGS, json.dumps(tags, indent=2, sort_keys=True) + "\n")
    return remaining
