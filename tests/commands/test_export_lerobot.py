"""Motions as a LeRobotDataset v3: its published layout, and its samples as they were; LeRobot's own reader opens it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pandas as pd
import pytest

from tests.commands.made_motions import compared, rig_run, simulated
from wristctl.commands.export.run_data import export_run, open_log_of
from wristctl.errors import UserError
from wristctl.records import Run, start_run
from wristctl.records.folders_of_logs import files_of_recording
from wristctl.records.log_converters import read_log
from wristctl.records.open_log import OpenLog
from wristctl.study_files.load import load_study

COUNTED = ["timestamp", "frame_index", "episode_index", "index", "task_index"]
# Python of an environment with lerobot[dataset], which `make lerobot-reader` makes.
READER = os.environ.get("WRISTCTL_LEROBOT", "")
READ = """
import json, sys
from lerobot.datasets import LeRobotDataset
found = LeRobotDataset("wristctl/run", root=sys.argv[1])
rows = [found[k] for k in range(len(found))]
told = {"fps": found.fps, "episodes": found.num_episodes, "names": found.meta.names}
told["stats"] = {k: {n: v.tolist() for n, v in each.items()} for k, each in found.meta.stats.items()}
told["rows"] = {k: [r[k].tolist() for r in rows] for k in ("observation.state", "action", "timestamp", "observed")}
told["tasks"] = [r["task"] for r in rows]
if "observation.images.camera" in rows[0]:
    told["bright"] = [float(r["observation.images.camera"].mean()) for r in rows]
    told["shape"] = list(rows[0]["observation.images.camera"].shape)
print("FOUND" + json.dumps(told))
"""


def parquet(folder: Path, part: str) -> pd.DataFrame:
    return pd.read_parquet(folder / part / "chunk-000" / "file-000.parquet")


def same_samples(log: OpenLog, other: OpenLog) -> None:
    """Every sample of the one is in the other, at its trial and time, to the last bit, but for the hand's mass."""
    assert set(log.columns) - {"mass"} == set(other.columns) and len(log) == len(other)
    for name, column in other.columns.items():
        np.testing.assert_array_equal(log.columns[name], column, err_msg=name)


