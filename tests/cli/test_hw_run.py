"""`hw-run` and `hw calibrate wrist` as they are typed."""

from __future__ import annotations

import json
import os
import pty
import re
import sys
import tty
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.cli.conftest import Call
from tests.plotting.browser import CHROMIUM, DRIVER, Browser
from wristctl.board.framing import Decoder
from wristctl.board.layout import LAYOUTS
from wristctl.board.messages import Command, Rate
from wristctl.commands.loop_warnings import outside_conditions
from wristctl.config.camera import Gates, Markers
from wristctl.records import Run, list_runs, open_run
from wristctl.study_files.load import load_study
from wristctl.vision.camera import VideoCamera
from wristctl.vision.marker import Tracker
from wristctl.vision.view import View
from wristctl.wrist.directions import ACTIVE, DIRECTIONS
from wristctl.wrist.kinematics import chain_tip

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "build" / "screenshots"

HOMING = "homing={move: 1.0e-4, rest: 0.15, frames: 2, slack: 5.0e-4, let_go: 1.0}"
QUICK = (
    "hw-run", "--set", "directions=[ulnar]", "--set", "push.force=0", "--set", "horizon=0.5", "--set", "back=0.3",
    "--set", "reference={duration: 0.4, angle_deg: 10.0}", "--set", HOMING,
    "--set", "controllers=[{controller: smc-tracking, gains: hardware}]",
)  # fmt: skip


SLOW = ("--set", "sensor={level: camera, frame_rate: 20}")


@pytest.mark.painted
@pytest.mark.slow
def test_the_emulated_experiment_ends_in_a_sealed_run_with_tables_and_pictures(call: Call) -> None:
    code, out, err = call(*QUICK, "--video")
    run = open_run("latest:hw-run")
    assert code == 0 and err.splitlines()[0].startswith("all emulated, in virtual time")
    assert "paper" not in out and run.problems() == []  # its numbers stand beside its law only
    (trial,) = run.data("trials").to_dict("records")
    assert trial["outcome"] == "ok" and trial["rmse"] == run.metrics["rmse"]["value"] < 0.01
    assert trial["true_rmse"] < 0.01
    names = {file.stem for file in (run.path / "figures").iterdir()}
    assert names == {"directions", "errors", "tensions"}
    assert '"group": "ulnar"' in (run.path / "report.html").read_text()
    zero = json.loads(run.file("data/zero.json").read_text())
    assert zero["slack"] == pytest.approx([3e-4, 2e-4, 4e-4, 2.5e-4], abs=6e-5)
    assert {column["unit"] for column in _columns(run.path, "data/log.csv")} > {"rad", "N", "steps", "s"}
    _watch(run.file("data/video.avi"), len(run.data("frames")))
    _track_anew(run)
    _hear(run)
    _learn(call, run)
    if CHROMIUM and DRIVER:
        _look(run.path / "report.html")


def _watch(video: Path, in_trial: int) -> None:
    """Every frame is annotated; in the trial the tip's marker, outlined in green, goes aside and back."""
    film = cv2.VideoCapture(str(video))
    assert film.get(cv2.CAP_PROP_FPS) == 60.0
    aside = []
    while (read := film.read())[0]:
        blue, green, red = np.moveaxis(read[1].astype(int), -1, 0)
        assert read[1][:20, :60].mean() > 150  # clock and angle on white
        aside.append(np.nonzero((green > red + 60) & (green > blue))[1].mean())
    assert len(aside) > in_trial > 25
    trial, home = aside[-in_trial - 240 :], np.median(aside[:20])  # behind it the way back, and tendons let out
    assert max(trial) - home > 15.0 and abs(aside[-1] - home) < 3.0


def _track_anew(run: Run) -> None:
    """The raw video gives the trial's angles again, at the times beside it, but for what JPEG takes away."""
    taken, frames = run.data("raw"), run.data("frames")
    assert run.data("log")["utc"].isna().all(), "virtual time has no date"
    tracker, angles = Tracker(Markers(), View(), Gates()), {}
    for time, frame in zip(taken["clock"], VideoCamera(run.file("data/raw.avi")), strict=True):
        angles[frame.number] = tracker.see(frame._replace(time=time)).theta
    usable = frames[frames["verdict"] == "ok"]
    start = float((run.data("log")["clock"] - run.data("log")["time"]).iloc[0])
    rows = [int(np.argmin(np.abs(taken["clock"] - start - time))) for time in usable["captured"]]
    zero = json.loads(run.file("data/zero.json").read_text())["marker"]
    assert np.abs([angles[row] for row in rows] - usable["theta"] - zero).max() < np.deg2rad(0.3)


