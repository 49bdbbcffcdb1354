"""A camera that repeats itself, or stamps its pictures with times that cannot be, gives no angle; one at rest does."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from tests.trial.conftest import SHORT, Run
from wristctl.config.camera import Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.safety import SafetyStop
from wristctl.trial.tracking import InlineTracking
from wristctl.vision.camera import Frame, Image
from wristctl.vision.marker import Sighting, SightingVerdict, Tracker
from wristctl.vision.scene import Scene
from wristctl.vision.view import View

RATE = 60.0
OK, FROZEN, STAMP, TWICE = (SightingVerdict(name) for name in ("ok", "frozen", "stamp", "twice"))


class Replayed:
    """A camera that gives these frames, one a look, 30 ms after their time stamps as they should be."""

    name = "replayed"

    def __init__(self, frames: list[Frame]) -> None:
        self.frames, self.looks = frames, 0

    def newest(self) -> Frame | None:
        self.looks += 1
        return self.frames[self.looks - 1]

    def now(self) -> float:
        return (self.looks - 1) / RATE + 0.03

    def close(self) -> None:
        """Nothing is open."""


def seen(frames: list[Frame], noisy: bool = True) -> list[Sighting]:
    camera = Replayed(frames)
    tracking = InlineTracking(camera, Tracker(Markers(), View(), Gates()), now=camera.now, noisy=noisy)
    return [tracking.look()[0] for _ in frames]


def pictures(count: int, rate: float = 0.0, noise: float = 4.0) -> list[Image]:
    """Of a wrist that turns at a rate [rad/s]."""
    scene, rng = Scene(SceneSettings(noise=noise), WristParameters()), np.random.default_rng(1)
    return [scene.render(np.full((1, 4), 0.05 + 0.25 * rate * k / RATE), rng) for k in range(count)]


def in_time(images: list[Image]) -> list[Frame]:
    return [Frame(image, k / RATE, k) for k, image in enumerate(images)]


def ring(buffers: int) -> Callable[[list[Image], int], Image]:
    return lambda before, k: before[-buffers:][k % buffers]


def clocked(before: list[Image], k: int) -> Image:
    image = before[-1].copy()
    image[0, 0] = k % 256
    return image


def overlaid(before: list[Image], k: int) -> Image:
    image = before[-1].copy()
    image[:16, :80] = np.random.default_rng(k).integers(0, 255, (16, 80))
    return image


@pytest.mark.parametrize("rate", [0.0, 0.5], ids=["at rest", "in motion"])
@pytest.mark.parametrize("repeated", [ring(1), ring(2), ring(4), clocked, overlaid],
                         ids=["1 buffer", "2 buffers", "4 buffers", "a pixel changes", "a clock runs"])  # fmt: skip
def test_repeated_pictures_are_no_angle(rate: float, repeated: Callable[[list[Image], int], Image]) -> None:
    before = pictures(8, rate)
    shown = seen(in_time([*before, *(repeated(before, k) for k in range(24))]))
    assert [each.verdict for each in shown[:8]] == [OK] * 8
    told = [each.verdict for each in shown[8:]]
    assert set(told[4:]) == {FROZEN} and all(math.isnan(each.theta) for each in shown[12:])
    assert told.count(FROZEN) >= 23


@pytest.mark.parametrize("noise", [0.7, 4.0], ids=["a quiet sensor", "a webcam's"])
@pytest.mark.slow
def test_a_wrist_at_rest_is_not_frozen(noise: float) -> None:
    assert {each.verdict for each in seen(in_time(pictures(90, 0.0, noise)))} == {OK}


def test_a_camera_without_noise_gives_the_same_picture_of_a_wrist_at_rest_again_and_its_stamps_are_judged() -> None:
    images = pictures(12, 0.0, 0.0)
    assert all((image == images[0]).all() for image in images)
    assert {each.verdict for each in seen(in_time(images), noisy=False)} == {OK}
    assert {each.verdict for each in seen(in_time(images))[1:]} == {FROZEN}
    late = [frame._replace(time=frame.time + 0.05) for frame in in_time(images)]
    assert {each.verdict for each in seen(late, noisy=False)} == {STAMP}


@pytest.mark.parametrize("frozen", [False, True])
@pytest.mark.slow
def test_an_emulated_camera_without_noise_is_not_frozen_at_rest_and_is_found_by_its_wrist_if_it_is(
    experiment: Run, frozen: bool
) -> None:
    faults = ({"kind": "camera-frozen", "at": 0.05},) if frozen else ()
    bench = {**SHORT["bench"], "camera": {"scene": {"noise": 0.0}}, "faults": faults}
    done = experiment(bench=bench, reference={"duration": 0.4, "angle_deg": 25.0}, horizon=0.6)
    if not frozen:
        assert done.error is None and set(done.table("frames")["verdict"]) == {"ok"}
    else:
        assert isinstance(done.error, SafetyStop) and "does not follow its motors" in done.error.what
        assert "the camera shows old pictures" in done.error.what and done.table("log")["time"].max() < 0.4


@pytest.mark.slow
def test_a_picture_of_more_than_a_second_ago_is_news() -> None:
    first, second = pictures(2)
    frames = [Frame(first, 0.0, 0), Frame(second, 1.0 / RATE, 1), *in_time(pictures(70))[2:70]]
    frames[69] = frames[69]._replace(image=first)
    assert seen(frames)[69].verdict is OK
    frames[50] = frames[50]._replace(image=second)
    assert seen(frames)[50].verdict is FROZEN


@pytest.mark.parametrize(
    ("stamp", "refused"),
    [
        (lambda t: t + 0.05, range(4, 10)),  # in the future: frames come 30 ms after what they show
        (lambda t: 4 / RATE, range(5, 10)),  # constant
        (lambda t: t - 0.05, range(4, 7)),  # back, until it has caught up
        (lambda t: t - 2.0, range(4, 10)),
        (lambda t: t - 1e-3, ()),
    ],
    ids=["future", "constant", "back by 50 ms", "back by 2 s", "jitter"],
)
def test_stamps_that_cannot_be_are_refused(stamp: Callable[[float], float], refused: range) -> None:
    frames = [f._replace(time=stamp(f.time) if f.number > 3 else f.time) for f in in_time(pictures(10))]
    assert [k for k, each in enumerate(seen(frames)) if each.verdict is STAMP] == list(refused)


def test_a_count_of_frames_that_goes_back_is_refused() -> None:
    frames = in_time(pictures(5))
    frames[3] = frames[3]._replace(number=1)
    assert [each.verdict for each in seen(frames)] == [OK, OK, OK, STAMP, OK]


@pytest.mark.slow
def test_another_marker_of_the_same_id_is_named_as_long_as_it_is_there_and_the_first_one_followed() -> None:
    """The whole picture is searched every 150 ms, and again at once where something was found."""
    images = pictures(80, 0.1)
    tip = (slice(60, 130), slice(20, 90))
    scene = Scene(SceneSettings(), WristParameters())
    place = scene.camera.project(np.array([[-0.022, 0.0, -0.028]]))[0].astype(int)
    base = images[0][place[1] - 34 : place[1] + 36, place[0] - 35 : place[0] + 35]
    for image in images[30:60]:
        image[tip] = base
    shown = seen(in_time(images))
    first = next(k for k, each in enumerate(shown) if each.verdict is TWICE)
    assert 30 <= first <= 30 + 0.15 * 60.0
    assert {each.verdict for each in shown[first:60]} == {TWICE}
    assert {each.verdict for each in shown[:first] + shown[60:]} == {OK}
    ends = np.array([each.corners[0] for each in shown])
    assert np.abs(ends - ends[0]).max() < 1.0, "the impostor is never followed"
