"""The wrist's angle in a recorded video, or the bends of both planes in two, without any board."""

from __future__ import annotations

import logging
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from wristctl.commands.inputs import EarlierRun, Inputs
from wristctl.commands.printed_table import Table
from wristctl.commands.procedure import Procedure, no_tendons
from wristctl.commands.quantities import VALUE, Quantity, documented, keep_values
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records.files import files_below, sha256_of, sha256_of_list

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from wristctl.arrays import Array
    from wristctl.vision.marker import Sighting
    from wristctl.vision.view import View

log = logging.getLogger(__name__)

# Skew from which the user is warned [deg]; noise of the corners alone is below 0.1.
_ASKEW = 0.3
_USABLE = Quantity("usable", meaning="share of frames with an angle", better="higher")
_SKEW = Quantity("askew", "deg", "largest error, by the base's marker that is no square", better="lower")
_PLANES = ("ulnar", "flexion")
_CORNERS = [f"{marker}_{axis}{k}" for marker in ("base", "tip") for k in (1, 2, 3, 4) for axis in "xy"]
_COLUMNS = [
    Quantity("time", "s", "of the frame in the recording"),
    Quantity("number", meaning="of the frame"),
    Quantity("theta", "rad", "bending angle, empty where the frame cannot be used"),
    Quantity("tip_x", "m", "tip from the first disc along the base's marker; track.markers says where that stands"),
    Quantity("tip_y", "m", "tip across, toward theta > 0"),
    Quantity("verdict", meaning="ok, or why it cannot be used"),
    *(Quantity(name, "px", "marker's corner, from its top left clockwise") for name in _CORNERS),
]
# What the table of two cameras has beside that: the plane that a frame's camera looks at, and the bend about it.
_IN_TWO_PLANES = [
    Quantity("plane", meaning="that the frame's camera looks at: ulnar or flexion"),
    Quantity(
        "bend", "rad", "bend of the last disc about it, by what the other camera sees; empty where that sees nothing"
    ),
]


@dataclass(frozen=True, repr=False, eq=False)
class Tracked(StudyResult):
    """Sightings of the wrist's markers in each frame of a recording, or of two, in the order of their times."""

    kind = "track"

    sightings: list[Sighting]
    bends: Array | None = None
    """Bend about the plane of each sighting's camera [rad], of a wrist that two cameras see; nan where unknown."""

    def frame(self) -> pd.DataFrame:
        """One row per frame of the recording: time [s], angle [rad], verdict, the markers' corners [px]."""
        return _frame(self.sightings, self.bends)


def plan(study: Study, inputs: Inputs) -> str:
    """Check that the recordings can be read, and describe them."""
    settings = study.track
    if settings.video is None:
        raise UserError("track needs a video", "track.video", "wristctl track trial.mp4, or a folder of pictures")
    if settings.video_2 is None:
        for name in ("calibration_2", "markers_2"):
            if name in inputs or name in settings.model_fields_set:
                raise UserError("there is no second camera", f"track.{name}", "--set video_2=FILE, or leave it out")
        return _described(settings.video, "calibration", study, inputs)
    first, second = settings.markers, settings.markers_2
    if {first.base, first.tip} & {second.base, second.tip}:
        raise UserError("both cameras look for a marker of one id", "track.markers_2", "other ids")
    both = (settings.video, "calibration"), (settings.video_2, "calibration_2")
    return "two planes: " + ", and ".join(_described(source, name, study, inputs) for source, name in both)


def _described(source: str, calibration: str, study: Study, inputs: Inputs) -> str:
    from wristctl.vision.camera import open_recording

    recording = open_recording(source, study.track.frame_rate)
    first = recording.newest()
    recording.close()
    assert first is not None
    height, width = first.image.shape
    square = "" if calibration in inputs else "; no calibration: the camera is taken to stand square to the plane"
    return f"{recording.name}: {width} x {height}{square}"


class _Seen(NamedTuple):
    """What a camera saw, with its view and the zero of its angles [rad]."""

    source: str
    sightings: list[Sighting]
    pictures: list[NDArray[np.uint8]]
    view: View
    zero: float
    side: float


