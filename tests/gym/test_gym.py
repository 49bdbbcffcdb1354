"""gymnasium's environments are the simulation's own loops: same bits, the observer's estimate, drawn worlds by seed."""

from __future__ import annotations

import re
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from wristctl.arrays import Array
from wristctl.config.study import Study
from wristctl.control.law import Controller, Gain
from wristctl.errors import UserError
from wristctl.gym import OBSERVED, SCALE, WristEnv, WristVectorEnv
from wristctl.simulation.closed_loop import repeat, scenario_of, simulate
from wristctl.simulation.drawn_worlds import drawn_cases
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.simulation.worlds import Draws
from wristctl.study_files.load import load_study

ROOT = Path(__file__).parents[2]
N = ("simulate.loop.plant_segments=1", "simulate.horizon=0.4", "simulate.reference.duration=0.2")
RIG = (
    "simulate.loop.sensor.level=camera", "simulate.loop.sensor.noise_deg=0.1", "simulate.loop.actuator.level=tendon",
    "simulate.loop.plant.stiffness_spread=0.3", "simulate.repetitions=9",
)  # fmt: skip
LOOPS = {"ideal": N, "rig": (*N, *RIG)}
FAMILY = """
families:
  bent:
    horizon: 0.3
    loop: {plant_segments: 1, sensor: {level: camera}, actuator: {level: tendon}}
    references: [{kind: step}, {duration: 0.2}]
    draw: {plant.payload: 0..0.3, reference.angle_deg: 5..25, sensor.delay_frames: [1, 2]}
"""


@pytest.fixture(params=LOOPS)
def study(request: pytest.FixtureRequest) -> Study:
    """A study of a loop without and with motors, tendons, a camera and drawn plants."""
    return load_study([], [*LOOPS[request.param], "seed=4", "simulate.controller=pid-ff", "simulate.gains=hardware"])


def driven(env: WristEnv, actions: Array, seed: int | None = None) -> dict[str, Array]:
    """What comes of actions (T,), from the reset on: observations, true angles, rewards."""
    observed, told = env.reset(seed=seed)
    found: dict[str, list[Any]] = {"observed": [observed], "theta": [told["theta"]], "reward": [], "ended": []}
    for action in actions:
        observed, reward, failed, ended, told = env.step(np.array([action]))
        assert not failed
        for name, value in (("observed", observed), ("theta", told["theta"]), ("reward", reward), ("ended", ended)):
            found[name].append(value)
    return {name: np.array(values) for name, values in found.items()}


@pytest.mark.slow
def test_gymnasiums_own_check_has_nothing_to_say(study: Study) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make("wristctl/Wrist-v0", study=study).unwrapped)


def test_a_laws_torques_give_the_angles_of_its_own_simulation_bit_for_bit(study: Study) -> None:
    done = simulate(study).first
    course, env = done.trajectory, WristEnv(study, split="judged")
    found = driven(env, course.torque_wanted[:-1] / env.torque)
    columns = course.columns()
    assert np.ptp(course.theta) > 0.1 and np.array_equal(found["theta"], course.theta)
    for number, name in ((0, "theta_seen"), (2, "theta_ref"), (7, "load_seen")):
        assert np.array_equal(found["observed"][:, number], columns[name]), name
    assert found["ended"].sum() == 1 and found["ended"][-1]
    rmse = np.sqrt(-found["reward"].sum() / len(course.time)) * SCALE
    assert rmse == pytest.approx(done.metrics["rmse"], rel=1e-12)


def _pd(now: Any, wrist: Any, gains: Any, memory: Any) -> float:
    torque: float = now.load - 0.3 * (now.theta - now.theta_ref) - 0.02 * (now.rate - now.rate_ref)
    return torque + 0.01 * (now.torque_low + now.torque_high) + 1e-3 * now.acceleration_ref


PD = Controller("pd", _pd, "this test", {"unused": Gain("1", "nothing", 0.1, 1.0)}, {}, plain=True)


