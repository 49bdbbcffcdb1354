"""What a camera gives is measured, and said where it is why there is no angle."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wristctl.trial.camera_pace import FIX, CameraPace, CameraPaces
from wristctl.vision.camera import CameraError
from wristctl.vision.marker import Sighting, SightingVerdict

OK = SightingVerdict.OK


def pace(
    rate: float, latency: float, count: int = 60, verdict: SightingVerdict = OK, jitter: float = 0.0
) -> CameraPace:
    """Pictures that come by the jitter too early and too late in turn."""
    made = CameraPace()
    for k in range(count):
        time = k / rate
        came = time + latency + jitter * (-1) ** k
        made.add(Sighting(time, k, 0.1 if verdict is OK else math.nan, verdict, np.zeros((2, 4, 2)), came=came))
    return made


@pytest.mark.parametrize(("rate", "latency"), [(60.0, 0.033), (15.0, 0.06), (30.0, 0.0)])
def test_rate_latency_and_evenness_are_those_of_the_pictures(rate: float, latency: float) -> None:
    even = pace(rate, latency)
    assert even.rate == pytest.approx(rate) and even.latency == pytest.approx(latency, abs=1e-9)
    assert even.jitter == pytest.approx(0.0, abs=1e-9)
    assert even.oldest() == pytest.approx(latency + 2.0 / rate)
    assert pace(rate, latency, 61, jitter=2e-3).jitter == pytest.approx(1.4826 * 4e-3, rel=0.05)


def test_pictures_that_nobody_saw_are_no_jitter_but_cost_rate() -> None:
    made = CameraPace()
    for k in range(0, 60, 2):
        made.add(Sighting(k / 60.0, k, 0.0, OK, np.zeros((2, 4, 2)), came=k / 60.0))
    assert made.rate == pytest.approx(30.0) and math.isnan(made.jitter)


def test_a_pause_between_two_looks_costs_no_rate_and_a_lost_picture_does() -> None:
    made = CameraPace()
    times = [*np.arange(40) / 60.0, *(5.0 + np.arange(40) / 60.0)]
    for k, time in enumerate(times):
        made.add(Sighting(time, k, 0.0, OK, np.zeros((2, 4, 2)), came=time))
    assert made.rate == pytest.approx(60.0)
    made.add(Sighting(5.0 + 49 / 60.0, 90, 0.0, OK, np.zeros((2, 4, 2)), came=5.0 + 49 / 60.0))
    assert made.rate == pytest.approx(79.0 / (88.0 / 60.0))


def test_a_camera_that_freezes_for_a_second_again_and_again_is_slow() -> None:
    made, time = CameraPace(), 0.0
    for k in range(80):
        time += 0.9 if k % 20 == 19 else 1.0 / 30.0
        made.add(Sighting(time, k, 0.0, OK, np.zeros((2, 4, 2)), came=time))
    assert made.rate < 15.0


def test_the_cause_of_a_missing_angle_is_the_cameras_own() -> None:
    slow = pace(15.0, 0.133)
    why, fix = slow.missing(59 / 15.0 + 0.14, 0.15)
    assert why == "newest frame: ok; the camera gives 15 pictures/s, 133 ms old when they come"
    assert "device.fourcc" in fix and "safety.stale of 0.3 s" in fix
    assert slow.missing(59 / 15.0 + 0.133 + 0.16, 0.15)[0].startswith("no picture has come; until then camera gives 15")
    assert CameraPace().missing(1.0, 0.15)[0] == "no picture has come"
    uneven = pace(60.0, 0.0, 61, jitter=4e-3)
    assert "unevenly (+-12 ms)" in uneven.missing(1.0, 0.15)[0]


@pytest.mark.parametrize("verdict", [each for each in SightingVerdict if each is not OK])
def test_each_verdict_has_its_own_way_out(verdict: SightingVerdict) -> None:
    assert pace(60.0, 0.033, verdict=verdict).missing(1.1, 0.15) == (f"newest frame: {verdict}", FIX[verdict])


@pytest.mark.parametrize(
    ("rate", "latency", "fits"), [(60.0, 0.033, True), (30.0, 0.067, True), (15.0, 0.01, True), (15.0, 0.03, False)]
)
def test_a_camera_fits_a_limit_where_one_lost_picture_stays_below_it(rate: float, latency: float, fits: bool) -> None:
    if fits:
        pace(rate, latency).fits(0.15)
        return
    with pytest.raises(CameraError, match=r"15 pictures/s.*beyond safety.stale \(150 ms\)") as refused:
        pace(rate, latency).fits(0.15)
    assert refused.value.exit_code == 4


def test_the_summary_counts_what_could_not_be_used() -> None:
    made = pace(60.0, 0.033)
    assert made.summary() == "The camera gives 60 pictures/s, 33 ms old when they come."
    made.add(Sighting(2.0, 99, math.nan, SightingVerdict.TWICE, np.zeros((2, 4, 2)), came=2.03))
    assert made.summary().endswith("; of 61 pictures 1 twice.")


def test_of_two_cameras_the_one_whose_angles_are_missing_is_named() -> None:
    paces = CameraPaces()
    paces.expect(2)
    assert paces.missing(0.5, 0.15)[0] == "no picture of camera 1 has come"
    for k in range(60):
        for plane, verdict in ((0, OK), (1, OK if k < 20 else SightingVerdict.NO_TIP)):
            time = k / 60.0
            paces.add(Sighting(time, k, 0.1, verdict, np.zeros((2, 4, 2)), came=time + 0.03, plane=plane))
    assert paces.missing(1.0, 0.15)[0] == "newest frame of camera 2: no tip"
    assert (
        paces.summary().startswith("Camera 1 gives 60 pictures/s") and "Camera 2 gives 60 pictures/s" in paces.summary()
    )
    paces.fits(0.15)
    with pytest.raises(CameraError, match="camera 1 gives 60 pictures/s"):
        paces.fits(0.05)


def test_one_camera_is_the_camera() -> None:
    paces = CameraPaces()
    paces.expect(1)
    assert paces.missing(0.5, 0.15)[0] == "no picture has come"
    assert paces.summary() == "The camera gives no pictures."
