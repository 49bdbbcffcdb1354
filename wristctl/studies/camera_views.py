"""Views of the calibration board: rendered, recorded, or taken from a camera now."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from wristctl.config.errors import UserError
from wristctl.studies.session import Session

if TYPE_CHECKING:
    from wristctl.vision.camera import Frame, Image
    from wristctl.vision.charuco import Album
    from wristctl.vision.device_camera import DeviceCamera

log = logging.getLogger(__name__)

_PATIENCE = 20.0
"""Seconds in which the board must be seen lying in the bending plane."""


def look(session: Session) -> Album:
    """The views. Raises UserError where a source gives no pictures, or shows no board where it must."""
    from wristctl.vision.camera import FolderCamera, is_device, open_recording
    from wristctl.vision.charuco import Album

    settings, findings, names = session.study.calibrate_camera, session.findings, []
    frames: Iterable[Frame]
    source = str(settings.camera)
    live = settings.camera is not None and is_device(source)
    if settings.camera is None:
        log.info("no camera named, so views are rendered (--camera 0, a video, or a folder)")
        album, names, frames = Album(settings.board), [str(k) for k in range(settings.views)], _rendered(session)
    elif live:
        album = Album(settings.board, settings.views)
        frames = _live(session, album)
    else:
        frames = open_recording(source)
        names = [file.name for file in frames.files] if isinstance(frames, FolderCamera) else []
        album = Album(settings.board, None if names else settings.views)
    name = ""
    with session.progress("views", None if not names else len(names)) as done:
        for frame in frames:
            name = names[frame.number] if names else f"frame {frame.number}"
            if album.look(frame, name) and live:  # nothing else has these pictures
                _keep(findings.file(f"data/views/{len(album.views):03}.png"), frame.image)
            done(frame.number + 1, views=len(album.views))
    if album.last is None or album.last_picture is None:
        fix = "show it sharp, well lit and whole; is it the board of hw calibrate board-pdf (calibrate-camera.board)?"
        raise UserError(f"no board in {album.pictures} pictures", source, fix, exit_code=3)
    if names and settings.in_plane and album.last.name != name:
        what = "the last picture does not show the board, which should lie in the bending plane there"
        raise UserError(what, name, "add such a picture, or go without: --set in_plane=false", exit_code=3)
    if live and settings.in_plane:
        _keep(findings.file("data/views/plane.png"), album.last_picture)
    return album


def _keep(file: Path | None, picture: Image) -> None:
    import cv2

    if file is not None:
        cv2.imwrite(str(file), picture)


def _rendered(session: Session) -> Iterator[Frame]:
    import numpy as np

    from wristctl.vision.board_shots import board_shots

    settings = session.study.calibrate_camera
    rng = np.random.default_rng(session.findings.stream("board shots"))
    return board_shots(settings.scene, settings.board, settings.views, rng)


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
