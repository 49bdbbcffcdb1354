"""gymnasium's environments over the closed loops of a study (extra `gym`): one wrist, or many at once.

An episode is one motion of the horizon's length, in the planes that it bends in. The action is the torque that a law
would want in each plane, or the tension of each tendon; the observation is what a law sees, behind a camera the
observer's estimate and never the plant's truth. docs/gym.md has it all.

    import wristctl, wristctl.gym

    env = wristctl.gym.WristEnv(wristctl.load_study("study.yaml"))
    many = gymnasium.make_vec("wristctl/Wrist-v0", num_envs=1024, vectorization_mode="vector_entry_point")
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.study import Study
from wristctl.errors import UserError, meant

if TYPE_CHECKING:
    from wristctl.simulation.cases import Case
    from wristctl.simulation.stepped_loops import Given, SteppedLoops
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
    Observed("theta", "rad", "bend as measured, behind a camera as the observer estimates it", 2.0 * math.pi),
    Observed("rate", "rad/s", "its rate, likewise", 100.0),
    Observed("theta_ref", "rad", "the reference", 2.0 * math.pi),
    Observed("rate_ref", "rad/s", "its rate", 100.0),
    Observed("acceleration_ref", "rad/s2", "its acceleration", 1e4),
    Observed("torque_low", "N m", "least torque that the tendons can give here", 100.0),
    Observed("torque_high", "N m", "largest torque that the tendons can give here", 100.0),
    Observed("load", "N m", "load torque as the observer estimates it; 0 where sensors are ideal", 100.0),
)
"""Signals of an observation in one plane, in their order."""

SCALE = math.radians(10.0)
"""Error [rad] at which a step costs 1."""


def observed_in(planes: int) -> tuple[Observed, ...]:
    """Signals of an observation in so many planes: in two those toward ulnar, then those toward flexion."""
    from wristctl.simulation.trajectory import PLANES

    if planes == 1:
        return OBSERVED
    return tuple(
        Observed(f"{each.name}_{plane}", each.unit, f"{each.meaning}, {plane}", each.bound)
        for plane in PLANES
        for each in OBSERVED
    )


# What episodes are drawn for: of one loop and, with True, of a family.
_SPLITS = {False: ("learn", "judged"), True: ("learn", "tune", "validation", "test")}


class _Episodes:
    """The episodes of a study's loop or family, so many at a time: each number is a world, a motion and its noise."""

    def __init__(
        self, study: Study | str | Path | None, family: str, split: str, count: int, network: Inverse | None,
        actions: Given,
    ) -> None:  # fmt: skip
        from wristctl.control.law import NOW
        from wristctl.simulation.drawn_worlds import asked_of
        from wristctl.simulation.planes import Asked, planes_of
        from wristctl.simulation.stepped_loops import largest_torque, places_of
        from wristctl.simulation.worlds import loop_facing
        from wristctl.study_files.load import load_study

        if count < 1:
            raise UserError(f"{count} wrists", "num_envs", "at least 1")
        self.study = load_study([Path(study)]) if isinstance(study, str | Path) else study or Study()
        self.family, self.split = family, split
        if family and family not in self.study.families:
            fix = meant(family, self.study.families) if self.study.families else "families: in the study"
            raise UserError(f"no family {family!r}", "family", fix)
        if actions not in ("torques", "tensions"):
            raise UserError(f"no actions are {actions!r}", "actions", meant(actions, ("torques", "tensions")))
        splits = _SPLITS[bool(family)]
        if split not in splits:
            raise UserError(f"no split is {split!r}", "split", meant(split, splits))
        simulated = self.study.simulate
        self.wrist, self.loop = self.study.wrist, self.study.families[family].loop if family else simulated.loop
        drawn = asked_of(self.study.families[family]) if family else []
        asked = drawn or [Asked(simulated.loop, simulated.reference, simulated.direction)]
        self.planes = planes_of(self.wrist, asked)
        if not family and self.planes == 1:
            self.wrist, self.loop = loop_facing(self.wrist, self.loop, simulated.direction)
        if not self.loop.limits:
            raise UserError(f"without limits no {actions[:-1]} is the largest", "loop.limits", "loop.limits: true")
        self.count, self.network, self.seed, self.next = count, network, self.study.seed, 0
        self.actions, self.observed = actions, observed_in(self.planes)
        self.picked = [NOW.index(each.name) for each in OBSERVED]
        torques = actions == "torques"
        most = largest_torque(self.wrist, self.planes) if torques else self.wrist.tension_limit
        self.largest = 2.0 ** math.ceil(math.log2(most))
        entries = self.planes if torques else places_of(self.wrist, self.planes)
        self.action_space = Box(-1.0 if torques else 0.0, 1.0, (entries,), np.float64)
        self.bound = np.array([each.bound for each in self.observed])
        self.observation_space = Box(-self.bound, self.bound, dtype=np.float64)
        self.loops: SteppedLoops | None = None
        self.warned = False

    @property
    def torque(self) -> float:
        """Torque of an action of 1 [N m]. Raises UserError where actions are tensions."""
        if self.actions != "torques":
            raise UserError("these actions are tensions", "torque", "largest, the tension of an action of 1")
        return self.largest

    def begin(self, seed: int | None) -> tuple[Array, Array, Any]:
        """The next episodes, or with a seed the first under it: observations, true bends, and who has failed."""
        from wristctl.simulation.closed_loop import equilibrium
        from wristctl.simulation.stepped_loops import SteppedLoops

        if seed is not None:
            self.seed, self.next = seed, 0
        cases = self._cases(self.next)
        self.next += self.count
        rests = not self.family and self.study.simulate.start == "equilibrium"
        start = equilibrium(self.loop, self.planes) if rests else None
        try:
            self.loops = SteppedLoops(cases, self.wrist, start, self.actions)
        except ValueError as error:
            what = f"the worlds of {self.family} cannot be stepped together: {error}"
            raise UserError(
                what, f"families.{self.family}.draw", "draw no such setting, or step them one by one"
            ) from error
        return self._seen()[:3]

    def step(self, given: Any) -> tuple[Array, Array, Any, Array]:
        """After a sample with these actions (count, A): observations, true bends, who has failed, and rewards.

        Of one number each the last axis, and of one wrist the first, may be left out.
        """
        if self.loops is None or self.loops.done:
            raise gymnasium.error.ResetNeeded("reset before the first step, and after an episode's end")
        actions, (entries,) = np.asarray(given, np.float64), self.action_space.shape
        shapes = [(self.count, entries), *[(entries,)] * (self.count == 1), *[(self.count,)] * (entries == 1)]
        if actions.shape not in [*shapes, *[()] * (shapes[0] == (1, 1))]:
            raise UserError(
                f"actions of shape {actions.shape}", "step(action)", f"{shapes[1 if self.count == 1 else 0]}"
            )
        actions = actions.reshape(self.count, entries)
        if not np.isfinite(actions).all():
            raise UserError("an action that is no number", "step(action)", "a finite one")
        self.loops.step(self.largest * actions)
        return self._seen()

    def truth(self, theta: Array, failed: Any) -> dict[str, Any]:
        """Entries of `info`, of each episode; at its end also whether its integration step is in doubt."""
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
        from wristctl.simulation.trajectory import size_of

        assert self.loops is not None
        sight = self.loops.look()
        error = np.where(sight.failed, 2.0 * sight.limit, size_of(sight.bend - sight.reference))
        signals = sight.signals[..., self.picked].reshape(self.count, -1)
        observed = np.clip(np.nan_to_num(signals), -self.bound, self.bound)
        theta = sight.bend[:, 0] if self.planes == 1 else sight.bend
        return observed, theta.copy(), sight.failed, -((error / SCALE) ** 2)

    def _cases(self, first: int) -> Sequence[Case]:
        from wristctl.config.loop import sample_period
        from wristctl.simulation.cases import Case
        from wristctl.simulation.closed_loop import scenario_of
        from wristctl.simulation.drawn_worlds import drawn_cases
        from wristctl.simulation.planes import motion_in
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
        numbers, period = range(first, first + self.count), sample_period(self.loop.control_period)
        followed = motion_in(
            self.planes, chosen.reference, chosen.direction, self.wrist, chosen.horizon, period, self.network
        )
        scenario = scenario_of(chosen.reference, chosen.direction)
        loops = loops_of(self.loop, [draws.plant(number) for number in numbers])
        return [Case(loop, followed, draws.camera(scenario, k), 0) for loop, k in zip(loops, numbers, strict=True)]