def _learn(call: Call, run: Run) -> None:
    """Tips and angles of the trial's frames are a recording: nearly those of the wrist that bent."""
    frames, truth = run.data("frames"), run.data("truth")
    usable = frames[frames["verdict"] == "ok"]
    angles = [np.interp(usable["captured"], truth["time"], truth[f"theta_{k}"]) for k in (1, 2, 3, 4)]
    off = usable[["tip_x", "tip_y"]].to_numpy() - chain_tip(np.column_stack(angles), run.config.wrist.length)
    assert np.abs(off).max() < 2e-3 and off[:, 1].std() < 3e-4  # the camera is not calibrated
    code, _, err = call("gen-data", "--source", "run", "--run", run.id)
    assert code == 0, err
    samples = open_run("latest:gen-data").array("samples")
    assert set(samples["recording"]) == {0} and len(samples["theta"]) == len(usable)
    np.testing.assert_array_equal(samples["theta"], usable["theta"])
    code, _, err = call("train", "--data", "latest:gen-data", "--dry-run")
    assert code == 2 and "1 recording: training, choosing and testing need one each" in err


def _hear(run: Run) -> None:
    """All bytes of the run are frames again, and those sent in the trial carry the rates of its log."""
    wire, log = run.data("wire"), run.data("log")
    sent, came = Decoder(), Decoder()
    told = [
        (clock, frame)
        for clock, way, digits in wire.itertuples(index=False)
        for frame in (sent if way == "sent" else came).feed(bytes.fromhex(digits))
    ]
    assert not sent.bad_crc + sent.bad_frames + came.bad_crc + came.bad_frames
    assert (np.diff(wire["clock"]) >= 0.0).all()
    rates = [(clock, frame) for clock, frame in told if frame.code == Command.RATE]
    within = [each for each in rates if log["clock"].iloc[0] <= each[0] <= log["clock"].iloc[-1] + 1e-3]
    assert len(within) == len(log)
    assert [clock for clock, _ in within] == pytest.approx(log["clock"].tolist(), abs=1e-4)
    steps = np.array([LAYOUTS[Rate].unpack(Rate, frame.payload[2:]).rate for _, frame in within])
    signs = json.loads(run.file("data/zero.json").read_text())["signs"]
    logged = log[[f"sent_{tendon}" for tendon in ACTIVE]].to_numpy() * signs
    assert np.abs(steps - logged).max() < 1e-3


def _look(page: Path) -> None:
    """A browser shows the page without an error or a request, and plays the wrist up to its 10 degrees."""
    browser = Browser(page.parents[2] / "profile")
    try:
        for width in (390, 1280):
            browser.open(page, width, False)
            browser.run(
                "const s = document.getElementById('instant'); s.value = s.max;s.dispatchEvent(new Event('input'))"
            )
            browser.screenshot(KEPT / f"hw-run-{width}.png")
            assert browser.run("return document.documentElement.scrollWidth") <= width
            shown = browser.run("return document.querySelector('#wrists > div').lastChild.textContent")
            assert shown.endswith("wanted 10.0\N{DEGREE SIGN}")
        assert browser.console() == [] and set(browser.requests()) == {page.as_uri()}
        assert page.stat().st_size < 5e6
    finally:
        browser.close()


@pytest.mark.slow
def test_a_covered_marker_ends_in_a_sealed_run_with_its_reason_and_the_last_second(call: Call) -> None:
    code, _, err = call(*QUICK, "--set", "bench.faults=[{kind: marker-covered, at: 0.1}]")
    (run,) = list_runs(Path("results"))
    assert code == 5 and run.state == "failed" and run.problems() == [] and run.manifest.exit_code == 5
    assert "no usable marker angle" in err and "the motors stand" in err and "The last second" in err
    stop = json.loads(run.file("data/stop.json").read_text())
    assert stop["motors_stand"] and stop["trial"] == 0 and stop["rate"] == [0, 0, 0, 0]
    code, out, _ = call("hw", "limits", "--from", run.id, "--figure", "residuals.png")
    assert (
        code == 0
        and f"{run.id} was stopped in trial 0" in out
        and re.search(r"no usable marker angle for 1(?:5\d|60) ms", out)
    )
    assert "A run that was stopped proposes no limits" in out and Path("residuals.png").stat().st_size > 10_000
    code, out, _ = call("hw", "limits", "--from", run.id, "--json")
    told = json.loads(out)
    assert told["stopped"][0]["by"] == told["residuals"][0]["name"] == "age" and told["stopped"][0]["trial"] == 0
    assert len(run.data("log")) > 20 and "no tip" in set(run.data("frames")["verdict"])
    assert call("hw", "watch", "--file", "seen.png")[:2] == (0, "seen.png\n")  # what there is of it
    assert Path("seen.png").read_bytes().startswith(b"\x89PNG")


