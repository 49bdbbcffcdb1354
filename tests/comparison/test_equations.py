"""What the paper's own equations and tables come to, by hand or by another way."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wristctl.comparison.equations import EQUATIONS, growth_as_printed, least_rmse
from wristctl.comparison.paper import T2


def test_time_constants_of_words_units_and_surface() -> None:
    decay = math.log(50.0)
    assert EQUATIONS["settling_by_words"]() == pytest.approx(5.857 * decay, rel=1e-3)
    assert EQUATIONS["settling_by_units"]() == pytest.approx(0.1707 * decay, rel=1e-3)
    assert EQUATIONS["settling_on_surface"]() == pytest.approx(1e6 * decay, rel=1e-9)


def test_the_chain_is_the_arc() -> None:
    assert 0.0 < EQUATIONS["chain_difference"]() < 1e-10


def test_e22_as_printed_grows_as_kd_over_the_inertia() -> None:
    """Its derivative pushes on: the pole nearest to Kd / I, for I = 0.3 kg (0.1 m)^2."""
    assert growth_as_printed() == pytest.approx(2e3 / 3e-3, rel=1e-3)


@pytest.mark.parametrize("name", T2)
def test_no_answer_to_a_step_has_less_rmse_than_its_bound(name: str) -> None:
    """Of all that leave the band then: an error that falls to the band at once and stays there comes closest."""
    settling, period = T2[name].settling, 1e-3
    time = np.arange(0.0, 10.0, period)
    closest = np.where(time < settling, 0.01 * math.radians(30.0), 0.0)
    assert math.sqrt(np.mean(closest**2)) == pytest.approx(least_rmse(name), rel=1e-3)
    exponential = math.radians(30.0) * np.exp(-time * math.log(100.0) / settling)
    assert math.sqrt(np.mean(exponential**2)) > least_rmse(name)


def test_what_t2_prints_of_each_row() -> None:
    below = [name for name in T2 if least_rmse(name) > T2[name].rmse]
    assert below == ["smc", "pid", "mrac"], "these cannot be read from one answer to a step"
    assert [name for name in T2 if EQUATIONS[f"rmse_over_steady_{name}"]() < 1.0] == ["pid", "mrac"]
