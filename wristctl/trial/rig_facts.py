"""Can this rig run the configured loop? What its link, camera and computer do, measured, and what is wrong with it."""

import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.board.check import Adapter, RoundTrips, adapter_of, round_trips, shorter
from wristctl.board.driver import Board
from wristctl.board.layout import LAYOUTS
from wristctl.board.messages import Command, Pulls, Rate, Status
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.camera_pace import BY_CHECK, FIX, CameraPace, CameraPaces, stale_for
from wristctl.trial.expected_moves import Bend, ExpectedMoves
from wristctl.trial.resting import judge_rest
from wristctl.trial.rig_belief import PLANES, layout_of_rig
from wristctl.trial.rig_strokes import Latency, RigStrokes, find_latency
from wristctl.trial.safety import SafetyStop
from wristctl.trial.supervised_wait import OBLIQUE_FIX
from wristctl.trial.testbeds import Testbed
from wristctl.trial.tick_timing import FIX as TIMING_FIX
from wristctl.trial.tick_timing import SCHEDULING
from wristctl.trial.tracking import Tracking
from wristctl.vision.camera import CameraError, Frame, Image
from wristctl.vision.camera_pose import CameraPose
from wristctl.vision.detector import Detector, PictureQuality, quality_of
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
# Verdicts on sound markers before a camera that is too oblique.
_OF_OBLIQUE = SightingVerdict.NO_BASE, SightingVerdict.SHAPE


class CameraFacts(NamedTuple):
    """What one camera gives, times in s."""

    pace: CameraPace
    quality: PictureQuality | None
    """Medians over the pictures; None where the tip's marker is not seen."""
    noise: float
    """Scatter of a resting wrist's angle [rad]."""
    latency: Latency | None
    """None where nothing was to move."""
    pose: CameraPose | None = None
    """None for a calibrated camera, or one that sees no markers."""
    foreign: tuple[int, ...] = ()
    """Ids of the other camera's markers that it shows, where it shows none of its own."""


class AxisDirection(NamedTuple):
    """Where the wrist went, in two planes, as its axis took up the tendon."""

    axis: int
    bend: float
    """Direction of the bend, from ulnar toward flexion [rad]."""
    place: float
    """Direction in which this axis should bend it [rad]."""
    astray: SafetyStop | None
    """What this means, where it is not that direction."""


class RigFacts(NamedTuple):
    """Times [s]."""

    trips: RoundTrips
    adapter: Adapter
    woken: Array
    """Delays with which the computer woke."""
    cameras: tuple[CameraFacts, ...]
    """Of each camera, in the order of their planes."""
    direction: AxisDirection | None = None
    """None in one plane, or where nothing was to move."""
    rest: SafetyStop | None = None
    """What is wrong with how the slack wrist rests and is seen."""


class Trouble(NamedTuple):
    """Something wrong with a rig."""

    grave: bool
    """Whether the loop cannot run like this."""
    what: str
    fix: str


class Pictures:
    """Keeps what was seen in the newest pictures, by the plane that their camera looks at."""

    def __init__(self) -> None:
        self.qualities: defaultdict[int, list[PictureQuality]] = defaultdict(list)
        self._newest: dict[int, Image] = {}

    def __call__(self, frame: Frame, sighting: Sighting) -> None:
        """Take one."""
        qualities, self._newest[sighting.plane] = self.qualities[sighting.plane], frame.image
        if np.isfinite(sighting.corners[1]).all() and len(qualities) < _TRIPS:
            qualities.append(quality_of(frame.image, sighting.corners[1]))

    def shown(self, plane: int) -> set[int]:
        """Ids of all markers in the newest picture."""
        return set(Detector().everywhere(self._newest[plane], fine=True)) if plane in self._newest else set()


