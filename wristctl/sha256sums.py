"""SHA256SUMS of a run: the one reader of it."""

import re
from pathlib import Path

from wristctl.plain_files import read_plain, unreadable

SUMS = "SHA256SUMS"
_LINE = re.compile(r"([0-9a-f]{64})  (.+)")


def read_seal(folder: Path) -> dict[str, str] | None:
    """SHA256SUMS: the hash of each sealed file by name, lines that are none left out; None where there is no seal.

    UserError where it is there, perhaps, and cannot be read.
    """
    try:
        text = read_plain(folder / SUMS, links=False).decode("utf-8", errors="replace")
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise unreadable(error, folder / SUMS) from error
    lines = (_LINE.fullmatch(line) for line in text.split("\n"))
    return {line[2]: line[1] for line in lines if line and _inside(line[2])}


def _inside(name: str) -> bool:
    return not name.startswith("/") and ".." not in name.split("/")
