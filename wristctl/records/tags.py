"""Tags of runs: in `tags.json` beside the run directories, because a sealed directory does not change."""

import json
import logging
import re
from collections.abc import Iterable
from pathlib import Path

from wristctl.errors import UserError
from wristctl.plain_files import read_json
from wristctl.records.files import write_text
from wristctl.records.lock import locked

TAGS, LOCK_OF_TAGS = "tags.json", ".tags.lock"

_log = logging.getLogger(__name__)


def read_tags(results: Path) -> dict[str, list[str]]:
    """Tags by run id; UserError where the file is damaged."""
    try:
        content = read_json(results / TAGS)
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise UserError(f"cannot read the tags: {reason}", str(results / TAGS), "mend or delete it") from error
    lists = content.values() if isinstance(content, dict) else [None]
    if all(isinstance(tags, list) and all(isinstance(tag, str) for tag in tags) for tags in lists):
        return dict(content)
    raise UserError("the tags are no lists by run id", str(results / TAGS), "mend or delete it")


def known_tags(results: Path) -> dict[str, list[str]]:
    """Tags by run id, for whoever can do without: where they cannot be read there are none, and a warning."""
    try:
        return read_tags(results)
    except UserError as error:
        _log.warning("runs are shown without their tags: %s", error)
        return {}


def change_tags(results: Path, run: str, add: Iterable[str] = (), remove: Iterable[str] = ()) -> list[str]:
    """Add and remove tags of a run; returns those it has now, sorted. Raises UserError for a tag with spaces."""
    add = list(add)
    for tag in add:
        if not re.fullmatch(r"[A-Za-z0-9_.:/-]{1,60}", tag):
            raise UserError("a tag holds letters, digits and _ . : / -", repr(tag), "respell it")
    with locked(results / LOCK_OF_TAGS):
        tags = read_tags(results)
        remaining = sorted((set(tags.pop(run, ())) | set(add)) - set(remove))
        if remaining:
            tags[run] = remaining
        write_text(results / TAGS, json.dumps(tags, indent=2, sort_keys=True) + "\n")
    return remaining
