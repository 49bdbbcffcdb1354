"""Public recordings of real robots: where each set is, under which licence, and which files of a folder are its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from wristctl.errors import UserError
from wristctl.records.files import sha256_of

_SUFFIXES = (".csv", ".txt", ".mat", ".xlsx", ".parquet")


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

    def found(self, folder: Path) -> dict[str, Path]:
        """The set's files in a folder by how their names end; of a set without hashes every recording there, once.

        What else the authors keep beside them, and a recording that another file has too, are passed over. Raises
        UserError where a file is missing, or is not as published.
        """
        if not folder.is_dir():
            raise UserError(f"no such folder - {folder}", "data", f"clone {self.place}")
        if not self.hashes:
            tables = sorted(file for file in folder.rglob("*") if file.suffix in _SUFFIXES)
            if not tables:
                raise UserError("no recordings", str(folder), f"clone {self.place}")
            return {file.relative_to(folder).as_posix(): file for file in self._recordings(tables)}
        found = {}
        for ending, digest in self.hashes.items():
            # folders are apart by /, or in the file's name by two underscores
            named = (file for file in folder.rglob(f"*{Path(ending).name}"))
            files = sorted(file for file in named if file.as_posix().replace("__", "/").endswith(ending))
            if not files:
                raise UserError(f"no file {ending}", str(folder), f"clone {self.place}")
            alike = (file for file in files if len(files) > 1 and sha256_of(file) == digest)
            found[ending] = next(alike, files[0])
        self.check(found)
        return found

    def _recordings(self, files: Sequence[Path]) -> list[Path]:
        """Those of files that the set's converter reads, of two that hold the same the first.

        Raises UserError of the first file where it reads none.
        """
        import numpy as np

        from wristctl.records.log_converters import read_log

        recordings, seen, errors = list[Path](), set[bytes](), list[UserError]()
        for file in files:
            try:
                log = read_log(file, self.columns)
            except UserError as error:
                errors.append(error)
                continue
            content = b"".join(name.encode() + np.round(log.columns[name], 9).tobytes() for name in sorted(log.columns))
            if content not in seen:
                recordings.append(file)
            seen.add(content)
        if not recordings:
            raise errors[0]
        return recordings

    def by_content(self, files: Sequence[Path]) -> dict[str, Path]:
        """Files by how their names ended when they were published, whatever they are called now.

        Raises UserError where one is missing.
        """
        if not self.hashes:
            return {file.name: file for file in files}
        digests = {sha256_of(file): file for file in files}
        missing = [ending for ending, digest in self.hashes.items() if digest not in digests]
        if missing:
            raise UserError(f"none of {len(files)} files is {missing[0]}", "files", f"clone {self.place}")
        return {ending: digests[digest] for ending, digest in self.hashes.items()}

    def check(self, files: Mapping[str, Path]) -> None:
        """UserError for a file that is not as published."""
        for ending, digest in self.hashes.items():
            if sha256_of(files[ending]) != digest:
                problem = "not the published file: its SHA-256 differs"
                raise UserError(problem, str(files[ending]), f"clone {self.place}")


_OPEN, _CLOSED = "imu_openloop/spring_test_", "imu_closeloop/frontier_test_"
_V4, _V6 = "tdcr_sysid_20260511-183002", "tdcrv6_sysid_20260406-181730"
DATA_SETS: dict[str, DataSet] = {
    "uc3m-soft-neck": DataSet(
        "github.com/HUMASoft/Data-and-Results @704ab9a", "LGPL-2.1", "humasoft",
        {
            _OPEN + "0gr.csv": "4b22f1ee8bc561e18449daad0f8d4e16d864989df9ff963fa8045a09239ff4f7",
            _OPEN + "500gr.csv": "1be9a7ff0cbd91cef9e1b41324f08e75a99ca347bd54a61024ea8e4afa1bb16d",
            _OPEN + "1000gr.csv": "ca8e003cdba862cb5ac43eb9e42137c65a747f2a714bdd5c751ed0f533b08611",
            _CLOSED + "000gr.csv": "3aec7a7757c0f93903210a96030868505826b752e92c9e2e26787c97aae5087d",
            _CLOSED + "200gr.csv": "7f67662294c65d48c15621ba1c9b8f1dd72e58c8ead03e227683b138da2c3d1e",
            _CLOSED + "400gr.csv": "87e9f89a38e508b81d26b1c11b297f245977095da30e6bc1cc3c8aa57d02a228",
            _CLOSED + "600gr.csv": "6172e9d32358a616e9b81ab10f8f1ae312247a8a816d246d00ca4eafd6ab4fd6",
            _CLOSED + "800gr.csv": "281c6f14e80a90c1513879c8bb1945e2d5c6a55fc8121ee4965c6851cd080005",
            _CLOSED + "1000gr.csv": "3bdb85719e8f2ef3544fb5176b3c8435e7657b5bb7ba47627830c1bf8d4a05e2",
        },
    ),
    "opencr-v4": DataSet(
        "github.com/ContinuumRoboticsLab/opencr-mujoco @17fff8b", "MIT", "opencr",
        {
            _V4 + "_train.csv": "1eddfda64b3cf51a7f6cdf3e88f088cbb70baa944be4e5ebb30ef397f76590af",
            _V4 + "_val.csv": "a69fd0e11c7e8ddbeb6828d7ca604f01e6c6bc45ea92311ae632e88302a751fe",
        },
    ),
    "opencr-v6": DataSet(
        "github.com/ContinuumRoboticsLab/opencr-mujoco @17fff8b", "MIT", "opencr",
        {
            _V6 + "_train.csv": "b54a17c839042e977bb09019385ed10f25bf8bd7bc06fb96db57c9369da7111f",
            _V6 + "_val.csv": "58b633c03f4d6ec13eceefad1a7854681f7627938c92ec71d233f6594b0ae5a2",
        },
    ),
    "deepc-arm": DataSet("github.com/chengoy30/DeePC-for-Soft-Robot-Control @b073f32", "none", "deepc-arm", {}),
    "tee-probe": DataSet("github.com/bfortuno/TEE-Probe_hysteresis_id @dba400e", "none", "tee-probe", {}),
    "spirob": DataSet("github.com/arben24/spirob-mjlab-sysid @e67ff90", "none", "spirob", {}),
}  # fmt: skip
