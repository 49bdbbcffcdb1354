"""What every plant behind the contract must be: its functions agree with each other, and with rest and energy.

The plants of the table, and one from elsewhere.
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba.core.registry import CPUDispatcher

from tests.bench.conftest import TAUT, HostOn, host_on
from tests.identification.rehearsal import RehearsedTruth, rehearse
from wristctl.config.bench import BenchSettings, WeakenedPlant
from wristctl.config.loop import DirectionName, Loop, Reference
from wristctl.config.plant import Actuator, Disturbances, Plant, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.lanes.compiled import _BODIES, sources
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.wrist.plant import PLANTS, PLANTS_IN_SPACE, PlantModel

__all__ = ["host_on"]  # a fixture of the bench's tests
HERE = Path(__file__).parent
WRIST = WristParameters()


@pytest.fixture(autouse=True, params=[*PLANTS, "elsewhere"])
def model(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> PlantModel:
    """Each plant, known under its name for one test."""
    if request.param != "elsewhere":
        return PLANTS[request.param]
    monkeypatch.syspath_prepend(str(HERE))
    from elsewhere.hinge import HINGE

    monkeypatch.setitem(PLANTS, "hinge", HINGE)
    return HINGE


def cut(model: PlantModel) -> int:
    """Segments of a rollout: few, and as many as other tests have compiled the house's own plant for."""
    return 4 if model is PLANTS["pcc"] else 2


def run(model: PlantModel, loop: dict[str, Any] | None = None, angle: float = 20.0, horizon: float = 4.0) -> Outcome:
    """Feedforward to an angle."""
    law = controller("feedforward")
    settings = Loop.model_validate({"plant": Plant(model=model.name), "plant_segments": cut(model), **(loop or {})})
    followed = motion(Reference(angle_deg=angle), WRIST, horizon, 1e-3)
    one = np.zeros(1, np.int64)
    return rollout(law, np.zeros((1, 0)), [followed], one, settings, WRIST, record=True, threads=1)


def loaded(force: float) -> dict[str, Any]:
    """A loop's disturbances, a force on the last disc [N]."""
    return {"disturbances": Disturbances(load=force)}


def some(model: PlantModel, count: int = 9) -> np.ndarray:
    """Coordinates (count, q), the straight wrist among them."""
    drawn = np.random.default_rng(0).uniform(-0.6, 0.6, (count, model.coordinates(2)))
    drawn[0] = 0.0
    return drawn


def test_the_backbone_ends_at_the_tip_along_the_angle(model: PlantModel) -> None:
    q = some(model)
    for own, (x, y), angle in zip(q, model.tips(WRIST, q), model.angle(q), strict=True):
        line, along = model.backbone(WRIST, own, np.array([0.0, WRIST.length]))
        np.testing.assert_allclose(line, [0.0, x + 1j * y], atol=1e-14)
        assert along[-1] == pytest.approx(np.exp(1j * angle), abs=1e-14)


def test_tendons_shorten_on_the_side_to_which_the_wrist_bends_and_are_the_wrists_length_when_straight(
    model: PlantModel,
) -> None:
    straight = np.zeros(model.coordinates(2))
    np.testing.assert_allclose(model.taut(WRIST, straight), WRIST.length, rtol=1e-14)
    plus, minus = model.taut(WRIST, straight + 0.2)
    assert plus < WRIST.length < minus


@pytest.mark.slow
def test_a_wrist_is_the_mirror_image_of_itself(model: PlantModel) -> None:
    right, left = (run(model, loaded(side * 0.2), angle=side * 20.0) for side in (1.0, -1.0))
    np.testing.assert_allclose(left.column("theta", 0), -right.column("theta", 0), atol=1e-12)
    np.testing.assert_allclose(left.column("tension_plus", 0), right.column("tension_minus", 0), atol=1e-9)


def test_a_load_bends_the_wrist_toward_it_and_a_stiffer_one_less(model: PlantModel) -> None:
    bends = []
    for scale in (1.0, 4.0):
        own = {"plant": Plant(model=model.name, stiffness_scale=scale)}
        toward, away = (run(model, loaded(force) | own).column("theta", 0) for force in (0.2, -0.2))
        bends.append(float((toward - away)[-1]))
    assert bends[0] > 0.02 and 0.0 < bends[1] < 0.5 * bends[0]


@pytest.mark.slow
def test_elastic_tendons_begin_at_pretension_and_a_held_wrist_stays(model: PlantModel) -> None:
    done = run(model, {"actuator": Actuator(level="tendon")}, angle=0.0, horizon=0.5)
    assert np.abs(done.column("theta", 0)).max() < 1e-6
    step = 20e3 * Actuator().step_length
    for side in ("plus", "minus"):
        np.testing.assert_allclose(done.column(f"acting_{side}", 0), WRIST.pretension, atol=step)


