"""Does a policy that PPO learns beat tuned gains? `python docs/ppo.py [MINUTES]`, 15 where not said: docs/ppo.md.

PPO (Schulman et al., arXiv:1707.06347) is Stable-Baselines3's (Raffin et al., JMLR 22 (2021) 268). It learns on worlds
of the `learn` split of the rig's family, and is judged on those of its test split beside feedforward and
gains tuned on a third split, every one on the same worlds, motions and noise.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from wristctl.comparison.bootstrap import LEVEL, GeometricMean, paired_ratio, penalised
from wristctl.comparison.world_ranking import world_scores
from wristctl.config.study import Study
from wristctl.control.table import controller
from wristctl.gym import WristVectorEnv
from wristctl.seeds import stream
from wristctl.simulation.cases import Measured, measure
from wristctl.simulation.drawn_worlds import drawn_cases
from wristctl.simulation.oscillation import oscillations
from wristctl.study_files.load import load_study
from wristctl.tuning.search import judges_of, search

Floats = NDArray[np.float64]
HERE = Path(__file__).parent
EXPERIMENTS = HERE.parent / "experiments"
RIG, WORLDS, MINUTES, COUNT = "camera", 240, 15.0, 256
ALIKE = ("plant_segments", "plant.model")
"""What environments that step together cannot draw: every wrist here bends in four segments."""
RIVALS = ("pid", "smc", "pid-ff")
"""The controllers that are tuned beside it: the paper's two, and the ladder's that integrates."""


class Wrists(VecEnv):
    """wristctl's environments as Stable-Baselines3 has them: an episode's end shows its last sight, and begins anew."""

    def __init__(self, env: WristVectorEnv) -> None:
        self.env, self.actions = env, np.zeros_like(env.action_space.sample())
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> Any:
        return self.env.reset()[0]

    def step_async(self, actions: NDArray[Any]) -> None:
        self.actions = np.asarray(actions, np.float64)

    def step_wait(self) -> Any:
        seen, reward, _, ended, _ = self.env.step(self.actions)
        told: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        if ended.all():
            for each, last in zip(told, seen, strict=True):
                each.update({"terminal_observation": last, "TimeLimit.truncated": True})
            seen = self.env.reset()[0]
        return seen, reward, ended.copy(), told

    def close(self) -> None:
        self.env.close()

    def seed(self, seed: int | None = None) -> list[int | None]:
        self.env.reset(seed=seed)
        return [seed] * self.num_envs

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [getattr(self.env, attr_name, None)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise AttributeError(attr_name)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **named: Any) -> list[Any]:
        raise AttributeError(method_name)

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        return [False] * self.num_envs


class Clock(BaseCallback):
    """Ends after so many seconds; the step size falls to nothing with the time that is left."""

    def __init__(self, seconds: float) -> None:
        super().__init__()
        self.seconds, self.began = seconds, time.perf_counter()

    def left(self) -> float:
        """Share of the time that is left."""
        return max(0.0, 1.0 - (time.perf_counter() - self.began) / self.seconds)

    def _on_step(self) -> bool:
        return self.left() > 0.0


class Learnt(NamedTuple):
    """A policy, and what it took."""

    model: PPO
    sight: VecNormalize
    steps: int
    minutes: float


def study_of() -> Study:
    """The rig's family without what environments that step together cannot draw, and the budget of the rivals."""
    study = load_study([EXPERIMENTS / "scenarios" / f"{RIG}.yaml", EXPERIMENTS / "rivals.yaml"])
    family = study.families[RIG]
    alike = family.model_copy(update={"draw": {k: v for k, v in family.draw.items() if k not in ALIKE}})
    budget = study.compare.tuning
    assert budget is not None
    tune = budget.model_copy(update={"worlds": budget.worlds.model_copy(update={"family": RIG}), "controllers": RIVALS})
    return study.model_copy(update={"families": {RIG: alike}, "tune": tune})


