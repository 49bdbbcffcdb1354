"""Public recordings: their files are recognised as published, or refused."""

from hashlib import sha256
from pathlib import Path

import pytest

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


def test_without_hashes_every_table_of_the_folder_is_of_the_set(tmp_path: Path) -> None:
    for name in ("a.txt", "b/c.mat", "readme.md"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("")
    assert list(DATA_SETS["deepc-arm"].found(tmp_path)) == ["a.txt", "b/c.mat"]


def test_every_set_has_a_converter_and_every_robot_a_set() -> None:
    assert all(one.columns in CONVERTERS and one.place and one.licence for one in DATA_SETS.values())
    assert set(ROBOTS) <= set(DATA_SETS)
