"""Parquet files, and parts of a LeRobotDataset v3 in its folder, are read as pandas writes them."""

import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wristctl.errors import UserError
from wristctl.records.log_converters import read_log

JOINTS = ["flexor.pos", "extensor.pos"]


def data_set(folder: Path, names: object) -> Path:
    """One file of two episodes, as LeRobot lays a data set out, and what a file of it is."""
    part = folder / "data" / "chunk-000" / "file-000.parquet"
    part.parent.mkdir(parents=True)
    (folder / "meta").mkdir()
    features = {
        "observation.state": {"dtype": "float32", "shape": [2], "names": names},
        "observation.angle": {"dtype": "float32", "shape": [1], "names": None},
        "timestamp": {"dtype": "float32", "shape": [1], "names": None},
        "episode_index": {"dtype": "int64", "shape": [1], "names": None},
    }
    info = {"codebase_version": "v3.0", "fps": 10, "features": features,
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"}  # fmt: skip
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    frame = pd.DataFrame(
        {
            "observation.state": [np.array([k, -k], np.float32) for k in range(6)],
            "observation.angle": np.arange(6.0, dtype=np.float32),
            "timestamp": np.array([0.0, 0.1, 0.2] * 2, np.float32),
            "frame_index": [0, 1, 2] * 2,
            "episode_index": [0] * 3 + [1] * 3,
            "index": range(6),
            "task_index": 0,
        }
    )
    frame.to_parquet(part, index=False)
    return part


@pytest.mark.parametrize("names", [JOINTS, {"motors": JOINTS}])
def test_a_data_set_has_its_joints_by_name_and_its_episodes_as_trials(tmp_path: Path, names: object) -> None:
    pytest.importorskip("pyarrow")
    part = data_set(tmp_path, names)
    mapped = "spool_1=observation.state.flexor.pos [mm], spool_2=observation.state.extensor.pos [mm]"
    log = read_log(part, mapped + ", bend_y=observation.angle [deg]")
    assert list(log.trials()) == ["0", "1"] and not log.remarks
    np.testing.assert_allclose(log.columns["time"], [0.0, 0.1, 0.2] * 2, atol=1e-7)
    np.testing.assert_allclose(log.columns["spool_2"], -1e-3 * np.arange(6))


def test_without_names_the_parts_of_a_vector_count_and_the_error_proposes(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    part = data_set(tmp_path, ["gripper", "gripper"])
    with pytest.raises(UserError) as caught:
        read_log(part)
    assert "bend_y=observation.angle [deg]" in caught.value.fix and "observation.state.0" in str(caught.value)
    (tmp_path / "meta" / "info.json").write_text("[]")
    with pytest.raises(UserError, match=r"info\.json - fix"):
        read_log(part)


def test_a_plain_table_keeps_its_units_and_its_missing_cells(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    file = tmp_path / "log.parquet"
    counts = pd.array([1, None, 3], dtype="Int64")
    pd.DataFrame({"time [ms]": [0, 10, 20], "spool_1 [mm]": counts, "trial": ["a", "a", "b"]}).to_parquet(file)
    log = read_log(file)
    np.testing.assert_allclose(log.columns["spool_1"], [1e-3, np.nan, 3e-3])
    np.testing.assert_allclose(log.columns["time"], [0.0, 0.01, 0.02])
    assert log.words["trial"].tolist() == ["a", "a", "b"]


def test_without_pyarrow_the_error_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "log.parquet"
    file.write_bytes(b"PAR1")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(UserError, match=r"pyarrow, which is not installed - .* - fix: pip install 'wristctl\[logs\]'"):
        read_log(file)
