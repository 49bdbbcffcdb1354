"""Code from elsewhere in a run: a copy of every source, so that what ran can run again when the original is gone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from wristctl.config.errors import UserError
from wristctl.config.foreign import Foreign
from wristctl.config.trust import agree, digest_of
from wristctl.records.files import replacing, sha256_of

FOLDER = "code"
"""Of a run, with a folder in it for each file that a study names."""


def sealed_references(foreign: Sequence[Foreign]) -> dict[str, str]:
    """What the copies will be called in the run's configuration, by what their originals are called."""
    homes = _homes(foreign)
    return {each.reference: f"{homes[each.file]}/{_below(each, each.file)}:{each.attribute}" for each in foreign}


def copy_code(path: Path, foreign: Sequence[Foreign]) -> Mapping[str, str]:
    """Copy every source into a run directory; the hash of each by its name there.

    Raises UserError where one is no longer what was loaded.
    """
    homes, found = _homes(foreign), dict[str, str]()
    for each in foreign:
        for file, digest in each.files.items():
            name = f"{homes[each.file]}/{_below(each, file)}"
            (path / name).parent.mkdir(parents=True, exist_ok=True)
            with replacing(path / name) as temporary:
                temporary.write_bytes(file.read_bytes())
            found[name] = sha256_of(path / name)
            if found[name] != digest:
                raise UserError("a source was changed after it was loaded", str(file), "run again")
    for home in set(homes.values()):
        copies = {path / name: digest for name, digest in found.items() if name.startswith(f"{home}/")}
        agree(digest_of(path / home, copies))  # who named the original need not agree to its copy
    return dict(sorted(found.items()))


def _below(foreign: Foreign, file: Path) -> str:
    return file.relative_to(foreign.root).as_posix()


def _homes(foreign: Sequence[Foreign]) -> dict[Path, str]:
    """The folder of each file that is named, those of the same name numbered."""
    homes: dict[Path, str] = {}
    for each in foreign:
        if each.file not in homes:
            name, number = f"{FOLDER}/{each.file.stem}", 2
            while name in homes.values():
                name, number = f"{FOLDER}/{each.file.stem}-{number}", number + 1
            homes[each.file] = name
    return homes