def measure(
    testbed: Testbed, board: Board, pictures: Pictures, settings: HwRunSettings, wrist: WristParameters,
    axis: int | None, progress: Callable[[int], None] = lambda done: None,
) -> RigFacts:  # fmt: skip
    """Measure a connected board and the testbed's pictures. With an `axis` its motor makes strokes.

    Nothing moves unless every camera sees the wrist, and none too obliquely. In two planes the axis must then bend the
    believed wrist toward its tendon, before it makes any stroke. Raises SafetyStop, BoardError and CameraError.
    """
    trips, adapter = round_trips(board, Command.STATUS, _TRIPS), adapter_of(testbed.transport.name)
    tracking = testbed.tracking()
    paces, sightings = _watched(tracking, testbed)
    seen = [[sighting for sighting in sightings if sighting.plane == plane] for plane in range(len(paces))]
    poses = [tracking.stand_square(of_camera) for of_camera in seen]
    woken = _woken(testbed, settings.control_period)
    latencies = list[Latency]()
    direction = None
    sees = all(pace.verdicts[SightingVerdict.OK] for pace in paces)
    rest = _rest(seen, settings, wrist)
    if axis is not None and sees and rest is None and not any(_is_too_oblique(pose, settings) for pose in poses):
        strokes = RigStrokes(board, tracking, settings, axis)
        taut, bend = strokes.taken_up()
        if settings.planes == 2:
            expected = ExpectedMoves(settings, wrist, "", layout_of_rig(settings, wrist))
            direction = _direction_of(axis, bend, expected)
        if direction is None or direction.astray is None:
            for cameras in strokes.strokes(taut, progress):
                latencies = [find_latency(motor_strokes, strokes.hold) for motor_strokes in cameras]
                if max(latency.sd for latency in latencies) < _SURE:
                    break
        strokes.let_go()
    facts = []
    for plane, (pace, pose) in enumerate(zip(paces, poses, strict=True)):
        angles = [sighting.theta for sighting in seen[plane] if math.isfinite(sighting.theta)]
        qualities = pictures.qualities[plane]
        quality = PictureQuality(*np.median(qualities, axis=0)) if qualities else None
        noise = float(np.std(angles)) if len(angles) > 2 else math.nan
        foreign: set[int] = set()
        if settings.planes == 2 and quality is None:
            shown, ids = pictures.shown(plane), _ids(settings)
            foreign = set() if shown & set(ids[plane]) else shown & set(ids[1 - plane])
        latency = latencies[plane] if latencies else None
        facts.append(CameraFacts(pace, quality, noise, latency, pose, tuple(sorted(foreign))))
    return RigFacts(trips, adapter, woken, tuple(facts), direction, rest)


def _rest(seen: Sequence[Sequence[Sighting]], settings: HwRunSettings, wrist: WristParameters) -> SafetyStop | None:
    usable = [sighting for of_camera in seen for sighting in of_camera if math.isfinite(sighting.theta)]
    try:
        judge_rest(usable, settings, wrist, ("ulnar",) if settings.planes == 1 else PLANES)
    except SafetyStop as stop:
        return stop
    return None


def _ids(settings: HwRunSettings) -> list[tuple[int, int]]:
    return [(markers.base, markers.tip) for markers in (settings.markers, settings.markers_2)]


def _direction_of(axis: int, bend: Bend, expected: ExpectedMoves) -> AxisDirection:
    try:
        expected.judge_side(axis, bend)
        astray = None
    except SafetyStop as stop:
        astray = stop
    return AxisDirection(axis, math.atan2(bend.away, bend.theta), expected.place(axis), astray)


