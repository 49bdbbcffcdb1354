"""Co-contraction: what it makes of a wrist's stiffness, held against rests of the simulated wrist under a load."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.errors import UserError
from wristctl.simulation.closed_loop import follow
from wristctl.simulation.motion import Motion, resting
from wristctl.simulation.spool_driven import SpooledWrist, spooled
from wristctl.wrist.spatial.co_contraction import against_each_other, held_wrist, least_pulls, most_stiffness
from wristctl.wrist.spatial.spatial_model import spatial_terms
from wristctl.wrist.spatial.spatial_segments import own_values
from wristctl.wrist.tendon_layout import TendonLayout

DRAWN = ({"angle_deg": 0.0}, {"angle_deg": 100.0, "radius": 0.012}, {"angle_deg": 220.0})
OVER, H = math.radians(1.0), 1e-3


def _wrist(tendons: object, **more: object) -> WristParameters:
    return WristParameters.model_validate({"tendons": tendons, **more})


def _loop(stiffness: float | None, **more: object) -> Loop:
    return Loop.model_validate({"actuator": {"level": "tendon"}, "stiffness": stiffness, **more})


@pytest.mark.parametrize("tendons", ["three", "four", "five", DRAWN])
def test_pulls_against_each_other_give_no_torque_and_nobody_pushes(tendons: object) -> None:
    wrist = _wrist(tendons)
    layout = TendonLayout.of(wrist)
    pulls, arms = against_each_other(wrist, layout), layout.moment_arms(np.zeros(2), wrist.length, wrist.discs)
    assert np.abs(pulls @ arms).max() < 1e-9 * wrist.tendon_radius and pulls.min() >= 0.0
    assert pulls.max() == pytest.approx(1.0)
    np.testing.assert_array_equal(pulls > 0.0, np.hypot(*arms.T) > 0.0)


def _rests(wrist: WristParameters, loop: Loop, ways: Array, torque: float) -> tuple[Array, Array]:
    """Bends (W, 2) [rad] of the simulated wrist at rest on held spools, and the torques (W, 2) [N m] of what loads it.

    That is weight, of so much torque on the straight wrist, along each way (W, 2).
    """
    layout = TendonLayout.of(wrist)
    spools = least_pulls(wrist, loop, layout) / (layout.multiplicity * loop.actuator.tendon_stiffness)
    straight = np.zeros((1, 2))

    def weight(at: Array, gravity: Array) -> Array:
        loaded = wrist.model_copy(update={"gravity": (wrist.gravity[0], gravity[0]), "gravity_flexion": gravity[1]})
        differ = [spatial_terms(own_values(one, 1), at, 0.0 * at).bias for one in (wrist, loaded)]
        return np.asarray(differ[0] - differ[1])[0]

    size = torque / np.hypot(*weight(straight, np.array([1.0, 0.0])))
    wrists = [
        wrist.model_copy(update={"gravity": (wrist.gravity[0], size * y), "gravity_flexion": size * z}) for y, z in ways
    ]
    actuator = Actuator(level="tendon", friction=0.0)
    lanes = [SpooledWrist(one, actuator, np.zeros(2), planes=2) for one in wrists]
    done = spooled(lanes, lambda time, which: np.tile(spools[:, None], (len(time), 1, len(which))), 3001, H, 100)
    bends = done.bends[:, -1]
    assert np.abs(done.bends[:, -1] - done.bends[:, -3]).max() < 1e-6, "at rest"
    return bends, np.array([weight(bend[None], size * way) for bend, way in zip(bends, ways, strict=True)])


@pytest.mark.slow
@pytest.mark.parametrize(("tendons", "stiffness"), [("three", 10.0), ("three", None), (DRAWN, 4.5)])
def test_a_load_bends_the_simulated_wrist_as_little_as_its_stiffness_says(
    tendons: object, stiffness: float | None
) -> None:
    """Torque over bend of the simulated wrist at some 1 deg, all around; none is less than what was asked for."""
    wrist, loop = _wrist(tendons), _loop(stiffness)
    layout, around = TendonLayout.of(wrist), np.radians(np.arange(0.0, 360.0, 15.0))
    held = held_wrist(wrist, loop, layout)._replace(pulls=least_pulls(wrist, loop, layout))
    least, _ = held.over(OVER)
    ways = np.stack([np.cos(around), np.sin(around)], axis=1)
    bends, torques = _rests(wrist, loop, ways, least * OVER)
    np.testing.assert_allclose(held.torque(bends), torques, atol=2e-3 * np.abs(torques).max())
    found = (torques * bends).sum(axis=1) / (bends**2).sum(axis=1)
    assert found.min() > 0.98 * least
    if tendons == "three":
        assert found.min() == pytest.approx(least, rel=0.05)
    if stiffness is not None:
        assert least == pytest.approx(stiffness, rel=1e-6)
        assert held_wrist(wrist, loop, layout).over(OVER)[0] < 0.8 * stiffness


def test_small_bends_are_stiffened_by_no_pull_and_larger_ones_up_to_all_tendons_together() -> None:
    wrist, loop = _wrist("three"), _loop(None)
    layout = TendonLayout.of(wrist)
    small = [held_wrist(wrist, loop, layout, pull).over(1e-5)[0] for pull in (0.0, 10.0, 40.0)]
    assert small[0] > small[1] > small[2] > 0.99 * small[0]
    wide = [held_wrist(wrist, loop, layout, pull).over(OVER)[0] for pull in (0.0, 3.0, 20.0)]
    assert wide[0] < 0.6 * small[0] < wide[1] < wide[2] < small[0]
    assert most_stiffness(wrist, loop, layout, OVER) == pytest.approx(small[0], rel=5e-3)
    on_pulls = [held_wrist(wrist, Loop(), layout, pull).over(OVER)[0] for pull in (0.0, 20.0)]
    assert on_pulls[1] < on_pulls[0] < 0.1 * small[0], "held pulls buckle rather than stiffen"


def test_both_sides_of_one_plane_have_a_null_space_too() -> None:
    wrist, loop = WristParameters(), _loop(15.0)
    pulls = least_pulls(wrist, loop, None)
    assert pulls[0] == pulls[1] > 2.0 * wrist.pretension
    held = held_wrist(wrist, loop, None)._replace(pulls=pulls)
    assert held.over(OVER)[0] == pytest.approx(15.0, rel=1e-6)


def test_both_sides_of_one_plane_are_looked_at_for_the_least_stiffness() -> None:
    """Weight across the plane stiffens one side more than the other; mirrored, the sides are exchanged."""
    leaning = WristParameters(gravity=(-4.0, 9.0))
    mirrored = leaning.model_copy(update={"gravity": (-4.0, -9.0)})
    one, other = (held_wrist(wrist, _loop(None), None) for wrist in (leaning, mirrored))
    least, most = one.over(OVER)
    assert most > least * (1.0 + 1e-4)
    np.testing.assert_allclose(other.over(OVER), (least, most), rtol=1e-9)


def test_the_stiffness_of_a_turned_wrist_is_the_same() -> None:
    """Places turned by a quarter; the wrist hangs and is equally stiff all around, so nothing else turns."""
    turned = tuple({**place, "angle_deg": place["angle_deg"] + 90.0} for place in DRAWN)
    one, other = (
        held_wrist(wrist, _loop(None), TendonLayout.of(wrist)).over(OVER) for wrist in (_wrist(DRAWN), _wrist(turned))
    )
    assert one[1] > 2.0 * one[0]
    np.testing.assert_allclose(other, one, rtol=1e-9)


def test_a_stiffness_beyond_what_tendons_give_is_refused_with_what_they_give() -> None:
    wrist = _wrist("three")
    with pytest.raises(UserError, match=r"no stiffer than 12\.3 N m/rad") as caught:
        least_pulls(wrist, _loop(30.0), TendonLayout.of(wrist))
    assert "6.64 to 12.3" in caught.value.fix
    with pytest.raises(UserError, match="only tendons that stretch do"):
        least_pulls(wrist, Loop(stiffness=10.0), TendonLayout.of(wrist))


def _followed(motion: Motion, wrist: WristParameters, stiffness: float | None) -> Array:
    law = controller("ct-dob")
    return follow(law, np.array(gains_of(law, "default")), motion, wrist, _loop(stiffness)).trajectory.tension


@pytest.mark.slow
def test_a_loop_rests_at_the_pulls_that_stiffen_its_wrist() -> None:
    """In one plane and in two; without the setting at pretension."""
    for tendons, still, layout in (("four", np.zeros(1), None), ("three", np.zeros(2), TendonLayout.three(0.02))):
        wrist, motion = _wrist(tendons), resting(still, 50, 1e-3)
        alike = 2.0 if layout is None else 1.0
        wanted = least_pulls(wrist, _loop(12.0), layout) / alike
        np.testing.assert_allclose(_followed(motion, wrist, 12.0)[-1], wanted, rtol=1e-6)
        np.testing.assert_allclose(_followed(motion, wrist, None)[-1], wrist.pretension, rtol=1e-6)
        assert wanted.min() > 1.1 * wrist.pretension