def test_a_policy_on_the_observation_is_the_same_function_as_a_law(study: Study) -> None:
    chosen = study.simulate
    followed = motion(chosen.reference, study.wrist, chosen.horizon, 1e-3)
    scenario = scenario_of(chosen.reference, chosen.direction)
    (law,) = repeat(
        PD, np.ones((1, 1)), [followed], np.zeros(1, np.int64), chosen.loop, study.wrist, [scenario],
        Draws(study.seed, "learn"),
    )  # fmt: skip
    env = WristEnv(study)
    observed, told = env.reset()
    theta, ended = [told["theta"]], False
    while not ended:
        now = type("Now", (), dict(zip((each.name for each in OBSERVED), observed.tolist(), strict=True)))
        observed, _, _, ended, told = env.step(np.array([_pd(now, None, None, None) / env.torque]))
        theta.append(told["theta"])
    assert np.array_equal(theta, law.first.trajectory.theta)


def test_behind_a_camera_the_observation_is_not_the_truth() -> None:
    env = WristEnv(load_study([], LOOPS["rig"]))
    found = driven(env, np.full(300, 0.1))
    apart = np.abs(found["observed"][:, 0] - found["theta"])
    assert 1e-4 < apart.max() < 0.2
    clear = WristEnv(load_study([], LOOPS["ideal"]))
    found = driven(clear, np.full(300, 0.1))
    assert np.array_equal(found["observed"][:, 0], found["theta"])


@pytest.mark.slow
def test_environments_of_a_vector_are_the_episodes_of_one(tmp_path: Path) -> None:
    file = tmp_path / "worlds.yaml"
    file.write_text(FAMILY)
    study, count = load_study([file]), 9
    many, one = WristVectorEnv(count, study, "bent"), WristEnv(study, "bent")
    actions = 0.2 * np.random.default_rng(1).uniform(-1.0, 1.0, (299, count, 1))
    observed, _ = many.reset(seed=7)
    assert observed in many.observation_space and len(np.unique(observed[:, 2])) > 4
    steps = [many.step(each) for each in actions]
    assert steps[-1][3].all() and not steps[-2][3].any()
    for lane in range(count):
        found = driven(one, actions[:, lane, 0], seed=7 if lane == 0 else None)
        assert np.array_equal(found["theta"][1:], [each[4]["theta"][lane] for each in steps])
        assert np.array_equal(found["observed"][1:], [each[0][lane] for each in steps])
        assert np.array_equal(found["reward"], [each[1][lane] for each in steps])


def test_the_step_after_the_end_begins_the_next_worlds_and_a_seed_the_first(tmp_path: Path) -> None:
    file = tmp_path / "worlds.yaml"
    file.write_text(FAMILY)
    env = WristVectorEnv(4, load_study([file]), "bent")
    still = np.zeros((4, 1))
    first, _ = env.reset(seed=7)
    for _ in range(299):
        *_, ended, _ = env.step(still)
    assert ended.all()
    second, reward, failed, ended, _ = env.step(still)
    assert not (reward.any() or failed.any() or ended.any()) and not np.array_equal(first, second)
    again, _ = env.reset(seed=7)
    assert np.array_equal(first, again)
    env.reset(seed=8)
    assert not np.array_equal(first, env.reset(seed=8)[0])
    both = WristVectorEnv(8, load_study([file]), "bent").reset(seed=7)[0]
    assert np.array_equal(both, np.concatenate([first, second]))


def test_a_family_is_met_in_the_worlds_that_its_split_judges_by(tmp_path: Path) -> None:
    file = tmp_path / "worlds.yaml"
    file.write_text(FAMILY)
    study = load_study([file], ["seed=3"])
    cases = drawn_cases(study.families["bent"], "bent", "test", 3, 2, study.wrist)
    env = WristEnv(study, "bent", "test")
    for case in cases:
        outcome = rollout(
            PD, np.ones((1, 1)), [case.motion], np.zeros(1, np.int64), case.loop, study.wrist,
            streams=[case.stream], record=True,
        )  # fmt: skip
        found = driven(env, outcome.column("torque_wanted", 0)[:-1] / env.torque)
        assert np.array_equal(found["theta"], outcome.column("theta", 0))
    learn = WristEnv(study, "bent").reset()[0]
    assert not np.array_equal(learn, WristEnv(study, "bent", "test").reset()[0])