def test_the_folder_has_the_published_layout(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    folder = export_run(rig_run(tmp_path), "lerobot", tmp_path / "set")
    info = json.loads((folder / "meta" / "info.json").read_text())
    assert info["codebase_version"] == "v3.0" and info["fps"] == 100 and info["video_path"] is None
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (2, 40, 2)
    assert info["data_path"].format(chunk_index=0, file_index=0) == "data/chunk-000/file-000.parquet"
    data, episodes = parquet(folder, "data"), parquet(folder, "meta/episodes")
    assert set(data.columns) == set(info["features"]) >= {"observation.state", "action", *COUNTED}
    for name, feature in info["features"].items():
        values = np.array(data[name].tolist(), data[name].iloc[:1].to_numpy()[0].dtype).reshape(40, -1)
        assert list(values.shape[1:]) == feature["shape"] and values.dtype == feature["dtype"], name
    names = info["features"]["observation.state"]["names"]
    assert "spool_4 [m]" in names and "bend_y [rad]" in names and "tip_x [m]" in names
    assert info["features"]["action"]["names"] == [f"spool_{tendon} [m]" for tendon in (1, 2, 4, 5)]
    assert data["index"].tolist() == list(range(40)) and data["frame_index"].tolist() == [*range(20)] * 2
    np.testing.assert_allclose(data["timestamp"], data["frame_index"] / 100.0, rtol=1e-6)
    tasks = pd.read_parquet(folder / "meta" / "tasks.parquet")
    assert tasks.loc["bend flexion, pushed by 2 N", "task_index"] == 1
    assert episodes["tasks"].map(list).tolist() == [["bend ulnar"], ["bend flexion, pushed by 2 N"]]
    assert episodes[["dataset_from_index", "dataset_to_index"]].to_numpy().tolist() == [[0, 20], [20, 40]]
    state = np.stack(data["observation.state"].tolist())
    whole = json.loads((folder / "meta" / "stats.json").read_text())
    np.testing.assert_allclose(whole["observation.state"]["mean"], state.mean(axis=0), rtol=1e-5)
    np.testing.assert_allclose(episodes["stats/action/max"][1], np.stack(data["action"].tolist())[20:].max(axis=0))
    assert whole["observation.state"]["count"] == [40]


def test_a_row_has_what_was_taken_by_then_and_no_picture_of_later(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    run = rig_run(tmp_path)
    data = parquet(export_run(run, "lerobot", tmp_path / "set"), "data")
    names = json.loads((tmp_path / "set" / "meta" / "info.json").read_text())["features"]["observation.state"]["names"]
    first = data[data.episode_index == 0]
    bend = np.stack(first["observation.state"].tolist())[:, names.index("bend_y [rad]")]
    # ticks at 0, 10, ... ms; pictures at 4, 29, 54 ... ms, of bends 0.1, 0.2, ...
    np.testing.assert_allclose(bend[:7], [0.1, 0.1, 0.1, 0.2, 0.2, 0.2, 0.3], rtol=1e-6)
    across = np.stack(first["observation.state"].tolist())[:, names.index("bend_z [rad]")]
    assert (across == 0.0).all() and np.isnan(
        np.stack(first["observed"].tolist())[:, names.index("bend_z [rad]")]
    ).all()


@pytest.mark.parametrize("made", [rig_run, simulated, compared])
def test_its_samples_come_back_to_the_last_bit(made: Any, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    run = made(tmp_path)
    csv = read_log(export_run(run, "csv", tmp_path / "log.csv"))
    (file,) = files_of_recording(export_run(run, "lerobot", tmp_path / "set"))
    log = read_log(file)
    same_samples(csv, log)
    assert not log.remarks
    trials = csv.words.get("trial")
    assert trials is None or log.words["trial"].tolist() == trials.tolist()


def test_a_motion_begins_at_the_time_at_which_the_one_before_it_ended(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    arrays = {"theta": np.array([[0.1, 0.2], [0.3, 0.4]]), "time": np.array([[0.0, 0.5], [0.5, 1.0]])}
    with start_run("compare", load_study(), "", tmp_path) as live:
        live.arrays("data/trajectories.npz", arrays)
    (file,) = files_of_recording(export_run(Run(live.path), "lerobot", tmp_path / "set"))
    trials = read_log(file).trials()
    assert [trial.columns["bend_y"].tolist() for trial in trials.values()] == [[0.1, 0.2], [0.3, 0.4]]
    assert [trial.columns["time"].tolist() for trial in trials.values()] == [[0.0, 0.5], [0.5, 1.0]]


def test_random_motions_of_gen_data_are_episodes_and_samples_without_time_are_refused(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    bend = np.arange(24.0).reshape(2, 6, 2)
    arrays = {"bend": bend, "rate": 10.0 * bend, "torque": -bend, "period": np.array(0.005)}
    with start_run("gen-data", load_study(), "", tmp_path) as live:
        live.arrays("data/samples.npz", arrays)
    folder = export_run(Run(live.path), "lerobot", tmp_path / "set")
    features = json.loads((folder / "meta" / "info.json").read_text())["features"]
    assert features["observation.state"]["names"] == [
        "bend_y [rad]",
        "bend_z [rad]",
        "rate_y [rad/s]",
        "rate_z [rad/s]",
    ]
    data = parquet(folder, "data")
    np.testing.assert_array_equal(np.stack(data.action.tolist()), -bend.reshape(12, 2))
    np.testing.assert_array_equal(np.stack(data["observed"].tolist())[:, :2], bend.reshape(12, 2))
    with start_run("gen-data", load_study(), "", tmp_path) as live:
        live.arrays("data/samples.npz", {"tip": np.zeros((3, 2)), "theta": np.zeros(3)})
    with pytest.raises(UserError, match="a gen-data run holds no motion") as caught:
        export_run(Run(live.path), "lerobot", tmp_path / "none")
    assert "--source transitions" in caught.value.fix and not (tmp_path / "none").exists()


def test_samples_that_share_a_row_are_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    pytest.importorskip("pyarrow")
    time = np.concatenate([0.01 * np.arange(30), [0.2901, 0.2902]])
    with start_run("simulate", load_study(), "", tmp_path) as live:
        live.table("data/trajectory.csv", {"time": time, "theta": time})
    export_run(Run(live.path), "lerobot", tmp_path / "set")
    assert "2 samples share a row of 1/100 s" in caplog.text


def film_run(folder: Path) -> Run:
    return rig_run(folder, film=True)


def test_pictures_are_a_film_with_one_for_each_row(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    folder = export_run(film_run(tmp_path), "lerobot", tmp_path / "set")
    info = json.loads((folder / "meta" / "info.json").read_text())
    assert info["features"]["observation.images.camera"]["shape"] == [48, 64, 3]
    file = folder / info["video_path"].format(video_key="observation.images.camera", chunk_index=0, file_index=0)
    film, bright = cv2.VideoCapture(str(file)), list[float]()
    assert film.get(cv2.CAP_PROP_FPS) == 100.0
    while (read := film.read())[0]:
        bright.append(float(np.mean(read[1])))
    # the first trial's pictures are dark, the second's light
    assert len(bright) == 40 and max(bright[:20]) < 60.0 < 180.0 < min(bright[20:])
    assert "observation.images.camera_2" not in info["features"]
    episodes = parquet(folder, "meta/episodes")
    assert episodes["videos/observation.images.camera/from_timestamp"].tolist() == [0.0, 0.2]


def test_without_an_encoder_the_film_is_left_out_and_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    pytest.importorskip("pyarrow")
    run = film_run(tmp_path)
    monkeypatch.setattr(cv2.VideoWriter, "fourcc", staticmethod(lambda *letters: 0))
    folder = export_run(run, "lerobot", tmp_path / "set")
    info = json.loads((folder / "meta" / "info.json").read_text())
    assert "observation.images.camera" not in info["features"] and not (folder / "videos").exists()
    assert "the video is left out" in caplog.text


def test_nothing_is_left_of_a_run_that_measured_nothing_or_where_pyarrow_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pyarrow")
    with start_run("simulate", load_study(), "", tmp_path) as live:
        live.table("data/trajectory.csv", {"time": np.empty(0), "theta": np.empty(0)})
    with pytest.raises(UserError, match="ended before anything was measured"):
        export_run(Run(live.path), "lerobot", tmp_path / "set")
    run = simulated(tmp_path)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(UserError, match="need pyarrow") as caught:
        export_run(run, "lerobot", tmp_path / "set")
    assert "wristctl[logs]" in caught.value.fix and not [path for path in tmp_path.iterdir() if "set" in path.name]


@pytest.mark.skipif(not READER, reason="make lerobot-reader")
@pytest.mark.parametrize("made", [film_run, simulated, compared])
def test_lerobots_own_reader_opens_it(made: Any, tmp_path: Path) -> None:
    run = made(tmp_path)
    folder = export_run(run, "lerobot", tmp_path / "set")
    hub = {"HF_HUB_OFFLINE": "1", "HF_HOME": str(tmp_path / "hub"), "PATH": os.environ["PATH"]}
    done = subprocess.run([READER, "-c", READ, str(folder)], capture_output=True, text=True, env=hub, cwd=tmp_path)
    assert done.returncode == 0 and "Unknown fields" not in done.stderr, done.stderr[-2000:]
    found = json.loads(
        next(line for line in done.stdout.splitlines() if line.startswith("FOUND")).removeprefix("FOUND")
    )
    data = parquet(folder, "data")
    for name, rows in found["rows"].items():
        shown = np.array(rows, float).reshape(len(data), -1)
        written = np.stack([np.atleast_1d(value) for value in data[name]]).astype(np.float32)
        np.testing.assert_array_equal(shown.astype(np.float32), written, err_msg=name)
    motions = open_log_of(run).trials()
    assert found["episodes"] == len(motions) and len(set(found["tasks"])) == 1 + (len(motions) > 1)
    if made is film_run:
        assert found["shape"] == [3, 48, 64] and max(found["bright"][:20]) < 0.25 < 0.7 < min(found["bright"][20:])
