"""Public recordings: their files are recognised as published, or refused."""

from hashlib import sha256
from pathlib import Path

import pytest

from wristctl.errors import UserError
from wristctl.records.data_sets import DATA_SETS, DataSet, data_set
from wristctl.records.log_converters import CONVERTERS

HASHES = {"a/one.csv": sha256(b"1").hexdigest(), "a/two.csv": sha256(b"2").hexdigest()}
MADE = DataSet("elsewhere", "MIT", "opencr", HASHES)


@pytest.mark.parametrize("name", ["x/a/{}.csv", "x__a__{}.csv"])
def test_files_are_known_in_their_tree_and_with_folders_in_their_names(tmp_path: Path, name: str) -> None:
    for word, content in (("one", "1"), ("two", "2")):
        file = tmp_path / name.format(word)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(content)
    assert MADE.checked(tmp_path) == list(HASHES)
    file.write_text("3")
    with pytest.raises(UserError, match="SHA-256 differs"):
        MADE.checked(tmp_path)
    file.unlink()
    with pytest.raises(UserError, match=r"no file a/two\.csv"):
        MADE.checked(tmp_path)


def test_every_set_has_a_converter_and_an_unknown_one_names_the_nearest() -> None:
    assert all(each.columns in CONVERTERS and each.place and each.licence for each in DATA_SETS.values())
    with pytest.raises(UserError) as caught:
        data_set("uc3m-softneck")
    assert "uc3m-soft-neck" in str(caught.value)