def test_without_a_run_of_trials_there_is_nothing_to_watch(call: Call) -> None:
    assert call("gen-data", "--samples", "10", "--label", "hw-run")[0] == 0  # by its label only
    code, _, err = call("hw", "watch")
    assert code == 2 and "there is no run of hw-run - results - fix: start one" in err


@pytest.fixture
def silent_port() -> Iterator[str]:
    """A serial port on which nobody answers."""
    master, client = pty.openpty()
    tty.setraw(client)
    yield os.ttyname(client)
    os.close(master)
    os.close(client)


def test_a_dry_run_opens_neither_port_nor_camera(call: Call, tmp_path: Path, silent_port: str) -> None:
    opened: list[str] = []
    sys.addaudithook(lambda event, given: opened.append(str(given[0])) if event == "open" else None)
    code, out, _ = call("hw-run", "--dry-run", "--port", silent_port, "--camera", "/dev/null")
    assert code == 0 and f"on hardware: board at {silent_port}, camera /dev/null" in out
    assert not list(tmp_path.iterdir())
    assert silent_port not in opened and "/dev/null" not in opened
    os.close(os.open(silent_port, os.O_RDWR | os.O_NOCTTY))
    assert opened[-1] == silent_port  # one that had been opened would have been seen


def test_a_port_that_is_none_is_exit_4_and_says_what_to_check(call: Call) -> None:
    code, _, err = call("hw-run", "--port", "/nowhere/ttyACM0", "--yes")
    assert code == 4 and "there is no such port" in err and "wristctl hw ports" in err
    assert "ticks" not in err and "nan" not in err


def test_a_port_where_nobody_answers_is_exit_4_after_three_seconds(
    call: Call, monkeypatch: pytest.MonkeyPatch, silent_port: str
) -> None:
    from wristctl.trial import testbeds

    class Dark:
        name = "dark"

        def __init__(self, *_: object) -> None:
            """A camera that is there."""

        def newest(self) -> None:
            return None

        def close(self) -> None:
            """Nothing is open."""

    monkeypatch.setattr(testbeds, "DeviceCamera", Dark)
    code, _, err = call("hw-run", "--port", silent_port, "--yes")
    assert code == 4 and "no answer to HELLO" in err and "check USB cable and power" in err
    attempts = re.search(r"after (\d+) attempts", err)
    assert attempts is not None and 0.1 * int(attempts[1]) <= 3.1  # a tenth of a second of patience with each


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--set", "controllers=[{controller: smc-trackin, gains: hardware}]"), "did you mean 'smc-tracking'?"),
        (("--set", "safety.late=0.2"), "must be below watchdog (0.1 s)"),
        (("--set", "safety.late=0.095"), "hw-run - fix: safety.late below 0.09, or a longer safety.watchdog"),
        ((*SLOW, "--set", "control_period=0.04"), "fix: control_period below 0.04, or safety.watchdog above 0.1"),
        (("--set", "safety={watchdog: 0.04, late: 0.02}"), "hw-run - fix: safety.watchdog above 0.05"),
        (("--set", "positions=stored"), "needs a calibration run"),
        (("--set", "push.force=0", "--set", "without_push=false"), "leave no trial"),
        (("--set", "reference.angle_deg=80"), "beyond the wrist's range"),
        (("--set", "bench.faults=[{kind: port-los}]"), "port-lost"),
    ],
)
def test_what_the_user_got_wrong_is_one_line_before_anything_moves(
    call: Call, arguments: tuple[str, ...], said: str
) -> None:
    code, _, err = call("hw-run", *arguments)
    assert code == 2 and said in err and "Traceback" not in err


