"""Copies that a run keeps of its inputs: files, and code from outside the package."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from wristctl.config.foreign import Foreign
from wristctl.config.given_files import files_of, with_files
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.plain_files import LARGEST_DATA, read_plain
from wristctl.plugins.trust import agree, digest_of
from wristctl.records.files import replacing, sha256_of
from wristctl.records.folders_of_logs import info_of
from wristctl.study_files.resolved import sections_read

# Folder of a run that holds the copies.
INPUTS = "inputs"


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
    sections = sections_read(kind, study)
    contents, names = dict[str, bytes](), dict[str, str]()
    for section in sections:
        for name in files_of(getattr(study, section)):
            content = _content(Path(name))
            digest = hashlib.sha256(content).hexdigest()
            names[name] = f"{INPUTS}/{digest[:12]}/{Path(name).name}"
            contents[names[name]] = content
            if (info := info_of(Path(name))) is not None:  # which names the parts of its vectors
                contents[f"{INPUTS}/{digest[:12]}/{info.name}"] = _content(info)
    if not names:
        return SealedFiles(study)
    sections_with_copies = {section: with_files(getattr(study, section), names.__getitem__) for section in sections}
    return SealedFiles(study.model_copy(update=sections_with_copies), contents, names)


def write_files(folder: Path, contents: dict[str, bytes]) -> None:
    """Put them into a run that begins."""
    for name, content in contents.items():
        (folder / PurePosixPath(name)).parent.mkdir(parents=True, exist_ok=True)
        (folder / PurePosixPath(name)).write_bytes(content)


def _content(file: Path) -> bytes:
    from wristctl.records.open_log import with_units

    try:
        content = read_plain(file, LARGEST_DATA)
        return with_units(content.decode("utf-8"), file).encode("utf-8")
    except UnicodeDecodeError:
        return content
    except OSError as error:
        raise UserError(
            f"cannot read a file that the study names: {error.strerror}", str(file), "check the path"
        ) from error


# Folder of a run with one subfolder for each code file that a study names.
FOLDER = "code"


def sealed_references(foreign: Sequence[Foreign]) -> dict[str, str]:
    """References to the copied code for the run's configuration, by the references of their originals."""
    homes = _homes(foreign)
    return {
        source.reference: f"{homes[source.file]}/{_below(source, source.file)}:{source.attribute}" for source in foreign
    }


def copy_code(path: Path, foreign: Sequence[Foreign]) -> Mapping[str, str]:
    """Copy every source into a run directory; the hash of each by its name there.

    Raises UserError where one is no longer what was loaded.
    """
    homes, digests = _homes(foreign), dict[str, str]()
    for source in foreign:
        for file, digest in source.files.items():
            name = f"{homes[source.file]}/{_below(source, file)}"
            (path / name).parent.mkdir(parents=True, exist_ok=True)
            with replacing(path / name) as temporary:
                temporary.write_bytes(read_plain(file))
            digests[name] = sha256_of(path / name)
            if digests[name] != digest:
                raise UserError("a source was changed after it was loaded", str(file), "run again")
    for home in set(homes.values()):
        copies = {path / name: digest for name, digest in digests.items() if name.startswith(f"{home}/")}
        agree(digest_of(path / home, copies))  # who named the original need not agree to its copy
    return dict(sorted(digests.items()))


def _below(foreign: Foreign, file: Path) -> str:
    return file.relative_to(foreign.root).as_posix()


def _homes(foreign: Sequence[Foreign]) -> dict[Path, str]:
    """The folder of each file that is named, those of the same name numbered."""
    homes: dict[Path, str] = {}
    for source in foreign:
        if source.file not in homes:
            name, number = f"{FOLDER}/{source.file.stem}", 2
            while name in homes.values():
                name, number = f"{FOLDER}/{source.file.stem}-{number}", number + 1
            homes[source.file] = name
    return homes
