"""Runs on their way to a colleague: packed, unpacked, and done again there by their configuration."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from wristctl.records import Run, open_run

WALK = "time [s],angle [deg]\n" + "".join(f"{t / 20},{5 * (t / 20) ** 2}\n" for t in range(21))
pytestmark = pytest.mark.painted  # their pictures are part of what is compared

STUDY = """
gen-data: {samples: 60}
train: {hidden: [4], epochs: 2, workers: 1}
simulate:
  horizon: 0.3
  controller: computed-torque
  gains: default
  loop: {plant_segments: 1}
  reference: {kind: recording, file: walk.csv, inverse: network}
"""


@pytest.fixture(scope="module")
def once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the author's folder is kept from one test to the next."""
    return tmp_path_factory.mktemp("once") / "author"


@pytest.fixture
def made(call: Call, once: Path) -> Run:
    """A simulation on a recording, through a network, of samples; its recording is then deleted."""
    if not once.exists():
        _make(call)
        shutil.copytree("author", once)
    else:
        shutil.copytree(once, "author")
    found = open_run("latest:simulate", Path("author/results"))
    assert found.manifest.state == "ok"  # read now: the folder moves
    return found


def _make(call: Call) -> None:
    folder = Path("author")
    folder.mkdir()
    (folder / "walk.csv").write_text(WALK)
    (folder / "study.yaml").write_text(STUDY)
    study, out = str(folder / "study.yaml"), ("--out", str(folder / "results"))
    for command in (("gen-data",), ("train", "--data", "latest:gen-data"), ("simulate", "--network", "latest:train")):
        code, _, err = call(command[0], study, *command[1:], *out)
        assert code == 0, err
    (folder / "walk.csv").unlink()


def again(call: Call, run: Path, *out: str) -> Run:
    code, said, err = call("simulate", "--config", str(run / "config.yaml"), *out)
    assert code == 0, err
    return Run(Path(said.splitlines()[-1]))


@pytest.mark.slow
def test_a_packed_run_is_done_again_at_a_colleagues_with_the_same_result(call: Call, made: Run) -> None:
    code, said, err = call("runs", "pack", made.id, "--out", "author/results", "--file", "mail.zip")
    assert code == 0 and said.splitlines()[-1] == "mail.zip", err
    Path("author").rename("gone")
    code, said, err = call("runs", "unpack", "mail.zip", "--out", "colleague")
    assert code == 0, err
    there = Path(said.splitlines()[-1])
    assert there.name == made.id and len(said.splitlines()) == 4
    done = again(call, there, "--out", "colleague")
    assert done.result_hash == made.result_hash and done.manifest.config_sha256 == made.manifest.config_sha256
    code, said, err = call("runs", "replay", made.id, "--out", "colleague")
    assert code == 0 and "identical" in said, err


@pytest.mark.slow
def test_a_configuration_finds_its_inputs_beside_it_whatever_the_results_folder(call: Call, made: Run) -> None:
    Path("author").rename("share")
    done = again(call, Path("share/results") / made.id, "--out", "mine")
    assert done.result_hash == made.result_hash
    assert [Path(each.path).parent.name for each in done.manifest.inputs] == ["results"]
    code, _, err = call("simulate", "--config", f"share/results/{made.id}/config.yaml", "--set", "network=gone")
    assert code == 2 and "no such run" in err


@pytest.mark.slow
def test_a_configuration_of_a_run_whose_inputs_were_elsewhere_finds_them_once_unpacked(call: Call, made: Run) -> None:
    """Its config.yaml names the network by the author's path, which nobody else has."""
    done = again(call, made.path, "--out", "second")
    network = open_run("latest:train", Path("author/results"))
    assert str(network.path) in (done.path / "config.yaml").read_text()
    assert call("runs", "pack", done.id, "--out", "second", "--file", "mail.zip")[0] == 0
    for folder in ("author", "second"):
        Path(folder).rename(f"gone-{folder}")
    code, said, err = call("runs", "unpack", "mail.zip", "--out", "colleague")
    assert code == 0, err
    assert again(call, Path(said.splitlines()[-1]), "--out", "colleague").result_hash == made.result_hash


def test_what_cannot_be_packed_or_unpacked_ends_with_its_code(call: Call, made: Run) -> None:
    code, _, err = call("runs", "unpack", "nothing.zip")
    assert code == 2 and "cannot be read" in err
    (made.path / "metrics.json").write_text("{}")
    code, _, err = call("runs", "pack", made.id, "--out", "author/results")
    assert code == 2 and "metrics.json" in err and not list(Path().glob("*.zip"))
