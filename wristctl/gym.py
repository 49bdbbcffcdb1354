"""gymnasium's environments over the closed loops of a study (extra `gym`): one wrist, or many at once.

An episode is one motion of the horizon's length. The action is the torque that a law would want; the observation is
what a law sees, behind a camera the observer's estimate and never the plant's truth. docs/gym.md has it all.

    import wristctl, wristctl.gym

    env = wristctl.gym.WristEnv(wristctl.load_study("study.yaml"))
    many = gymnasium.make_vec("wristctl/Wrist-v0", num_envs=1024, vectorization_mode="vector_entry_point")
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.study import Study
from wristctl.errors import UserError, meant

if TYPE_CHECKING:
    from wristctl.simulation.cases import Case
    from wristctl.simulation.stepped_loops import SteppedLoops
    from wristctl.wrist.kinematics import Inverse

try:
    import gymnasium
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ModuleNotFoundError as error:
    raise UserError("gymnasium is not installed", "wristctl.gym", "pip install 'wristctl[gym]'") from error

__all__ = ["OBSERVED", "SCALE", "WristEnv", "WristVectorEnv"]

Box = gymnasium.spaces.Box
log = logging.getLogger(__name__)


class Observed(NamedTuple):
    """An entry of the observation: its name, unit, meaning, and the bound at which it is cut off to either side."""

    name: str
    unit: str
    meaning: str
    bound: float


OBSERVED = (
    Observed("theta", "rad", "bending angle as measured, behind a camera as the observer estimates it", 2.0 * math.pi),
    Observed("rate", "rad/s", "its rate, likewise", 100.0),
    Observed("theta_ref", "rad", "the reference", 2.0 * math.pi),
    Observed("rate_ref", "rad/s", "its rate", 100.0),
    Observed("acceleration_ref", "rad/s2", "its acceleration", 1e4),
    Observed("torque_low", "N m", "least torque that the tendons can give here", 100.0),
    Observed("torque_high", "N m", "largest torque that the tendons can give here", 100.0),
    Observed("load", "N m", "load torque as the observer estimates it; 0 where sensors are ideal", 100.0),
)
"""Signals of an observation, in their order."""

SCALE = math.radians(10.0)
"""Error [rad] at which a step costs 1."""

_BOUND = np.array([each.bound for each in OBSERVED])


class _Episodes:
    """The episodes of a study's loop or family, so many at a time: each number is a world, a motion and its noise."""

    def __init__(self, study: Study | None, family: str, split: str, count: int, network: Inverse | None) -> None:
        from wristctl.control.law import NOW
        from wristctl.simulation.stepped_loops import largest_torque
        from wristctl.simulation.worlds import loop_facing

        self.study, self.family, self.split = study or Study(), family, split
        if family and family not in self.study.families:
            fix = meant(family, self.study.families) if self.study.families else "families: in the study"
            raise UserError(f"no family {family!r}", "family", fix)
        simulated = self.study.simulate
        self.wrist, self.loop = self.study.wrist, self.study.families[family].loop if family else simulated.loop
        if not family:
            self.wrist, self.loop = loop_facing(self.wrist, self.loop, simulated.direction)
        if not self.loop.limits:
            raise UserError("without limits no torque is the largest", "loop.limits", "loop.limits: true")
        self.count, self.network, self.seed, self.next = count, network, self.study.seed, 0
        self.picked = [NOW.index(each.name) for each in OBSERVED]
        self.torque = 2.0 ** math.ceil(math.log2(largest_torque(self.wrist)))
        self.action_space = Box(-1.0, 1.0, (1,), np.float64)
        self.observation_space = Box(-_BOUND, _BOUND, dtype=np.float64)
        self.loops: SteppedLoops | None = None
        self.warned = False

    def begin(self, seed: int | None) -> tuple[Array, Array, Any]:
        """The next episodes, or with a seed the first under it: observations, true angles, and who has failed."""
        from wristctl.simulation.closed_loop import equilibrium
        from wristctl.simulation.stepped_loops import SteppedLoops

        if seed is not None:
            self.seed, self.next = seed, 0
        cases = self._cases(self.next)
        self.next += self.count
        start = equilibrium(self.loop) if not self.family and self.study.simulate.start == "equilibrium" else None
        try:
            self.loops = SteppedLoops(cases, self.wrist, start)
        except ValueError as error:
            what = f"the worlds of {self.family} cannot be stepped together: {error}"
            raise UserError(
                what, f"families.{self.family}.draw", "draw no such setting, or step them one by one"
            ) from error
        return self._seen()[:3]

    def step(self, actions: Array) -> tuple[Array, Array, Any, Array]:
        """After a sample with these actions (count,): observations, true angles, who has failed, and rewards."""
        if self.loops is None or self.loops.done:
            raise gymnasium.error.ResetNeeded("reset before the first step, and after an episode's end")
        if not np.isfinite(actions).all():
            raise UserError("an action that is no number", "step(action)", "a finite one")
        self.loops.step(self.torque * actions)
        return self._seen()

    def truth(self, theta: Array, failed: Any) -> dict[str, Any]:
        """Entries of `info`, (count,) each; at an episode's end also whether its integration step is in doubt."""
        told = {"theta": theta, "failed": failed}
        if self.loops is None or not self.loops.done:
            return told
        doubtful, steps = self.loops.doubts()
        if doubtful.any() and not self.warned:
            self.warned = True
            key = f"families.{self.family}.loop" if self.family else "simulate.loop"
            what = "the angles of %d of %d episodes may depend on the integration step - %s - fix: substeps: %d"
            log.warning(what, doubtful.sum(), self.count, key, steps.max())
        return {**told, "in_doubt": doubtful, "substeps": steps}

    def _seen(self) -> tuple[Array, Array, Any, Array]:
        assert self.loops is not None
        sight = self.loops.look()
        error = np.where(sight.failed, 2.0 * sight.limit, sight.theta - sight.reference)
        observed = np.clip(np.nan_to_num(sight.signals[:, self.picked]), -_BOUND, _BOUND)
        return observed, sight.theta.copy(), sight.failed, -((error / SCALE) ** 2)

    def _cases(self, first: int) -> Sequence[Case]:
        from wristctl.config.loop import sample_period
        from wristctl.simulation.cases import Case
        from wristctl.simulation.closed_loop import scenario_of
        from wristctl.simulation.drawn_worlds import drawn_cases
        from wristctl.simulation.reference import motion, toward
        from wristctl.simulation.worlds import Draws, loops_of

        if self.family:
            family = self.study.families[self.family]
            each = len(family.references)
            world, skipped = divmod(first, each)
            worlds = -(-(skipped + self.count) // each)
            drawn = drawn_cases(
                family, self.family, self.split, self.seed, worlds, self.wrist, self.network, world
            )  # fmt: skip
            return drawn[skipped : skipped + self.count]
        chosen, draws = self.study.simulate, Draws(self.seed, self.split)
        reference, numbers = toward(chosen.reference, chosen.direction), range(first, first + self.count)
        period = sample_period(self.loop.control_period)
        followed = motion(reference, self.wrist, chosen.horizon, period, self.network)
        scenario = scenario_of(chosen.reference, chosen.direction)
        loops = loops_of(self.loop, [draws.plant(number) for number in numbers])
        return [Case(loop, followed, draws.camera(scenario, k), 0) for loop, k in zip(loops, numbers, strict=True)]


class WristEnv(gymnasium.Env[Array, Array]):
    """One closed loop of a study: its `simulate` section's, or with `family` the worlds of a family one after another.

    Observation (8,): OBSERVED. Action (1,): the torque that is wanted until the next step, a control period (1 ms where
    that is shorter) later, as a share of `torque` [N m]; what tendons cannot give is cut off. Reward: -(e / 10 deg)^2,
    e being the true angle's error; once the wrist has left its range, with e both ends of the range apart. An episode
    lasts the horizon (truncated); a wrist that has failed stays where it was till then.

    Episode k under a seed (the study's where reset is given none) is repetition or case k of `split`: `learn`'s are its
    own; `judged` (`test` of a family) are those that `simulate` (`compare`) judges by. `info` has the truth: theta
    [rad], failed; at an episode's end also `in_doubt`, whether its integration step may have been too long for these
    actions, and `substeps`, how many in a control period are likely to do. Raises UserError for an unknown family, a
    loop without limits, and what the study cannot be.
    """

    def __init__(
        self, study: Study | None = None, family: str = "", split: str = "learn", network: Inverse | None = None
    ) -> None:
        self._episodes = _Episodes(study, family, split, 1, network)
        self.observation_space, self.action_space = self._episodes.observation_space, self._episodes.action_space

    @property
    def torque(self) -> float:
        """Torque of an action of 1 [N m]: the power of two above all that tendons give, so that it divides exactly."""
        return self._episodes.torque

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """The next episode, or with a seed the first under it; there are no options."""
        super().reset(seed=seed)
        observed, theta, failed = self._episodes.begin(seed)
        return observed[0], self._told(theta, failed)

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Hold an action (1,) until the next sample; UserError for one that is no number."""
        observed, theta, failed, reward = self._episodes.step(np.asarray(action, np.float64).reshape(1))
        assert self._episodes.loops is not None
        return observed[0], float(reward[0]), False, self._episodes.loops.done, self._told(theta, failed)

    def _told(self, theta: Array, failed: Any) -> dict[str, Any]:
        return {name: values[0].item() for name, values in self._episodes.truth(theta, failed).items()}


class WristVectorEnv(VectorEnv[Array, Array, Array]):
    """`num_envs` of WristEnv's loops in one compiled call: of each reset the next so many episodes.

    They begin and end together; the step after the end resets them all, whatever the actions (autoreset NEXT_STEP).
    Worlds of a family must share segments, plant, timing, and levels of actuator and sensor (else UserError).
    """

    def __init__(
        self,
        num_envs: int = 8,
        study: Study | None = None,
        family: str = "",
        split: str = "learn",
        network: Inverse | None = None,
    ) -> None:
        self.metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}
        self._episodes = _Episodes(study, family, split, num_envs, network)
        self.num_envs = num_envs
        self.single_observation_space = self._episodes.observation_space
        self.single_action_space = self._episodes.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    @property
    def torque(self) -> float:
        """Torque of an action of 1 [N m], as WristEnv's."""
        return self._episodes.torque

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """The next episodes, or with a seed the first under it; there are no options."""
        super().reset(seed=seed)
        observed, theta, failed = self._episodes.begin(seed)
        return observed, self._told(theta, failed)

    def step(self, actions: Array) -> tuple[Array, Array, Any, Any, dict[str, Any]]:
        """Hold actions (num_envs, 1) until the next sample; UserError for one that is no number."""
        never = np.zeros(self.num_envs, bool)
        if self._episodes.loops is not None and self._episodes.loops.done:
            observed, info = self.reset()
            return observed, np.zeros(self.num_envs), never, never.copy(), info
        shares = np.asarray(actions, np.float64).reshape(self.num_envs)
        observed, theta, failed, reward = self._episodes.step(shares)
        assert self._episodes.loops is not None
        ended = np.full(self.num_envs, self._episodes.loops.done)
        return observed, reward, never, ended, self._told(theta, failed)

    def _told(self, theta: Array, failed: Any) -> dict[str, Any]:
        """The truth as gymnasium has it: beside every entry, whose it is."""
        told = self._episodes.truth(theta, failed)
        return told | {f"_{name}": np.ones(self.num_envs, bool) for name in told}


gymnasium.register(
    "wristctl/Wrist-v0", entry_point="wristctl.gym:WristEnv", vector_entry_point="wristctl.gym:WristVectorEnv"
)
