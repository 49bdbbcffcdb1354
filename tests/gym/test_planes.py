"""gymnasium's environments in two planes and by tensions: the loops of `simulate` and `rollout`, of any layout."""

from __future__ import annotations

import warnings
from itertools import cycle
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from wristctl.arrays import Array
from wristctl.config.study import Study
from wristctl.control.law import Controller
from wristctl.errors import UserError
from wristctl.gym import OBSERVED, SCALE, WristEnv, WristVectorEnv
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import part, rows_of
from wristctl.simulation.closed_loop import asked_of, simulate
from wristctl.simulation.rollout import rollout
from wristctl.study_files.load import load_study
from wristctl.wrist.plant import advance, kernel_of, parameters_of
from wristctl.wrist.spatial.pcc_in_space import PCC_IN_SPACE
from wristctl.wrist.spatial.spatial_kinematics import tip_bends
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendon_mechanics import NoTendons

SIX = str([{"angle_deg": angle} for angle in range(0, 360, 60)]).replace("'", "")
DRAWN = (
    "[{angle_deg: 11, radius: 0.018}, {angle_deg: 131, radius: 0.024}, {angle_deg: 230, radius: 0.02, ends_at: 3}, "
    "{angle_deg: 288, multiplicity: 2}]"
)
LAYOUTS = {"three": 3, "four": 4, "five": 5, SIX: 6, DRAWN: 4}
CIRCLE = (
    "simulate.loop.plant_segments=1", "simulate.horizon=1.2",
    "simulate.reference={kind: circumduction, duration: 0.6, angle_deg: 20}",
)  # fmt: skip
SAMPLES = 1200
RIG = (
    "simulate.loop.sensor.level=camera", "simulate.loop.sensor.noise_deg=0.1", "simulate.loop.actuator.level=tendon",
    "simulate.controller=pid-ff", "simulate.gains=hardware", "seed=4",
)  # fmt: skip


def study_of(layout: str, *more: str) -> Study:
    """A circle on a wrist with these tendons; places that end within the wrist need segments that end there."""
    segments = ("simulate.loop.plant_segments=4",) if "ends_at" in layout else ()
    return load_study([], [*CIRCLE, *segments, f"wrist.tendons={layout}", *more])