class WristEnv(gymnasium.Env[Array, Array]):
    """One closed loop of a study: its `simulate` section's, or with `family` the worlds of a family one after another.

    `study` may be a study's file or an experiment's name, as in `wristctl.simulate`; None: that of defaults.
    It bends in P planes: the planes of the section's loop, or two where any world of the family leaves its plane.
    Observation (8 P,): `observed`. Action (P,): the torque that is wanted in each plane until the next step, a control
    period (1 ms where that is shorter) later, as a share of `largest` [N m]. With `actions="tensions"` it is (T,): the
    tension of a tendon at each place, in one plane of each side, as a share of `largest` [N]. What tendons cannot give
    is cut off. Reward: -(e / 10 deg)^2, e being the size of the true bend's error; once the wrist has left its range,
    with e both ends of the range apart. An episode lasts the horizon (truncated); a wrist that has failed stays where
    it was till then.

    Episode k under a seed (the study's where reset is given none) is repetition or case k of `split`: `learn`'s are its
    own; `judged` (`test` of a family) are those that `simulate` (`compare`) judges by. `info` has the truth: theta
    [rad], in two planes (2,), and failed; at an episode's end also `in_doubt`, whether its integration step may have
    been too long for these actions, and `substeps`, how many in a control period are likely to do. Raises UserError for
    an unknown family, other actions, a loop without limits, and what the study cannot be.
    """

    def __init__(
        self,
        study: Study | str | Path | None = None,
        family: str = "",
        split: str = "learn",
        network: Inverse | None = None,
        actions: Given = "torques",
    ) -> None:
        self._episodes = _Episodes(study, family, split, 1, network, actions)
        self.observation_space, self.action_space = self._episodes.observation_space, self._episodes.action_space

    @property
    def observed(self) -> tuple[Observed, ...]:
        """Signals of an observation, in their order."""
        return self._episodes.observed

    @property
    def largest(self) -> float:
        """Torque [N m] or tension [N] of an action of 1: the power of two above all that tendons give or bear, so that
        it divides exactly."""
        return self._episodes.largest

    @property
    def torque(self) -> float:
        """Torque of an action of 1 [N m]. Raises UserError where actions are tensions."""
        return self._episodes.torque

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """The next episode, or with a seed the first under it; there are no options."""
        super().reset(seed=seed)
        observed, theta, failed = self._episodes.begin(seed)
        return observed[0], self._told(theta, failed)

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Hold an action until the next sample; UserError for one of another shape, or that is no number."""
        observed, theta, failed, reward = self._episodes.step(action)
        assert self._episodes.loops is not None
        return observed[0], float(reward[0]), False, self._episodes.loops.done, self._told(theta, failed)

    def _told(self, theta: Array, failed: Any) -> dict[str, Any]:
        told = {name: values[0] for name, values in self._episodes.truth(theta, failed).items()}
        return {name: value if isinstance(value, np.ndarray) else value.item() for name, value in told.items()}


class WristVectorEnv(VectorEnv[Array, Array, Array]):
    """`num_envs` of WristEnv's loops in one compiled call: of each reset the next so many episodes.

    They begin and end together; the step after the end resets them all, whatever the actions (autoreset NEXT_STEP).
    Worlds of a family must share segments, plant, timing, and levels of actuator and sensor (else UserError).
    """

    def __init__(
        self,
        num_envs: int = 8,
        study: Study | str | Path | None = None,
        family: str = "",
        split: str = "learn",
        network: Inverse | None = None,
        actions: Given = "torques",
    ) -> None:
        self.metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}
        self._episodes = _Episodes(study, family, split, num_envs, network, actions)
        self.num_envs = num_envs
        self.single_observation_space = self._episodes.observation_space
        self.single_action_space = self._episodes.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    @property
    def observed(self) -> tuple[Observed, ...]:
        """Signals of an observation, as WristEnv's."""
        return self._episodes.observed

    @property
    def largest(self) -> float:
        """Torque [N m] or tension [N] of an action of 1, as WristEnv's."""
        return self._episodes.largest

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
        """Hold actions (num_envs, A) until the next sample; UserError for another shape, or what is no number."""
        never = np.zeros(self.num_envs, bool)
        if self._episodes.loops is not None and self._episodes.loops.done:
            observed, info = self.reset()
            return observed, np.zeros(self.num_envs), never, never.copy(), info
        observed, theta, failed, reward = self._episodes.step(actions)
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
