"""`wristctl hw check --rig` of a rig in two planes: both cameras, and the direction of an axis; each fault is named."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

from tests.cli.conftest import Call
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.board.messages import Reset, State, Status
from wristctl.config.camera import Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial import rig_strokes, testbeds
from wristctl.vision.camera import CameraError, Frame
from wristctl.vision.scene import Scene

CHECK = ("hw", "check", "--rig", "--set", "planes=2")
EMULATED = (*CHECK, "--port", "emulated", "--yes")
REAL = (*CHECK, "--port", "/dev/x")


@pytest.fixture
def benches(monkeypatch: pytest.MonkeyPatch) -> list[VirtualBench]:
    """The benches that have been built."""
    built: list[VirtualBench] = []

    class Kept(VirtualBench):
        def __init__(self, *given: Any) -> None:
            super().__init__(*given)
            built.append(self)

    monkeypatch.setattr(testbeds, "VirtualBench", Kept)
    return built


def nothing_moved(bench: VirtualBench) -> bool:
    return bench.motion().steps == (0, 0, 0, 0) and not any(bench.motion().energised)


def troubles_of(out: str) -> str:
    """What is printed before the first table, but for the answer."""
    lines = out.splitlines()
    return "\n".join(lines[1 : lines.index("")])


SLOWER = [part for key in ("bench.camera", "bench.camera_2", "sensor") for part in ("--set", f"{key}.frame_rate=30")]


@pytest.fixture
def few_strokes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four strokes are enough."""
    monkeypatch.setattr(rig_strokes, "COUNT", 4)
    monkeypatch.setattr(rig_strokes, "MOST", 4)


@pytest.mark.slow
def test_a_sound_rig_passes_with_the_age_of_both_cameras_and_the_direction_of_its_axis(
    call: Call, few_strokes: None
) -> None:
    bears_two_lost = "safety.stale=0.2"
    given = [part for each in (bears_two_lost, "bench.camera_2.delay_frames=1.2") for part in ("--set", each)]
    code, out, err = call(*EMULATED, *SLOWER, *given, "--axis", "1", "--json")
    assert code == 0, err
    checked = json.loads(out)
    assert checked["fit"] and checked["troubles"] == []
    first, second = checked["cameras"]
    assert first["pictures"]["stamped_age"] == pytest.approx(2.0 / 30.0, abs=3e-3)
    assert second["pictures"]["stamped_age"] == pytest.approx(1.2 / 30.0, abs=3e-3)
    for camera in (first, second):
        assert abs(camera["latency"]["delay"]) < 4e-3 and camera["latency"]["sd"] < 2e-3
        assert np.degrees(camera["pose"]["oblique"]) < 1.0 and np.degrees(camera["noise"]) < 0.1
    direction = checked["direction"]
    assert direction["axis"] == 1 and np.degrees(direction["place"]) == pytest.approx(135.0)
    assert np.degrees(direction["bend"]) == pytest.approx(135.0, abs=5.0)


@pytest.mark.slow
def test_pictures_of_one_camera_that_are_older_than_their_stamps_are_told_from_the_other_ones(
    call: Call, few_strokes: None
) -> None:
    late = "bench.faults=[{kind: pictures-late, size: 0.03, camera: 2, since: power-on, at: 0}]"
    code, out, err = call(*EMULATED, *SLOWER, "--set", late, "--set", "bench.camera_2.delay_frames=1")
    assert code == 0 and "and could be better." in out, err
    ages = re.search(r"camera 1 are (-?\d+) ms and pictures of camera 2 are (\d+) ms older", troubles_of(out))
    assert ages and abs(int(ages[1])) <= 4 and abs(int(ages[2]) - 30) <= 4, out
    assert "device.delay=" in troubles_of(out)


