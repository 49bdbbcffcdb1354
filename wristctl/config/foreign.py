"""How a study names code from elsewhere, path/to/file.py:NAME, and where such code is from."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

PLAIN = "(py)"
"""How the names of laws end that are plain Python."""

_REFERENCE = re.compile(r"[^\n]*\.py:[A-Za-z_]\w*")


@dataclass(frozen=True)
class Foreign:
    """Where an object from elsewhere is from: its file, its name there, and every source it rests on with its hash."""

    file: Path
    attribute: str
    files: Mapping[Path, str]
    """SHA-256 of the file and of the modules beside it that it imports, when they were loaded."""
    root: Path
    """The folder below which all of them are."""

    @property
    def reference(self) -> str:
        """As a study names it."""
        return f"{self.file}:{self.attribute}"


def is_reference(name: str) -> bool:
    """Whether a name is the place of an object in a file."""
    return _REFERENCE.fullmatch(name) is not None


def split(reference: str) -> tuple[Path, str]:
    """File and name of a reference."""
    file, _, attribute = reference.rpartition(":")
    return Path(file), attribute
