"""The experiments that come with wristctl: study files that have a name wherever it is installed."""

import os
from pathlib import Path

EXPERIMENTS = "experiments"
"""Their folder: within an installed package, beside the package in a clone, and where `init` lays them out."""

_PACKAGE = Path(__file__).resolve().parents[1]


def shipped() -> Path:
    """The folder of the experiments that come with this wristctl."""
    within = _PACKAGE / EXPERIMENTS
    return within if within.is_dir() else _PACKAGE.parent / EXPERIMENTS


def shipped_names() -> list[str]:
    """What a study file may be called without a path: quick, scenarios/camera."""
    folder = shipped()
    return sorted(file.relative_to(folder).with_suffix("").as_posix() for file in folder.rglob("*.yaml"))


def study_file(given: Path, folder: Path = Path()) -> Path | None:
    """The file that is meant in a folder: of that path, else the experiment of that name.

    Experiments of the folder come before those of wristctl; quick, quick.yaml and experiments/quick.yaml are the same
    one. A path from the root names none, and is given back. None where there is neither.
    """
    file, name = folder / given, shipped_name(given)
    there = os.path.exists(file)
    if given.is_absolute() or (there and not os.path.isdir(file)):
        return file
    if ".." not in given.parts:
        own = folder / EXPERIMENTS / f"{name}.yaml"
        if own.is_file():
            return own
        if name in shipped_names():
            return shipped() / f"{name}.yaml"
    return file if there else None


def shipped_name(given: Path) -> str:
    """What an experiment of that path is called."""
    parts = given.parts[1:] if given.parts[:1] == (EXPERIMENTS,) else given.parts
    return "/".join(parts).removesuffix(".yaml")
