"""Runs in formats of other programs, opened by those formats' own readers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat

from wristctl.commands.export.run_data import FORMATS, export_run
from wristctl.errors import UserError
from wristctl.records import Run, start_run
from wristctl.records.log_converters import read_log
from wristctl.study_files.load import load_study
from wristctl.vision.camera import Frame
from wristctl.vision.marker import Sighting, SightingVerdict
from wristctl.vision.recordings import COLUMNS, RawVideo

LOG = {
    "trial": np.repeat([0, 1], 5),
    "time": np.tile(np.arange(5) * 0.005, 2),
    "clock": 10.0 + np.arange(10) * 0.005,
    "theta": np.where(np.arange(10) == 3, np.nan, 0.1 * np.arange(10)),
    "state": np.array(["enabled"] * 9 + ["fault"]),
    "state-": np.arange(10),
    "load": np.where(np.arange(10) == 7, np.inf, 0.0),
}
UNITS = {"time": "s", "clock": "s", "theta": "rad"}
SERIES = {"theta": np.arange(12.0).reshape(3, 4), "names": np.arange(3), "time": np.arange(4.0), "one": np.array(7.0)}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run with a log of two trials, frames on the trials' time, arrays, a film and metrics."""
    with start_run("hw-run", load_study(), "", tmp_path_factory.mktemp("made")) as live:
        live.table("data/log.csv", LOG, UNITS, {"theta": "bending angle as estimated"})
        live.table("data/frames.csv", {"trial": np.array([0, 1]), "captured": np.array([0.002, 0.003])})
        live.table("data/trials-of-it.csv", {"trial": np.array([0, 1]), "rmse": np.array([0.1, 0.2])})
        live.arrays("data/series.npz", SERIES)
        film = RawVideo(live.file("data/raw.avi"), 60.0)
        for number in range(3):
            picture = np.full((48, 64), 80 * number, np.uint8)
            verdict, corners = SightingVerdict.NO_TIP, np.full((2, 4, 2), np.nan)
            film.add(Frame(picture, 10.0 + number / 64.0, number), Sighting(0.0, number, np.nan, verdict, corners))
        film.close()
        live.columns("data/raw.csv", COLUMNS)
        live.metric("rmse", 0.25, "rad", "lower")
        live.metric("settling", None, "s", "lower")
    return Run(live.path)


def test_matlabs_file_has_tables_arrays_units_metrics_and_the_run(made: Run, tmp_path: Path) -> None:
    found = loadmat(export_run(made, "mat", tmp_path / "a.mat"), squeeze_me=True, simplify_cells=True)
    for name in ("time", "clock", "theta", "trial"):
        np.testing.assert_array_equal(found["data"]["log"][name], LOG[name])
    assert list(found["data"]["log"]["state"]) == list(LOG["state"])
    np.testing.assert_array_equal(found["data"]["log"]["state_"], np.arange(10))
    np.testing.assert_array_equal(found["data"]["series"]["theta"], SERIES["theta"])
    assert found["units"]["log"]["theta"] == "rad" and found["meaning"]["log"]["theta"] == "bending angle as estimated"
    assert found["metrics"]["rmse"] == 0.25 and np.isnan(found["metrics"]["settling"])
    assert found["run"]["id"] == made.id and found["run"]["result_sha256"] == made.result_hash
    np.testing.assert_array_equal(found["data"]["trials_of_it"]["rmse"], [0.1, 0.2])


def messages(file: Path) -> dict[str, list[tuple[int, Any]]]:
    """Time [ns] and content of every message by its topic, as mcap's own reader has them."""
    reader, ros = pytest.importorskip("mcap.reader"), pytest.importorskip("mcap_ros2.decoder")
    found: dict[str, list[tuple[int, Any]]] = {}
    with file.open("rb") as stream:
        opened = reader.make_reader(stream, decoder_factories=[ros.DecoderFactory()])
        for _, channel, message, content in opened.iter_decoded_messages():
            found.setdefault(channel.topic, []).append((message.log_time, content))
    return found


