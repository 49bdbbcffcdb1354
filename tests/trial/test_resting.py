"""What is looked at before a motor turns: how a slack wrist rests, its markers, light; each mistake by its name."""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
import pytest

from tests.trial.conftest import SHORT, WRIST, Run, settings_of
from wristctl.config.wrist import WristParameters
from wristctl.trial.resting import judge_looks, judge_rest, judge_slack, judge_weight, sag_of
from wristctl.trial.safety import SafetyStop
from wristctl.vision import detector
from wristctl.vision.detector import Detector
from wristctl.vision.marker import Sighting, SightingVerdict

UNSEEN = np.full((2, 4, 2), math.nan)
STEADY = 1e-3 * np.sin(np.arange(20.0))


def sightings(degrees: float, plane: int = 0, size: float = 1.0, noise: float = 1.0) -> list[Sighting]:
    """Frames of a wrist that rests at an angle, with some noise."""
    return [
        Sighting(k / 60.0, k, math.radians(degrees) + noise * off, SightingVerdict.OK, UNSEEN, size, plane=plane)
        for k, off in enumerate(STEADY)
    ]


def leaning(degrees: float, toward: float = 1.0) -> WristParameters:
    """A hanging wrist whose base leans so far."""
    along, aside = 9.81 * math.cos(math.radians(degrees)), 9.81 * math.sin(math.radians(degrees))
    return WRIST.model_copy(update={"gravity": (along, toward * aside)})


@pytest.mark.parametrize("plane", ["ulnar", "flexion"])
def test_a_sag_is_where_springs_and_weight_balance(plane: str) -> None:
    """For small angles torque over stiffness, by an arc whose end goes L/2 aside for a radian; mirrored by symmetry."""
    assert sag_of(WRIST, plane) == 0.0
    firm = leaning(1.0).model_copy(update={"stiffness": 50.0})
    arm = firm.hand_mass * (firm.length / 2.0 + firm.hand_offset) + firm.mass * firm.length / 6.0
    expected = firm.gravity[1] * arm / 50.0 if plane == "ulnar" else 0.0
    assert sag_of(firm, plane) == pytest.approx(expected, rel=0.02, abs=1e-12)
    assert sag_of(leaning(20.0, -1.0), plane) == pytest.approx(-sag_of(leaning(20.0), plane))
    assert sag_of(WRIST.model_copy(update={"hand_mass": 3.0}), plane) == math.inf


@pytest.mark.parametrize(
    ("degrees", "named"),
    [(0.0, None), (6.5, None), (-6.5, None), (7.5, "rests at 8 deg"), (-25.0, "rests at -25 deg"),
     (179.0, "upside down"), (-178.0, "upside down"), (91.0, "a quarter turn round"), (-88.0, "a quarter turn round")],
)  # fmt: skip
@pytest.mark.parametrize("camera", [0, 1])
def test_a_rest_far_off_and_a_marker_glued_on_otherwise_are_named(
    degrees: float, named: str | None, camera: int
) -> None:
    """Of two cameras too, with the camera's number."""
    planes = ("ulnar", "flexion")
    seen = sightings(0.0) + sightings(degrees, 1) if camera else sightings(degrees) + sightings(0.0, 1)
    if named is None:
        judge_rest(seen, settings_of(), WRIST, planes)
        return
    with pytest.raises(SafetyStop, match=rf"of camera {camera + 1} .*{named}"):
        judge_rest(seen, settings_of(), WRIST, planes)
    with pytest.raises(SafetyStop, match=named):
        judge_rest(sightings(degrees), settings_of(), WRIST, ("ulnar",))


def test_a_wrist_that_leans_as_it_says_may_rest_there() -> None:
    wrist = leaning(15.0)
    rests = math.degrees(sag_of(wrist, "ulnar"))
    assert 4.0 < rests < 7.0
    judge_rest(sightings(rests), settings_of(), wrist, ("ulnar",))
    judge_rest(sightings(rests - 6.5), settings_of(), wrist, ("ulnar",))
    with pytest.raises(SafetyStop, match="off where its weight should let it"):
        judge_rest(sightings(rests - 7.5), settings_of(), wrist, ("ulnar",))