def track(session: Session) -> Tracked:
    """Find the wrist's angle in each frame of a recorded video, or of a folder of pictures.

    The two printed markers (hw calibrate board-pdf) must be in the picture; no motor board is needed. With the
    recording of a second camera, at a right angle to the first, it finds the bends of both planes.
    """
    import cv2
    import numpy as np

    from wristctl.commands.track.figures import angle, frames
    from wristctl.vision.marker import MEANING, SightingVerdict
    from wristctl.vision.recordings import angle_noise, base_askew

    cv2.setNumThreads(1)
    findings, settings = session.findings, session.study.track
    sources = [str(source) for source in (settings.video, settings.video_2) if source is not None]
    cameras = [_see(session, number, source, len(sources) == 2) for number, source in enumerate(sources)]
    sightings, bends = _together(cameras, settings.video_2 is not None)
    columns = _COLUMNS if bends is None else [*_COLUMNS, *_IN_TWO_PLANES]
    findings.table("data/track.csv", _frame(sightings, bends), *documented(columns))
    recordings = [
        {"name": seen.source, "sha256": _digest(Path(seen.source)), "frames": len(seen.sightings)} for seen in cameras
    ]
    findings.plain("data/recording.json", recordings[0] if bends is None else {"recordings": recordings})
    with session.drawing():
        findings.figure("angle", angle, sightings, bends)
        findings.figure("frames", frames, [picture for seen in cameras for picture in seen.pictures])
    counts = Counter(sighting.verdict for sighting in sightings)
    usable, total = counts[SightingVerdict.OK], len(sightings)
    share = keep_values(findings, [(_USABLE, usable / total, total)])
    for seen in cameras:
        verdicts = Counter(sighting.verdict for sighting in seen.sightings)
        if not verdicts[SightingVerdict.OK]:
            verdict, count = verdicts.most_common(1)[0]
            reason = f"no frame can be used: {verdict} in {count} of {len(seen.sightings)}: {MEANING[verdict]}"
            fix = "see figures/frames.png; are both markers (4x4_50, ids track.markers) uncovered and 40 px or larger?"
            raise UserError(reason, seen.source, fix, exit_code=3)
    seconds = sightings[-1].time - sightings[0].time
    rows = [("frames", total), ("frames per second", (total - 1) / seconds if seconds else None), *share]
    for name, heading, degrees in _courses(sightings, bends):
        some = degrees[np.isfinite(degrees)]
        if not len(some):
            fix = "recordings that begin together, or both with the table of their times beside them"
            raise UserError("the cameras see the wrist at no common time", sources[0], fix, exit_code=3)
        values = [
            (Quantity(f"{name}_{key}", "deg", f"{end} {heading}", f"{end} {heading}"), float(value))
            for key, end, value in (("min", "least", some.min()), ("max", "greatest", some.max()))
        ]
        noise = Quantity("noise", "deg", "deviation from steady motion", better="lower")
        if bends is not None:
            noise = replace(noise, name=f"noise_{name}", heading=f"noise of that, {name}")
        values.append((noise, angle_noise(degrees)))
        rows += keep_values(findings, [(quantity, value, len(some)) for quantity, value in values])
    skew = math.degrees(max(base_askew(seen.view, seen.sightings) for seen in cameras))
    rows += keep_values(findings, [(_SKEW, skew, usable)])
    if skew > _ASKEW:
        fix = "calibrate the camera where it stands now, and name that run with --calibration"
        log.warning("angles may be up to %.1f deg off, for the base's marker looks askew - fix: %s", skew, fix)
    why = [(str(verdict), count, count / total, MEANING[verdict]) for verdict, count in counts.most_common()]
    heads = ("verdict", "frames", "share", "meaning")
    title = " and ".join(Path(source).name for source in sources)
    tables = [Table(title, VALUE, rows), Table("Frames by verdict", heads, why)]
    return Tracked(session.study, findings, tables, sightings, bends)