def test_an_mcap_log_has_what_went_on_in_time_on_one_clock(made: Run, tmp_path: Path) -> None:
    found = messages(export_run(made, "mcap", tmp_path / "a.mcap"))
    assert {"/hw_run/log", "/hw_run/frames", "/hw_run/raw", "/camera/compressed"} <= set(found)
    times, rows = zip(*found["/hw_run/log"], strict=True)
    np.testing.assert_allclose(np.array(times) * 1e-9, LOG["clock"])
    np.testing.assert_array_equal([row.theta for row in rows], LOG["theta"])
    assert rows[9].state == "fault" and [row.state_2 for row in rows] == [
        *range(10)
    ]  # two names alike in ROS's letters
    assert rows[7].load == np.inf and rows[6].load == 0.0
    np.testing.assert_allclose([at * 1e-9 for at, _ in found["/hw_run/frames"]], [10.002, 10.028])


def test_the_runs_id_and_metrics_are_metadata(made: Run, tmp_path: Path) -> None:
    reader = pytest.importorskip("mcap.reader")
    with export_run(made, "mcap", tmp_path / "a.mcap").open("rb") as stream:
        told = {each.name: each.metadata for each in reader.make_reader(stream).iter_metadata()}
    assert told["run"]["id"] == made.id and json.loads(told["metrics"]["rmse"])["value"] == 0.25


