"""What the paper's own equations and tables come to, by hand or by another way."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wristctl.comparison.derived_claims import EQUATIONS, least_rmse
from wristctl.comparison.paper import T2


def as_printed(name: str) -> float:
    """An equation at the numbers as they are printed, between its ends."""
    equation = EQUATIONS[name]
    value, ends = equation.of(*equation.printed), equation.ends()
    assert ends.low <= value <= ends.high
    return value


def test_time_constants_of_words_units_and_surface() -> None:
    decay = math.log(50.0)
    assert as_printed("settling_by_words") == pytest.approx(5.857 * decay, rel=1e-3)
    assert as_printed("settling_by_units") == pytest.approx(0.1707 * decay, rel=1e-3)
    assert as_printed("settling_on_surface") == pytest.approx(1e6 * decay, rel=1e-9)


def test_an_equation_comes_to_a_range_by_the_rounding_of_what_it_takes_from_print() -> None:
    low, high = EQUATIONS["settling_by_units"].ends()
    assert (low, high) == pytest.approx((math.log(50.0) * 0.1045 / 0.6155, math.log(50.0) * 0.1055 / 0.6145))
    low, high = EQUATIONS["rmse_over_steady_mrac"].ends()
    assert low == pytest.approx(1.15 / 1.35) and high == 1.0, "1.2e-3 and 1.3e-3 may both be of 1.25e-3"
    assert EQUATIONS["rmse_over_steady_pid"].ends().high < 0.64
    exact = EQUATIONS["chain_difference"].ends()
    assert exact.low == exact.high, "which takes nothing from print"


def test_the_chain_is_the_arc() -> None:
    assert 0.0 < as_printed("chain_difference") < 1e-10


def test_e22_as_printed_grows_as_kd_over_the_inertia() -> None:
    """Its derivative pushes on: the pole nearest to Kd / I, for I = 0.3 kg (0.1 m)^2."""
    assert as_printed("growth_as_printed") == pytest.approx(2e3 / 3e-3, rel=1e-3)


@pytest.mark.parametrize("name", T2)
def test_no_answer_to_a_step_has_less_rmse_than_its_bound(name: str) -> None:
    """Of all that leave the band then: an error that falls to the band at once and stays there comes closest."""
    settling, period = T2[name].settling, 1e-3
    time = np.arange(0.0, 10.0, period)
    closest = np.where(time < settling, 0.01 * math.radians(30.0), 0.0)
    assert math.sqrt(np.mean(closest**2)) == pytest.approx(least_rmse(settling), rel=1e-3)
    exponential = math.radians(30.0) * np.exp(-time * math.log(100.0) / settling)
    assert math.sqrt(np.mean(exponential**2)) > least_rmse(settling)


def test_what_t2_prints_of_each_row() -> None:
    below = [name for name in T2 if as_printed(f"least_rmse_{name}") > T2[name].rmse]
    assert below == ["smc", "pid", "mrac"], "these cannot be read from one answer to a step"
    assert [name for name in T2 if as_printed(f"rmse_over_steady_{name}") < 1.0] == ["pid", "mrac"]