def test_a_controller_that_is_none_is_told_by_its_row_before_there_is_a_run(call: Call) -> None:
    rows = "controllers=[{controller: smc-tracking, gains: hardware}, {controller: smcc}]"
    code, _, err = call("hw-run", "--set", rows)
    assert code == 2 and f"--set {rows}: hw-run.controllers.1.controller" in err and not Path("results").exists()


def _columns(run: Path, name: str) -> list[dict[str, str]]:
    outputs = json.loads((run / "run.json").read_text())["outputs"]
    columns: list[dict[str, str]] = next(each["columns"] for each in outputs if each["path"] == name)
    return columns


def test_a_replay_is_identical(call: Call) -> None:
    if not os.environ.get("WRISTCTL_THOROUGH"):
        pytest.skip("WRISTCTL_THOROUGH=1")
    assert call(*QUICK)[0] == 0
    code, out, _ = call("runs", "replay", "latest:hw-run")
    assert code == 0 and out.splitlines()[-1].endswith("identical")


def test_calibrating_the_wrist_leaves_what_a_later_run_reuses(call: Call) -> None:
    if not os.environ.get("WRISTCTL_THOROUGH"):
        pytest.skip("WRISTCTL_THOROUGH=1")
    motors = "bench.motors.reversed=[false, true, false, false]"
    code, out, _ = call("hw", "calibrate", "wrist", "--set", HOMING, "--set", motors)
    assert code == 0 and "-1" in out
    assert call(*QUICK, "--set", motors, "--calibration", "latest:calibrate-wrist")[0] == 0
    code, _, err = call(*QUICK, "--calibration", "latest:calibrate-wrist", "--set", "positions=stored")
    assert code == 4 and "the calibration left the motors at" in err


@pytest.mark.slow
def test_a_calibration_that_was_refused_or_is_of_one_axis_is_none(call: Call) -> None:
    calibrate = ("hw", "calibrate", "wrist")
    quick = ("--set", HOMING, "--set", "bench.motors.slack=[0, 0, 0, 0]")
    assert call(*calibrate, *quick, "--label", "good")[0] == 0
    assert call(*calibrate, *quick, "--set", "bench.motors.slack=[0.01, 0, 0, 0]", "--label", "refused")[0] == 5
    assert call(*calibrate, "--axis", "2", "--max-deg", "2", "--label", "axis")[0] == 0
    code, out, err = call("hw-run", "--calibration", "latest:calibrate-wrist", "--dry-run")
    assert code == 0 and f"calibration: {open_run('latest:calibrate-wrist:good').id} " in out
    assert "holds no calibration of all axes" in err
    axis = open_run("latest:calibrate-wrist:axis").id
    (refused,) = (path.name for path in Path("results").glob("*calibrate-wrist-refused*"))
    for ref, told in (
        (axis, "the run holds no calibration of all axes"),
        (refused, "run is failed, not ok: stopped: axis 0 (tendon 1) does not bend the wrist"),
        ("latest:calibrate-wrist:refused", "(state: failed: stopped: axis 0"),
    ):
        code, _, err = call("hw-run", "--calibration", ref, "--dry-run")
        assert code == 2 and told in err, err
        code, _, err = call("hw", "jog", "--axis", "0", "--mm", "0.1", "--port", "emulated", "--calibration", ref)
        assert code == 2 and told in err, err


@pytest.mark.slow
def test_the_first_motion_of_a_new_rig_is_small_slow_and_stops_early(call: Call) -> None:
    file = str(ROOT / "experiments" / "first-motion.yaml")
    study = load_study([Path(file)])
    settings = study.hw_run
    assert {DIRECTIONS[each].plane for each in settings.directions} == {"ulnar"} and settings.push.force == 0.0
    assert settings.reference.angle_deg == 5.0 and study.wrist.tension_limit == 10.0
    assert outside_conditions(settings.rows, [settings.loop]) == [], "no --force is needed on hardware"
    code, _, err = call("hw-run", file, "--set", "directions=[ulnar]", "--set", "horizon=2.2", "--set", HOMING)
    assert code == 0, err
    truth = open_run("latest:hw-run").data("truth")
    assert truth[[f"pull_{tendon}" for tendon in (1, 2, 4, 5)]].to_numpy().max() < 10.0
    assert np.degrees(np.abs(truth["theta"]).max()) == pytest.approx(5.0, abs=0.3)
