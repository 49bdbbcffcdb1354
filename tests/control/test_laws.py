"""What each law promises, on the n = 1 model and in batches."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wristctl.config.wrist import WristParameters
from wristctl.control.law import NOW, Controller, now_of, signals_of, wrist_of
from wristctl.control.model import one_segment
from wristctl.control.table import CONTROLLERS, controller, gains_of
from wristctl.control.vetting import call_in_one_plane
from wristctl.errors import UserError
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import rows_of
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.segments import segments

WRIST = WristParameters(gravity=(-8.0, 3.0))


@kernel
def _one_segment(wrist: Any, now: Any, out: Any) -> None:
    row, result = now_of(now), rows_of(out)
    result[0], result[1] = one_segment(wrist_of(wrist), row.theta, row.rate)


def torque(name: str | Controller, gains: tuple[float, ...], memory: np.ndarray | None = None, **now: float) -> float:
    chosen = controller(name) if isinstance(name, str) else name
    given_now = {"torque_low": -1e9, "torque_high": 1e9, "period": 1e-3} | now
    row = np.zeros(signals_of(chosen.preview))
    row[: len(NOW)] = [given_now.get(field, 0.0) for field in NOW]
    kept = np.zeros(max(1, chosen.memory)) if memory is None else memory
    out = np.zeros(1)
    call_in_one_plane(chosen.compiled(), row, segments(WRIST, 1), np.array([*gains, 0.0]), kept, out, 1)
    return float(out[0])


def inertia_and_load(theta: float, rate: float) -> tuple[float, float]:
    at = terms(segments(WRIST, 1), [theta], [rate])
    return float(at.mass[0, 0]), float(at.bias[0] + WRIST.damping * rate + WRIST.stiffness * theta)


state = st.tuples(st.floats(-0.87, 0.87), st.floats(-5.0, 5.0), st.floats(-0.87, 0.87))


@settings(max_examples=80)
@given(state)
def test_one_segment_model_of_the_laws_is_the_wrists(at: tuple[float, float, float]) -> None:
    theta, rate, _ = at
    row, out = np.zeros(len(NOW)), np.zeros(2)
    row[:2] = theta, rate
    _one_segment(segments(WRIST, 1), row, out)
    assert out == pytest.approx(inertia_and_load(theta, rate), rel=1e-12, abs=1e-14)


@settings(max_examples=80)
@given(state, st.sampled_from(["printed", "exchanged", "initial"]))
def test_sliding_variable_obeys_its_reaching_law(at: tuple[float, float, float], preset: str) -> None:
    """With an exact model sigma' = P1 rate + P2 theta'' = -P3 tanh(sigma) (E19-E21)."""
    theta, rate, theta_ref = at
    p1, p2, p3 = gains_of(controller("smc"), preset)
    u = torque("smc", (p1, p2, p3), theta=theta, rate=rate, theta_ref=theta_ref)
    inertia, load = inertia_and_load(theta, rate)
    sigma = p1 * (theta - theta_ref) + p2 * rate
    assert p1 * rate + p2 * (u - load) / inertia == pytest.approx(-p3 * np.tanh(sigma), rel=1e-9, abs=1e-8 * p3)


