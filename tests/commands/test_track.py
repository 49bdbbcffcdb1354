"""What a recording's sightings come to: angles in deg, noise, how askew the base is, and why frames were not used."""

from __future__ import annotations

import hashlib
import json
import logging
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
import pytest

import wristctl
from tests.commands.conftest import columns_of, known_of, session
from wristctl.arrays import Array
from wristctl.commands.export.run_data import open_log_of
from wristctl.commands.inputs import Inputs
from wristctl.commands.track.command import TRACK, Tracked
from wristctl.config.camera import Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.records import Run, start_run
from wristctl.vision import marker
from wristctl.vision.camera import Frame
from wristctl.vision.marker import MEANING, Sighting, SightingVerdict
from wristctl.vision.recordings import RawVideo
from wristctl.vision.scene import Scene

DEGREES = (10.0, 30.0, 20.0, 25.0, None, 40.0, None, None)
"""Seen in each frame; None where no tip is."""
Follow = Callable[..., Tracked]


def sighting(number: int, degrees: float | None, askew: float = 0.0) -> Sighting:
    """A base so much off square [deg], and a tip's marker whose corners are numbered."""
    half = 20.0 * np.array([1.0 + math.sin(math.radians(askew)), 1.0 - math.sin(math.radians(askew))])
    base = half * [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    theta, verdict = (math.nan, SightingVerdict.NO_TIP) if degrees is None else (math.radians(degrees), "ok")
    tip = 100.0 * number + np.arange(8.0).reshape(4, 2)
    return Sighting(0.25 * number, number, theta, SightingVerdict(verdict), np.stack([base, tip]))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Eight grey pictures of 24 x 16."""
    made = tmp_path / "pictures"
    made.mkdir()
    for number in range(len(DEGREES)):
        cv2.imwrite(str(made / f"{number}.png"), np.full((16, 24), 100 + number, np.uint8))
    return made


@pytest.fixture
def follow(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Follow:
    """The folder tracked by a tracker that sees these angles, less its zero."""

    class Told:
        def __init__(self, markers: Any, view: Any, gates: Any, plane: Any = None) -> None:
            assert (markers.base, view.size, gates, plane) == (0, None, study().track.gates, None)
            self.zero = 0.0

        def see(self, frame: Any) -> Sighting:
            seen = sighting(frame.number, Told.degrees[frame.number], Told.askew)
            return seen._replace(theta=seen.theta - self.zero)

        degrees: Sequence[float | None] = DEGREES
        askew = 0.0

    def study(*settings: str) -> wristctl.Study:
        return wristctl.load_study(None, f"track.video={folder}", "track.frame_rate=4", *settings)

    def followed(*settings: str, run: Any = None, degrees: Sequence[float | None] = DEGREES, askew: float = 0.0) -> Any:
        Told.degrees, Told.askew = degrees, askew
        return TRACK.perform(session(study(*settings), run))

    monkeypatch.setattr(marker, "Tracker", Told)
    return followed


def test_angles_are_told_in_degrees_with_the_share_of_frames_that_have_one(follow: Follow) -> None:
    done = follow()
    noise = math.sqrt((30.0**2 + 15.0**2) / 2.0 / 6.0)  # second differences of 10, 30, 20, 25
    expected = {"usable": 5 / 8, "theta_min": 10.0, "theta_max": 40.0, "noise": noise, "askew": 0.0}
    assert done.metrics == pytest.approx(expected, abs=1e-9)
    assert known_of(done.findings, *expected) == [
        ("", "higher", 8), ("deg", "", 5), ("deg", "", 5), ("deg", "lower", 5), ("deg", "lower", 5),
    ]  # fmt: skip
    summary, verdicts = done.tables
    assert summary.title == "pictures" and summary.columns == ("what", "value")
    assert [name for name, _ in summary.rows] == [
        "frames", "frames per second", "usable", "least angle [deg]", "greatest angle [deg]", "noise [deg]",
        "askew [deg]",
    ]  # fmt: skip
    assert [value for _, value in summary.rows] == pytest.approx([8, 4.0, 5 / 8, 10.0, 40.0, noise, 0.0], abs=1e-9)
    assert verdicts.rows == [
        ("ok", 5, 5 / 8, MEANING[SightingVerdict.OK]),
        ("no tip", 3, 3 / 8, MEANING[SightingVerdict.NO_TIP]),
    ]
    assert verdicts.columns == ("verdict", "frames", "share", "meaning")
    assert cv2.getNumThreads() == 1


def test_a_row_of_the_table_is_a_frame_with_both_markers_corners(follow: Follow) -> None:
    table = follow().frame()
    np.testing.assert_allclose(table["time"], 0.25 * np.arange(8))
    np.testing.assert_allclose(np.degrees(table["theta"]), [np.nan if each is None else each for each in DEGREES])
    assert list(table["verdict"]) == ["ok"] * 4 + ["no tip", "ok", "no tip", "no tip"]
    corners = [f"{marker}_{axis}{k}" for marker in ("base", "tip") for k in (1, 2, 3, 4) for axis in "xy"]
    assert list(table.columns) == ["time", "number", "theta", "tip_x", "tip_y", "verdict", *corners]
    np.testing.assert_allclose(table.loc[2, "base_x1":"base_y4"].astype(float), [-20, -20, 20, -20, 20, 20, -20, 20])
    np.testing.assert_allclose(table.loc[2, "tip_x1":"tip_y4"].astype(float), 200.0 + np.arange(8.0))


def test_the_first_angle_that_is_seen_can_count_as_zero(follow: Follow) -> None:
    degrees = (None, 10.0, None, 30.0, 5.0, 10.0, 10.0, 10.0)
    found = np.degrees(follow("track.zero=first", degrees=degrees).frame()["theta"])
    np.testing.assert_allclose(found, [np.nan, 0.0, np.nan, 20.0, -5.0, 0.0, 0.0, 0.0], atol=1e-9)


@pytest.mark.parametrize(("askew", "warned"), [(0.2, False), (0.4, True)])
def test_a_base_that_looks_askew_is_warned_of(
    follow: Follow, caplog: pytest.LogCaptureFixture, askew: float, warned: bool
) -> None:
    done = follow(askew=askew)
    assert done.metrics["askew"] == pytest.approx(askew)
    assert [record.levelno for record in caplog.records] == [logging.WARNING] * warned
    assert caplog.text.count(f"up to {askew:.1f} deg off") == warned


def test_where_no_frame_can_be_used_the_commonest_reason_is_told(follow: Follow) -> None:
    with pytest.raises(UserError) as caught:
        follow(degrees=[None] * 8)
    assert caught.value.what == f"no frame can be used: no tip in 8 of 8: {MEANING[SightingVerdict.NO_TIP]}"
    assert caught.value.exit_code == 3 and "figures/frames.png" in caught.value.fix


@pytest.mark.parametrize("annotate", [False, True])
def test_a_run_keeps_frames_pictures_and_what_was_recorded(
    follow: Follow, folder: Path, tmp_path: Path, annotate: bool
) -> None:
    with start_run("track", wristctl.load_study(None), "", tmp_path) as live:
        done = follow(f"track.annotate={str(annotate).lower()}", run=live)
    run = Run(live.path)
    assert list(done.figures) == ["angle", "frames"]
    np.testing.assert_allclose(run.data("track")["theta"], done.frame()["theta"])
    units = columns_of(run, "data/track.csv")
    assert units["time"] == ("s", "of the frame in the recording") and units["theta"][0] == "rad"
    assert units["tip_y4"] == units["base_x1"] == ("px", "marker's corner, from its top left clockwise")
    digests = {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in folder.iterdir()}
    listed = "".join(f"{digest}  {name}\n" for name, digest in sorted(digests.items()))
    recording = json.loads(run.file("data/recording.json").read_text())
    expected = {"name": str(folder), "sha256": hashlib.sha256(listed.encode()).hexdigest(), "frames": 8}
    assert recording == expected
    film = run.path / "data/annotated.avi"
    assert film.is_file() == annotate
    if annotate:
        capture = cv2.VideoCapture(str(film))
        assert capture.get(cv2.CAP_PROP_FRAME_COUNT) == 8 and capture.get(cv2.CAP_PROP_FPS) == pytest.approx(4.0)
        capture.release()


def test_a_plan_names_the_recording_its_size_and_that_there_is_no_calibration(folder: Path, tmp_path: Path) -> None:
    study = wristctl.load_study(None, f"track.video={folder}")
    square = "; no calibration: the camera is taken to stand square to the plane"
    assert TRACK.plan(study, Inputs()) == f"{folder}: 24 x 16{square}"
    with start_run("calibrate-camera", study, "", tmp_path) as live:
        pass
    assert TRACK.plan(study, Inputs({"calibration": Run(live.path)})) == f"{folder}: 24 x 16"
    with pytest.raises(UserError, match="track needs a video"):
        TRACK.plan(wristctl.load_study(None), Inputs())
    assert all(need.optional and need.kind == "calibrate-camera" for need in TRACK.needs) and len(TRACK.needs) == 2


def filmed(folder: Path, plane: Literal[0, 1], bends: Sequence[tuple[float, float]], at: Array) -> Path:
    """A video of arcs with these bends [rad] as the camera of a plane sees them, and the table of its times beside."""
    markers = Markers(base=2 * plane, tip=2 * plane + 1)
    scene, rng = Scene(SceneSettings(), WristParameters(), markers, plane=plane), np.random.default_rng(plane)
    video = RawVideo(folder / f"raw{'_2' if plane else ''}.avi", 30.0)
    for number, (bend, time) in enumerate(zip(bends, at, strict=True)):
        frame = Frame(scene.render(np.tile(np.array(bend) / 4.0, 4), rng), float(time), number)
        video.add(frame, sighting(number, None))
    video.close()
    return folder / f"raw{'_2' if plane else ''}.avi"


@pytest.mark.slow
def test_two_recordings_tell_the_bends_of_both_planes(tmp_path: Path) -> None:
    """The second camera starts 0.1 s late and looks half a frame later, which the tables beside the videos tell."""
    times = np.arange(24) / 30.0

    def bend(at: float) -> tuple[float, float]:
        turn = 2.0 * math.pi * at
        return 0.5 * math.cos(turn), 0.5 * math.sin(turn)

    late = times[3:] + 0.5 / 30.0
    videos = [
        filmed(tmp_path, 0, [*map(bend, times)], 7.0 + times),
        filmed(tmp_path, 1, [*map(bend, late)], 7.0 + late),
    ]
    views = []
    for plane in (0, 1):
        with start_run("calibrate-camera", wristctl.load_study(None), "", tmp_path) as live:
            Scene(SceneSettings(), WristParameters(), plane=plane).view.save(live.file("data/camera.json"))
        views.append(Run(live.path))
    study = wristctl.load_study(None, f"track.video={videos[0]}", f"track.video_2={videos[1]}")
    inputs = Inputs({"calibration": views[0], "calibration_2": views[1]})
    assert TRACK.plan(study, inputs).startswith("two planes: ")
    with start_run("track", study, "", tmp_path / "results") as live:
        done = TRACK.perform(session(study, live, inputs=inputs))
    table = done.frame()
    assert (np.diff(table["time"]) >= 0.0).all() and set(table["verdict"]) == {"ok"}
    for plane, name in enumerate(("ulnar", "flexion")):
        seen = table[table["plane"] == name]
        true = np.array([bend(at)[plane] for at in seen["time"]])
        whole = np.isfinite(seen["bend"])
        assert whole.sum() >= 20 and np.degrees(np.abs(seen["bend"] - true)[whole]).max() < 0.2
        assert done.metrics[f"{name}_max"] == pytest.approx(np.degrees(seen["bend"].max()), rel=1e-12)
    assert np.degrees(np.abs(table["bend"] - table["theta"])).max() > 1.0, "one camera alone is off"
    one_alone = (table["time"] < late[0] - 1e-9) | (table["time"] > times[-1] + 1e-9)
    assert table["bend"].isna().to_list() == one_alone.to_list()
    log = open_log_of(Run(live.path)).columns
    for column, name in (("bend_y", "ulnar"), ("bend_z", "flexion")):
        seen = table[table["plane"] == name]
        np.testing.assert_array_equal(log[column][np.isfinite(log[column])], seen["bend"].dropna())


def test_a_second_camera_is_asked_for_with_its_recording(folder: Path) -> None:
    def planned(*settings: str) -> None:
        TRACK.plan(wristctl.load_study(None, f"track.video={folder}", *settings), Inputs())

    with pytest.raises(UserError, match=r"no second camera - track\.markers_2"):
        planned("track.markers_2={base: 4, tip: 5}")
    with pytest.raises(UserError, match=r"both cameras look for a marker of one id - track\.markers_2"):
        planned(f"track.video_2={folder}", "track.markers_2={base: 1, tip: 3}")
