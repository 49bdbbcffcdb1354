"""What is wrong with a rig is named, with what to do, and the grave first."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.trial.conftest import WRIST
from tests.trial.test_camera_pace import pace
from wristctl.board.check import Adapter, RoundTrips, adapter_of, shorter
from wristctl.board.transport import PortFound
from wristctl.config.hw_run import HwRunSettings
from wristctl.trial import rig_facts
from wristctl.trial.camera_pace import CameraPace
from wristctl.trial.expected_moves import Bend
from wristctl.trial.rig_facts import AxisDirection, CameraFacts, Pictures, RigFacts, Trouble, measure, troubles
from wristctl.trial.rig_strokes import Latency
from wristctl.trial.safety import SafetyStop
from wristctl.vision.camera_pose import CameraPose
from wristctl.vision.detector import PictureQuality
from wristctl.vision.marker import Sighting, SightingVerdict
from wristctl.vision.view import View

SETTINGS = HwRunSettings()
TWO = HwRunSettings.model_validate({"planes": 2, "port": "x", "camera": "4", "camera_2": "6"})
CAMERA = CameraFacts(
    pace=pace(60.0, 0.033), quality=PictureQuality(48.0, 1.0, 40.0, 220.0), noise=4e-4,
    latency=Latency(1e-3, 3e-4, 40.0, 5e-4, 200),
)  # fmt: skip
SOUND = RigFacts(
    trips=RoundTrips("STATUS", 100, 3.0e-3, 3.4e-3, 4e-3), adapter=Adapter("FTDI", 1e-3), woken=np.full(200, 1e-4),
    cameras=(CAMERA,),
)  # fmt: skip


def posed(tilt: float, pan: float = 0.0, misfit: float = 1e-3) -> CameraPose:
    """A camera so many degrees off square."""
    return CameraPose(math.radians(tilt), math.radians(pan), -0.05, misfit, View())


SLOW = RoundTrips("STATUS", 100, 0.021, 0.03, 0.04)


def told(**changes: Any) -> list[tuple[bool, str, str]]:
    """Troubles of a rig with one camera of which so much is changed."""
    of_camera = {name: value for name, value in changes.items() if name in CameraFacts._fields}
    others = {name: value for name, value in changes.items() if name not in of_camera}
    facts = SOUND._replace(cameras=(CAMERA._replace(**of_camera),), **others)
    return [tuple(each) for each in troubles(facts, SETTINGS, "/dev/ttyUSB0")]  # type: ignore[misc]


def named(camera: int, **changes: Any) -> CameraFacts:
    """A sound camera of two, so much changed."""
    facts = CAMERA._replace(**{"pace": pace(60.0, 0.033), **changes})
    facts.pace.name = f"camera {camera}"
    return facts


def told_of_two(first: CameraFacts, second: CameraFacts, **changes: Any) -> list[Trouble]:
    """Troubles of a rig with these two cameras."""
    return troubles(SOUND._replace(cameras=(first, second), **changes), TWO, "/dev/ttyUSB0")


def test_a_sound_rig_has_no_troubles() -> None:
    assert told() == [] == told(pose=posed(3.0, -3.0)) == told(pace=pace(60.0, 0.095))


@pytest.mark.parametrize(
    ("changes", "grave", "said", "fix"),
    [
        ({"trips": SLOW, "adapter": Adapter("FTDI", 0.016)}, True, "latency timer is 16 ms", "tee"),
        ({"trips": SLOW}, True, "take 21.7 ms, too long for ticks of 10 ms",
         "control_period=0.011"),
        ({"pace": pace(40.0, 0.033)}, False, "gives 40 pictures/s; the loop's observer counts on 60", "device.fourcc"),
        ({"pace": pace(60.0, 0.0, 61, jitter=4e-3)}, False, "unevenly, +-12 ms", "hub"),
        ({"pace": pace(60.0, 0.14)}, True, "beyond safety.stale (150 ms)", "safety.stale of 0.2"),
        ({"pace": pace(30.0, 0.066)}, False, "lost one after the other, the angle is 167 ms old", "safety.stale=0.2"),
        ({"pace": pace(60.0, 0.105)}, False, "the angle is 156 ms old", "safety.stale=0.2"),
        ({"latency": Latency(0.06, 3e-4, 40.0, 5e-4, 99)}, False, "60 ms older than their time stamps say",
         "device.delay=0.0600"),
        ({"latency": Latency(0.12, 3e-4, 40.0, 5e-4, 99)}, True, "beyond safety.stale", "safety.stale of 0.2 s"),
        ({"pace": pace(60.0, 0.03, verdict=SightingVerdict.TWICE)}, True, "60 of 60 pictures: twice", "same id"),
        ({"pose": posed(6.0)}, False, "looks 6 deg off square", "--optics"),
        ({"pose": posed(0.0, -16.0)}, True, "looks 16 deg off square", "--optics"),
        ({"pose": posed(0.0, misfit=0.02)}, False, "no squares of one plane (by 2.0 %)", "flat on stiff flags"),
        ({"quality": PictureQuality(28.0, 1.0, 40.0, 220.0)}, False, "28 px wide", "40 px"),
        ({"quality": PictureQuality(48.0, 2.4, 40.0, 220.0)}, False, "blurred by 2.4 px", "focus"),
        ({"quality": PictureQuality(48.0, 1.0, 90.0, 254.0)}, False, "rim of the tip's marker is white", "shorter"),
        ({"quality": PictureQuality(48.0, 1.0, 40.0, 80.0)}, False, "print of the tip's marker is faint", "light"),
        ({"woken": np.array([1e-4] * 190 + [3e-3] * 10)}, False, "wakes a tick 3.0 ms late", "--priority"),
        ({"woken": np.array([1e-4] * 190 + [0.06] * 10)}, True, "wakes a tick 60.0 ms late", "--priority"),
    ],
)  # fmt: skip
def test_each_trouble_is_named_with_its_way_out(changes: Any, grave: bool, said: str, fix: str) -> None:
    found = told(**changes)
    assert any(said in what and fix in how and grave == is_grave for is_grave, what, how in found), found
    assert [is_grave for is_grave, *_ in found] == sorted((g for g, *_ in found), reverse=True)


def test_two_sound_cameras_have_no_troubles() -> None:
    assert told_of_two(named(1), named(2, pose=posed(4.0))) == []


@pytest.mark.parametrize("camera", [1, 2])
@pytest.mark.parametrize(
    ("changes", "grave", "said", "fix"),
    [
        ({"pace": pace(40.0, 0.033)}, False, "camera {} gives 40 pictures/s", "device.fourcc"),
        ({"pace": pace(60.0, 0.14)}, True, "camera {} gives 60 pictures/s, 140 ms old", "safety.stale"),
        ({"pace": CameraPace()}, True, "camera {} gives no pictures", "cable"),
        ({"pace": pace(60.0, 0.03, verdict=SightingVerdict.NO_TIP), "quality": None}, True,
         "60 of 60 pictures of camera {}: no tip", "covers the tip's marker"),
        ({"pose": posed(0.0, 6.0)}, False, "camera {} looks 6 deg off square", "wristctl hw calibrate camera"),
        ({"pose": posed(16.0)}, True, "camera {} looks 16 deg off square", "wristctl hw calibrate camera"),
        ({"pose": posed(0.0, misfit=0.02)}, False, "the markers of camera {} are no squares", "flags"),
        ({"quality": PictureQuality(28.0, 1.0, 40.0, 220.0)}, False, "the tip's marker of camera {} is 28 px", "40 px"),
    ],
)  # fmt: skip
def test_a_trouble_of_one_of_two_cameras_names_it_and_spares_the_other(
    camera: int, changes: Any, grave: bool, said: str, fix: str
) -> None:
    cameras = [named(1), named(2)]
    cameras[camera - 1] = named(camera, **changes)
    (trouble,) = told_of_two(*cameras)
    assert trouble.grave == grave and said.format(camera) in trouble.what and fix in trouble.fix
    assert f"camera {3 - camera}" not in trouble.what + trouble.fix


def test_an_oblique_camera_is_not_said_to_lose_its_markers() -> None:
    """Its markers are no squares, until its pose is taken into account."""
    unseen = pace(60.0, 0.033, verdict=SightingVerdict.NO_BASE)
    (oblique,) = told_of_two(named(1, pace=unseen, pose=posed(20.0)), named(2))
    assert oblique.grave and "camera 1 looks 20 deg off square" in oblique.what
    unseen = pace(60.0, 0.033, verdict=SightingVerdict.NO_BASE)
    (covered,) = told_of_two(named(1, pace=unseen, pose=posed(4.0)), named(2))
    assert covered.grave and "pictures of camera 1: no base" in covered.what


def blind(camera: int, foreign: tuple[int, ...]) -> CameraFacts:
    """A camera that sees the other one's markers alone."""
    unseen = pace(60.0, 0.033, verdict=SightingVerdict.NO_TIP)
    return named(camera, pace=unseen, quality=None, pose=None, noise=math.nan, latency=None, foreign=foreign)


