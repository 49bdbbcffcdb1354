"""Plants that differ from the controller's model, and what our tracking law reaches on them."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.config.loop import Loop, Reference, sample_period
from wristctl.config.plant import Actuator, Plant, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.table import CONTROLLERS, controller, gains_of
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.wrist.statics import equilibrium

WRIST = WristParameters()
STEP, MOVE = Reference(kind="step"), Reference(duration=1.0)
UNKNOWN = {
    "softer": Plant(stiffness_scale=0.8),
    "stiffer": Plant(stiffness_scale=1.2),
    "loaded": Plant(payload=0.5 * WRIST.hand_mass),
}


def run(name: str, plant: Plant, *references: Reference, horizon: float = 5.0, **loop: object) -> Outcome:
    chosen, each = controller(name), Loop.model_validate({"plant": plant, **loop})
    motions = [motion(r, WRIST, horizon, sample_period(each.control_period)) for r in references]
    gains = np.tile(gains_of(chosen, "default"), (len(motions), 1))
    return rollout(chosen, gains, motions, np.arange(len(motions)), each, WRIST, record=True, threads=1)


def test_smc_tracking_meets_its_targets_on_move_and_step_with_one_set_of_gains() -> None:
    found = run("smc-tracking", Plant(), MOVE, STEP).metrics
    assert found["rmse"][0] <= 3e-5 and found["steady_state"][0] <= 1e-5
    assert found["settling"][0] <= 0.864 + 0.010 + 1e-9
    assert found["settling"][1] <= 0.1 and found["overshoot"][1] <= 2.0
    assert (found["peak_tension"] <= 60.0).all()
    feedforward = run("feedforward", Plant(), MOVE).metrics["chattering"][0]
    assert found["chattering"][0] <= 3.0 * feedforward


@pytest.mark.parametrize("plant", [Plant(), *UNKNOWN.values()], ids=["nominal", *UNKNOWN])
def test_smc_tracking_settles_steps_of_any_size_within_a_tenth_of_a_second(plant: Plant) -> None:
    """Small steps stay clear of saturation, large ones do not; the softer or heavier wrist is unknown to the law."""
    steps = [Reference(kind="step", angle_deg=angle) for angle in (15.0, -30.0, 50.0)]
    found = run("smc-tracking", plant, *steps, horizon=1.5).metrics
    assert (found["settling"] <= 0.1).all() and (found["overshoot"] <= 2.0).all()


@pytest.mark.parametrize("plant", UNKNOWN.values(), ids=UNKNOWN)
@pytest.mark.parametrize("name", ["smc-tracking", "super-twisting", "mrac"])
def test_integrating_laws_keep_their_accuracy_on_an_unknown_plant(name: str, plant: Plant) -> None:
    assert run(name, plant, MOVE).metrics["rmse"][0] <= 2e-4


@pytest.mark.parametrize("plant", UNKNOWN.values(), ids=UNKNOWN)
def test_a_plant_rests_where_the_wrist_of_its_own_parameters_rests(plant: Plant) -> None:
    """Under feedforward's final tensions the plant reaches the equilibrium of a wrist with those parameters."""
    outcome = run("feedforward", plant, Reference(angle_deg=10.0), horizon=8.0)
    plus, minus = (float(outcome.column(f"tension_{side}", 0)[-1]) for side in ("plus", "minus"))
    its_own = WristParameters(
        stiffness=WRIST.stiffness * plant.stiffness_scale, hand_mass=WRIST.hand_mass + plant.payload
    )
    assert outcome.column("theta", 0)[-1] == pytest.approx(equilibrium(its_own, 4, (plus, minus)).sum(), abs=1e-4)


WORST = Loop(plant=UNKNOWN["softer"], sensor=Sensor(level="camera"), actuator=Actuator(level="tendon"))


@pytest.mark.parametrize("loop", [Loop(plant=UNKNOWN["loaded"]), WORST], ids=["loaded", "camera and tendons"])
@pytest.mark.parametrize("name", sorted(CONTROLLERS))
@pytest.mark.slow
def test_commands_stay_finite_and_within_limits_for_any_gains_in_the_box(name: str, loop: Loop) -> None:
    chosen = controller(name)
    rng = np.random.default_rng(1)
    box = np.log10([[g.low, g.high] for g in chosen.gains.values()]).reshape(-1, 2)
    gains = 10.0 ** rng.uniform(box[:, 0], box[:, 1], (80, len(box)))
    motions = [
        motion(r, WRIST, 0.5, sample_period(loop.control_period))
        for r in (STEP, Reference(angle_deg=-50.0, duration=0.3))
    ]
    outcome = rollout(chosen, gains, motions, np.arange(80) % 2, loop, WRIST, record=True)
    assert outcome.samples is not None
    tension = np.array([[outcome.column(f"tension_{s}", i) for s in ("plus", "minus")] for i in range(80)])
    assert np.isfinite(tension).all()
    assert tension.min() >= WRIST.pretension and tension.max() <= WRIST.tension_limit
