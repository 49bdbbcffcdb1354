"""`hw calibrate` and `track` as a user meets them: a camera calibrated, a recording tracked with it."""

from __future__ import annotations

import contextlib
import json
import math
import os
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from wristctl.cli.operator import TerminalOperator
from wristctl.cli.progress import Terminal
from wristctl.commands.calibrate.camera import look
from wristctl.config.camera import CalibrateCameraSettings, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.records import Run, open_run
from wristctl.study_files.keys import command_of
from wristctl.vision.camera import FolderCamera, Frame
from wristctl.vision.scene import Scene, board_shots

THOROUGH = os.environ.get("WRISTCTL_THOROUGH")
Call = Callable[..., tuple[int, str, str]]

POSE = {"tilt_deg": 10.0, "pan_deg": 4.0}
COVERED = range(12, 16)


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """24 pictures of a move to 20 deg, the tip's marker covered in four of them."""
    scene, rng = Scene(SceneSettings.model_validate(POSE), WristParameters()), np.random.default_rng(0)
    folder = tmp_path / "pictures"
    folder.mkdir()
    for k in range(24):
        bent = np.full((1, 4), math.radians(min(k, 20)) / 4)
        cv2.imwrite(str(folder / f"{k}.png"), scene.render(bent, rng, covered=k in COVERED))
    return folder


@pytest.mark.painted
@pytest.mark.slow
def test_a_recording_is_tracked_with_a_calibration(call: Call, recording: Path) -> None:
    pose = [part for name, value in POSE.items() for part in ("--set", f"scene.{name}={value}")]
    code, out, err = call("hw", "calibrate", "camera", "--views", "8", *pose)
    assert code == 0 and "views are rendered" in err
    camera = Run(Path(out.splitlines()[-1]))
    assert camera.kind == "calibrate-camera" and camera.metrics["tilt"]["value"] == pytest.approx(10.8, abs=0.5)
    assert {"reprojection.png", "lens.png", "plane.png"} <= {file.name for file in (camera.path / "figures").iterdir()}

    options = ("--calibration", camera.id, "--set", "frame_rate=60.0", "--annotate")
    code, out, err = call("track", str(recording), *options)
    assert code == 0, err
    run = Run(Path(out.splitlines()[-1]))
    found = run.data("track")
    assert list(found["verdict"]) == ["no tip" if k in COVERED else "ok" for k in range(24)]
    assert np.isnan(found["theta"]).sum() == len(COVERED)
    off = np.degrees(found["theta"]) - np.minimum(np.arange(24), 20)
    assert np.abs(off).max() < 0.4 and found["time"][6] == pytest.approx(0.1)
    assert run.metrics["usable"]["value"] == pytest.approx(20 / 24) and run.metrics["askew"]["value"] < 0.3
    assert [each.run for each in run.manifest.inputs] == [camera.id]
    assert run.manifest.inputs[0].result_sha256 == camera.result_hash
    film = cv2.VideoCapture(str(run.file("data/annotated.avi")))
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == 24 and film.get(cv2.CAP_PROP_FPS) == pytest.approx(60.0)

    for each in (camera, run):
        again = command_of(each.kind).split()
        assert f"wristctl {' '.join(again)} --config {each.id}/config.yaml" in (each.path / "README.md").read_text()
        if THOROUGH:
            code, out, err = call(*again, "--config", str(each.path / "config.yaml"))
            assert code == 0 and Run(Path(out.splitlines()[-1])).result_hash == each.result_hash