@pytest.mark.parametrize("to", list(FORMATS))
def test_nothing_is_written_over(made: Run, to: str, tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("mine")
    with pytest.raises(UserError, match="a file is in the way"):
        export_run(made, to, tmp_path / "mine")
    assert (tmp_path / "mine").read_text() == "mine"
    with start_run("simulate", load_study(), "", tmp_path) as live:
        pass
    with pytest.raises(UserError, match="the run has no data"):
        export_run(Run(live.path), to, tmp_path / "other")


def test_a_package_that_is_missing_is_named(made: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.delitem(sys.modules, "wristctl.commands.export.mcap_log", raising=False)
    for name in [each for each in sys.modules if each.split(".")[0] == "mcap"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "mcap", None)
    with pytest.raises(UserError, match="needs the packages mcap") as caught:
        export_run(made, "mcap", tmp_path / "a")
    assert "wristctl[logs]" in caught.value.fix and not (tmp_path / "a").exists()


def test_a_rigs_motions_are_an_open_log_with_spools_and_bends_at_their_own_times(tmp_path: Path) -> None:
    positions = {f"position_{tendon}": 100.0 * tendon + np.arange(4) for tendon in (1, 2, 4, 5)}
    ticks = {"trial": np.array([0, 0, 1, 1]), "counted": np.array([0.0, 0.01, 0.0, 0.01]), **positions}
    frames = {
        "trial": np.array([0, 0, 1]), "captured": np.array([0.004, 0.012, 0.002]), "theta": np.array([0.1, 0.9, 0.3]),
        "tip_x": np.full(3, 0.08), "tip_y": np.array([0.01, 0.02, 0.03]), "verdict": np.array(["ok", "blurred", "ok"]),
    }  # fmt: skip
    with start_run("hw-run", load_study(), "", tmp_path) as live:
        live.table("data/log.csv", ticks)
        live.table("data/frames.csv", frames)
        live.table("data/trials.csv", {"trial": np.array([0, 1]), "direction": np.array(["ulnar", "flexion"])})
    run = Run(live.path)
    ulnar, flexion = read_log(export_run(run, "csv", tmp_path / "log.csv")).trials().values()
    step = run.config.hw_run.actuator.step_length
    assert ulnar.columns["time"].tolist() == [0.0, 0.004, 0.01]
    np.testing.assert_allclose(ulnar.columns["spool_4"], [400.0 * step, np.nan, 401.0 * step])
    np.testing.assert_array_equal(ulnar.columns["bend_y"], [np.nan, 0.1, np.nan])
    assert np.isnan(ulnar.columns["bend_z"]).all() and np.isnan(flexion.columns["bend_y"]).all()
    assert flexion.columns["bend_z"][1] == 0.3 and flexion.columns["tip_z"][1] == 0.03
    with pytest.raises(UserError, match="a hw-run run holds no motion"):
        (run.path / "data" / "log.csv").unlink()
        export_run(run, "csv", tmp_path / "none.csv")


@pytest.mark.parametrize("kind", ["analyse", "hysteresis"])
def test_a_run_of_hysteresis_is_a_loop_that_can_be_measured(kind: str, tmp_path: Path) -> None:
    courses = {
        "loop": np.array([0, 0, 1]), "time": np.array([0.0, 0.1, 0.0]), "theta": np.array([0.1, 0.2, 0.3]),
        "given_plus": np.array([1e-3, 2e-3, 3e-3]), "given_minus": -np.array([1e-3, 2e-3, 3e-3]),
        "spool_plus": np.array([4.0, 6.0, 8.0]), "spool_minus": np.array([4.0, 2.0, 2.0]),
    }  # fmt: skip
    with start_run(kind, load_study([], ["analyse.of=hysteresis"]), "", tmp_path) as live:
        live.table("data/courses.csv", courses)
    first, _ = read_log(export_run(Run(live.path), "csv", tmp_path / "loops.csv")).trials().values()
    assert first.columns["tension_1"].tolist() == [2.0, 3.0] and first.columns["spool_2"].tolist() == [-1e-3, -2e-3]
    assert first.columns["bend_y"].tolist() == [0.1, 0.2]


def test_a_run_of_hysteresis_in_two_planes_has_both_bends_and_the_tendon_of_each_place(tmp_path: Path) -> None:
    courses = {"loop": np.array([0, 0]), "time": np.array([0.0, 0.1]), "theta": np.array([0.1, 0.2]),
               "bend_ulnar": np.array([0.08, 0.16]), "bend_flexion": np.array([0.06, 0.12])}  # fmt: skip
    for place in (1, 2, 3):
        courses |= {f"given_{place}": 1e-3 * place * np.ones(2), f"spool_{place}": place * np.array([4.0, 6.0])}
    study = load_study([], ["analyse.of=hysteresis", "wrist.tendons=three"])
    with start_run("analyse", study, "", tmp_path) as live:
        live.table("data/courses.csv", courses)
    log = read_log(export_run(Run(live.path), "csv", tmp_path / "loops.csv"))
    assert log.columns["bend_y"].tolist() == [0.08, 0.16] and log.columns["bend_z"].tolist() == [0.06, 0.12]
    assert log.columns["spool_3"].tolist() == [3e-3, 3e-3] and log.columns["tension_2"].tolist() == [8.0, 12.0]


def test_a_motion_ends_where_the_wrist_left_its_range(tmp_path: Path) -> None:
    """In a simulate run and for each motion of a comparison, whose other motions stay whole."""
    bend, time = np.array([0.0, 0.5, np.nan, np.nan]), np.arange(4.0)
    with start_run("simulate", load_study(), "", tmp_path) as live:
        live.table("data/trajectory.csv", {"time": time, "theta": bend, "tip_x": time, "tip_y": time})
    log = read_log(export_run(Run(live.path), "csv", tmp_path / "log.csv"))
    assert log.columns["time"].tolist() == [0.0, 1.0] and log.columns["tip_x"].tolist() == [0.0, 1.0]
    with start_run("compare", load_study(), "", tmp_path) as live:
        live.arrays("data/trajectories.npz", {"theta": np.stack([time, bend]), "time": time})
    trials = read_log(export_run(Run(live.path), "csv", tmp_path / "both.csv")).trials()
    assert [trial.columns["bend_y"].tolist() for trial in trials.values()] == [[0.0, 1.0, 2.0, 3.0], [0.0, 0.5]]
