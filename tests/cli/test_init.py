"""`wristctl init` lays the experiments out, whole and over nothing."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest
import yaml
from jsonschema import Draft202012Validator

from tests.cli.conftest import ROOT, Command
from wristctl.config.study import Study
from wristctl.study_files.json_schema import NAMED, SCHEMA_FILE, study_schema
from wristctl.study_files.load import load_study

SOURCE = ROOT / "experiments"


def _files(folder: Path) -> dict[str, bytes]:
    found = (each for each in folder.rglob("*") if each.is_file() and each.suffix != ".pyc")
    return {each.relative_to(folder).as_posix(): each.read_bytes() for each in found}


def test_init_lays_all_experiments_out_and_its_next_lines_run(
    wristctl: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = wristctl("init", "my study")
    assert done.returncode == 0 and _files(tmp_path / "my study" / "experiments") == _files(SOURCE)
    names = {each.name for each in (tmp_path / "my study").iterdir()}
    assert names == {"experiments", "mywrist.yaml", "README.md", "study.schema.json"}
    lines = [shlex.split(line) for line in re.findall(r"^  (.*)$", done.stdout, re.MULTILINE)]
    assert lines[0] == ["cd", "my study"] and len(lines) == 4
    monkeypatch.chdir(lines[0][1])
    page = Path("README.md").read_text()
    for _, *typed in lines[1:]:
        assert "mywrist.yaml" in typed and shlex.join(["wristctl", *typed]) in page
        said = wristctl(*typed, "--dry-run")
        assert said.returncode == 0 and not said.stderr, said.stderr


def test_the_wrist_of_init_is_the_default_one_with_each_value_explained(wristctl: Command, tmp_path: Path) -> None:
    assert wristctl("init", ".").returncode == 0
    file = tmp_path / "mywrist.yaml"
    assert load_study([file]).wrist == Study().wrist
    values = re.findall(r"^  (\w+): .*# \S", file.read_text(), re.MULTILINE)
    assert set(values) == set(yaml.safe_load(file.read_text())["wrist"]) and len(values) > 10
    file.write_text(file.read_text().replace("length: 0.080", "length: 0.120"))
    assert "length: 0.12" in wristctl("simulate", "mywrist.yaml", "--dry-run").stdout


@pytest.mark.parametrize("name", ["mywrist.yaml", "README.md", "experiments", "study.schema.json"])
def test_init_writes_over_no_file_of_yours(wristctl: Command, tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mine")
    done = wristctl("init", ".")
    assert done.returncode == 2 and f" - {name} - " in done.stderr
    assert [each.name for each in tmp_path.iterdir()] == [name] and (tmp_path / name).read_text() == "mine"


def test_init_goes_into_a_folder_of_yours_and_writes_over_nothing(wristctl: Command, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    assert wristctl("init", ".").returncode == 0
    (tmp_path / "experiments" / "quick.yaml").write_text("seed: 5")
    before = _files(tmp_path)
    again = wristctl("init", ".")
    assert again.returncode == 2 and re.search(r"already.* - experiments - fix: another folder", again.stderr)
    assert _files(tmp_path) == before and before["notes.txt"] == b"mine"


def test_init_that_cannot_write_leaves_nothing(
    wristctl: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    assert re.search(r"cannot write: .* - file/experiments - fix: .*DIR", wristctl("init", "file").stderr)
    write, left = Path.write_bytes, [3]

    def full(file: Path, content: bytes) -> int:
        left[0] -= 1
        if not left[0]:
            raise OSError(28, "No space left on device")
        return write(file, content)

    monkeypatch.setattr(Path, "write_bytes", full)
    done = wristctl("init", "study")
    assert done.returncode == 2 and "No space left on device" in done.stderr
    assert list((tmp_path / "study").iterdir()) == []


def test_init_lays_the_schema_beside_the_study_that_names_it(wristctl: Command, tmp_path: Path) -> None:
    assert wristctl("init", ".").returncode == 0
    first = (tmp_path / "mywrist.yaml").read_text().partition("\n")[0]
    named = re.fullmatch(r"# yaml-language-server: \$schema=(\S+)", first)
    assert first == NAMED and named and named[1] == SCHEMA_FILE
    printed = wristctl("schema")
    schema = json.loads((tmp_path / SCHEMA_FILE).read_text())
    assert printed.returncode == 0 and json.loads(printed.stdout) == schema == study_schema()
    assert Draft202012Validator(schema).is_valid(yaml.safe_load((tmp_path / "mywrist.yaml").read_text()))
