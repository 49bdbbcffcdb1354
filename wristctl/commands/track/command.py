"""The wrist's angle in a recorded video, without any board."""

from __future__ import annotations

import logging
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from wristctl.commands.inputs import EarlierRun, Inputs
from wristctl.commands.printed_table import Table
from wristctl.commands.procedure import Procedure, no_tendons
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import UserError

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from wristctl.vision.marker import Sighting
    from wristctl.vision.view import View

log = logging.getLogger(__name__)

# Skew from which the user is warned [deg]; noise of the corners alone is below 0.1.
_ASKEW = 0.3
_CORNERS = [f"{marker}_{axis}{k}" for marker in ("base", "tip") for k in (1, 2, 3, 4) for axis in "xy"]
_UNITS = {"time": "s", "theta": "rad", "tip_x": "m", "tip_y": "m"} | dict.fromkeys(_CORNERS, "px")
_MEANING = {
    "time": "of the frame in the recording",
    "number": "of the frame",
    "theta": "bending angle, empty where the frame cannot be used",
    "tip_x": "tip from the first disc along the base's marker; track.markers says where that stands",
    "tip_y": "tip across, toward theta > 0",
    "verdict": "ok, or why it cannot be used",
} | dict.fromkeys(_CORNERS, "marker's corner, from its top left clockwise")


@dataclass(frozen=True, repr=False, eq=False)
class Tracked(StudyResult):
    """Sightings of the wrist's markers in each frame of a recording."""

    kind = "track"

    sightings: list[Sighting]

    def frame(self) -> pd.DataFrame:
        """One row per frame of the recording: time [s], angle [rad], verdict, the markers' corners [px]."""
        return _frame(self.sightings)


def plan(study: Study, inputs: Inputs) -> str:
    """Check that the recording can be read, and describe it."""
    from wristctl.vision.camera import open_recording

    if study.track.video is None:
        raise UserError("track needs a video", "track.video", "wristctl track trial.mp4, or a folder of pictures")
    recording = open_recording(study.track.video, study.track.frame_rate)
    first = recording.newest()
    recording.close()
    assert first is not None
    height, width = first.image.shape
    square = "" if "calibration" in inputs else "; no calibration: the camera is taken to stand square to the plane"
    return f"{recording.name}: {width} x {height}{square}"


def track(session: Session) -> Tracked:
    """Find the wrist's angle in each frame of a recorded video, or of a folder of pictures.

    The two printed markers (hw calibrate board-pdf) must be in the picture; no motor board is needed.
    """
    import cv2
    import numpy as np

    from wristctl.commands.track.figures import angle, frames
    from wristctl.vision.marker import MEANING, SightingVerdict
    from wristctl.vision.recordings import angle_noise, base_askew
    from wristctl.vision.view import View

    cv2.setNumThreads(1)
    findings, source = session.findings, str(session.study.track.video)
    view = View.of(session.inputs.runs().get("calibration"))
    sightings, pictures = _see(session, view)
    findings.table("data/track.csv", _frame(sightings), _UNITS, _MEANING)
    recording = {"name": session.study.track.video, "sha256": _digest(Path(source)), "frames": len(sightings)}
    findings.plain("data/recording.json", recording)
    with session.drawing():
        findings.figure("angle", angle, sightings)
        findings.figure("frames", frames, pictures)
    counts = Counter(sighting.verdict for sighting in sightings)
    usable, total = counts[SightingVerdict.OK], len(sightings)
    findings.metric("usable", usable / total, "", "higher", total, meaning="share of frames with an angle")
    thetas = [math.degrees(sighting.theta) for sighting in sightings if sighting.verdict is SightingVerdict.OK]
    if not thetas:
        verdict = counts.most_common(1)[0][0]
        reason = f"no frame can be used: {verdict} in {counts[verdict]} of {total}: {MEANING[verdict]}"
        fix = "see figures/frames.png; are both markers (4x4_50, ids track.markers) uncovered and 40 px or larger?"
        raise UserError(reason, source, fix, exit_code=3)
    noise = angle_noise(np.degrees([sighting.theta for sighting in sightings]))
    findings.metric("theta_min", min(thetas), "deg", n=usable, meaning="least angle")
    findings.metric("theta_max", max(thetas), "deg", n=usable, meaning="greatest angle")
    findings.metric("noise", noise, "deg", "lower", usable, meaning="deviation from steady motion")
    skew = math.degrees(base_askew(view, sightings))
    meaning = "largest error, by the base's marker that is no square"
    findings.metric("askew", skew, "deg", "lower", usable, meaning=meaning)
    if skew > _ASKEW:
        fix = "calibrate the camera where it stands now, and name that run with --calibration"
        log.warning("angles may be up to %.1f deg off, for the base's marker looks askew - fix: %s", skew, fix)
    lasts = sightings[-1].time - sightings[0].time
    rows = [
        ("frames", total),
        ("frames per second", (total - 1) / lasts if lasts else None),
        ("usable", usable / total),
        ("least angle [deg]", min(thetas)),
        ("greatest angle [deg]", max(thetas)),
        ("noise [deg]", noise),
        ("askew [deg]", skew),
    ]
    why = [(str(verdict), count, count / total, MEANING[verdict]) for verdict, count in counts.most_common()]
    columns = ("verdict", "frames", "share", "meaning")
    tables = [Table(Path(source).name, ("what", "value"), rows), Table("Frames by verdict", columns, why)]
    return Tracked(session.study, findings, tables, sightings)


