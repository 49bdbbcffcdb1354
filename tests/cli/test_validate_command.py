"""`validate`: a sealed run on a real robot's recordings, here made ones in the same formats."""

from __future__ import annotations

import json
import math
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Call
from wristctl.config.choices import ROBOTS
from wristctl.identification.arc_robot import ArcRecording
from wristctl.records import Run
from wristctl.records.data_sets import DATA_SETS, DataSet
from wristctl.records.log_converters import ARM_STEP

SHARED = Path(__file__).parents[2] / ".." / ".." / "shared" / "data"
ARM = {"gain": 1.0, "tendon": 4.0, "shortening": 0.02, "delay": 0.1, "turn": 0.3, "tilt_y": 0.05, "tilt_z": -0.02}


def arm_log(file: Path, seed: int) -> None:
    """A day of a made silicone arm, as its authors write one: steps and tip [mm] without a header, hanging."""
    samples = 160
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-0.4, 0.4, (samples // 8 + 1, 2))
    held = np.repeat(corners, 8, axis=0)[:samples]
    robot = ROBOTS["deepc-arm"].robot
    toward = np.stack([np.cos(robot.angles), np.sin(robot.angles)], axis=1)
    steps = np.rint(robot.radius * held @ toward.T / ARM_STEP)
    nothing, time = np.zeros(samples, bool), 0.25 * np.arange(samples, dtype=np.float64)
    pause = np.r_[math.nan, np.full(samples - 1, 0.25)]
    recording = ArcRecording("", "", time, ARM_STEP * steps, np.zeros((samples, 3)), pause, nothing, nothing, nothing,
                             np.zeros(samples, np.int64))  # fmt: skip
    values = {name: np.array([value]) for name, value in ARM.items()}
    x, y, z = 1e3 * robot.expected(values, np.zeros((1, 3)), np.array([[1e-3, 0.0, 5e-4]]), recording)[0][0].T
    tips = np.stack([y, -z, -x], axis=1) + 0.2 * rng.normal(size=(samples, 3))
    rows = [", ".join(f"{value:.6g}" for value in (*step, *tip)) for step, tip in zip(steps, tips, strict=True)]
    file.write_text("\n".join(rows) + "\n")


@pytest.fixture
def days(tmp_path: Path) -> Path:
    """Folder with two days of the arm."""
    folder = tmp_path / "arm"
    folder.mkdir()
    for number, day in enumerate(("day1.txt", "day2.txt")):
        arm_log(folder / day, number)
    return folder


@pytest.mark.painted
@pytest.mark.slow
def test_a_robot_is_validated_in_a_run_that_stands_without_its_folder(tmp_path: Path, days: Path, call: Call) -> None:
    code, out, err = call("validate", "deepc-arm", "--data", str(days), "--set", "terms=[slack]")
    assert code == 0, err
    assert out.startswith("The model predicts the tip of the DeePC arm to 0.")
    run = Run(Path(out.strip().splitlines()[-1]))
    error = run.metrics["error"]
    assert error["value"] == pytest.approx(0.35, abs=0.06) and error["interval"][0] < 0.35 < error["interval"][1] + 0.05
    assert run.metrics["turn_1"]["value"] == pytest.approx(0.3, abs=0.02)
    assert {figure.stem for figure in (run.path / "figures").glob("*.png")} == {"motion", "left-over", "models"}
    predicted = run.data("predicted")
    assert set(predicted["part"]) == {"fitted", "predicted"} and len(predicted) == 320
    for day in days.iterdir():
        assert next(run.path.glob(f"inputs/*/{day.name}")).read_bytes() == day.read_bytes()
        day.unlink()
    assert call("runs", "verify", run.id)[0] == 0
    code, out, err = call("runs", "replay", run.id)
    assert code == 0, out + err
    assert "DeePC" in (run.path / "README.md").read_text()


def test_what_is_missing_or_not_as_published_is_said_before_anything_is_written(
    tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, out, _ = call("validate", "--list")
    assert code == 0 and "uc3m-soft-neck" in out and "LGPL-2.1" in out
    shown = json.loads(call("validate", "--list", "--json")[1])
    assert shown["columns"][:3] == ["robot", "where", "licence"] and [row[0] for row in shown["rows"]] == list(
        DATA_SETS
    )
    assert "a robot is needed" in call("validate")[2]
    assert "its recordings are needed" in call("validate", "opencr-v4")[2]
    assert "no such folder" in call("validate", "opencr-v4", "--data", "away")[2]
    code, _, err = call("validate", "opencr-v5", "--data", ".")
    assert code == 2 and "opencr-v4" in err
    (tmp_path / "one.csv").write_text("1")
    monkeypatch.setitem(
        DATA_SETS, "opencr-v4", DataSet("there", "MIT", "opencr", {"one.csv": sha256(b"2").hexdigest()})
    )
    assert "SHA-256 differs" in call("validate", "opencr-v4", "--data", str(tmp_path))[2]
    assert not list(tmp_path.glob("results/*"))


def test_a_plan_says_what_is_fitted_and_what_is_predicted(days: Path, call: Call) -> None:
    code, out, _ = call("validate", "deepc-arm", "--data", str(days), "--dry-run", "--json")
    assert code == 0 and "160 samples fitted, 160 predicted" in json.loads(out)["plan"]


@pytest.mark.parametrize(("robot", "most", "unit"), [("uc3m-soft-neck", 1.5, "deg")])
@pytest.mark.slow
def test_published_recordings_are_predicted_better_than_by_their_authors(
    call: Call, robot: str, most: float, unit: str
) -> None:
    """Where the recordings are at hand; with slack alone, which takes a second."""
    folder = SHARED / robot
    if not folder.is_dir():
        pytest.skip("recordings of others are no part of this package")
    code, out, err = call("validate", robot, "--data", str(folder), "--set", "terms=[slack]", "--json")
    assert code == 0, err
    metrics = json.loads(out)["metrics"]
    assert metrics["error"]["value"] <= most and metrics["error"]["unit"] == unit
    assert metrics["error"]["interval"][1] < metrics["authors"]["value"]
    assert metrics["step1_0g"]["value"] < 1.0