def _courses(sightings: Sequence[Sighting], bends: Array | None) -> list[tuple[str, str, Array]]:
    """Name, heading and values [deg] of the angle, or of the bend of each plane."""
    import numpy as np

    if bends is None:
        return [("theta", "angle", np.degrees([sighting.theta for sighting in sightings]))]
    planes = np.array([sighting.plane for sighting in sightings])
    return [(name, f"bend toward {name}", np.degrees(bends[planes == p])) for p, name in enumerate(_PLANES)]


def _see(session: Session, number: int, source: str, of_two: bool) -> _Seen:
    """Sightings in each frame of a camera's recording, and annotated pictures of some frames."""
    from wristctl.vision.camera import open_recording
    from wristctl.vision.marker import SightingVerdict, Tracker
    from wristctl.vision.recordings import AnnotatedVideo, Picked
    from wristctl.vision.view import View

    settings, end = session.study.track, f"_{number + 1}" if number else ""
    view = View.of(session.inputs.runs().get(f"calibration{end}"))
    markers = settings.markers_2 if number else settings.markers
    plane: Literal[0, 1] | None = None if not of_two else 1 if number else 0
    tracker = Tracker(markers, view, settings.gates, plane=plane)
    recording = open_recording(source, settings.frame_rate)
    video = session.findings.file(f"data/annotated{end}.avi") if settings.annotate else None
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
    side = 1.0 if markers.positive == "right" else -1.0
    return _Seen(source, sightings, picked.pictures(), view, tracker.zero, side)


def _together(cameras: Sequence[_Seen], of_two: bool) -> tuple[list[Sighting], Array | None]:
    """Sightings of all cameras in the order of their times, and of two the bends about their planes [rad].

    Times of two are those of the tables beside their videos where both have one; else both are taken to begin together.
    """
    import numpy as np

    from wristctl.vision.recordings import times_beside
    from wristctl.vision.two_views import paired_bends

    if not of_two:
        return cameras[0].sightings, None
    clocks = [times_beside(Path(seen.source), len(seen.sightings)) for seen in cameras]
    known = [clock for clock in clocks if clock is not None]
    begin = min(float(clock.min()) for clock in known) if len(known) == len(clocks) else None
    parts = []
    for seen, clock in zip(cameras, clocks, strict=True):
        times = [sighting.time for sighting in seen.sightings] if begin is None or clock is None else clock - begin
        parts.append([sighting._replace(time=float(at)) for sighting, at in zip(seen.sightings, times, strict=True)])
    views, zeros, sides = ([getattr(seen, name) for seen in cameras] for name in ("view", "zero", "side"))
    bends = np.concatenate(paired_bends(parts, views, zeros, sides))
    joined = [sighting for part in parts for sighting in part]
    order = np.argsort([sighting.time for sighting in joined], kind="stable")
    return [joined[k] for k in order], bends[order]


def _frame(sightings: Sequence[Sighting], bends: Array | None = None) -> pd.DataFrame:
    import numpy as np
    import pandas as pd

    names = ("time", "number", "theta", "tip_x", "tip_y")
    fields: dict[str, Any] = {name: [getattr(sighting, name) for sighting in sightings] for name in names}
    fields["verdict"] = [str(sighting.verdict) for sighting in sightings]
    if bends is not None:
        fields |= {"plane": [_PLANES[sighting.plane] for sighting in sightings], "bend": bends}
    corners = np.array([sighting.corners.ravel() for sighting in sightings]).T
    return pd.DataFrame(fields | dict(zip(_CORNERS, corners, strict=True)))


def _digest(source: Path) -> str:
    """SHA-256 of a file, or of the list of a folder's files."""
    if source.is_file():
        return sha256_of(source)
    return sha256_of_list([(name, sha256_of(source / name)) for name in files_below(source)])


TRACK = Procedure(
    "track",
    plan,
    track,
    tuple(EarlierRun(name, kind="calibrate-camera", optional=True) for name in ("calibration", "calibration_2")),
    in_one_plane=no_tendons,
)
