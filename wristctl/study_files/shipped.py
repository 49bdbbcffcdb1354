"""The experiments that come with wristctl: study files that have a name wherever it is installed."""

import os
from pathlib import Path

# Folder of the shipped experiments: in an installed package, beside the package in a clone, and as copied by `init`.
EXPERIMENTS = "experiments"

_PACKAGE = Path(__file__).resolve().parents[1]


def shipped() -> Path:
    """The folder of the experiments that come with this wristctl."""
    within = _PACKAGE / EXPERIMENTS
    return within if within.is_dir() else _PACKAGE.parent / EXPERIMENTS


def shipped_names() -> list[str]:
    """Names of shipped study files without a path: quick, scenarios/camera."""
    folder = shipped()
    return sorted(file.relative_to(folder).with_suffix("").as_posix() for file in folder.rglob("*.yaml"))


def study_file(path: Path, folder: Path = Path()) -> Path | None:
    """The file that is meant in a folder: of that path, else the experiment of that name.

    Experiments of the folder come before those of wristctl; quick, quick.yaml and experiments/quick.yaml are the same
    one. A path from the root names none, and is given back. None where there is neither.
    """
    file, name = folder / path, shipped_name(path)
    exists = os.path.exists(file)
    if path.is_absolute() or (exists and not os.path.isdir(file)):
        return file
    if ".." not in path.parts:
        shipped_copy = folder / EXPERIMENTS / f"{name}.yaml"
        if shipped_copy.is_file():
            return shipped_copy
        if name in shipped_names():
            return shipped() / f"{name}.yaml"
    return file if exists else None


def studies_beside(path: Path) -> list[str]:
    """Study files in the folder of a path, as they are typed: mywrist.yaml."""
    return [str(file) for file in sorted(path.parent.glob("*.yaml"))]


def shipped_name(path: Path) -> str:
    """Name of the experiment at a path."""
    parts = path.parts[1:] if path.parts[:1] == (EXPERIMENTS,) else path.parts
    return "/".join(parts).removesuffix(".yaml")
