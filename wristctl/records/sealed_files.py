"""Files that a study names, as a run keeps them: copied into it, named by what they hold, units in their headers."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from wristctl.config.errors import UserError
from wristctl.config.given_files import files_of, with_files
from wristctl.config.resolved import sections_read
from wristctl.config.study import Study

INPUTS = "inputs"
"""The folder of a run in which they stand."""


@dataclass(frozen=True)
class SealedFiles:
    """A study with its files under the names that they have in a run, which config.yaml gives, and what they hold."""

    study: Study
    contents: dict[str, bytes] = field(default_factory=dict)
    """by the name in the run"""
    names: dict[str, str] = field(default_factory=dict)
    """the name in the run, by that in the study"""


def sealed_files(study: Study, kind: str) -> SealedFiles:
    """The files of the sections that a command reads. Raises UserError for one that cannot be read."""
    sections = sections_read(kind)
    contents, names = dict[str, bytes](), dict[str, str]()
    for section in sections:
        for name in files_of(getattr(study, section)):
            content = _content(Path(name))
            digest = hashlib.sha256(content).hexdigest()
            names[name] = f"{INPUTS}/{digest[:12]}/{Path(name).name}"
            contents[names[name]] = content
    if not names:
        return SealedFiles(study)
    own = {section: with_files(getattr(study, section), names.__getitem__) for section in sections}
    return SealedFiles(study.model_copy(update=own), contents, names)


def write_files(folder: Path, contents: dict[str, bytes]) -> None:
    """Put them into a run that begins."""
    for name, content in contents.items():
        (folder / PurePosixPath(name)).parent.mkdir(parents=True, exist_ok=True)
        (folder / PurePosixPath(name)).write_bytes(content)


def _content(file: Path) -> bytes:
    from wristctl.records.measured_table import with_units

    try:
        content = file.read_bytes()
        return with_units(content.decode("utf-8"), file).encode("utf-8")
    except UnicodeDecodeError:
        return content
    except OSError as error:
        raise UserError(
            f"cannot read a file that the study names: {error.strerror}", str(file), "check the path"
        ) from error
