"""Lens and bending plane of a camera, from views of the board."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from wristctl.commands.inputs import Inputs
from wristctl.commands.printed_table import Table
from wristctl.commands.procedure import Procedure, no_tendons
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import UserError

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.vision.camera import Frame, Image
    from wristctl.vision.charuco import Album, CameraCalibration
    from wristctl.vision.device_camera import DeviceCamera


log = logging.getLogger(__name__)

# Seconds in which the board must be seen lying in the bending plane.
_PATIENCE = 20.0


def look(session: Session) -> Album:
    """The views. Raises UserError where a source gives no pictures, or shows no board where it must."""
    import numpy as np

    from wristctl.vision.camera import FolderCamera, is_device, open_recording
    from wristctl.vision.charuco import Album
    from wristctl.vision.scene import board_shots

    settings, findings, names = session.study.calibrate_camera, session.findings, []
    frames: Iterable[Frame]
    source = str(settings.camera)
    live = settings.camera is not None and is_device(source)
    if settings.camera is None:
        log.info("no camera named, so views are rendered (--camera 0, a video, or a folder)")
        rng = np.random.default_rng(findings.stream("board shots"))
        album, names = Album(settings.board), [str(k) for k in range(settings.views)]
        frames = board_shots(settings.scene, settings.board, settings.views, rng)
    elif live:
        album = Album(settings.board, settings.views)
        frames = _live(session, album)
    else:
        frames = open_recording(source)
        names = [file.name for file in frames.files] if isinstance(frames, FolderCamera) else []
        album = Album(settings.board, None if names else settings.views)
    name = ""
    with session.progress("views", None if not names else len(names)) as advance:
        for frame in frames:
            name = names[frame.number] if names else f"frame {frame.number}"
            if album.look(frame, name) and live:  # nothing else has these pictures
                _keep(findings.file(f"data/views/{len(album.views):03}.png"), frame.image)
            advance(frame.number + 1, views=len(album.views))
    if album.last is None or album.last_picture is None:
        fix = "show it sharp, well lit and whole; is it the board of hw calibrate board-pdf (calibrate-camera.board)?"
        raise UserError(f"no board in {album.pictures} pictures", source, fix, exit_code=3)
    if names and settings.in_plane and album.last.name != name:
        problem = "the last picture does not show the board, which should lie in the bending plane there"
        raise UserError(problem, name, "add such a picture, or go without: --set in_plane=false", exit_code=3)
    if live and settings.in_plane:
        _keep(findings.file("data/views/plane.png"), album.last_picture)
    return album


def _keep(file: Path | None, picture: Image) -> None:
    import cv2

    if file is not None:
        cv2.imwrite(str(file), picture)


def _live(session: Session, album: Album) -> Iterator[Frame]:
    """Frames of a device until the album is full; then until the board is seen in the bending plane."""
    from wristctl.vision.charuco import least_seen
    from wristctl.vision.device_camera import DeviceCamera

    settings = session.study.calibrate_camera
    camera = DeviceCamera(str(settings.camera), settings.device)
    try:
        log.info("show the board: near, in all parts of the picture, tilted 20 to 40 deg")
        taken = 0
        while len(album.views) < settings.views:
            yield from _newest(camera)
            if len(album.views) > taken:
                taken = len(album.views)
                log.info("view %d of %d; least seen yet: %s", taken, settings.views, least_seen(album.seen))
        if settings.in_plane:
            session.operator.wait_for("Lay the board in the bending plane, then press Enter")
            camera.newest()
            album.last, end = None, time.monotonic() + _PATIENCE
            while album.last is None and time.monotonic() < end:
                yield from _newest(camera)
    finally:
        camera.close()


def _newest(camera: DeviceCamera) -> Iterator[Frame]:
    frame = camera.newest()
    if frame is None:
        time.sleep(0.005)
    else:
        yield frame


_LENS = (("fx", "px"), ("fy", "px"), ("cx", "px"), ("cy", "px"), ("k1", ""), ("k2", ""), ("p1", ""), ("p2", ""))
_MEANING = {
    "view": "which picture",
    "corner": "number on the board",
    "x": "where it was seen, from the left",
    "y": "where it was seen, from above",
    "off_x": "seen less expected",
    "off_y": "seen less expected",
}


@dataclass(frozen=True, repr=False, eq=False)
class CameraCalibrated(StudyResult):
    """A camera's lens and its place before the bending plane."""

    kind = "calibrate-camera"

    album: Album
    calibration: CameraCalibration

    def frame(self) -> pd.DataFrame:
        """One row per corner of the board in a view: where it was seen, and how far off [px]."""
        return _corners(self.album, self.calibration)