def _watched(tracking: Tracking, testbed: Testbed) -> tuple[list[CameraPace], list[Sighting]]:
    clock, paces, sightings = testbed.transport, CameraPaces(), []
    paces.expect(len(tracking.zero))
    tracking.look()
    end = clock.now() + _WATCHED
    while clock.now() < end:
        for sighting in tracking.look():
            paces.add(sighting)
            sightings.append(sighting)
        clock.wait(2e-3)
    return paces.by_camera, sightings


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
    met = [*_of_the_link(facts, settings, port), *_of_the_views(facts, settings)]
    for plane, camera in enumerate(facts.cameras):
        if not camera.foreign:
            met += _of_a_camera(camera, settings)
        met += [*_of_the_pictures(camera), *_of_the_pose(camera, settings, plane)]
    met += _of_the_age(facts, settings)
    for stop in (facts.rest, None if facts.direction is None else facts.direction.astray):
        if stop is not None:
            met.append(Trouble(True, stop.what.removeprefix("stopped: "), stop.fix))
    late = float(np.quantile(facts.woken, 0.99))
    if late > _WOKEN * settings.control_period:
        problem = f"one time in a hundred this computer wakes a tick {1e3 * late:.1f} ms late"
        met.append(Trouble(late > settings.safety.late, problem, TIMING_FIX[SCHEDULING]))
    return sorted(met, key=lambda trouble: not trouble.grave)


def _of_the_views(facts: RigFacts, settings: HwRunSettings) -> list[Trouble]:
    shown = [" and ".join(map(str, camera.foreign)) for camera in facts.cameras]
    if all(shown):
        problem = f"the cameras are exchanged: camera 1 shows markers {shown[0]}, camera 2 markers {shown[1]}"
        return [Trouble(True, problem, f"--camera {settings.camera_2} --set camera_2={settings.camera}")]
    return [
        Trouble(
            True,
            f"camera {plane + 1} shows markers {ids}, which are those of camera {2 - plane}",
            f"it must see markers {' and '.join(map(str, _ids(settings)[plane]))}: put it before their plane, or give "
            f"the right one, {('--camera NUMBER', '--set camera_2=NUMBER')[plane]}",
        )
        for plane, ids in enumerate(shown)
        if ids
    ]


def _of_the_link(facts: RigFacts, settings: HwRunSettings, port: str) -> list[Trouble]:
    more = len(LAYOUTS[Rate].pack(Rate((0.0,) * 4)))  # a tick's command is longer than the one that was timed
    if settings.load_cells is not None:  # and so is its answer
        more += LAYOUTS[Pulls].struct.size - LAYOUTS[Status].struct.size
    longer = more * 10.0 / settings.baud
    trip, period = facts.trips.median + longer, settings.control_period
    if trip <= settings.safety.round_trip * period:
        return []
    problem = f"the board's answers take {1e3 * trip:.1f} ms, too long for ticks of {1e3 * period:g} ms"
    adapter = facts.adapter
    if adapter.name == "FTDI" and adapter.every is not None and adapter.every > 1e-3:
        latency = f"the USB adapter's latency timer is {1e3 * adapter.every:g} ms"
        return [Trouble(True, f"{problem}: {latency}", shorter(port))]
    fix = (
        "a USB adapter that holds answers back (a Mega's own for 4.1 ms, an FTDI for 16 ms unless told), a hub, or a "
        f"longer control_period (--set control_period={math.ceil(1e3 * trip / settings.safety.round_trip) / 1e3:g})"
    )
    return [Trouble(True, problem, fix)]


