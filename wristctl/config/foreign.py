"""References to code outside the package, path/to/file.py:NAME, and the origin of such code."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

# Suffix of the name of a law in plain Python.
PLAIN = "(py)"

_REFERENCE = re.compile(r"[^\n]*\.py:[A-Za-z_]\w*")


@dataclass(frozen=True)
class Foreign:
    """Origin of an object outside the package: file, attribute, and the hash of every source file it needs."""

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
