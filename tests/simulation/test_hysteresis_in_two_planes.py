"""Hysteresis in two planes: one plane's numbers along it, a balance of energy, and dead bands at the statics' roots."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from wristctl.config.hysteresis import HysteresisSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.hysteresis import HysteresisLoop, dead_bands, loops
from wristctl.simulation.strokes import FrictionCase, Strokes, strokes, why_in_two_planes
from wristctl.wrist.spatial.spatial_model import spatial_linearised
from wristctl.wrist.spatial.spatial_segments import own_values

DRAWN = ({"angle_deg": 10.0}, {"angle_deg": 100.0, "radius": 0.012}, {"angle_deg": 170.0}, {"angle_deg": 260.0})


def _strokes(tendons: object = "four", toward_deg: float = 0.0, **settings: Any) -> Strokes:
    chosen = {"ranges_deg": ((0.0, 20.0),), "frequencies": (0.1,), "sheaths": (1.0,), "angles_deg": ()}
    wrist = WristParameters.model_validate({"tendons": tendons})
    return strokes(wrist, HysteresisSettings.model_validate(chosen | {"toward_deg": toward_deg} | settings))


def _loop(*given: object, **settings: Any) -> HysteresisLoop:
    return loops(_strokes(*given, **settings))[0]  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize("drive", ["spools", "tensions"])
def test_along_a_plane_both_planes_have_the_loop_of_one(drive: str) -> None:
    one, two = _loop("four", 0.0, drive=drive), _loop("four", 360.0, drive=drive)
    assert (one.toward, len(two.toward)) == ((1.0,), 2) and two.aside < 1e-9
    np.testing.assert_allclose(two.bend, one.bend, atol=1e-6)
    for name in ("friction_work", "raw_work", "damped_work", "width", "exact_width"):
        assert getattr(two, name) == pytest.approx(getattr(one, name), rel=1e-4), name
    np.testing.assert_allclose(two.course.spool.sum(axis=1), one.course.spool.sum(axis=1), rtol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(("tendons", "toward_deg"), [("three", 0.0), ("three", 75.0), (DRAWN, 45.0)])
def test_what_the_spools_give_in_a_cycle_friction_and_damping_take(tendons: object, toward_deg: float) -> None:
    """Beside it the line integral of torque over bend, of pulls times moment arms at each sample of the course."""
    held = _strokes(tendons, toward_deg)
    loop = loops(held)[0]
    assert loop.drift == 0.0 and loop.friction_work > 1e-3 and loop.damped_work > 1e-3
    assert loop.raw_work == pytest.approx(loop.friction_work + loop.damped_work, rel=5e-3)
    travel = loop.course.given - loop.course.spool / (held.settings.tendon_stiffness * held.layout.multiplicity)
    area = sum(np.trapezoid(pull, path) for pull, path in zip(loop.course.spool.T, travel.T, strict=True))
    assert area == pytest.approx(loop.raw_work, rel=2e-2)
    assert 0.0 < loop.exact_width < loop.width < 2.0 * loop.exact_width
    off = loop.course.bends - np.outer(loop.bend, loop.toward)
    assert loop.aside == pytest.approx(np.hypot(*off.T).max(), rel=1e-9) and loop.aside < 0.1 * loop.bend.max()


@pytest.mark.slow
@pytest.mark.parametrize(("tendons", "toward_deg"), [("three", 0.0), (DRAWN, 45.0)])
def test_ramps_come_to_rest_at_the_roots_of_the_statics(tendons: object, toward_deg: float) -> None:
    (band,) = dead_bands(_strokes(tendons, toward_deg, angles_deg=(10.0,)))
    assert band.slid and band.exact_below < band.unhindered < band.exact_above
    assert band.width == pytest.approx(band.exact_width, rel=0.02)


@pytest.mark.parametrize(("tendons", "toward_deg"), [("three", 30.0), (DRAWN, 45.0)])
def test_spools_hold_the_wrist_along_the_line_with_no_tendon_below_pretension(
    tendons: object, toward_deg: float
) -> None:
    held = _strokes(tendons, toward_deg)
    values, still = own_values(held.wrist, held.settings.segments), 0.0 * held.theta
    r = spatial_linearised(values, held.theta, still, still, held.pulls)[0]
    assert np.abs(r).max() < 1e-8 and held.pulls.min() >= held.wrist.pretension - 1e-9
    assert (held.pulls.min(axis=1) < held.wrist.pretension + 1e-6).all(), "with the least sum of pulls"
    free = held.exact([FrictionCase(0.0, 0.0, 2e-5)] * 3, np.radians([5.0, 10.0, 15.0]))
    np.testing.assert_allclose(free, np.radians([[5.0] * 2, [10.0] * 2, [15.0] * 2]), atol=1e-6)


def test_what_bends_in_two_planes_says_why() -> None:
    settings, wrist = HysteresisSettings(), WristParameters()
    assert why_in_two_planes(wrist, settings) == ""
    assert "60 deg" in why_in_two_planes(wrist, settings.model_copy(update={"toward_deg": 60.0}))
    assert "tendons" in why_in_two_planes(wrist.model_copy(update={"tendons": "three"}), settings)
    across = wrist.model_copy(update={"gravity_flexion": 9.81})
    assert "gravity" in why_in_two_planes(across, settings)


def test_a_bend_that_takes_more_than_a_tendon_bears_is_refused() -> None:
    wrist = WristParameters.model_validate({"tendons": "three", "tension_limit": 4.0})
    with pytest.raises(UserError, match=r"above wrist\.tension_limit"):
        strokes(wrist, HysteresisSettings(ranges_deg=((0.0, 30.0),), angles_deg=(5.0,)))


@pytest.mark.slow
@pytest.mark.parametrize("tendons", ["four", "three"])
def test_a_wrist_that_is_stiffened_by_its_tendons_has_more_friction(tendons: str) -> None:
    """Pulls of no place fall below those that stiffen it, in one plane and in two; friction goes by pulls."""
    plain, stiff = _strokes(tendons), _strokes(tendons, stiffness=16.0 if tendons == "four" else 12.0)
    alike = stiff.layout.multiplicity
    assert (stiff.pulls / alike).min() > 1.5 * plain.wrist.pretension
    first, second = loops(plain)[0], loops(stiff)[0]
    assert second.friction_work > 1.1 * first.friction_work and second.width > first.width
