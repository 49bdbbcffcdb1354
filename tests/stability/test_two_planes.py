"""Margins of a loop in two planes are those of one coupled loop, and the simulated one begins to swing there."""

from __future__ import annotations

import math
from itertools import pairwise
from types import ModuleType

import numpy as np
import pytest

from tests.documented import script_of_docs
from tests.stability.conftest import LAGGED, PID, row
from wristctl.arrays import Array
from wristctl.config.loop import Loop, sample_period
from wristctl.config.wrist import WristParameters
from wristctl.simulation.motion import resting
from wristctl.simulation.rollout import rollout
from wristctl.stability.loop_analysis import AnalysedRow
from wristctl.stability.margins import loci_of, margins
from wristctl.stability.sampled_loop import LinearTick, SampledLoop

PERIOD = 0.01
DRAWN = ({"angle_deg": 0.0}, {"angle_deg": 100.0, "radius": 0.012}, {"angle_deg": 220.0})


def _coupled(across: float) -> SampledLoop:
    """Two lags with an integrator each, of which each plane's signal drives the other `across` as hard."""
    lag, integrator = math.exp(-PERIOD / 0.05), 1.0
    alone = np.array([[lag, 0.0], [1.0 - lag, integrator]])
    mixed = np.array([[1.0, across], [-across, 1.0]])
    transition, into = np.kron(np.eye(2), alone), np.kron(mixed, np.array([[1.0 - lag], [0.0]]))
    back = np.kron(np.eye(2), np.array([[0.0, 20.0 * PERIOD]]))
    return SampledLoop(PERIOD, [LinearTick(transition - into @ back, into, -back, into, True, {"theta": back})])


def _grows(loop: SampledLoop, factors: Array) -> bool:
    """Whether it grows with these factors of both planes' gains."""
    (tick,) = loop.ticks
    opened = tick.transition - tick.into @ tick.back
    return bool(np.abs(np.linalg.eigvals(opened + tick.into @ np.diag(factors) @ tick.back)).max() > 1.0)


@pytest.mark.parametrize("across", [0.0, 0.5, 1.5])
def test_the_gain_margin_is_that_of_both_planes_together(across: float) -> None:
    loop, alone = _coupled(across), margins(_coupled(0.0))
    found = margins(loop)
    assert found.stable and not _grows(loop, np.full(2, 0.999 * found.most.value))
    assert _grows(loop, np.full(2, 1.001 * found.most.value))
    if across > 0.0:
        assert found.most.value < 0.8 * alone.most.value and found.delay < 0.8 * alone.delay
        assert found.sensitivity.value > 1.1 * alone.sensitivity.value


@pytest.mark.parametrize("across", [0.0, 1.0])
def test_each_plane_bears_any_gain_within_its_own_margin_whatever_the_other_bears(across: float) -> None:
    loop = _coupled(across)
    each = margins(loop).of_each
    shares = np.linspace(0.001, 0.999, 12)
    gains = each.least * (each.most / each.least) ** shares
    assert 0.5 <= each.least < 0.95 and each.most > 1.05
    assert not any(_grows(loop, np.array([first, second])) for first in gains for second in gains)


@pytest.mark.parametrize("across", [0.0, 1.0])
def test_each_plane_bears_any_phase_within_its_own_margin_to_either_side_whatever_the_other_bears(
    across: float,
) -> None:
    """As many radians as take a gain to the same disk about -1 as the least and the largest factor do."""
    loop = _coupled(across)
    found = margins(loop)
    each = found.of_each
    phases = each.phase * np.linspace(-0.999, 0.999, 13)
    turns = np.exp(1j * phases)
    assert not any(_grows(loop, np.array([first, second])) for first in turns for second in turns)
    for factor in (each.least, each.most, *np.exp(1j * each.phase * np.array([-1.0, 1.0]))):
        assert abs(1.0 / factor - 1.0) == pytest.approx(1.0 / found.sensitivity.value)


def test_a_delay_takes_both_planes_to_their_margin() -> None:
    """The loop with one whole tick of delay more in both, by its poles."""
    loop = _coupled(0.5)
    (tick,), found = loop.ticks, margins(loop)
    opened, n = tick.transition - tick.into @ tick.back, len(tick.into)

    def grows(ticks: int) -> bool:
        whole = np.zeros((n + 2 * ticks, n + 2 * ticks))
        whole[:n, :n], whole[:n, -2:] = opened, tick.into
        whole[n : n + 2, :n] = tick.back
        whole[n + 2 :, n:-2] = np.eye(2 * ticks - 2)
        return bool(np.abs(np.linalg.eigvals(whole)).max() > 1.0)

    assert math.isfinite(found.delay)
    limits = [ticks for ticks in range(1, 100) if grows(ticks)]
    assert (limits[0] - 1) * PERIOD <= found.delay <= limits[0] * PERIOD and limits[0] > 1


