"""A law that sees both planes at once: what it is given, and that it moves the wrist as laws of one plane do."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.control.computed_torque import COMPUTED_TORQUE
from wristctl.control.computed_torque import law as of_one_plane
from wristctl.control.differenced import differenced
from wristctl.control.law import Controller
from wristctl.control.plain_model import plain_one_segment
from wristctl.control.vetting import vet
from wristctl.errors import UserError
from wristctl.lanes.compiled import compiled
from wristctl.lanes.rows import beyond
from wristctl.simulation.motion import Motion
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.simulation.spatial_references import bend_path

WRISTS = {tendons: WristParameters(tendons=tendons) for tendons in ("three", "four")}
PERIOD = 1e-3
_inner = compiled(of_one_plane)


def by_plane(now: Any, wrist: Any, gains: Any, memory: Any, tendons: Any, torque: Any) -> None:
    """Computed torque in every plane."""
    for p in range(len(torque)):
        torque[p] = _inner(now[p], wrist[p], gains, memory[p])


def plain_by_plane(now: Any, wrist: Any, gains: Any, memory: Any, tendons: Any, torque: Any) -> None:
    """The same in plain Python."""
    for p, view in enumerate(now):
        inertia, load = plain_one_segment(wrist[p], view.theta, view.rate)
        error, error_rate = view.theta - view.theta_ref, view.rate - view.rate_ref
        wanted = view.acceleration_ref - 2.0 * gains.zeta * gains.w * error_rate - gains.w**2 * error
        torque[p] = inertia * wanted + load


def reaches(now: Any, wrist: Any, gains: Any, memory: Any, tendons: Any, torque: Any) -> None:
    """All that the tendons give toward a plane, less the largest torque that it is told, kept plane by plane."""
    count = len(tendons.least)
    for p in range(len(torque)):
        most = -now[p].torque_high
        for t in range(count):
            arm = tendons.arms[p, t]
            most += arm * (tendons.greatest[t] if arm > 0.0 else tendons.least[t])
        torque[p] = most


def both(law: Any, **more: Any) -> Controller:
    return replace(COMPUTED_TORQUE, name="of-both", law=law, planes=2, conditions={}, **more)


def in_space(law: Controller, wrist: WristParameters, loop: Loop | None = None, lanes: int = 1) -> Outcome:
    path = bend_path("circumduction", size_deg=20.0, turn=0.4, horizon=0.5)
    gains = np.tile(law.values(COMPUTED_TORQUE.presets["default"]) if law.gains else (), (lanes, 1))
    followed = Motion.of_bends(path, PERIOD, wrist.length)
    return rollout(law, gains, [followed], np.zeros(lanes, np.int64), loop or Loop(), wrist, record=True)


def samples(outcome: Outcome) -> Any:
    assert outcome.samples is not None
    return outcome.samples


@pytest.mark.parametrize("lanes", [1, 8])
@pytest.mark.parametrize("tendons", WRISTS)
def test_a_law_of_both_planes_gives_the_bits_of_the_same_law_run_by_plane(tendons: str, lanes: int) -> None:
    found, expected = (in_space(law, WRISTS[tendons], lanes=lanes) for law in (both(by_plane), COMPUTED_TORQUE))
    np.testing.assert_array_equal(samples(found), samples(expected))
    assert np.abs(samples(found)).max() > 1.0


def test_in_one_plane_it_is_called_with_one_of_each() -> None:
    followed = motion(Reference(angle_deg=20.0, duration=0.3), WRISTS["four"], 0.5, PERIOD)
    gains = np.array([COMPUTED_TORQUE.values(COMPUTED_TORQUE.presets["default"])])
    runs = [
        rollout(law, gains, [followed], np.zeros(1, np.int64), Loop(), WRISTS["four"], record=True)
        for law in (both(by_plane), COMPUTED_TORQUE)
    ]
    np.testing.assert_array_equal(samples(runs[0]), samples(runs[1]))


def test_a_differenced_one_sees_the_differences_of_both_planes() -> None:
    found, expected = (in_space(differenced(law), WRISTS["three"]) for law in (both(by_plane), COMPUTED_TORQUE))
    np.testing.assert_array_equal(samples(found), samples(expected))


@pytest.mark.parametrize("tendons", WRISTS)
def test_one_of_plain_python_moves_the_wrist_as_the_compiled_one_does(tendons: str) -> None:
    law = both(plain_by_plane, plain=True)
    np.testing.assert_allclose(
        samples(in_space(law, WRISTS[tendons])), samples(in_space(COMPUTED_TORQUE, WRISTS[tendons])), atol=1e-6
    )


@pytest.mark.parametrize("tendons", WRISTS)
def test_arms_and_limits_give_the_reach_that_each_plane_is_told(tendons: str) -> None:
    """The wanted torque is the difference of both, as nothing couples the planes here."""
    law = both(reaches, plain=True, gains={}, presets={"default": {}})
    outcome = in_space(law, WRISTS[tendons], Loop(coupling="ignored"))
    wanted = [outcome.column(f"torque_wanted_{plane}", 0) for plane in ("ulnar", "flexion")]
    assert np.abs(wanted).max() < 1e-9
    assert np.isfinite(wanted).all()


def overwrites(now: Any, wrist: Any, gains: Any, memory: Any, tendons: Any, torque: Any) -> None:
    """Writes what it is only shown."""
    for p in range(len(torque)):
        beyond(now[p], 0)[0] = 1.0 + now[p].theta
        torque[p] = now[p].theta


def forgets(now: Any, wrist: Any, gains: Any, memory: Any, tendons: Any, torque: Any) -> None:
    """Writes no torque."""


def test_such_a_law_is_vetted_as_every_other() -> None:
    assert np.isfinite(vet(both(by_plane), "here").torques).all()
    with pytest.raises(UserError, match="changes what it sees"):
        vet(both(overwrites), "here")
    with pytest.raises(UserError, match="wrote nan"):
        vet(both(forgets, plain=True), "here")


def test_a_controller_is_of_one_plane_or_of_both() -> None:
    with pytest.raises(ValueError, match="planes=3"):
        replace(COMPUTED_TORQUE, planes=3)
