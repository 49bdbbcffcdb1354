"""The sliding laws' surfaces, and how loops come to them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.stability.conftest import row
from wristctl.config.loop import Loop
from wristctl.control.table import CONTROLLERS
from wristctl.simulation.worlds import Draws
from wristctl.stability.phase_portrait import phase_portrait

SLIDING = [name for name in CONTROLLERS if CONTROLLERS[name].surface is not None]


WEIGHTS: dict[str, tuple[str, str | None, str | None]] = {
    "smc": ("P1", "P2", None),
    "smc-tracking": ("lambda", None, "kappa"),
    "super-twisting": ("lambda", None, None),
    "smc-dob": ("Kp", "Kd", None),
}
"""Gains by which each law's sigma weighs error, rate (None: by 1) and integral (None: not)."""


def test_the_sliding_laws_say_what_their_surface_is() -> None:
    assert SLIDING == ["smc", "smc-tracking", "super-twisting", "smc-dob"]


@pytest.mark.parametrize("name", SLIDING)
def test_courses_come_into_the_layer_and_end_at_rest(name: str) -> None:
    own = row(name, {"smc": "hardware"}.get(name, "default"), Loop())
    theta = math.radians(15.0)
    found = phase_portrait(own.law, own.gains, own.loop, own.wrist, theta, 1.5, Draws(0))
    assert found is not None and len(found.courses) == 4
    assert [np.degrees(each.error[0]) for each in found.courses] == pytest.approx([-20.0, -10.0, 10.0, 20.0], abs=0.1)
    for each in found.courses:
        assert 0.0 <= each.reached < 0.5 and abs(each.error[-1]) < math.radians(0.2)
        a, b, c = WEIGHTS[name]
        integral = np.cumsum(each.error) * 1e-3 * (own.gains[c] if c else 0.0)
        sigma = own.gains[a] * each.error + (own.gains[b] if b else 1.0) * each.rate + integral
        np.testing.assert_allclose(each.sigma, sigma)
        assert found.slope == pytest.approx(own.gains[a] / (own.gains[b] if b else 1.0))
        late = each.time >= each.reached
        assert np.abs(each.sigma[late]).max() <= own.law.surface.layer(own.gains)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("degrees", "errors"),
    [(-45.0, (-5.0, -2.5, 10.0, 20.0)), (45.0, (-20.0, -10.0, 2.5, 5.0)), (-20.0, (-20.0, -10.0, 10.0, 20.0)),
     (50.0, (-20.0, -10.0))],
)  # fmt: skip
def test_courses_begin_within_the_range(degrees: float, errors: tuple[float, ...]) -> None:
    own = row("smc-tracking", "default", Loop())
    assert own.wrist.range_deg == 50.0
    found = phase_portrait(own.law, own.gains, own.loop, own.wrist, math.radians(degrees), 0.01, Draws(0))
    assert found is not None
    assert [np.degrees(each.error[0]) for each in found.courses] == pytest.approx(errors, abs=0.1)