def _in_space(law: str, gains: str | dict[str, float], loop: Loop, **wrist: object) -> AnalysedRow:
    own = row(law, gains, loop)
    return AnalysedRow(own.law, own.gains, loop, WristParameters.model_validate(wrist), "slipping")


@pytest.mark.slow
@pytest.mark.parametrize("tendons", ["four", "three"])
def test_a_straight_wrist_alike_in_both_planes_has_the_margins_of_one(tendons: str) -> None:
    loop = Loop(actuator=LAGGED)
    planar, spatial = row("smc-tracking", "default", loop), _in_space("smc-tracking", "default", loop, tendons=tendons)
    one, two = planar.analysed(0.0), spatial.analysed(np.zeros(2), np.array([0.6, 0.8]))
    assert one is not None and two is not None and two.linear.planes == 2
    for name in ("most", "phase", "sensitivity", "complementary"):
        assert getattr(two.margins, name).value == pytest.approx(getattr(one.margins, name).value, rel=2e-3), name
    assert two.margins.delay == pytest.approx(one.margins.delay, rel=2e-3)
    assert (two.step.settling, two.step.rise) == pytest.approx((one.step.settling, one.step.rise), abs=2e-3)


@pytest.fixture(scope="module")
def measured() -> ModuleType:
    """docs/loop_analysis.py"""
    return script_of_docs("loop_analysis")


def _swings(measured: ModuleType, own: AnalysedRow, bend: Array, factors: Array) -> Array:
    """What is left [deg] of the swing about straight of the plane that swings more, let go at a bend (2,) [rad], where
    the law's torques are times these factors; inf where the wrist leaves its range."""
    loop = own.loop.model_copy(update={"substeps": round(own.loop.control_period / measured.STEP) or 1})
    samples = round(measured.HORIZON / sample_period(loop.control_period))
    still = resting(np.zeros(2), samples, sample_period(loop.control_period))
    nothing = np.zeros(len(factors))
    gains = np.column_stack([np.tile(own.law.values(own.gains), (len(factors), 1)), factors, nothing, nothing])
    begin = np.tile(bend / loop.plant_segments, loop.plant_segments)
    law, which = measured.altered(own.law.name), np.zeros(len(factors), np.int64)
    done = rollout(law, gains, [still], which, loop, own.wrist, start=lambda plant: begin, record=True)
    left = [max(measured._left(bends) for bends in done.part("bend", lane).T) for lane in range(len(factors))]
    return np.where(done.failed, math.inf, left)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "gains", "loop"),
    [("pid", PID, Loop()), ("computed-torque", "default", Loop(control_period=5e-3, actuator=LAGGED))],
)
def test_three_tendons_begin_to_swing_where_both_planes_gains_reach_their_margin(
    measured: ModuleType, law: str, gains: str | dict[str, float], loop: Loop
) -> None:
    """Three at drawn places, on springs that are twice as stiff along an oblique axis, which couples the planes."""
    loop = loop.model_copy(update={"coupling": "ignored"})
    own = _in_space(law, gains, loop, tendons=DRAWN, flexion_ratio=2.0, stiffness_axis_deg=30.0)
    found = own.analysed(np.zeros(2))
    assert found is not None and found.margins.stable
    across = np.abs(found.transfer[:, 0, 1] / found.transfer[:, 0, 0]).max()
    assert across > 0.1, "one loop of two planes, not two loops"
    left = _swings(measured, own, np.radians([0.7, 0.7]), found.margins.most.value * np.array([0.9, 1.1]))
    limits = {limit.what: math.degrees(limit.swing) for limit in found.limits}
    still = limits.get("a motor's microstep", measured.STILL)
    assert left[0] <= still < left[1] and left[1] > 10.0 * left[0], (left, still)


def test_loci_go_on_where_they_cross_each_other() -> None:
    place = np.linspace(-1.0, 1.0, 101)
    turned = np.array([[0.6, 0.8], [-0.8, 0.6]])
    transfer = turned @ (np.eye(2) * np.stack([place + 1j, -place + 1j], axis=1)[:, None, :]) @ turned.T
    loci = loci_of(transfer)
    for locus in loci:
        assert max(abs(after - before) for before, after in pairwise(locus)) < 0.03
        assert abs(locus[-1].real - locus[0].real) == pytest.approx(2.0)