def learnt(study: Study, minutes: float) -> Learnt:
    """What PPO makes of so many minutes: two layers of 64, whole episodes of 256 wrists at a time."""
    torch.set_num_threads(1)
    clock = Clock(60.0 * minutes)
    wrists = Wrists(WristVectorEnv(COUNT, study, RIG))
    sight = VecNormalize(wrists, gamma=0.98, clip_obs=20.0)
    steps = steps_of(study)
    model = PPO(
        "MlpPolicy", sight, learning_rate=lambda _: 1e-3 * clock.left(), n_steps=steps,
        batch_size=steps * max(1, COUNT // 16), n_epochs=6, gamma=0.98, gae_lambda=0.95, seed=study.seed,
        device="cpu", policy_kwargs={"log_std_init": -1.5},
    )  # fmt: skip
    model.learn(10**12, callback=clock)
    sight.training = False
    return Learnt(model, sight, model.num_timesteps, (time.perf_counter() - clock.began) / 60.0)


def steps_of(study: Study) -> int:
    """Of an episode: one from each sample to the next."""
    family = study.families[RIG]
    return round(family.horizon / family.loop.control_period) - 1


def judged(study: Study, policy: Learnt) -> Measured:
    """What the policy does on the cases of the controllers' test, in their order, a sample a control period."""
    family = study.families[RIG]
    cases = drawn_cases(family, RIG, "test", study.seed, WORLDS, study.wrist)
    env = WristVectorEnv(len(cases), study, RIG, split="test")
    seen, told = env.reset(seed=study.seed)
    wanted_at = [number for number, each in enumerate(env.observed) if each.name.startswith("theta_ref")]
    courses, references, failed = [told["theta"]], [seen[:, wanted_at]], told["failed"]
    ended = np.zeros(env.num_envs, bool)
    while not ended.any():
        actions, _ = policy.model.predict(policy.sight.normalize_obs(seen), deterministic=True)
        seen, _, _, ended, told = env.step(np.asarray(actions, np.float64))
        courses.append(told["theta"])
        references.append(seen[:, wanted_at])
        failed = failed | told["failed"]
    count, step = len(courses), family.loop.control_period
    bends, wished = (
        np.array(rows).reshape(count, env.num_envs, -1).transpose(2, 1, 0) for rows in (courses, references)
    )
    rmse = np.sqrt(np.square(bends - wished).sum(axis=0).mean(axis=1))
    swings = [oscillations(*plane, np.arange(env.num_envs), step) for plane in zip(bends, wished, strict=True)]
    left = np.max(swings, axis=0)
    nothing, rests = np.zeros((1, len(cases))), np.array([case.rests for case in cases])
    found = {"rmse": rmse[None], "oscillation": np.where(failed, np.nan, left)[None], "drift": nothing}
    return Measured(found, failed[None], nothing + 1.0, rests)


class Row(NamedTuple):
    """A row of the page."""

    name: str
    scores: Floats
    """Geometric mean of the RMSE [rad] over the motions of each world."""
    lost: int
    """Worlds in which it fails or swings."""


def row_of(name: str, found: Measured) -> Row:
    """One row of what was measured."""
    lost = (found.swings | found.failed).reshape(WORLDS, -1).any(axis=1)
    return Row(name, penalised(world_scores(found, WORLDS))[0], int(lost.sum()))


def rivals(study: Study) -> list[Row]:
    """Feedforward, and each controller's gains, tuned with the budget of experiments/rivals.yaml."""
    judges = judges_of(study)
    cases = drawn_cases(study.families[RIG], RIG, "test", study.seed, WORLDS, study.wrist)
    gains: dict[str, tuple[str, Floats]] = {"feedforward": ("feedforward", np.zeros(0))}
    for name in RIVALS:
        law = controller(name)
        found = search(study, law, lambda what: stream(study.seed, what), judges)
        gains[f"{name}/tuned"] = name, np.array(law.values(found.gains))
    return [
        row_of(label, measure(controller(name), values[None], cases, study.wrist, ["rmse", "oscillation"]))
        for label, (name, values) in gains.items()
    ]


def beside(policy: Row, other: Row) -> GeometricMean:
    """How many times less the policy's RMSE is."""
    return paired_ratio(other.scores, policy.scores, 1, LEVEL)


def told(policy: Row, other: Row) -> str:
    """The answer beside a row, in words."""
    ratio = beside(policy, other)
    numbers = f"{other.name} has {ratio.value:.2f} [{ratio.low:.2f}, {ratio.high:.2f}] times its RMSE"
    if ratio.low <= 1.0 <= ratio.high:
        return f"is not told apart from {other.name} ({numbers})"
    return f"{'beats' if ratio.low > 1.0 else 'does not reach'} {other.name} ({numbers})"


def main() -> None:
    """Learn, tune, judge, write the page."""
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else MINUTES
    study = study_of()
    policy = learnt(study, minutes)
    own = row_of("PPO", judged(study, policy))
    rows = sorted([own, *rivals(study)], key=lambda row: float(np.log(row.scores).mean()))
    others = {row.name: row for row in rows}
    means = {row.name: float(np.degrees(np.exp(np.log(row.scores).mean()))) for row in rows}
    evaluations = study.tune.candidates * study.tune.iterations
    table = [
        f"| {row.name} | {means[row.name]:.3f} | {each.value:.2f} [{each.low:.2f}, {each.high:.2f}] | {row.lost} |"
        for row in rows
        for each in [beside(own, row)]
    ]
    lines = [
        "# Does a policy that PPO learns beat tuned gains?",
        "",
        f"In RMSE the policy {told(own, others['feedforward'])}, and {told(own, others['pid/tuned'])}.",
        f"It is lost in {own.lost} of {WORLDS} worlds, feedforward in {others['feedforward'].lost}, pid/tuned in "
        f"{others['pid/tuned'].lost}.",
        "",
        "| row | RMSE [deg] | its RMSE over the policy's, 95 % | worlds lost |",
        "| --- | --- | --- | --- |",
        *table,
        "",
        f"On the `{RIG}` family (steppers, elastic tendons with friction, a camera of 60 Hz, 200 Hz), every wrist of",
        f"four segments: {WORLDS} worlds of its test split, three motions in each; geometric means, with 95 %",
        "intervals over worlds. A world is lost where the wrist leaves its range, or swings by more than 0.1 deg",
        "at rest.",
        "",
        "PPO (deep reinforcement learning) is Stable-Baselines3's, two layers of 64, observations and rewards",
        f"normalised, one seed: {policy.steps / 1e6:.1f} million",
        f"steps of 5 ms in {policy.minutes:.0f} minutes, {COUNT} wrists at a time, on worlds of the `learn` split. It",
        "sees what a controller sees: no integral, and no past but the observer's. Gains are tuned with",
        f"{evaluations} evaluations a controller on drawn worlds, and chosen on others.",
        "",
        "Made by `python docs/ppo.py`. A time limit makes no two of its runs the same.",
    ]
    (HERE / "ppo.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
