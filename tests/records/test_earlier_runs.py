"""Runs that an earlier version sealed are read, checked, shown and built upon as if they were made today."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from wristctl.cli.app import main
from wristctl.config.study import Study
from wristctl.records import Run, list_runs, open_run
from wristctl.study_files.keys import command_of
from wristctl.trial.calibration import WristCalibration
from wristctl.vision.view import View

pytestmark = pytest.mark.filterwarnings("default")  # a setting that has gone since may be read with a warning

KINDS = (
    "gen-data", "train", "tune", "simulate", "hw-run", "identify", "calibrate-wrist", "compare", "audit",
    "calibrate-camera", "track",
)  # fmt: skip
Call = Callable[..., str]


@pytest.fixture
def call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Call:
    """Runs `wristctl ...` in this process and an empty folder, which must end with the exit code: stdout."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str, code: int = 0) -> str:
        monkeypatch.setattr(sys, "argv", ["wristctl", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        assert (ended.value.code or 0) == code, err
        return out

    return run


@pytest.fixture(params=KINDS)
def run(request: pytest.FixtureRequest, earlier: Path) -> Run:
    """An earlier run of each kind."""
    return open_run(f"latest:{request.param}", earlier)


def test_earlier_runs_are_listed_oldest_first_as_having_ended_well(call: Call, earlier: Path) -> None:
    listed = json.loads(call("runs", "ls", "--out", str(earlier), "--json"))["runs"]
    assert [(each["kind"], each["state"], each["note"]) for each in listed] == [(kind, "ok", "") for kind in KINDS]
    assert [each["id"] for each in listed] == [each.id for each in list_runs(earlier)]
    assert all(each["wall_s"] > 0 and each["metrics"] for each in listed)


def test_earlier_runs_are_as_they_were_sealed(call: Call, earlier: Path) -> None:
    said, ids = call("runs", "verify", "--out", str(earlier)).splitlines(), [run.id for run in list_runs(earlier)]
    assert said == [f"{each:{max(map(len, ids))}}  as sealed" for each in ids]


def test_an_earlier_run_is_shown_with_its_metrics_and_files(call: Call, run: Run) -> None:
    shown = call("runs", "show", str(run.path))
    assert run.id in shown and run.result_hash in shown
    assert all(output.path in shown for output in run.manifest.outputs)
    assert all(name in shown for name in run.metrics)
    assert json.loads(call("runs", "show", str(run.path), "--json"))["state"] == "ok"


def test_an_earlier_run_has_a_report(call: Call, run: Run, tmp_path: Path) -> None:
    call("runs", "report", str(run.path), "--to", "page.html")
    page = (tmp_path / "page.html").read_text()
    assert run.id in page and page.rstrip().endswith("</html>")


def test_the_configuration_of_an_earlier_run_is_read_back(run: Run) -> None:
    study = run.config
    assert isinstance(study, Study) and study.seed == run.manifest.seed
    if run.kind == "gen-data":
        assert (study.seed, study.gen_data.samples) == (3, 60)
    if run.kind == "simulate":
        assert (study.simulate.controller, study.simulate.loop.sensor.level) == ("smc-tracking", "camera")


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "track"])  # the pictures it tracked are not kept
def test_the_configuration_of_an_earlier_run_is_fed_back(call: Call, earlier: Path, kind: str) -> None:
    config = open_run(f"latest:{kind}", earlier).file("config.yaml")
    said = call(*command_of(kind).split(), "--config", str(config), "--out", str(earlier), "--dry-run")
    assert f"would write a run of {kind}" in said