@pytest.mark.parametrize("rate_ref", [0.0, 0.7])
@pytest.mark.parametrize(("name", "switching"), [("smc", "P3"), ("smc-tracking", "k"), ("super-twisting", "k1")])
def test_a_sliding_law_switches_on_the_surface_that_it_states(name: str, switching: str, rate_ref: float) -> None:
    """On it the gain of the switching term does not matter; at the layer's end that term is well below its line.

    The paper's law reads the angle's rate, the others that of the error (C9).
    """
    law = controller(name)
    surface = law.surface
    assert surface is not None and surface.of_error == (name != "smc")
    gains = {each.removesuffix("_"): 3.0 for each in law.gains} | {"phi": 0.4, "tau": 0.3, "k1": 2.0, "k2": 1e-9}
    gains = {each: gains[each] for each in law.gains}
    (a, b, c), layer = surface.weights(gains), surface.layer(gains)
    error, period, memory = 0.2, 1e-3, np.full(max(law.memory, 1), 0.05 if c else 0.0)

    def wanted(sigma: float, factor: float) -> float:
        rate = (sigma - a * error - c * (memory[0] + period * error)) / b + rate_ref * surface.of_error
        values = law.values(gains | {switching: factor * gains[switching]})
        now = {"theta": 0.3 + error, "rate": rate, "theta_ref": 0.3, "torque_low": -1e3, "torque_high": 1e3}
        now["rate_ref"] = rate_ref
        return torque(name, values, memory.copy(), period=period, **now)

    assert wanted(0.0, 1.0) == pytest.approx(wanted(0.0, 2.0), rel=1e-9)

    small = 1e-4 * layer
    slope = (wanted(small, 1.0) - wanted(small, 1e-9)) / small
    share = (wanted(layer, 1.0) - wanted(layer, 1e-9)) / (slope * layer)
    assert slope < 0.0 and 0.7 < share < 0.9 and wanted(1.0, 1.0) != pytest.approx(wanted(1.0, 2.0))


@settings(max_examples=80)
@given(state)
def test_computed_torque_gives_the_linear_error_equation(at: tuple[float, float, float]) -> None:
    theta, rate, theta_ref = at
    u = torque("computed-torque", (40.0, 0.7), theta=theta, rate=rate, theta_ref=theta_ref, acceleration_ref=3.0)
    inertia, load = inertia_and_load(theta, rate)
    expected = 3.0 - 2 * 0.7 * 40.0 * rate - 40.0**2 * (theta - theta_ref)
    assert (u - load) / inertia == pytest.approx(expected, rel=1e-10, abs=1e-9)


def test_feedforward_holds_the_model_at_the_reference() -> None:
    assert torque("feedforward", (), theta=0.1, rate=2.0, theta_ref=0.5) == pytest.approx(inertia_and_load(0.5, 0.0)[1])


def test_pid_opposes_the_error_and_integrates_it() -> None:
    memory = np.zeros(1)
    first = torque("pid", (10.0, 5.0, 2.0), memory, theta=0.2, rate=0.5)
    assert first == pytest.approx(-(10.0 * 0.2 + 5.0 * 0.2e-3 + 2.0 * 0.5))
    second = torque("pid", (10.0, 5.0, 2.0), memory, theta=0.2, rate=0.5)
    assert second - first == pytest.approx(-5.0 * 0.2e-3)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_pid_holds_its_integral_in_saturation_and_lets_it_unwind(side: float) -> None:
    memory = np.full(1, -0.3 * side)
    reach = {"torque_low": -0.1, "torque_high": 0.1}
    torque("pid", (10.0, 5.0, 2.0), memory, theta=-0.2 * side, **reach)
    assert (memory == -0.3 * side).all()
    torque("pid", (1.0, 5.0, 2.0), memory, theta=0.2 * side, **reach)
    assert (np.abs(memory) < 0.3).all()


@pytest.mark.parametrize("name", sorted(CONTROLLERS))
@settings(max_examples=40)
@given(state, st.lists(st.floats(0.0, 1.0), min_size=5, max_size=5), st.floats(-5.0, 5.0))
def test_every_law_is_finite_for_any_state_and_gains_in_the_box(
    name: str, at: tuple[float, float, float], share: list[float], rate_ref: float
) -> None:
    theta, rate, theta_ref = at
    gains = tuple(g.low * (g.high / g.low) ** u for g, u in zip(controller(name).gains.values(), share, strict=False))
    kept = np.zeros(max(1, controller(name).memory))
    for _ in range(3):
        u = torque(name, gains, kept, theta=theta, rate=rate, theta_ref=theta_ref, rate_ref=rate_ref)
        assert np.isfinite(u) and np.isfinite(kept).all()


@pytest.mark.parametrize("name", sorted(set(CONTROLLERS) - {"feedforward"}))
def test_every_gain_is_searched_over_six_decades_around_its_presets(name: str) -> None:
    for key, gain in controller(name).gains.items():
        order = (name, key) == ("fopi", "lambda")  # of an integral: between none and two
        assert 0.0 < gain.low < gain.high < 2.0 if order else gain.high / gain.low == pytest.approx(1e6)
        assert gain.low <= controller(name).presets.get("default", {key: gain.low})[key] <= gain.high


