"""Recordings that are folders, a bag of ROS 2 or a data set, and the files that belong to them; nothing is read."""

from pathlib import Path

INFO = "info.json"
"""File of a data set that names its vectors' parts."""


def info_of(file: Path) -> Path | None:
    """The description of the data set that a parquet file is a part of: beside it, or where the set has it."""
    places = [file.parent / INFO, *(parent / "meta" / INFO for parent in file.absolute().parents[2:3])]
    return next((place for place in places if file.suffix == ".parquet" and place.is_file()), None)


def files_of_recording(path: Path) -> list[Path]:
    """The files that a recording has which is a folder: a bag of ROS 2, or a data set; of any other path itself."""
    files = list[Path]()
    if (path / "meta" / INFO).is_file():
        files = sorted(path.glob("data/*/*.parquet"))
    elif (path / "metadata.yaml").is_file():
        files = sorted(file for file in path.iterdir() if file.suffix in (".mcap", ".db3"))
    return files or [path]