def test_exchanged_cameras_are_one_trouble_with_the_options_that_exchange_them_back() -> None:
    (trouble,) = told_of_two(blind(1, (2, 3)), blind(2, (0, 1)))
    assert trouble.grave and "the cameras are exchanged" in trouble.what
    assert trouble.fix == "--camera 6 --set camera_2=4"


def test_a_camera_before_the_others_markers_is_told_which_it_must_see() -> None:
    (trouble,) = told_of_two(named(1), blind(2, (0, 1)))
    assert trouble.grave and trouble.what == "camera 2 shows markers 0 and 1, which are those of camera 1"
    assert "markers 2 and 3" in trouble.fix and "camera_2=" in trouble.fix


@pytest.mark.parametrize(
    ("first", "second", "said", "delay", "alike"),
    [
        (0.060, 0.064, "camera 1 are 60 ms and pictures of camera 2 are 64 ms older", "device.delay=0.0620", True),
        (0.001, 0.031, "camera 1 are 1 ms and pictures of camera 2 are 31 ms older", "device.delay=0.0160", False),
    ],
)
def test_one_delay_is_for_both_cameras(first: float, second: float, said: str, delay: str, alike: bool) -> None:
    aged = [named(k, latency=Latency(age, 3e-4, 40.0, 5e-4, 99)) for k, age in ((1, first), (2, second))]
    (trouble,) = told_of_two(*aged)
    assert not trouble.grave and said in trouble.what and delay in trouble.fix
    assert ("of one kind" not in trouble.fix) == alike