def plan(study: Study, inputs: Inputs) -> str:
    """Plan of a calibration: the source of its views."""
    settings = study.calibrate_camera
    source = "rendered pictures (no camera is named)" if settings.camera is None else settings.camera
    last = "; the last view is the board in the bending plane" if settings.in_plane else ""
    return f"views of a {settings.board.columns} x {settings.board.rows} board from {source}{last}"


def calibrate_camera(session: Session) -> CameraCalibrated:
    """Find lens and bending plane from views of the printed board (hw calibrate board-pdf).

    Show the board in 20 views: near, in all parts of the picture, tilted by 20 to 40 deg to all sides. In the last view
    it lies flat in the plane in which the wrist bends.
    """
    import cv2
    import numpy as np

    from wristctl.commands.calibrate.figures import lens, plane, reprojection
    from wristctl.vision.charuco import calibrate, plane_tilt
    from wristctl.vision.view import FILE, Pinhole

    cv2.setNumThreads(1)
    findings, settings = session.findings, session.study.calibrate_camera
    album = look(session)
    lying = album.last if settings.in_plane else None
    calibration = calibrate(album.views, lying, album.size or (1, 1), settings)
    tilt = plane_tilt(calibration.view) if lying is not None else math.nan

    units = dict.fromkeys(("x", "y", "off_x", "off_y"), "px")
    findings.table("data/corners.csv", _corners(album, calibration), units, _MEANING)
    deviation = dict(zip((name for name, _ in _LENS), calibration.deviation.tolist(), strict=True))
    quality = {"reprojection_px": calibration.error, "views": len(album.views), "coverage": calibration.coverage}
    if file := findings.file(FILE):
        calibration.view.save(file, deviation=deviation, in_plane=settings.in_plane, **quality)
    findings.metric(
        "reprojection", calibration.error, "px", "lower", len(album.views), meaning="RMS of corners less expected"
    )
    findings.metric(
        "coverage", calibration.coverage, "", "higher", meaning="share of the picture in which corners were seen"
    )
    if lying is not None:
        findings.metric("tilt", math.degrees(tilt), "deg", meaning="camera's axis to the bending plane's normal")
        meaning = "RMS distance of the corners in the plane from where the homography puts them"
        findings.metric(
            "plane_error", 1e6 * calibration.plane_error, "um", "lower", len(lying.corners), meaning=meaning
        )
    with session.drawing():
        findings.figure("reprojection", reprojection, calibration, album.views)
        findings.figure("lens", lens, calibration.view)
        if lying is not None and album.last_picture is not None:
            findings.figure("plane", plane, album.last_picture, lying, calibration.view)
    values = [*(calibration.view.camera_matrix[[0, 1, 0, 1], [0, 1, 2, 2]]), *calibration.view.distortion]
    names = [f"{name} [{unit}]" if unit else name for name, unit in _LENS]
    rows: list[tuple[object, ...]] = list(zip(names, map(float, values), calibration.deviation.tolist(), strict=True))
    if settings.camera is None:
        camera = Pinhole(settings.scene, "right")
        truth = [*camera.matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist(), *camera.distortion.tolist()]
        rows = [(*row, true) for row, true in zip(rows, truth, strict=True)]
    summary = [
        ("views", len(album.views)),
        ("pictures", album.pictures),
        ("reprojection error [px]", calibration.error),
        ("coverage", calibration.coverage),
        ("largest tilt of a view [deg]", float(np.degrees(calibration.tilts.max()))),
    ]
    if lying is not None:
        summary += [("tilt of the camera to the bending plane [deg]", math.degrees(tilt))]
    columns = ("lens", "value", "standard deviation", *(("rendered with",) if settings.camera is None else ()))
    tables = [Table("Views", ("what", "value"), summary), Table("Lens", columns, rows)]
    return CameraCalibrated(session.study, findings, tables, album, calibration)


def _corners(album: Album, calibration: CameraCalibration) -> pd.DataFrame:
    import numpy as np
    import pandas as pd

    names = np.repeat([view.name for view in album.views], [len(view.corners) for view in album.views])
    corners, off = np.concatenate([view.corners for view in album.views]), np.concatenate(calibration.residuals)
    numbers = np.concatenate([view.numbers for view in album.views])
    columns = (names, numbers, *corners.T, *off.T)
    return pd.DataFrame(dict(zip(_MEANING, columns, strict=True)))


CALIBRATE_CAMERA = Procedure("calibrate-camera", plan, calibrate_camera, in_one_plane=no_tendons)
