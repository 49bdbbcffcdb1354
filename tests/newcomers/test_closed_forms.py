"""A plant from elsewhere whose motion is known in closed form: rollouts move it so, on spools and behind a camera.

The plant is a rod on a hinge with a linear spring (`elsewhere/hinge.py`): one file and one line of a table.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from wristctl.arrays import Array
from wristctl.config.loop import Loop, Reference, sample_period
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.wrist.plant import PLANTS

pytestmark = pytest.mark.slow

LEVEL = WristParameters(gravity=(0.0, 0.0), damping=0.02, pretension=0.0)
REACH = LEVEL.length + LEVEL.hand_offset
INERTIA = LEVEL.mass * LEVEL.length**2 / 3.0 + LEVEL.hand_mass * REACH**2


@pytest.fixture(autouse=True)
def rod(monkeypatch: pytest.MonkeyPatch) -> None:
    """The rod, known under its name for one test."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    from elsewhere.hinge import HINGE

    monkeypatch.setitem(PLANTS, "hinge", HINGE)


def run(
    wrist: WristParameters, angle: float, horizon: float, law: str = "feedforward", begin: float = 0.0, **loop: Any
) -> Outcome:
    """A move to an angle [deg] from rest at `begin` [rad]."""
    chosen = controller(law)
    settings = Loop.model_validate({"plant": {"model": "hinge"}, "plant_segments": 1, **loop})
    followed = motion(Reference(angle_deg=angle), wrist, horizon, sample_period(settings.control_period))
    gains = np.array([gains_of(chosen, "default")])
    one = np.zeros(1, np.int64)
    return rollout(
        chosen, gains, [followed], one, settings, wrist, start=lambda _: np.array([begin]), record=True, threads=1
    )


def swing(stiffness: float, damping: float, count: int, every: float = 1e-3) -> Array:
    """Angle over its first one at so many samples, of a rod with a spring that is let go and swings."""
    time = every * np.arange(float(count))
    decay = damping / (2.0 * INERTIA)
    beat = np.sqrt(stiffness / INERTIA - decay**2)
    swung: Array = np.exp(-decay * time) * (np.cos(beat * time) + decay / beat * np.sin(beat * time))
    return swung


def test_a_wrist_that_is_let_go_beats_and_decays_as_spring_damper_and_mass_have_it() -> None:
    """Without pulls, in steps of 10 ms and of parts of it: the plant's own error is of fourth order."""
    off = []
    for substeps in (1, 2, 4):
        angle = run(LEVEL, 0.0, 2.0, begin=0.3, control_period=0.01, substeps=substeps).column("theta", 0)
        exact = 0.3 * swing(LEVEL.stiffness, LEVEL.damping, len(angle), 0.01)
        off.append(np.abs(angle - exact).max())
    assert off[0] < 1e-6 and exact.min() < -0.1
    np.testing.assert_allclose(np.divide(off[:-1], off[1:]), 16.0, rtol=0.05)


def test_a_step_too_long_for_a_stiff_wrist_is_shortened_by_itself() -> None:
    """A spring of 60 N m/rad beats 16 times a second, on which a step of 10 ms is coarse."""
    wrist = LEVEL.model_copy(update={"stiffness": 60.0})
    coarse, settled = (
        run(wrist, 0.0, 2.0, begin=0.3, control_period=0.01, substeps=substeps) for substeps in (1, None)
    )
    angle = settled.column("theta", 0)
    rms = 0.3 * np.sqrt(np.mean(swing(60.0, wrist.damping, len(angle), 0.01) ** 2))
    assert settled.steps[0] > 1 and settled.drift[0] == 0.0
    assert settled.metrics["rmse"][0] == pytest.approx(rms, rel=0.01)
    assert coarse.drift[0] > 0.0 and abs(coarse.metrics["rmse"][0] - rms) > 0.1 * rms


def test_on_spools_that_stand_still_taut_tendons_are_springs_more() -> None:
    """A load that is there at once: c^2 times the stiffness of four tendons adds to the wrist's."""
    wrist, load, motors = LEVEL.model_copy(update={"pretension": 3.0}), 0.2, {"level": "tendon", "friction": 0.0}
    found = run(wrist, 0.0, 1.0, actuator=motors, disturbances={"load": load})
    stiffness = wrist.stiffness + 4.0 * 20e3 * wrist.tendon_offset**2
    angle = found.column("theta", 0)
    exact = load * wrist.length / stiffness * (1.0 - swing(stiffness, wrist.damping, len(angle)))
    assert exact.max() > 1.5e-3 and np.ptp(found.column("delivered_plus", 0)) == 0.0
    np.testing.assert_allclose(angle, exact, atol=2e-8)


def bent_by(plus: float, minus: float, load: float, wrist: WristParameters) -> float:
    """Angle at rest [rad] under tensions [N per tendon] and a load [N], upright."""
    falling = 0.5 * wrist.mass * wrist.length + wrist.hand_mass * (wrist.length + wrist.hand_offset)

    def torque(q: float) -> float:
        pulled = 2.0 * wrist.tendon_offset * (plus - minus) + load * wrist.length * np.cos(q)
        return float(pulled - falling * wrist.gravity[0] * np.sin(q) - wrist.stiffness * q)

    return float(brentq(torque, -1.0, 1.0, xtol=1e-14))


@pytest.mark.parametrize(("law", "sensor", "near"), [("feedforward", "ideal", 20.0), ("pid-ff", "camera", 0.1)])
def test_it_rests_where_the_pulls_at_the_wrist_hold_its_spring_weight_and_load(
    law: str, sensor: str, near: float
) -> None:
    """Behind spools with elastic tendons that rub; a law with a camera finds the angle that it is to bend to."""
    wrist, load = WristParameters(), 0.3
    seeing = {"level": sensor, "noise_deg": 0.0, "dropped": 0.0}
    motors = {"level": "tendon", "sheath": 1.0}
    found = run(wrist, 20.0, 8.0, law, actuator=motors, sensor=seeing, disturbances={"load": load})
    names = ("acting_plus", "acting_minus", "theta", "seen")
    plus, minus, angle, seen = (float(found.column(name, 0)[-1]) for name in names)
    assert (
        abs(np.rad2deg(angle) - 20.0) < near and abs(seen - angle) < 1e-4
    )  # a microstep of the spool turns it by 6e-4
    assert angle == pytest.approx(bent_by(plus, minus, load, wrist), abs=2e-5)
    assert abs(bent_by(plus, minus, 0.0, wrist) - angle) > 0.01
