"""A loop whose motors cannot keep up: laws that know what was withheld come to rest, and nothing winds up."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.control.test_laws import inertia_and_load, torque
from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.law import NOW, Controller
from wristctl.control.table import controller, gains_of
from wristctl.lanes.compiled import compiled
from wristctl.simulation.oscillation import oscillations
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout

WRIST = WristParameters()
RIG = Loop(
    control_period=5e-3, actuator=Actuator(level="tendon", friction=0.1, sheath=1.0), sensor=Sensor(level="camera")
)
STROKE = Reference(angle_deg=40.0, duration=0.15)
WITHHELD = NOW.index("withheld")


def unaware(law: Controller) -> Controller:
    """The law as it would be if nobody said what the motors withhold."""
    inner = compiled(law.law)

    def without(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
        now[WITHHELD] = 0.0 * now.theta
        return inner(now, wrist, gains, memory)

    without.__code__ = without.__code__.replace(co_filename="<unaware>")
    return replace(law, law=without)


def stroke(law: Controller, gains: str, side: float = 1.0) -> Outcome:
    reference = STROKE.model_copy(update={"angle_deg": side * STROKE.end_deg})
    followed = motion(reference, WRIST, 4.0, RIG.control_period)
    row = np.array([gains_of(law, gains)])
    return rollout(law, row, [followed], np.zeros(1, np.int64), RIG, WRIST, record="briefly", threads=1)


def swing(done: Outcome) -> float:
    """Swing left at rest [deg]."""
    return float(np.degrees(oscillations(done.columns("theta"), done.references[:, 0], np.zeros(1, np.int64), 5e-3))[0])


@pytest.mark.parametrize("name", ["pid-dob", "ct-dob"])
@pytest.mark.slow
def test_a_stroke_faster_than_the_motors_ends_at_rest_and_not_in_a_swing(name: str) -> None:
    law = controller(name)
    for side in (1.0, -1.0):
        assert swing(stroke(law, "hardware", side)) < 0.1 < 0.3 < swing(stroke(unaware(law), "hardware", side))


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("name", ["pid", "pid-ff", "pid-dob", "lqi", "fopi"])
def test_an_integral_holds_while_a_motor_is_behind_and_unwinds(name: str, side: float) -> None:
    law = controller(name)
    gains = tuple(1.0 for _ in law.gains)
    for withheld, moves in ((0.3 * side, False), (-0.3 * side, True), (0.0, True)):
        memory = np.zeros(max(law.memory, 1))
        torque(name, gains, memory, theta=-0.2 * side, withheld=withheld)
        assert (memory[0] != 0.0) == moves


@pytest.mark.parametrize("name", ["smc-tracking", "super-twisting", "mrac", "nn-mrac", "nc"])
def test_a_law_does_not_learn_from_motors_that_are_behind(name: str) -> None:
    law = controller(name)

    def kept(withheld: float) -> np.ndarray:
        memory = np.zeros(law.memory)
        for _ in range(2):
            torque(name, law.values(law.presets["default"]), memory, theta=0.2, rate=0.4, withheld=withheld)
        return memory

    learnt, held, also = kept(0.0), kept(0.3), kept(-0.3)
    assert not np.array_equal(learnt, held) and np.array_equal(held, also)


def test_the_disturbance_observer_takes_no_withheld_torque_for_a_load() -> None:
    """A wrist that stays at rest although the law pushes: a load, but for the 0.2 N m that its motors withheld."""
    law = controller("ct-dob")
    gains = law.values({"w": 10.0, "zeta": 1.0, "wo": 1e9})
    loads = []
    for withheld in (0.0, 0.2):
        memory = np.zeros(law.memory)
        torque("ct-dob", gains, memory, theta=0.1, theta_ref=0.2)
        torque("ct-dob", gains, memory, theta=0.1, theta_ref=0.2, withheld=withheld)
        loads.append(memory[0])
    assert loads[1] - loads[0] == pytest.approx(0.2, rel=1e-9)


def test_the_extended_observer_expects_what_the_motors_delivered() -> None:
    """Of adrc: 0.2 N m less over a period h turns the wrist by h^2/2 0.2/M less, and that is then no innovation."""
    law, h = controller("adrc"), 1e-3
    gains, memory = law.values({"wc": 10.0, "wo": 50.0, "beta": 1.0}), np.zeros(law.memory)
    torque("adrc", gains, memory, theta=0.1, theta_ref=0.1)
    expected = memory[1]
    less = 0.5 * h * h * 0.2 / inertia_and_load(0.1, 0.0)[0]
    loads = []
    for theta, withheld in ((expected, 0.0), (expected - less, 0.2), (expected - less, 0.0)):
        kept = memory.copy()
        torque("adrc", gains, kept, theta=theta, theta_ref=0.1, withheld=withheld)
        loads.append(kept[3])
    assert loads[1] == pytest.approx(loads[0], abs=1e-3 * abs(loads[2] - loads[0])) and loads[2] != loads[0]