@pytest.mark.parametrize("name", sorted(CONTROLLERS))
def test_every_controller_states_units_boxes_and_presets_of_all_its_gains(name: str) -> None:
    chosen = controller(name)
    assert chosen.presets and chosen.law.__doc__
    for gain in chosen.gains.values():
        assert 0.0 < gain.low < gain.high and gain.meaning
    for preset in chosen.presets.values():
        assert len(preset) == len(chosen.gains)


def test_unknown_names_get_the_nearest_one() -> None:
    with pytest.raises(UserError, match="did you mean 'smc'"):
        controller("scm")
    with pytest.raises(UserError, match="did you mean 'pd-ff'"):
        controller("pd")
    with pytest.raises(UserError, match="did you mean 'printed'"):
        gains_of(controller("smc"), "prnted")
    with pytest.raises(UserError, match="unknown gain 'P4'"):
        gains_of(controller("smc"), {"P1": 1.0, "P2": 1.0, "P4": 1.0})
    with pytest.raises(UserError, match="missing gain P3"):
        gains_of(controller("smc"), {"P1": 1.0, "P2": 1.0})
    with pytest.raises(UserError, match="no tuned gains of smc"):
        gains_of(controller("smc"), "tuned", {"pid": {}})


def test_pid_acts_on_the_errors_rate_so_that_a_wrist_that_moves_as_asked_gets_no_torque() -> None:
    assert torque("pid", (10.0, 5.0, 2.0), theta=0.3, theta_ref=0.3, rate=0.7, rate_ref=0.7) == 0.0
    behind = torque("pid", (10.0, 5.0, 2.0), theta=0.3, theta_ref=0.3, rate=0.2, rate_ref=0.7)
    assert behind == pytest.approx(2.0 * 0.5)


@pytest.mark.parametrize("name", sorted(set(CONTROLLERS) - {"feedforward"}))
def test_gains_in_any_order_are_the_same_gains(name: str) -> None:
    chosen = controller(name)
    for preset, values in chosen.presets.items():
        backwards = dict(reversed(list(values.items())))
        assert gains_of(chosen, backwards) == gains_of(chosen, preset) == tuple(values[key] for key in chosen.gains)
        assert gains_of(chosen, "tuned", {name: backwards}) == gains_of(chosen, preset)


def test_a_law_reads_its_gains_by_name_whatever_their_order_in_the_table() -> None:
    chosen = controller("pid")
    turned = replace(chosen, name="turned", gains=dict(reversed(list(chosen.gains.items()))))
    at = {"theta": 0.2, "theta_ref": 0.1, "rate": 0.5}
    gains = {"Kp": 10.0, "Ki": 5.0, "Kd": 2.0}
    both = [torque(each, each.values(gains), None, **at) for each in (chosen, turned)]
    assert both[0] == both[1] != 0.0 and turned.values(gains) == (2.0, 5.0, 10.0)


def test_a_preset_that_leaves_a_gain_out_or_gives_values_without_names_is_refused() -> None:
    for wrong in ({"Kp": 1.0}, (1.0, 2.0, 3.0)):
        with pytest.raises(ValueError, match="preset default of pid must give Kp, Ki, Kd by name"):
            replace(controller("pid"), presets={"default": wrong})  # type: ignore[dict-item]


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_law_remembers_as_many_numbers_as_it_says(name: str) -> None:
    """A few ticks off the reference change every one of them, whatever it was, but for what a motion has to teach."""
    law = controller(name)
    if not law.memory:
        return
    gains = tuple(law.values(next(iter(law.presets.values()))))
    memory = np.full(law.memory, 0.5)
    for tick in range(5):
        torque(name, gains, memory, theta=0.3 - 0.01 * tick, rate=-0.2, theta_ref=0.1, rate_ref=0.4)
    assert (memory[law.learned :] != 0.5).all()