def test_compiled_and_plain_functions_say_the_same_of_the_angle_and_its_rate(model: PlantModel) -> None:
    done = run(model, loaded(0.2))
    angle = model.angle(done.coordinates(0))
    np.testing.assert_allclose(done.column("theta", 0), angle, atol=1e-14)
    np.testing.assert_allclose(done.column("rate", 0)[1:-1], np.gradient(angle, 1e-3)[1:-1], atol=1e-3)


def test_a_wrist_bent_beyond_what_its_plant_can_be_has_failed_and_stays_where_it_was(model: PlantModel) -> None:
    """The paper's printed PID, a thousand times too strong for a period of 1 ms and tendons without a limit."""
    law, followed = controller("pid"), motion(Reference(), WRIST, 1.0, 1e-3)
    loop = Loop.model_validate(
        {"plant": Plant(model=model.name), "plant_segments": cut(model), "limits": False, **loaded(0.2)}
    )
    gains = np.array([gains_of(law, "printed")])
    done = rollout(law, gains, [followed], np.zeros(1, np.int64), loop, WRIST, record=True, threads=1)
    assert done.failed[0] and np.isnan(done.metrics["rmse"][0])
    theta = done.coordinates(0)
    assert np.isfinite(theta).all() and (theta[-1] == theta[-100]).all()


# What no plant in one plane is made of.
IN_SPACE = {plant.parameters for plant in PLANTS_IN_SPACE.values()}


def _reached(functions: Iterable[CPUDispatcher], others: Collection[type]) -> set[Path]:
    """Files of these compiled functions and of all that they call, as numba finds them: by name where they stand.

    A function that is declared by type is followed into all of its bodies within the package but those for the
    parameters of the other plants.
    """
    seen, waiting = set[Any](), [function.py_func for function in functions]
    while waiting:
        function = waiting.pop()
        if function not in seen:
            seen.add(function)
            called = [function.__globals__.get(name) for name in function.__code__.co_names]
            waiting += [value.py_func for value in called if isinstance(value, CPUDispatcher)]
            bodies = [body for (declared, kind), body in _BODIES.items() if declared in called and kind not in others]
            waiting += [body for body in bodies if body.__module__.startswith("wristctl.")]
    return {Path(function.__code__.co_filename) for function in seen}


def test_every_plant_is_registered_and_its_kernels_go_by_all_that_they_call(model: PlantModel) -> None:
    assert PLANTS[model.name] is model
    assert Path(sys.modules[model.parameters.__module__].__file__ or "") in model.sources
    files = {file for source in model.sources for file in sources(source)}
    others = {plant.parameters for plant in PLANTS.values()} - {model.parameters} | IN_SPACE
    called = _reached((value for value in vars(model).values() if isinstance(value, CPUDispatcher)), others)
    assert called <= files and len(called) > 1


@pytest.mark.slow
def test_on_the_bench_it_comes_to_rest_and_the_other_side_is_its_mirror_image(
    host_on: HostOn, model: PlantModel
) -> None:
    settings = BenchSettings(motors=TAUT, plant=WeakenedPlant(model=model.name))
    ends = []
    for steps in ((-110, -110, 130, 130), (130, 130, -110, -110)):
        host = host_on(settings)
        host.reel(steps)
        host.rest(4.0)
        truth = host.bench.truth()
        assert truth.theta.shape[1] == model.coordinates(settings.segments) and truth.pull[-1].min() > 1.0
        assert np.ptp(truth.theta[-100:], axis=0).max() < 1e-7
        ends.append(truth.theta[-1])
    assert ends[0].sum() > 0.05
    np.testing.assert_allclose(ends[1], -ends[0], atol=1e-6)


@pytest.mark.slow
def test_a_rehearsal_logs_it_as_it_moves(model: PlantModel) -> None:
    """A perfect camera sees the plant's angle; the same move to the other side is its mirror image."""
    own = TrueWrist(model=model.name)
    truth = RehearsedTruth(WRIST, Actuator(level="tendon"), 0.0, 0.0, exposure=0.0, dropped=0.0, plant=own)
    moves: list[tuple[DirectionName, Reference]] = [("ulnar", Reference()), ("radial", Reference())]
    log, frames, trials = rehearse(WRIST, truth.actuator, truth, moves, 2.0, np.random.default_rng(1))
    assert list(trials["direction"]) == ["ulnar", "radial"] and set(frames["verdict"]) == {"ok"}
    there, back = (frames[frames["trial"] == k] for k in range(2))
    assert 0.2 < there["theta"].iloc[-1] < 1.0
    mirrored = np.interp(there["captured"], back["captured"], -back["theta"])
    inside = there["captured"].between(back["captured"].min(), back["captured"].max())
    np.testing.assert_allclose(there["theta"][inside], mirrored[inside], atol=2e-3)
    reeled = [log[log["trial"] == k][["position_4", "position_1"]].to_numpy() for k in range(2)]
    np.testing.assert_array_equal(reeled[0], reeled[1][:, ::-1])