def driven(env: WristEnv, actions: Array, seed: int | None = None) -> dict[str, Array]:
    """What comes of actions (K, A), from the reset on: observations, true bends, rewards."""
    observed, told = env.reset(seed=seed)
    found: dict[str, list[Any]] = {"observed": [observed], "bend": [told["theta"]], "reward": [], "ended": []}
    for action in actions:
        observed, reward, failed, ended, told = env.step(action)
        assert not failed and not told["failed"]
        for name, value in (("observed", observed), ("bend", told["theta"]), ("reward", reward), ("ended", ended)):
            found[name].append(value)
    return {name: np.array(values) for name, values in found.items()}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("layout", "actions"), [*((layout, "tensions") for layout in LAYOUTS), ("three", "torques"), (DRAWN, "torques")]
)
def test_gymnasiums_own_check_has_nothing_to_say_of_any_layout(layout: str, actions: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make("wristctl/Wrist-v0", study=study_of(layout), actions=actions).unwrapped
        check_env(env)
    assert env.observation_space.shape == (2 * len(OBSERVED),)
    assert env.action_space.shape == (2 if actions == "torques" else LAYOUTS[layout],)


@pytest.mark.slow
@pytest.mark.parametrize(("layout", "level"), [("three", "ideal"), (SIX, "rig"), (DRAWN, "rig")])
def test_tensions_that_simulate_commanded_bend_the_wrist_as_it_did(layout: str, level: str) -> None:
    study = study_of(layout, *(RIG if level == "rig" else ()))
    done = simulate(study).first
    course, env = done.trajectory, WristEnv(study, split="judged", actions="tensions")
    found = driven(env, course.tension[:-1] / env.largest)
    assert np.ptp(course.theta, axis=0).min() > 0.02
    np.testing.assert_allclose(found["bend"], course.theta, rtol=0.0, atol=1e-9)
    at, columns = {each.name: number for number, each in enumerate(env.observed)}, course.columns()
    for observed, column in {"theta": "bend_seen", "theta_ref": "bend_ref", "load": "load_seen"}.items():
        for plane in ("ulnar", "flexion"):
            seen = found["observed"][:, at[f"{observed}_{plane}"]]
            np.testing.assert_allclose(seen, columns[f"{column}_{plane}"], rtol=0.0, atol=1e-9)
    rmse = np.sqrt(-found["reward"].sum() / len(course.time)) * SCALE
    assert found["ended"].sum() == 1 and found["ended"][-1] and rmse == pytest.approx(done.metrics["rmse"], rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("coupling", ["compensated", "ignored"])
def test_torques_go_where_a_laws_torques_go(coupling: str) -> None:
    """What the planes do to each other is added to both where the loop compensates it."""
    study = study_of("three", f"simulate.loop.coupling={coupling}", "simulate.controller=feedforward")
    env = WristEnv(study)
    chosen, (wrist, loop, followed) = study.simulate, asked_of(study, 1e-3)
    draws = np.repeat(np.random.default_rng(3).uniform(-0.3, 0.3, (SAMPLES // 50, 2)), 50, axis=0)
    law = Controller("drawn", replaying(draws), "this test", {}, {"default": {}}, plain=True)
    outcome = rollout(law, np.zeros((1, 0)), [followed], np.zeros(1, np.int64), loop, wrist, record=True)
    bends = driven(env, draws[:-1] / env.torque)["bend"]
    assert np.ptp(bends, axis=0).min() > 0.01 and chosen.loop.coupling == coupling
    np.testing.assert_array_equal(bends, outcome.part("bend", 0))


def replaying(torques: Array) -> type:
    """A law that wants these torques (K, 2): an object for each plane of each rollout, made in turn."""
    planes = cycle(torques.T)

    class Replay:
        def __init__(self) -> None:
            self.torques = iter(next(planes).tolist())

        def __call__(self, now: Any, wrist: Any, gains: Any, memory: Any) -> float:
            return float(next(self.torques))

    return Replay


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["three", SIX])
def test_random_tensions_of_neighbours_bend_as_a_rollout_that_allocates_them(layout: str) -> None:
    """Of tensions without co-contraction: at most two neighbours pull more than at least, as allocation has it."""
    study = study_of(layout, "simulate.loop.coupling=ignored")
    (wrist, loop, followed), places = asked_of(study, 1e-3), TendonLayout.of(study.wrist)
    draws, samples = np.random.default_rng(7), len(followed.time)
    count = LAYOUTS[layout]
    tensions = np.full((samples, count), wrist.pretension)
    for row in tensions:
        first = draws.integers(count)
        row[[first, (first + 1) % count]] += draws.uniform(0.0, 15.0, 2)
    tensions[:, 0] += np.where(tensions[:, 0] > tensions.min(), 10.0, 0.0)  # so that the wrist leaves the middle
    env = WristEnv(study, actions="tensions")
    found = driven(env, tensions[:-1] / env.largest)
    seen = found["bend"]  # ideal sensors: what the law sees
    arms = np.array([places.moment_arms(bend, wrist.length, wrist.discs) for bend in seen])
    pulls = tensions * places.multiplicity
    torques = np.einsum("ktp,kt->kp", arms, pulls)
    law = Controller("drawn", replaying(torques), "this test", {}, {}, plain=True)
    outcome = rollout(law, np.zeros((1, 0)), [followed], np.zeros(1, np.int64), loop, wrist, record=True)
    assert np.ptp(seen, axis=0).min() > 0.02
    np.testing.assert_allclose(outcome.part("tension", 0), tensions, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(outcome.part("bend", 0), seen, rtol=0.0, atol=1e-9)


def _steps(model: Any, parameters: Any, state: Any, pulls: Any, h: float, cut: Any, places: Any) -> None:
    rows = rows_of(state)
    plant = parameters_of(model, rows_of(parameters), places)
    q, rate = part(rows, 0, cut), part(rows, len(cut), cut)
    for k in range(pulls.shape[0]):
        advance(plant, q, rate, part(rows_of(pulls[k]), 0, places), NoTendons(), h + zero_like(q[0]))


@pytest.mark.slow
@pytest.mark.parametrize("layout", LAYOUTS)
def test_random_tensions_of_all_tendons_move_the_plant_under_these_pulls(layout: str) -> None:
    """With co-contraction, which no allocation asks for; below pretension it is the pretension that pulls."""
    study = study_of(layout)
    env, places = WristEnv(study, actions="tensions"), TendonLayout.of(study.wrist)
    wrist, n = study.wrist, study.simulate.loop.plant_segments
    shares = np.random.default_rng(11).uniform(0.0, 0.3, (SAMPLES - 1, LAYOUTS[layout]))
    bends = driven(env, shares)["bend"]
    pulls = np.clip(shares * env.largest, wrist.pretension, wrist.tension_limit) * places.multiplicity
    assert (pulls == places.multiplicity * wrist.pretension).any() and np.ptp(bends, axis=0).min() > 0.01
    state, moved = np.zeros(4 * n), [np.zeros(2)]
    values, step = PCC_IN_SPACE.values(wrist, n), kernel_of(_steps, PCC_IN_SPACE)
    for row in pulls:
        step(PCC_IN_SPACE, values, state, row[None].copy(), 1e-3, (0,) * (2 * n), (0,) * len(row))
        moved.append(tip_bends(state[None, : 2 * n])[0])
    np.testing.assert_allclose(bends, moved, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("level", ["ideal", "rig"])
def test_in_one_plane_tensions_are_those_of_both_sides(level: str) -> None:
    more = ("simulate.loop.plant_segments=1", "simulate.horizon=0.3", *(RIG if level == "rig" else ()))
    study = load_study([], more)
    course, env = simulate(study).first.trajectory, WristEnv(study, split="judged", actions="tensions")
    found = driven(env, course.tension[:-1] / env.largest)
    assert np.ptp(course.theta) > 0.04 and env.action_space.shape == (2,) and env.observed == OBSERVED
    assert np.array_equal(found["bend"], course.theta)


@pytest.mark.slow
def test_environments_of_a_vector_in_two_planes_are_the_episodes_of_one(tmp_path: Path) -> None:
    """Of a family whose worlds leave their planes by a draw; one of its motions has one plane."""
    file = tmp_path / "worlds.yaml"
    file.write_text(
        "wrist: {tendons: three}\n"
        "families:\n  round:\n    horizon: 0.3\n    loop: {plant_segments: 1}\n"
        "    references: [{kind: circumduction}, {duration: 0.2}]\n    draw: {plant.payload: 0..0.3}\n"
    )
    study, count = load_study([file]), 9
    actions = np.random.default_rng(1).uniform(0.0, 0.5, (299, count, 3))
    many, one = WristVectorEnv(count, study, "round", actions="tensions"), WristEnv(study, "round", actions="tensions")
    observed, _ = many.reset(seed=7)
    assert observed.shape == (count, 16) and observed in many.observation_space
    steps = [many.step(each) for each in actions]
    assert steps[-1][3].all() and not steps[-2][3].any()
    for lane in range(count):
        found = driven(one, actions[:, lane], seed=7 if lane == 0 else None)
        assert np.array_equal(found["bend"][1:], [each[4]["theta"][lane] for each in steps])
        assert np.array_equal(found["observed"][1:], [each[0][lane] for each in steps])
        assert np.array_equal(found["reward"], [each[1][lane] for each in steps])


def test_a_wrist_out_of_its_range_pays_for_the_whole_range_by_the_bends_size() -> None:
    study = study_of("three", "wrist.range_deg=25")
    env = WristEnv(study, actions="tensions")
    env.reset()
    pull = np.array([0.0, 1.0, 0.0])
    steps = [env.step(pull) for _ in range(SAMPLES - 1)]
    bends, failed = np.array([each[4]["theta"] for each in steps]), np.array([each[4]["failed"] for each in steps])
    first = int(np.argmax(failed))
    sizes = np.degrees(np.hypot(*bends.T))
    assert failed[-1] and (sizes[:first] < 30.0).all() and np.abs(np.degrees(bends)).max() < 30.0 < sizes[-1]
    assert steps[-1][1] == pytest.approx(-((60.0 / 10.0) ** 2)) and (bends[first + 1 :] == bends[-1]).all()


def test_an_action_of_one_is_more_than_tendons_can_give_in_either_plane() -> None:
    env = WristEnv(study_of(DRAWN, "simulate.loop.coupling=ignored"))
    observed, _ = env.reset()
    at = {each.name: number for number, each in enumerate(env.observed)}
    reached = [observed[at[f"torque_{end}_{plane}"]] for end in ("low", "high") for plane in ("ulnar", "flexion")]
    assert 0.25 * env.torque < np.abs(reached).max() < env.torque
    assert np.log2(env.torque) == round(np.log2(env.torque))


def test_what_is_no_action_is_said() -> None:
    with pytest.raises(UserError, match=r"no actions are 'tension' - actions - fix: did you mean 'tensions'"):
        WristEnv(study_of("three"), actions="tension")  # type: ignore[arg-type]
    with pytest.raises(UserError, match=r"without limits no tension is the largest - loop\.limits"):
        WristEnv(study_of("three", "simulate.loop.limits=false"), actions="tensions")
    env = WristEnv(study_of("three"), actions="tensions")
    with pytest.raises(UserError, match="these actions are tensions - torque"):
        _ = env.torque
    env.reset()
    with pytest.raises(UserError, match=r"actions of shape \(2,\) .*fix: \(3,\)"):
        env.step(np.zeros(2))
