"""Can this rig run the configured loop? What its link, camera and computer do, measured, and what is wrong with it."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.board.check import Adapter, RoundTrips, adapter_of, round_trips, shorter
from wristctl.board.driver import Board
from wristctl.board.messages import LAYOUTS, Command, Pulls, Rate, Status
from wristctl.config.hw_run import HwRunSettings
from wristctl.trial.camera_pace import FIX, CameraPace
from wristctl.trial.rig_strokes import Latency, RigStrokes, find_latency
from wristctl.trial.supervised_wait import OBLIQUE_FIX
from wristctl.trial.testbeds import Testbed
from wristctl.trial.tick_timing import FIX as TIMING_FIX
from wristctl.trial.tick_timing import SCHEDULING
from wristctl.trial.tracking import Tracking
from wristctl.vision.camera import CameraError, Frame
from wristctl.vision.camera_pose import CameraPose
from wristctl.vision.detector import PictureQuality, quality_of
from wristctl.vision.marker import Sighting, SightingVerdict

# Commands timed; seconds for which the camera is watched, and for which the computer is woken every period.
_TRIPS, _WATCHED, _SLEPT = 100, 2.0, 1.0
# Limits that are worth a word: share of the expected pictures, scatter over their interval, seconds of age that stamps
# do not tell, share of a period by which one tick in a hundred begins late.
_SLOW_CAMERA, _UNEVEN, _UNSTAMPED, _WOKEN = 0.9, 0.3, 5e-3, 0.2
# Standard deviation [s] of a camera's age that is enough: what friction does to a stroke is as much.
_SURE = 0.7e-3
# Limits of a marker: side and blur [px], grey of its rim that is too bright, and too little above its border's.
_SMALL, _BLURRED, _BRIGHT, _FAINT = 40.0, 1.8, 250.0, 60.0
# Limits of its pose: degrees off square, and corners off two squares of one plane, in sides.
_OBLIQUE_DEG, _MISFIT = 5.0, 0.006


class RigFacts(NamedTuple):
    """Times [s]."""

    trips: RoundTrips
    adapter: Adapter
    pace: CameraPace
    quality: PictureQuality | None
    """Medians over the pictures; None where the tip's marker is not seen."""
    noise: float
    """Scatter of a resting wrist's angle [rad]."""
    woken: Array
    """Delays with which the computer woke."""
    latency: Latency | None
    """None where nothing was to move."""
    pose: CameraPose | None = None
    """None for a calibrated camera, or one that sees no markers."""


class Trouble(NamedTuple):
    """Something wrong with a rig."""

    grave: bool
    """Whether the loop cannot run like this."""
    what: str
    fix: str


class Pictures:
    """Keeps what was seen in the newest pictures with a usable angle."""

    def __init__(self) -> None:
        self.qualities: list[PictureQuality] = []

    def __call__(self, frame: Frame, sighting: Sighting) -> None:
        """Take one."""
        if np.isfinite(sighting.corners[1]).all() and len(self.qualities) < _TRIPS:
            self.qualities.append(quality_of(frame.image, sighting.corners[1]))


def measure(
    testbed: Testbed, board: Board, pictures: Pictures, settings: HwRunSettings, axis: int | None,
    progress: Callable[[int], None] = lambda done: None,
) -> RigFacts:  # fmt: skip
    """Measure a connected board and the testbed's pictures. With an `axis` its motor makes strokes.

    Raises SafetyStop, BoardError and CameraError.
    """
    trips, adapter = round_trips(board, Command.STATUS, _TRIPS), adapter_of(testbed.transport.name)
    tracking = testbed.tracking()
    pace, sightings = _watched(tracking, testbed)
    angles = [sighting.theta for sighting in sightings if math.isfinite(sighting.theta)]
    pose = tracking.stand_square(sightings)
    woken = _woken(testbed, settings.control_period)
    usable = pace.verdicts[SightingVerdict.OK] > 0
    latency = None
    if axis is not None and usable:
        strokes = RigStrokes(board, tracking, settings, axis)
        for motor_strokes in strokes.strokes(progress):
            latency = find_latency(motor_strokes)
            if latency.sd < _SURE:
                break
        strokes.let_go()
    quality = PictureQuality(*np.median(pictures.qualities, axis=0)) if pictures.qualities else None
    noise = float(np.std(angles)) if len(angles) > 2 else math.nan
    return RigFacts(trips, adapter, pace, quality, noise, woken, latency, pose)


def _watched(tracking: Tracking, testbed: Testbed) -> tuple[CameraPace, list[Sighting]]:
    clock, pace, sightings = testbed.transport, CameraPace(), []
    tracking.look()
    end = clock.now() + _WATCHED
    while clock.now() < end:
        for sighting in tracking.look():
            pace.add(sighting)
            sightings.append(sighting)
        clock.wait(2e-3)
    return pace, sightings


def _woken(testbed: Testbed, period: float) -> Array:
    clock, late = testbed.transport, []
    due = clock.now()
    for _ in range(round(_SLEPT / period)):
        due = max(due + period, clock.now())
        clock.wait(max(0.0, due - clock.now()))
        late.append(clock.now() - due)
    return np.array(late)


