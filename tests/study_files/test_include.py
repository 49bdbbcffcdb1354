"""Study files that include others."""

from __future__ import annotations

from pathlib import Path

import pytest

from wristctl.errors import UserError
from wristctl.study_files.load import load_study


def test_what_is_included_is_read_first_from_where_the_file_stands(tmp_path: Path) -> None:
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner" / "a.yaml").write_text("seed: 1\nwrist: {length: 0.07, range_deg: 40}\n")
    (tmp_path / "b.yaml").write_text("include: [inner/a.yaml]\nwrist: {length: 0.09}\n")
    study = load_study([tmp_path / "b.yaml"])
    assert (study.seed, study.wrist.length, study.wrist.range_deg) == (1, 0.09, 40.0)


@pytest.mark.parametrize(
    "text, told",
    [
        ("include: [missing.yaml]\n", r"there is no .*missing.yaml to include, nor such .* - .*b.yaml:1"),
        ("seed: 1\ninclude: b.yaml\n", r"include should be a list of study files - .*b.yaml:2"),
        ("seed: 1\ninclude: [b.yaml]\n", r"b.yaml includes itself - .*b.yaml:2"),
        ("include: [c.yaml]\n", r"unknown key 'sed' - .*c.yaml:2: sed - fix: did you mean 'seed'"),
    ],
)
def test_an_include_that_cannot_be_is_named(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "b.yaml").write_text(text)
    (tmp_path / "c.yaml").write_text("wrist: {length: 0.09}\nsed: 2\n")
    with pytest.raises(UserError, match=told):
        load_study([tmp_path / "b.yaml"])


def test_files_that_include_each_other_are_named(tmp_path: Path) -> None:
    (tmp_path / "b.yaml").write_text("include: [c.yaml]\n")
    (tmp_path / "c.yaml").write_text("include: [b.yaml]\n")
    with pytest.raises(UserError, match=r"b.yaml includes itself"):
        load_study([tmp_path / "b.yaml"])