@pytest.mark.slow
def test_without_a_calibration_a_tilted_camera_is_warned_of(call: Call, recording: Path) -> None:
    code, out, err = call("track", str(recording), "--zero", "first", "--json")
    assert code == 0
    assert "warning: angles may be up to" in err and "--calibration" in err
    run = open_run(json.loads(out)["run"])
    assert run.data("track")["theta"][0] == 0.0


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["track", "none.mp4"], 4, "no such video - none.mp4 - fix: "),
        (["track", "notes.txt"], 4, "no video that can be decoded"),
        (["track", "."], 4, "no pictures in this folder"),
        (["track"], 2, "track needs a video - track.video - fix: "),
        (["track", "notes.txt", "--calibration", "latest:calibrate-camera"], 2, "`wristctl hw calibrate camera` first"),
        (["hw", "calibrate", "camera", "--camera", "93"], 4, "no such camera"),
        (["hw", "calibrate", "camera", "--views", "3"], 2, "3 should be greater than or equal to 8"),
        (["hw", "calibrate", "board-pdf", "--set", "board={square: 0.05, marker: 0.03}"], 2, "does not fit on a4"),
        (["hw", "calibrate", "board-pdf", "no/such/folder.pdf"], 2, "cannot write: No such file"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(call: Call, arguments: list[str], code: int, said: str) -> None:
    Path("notes.txt").write_text("no video")
    ended, out, err = call(*arguments)
    last = err.splitlines()[-1]
    assert ended == code and said in last and last.startswith("error: ") and out == ""


def test_a_recording_without_markers_fails_and_keeps_what_was_seen(call: Call, tmp_path: Path) -> None:
    folder = tmp_path / "empty"
    folder.mkdir()
    cv2.imwrite(str(folder / "0.png"), np.full((120, 160), 128, np.uint8))
    code, _, err = call("track", str(folder))
    assert code == 3 and "no frame can be used: no tip in 1 of 1" in err
    (run,) = (Run(path) for path in Path("results").iterdir())
    assert run.state == "failed" and len(run.data("track")) == 1


@pytest.mark.slow
def test_the_board_is_written_where_asked(call: Call, tmp_path: Path) -> None:
    code, out, err = call("hw", "calibrate", "board-pdf", "sheet.pdf", "--paper", "letter")
    assert code == 0 and out == "sheet.pdf\n" and "100 %" in err
    assert (tmp_path / "sheet.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.slow
def test_views_from_a_device_are_taken_kept_and_ended_with_the_plane(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = CalibrateCameraSettings(camera=0, views=8, scene=SceneSettings(noise=1.0))
    shots = list(board_shots(settings.scene, settings.board, 9, np.random.default_rng(0)))
    asked: list[str] = []

    class Webcam:
        """Gives each view twice, with pauses; the last one, in the plane, only once it was asked for."""

        def __init__(self, source: str, _settings: object) -> None:
            assert source == "0"
            self.coming = [shots[0], None, *(shot for shot in shots[:-1] for _ in range(2))]
            self.closed = False
            cameras.append(self)

        def newest(self) -> Frame | None:
            if asked:
                return shots[-1]
            return self.coming.pop(0)

        def close(self) -> None:
            self.closed = True

    def file(name: str) -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    cameras: list[Webcam] = []
    monkeypatch.setattr("wristctl.vision.device_camera.DeviceCamera", Webcam)
    monkeypatch.setattr("typer.prompt", lambda said, **_: asked.append(said))
    progress = contextlib.nullcontext(lambda *_, **__: None)
    session: Any = SimpleNamespace(
        study=SimpleNamespace(calibrate_camera=settings), findings=SimpleNamespace(file=file),
        progress=lambda *_: progress, operator=TerminalOperator(Terminal(), False, frozenset()),
    )  # fmt: skip
    album = look(session)
    assert len(album.views) == 8 and cameras[0].closed
    assert asked == ["Lay the board in the bending plane, then press Enter"]
    assert album.last_picture is not None and np.array_equal(album.last_picture, shots[-1].image)
    names = sorted(each.name for each in (tmp_path / "data" / "views").iterdir())
    assert names == [*(f"{k:03}.png" for k in range(1, 9)), "plane.png"]
    again = [frame.image for frame in FolderCamera(tmp_path / "data" / "views")]
    assert len(again) == 9 and np.array_equal(again[-1], shots[-1].image)