def troubles(facts: RigFacts, settings: HwRunSettings, port: str) -> list[Trouble]:
    """Troubles of a rig for these settings, the grave first."""
    met = [*_of_the_link(facts, settings, port), *_of_the_camera(facts, settings), *_of_the_pictures(facts)]
    met += _of_the_pose(facts, settings)
    late = float(np.quantile(facts.woken, 0.99))
    if late > _WOKEN * settings.control_period:
        problem = f"one time in a hundred this computer wakes a tick {1e3 * late:.1f} ms late"
        met.append(Trouble(late > settings.safety.late, problem, TIMING_FIX[SCHEDULING]))
    return sorted(met, key=lambda trouble: not trouble.grave)


def _of_the_link(facts: RigFacts, settings: HwRunSettings, port: str) -> list[Trouble]:
    more = len(LAYOUTS[Rate].pack(Rate((0.0,) * 4)))  # a tick's command is longer than the one that was timed
    if settings.load_cells is not None:  # and so is its answer
        more += LAYOUTS[Pulls].struct.size - LAYOUTS[Status].struct.size
    longer = more * 10.0 / settings.baud
    trip, period = facts.trips.median + longer, settings.control_period
    if trip <= settings.safety.round_trip * period:
        return []
    problem = f"the board's answers take {1e3 * trip:.1f} ms of a tick's {1e3 * period:g} ms"
    adapter = facts.adapter
    if adapter.name == "FTDI" and adapter.every is not None and adapter.every > 1e-3:
        latency = f"the USB adapter's latency timer is {1e3 * adapter.every:g} ms"
        return [Trouble(True, f"{problem}: {latency}", shorter(port))]
    fix = (
        "a USB adapter that holds answers back (a Mega's own for 4.1 ms, an FTDI for 16 ms unless told), a hub, or a "
        f"longer control_period (--set control_period={math.ceil(1e3 * trip / settings.safety.round_trip) / 1e3:g})"
    )
    return [Trouble(True, problem, fix)]


def _of_the_camera(facts: RigFacts, settings: HwRunSettings) -> list[Trouble]:
    pace, met = facts.pace, []
    odd = [verdict for verdict in pace.verdicts if verdict is not SightingVerdict.OK]
    for verdict in odd:
        count, of = pace.verdicts[verdict], sum(pace.verdicts.values())
        met.append(Trouble(count == of, f"{count} of {of} pictures: {verdict}", FIX[verdict]))
    if not pace.verdicts:
        return [Trouble(True, "the camera gives no pictures", "see its cable, and that no other program uses it")]
    expected, hidden = settings.sensor.frame_rate, 0.0 if facts.latency is None else facts.latency.delay
    if pace.rate < _SLOW_CAMERA * expected:
        problem = f"the camera gives {pace.rate:.3g} pictures/s; the loop's observer counts on {expected:g}"
        fix = f"device.fourcc: MJPG, device.frame_rate, a shorter device.exposure; or sensor.frame_rate={pace.rate:.0f}"
        met.append(Trouble(False, problem, fix))
    try:
        pace.fits(settings.safety.stale, hidden)
    except CameraError as error:
        met.append(Trouble(True, error.what, error.fix))
    if abs(hidden) > _UNSTAMPED:
        delay = max(0.0, settings.device.delay + hidden)
        problem = f"pictures are {1e3 * hidden:.0f} ms older than their time stamps say"
        met.append(Trouble(False, problem, f"--set device.delay={delay:.4f}"))
    if pace.jitter * pace.rate > _UNEVEN:
        problem = f"pictures come unevenly, +-{1e3 * pace.jitter:.0f} ms"
        met.append(Trouble(False, problem, "another USB port or hub, or a computer that does less besides"))
    return met


def _of_the_pictures(facts: RigFacts) -> list[Trouble]:
    quality = facts.quality
    if quality is None:
        return []
    checks = [
        (quality.side < _SMALL, f"the tip's marker is {quality.side:.0f} px wide", "nearer, or larger pictures: 40 px"),
        (quality.blur > _BLURRED, f"its outline is blurred by {quality.blur:.1f} px", "focus (device.focus)"),
        (quality.white > _BRIGHT, f"its rim is white ({quality.white:.0f} of 255)", "a shorter device.exposure"),
        (quality.white - quality.black < _FAINT, "its print is faint", "more light, or a longer device.exposure"),
    ]
    return [Trouble(False, problem, fix) for is_bad, problem, fix in checks if is_bad]


def _of_the_pose(facts: RigFacts, settings: HwRunSettings) -> list[Trouble]:
    pose, most = facts.pose, settings.homing.oblique_deg
    if pose is None:
        return []
    oblique = math.degrees(pose.oblique)
    problem = f"the camera looks {oblique:.0f} deg off square at the bending plane"
    checks = [
        (oblique > _OBLIQUE_DEG, oblique > most, problem, OBLIQUE_FIX),
        (pose.misfit > _MISFIT, False, f"the markers are no squares of one plane (by {100.0 * pose.misfit:.1f} %)",
         "glue both flat on stiff flags in one plane, as far from the camera, of one print"),
    ]  # fmt: skip
    return [Trouble(grave, what, fix) for is_bad, grave, what, fix in checks if is_bad]
