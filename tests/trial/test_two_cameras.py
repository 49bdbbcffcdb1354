"""Two cameras beside a wrist that bends in two planes: what the loop is told of both."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import pytest
from pydantic import ValidationError

from tests.bench.conftest import TAUT
from wristctl.board.driver import Board
from wristctl.board.messages import Target
from wristctl.config.bench import BenchSettings, InjectedFault
from wristctl.config.camera import Markers
from wristctl.config.choices import PLANTS
from wristctl.config.hw_run import RigSettings
from wristctl.config.plant import Disturbances
from wristctl.config.wrist import WristParameters
from wristctl.trial import testbeds
from wristctl.trial.testbeds import EmulatedTestbed, RealTestbed, open_testbed
from wristctl.trial.tracking import PairedTracking, Tracking
from wristctl.vision.camera import CameraError
from wristctl.vision.marker import Sighting
from wristctl.vision.view import View

WRIST = WristParameters()


def two_planes(**settings: Any) -> RigSettings:
    return RigSettings(planes=2, bench=BenchSettings(motors=TAUT, **settings))


def opened(settings: RigSettings) -> EmulatedTestbed:
    """An emulated testbed whose cameras are not calibrated, its board enabled and homed."""
    testbed = open_testbed(settings, WRIST, 0, View(), lambda what, meanwhile: None)
    assert isinstance(testbed, EmulatedTestbed)
    return testbed


def driven(testbed: EmulatedTestbed) -> Board:
    board = Board(testbed.transport)
    board.connect()
    board.enable()
    board.home()
    return board


def watched(board: Board, tracking: Tracking, seconds: float) -> list[Sighting]:
    sightings: list[Sighting] = []
    for _ in range(round(seconds / 0.02)):
        board.ping()
        board.transport.wait(0.02)
        looked = tracking.look()
        assert [sighting.time for sighting in looked] == sorted(sighting.time for sighting in looked)
        sightings += looked
    return sightings


@pytest.mark.slow
def test_uncalibrated_cameras_that_were_set_square_tell_both_true_bends() -> None:
    testbed = opened(two_planes())
    board, tracking = driven(testbed), testbed.tracking()
    assert isinstance(tracking, PairedTracking)
    still = watched(board, tracking, 0.4)
    assert {sighting.plane for sighting in still} == {0, 1}
    for plane in (0, 1):
        pose = tracking.stand_square(sorted(still, key=lambda sighting: abs(sighting.plane - plane)))
        assert pose is not None and pose.oblique < np.radians(3.0)
    assert tracking.stand_square([]) is None
    straight = watched(board, tracking, 0.3)
    tracking.zero = tuple(
        float(np.mean([sighting.theta for sighting in straight if sighting.plane == plane])) for plane in (0, 1)
    )
    assert len(tracking.zero) == 2 and tracking.zero[0] != tracking.zero[1]
    assert abs(np.mean([sighting.theta for sighting in watched(board, tracking, 0.2)])) < 1e-3
    testbed.begin(testbed.transport.now(), Disturbances(), (5,))
    board.send(Target((300, -600, 900, -100), (2000,) * 4))
    sightings, truth = watched(board, tracking, 1.0), testbed.truth(0.0)
    bends = truth[:, 9:11]
    off = []
    for sighting in sightings:
        true = [np.interp(sighting.time, truth[:, 0], bend) for bend in bends.T]
        off.append(tracking.bend(sighting, true[1 - sighting.plane]) - true[sighting.plane])
    assert np.degrees(np.abs(bends[-1])).min() > 10.0 and len(off) > 80
    assert np.degrees(np.abs(off).max()) < 0.3 and np.degrees(np.std(off)) < 0.06
    before = testbed.transport.now()
    testbed.face("flexion", lambda: None)
    assert testbed.transport.now() == before, "nobody is asked to turn it"
    testbed.close()


def test_a_camera_that_is_lost_ends_the_look() -> None:
    testbed = opened(two_planes(faults=(InjectedFault(kind="camera-lost", at=0.1, since="power-on", camera=2),)))
    tracking = testbed.tracking()
    testbed.transport.wait(0.2)
    with pytest.raises(CameraError, match="camera 2: the camera gives no more pictures"):
        tracking.look()


class Device:
    """A camera that can be opened unless its source is `broken`."""

    opened: ClassVar[list[Device]] = []

    def __init__(self, source: str, settings: object) -> None:
        if source == "broken":
            raise CameraError("no such camera", source, "plug it in")
        self.source, self.closed = source, False
        Device.opened.append(self)

    def newest(self) -> None:
        return None

    def close(self) -> None:
        self.closed = True


class Port:
    """A transport that can be closed."""

    closed = False

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def port(monkeypatch: pytest.MonkeyPatch) -> Port:
    made = Port()
    monkeypatch.setattr(testbeds, "DeviceCamera", Device)
    monkeypatch.setattr(testbeds, "open_transport", lambda port, baud: made)
    Device.opened.clear()
    return made


@pytest.mark.parametrize(("planes", "sources"), [(1, ["4"]), (2, ["4", "6"])])
def test_a_real_rig_opens_a_camera_for_each_plane_and_gives_them_back(
    port: Port, planes: int, sources: list[str]
) -> None:
    settings = RigSettings(planes=planes, port="x", camera="4", camera_2="6")  # type: ignore[arg-type]
    asked: list[str] = []
    testbed = open_testbed(settings, WRIST, 0, View(), lambda what, meanwhile: asked.append(what))
    assert isinstance(testbed, RealTestbed)
    assert [device.source for device in Device.opened] == sources
    tracking = testbed.tracking()
    assert len(tracking.zero) == planes and tracking.look() == []
    testbed.face("flexion", lambda: None)
    assert len(asked) == 2 - planes
    testbed.close()
    assert port.closed and all(device.closed for device in Device.opened)


def test_a_second_camera_that_cannot_be_opened_gives_the_first_one_back(port: Port) -> None:
    settings = RigSettings(planes=2, port="x", camera="4", camera_2="broken")
    with pytest.raises(CameraError, match="camera 2: no such camera"):
        open_testbed(settings, WRIST, 0, View(), lambda what, meanwhile: None)
    assert port.closed and [device.closed for device in Device.opened] == [True]


def test_the_same_camera_for_both_planes_is_refused_before_anything_is_opened(port: Port) -> None:
    settings = RigSettings(planes=2, port="x", camera="4", camera_2="4")
    with pytest.raises(CameraError, match="camera 1 and camera 2 are the same, 4"):
        open_testbed(settings, WRIST, 0, View(), lambda what, meanwhile: None)
    assert not Device.opened


def test_a_camera_may_be_given_by_its_number() -> None:
    """As `--set camera_2=4` gives it."""
    settings = RigSettings.model_validate({"camera": 4, "camera_2": 6})
    assert (settings.camera, settings.camera_2) == ("4", "6")
    with pytest.raises(ValidationError):
        RigSettings.model_validate({"camera": True})


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"bench": {"plant": {"model": "rod"}}}, "plant rod bends in one plane"),
        ({"markers_2": {"base": 1, "tip": 2}}, "different ids"),
    ],
)
def test_what_no_rig_in_two_planes_can_have_is_refused(
    monkeypatch: pytest.MonkeyPatch, settings: dict[str, Any], said: str
) -> None:
    monkeypatch.setitem(PLANTS, "rod", PLANTS["hinges"])
    assert RigSettings.model_validate(settings).planes == 1
    with pytest.raises(ValidationError, match=said):
        RigSettings.model_validate({"planes": 2, **settings})
    real = {"planes": 2, "port": "x", **settings}
    if "markers_2" not in settings:
        assert RigSettings.model_validate(real).markers_2 == Markers(base=2, tip=3)
