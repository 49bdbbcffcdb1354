"""Public recordings: their files are recognised as published, or refused."""

from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from wristctl.config.choices import ROBOTS
from wristctl.errors import UserError
from wristctl.records.data_sets import DATA_SETS, DataSet
from wristctl.records.log_converters import CONVERTERS

HASHES = {"a/one.csv": sha256(b"1").hexdigest(), "a/two.csv": sha256(b"2").hexdigest()}
MADE = DataSet("elsewhere", "MIT", "opencr", HASHES)


@pytest.mark.parametrize("name", ["x/a/{}.csv", "x__a__{}.csv"])
def test_files_are_known_in_their_tree_and_with_folders_in_their_names(tmp_path: Path, name: str) -> None:
    for word, content in (("one", "1"), ("two", "2")):
        file = tmp_path / name.format(word)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(content)
    assert list(MADE.found(tmp_path)) == list(HASHES) and MADE.found(tmp_path)["a/two.csv"] == file
    older = tmp_path / "0" / name.format("two")
    older.parent.mkdir(parents=True)
    older.write_text("another version, which sorts before it")
    assert MADE.found(tmp_path)["a/two.csv"] == file
    older.write_text(file.read_text())
    assert MADE.found(tmp_path)["a/two.csv"] == older, "of two that are as published the first by name"
    older.unlink()
    file.write_text("3")
    with pytest.raises(UserError, match="SHA-256 differs"):
        MADE.found(tmp_path)
    file.unlink()
    with pytest.raises(UserError, match=r"no file a/two\.csv"):
        MADE.found(tmp_path)
    with pytest.raises(UserError, match="no such folder"):
        MADE.found(tmp_path / "away")


def test_files_are_known_by_what_they_hold_whatever_they_are_called(tmp_path: Path) -> None:
    for name, content in (("2nd", "2"), ("1st", "1"), ("none", "3")):
        (tmp_path / name).write_text(content)
    files = sorted(tmp_path.iterdir())
    assert MADE.by_content(files) == {"a/one.csv": tmp_path / "1st", "a/two.csv": tmp_path / "2nd"}
    with pytest.raises(UserError, match=r"none of 2 files is a/two\.csv"):
        MADE.by_content([tmp_path / "1st", tmp_path / "none"])


def test_of_a_clone_without_hashes_every_recording_is_taken_once_and_all_else_passed_over(tmp_path: Path) -> None:
    rows = np.array([[0, 0, -1, 0.010658, -0.014175, -89.982605], [23, -28, 5, 4.6, 1.44, -89.28]])
    data = tmp_path / "Collect Data/Collect Data"
    data.mkdir(parents=True)
    for day, scale in (("08-28", 1.0), ("09-02", 2.0)):
        lines = [", ".join([*(f"{round(k)}" for k in row[:3]), *(f"{x:.6f}" for x in row[3:])]) for row in scale * rows]
        (data / f"arduino_log_2025-{day}.txt").write_text("\n".join(lines) + "\n")
    savemat(data / "ioput.mat", {"ud": rows[:, :3].T, "yd": rows[:, 3:].T})  # the first log once more
    savemat(data / "trajectory.mat", {"trajectory": rows})
    savemat(tmp_path / "Experiment2_reference_y.mat", {"Yref_ext": rows[:, 3:]})
    (tmp_path / "README.md").write_text("an arm")
    (tmp_path / "requirements.txt").write_text("numpy")
    (tmp_path / "empty.txt").write_text("")
    (tmp_path / "broken.mat").write_bytes(b"")
    named = [Path(name).name for name in DATA_SETS["deepc-arm"].found(tmp_path)]
    assert named == ["arduino_log_2025-08-28.txt", "arduino_log_2025-09-02.txt"]
    with pytest.raises(UserError, match="no Excel workbook"):
        DATA_SETS["tee-probe"].found(tmp_path)
    (tmp_path / "away").mkdir()
    with pytest.raises(UserError, match="no recordings"):
        DATA_SETS["tee-probe"].found(tmp_path / "away")


def test_every_set_has_a_converter_and_every_robot_a_set() -> None:
    assert all(one.columns in CONVERTERS and one.place and one.licence for one in DATA_SETS.values())
    assert set(ROBOTS) <= set(DATA_SETS)