@pytest.mark.slow
def test_exchanged_motors_are_named_before_any_stroke(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    def stroke(*_: object) -> None:
        raise AssertionError("no stroke is to be made")

    monkeypatch.setattr(rig_strokes.RigStrokes, "strokes", stroke)
    code, out, err = call(*EMULATED, "--axis", "0", "--set", "bench.motors.order=[1, 0, 2, 3]")
    assert code == 3, err
    assert out.startswith("This rig cannot run the loop of 10 ms in two planes.")
    assert "as tendon 2 would; likely motors of axes 0 and 1 exchanged" in troubles_of(out)
    assert "its tendon toward 225 deg" in out


@pytest.mark.slow
def test_nothing_moves_where_one_camera_is_oblique_and_the_other_sees_no_marker(
    call: Call, benches: list[VirtualBench]
) -> None:
    covered = "bench.faults=[{kind: marker-covered, camera: 1, since: power-on, at: 0}]"
    code, out, err = call(*EMULATED, "--set", covered, "--set", "bench.camera_2.scene.pan_deg=20")
    assert code == 3, err
    troubles = troubles_of(out)
    assert "pictures of camera 1: no tip" in troubles and re.search(r"camera 2 looks (19|20) deg off square", troubles)
    assert "--optics-2" in troubles and troubles.count("\n- ") == 1, "two troubles"
    assert nothing_moved(benches[0])


@pytest.mark.slow
def test_nothing_moves_before_a_camera_that_is_too_oblique_though_it_sees_its_markers(
    call: Call, benches: list[VirtualBench]
) -> None:
    given = ("--set", "homing.oblique_deg=5", "--set", "bench.camera.scene.tilt_deg=9")
    code, out, err = call(*EMULATED, *given)
    assert code == 3, err
    assert re.search(r"^- camera 1 looks \d deg off square", troubles_of(out)) and "camera 2 looks" not in out
    assert nothing_moved(benches[0])


@pytest.mark.slow
def test_an_oblique_camera_that_is_calibrated_passes(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("wristctl.cli.hw_check.typed_line", lambda meanwhile: "no")
    code, _, err = call("hw", "calibrate", "camera", "--set", "scene.pan_deg=20")
    assert code == 0, err
    given = ("--optics-2", "latest:calibrate-camera", "--set", "bench.camera_2.scene.pan_deg=20")
    code, out, err = call(*CHECK, "--port", "emulated", *given)
    assert code == 0 and "in two planes.\n" in out, out + err
    assert re.search(r"off square, by its markers +0\.\d deg \(.*\) +calibrated", out)


@pytest.mark.slow
def test_exchanged_cameras_are_named_and_nothing_moves(
    call: Call, benches: list[VirtualBench], monkeypatch: pytest.MonkeyPatch
) -> None:
    begin = VirtualBench.__init__

    def exchanged(bench: VirtualBench, *given: Any) -> None:
        begin(bench, *given)
        bench.cameras = bench.cameras[::-1]

    monkeypatch.setattr(VirtualBench, "__init__", exchanged)
    code, out, err = call(*EMULATED)
    assert code == 3, err
    assert "the cameras are exchanged: camera 1 shows markers 2 and 3, camera 2 markers 0 and 1" in troubles_of(out)
    assert "no tip" not in out and nothing_moved(benches[0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "at", "code", "said"),
    [
        ("frames-dropped", 0, 3, "camera 2 gives no pictures"),
        ("camera-lost", 1, 4, "camera 2: the camera gives no more"),
    ],
)
def test_a_camera_without_pictures_is_named(
    call: Call, benches: list[VirtualBench], kind: str, at: float, code: int, said: str
) -> None:
    fault = f"bench.faults=[{{kind: {kind}, camera: 2, since: power-on, at: {at}}}]"
    ended, out, err = call(*EMULATED, "--set", fault)
    assert ended == code and said in out + err and "nan" not in out
    assert nothing_moved(benches[0])


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("bench.plant.model=hinge", "did you mean 'hinges'"),
        ("wrist.tendons=six", "the motor board has 4 axes, and this wrist 6 tendons off its axis"),
    ],
)
def test_what_cannot_be_checked_in_two_planes_is_refused_before_anything_is_opened(
    call: Call, benches: list[VirtualBench], setting: str, said: str
) -> None:
    code, _, err = call(*EMULATED, "--set", setting)
    assert code == 2 and said in err and "fix:" in err and not benches


class Clock:
    """The wall's, as a port to a board that is always the same."""

    name, boot_time = "/dev/x", 0.0
    closed = False

    def now(self) -> float:
        return time.monotonic()

    def wait(self, seconds: float) -> None:
        time.sleep(seconds)

    def close(self) -> None:
        self.closed = True