def test_a_wrist_that_leaves_its_range_stays_there_and_pays_for_the_whole_range() -> None:
    env = WristEnv(load_study([], [*N, "wrist.range_deg=10", "simulate.reference.angle_deg=-5"]))
    found = driven(env, np.full(399, 1.0))
    assert found["theta"].max() > np.deg2rad(15.0) and len(set(found["theta"][-100:])) == 1
    assert found["reward"].min() == found["reward"][-1] == pytest.approx(-((30.0 / 10.0) ** 2))
    assert found["ended"][-1]


@pytest.mark.slow
def test_a_failed_neighbour_changes_nothing_and_is_told() -> None:
    study = load_study([], [*N, "wrist.range_deg=10", "simulate.reference.angle_deg=-5"])
    env = WristVectorEnv(9, study)
    env.reset()
    actions = np.zeros((9, 1))
    actions[3] = 1.0
    for _ in range(399):
        *_, told = env.step(actions)
    assert told["failed"].tolist() == [lane == 3 for lane in range(9)]
    assert np.array_equal(np.delete(told["theta"], 3), np.full(8, driven(WristEnv(study), np.zeros(399))["theta"][-1]))


def test_an_action_of_one_is_more_than_tendons_can_give() -> None:
    """So that the box cuts nothing off, and shares are exact."""
    env = WristEnv(load_study([], N))
    reset = driven(env, np.zeros(1))["observed"]
    largest = reset[0, 6]
    assert reset[0, 5] == -largest and largest < env.torque < 4.0 * largest
    assert np.log2(env.torque) == round(np.log2(env.torque))
    more, most = (driven(env, np.full(50, each), seed=0)["theta"] for each in (1.0, 1.5))
    assert np.array_equal(more, most) and more[-1] > 0.0
    assert np.allclose(driven(env, np.full(50, -1.0), seed=0)["theta"], -more, atol=1e-12)


def test_what_cannot_be_stepped_says_how_to_mend_it(tmp_path: Path) -> None:
    file = tmp_path / "worlds.yaml"
    file.write_text(FAMILY.replace("[1, 2]", "[1, 2], plant_segments: [1, 2]"))
    study = load_study([file])
    with pytest.raises(UserError, match=r"no family 'bend' - family - fix: did you mean 'bent'\?"):
        WristEnv(study, "bend")
    with pytest.raises(UserError, match=r"without limits no torque is the largest - loop\.limits"):
        WristEnv(load_study([], ["simulate.loop.limits=false"]))
    with pytest.raises(UserError, match=r"worlds of bent cannot be stepped together.*families\.bent\.draw"):
        WristVectorEnv(16, study, "bent").reset()
    env = WristEnv(load_study([], N))
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset before the first step"):
        env.step(np.zeros(1))
    env.reset()
    with pytest.raises(UserError, match="no number"):
        env.step(np.array([np.nan]))
    with pytest.raises(UserError, match=r"actions of shape \(2,\) .*fix: \(1,\)"):
        env.step(np.zeros(2))
    for family in ("", "bent"):
        with pytest.raises(UserError, match=r"no split is 'lern' - split - fix: did you mean 'learn'"):
            WristEnv(study, family, split="lern")
    with pytest.raises(UserError, match="0 wrists - num_envs"):
        WristVectorEnv(0)
    with pytest.raises(UserError, match=r"there is no study file .*nosuch"):
        WristEnv("nosuch")


def test_many_wrists_take_actions_of_their_own_shape_alone() -> None:
    """A wrist's actions stand in a row: turned by a quarter they have as many numbers, and would be others'."""
    study = load_study([], ["wrist.tendons=three", "simulate.reference=circumduction", "simulate.horizon=0.1"])
    env = WristVectorEnv(2, study, actions="tensions")
    env.reset()
    with pytest.raises(UserError, match=r"actions of shape \(3, 2\) .*fix: \(2, 3\)"):
        env.step(np.zeros((3, 2)))
    env.step(np.zeros((2, 3)))
    flat = WristVectorEnv(2, load_study([], N))
    flat.reset()
    assert flat.step(np.zeros(2))[0].shape == flat.step(np.zeros((2, 1)))[0].shape == (2, 8)