def _see(session: Session, view: View) -> tuple[list[Sighting], list[NDArray[np.uint8]]]:
    """Sightings in each frame of the recording, and annotated pictures of some frames."""
    from wristctl.vision.camera import open_recording
    from wristctl.vision.marker import SightingVerdict, Tracker
    from wristctl.vision.recordings import AnnotatedVideo, Picked

    settings = session.study.track
    tracker = Tracker(settings.markers, view, settings.gates)
    recording = open_recording(str(settings.video), settings.frame_rate)
    video = session.findings.file("data/annotated.avi") if settings.annotate else None
    film = AnnotatedVideo(video, recording.frame_rate) if video else None
    sightings, picked, zero = [], Picked(), settings.zero == "first"
    try:
        with session.progress("frames") as report:
            for frame in recording:
                sighting = tracker.see(frame)
                if zero and sighting.verdict is SightingVerdict.OK:
                    tracker.zero, zero, sighting = sighting.theta, False, sighting._replace(theta=0.0)
                sightings.append(sighting)
                picked.offer(frame, sighting)
                if film is not None:
                    film.add(frame, sighting)
                report(len(sightings))
    finally:
        recording.close()
        if film is not None:
            film.close()
    return sightings, picked.pictures()


def _frame(sightings: Sequence[Sighting]) -> pd.DataFrame:
    import numpy as np
    import pandas as pd

    fields = {
        name: [getattr(sighting, name) for sighting in sightings]
        for name in ("time", "number", "theta", "tip_x", "tip_y")
    }
    verdicts = {"verdict": [str(sighting.verdict) for sighting in sightings]}
    corners = np.array([sighting.corners.ravel() for sighting in sightings]).T
    return pd.DataFrame(fields | verdicts | dict(zip(_CORNERS, corners, strict=True)))


def _digest(source: Path) -> str:
    """SHA-256 of a file, or of the list of a folder's files."""
    from wristctl.records.files import files_below, sha256_of, sha256_of_list

    if source.is_file():
        return sha256_of(source)
    return sha256_of_list([(name, sha256_of(source / name)) for name in files_below(source)])


TRACK = Procedure(
    "track",
    plan,
    track,
    (EarlierRun("calibration", kind="calibrate-camera", optional=True),),
    in_one_plane=no_tendons,
)