def test_an_axis_that_bends_the_wrist_elsewhere_is_grave() -> None:
    astray = SafetyStop("axis 0 bends the wrist toward 137 deg", "homing", "see the motors")
    direction = AxisDirection(0, math.radians(137.0), math.radians(225.0), astray)
    (trouble,) = told_of_two(named(1), named(2), direction=direction)
    assert trouble == Trouble(True, "axis 0 bends the wrist toward 137 deg", "see the motors")
    assert told_of_two(named(1), named(2), direction=direction._replace(astray=None)) == []


class Stand:
    """A testbed whose cameras see this, of which every axis bends the wrist so, and which keeps what has moved."""

    def __init__(self, paces: Sequence[CameraPace], tilts: Sequence[float], bend: Bend) -> None:
        self.transport, self.moved = SimpleNamespace(name="socket://a:1"), list[int]()
        self.bend, self.struck = bend, 0
        self._poses = iter([posed(tilt) for tilt in tilts])
        self.watched = tuple(paces), list[Sighting]()

    def tracking(self) -> Stand:
        return self

    def stand_square(self, seen: Sequence[Sighting]) -> CameraPose:
        return next(self._poses)

    def strokes_of(self, board: Any, tracking: Any, settings: Any, axis: int) -> Any:
        self.moved.append(axis)
        return SimpleNamespace(taken_up=lambda: (30, self.bend), strokes=self.strokes, let_go=lambda: None)

    def strokes(self, taut: int, progress: Any) -> Iterator[Any]:
        self.struck += 1
        return iter(())


