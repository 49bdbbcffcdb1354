"""When the bench's camera takes its frames, which get through, and what an exposure is made of."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
import pytest

from wristctl.bench.faults import CameraFaults, Faults
from wristctl.bench.shutter import Shutter
from wristctl.config.bench import InjectedFault, RenderedCamera


class Turning:
    """A wrist of two segments that turns at a steady rate [rad/s]."""

    def __init__(self, rate: float = 0.0, time: float = 10.0) -> None:
        self.rate, self.time = rate, time

    def angles(self, times: np.ndarray) -> np.ndarray:
        return 0.5 * self.rate * np.stack([times, times], axis=-1)

    def across(self, time: float) -> float:
        return 0.1 * self.rate * time

    def turned(self, ends: np.ndarray) -> float:
        return abs(float(np.diff(ends.sum(axis=-1))[0]))


def shutter(wrist: Any = None, *faults: InjectedFault, **camera: Any) -> Shutter:
    known = Faults(faults)
    known.begin(0.0)
    settings = RenderedCamera.model_validate({"frame_rate": 50.0, "dropped": 0.0, "exposure": 0.01, **camera})
    seen: Any = wrist or Turning()
    return Shutter(settings, known, seen, (1, 2))


@pytest.mark.parametrize(
    ("time", "delay", "newest"),
    [(1.0, 0.02, 49), (1.0199, 0.02, 49), (1.02, 0.02, 50), (1.0, 0.0, 49), (1.005, 0.0, 50), (0.004, 0.0, -1)],
)
def test_a_frame_is_there_once_its_delay_and_at_least_half_its_exposure_are_over(
    time: float, delay: float, newest: int
) -> None:
    assert shutter(Turning(time=time)).newest(delay) == newest


def test_the_delay_is_in_frames() -> None:
    assert shutter(delay_frames=2.5).delay == pytest.approx(0.05)


@pytest.mark.parametrize(("degrees", "parts"), [(0.0, 1), (0.2, 1), (0.3, 2), (-0.6, 3), (1.9, 8), (9.0, 8)])
def test_an_exposure_is_drawn_in_parts_of_a_quarter_degree_and_eight_at_most(degrees: float, parts: int) -> None:
    rate = np.radians(degrees) / 0.01
    exposure = shutter(Turning(float(rate))).expose(100)
    assert exposure.theta.shape == (parts, 2)
    assert exposure.theta.sum(axis=1).mean() == pytest.approx(rate * 2.0, abs=1e-9), "around its middle"
    if parts > 1:
        turned = np.diff(exposure.theta.sum(axis=1))
        assert turned == pytest.approx(np.full(parts - 1, rate * 0.01 / parts)), "evenly over its time"


def test_frames_are_numbered_and_timed_by_the_frame_rate() -> None:
    exposure = shutter().expose(75)
    assert (exposure.number, exposure.shown, exposure.time) == (75, 75, 1.5)
    assert not exposure.covered and not exposure.swapped


def test_each_frame_has_its_own_noise_by_its_number_in_its_stream() -> None:
    taken = shutter()
    assert taken.expose(3).noise == (1, 2, 3)
    taken.begin(0.2, (7,))
    taken.begin(0.41, (8, 9))
    noises = {number: taken.expose(number).noise for number in (9, 10, 20, 21, 30)}
    assert noises == {9: (1, 2, 9), 10: (7, 0), 20: (7, 10), 21: (8, 9, 0), 30: (8, 9, 9)}


def test_a_frozen_camera_shows_the_last_frame_before_it_froze() -> None:
    frozen = shutter(Turning(1.0), InjectedFault(kind="camera-frozen", at=0.51, duration=0.2))
    exposure = frozen.expose(30)
    assert (exposure.number, exposure.shown, exposure.time) == (30, 25, 0.6)
    assert exposure.theta.sum(axis=1).mean() == pytest.approx(0.5) and exposure.noise == (1, 2, 25)
    assert frozen.expose(40).shown == 40 and frozen.expose(25).shown == 25


def test_a_ring_shows_its_last_pictures_again_and_again_and_a_frozen_camera_one() -> None:
    for kind, pictures in (("camera-repeats", {23, 24, 25}), ("camera-frozen", {25}), ("camera-frozen-clock", {25})):
        fault = InjectedFault.model_validate({"kind": kind, "at": 0.51, "size": 3.0})
        shown = [shutter(None, fault).expose(number).shown for number in range(26, 38)]
        assert set(shown) == pictures and all(one == other for one, other in zip(shown, shown[3:], strict=False))
        assert shown[:3] == sorted(shown[:3]), "in the order in which they were taken"


@pytest.mark.parametrize(("kind", "which"), [("marker-covered", "covered"), ("markers-swapped", "swapped")])
def test_only_its_own_fault_covers_or_swaps(kind: Any, which: str) -> None:
    taken = shutter(None, InjectedFault(kind=kind, at=0.5, duration=0.1))
    for number, on in ((24, False), (25, True), (29, True), (31, False)):
        exposure = taken.expose(number)
        assert getattr(exposure, which) == on and exposure.covered + exposure.swapped == on


def test_a_marker_that_peels_turns_from_when_it_began_and_one_that_is_turned_stands_askew() -> None:
    peels = InjectedFault(kind="marker-peels", at=1.0, size=3.0, duration=2.0)
    askew = InjectedFault(kind="marker-turned", at=2.0, size=-5.0)
    taken = shutter(None, peels, askew)
    turned = [math.degrees(taken.expose(number).turned) for number in (49, 50, 75, 125, 160)]
    assert turned == pytest.approx([0.0, 0.0, 1.5, 4.5 - 5.0, -5.0], abs=1e-12)


def test_frames_are_lost_by_chance_and_by_fault() -> None:
    some = shutter(dropped=0.25)
    assert np.mean([some.arrives(k) for k in range(2000)]) == pytest.approx(0.75, abs=0.04)
    assert all(shutter().arrives(k) for k in range(100))
    faulty = shutter(None, InjectedFault(kind="frames-dropped", at=0.5, duration=0.1))
    assert [faulty.arrives(k) for k in (24, 25, 29, 31)] == [True, False, False, True]


def test_a_phase_puts_exposures_off_by_a_share_of_a_frame() -> None:
    """Of 50 frames a second by 8 ms: frame 49 is from 0.988 s, and there 20 ms later."""
    late = shutter(Turning(time=1.0079), phase=0.4)
    assert late.expose(49).time == pytest.approx(0.988)
    assert late.newest(0.02) == 48 and shutter(Turning(time=1.0081), phase=0.4).newest(0.02) == 49
    late.begin(0.99, (7,))
    assert late.expose(50).noise == (7, 0) and late.expose(49).noise == (1, 2, 49)


def test_a_jitter_holds_each_frame_back_by_a_time_of_its_own_and_changes_no_picture() -> None:
    wrist = Turning(time=1.0)
    jittered, steady = shutter(wrist, jitter=0.02, delay_frames=1.0), shutter(wrist, delay_frames=1.0)
    late = np.array([jittered.late(number) for number in range(200)])
    assert 0.0 <= late.min() < 0.002 and 0.018 < late.max() < 0.02 and late.mean() == pytest.approx(0.01, abs=0.002)
    assert [jittered.late(number) for number in range(200)] == late.tolist()
    for number in (46, 47, 48, 49):
        there = number * 0.02 + 0.02 + late[number] <= 1.0 + 1e-9
        assert jittered.has_arrived(number) == there and steady.has_arrived(number)
        assert jittered.expose(number).noise == steady.expose(number).noise
    assert jittered.expose(46).late == late[46] and steady.expose(46).late == 0.0


def test_a_jitter_of_more_than_a_frame_is_refused() -> None:
    with pytest.raises(ValueError, match="jitter"):
        RenderedCamera(frame_rate=50.0, jitter=0.021)


@pytest.mark.parametrize(("phase", "shown"), [(0.0, 25), (0.4, 24)])
def test_a_frozen_camera_shows_the_last_frame_exposed_before_it_froze(phase: float, shown: int) -> None:
    frozen = shutter(None, InjectedFault(kind="camera-frozen", at=0.5), phase=phase)
    assert frozen.expose(40).shown == shown and frozen.expose(shown).shown == shown


@pytest.mark.parametrize("camera", [1, 2])
def test_a_fault_added_while_the_rig_stands_reaches_the_camera_it_is_of(camera: Literal[1, 2]) -> None:
    schedule = Faults(())
    cameras = {number: CameraFaults(schedule, number) for number in (1, 2)}
    schedule._faults = (InjectedFault(kind="camera-lost", at=1.0, camera=camera),)
    schedule.begin(3.0)
    own, other = cameras[camera], cameras[3 - camera]
    assert own.on("camera-lost", 4.0) and not own.on("camera-lost", 3.9)
    assert own.next("camera-lost", 0.0) == own.since("camera-lost", 4.0) == 4.0
    assert not other.on("camera-lost", 4.0) and other.next("camera-lost", 0.0) == math.inf
    assert other.of(("camera-lost",)) == [] and len(own.of(("camera-lost",))) == 1