SHORT = ("--set", "horizon=0.05")
MOVE = "references=[{kind: minimum-jerk, duration: 0.02}]"
ONE_ROW = ("--set", "controllers=[{controller: smc, gains: tuned}]", "--set", MOVE, "--set", "inverses=[network]")
USES = {
    "data of train": (("train", "--epochs", "1", "--seeds", "1", "--set", "hidden=[4]"), {"data": "gen-data"}),
    "network of simulate": (("simulate", *SHORT, "--set", "reference.inverse=network"), {"network": "train"}),
    "gains of simulate": (("simulate", *SHORT, "--controller", "smc", "--gains", "tuned"), {"tuned": "tune"}),
    "wrist of simulate": (("simulate", *SHORT), {"from-identified": "identify"}),
    "network and gains of compare": (("compare", *SHORT, *ONE_ROW), {"network": "train", "tuned": "tune"}),
    "course of gen-data": (("gen-data", "--source", "run", "--samples", "50"), {"run": "simulate"}),
    "courses of gen-data": (("gen-data", "--source", "run", "--samples", "50"), {"run": "compare"}),
}


@pytest.mark.parametrize("use", USES)
def test_an_earlier_run_serves_as_an_input(call: Call, earlier: Path, use: str) -> None:
    command, inputs = USES[use]
    runs = {role: open_run(f"latest:{kind}", earlier) for role, kind in inputs.items()}
    named = [part for role, run in runs.items() for part in (f"--{role}", str(run.path))]
    made = Run(Path(call(*command, *named).splitlines()[-1]))
    assert made.state == "ok" and made.metrics
    read = {each.role.replace("_", "-"): (each.run, each.result_sha256) for each in made.manifest.inputs}
    assert read == {role: (run.id, run.result_hash) for role, run in runs.items()}


@pytest.mark.parametrize(
    ("command", "option", "kind"),
    [
        ("identify", "", "hw-run"),
        ("tune", "--from-identified", "identify"),
        ("tune", "--network", "train"),
        ("hw-run", "--from-identified", "identify"),
        ("hw-run", "--calibration", "calibrate-wrist"),
        ("hw-run", "--optics", "calibrate-camera"),
        ("hw-run", "--optics-2", "calibrate-camera"),
        ("hw-run", "--tuned", "tune"),
        ("hw-run", "--network", "train"),
        ("hw calibrate wrist", "--optics", "calibrate-camera"),
        ("track pictures", "--calibration", "calibrate-camera"),
    ],
)
def test_an_earlier_run_is_taken_into_a_plan(
    call: Call, earlier: Path, tmp_path: Path, command: str, option: str, kind: str
) -> None:
    run = open_run(f"latest:{kind}", earlier)
    (tmp_path / "pictures").mkdir()
    matplotlib.image.imsave(tmp_path / "pictures" / "first.png", np.zeros((8, 8)))
    said = call(*command.split(), *([option] if option else []), str(run.path), "--dry-run")
    assert str(run.path) in said and "nothing is written now" in said


def test_an_earlier_calibration_is_read(earlier: Path) -> None:
    wrist, camera = (open_run(f"latest:calibrate-{what}", earlier) for what in ("wrist", "camera"))
    zero = WristCalibration.load(wrist).zero
    assert zero.markers[0] == wrist.metrics["marker"]["value"]
    assert zero.steps_per_radian[1] == wrist.metrics["steps_per_radian_2"]["value"]
    corners, view = camera.data("corners"), View.of(camera)
    assert view.size is not None
    assert 0 <= corners["x"].min() < corners["x"].max() < view.size[0]
    assert np.all(np.isfinite(view.rectify(corners[["x", "y"]].to_numpy())))


@pytest.mark.slow
def test_a_repetition_that_differs_from_an_earlier_run_names_the_code(call: Call, earlier: Path) -> None:
    run = open_run("latest:gen-data", earlier)
    found = json.loads(call("runs", "replay", str(run.path), "--set", "samples=61", "--json", code=3))
    assert not found["same"] and "config: gen-data.samples: 60 -> 61" in found["causes"]
    assert any(cause.startswith("code: tree: ") for cause in found["causes"])
    assert not any(cause.startswith(("input", "nondeterminism")) for cause in found["causes"])
    verdicts = {each["path"]: each["verdict"] for each in found["files"]}
    assert verdicts["data/samples.csv"] == "differs" and verdicts["tables.json"] == "volatile"
    shutil.rmtree(found["scratch"])