@pytest.mark.parametrize("planes", [("ulnar",), ("ulnar", "flexion"), ("flexion",)])
def test_a_wrist_that_leans_on_a_tendon_is_not_slack(planes: tuple[str, ...]) -> None:
    """A tendon's path is shorter by what the wrist bends in its plane and across, where that is seen."""
    wrist, rig = leaning(6.0), settings_of()
    rests = sag_of(wrist, planes[0])
    most = 0.75 * 2.0 * rig.homing.pull / wrist.tendon_offset
    for share, refused in ((0.97, False), (1.03, True)):
        for bend in ((rests + share * most, 0.0), (rests - 0.5 * share * most, 0.5 * share * most),
                     (rests - share * most, math.nan)):  # fmt: skip
            if refused:
                with pytest.raises(SafetyStop, match="with slack tendons the wrist sags"):
                    judge_slack(bend, rig, wrist, planes)
            else:
                judge_slack(bend, rig, wrist, planes)


@pytest.mark.parametrize(("rig", "fix"), [(None, "wristctl hw slacken"), ("servos", "before the rig is")])
def test_a_taut_tendon_is_among_the_causes_with_how_to_let_it_go(rig: str | None, fix: str) -> None:
    """A wrist that a tendon pulls aside looks like one that leans: before anything has moved, and after."""
    settings = settings_of(rig=rig, calibration=None, positions="find")
    with pytest.raises(SafetyStop, match="a tendon is taut") as before:
        judge_rest(sightings(9.0), settings, WRIST, ("ulnar",))
    with pytest.raises(SafetyStop, match="a tendon is taut") as after:
        judge_slack((math.radians(9.0), 0.0), settings, WRIST, ("ulnar",))
    assert fix in str(before.value.fix) and fix in str(after.value.fix)


@pytest.mark.parametrize(("gravity", "how"), [((0.0, 9.81), "sags by 2"), ((0.0, -9.81), "sags by -2")])
def test_a_wrist_that_sags_too_far_by_its_own_account_is_refused(gravity: tuple[float, float], how: str) -> None:
    level = WRIST.model_copy(update={"gravity": gravity})
    with pytest.raises(SafetyStop, match=f"{how}.* deg under its weight, as wrist.gravity says"):
        judge_weight(settings_of(), level, ("ulnar",))
    judge_weight(settings_of(), level, ("flexion",))
    with pytest.raises(SafetyStop, match="buckles under its weight"):
        judge_weight(settings_of(), WRIST.model_copy(update={"hand_mass": 3.0}), ("ulnar",))


def test_markers_that_are_seen_unsteadily_are_named_by_what_scatters() -> None:
    """A reading is a mean of `homing.frames`; in two planes nothing goes by size."""
    rig = settings_of(homing={**SHORT["homing"], "frames": 4})
    limit = 2.0 * math.radians(0.4 * rig.homing.bend_deg) / float(np.std(STEADY))
    judge_rest(sightings(0.0, noise=0.95 * limit), rig, WRIST, ("ulnar",))
    with pytest.raises(SafetyStop, match="by the angle of the tip's"):
        judge_rest(sightings(0.0, noise=1.05 * limit), rig, WRIST, ("ulnar",))
    scale = WRIST.length / (2.0 * rig.markers.distance)
    sizes = np.exp(1.05 * limit * scale * STEADY)
    sized = [seen._replace(size=float(size)) for seen, size in zip(sightings(0.0), sizes, strict=True)]
    with pytest.raises(SafetyStop, match="by the size of the tip's"):
        judge_rest(sized, rig, WRIST, ("ulnar",))
    judge_rest([*sized, *sightings(0.0, 1)], rig, WRIST, ("ulnar", "flexion"))