class StandingBoard:
    """A board whose motors stand, which answers within 3 ms."""

    round_trip = 3e-3
    hello = SimpleNamespace(boot_nonce=1, reset_cause=Reset(0))

    def __init__(self, transport: Clock) -> None:
        self.transport = transport

    def __enter__(self) -> StandingBoard:
        return self

    def __exit__(self, *_: object) -> None:
        self.transport.close()

    def read(self) -> Status:
        plain: dict[str, Any] = dict.fromkeys(Status._fields, 0)
        return Status(**{**plain, "state": State.DISABLED, "position": (0, 0, 0, 0)})

    def ping(self) -> None:
        pass


class Webcam:
    """A camera of number 4 or 6, at a right angle to each other, of 60 pictures/s; another number is no camera."""

    pictures: ClassVar[dict[str, np.ndarray]] = {}
    opened: ClassVar[list[Webcam]] = []

    def __init__(self, source: str, settings: object) -> None:
        if source not in self.pictures:
            raise CameraError("no such camera, or it cannot be opened", source, "check the cable")
        self.name, self.closed, self._began, self._number = source, False, time.monotonic(), -1
        self._noise = np.random.default_rng(int(source)).normal(0.0, 4.0, self.pictures[source].shape)
        Webcam.opened.append(self)

    def newest(self) -> Frame | None:
        number = int((time.monotonic() - self._began) * 60.0)
        if number == self._number:
            return None
        self._number = number
        noisy = self.pictures[self.name] + np.roll(self._noise, (7 * number, number), (0, 1))
        return Frame(noisy.clip(0, 255).astype(np.uint8), self._began + number / 60.0, number)

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def port(monkeypatch: pytest.MonkeyPatch) -> Iterator[Clock]:
    """Port of a board, beside two cameras before a straight wrist; nobody lets it move."""
    clock, still, rng = Clock(), SceneSettings(noise=0.0), np.random.default_rng(0)
    for plane, (source, markers) in enumerate({"4": Markers(), "6": Markers(base=2, tip=3)}.items()):
        scene = Scene(still, WristParameters(), markers, plane=plane)  # type: ignore[arg-type]
        Webcam.pictures[source] = scene.render(np.zeros((1, 8)), rng)
    monkeypatch.setattr(testbeds, "DeviceCamera", Webcam)
    monkeypatch.setattr(testbeds, "open_transport", lambda port, baud: clock)
    monkeypatch.setattr("wristctl.board.driver.Board", StandingBoard)
    monkeypatch.setattr("wristctl.cli.hw_check.typed_line", lambda meanwhile: "no")
    yield clock
    assert clock.closed == bool(Webcam.opened) and all(camera.closed for camera in Webcam.opened)
    Webcam.opened.clear()


@pytest.mark.slow
@pytest.mark.parametrize("exchanged", [False, True])
def test_two_cameras_of_a_real_rig_are_measured_and_known_by_their_markers(
    call: Call, port: Clock, exchanged: bool
) -> None:
    first, second = ("6", "4") if exchanged else ("4", "6")
    code, out, err = call(*REAL, "--camera", first, "--set", f"camera_2={second}", "--json")
    checked = json.loads(out)
    said = [trouble["what"] for trouble in checked["troubles"] if trouble["grave"]]
    assert code == (3 if exchanged else 0) and "Type yes" in err
    if exchanged:
        assert len(said) == 1 and "the cameras are exchanged" in said[0]
        assert "--camera 4 --set camera_2=6" in [trouble["fix"] for trouble in checked["troubles"]]
    else:
        assert said == [] and checked["direction"] is None
        assert all(np.degrees(camera["pose"]["oblique"]) < 1.0 for camera in checked["cameras"])


def test_a_second_camera_that_is_not_there_is_named_and_all_else_given_back(call: Call, port: Clock) -> None:
    code, _, err = call(*REAL, "--camera", "4", "--set", "camera_2=9")
    assert code == 4 and "camera 2: no such camera" in err and "- 9 -" in err
    assert [camera.name for camera in Webcam.opened] == ["4"]


def test_one_camera_for_both_planes_is_refused_before_anything_is_opened(call: Call, port: Clock) -> None:
    code, _, err = call(*REAL, "--camera", "6", "--set", "camera_2=6")
    assert code == 4 and "camera 1 and camera 2 are the same, 6" in err and "camera_2=" in err