def measured(stand: Any, axis: int | None, monkeypatch: pytest.MonkeyPatch) -> RigFacts:
    monkeypatch.setattr(rig_facts, "round_trips", lambda *given: SOUND.trips)
    monkeypatch.setattr(rig_facts, "_watched", lambda tracking, testbed: stand.watched)
    monkeypatch.setattr(rig_facts, "_woken", lambda testbed, period: SOUND.woken)
    monkeypatch.setattr(rig_facts, "RigStrokes", stand.strokes_of)
    return measure(stand, stand, Pictures(), SETTINGS if len(stand.watched[0]) == 1 else TWO, WRIST, axis)


UNSEEN = pace(60.0, 0.033, verdict=SightingVerdict.NO_BASE)


@pytest.mark.parametrize(
    ("axis", "first", "second", "tilts", "moves"),
    [
        (0, pace(60.0, 0.033), None, (0.0,), True),
        (3, pace(60.0, 0.033), None, (0.0,), True),
        (None, pace(60.0, 0.033), None, (0.0,), False),
        (0, UNSEEN, None, (0.0,), False),
        (None, UNSEEN, None, (0.0,), False),
        (0, pace(60.0, 0.033), None, (40.0,), False),
        (1, pace(60.0, 0.033), UNSEEN, (0.0, 0.0), False),
        (1, UNSEEN, pace(60.0, 0.033), (0.0, 0.0), False),
        (1, pace(60.0, 0.033), pace(60.0, 0.033), (0.0, 40.0), False),
        (1, pace(60.0, 0.033), pace(60.0, 0.033), (0.0, 0.0), True),
    ],
)
def test_nothing_moves_unless_it_is_asked_for_and_every_camera_sees_the_wrist_none_too_obliquely(
    axis: int | None, first: CameraPace, second: CameraPace | None, tilts: tuple[float, ...], moves: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    stand = Stand([each for each in (first, second) if each is not None], tilts, Bend(-0.05, 0.05))
    found = measured(stand, axis, monkeypatch)
    assert stand.moved == ([axis] if moves else []) and stand.struck == moves
    assert [camera.pace for camera in found.cameras] == list(stand.watched[0])
    assert (found.direction is not None) == (moves and second is not None)


def test_an_axis_that_bends_the_wrist_elsewhere_makes_no_stroke(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tendon 2, of axis 1, is to bend it toward 135 deg from ulnar toward flexion."""
    for bend, strokes in ((Bend(-0.05, 0.04), 1), (Bend(0.05, -0.05), 0), (Bend(0.05, 0.05), 0)):
        stand = Stand([pace(60.0, 0.033)] * 2, (0.0, 0.0), bend)
        direction = measured(stand, 1, monkeypatch).direction
        assert stand.moved == [1] and stand.struck == strokes
        assert direction is not None and (direction.astray is None) == bool(strokes) and direction.axis == 1
        assert direction.bend == pytest.approx(math.atan2(bend.away, bend.theta))
        assert math.degrees(direction.place) == pytest.approx(135.0)


def test_the_adapter_is_that_of_the_real_port_behind_a_link_with_its_own_latency(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    system, port, link = tmp_path / "devices", tmp_path / "ttyUSB3", tmp_path / "wrist"
    (system / "ttyUSB3").mkdir(parents=True)
    (system / "ttyUSB3" / "latency_timer").write_text("16\n")
    port.touch()
    link.symlink_to(port)
    assert adapter_of(str(link), system) == Adapter("FTDI", 0.016)
    assert f"{system}/ttyUSB3/latency_timer" in shorter(str(link), system)
    assert adapter_of("/dev/ttyACM0", system) == adapter_of("socket://a:1", system) == Adapter("", None)
    listed = [PortFound("/dev/ttyACM0", "", "", True, "16U2"), PortFound("/dev/ttyUSB4", "", "", True, "CH340")]
    monkeypatch.setattr("wristctl.board.check.ports", lambda: listed)
    assert str(adapter_of("/dev/ttyACM0", system)) == "16U2, hands over every 4.1 ms"
    assert str(adapter_of("/dev/ttyUSB4", system)) == "CH340, hands over every 1 ms"