def _of_a_camera(camera: CameraFacts, settings: HwRunSettings) -> list[Trouble]:
    pace, met = camera.pace, []
    usual = {SightingVerdict.OK, *(_OF_OBLIQUE if _is_too_oblique(camera.pose, settings) else ())}
    for verdict in [verdict for verdict in pace.verdicts if verdict not in usual]:
        count, of = pace.verdicts[verdict], sum(pace.verdicts.values())
        problem, fix = f"{count} of {of} pictures{pace.whose}: {verdict}", FIX[verdict].removesuffix(BY_CHECK)
        met.append(Trouble(count == of, problem, fix))
    if not pace.verdicts:
        return [Trouble(True, f"{pace.name} gives no pictures", "see its cable, and that no other program uses it")]
    expected, hidden = settings.sensor.frame_rate, 0.0 if camera.latency is None else camera.latency.delay
    if pace.rate < _SLOW_CAMERA * expected:
        problem = f"{pace.name} gives {pace.rate:.3g} pictures/s; the loop's observer counts on {expected:g}"
        fix = f"device.fourcc: MJPG, device.frame_rate, a shorter device.exposure; or sensor.frame_rate={pace.rate:.0f}"
        met.append(Trouble(False, problem, fix))
    try:
        pace.fits(settings.safety.stale, hidden)
    except CameraError as error:
        met.append(Trouble(True, error.what, error.fix))
    else:
        if (oldest := pace.oldest(2) + hidden) > settings.safety.stale:
            problem = (
                f"where two pictures{pace.whose} are lost one after the other, the angle is {1e3 * oldest:.0f} ms old "
                f"before the next: beyond safety.stale ({1e3 * settings.safety.stale:.0f} ms), that ends a trial"
            )
            fix = f"a faster mode of the camera, or --set safety.stale={stale_for(oldest):g}"
            met.append(Trouble(False, problem, fix))
    if pace.jitter * pace.rate > _UNEVEN:
        problem = f"pictures{pace.whose} come unevenly, +-{1e3 * pace.jitter:.0f} ms"
        met.append(Trouble(False, problem, "another USB port or hub, or a computer that does less besides"))
    return met


def _of_the_age(facts: RigFacts, settings: HwRunSettings) -> list[Trouble]:
    """Ages that stamps do not tell. One `device.delay` is for both of two cameras."""
    aged = [(camera.pace, camera.latency.delay) for camera in facts.cameras if camera.latency is not None]
    if not any(abs(hidden) > _UNSTAMPED for _, hidden in aged):
        return []
    ages = [hidden for _, hidden in aged]
    said = " and ".join(f"pictures{pace.whose} are {1e3 * hidden:.0f} ms" for pace, hidden in aged)
    delay = f"--set device.delay={max(0.0, settings.device.delay + float(np.mean(ages))):.4f}"
    if max(ages) - min(ages) > 2.0 * _UNSTAMPED:
        delay = f"cameras of one kind on ports alike, since device.delay is for both; until then {delay}"
    return [Trouble(False, f"{said} older than their time stamps say", delay)]


def _of_the_pictures(camera: CameraFacts) -> list[Trouble]:
    quality, marker = camera.quality, f"the tip's marker{camera.pace.whose}"
    if quality is None:
        return []
    checks = [
        (quality.side < _SMALL, f"{marker} is {quality.side:.0f} px wide", "nearer, or larger pictures: 40 px"),
        (quality.blur > _BLURRED, f"{marker} is blurred by {quality.blur:.1f} px", "focus (device.focus)"),
        (quality.white > _BRIGHT, f"the rim of {marker} is white ({quality.white:.0f} of 255)",
         "a shorter device.exposure"),
        (quality.white - quality.black < _FAINT, f"the print of {marker} is faint",
         "more light, or a longer device.exposure"),
    ]  # fmt: skip
    return [Trouble(False, problem, fix) for is_bad, problem, fix in checks if is_bad]


def _is_too_oblique(pose: CameraPose | None, settings: HwRunSettings) -> bool:
    return pose is not None and pose.oblique > math.radians(settings.homing.oblique_deg)


def _of_the_pose(camera: CameraFacts, settings: HwRunSettings, plane: int) -> list[Trouble]:
    pose = camera.pose
    if pose is None:
        return []
    oblique = math.degrees(pose.oblique)
    problem = f"{camera.pace.name} looks {oblique:.0f} deg off square at the bending plane"
    checks = [
        (oblique > _OBLIQUE_DEG, _is_too_oblique(pose, settings), problem, OBLIQUE_FIX[plane]),
        (pose.misfit > _MISFIT, False,
         f"the markers{camera.pace.whose} are no squares of one plane (by {100.0 * pose.misfit:.1f} %)",
         "glue both flat on stiff flags in one plane, as far from the camera, of one print"),
    ]  # fmt: skip
    return [Trouble(grave, what, fix) for is_bad, grave, what, fix in checks if is_bad]
