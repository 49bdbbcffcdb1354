"""Public recordings of real robots: where each set is, under which licence, and whether a folder holds those files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from wristctl.errors import UserError, meant
from wristctl.records.files import sha256_of


@dataclass(frozen=True)
class DataSet:
    """A set that its authors published; none is part of this package."""

    place: str
    """Repository and commit."""
    licence: str
    columns: str
    """Name of the converter of its files."""
    hashes: Mapping[str, str]
    """SHA-256 of files by how their names end; empty where none was at hand."""

    def checked(self, folder: Path) -> list[str]:
        """Ends of the names whose files are there as published. Raises UserError for one that is missing or differs."""
        for ending, digest in self.hashes.items():
            files = [file for file in folder.rglob(f"*{Path(ending).name}") if _named(file, ending)]
            if not files:
                raise UserError(f"no file {ending}", str(folder), f"clone {self.place}")
            if sha256_of(files[0]) != digest:
                raise UserError("not the published file: its SHA-256 differs", str(files[0]), f"clone {self.place}")
        return list(self.hashes)


def _named(file: Path, ending: str) -> bool:
    """Whether a path ends so, folders apart by / or, in the file's name, by two underscores."""
    return file.as_posix().replace("__", "/").endswith(ending)


_NECK = "imu_openloop/spring_test_"
DATA_SETS: dict[str, DataSet] = {
    "uc3m-soft-neck": DataSet(
        "github.com/HUMASoft/Data-and-Results @704ab9a", "LGPL-2.1", "humasoft",
        {
            _NECK + "0gr.csv": "4b22f1ee8bc561e18449daad0f8d4e16d864989df9ff963fa8045a09239ff4f7",
            _NECK + "500gr.csv": "1be9a7ff0cbd91cef9e1b41324f08e75a99ca347bd54a61024ea8e4afa1bb16d",
            _NECK + "1000gr.csv": "ca8e003cdba862cb5ac43eb9e42137c65a747f2a714bdd5c751ed0f533b08611",
        },
    ),
    "opencr": DataSet(
        "github.com/ContinuumRoboticsLab/opencr-mujoco @17fff8b", "MIT", "opencr",
        {
            "tdcr_sysid_20260511-183002_train.csv": "1eddfda64b3cf51a7f6cdf3e88f088cbb70baa944be4e5ebb30ef397f76590af",
            "tdcr_sysid_20260511-183002_val.csv": "a69fd0e11c7e8ddbeb6828d7ca604f01e6c6bc45ea92311ae632e88302a751fe",
        },
    ),
    "deepc-arm": DataSet("github.com/chengoy30/DeePC-for-Soft-Robot-Control @b073f32", "none", "deepc-arm", {}),
    "tee-probe": DataSet("github.com/bfortuno/TEE-Probe_hysteresis_id @dba400e", "none", "tee-probe", {}),
    "spirob": DataSet("github.com/arben24/spirob-mjlab-sysid @e67ff90", "none", "spirob", {}),
}  # fmt: skip


def data_set(name: str) -> DataSet:
    """A set by its name. Raises UserError for an unknown one, with the nearest."""
    if name not in DATA_SETS:
        raise UserError(f"no data set '{name}'", name, meant(name, list(DATA_SETS)))
    return DATA_SETS[name]