@pytest.mark.parametrize("plane", [0, 1])
def test_what_scatters_in_either_plane_alone_is_refused(plane: int) -> None:
    """By the cameras of a board's rig, and by the looks of a rig of one's own."""
    rig = settings_of(homing={**SHORT["homing"], "frames": 4}, planes=2)
    limit = 2.0 * math.radians(0.4 * rig.homing.bend_deg) / float(np.std(STEADY))
    planes = ("ulnar", "flexion")
    steady = sightings(0.0, 1 - plane, noise=0.95 * limit)
    for noise, refused in ((0.95, False), (1.05, True)):
        seen = sorted([*steady, *sightings(0.0, plane, noise=noise * limit)], key=lambda sighting: sighting.plane)
        if not refused:
            judge_rest(seen, rig, WRIST, planes)
            judge_looks(seen, rig, "my_rig.py")
            continue
        with pytest.raises(SafetyStop, match=f"the markers of camera {plane + 1} are seen unsteadily"):
            judge_rest(seen, rig, WRIST, planes)
        with pytest.raises(SafetyStop, match="the bend is seen unsteadily"):
            judge_looks(seen, rig, "my_rig.py")


@pytest.mark.parametrize("name", detector._OTHERS)
def test_a_print_of_another_dictionary_is_known_and_one_of_ours_is_none(name: str) -> None:
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
    print_ = cv2.aruco.generateImageMarker(dictionary, 1, 120)
    picture = np.pad(np.asarray(print_, np.uint8), 80, constant_values=255)
    assert Detector().other_dictionary(picture) is not None
    ours = np.pad(np.kron(detector.print_of(1), np.ones((20, 20), np.uint8)), 80, constant_values=255)
    assert Detector().other_dictionary(ours) is None
    assert Detector().other_dictionary(np.full((240, 320), 200, np.uint8)) is None


TURNED, SLACK = {"kind": "marker-turned", "since": "power-on", "at": 0.0}, {"slack": (6e-3,) * 4}
MISTAKES: dict[str, tuple[dict[str, Any], str]] = {
    "upside down": ({"faults": ({**TURNED, "size": 180.0},)}, "sits upside down"),
    "a quarter turn": ({"faults": ({**TURNED, "size": -90.0},)}, "a quarter turn round"),
    "dim and noisy": ({"camera": {"scene": {"contrast": 0.25, "noise": 12.0}}}, "seen unsteadily"),
    "camera 15 deg off": ({"camera": {"scene": {"pan_deg": 15.0}}}, "off square"),
    "5 deg out of plumb": ({"plant": {"tilt_deg": 5.0}, "motors": SLACK}, "where its weight should let it"),
    "10 deg out of plumb": ({"plant": {"tilt_deg": -10.0}, "motors": SLACK}, "where its weight should let it"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
@pytest.mark.slow
def test_what_can_be_seen_at_rest_is_refused_before_a_motor_turns(experiment: Run, mistake: str) -> None:
    bench, named = MISTAKES[mistake]
    done = experiment(calibration=None, positions="find", homing={"frames": 5}, bench={**SHORT["bench"], **bench})
    assert isinstance(done.error, SafetyStop) and named in done.error.what, done.error
    assert done.bench.motion().last_step == (None,) * 4


@pytest.mark.slow
def test_a_wrist_that_little_slack_holds_up_is_found_out_when_its_tendons_are_let_out(experiment: Run) -> None:
    bench = {**SHORT["bench"], "plant": {"tilt_deg": 5.0}, "motors": {"slack": (3e-4,) * 4}}
    done = experiment(calibration=None, positions="find", homing={"frames": 5}, bench=bench)
    assert isinstance(done.error, SafetyStop) and "with slack tendons the wrist sags" in done.error.what, done.error


@pytest.mark.slow
def test_a_hanging_wrist_five_degrees_out_of_plumb_is_homed(experiment: Run) -> None:
    hanging = WRIST.model_copy(update={"gravity": (9.81, 0.0)})
    bench = {**SHORT["bench"], "plant": {"tilt_deg": 5.0}, "motors": {"slack": (3e-4,) * 4}}
    done = experiment(wrist=hanging, calibration=None, positions="find", homing={"frames": 5}, bench=bench)
    assert done.error is None, done.error
