"""A camera's latency is told from what the wrist itself lags behind."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wristctl.trial.rig_strokes import MotorStroke, find_latency

GAIN, STEP_RATE, HIGH, NOISE = 1.0e-3, 1000.0, 70.0, 5e-4


Wrist = Callable[[float, np.ndarray], list[float]]
"""Rates of its state (n,), whose first entry is the angle that is seen, by how far its motor has turned."""


def on_springs(rate: float, damping: float) -> Wrist:
    return lambda turned, state: [
        state[1], rate**2 * (GAIN * turned - state[0]) - 2.0 * damping * rate * state[1],
    ]  # fmt: skip


def in_two_planes(across: float) -> Wrist:
    """Its tendon runs along the diagonal of the planes, and across it is so many times as stiff."""

    def moved(turned: float, state: np.ndarray) -> list[float]:
        angle, speed, beside, sideways = state
        pull = 70.0**2 * (GAIN * turned - (angle + beside))
        return [speed, pull - 40.0 * speed - 150.0 * angle, sideways, pull - 40.0 * sideways - 150.0 * across * beside]

    return moved


def strokes(
    delay: float, wrist: Wrist, frame_rate: float, states: int = 2, count: int = 24, seed: int = 0
) -> list[MotorStroke]:
    """Seen of a wrist that an independent solver moves, each from another place; frames begin anywhere."""
    rng, made = np.random.default_rng(seed), []
    for _ in range(count):
        begin = rng.uniform(0.09, 0.21)

        def position(time: float, begin: float = begin) -> float:
            return float(np.clip(STEP_RATE * (time - begin), 0.0, HIGH))

        def moved(time: float, state: np.ndarray, position: Callable[[float], float] = position) -> list[float]:
            return wrist(position(time), state)

        at = np.arange(rng.uniform(0.0, 1.0 / frame_rate), begin + 0.35, 1.0 / frame_rate)
        seen = solve_ivp(moved, (0.0, 0.6), [0.0] * states, t_eval=at, rtol=1e-6, atol=1e-8, max_step=0.01)
        polled = np.arange(0.0, begin + 0.35, 4e-3)
        start = rng.uniform(-0.02, 0.02)
        angle = start + seen.y[0] + NOISE * rng.standard_normal(len(at))
        known = at + delay < polled[-1]
        made.append(
            MotorStroke(polled, np.array([40.0 + position(t) for t in polled]), (at + delay)[known], angle[known])
        )
    return made


@pytest.mark.parametrize(
    ("delay", "rate", "damping", "frame_rate"),
    [(0.0, 35.0, 0.4, 15.0), (0.06, 35.0, 0.4, 15.0), (0.13, 70.0, 0.2, 60.0), (0.06, 25.0, 1.5, 60.0)],
)
@pytest.mark.slow
def test_the_delay_is_found_to_two_milliseconds_whatever_the_wrist_does(
    delay: float, rate: float, damping: float, frame_rate: float
) -> None:
    found = find_latency(strokes(delay, on_springs(rate, damping), frame_rate))
    assert found.delay == pytest.approx(delay, abs=2e-3)
    assert abs(found.delay - delay) < 4.0 * found.sd + 2e-4 and found.sd < 1.5e-3
    assert found.scatter == pytest.approx(NOISE, rel=0.3)


@pytest.mark.parametrize(("delay", "rate", "damping"), [(0.06, 35.0, 0.3)])
def test_a_few_strokes_of_a_wrist_on_springs_tell_its_own_frequency_too(
    delay: float, rate: float, damping: float
) -> None:
    seen = strokes(delay, on_springs(rate, damping), 60.0, count=4)
    found = find_latency(seen)
    assert found.delay == pytest.approx(delay, abs=2e-3) and found.rate == pytest.approx(rate, rel=0.1)
    assert found.scatter == pytest.approx(NOISE, rel=0.3) and 0.0 < found.sd < 2e-3
    assert found.pictures == sum(len(each.angle) for each in seen)


@pytest.mark.parametrize(("across", "seed"), [(0.5, 0), (0.5, 1), (1.0, 0), (1.7, 0), (1.7, 1)])
@pytest.mark.slow
def test_what_the_other_plane_gives_back_slowly_is_not_taken_for_age(across: float, seed: int) -> None:
    found = find_latency(strokes(0.06, in_two_planes(across), 15.0, states=4, seed=seed))
    assert found.delay == pytest.approx(0.06, abs=2e-3)


@pytest.mark.slow
def test_a_motor_that_reels_in_the_other_way_is_seen_as_late() -> None:
    turned = [each._replace(position=-each.position) for each in strokes(0.06, on_springs(35.0, 0.4), 30.0)]
    assert find_latency(turned).delay == pytest.approx(0.06, abs=2e-3)


def test_too_few_pictures_are_no_measurement() -> None:
    with pytest.raises(ValueError, match="too few"):
        find_latency(strokes(0.0, on_springs(35.0, 0.4), 15.0, count=2))


def test_somebody_else_may_do_something_all_the_while() -> None:
    """As a board has to be fed, while a fit goes on that takes up to seconds."""
    calls = list[None]()
    find_latency(strokes(0.06, on_springs(35.0, 0.4), 15.0, count=8), lambda: calls.append(None))
    assert len(calls) > 20
