"""Lens and bending plane of a camera, from views of the board."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from wristctl.config.study import Study
from wristctl.config.vision import CalibrateCameraSettings
from wristctl.report.printed_table import Table
from wristctl.studies.camera_views import look
from wristctl.studies.inputs import Inputs
from wristctl.studies.procedure import Procedure
from wristctl.studies.session import Session
from wristctl.studies.study_result import StudyResult

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.vision.charuco import Album, CameraCalibration

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
    """Where the views come from."""
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

    from wristctl.report.camera_figures import lens, plane, reprojection
    from wristctl.vision.charuco import calibrate, plane_tilt
    from wristctl.vision.view import FILE

    cv2.setNumThreads(1)
    findings, settings = session.findings, session.study.calibrate_camera
    album = look(session)
    lying = album.last if settings.in_plane else None
    found = calibrate(album.views, lying, album.size or (1, 1), settings)
    tilt = plane_tilt(found.view) if lying is not None else math.nan

    units = dict.fromkeys(("x", "y", "off_x", "off_y"), "px")
    findings.table("data/corners.csv", _corners(album, found), units, _MEANING)
    deviation = dict(zip((name for name, _ in _LENS), found.deviation.tolist(), strict=True))
    known = {"reprojection_px": found.error, "views": len(album.views), "coverage": found.coverage}
    if file := findings.file(FILE):
        found.view.save(file, deviation=deviation, in_plane=settings.in_plane, **known)
    findings.metric(
        "reprojection", found.error, "px", "lower", len(album.views), meaning="RMS of corners less expected"
    )
    findings.metric("coverage", found.coverage, "", "higher", meaning="share of the picture in which corners were seen")
    if lying is not None:
        findings.metric("tilt", math.degrees(tilt), "deg", meaning="camera's axis to the bending plane's normal")
        meaning = "RMS distance of the corners in the plane from where the homography puts them"
        findings.metric("plane_error", 1e6 * found.plane_error, "um", "lower", len(lying.corners), meaning=meaning)
    with session.progress("drawing"):
        findings.figure("reprojection", reprojection, found, album.views)
        findings.figure("lens", lens, found.view)
        if lying is not None and album.last_picture is not None:
            findings.figure("plane", plane, album.last_picture, lying, found.view)
    values = [*(found.view.camera_matrix[[0, 1, 0, 1], [0, 1, 2, 2]]), *found.view.distortion]
    names = [f"{name} [{unit}]" if unit else name for name, unit in _LENS]
    rows: list[tuple[object, ...]] = list(zip(names, map(float, values), found.deviation.tolist(), strict=True))
    if settings.camera is None:
        rows = [(*row, true) for row, true in zip(rows, _true_lens(settings), strict=True)]
    seen = [
        ("views", len(album.views)),
        ("pictures", album.pictures),
        ("reprojection error [px]", found.error),
        ("coverage", found.coverage),
        ("largest tilt of a view [deg]", float(np.degrees(found.tilts.max()))),
    ]
    if lying is not None:
        seen += [("tilt of the camera to the bending plane [deg]", math.degrees(tilt))]
    columns = ("lens", "value", "standard deviation", *(("rendered with",) if settings.camera is None else ()))
    tables = [Table("Views", ("what", "value"), seen), Table("Lens", columns, rows)]
    return CameraCalibrated(session.study, findings, tables, album, found)


def _corners(album: Album, found: CameraCalibration) -> pd.DataFrame:
    import numpy as np
    import pandas as pd

    names = np.repeat([view.name for view in album.views], [len(view.corners) for view in album.views])
    corners, off = np.concatenate([view.corners for view in album.views]), np.concatenate(found.residuals)
    numbers = np.concatenate([view.numbers for view in album.views])
    columns = (names, numbers, *corners.T, *off.T)
    return pd.DataFrame(dict(zip(_MEANING, columns, strict=True)))


def _true_lens(settings: CalibrateCameraSettings) -> list[float]:
    """What rendered views were rendered with, in the order of _LENS."""
    from wristctl.vision.pinhole import Pinhole

    camera = Pinhole(settings.scene, "right")
    return [*camera.matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist(), *camera.distortion.tolist()]


CALIBRATE_CAMERA = Procedure("calibrate-camera", plan, calibrate_camera)