@pytest.mark.slow
def test_import_is_light_and_a_missing_gymnasium_is_told() -> None:
    heavy = "{'torch', 'scipy', 'pandas', 'matplotlib', 'cv2', 'numba'}"
    code = f"import sys, wristctl.gym; assert not {heavy} & set(sys.modules), {heavy} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)
    code = "import sys; sys.modules['gymnasium'] = None\nimport wristctl.gym"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert "gymnasium is not installed - wristctl.gym - fix: pip install 'wristctl[gym]'" in done.stderr


BANG = np.where(np.arange(999) % 2 == 0, 1.0, -0.9)
DEFAULT = ("simulate.horizon=1.0",)


@pytest.mark.slow
def test_an_episode_in_doubt_says_so_at_its_end_and_the_steps_that_it_names_are_enough(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Torques from limit to limit on four segments at 1 kHz, which one step a tick gets wrong."""

    def ended(*settings: str) -> tuple[Array, dict[str, Any], list[str]]:
        env = WristEnv(load_study([], [*DEFAULT, *settings]))
        caplog.clear()
        env.reset()
        steps = [env.step(np.array([each])) for each in BANG]
        assert not any("in_doubt" in each[4] or "substeps" in each[4] for each in steps[:-1])
        return np.array([each[4]["theta"] for each in steps]), steps[-1][4], list(caplog.messages)

    coarse, told, said = ended()
    assert told["in_doubt"] and told["substeps"] > 1
    assert len(said) == 1 and f"simulate.loop - fix: substeps: {told['substeps']}" in said[0]
    own, enough, quiet = ended(f"simulate.loop.substeps={told['substeps']}")
    assert not enough["in_doubt"] and enough["substeps"] == told["substeps"] and not quiet
    fine = ended(f"simulate.loop.substeps={8 * told['substeps']}")[0]
    off, left = (np.sqrt(np.mean((each - fine) ** 2)) for each in (coarse, own))
    assert left < 0.1 * off and off > np.deg2rad(0.01)


@pytest.mark.slow
def test_of_a_vector_only_the_episodes_with_rough_actions_are_in_doubt(caplog: pytest.LogCaptureFixture) -> None:
    env = WristVectorEnv(9, load_study([], DEFAULT))
    for episode in range(2):
        env.reset()
        for each in BANG:
            actions = np.zeros((9, 1))
            actions[8] = each
            *_, ended, told = env.step(actions)
        assert ended.all() and told["_in_doubt"].all() and told["_substeps"].all()
        assert told["in_doubt"].tolist() == [lane == 8 for lane in range(9)], episode
        assert told["substeps"][:8].tolist() == [1] * 8 and told["substeps"][8] > 1
    assert len(caplog.messages) == 1 and "1 of 9 episodes" in caplog.messages[0], "said once"


@pytest.mark.slow
def test_the_pages_examples_run_and_feedback_pays_in_the_first() -> None:
    page, known = (ROOT / "docs" / "gym.md").read_text(), dict[str, Any]()
    first, second = re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    exec(first, known)
    assert 0.0 < known["rmse"]["pull"] < known["rmse"]["hold"] < 10.0
    exec(second, known)
    assert known["truth"]["theta"].shape == (2,) and known["seen"].shape == (16,)


def test_the_page_states_the_observation_in_its_order() -> None:
    page = " ".join((ROOT / "docs" / "gym.md").read_text().split())
    (stated,) = re.findall(r"\*\*Observation\*\*.*?: (`theta`.*?)\. It is", page)
    assert re.findall(r"`(\w+)`", stated) == [each.name for each in OBSERVED]


def test_an_episode_with_a_tip_out_of_the_wrists_reach_does_not_begin() -> None:
    asked = "simulate.reference={tip: [0.078, 0.014], inverse: closed-form}"
    with pytest.raises(UserError, match="120 mm"):
        WristEnv(load_study([], [asked, "wrist.length=0.12"])).reset()
    WristEnv(load_study([], [asked])).reset()
