"""A rig around any MuJoCo model with tendons that actuators pull (extra `mujoco`), for `hw-run --rig my_rig.py:RIG`.

    from wristctl.mujoco_rig import MujocoRig
    from wristctl.plugins.import_hook import data_file

    RIG = MujocoRig(data_file(__file__, "hand.xml"), bend="fingertip")

Somebody else's physics in virtual time, behind the camera that the sensor says. What a trial has to know of the robot
is taken from the model by `wristctl.mujoco_facts`. docs/mujoco-rig.md has an example.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wristctl.errors import UserError
from wristctl.mujoco_facts import Axes, Spooled, pulled, said_of
from wristctl.rig import Drive, Facts, Limits, Look, Reeled, Refused, Sensor, Tendon, VirtualClock, value

try:
    import mujoco
except ModuleNotFoundError as error:
    raise UserError("mujoco is not installed", "wristctl.mujoco_rig", "pip install 'wristctl[mujoco]'") from error

__all__ = ["AT_ONCE", "CAMERA", "EXACT", "MujocoRig"]

CAMERA = Sensor(rate=60.0, delay=1.0 / 30.0, noise_deg=0.1)
"""A camera as it is assumed of wristctl's own rig."""
EXACT = Sensor(rate=1000.0, delay=0.0, noise_deg=0.0)
"""Every bend as it is."""
AT_ONCE = Drive()
"""Motors that follow their targets at once."""


class MujocoRig:
    """A tendon-driven MuJoCo model as a rig; targets are metres of tendon reeled in.

    Parameters
    ----------
    model : path of an MJCF file, or its text
    bend : name of the site whose turning is the bend
    actuators : names of those that pull, in the order of the targets; none: all that pull a tendon
    sensor : rate, age and noise with which the bend is seen: CAMERA, EXACT or one's own. The tip is seen with the same
        noise of its direction from the base
    drive : delay, lag and resolution of the motors, and the stiffness of a tendon [N/m] behind an actuator that takes a
        force. One that takes a length has the stiffness of the model
    along, toward : the straight robot's direction and that of ulnar bends, in the model's axes
    tension : largest of a tendon [N]; None: that of the model
    rate, travel : of the motors [m/s, m]; None: as far as the straight robot's tendons need for `wrist.range_deg`
    slack : of each tendon when the rig is connected [m]
    tendons : where they run; None: found by a small pull of each
    wrist : what is known of the wrist, before what is found in the model
    seed : of the sensor's noise

    Raises UserError for what is no such model.
    """

    def __init__(
        self, model: Path | str, bend: str, *, actuators: Sequence[str] = (), sensor: Sensor = CAMERA,
        drive: Drive = AT_ONCE, along: ArrayLike = (1.0, 0.0, 0.0), toward: ArrayLike = (0.0, 1.0, 0.0),
        tension: float | None = None, rate: float = 0.2, travel: float | None = None, slack: float = 5e-4,
        tendons: Sequence[Tendon] | None = None, wrist: Mapping[str, Any] | None = None, seed: int = 0,
    ) -> None:  # fmt: skip
        self.model = _loaded(model)
        where = str(model) if isinstance(model, Path) else "MujocoRig"
        self._spools = Spooled.of(self.model, actuators, value(drive.stiffness), tension, where)
        self._axes = Axes.of(self.model, bend, along, toward, where)
        found = pulled(self.model, self._spools, self._axes, where)
        self._slack, self._rate, self._delay, self._lag = slack, rate, value(drive.delay), value(drive.lag)
        self._finest = value(drive.resolution)
        self.facts: Facts = said_of(
            found, self._spools, drive, sensor, Limits(travel or math.inf, rate, self._spools.tension), tendons, wrist,
            slack,
        )  # fmt: skip
        self.model.opt.timestep = self._step = found.step
        self.data = mujoco.MjData(self.model)
        self._noise, self._tip_noise = np.random.default_rng(seed), np.random.default_rng([seed, 1])
        self.clock = VirtualClock(self._advance)
        self._origin = 0.0
        self._begin()

    def _begin(self) -> None:
        """The straight robot, its tendons slack and its motors standing."""
        mujoco.mj_resetData(self.model, self.data)
        count = len(self._spools.actuators)
        self._wanted = self._reeled = np.zeros(count)
        self._coming: deque[tuple[float, NDArray[np.float64]]] = deque()
        self._steps, self._frames, self._origin = 0, 0, self.clock.now()
        self._spools.reel(self.data, self._reeled - self._slack)
        mujoco.mj_forward(self.model, self.data)
        self._seen: deque[tuple[float, NDArray[np.float64], NDArray[np.float64]]] = deque()
        self._motion = list[NDArray[np.float64]]()
        self._capture()

    @property
    def motion(self) -> NDArray[np.float64]:
        """True motion since the rig was connected, at each frame: time [s], bend (P,) [rad], tip (3,) [m]; (n, 4 + P).

        The tip is that of the site, from where the robot's first joint is: along, ulnar, flexion.
        """
        return np.array(self._motion)

    def connect(self) -> NDArray[np.float64]:
        """Stand straight with slack tendons, as if nothing had been."""
        self._begin()
        return np.zeros(len(self._spools.actuators))

    def send(self, targets: NDArray[np.float64]) -> NDArray[np.float64]:
        """Reel in so much of each tendon (T,) [m] after the drive's delay. Raises Refused for what is beyond travel."""
        if not (np.abs(targets) <= self.facts.limits.travel).all():  # a nan is not either
            raise Refused(f"targets {targets} m, beyond +-{self.facts.limits.travel:g} m")
        sent = np.array(targets, float)
        if self._finest > 0.0:
            sent = np.round(sent / self._finest) * self._finest
        self._coming.append((self.clock.now() + self._delay, sent))
        return sent

    def look(self) -> Look:
        """The newest frame that is old enough."""
        now = self.clock.now() - value(self.facts.sensor.delay) + 1e-9
        while len(self._seen) > 1 and self._seen[1][0] <= now:
            self._seen.popleft()
        moment, bend, tip = self._seen[0]
        seen = (bend, tip) if moment <= now else (math.nan * bend, math.nan * tip)
        return Look(seen[0], min(moment, self.clock.now()), None, Reeled(self._reeled, self.clock.now()), seen[1])

    def stop(self) -> None:
        """The motors stand where they are."""
        self._coming.clear()
        self._wanted = self._reeled

    def close(self) -> None:
        """Stop."""
        self.stop()

    def _advance(self, begin: float, end: float) -> None:
        last = self._step_at(end)
        while self._steps < last:
            while self._coming and self._coming[0][0] <= self._time(self._steps + 1):
                self._wanted = self._coming.popleft()[1]
            steps = 1
            if (left := self._wanted - self._reeled).any():
                step = self._step
                follows = left * -math.expm1(-step / self._lag) if self._lag > 0.0 else left
                self._reeled = self._reeled + np.clip(follows, -self._rate * step, self._rate * step)
            elif self._spools.alone:  # nothing changes before the next target or frame
                coming = self._step_at(self._coming[0][0]) if self._coming else last
                steps = max(1, min(last, coming, self._frame_step()) - self._steps)
            self._spools.reel(self.data, self._reeled - self._slack)
            mujoco.mj_step(self.model, self.data, steps)
            self._steps += steps
            if self._steps >= self._frame_step():
                self._capture()

    def _time(self, steps: int) -> float:
        return self._origin + steps * self._step

    def _step_at(self, time: float) -> int:
        """Steps that have been made by then."""
        return math.floor((time - self._origin) / self._step + 1e-6)

    def _frame_step(self) -> int:
        """Steps after which the next frame is due."""
        return math.ceil(self._frames / value(self.facts.sensor.rate) / self._step - 1e-6)

    def _capture(self) -> None:
        """Keep a frame: the bend that the sensor sees, and the true one."""
        mujoco.mj_kinematics(self.model, self.data)
        moment, planes = self._time(self._steps), self.facts.planes
        bend = self._axes.bend(self.data)[:planes]
        scatter = math.radians(value(self.facts.sensor.noise_deg))
        tip = self._axes.tip(self.data)
        shown = tip + self._tip_noise.normal(0.0, scatter * float(np.linalg.norm(tip)), 3)
        self._seen.append((moment, bend + self._noise.normal(0.0, scatter, planes), shown[: planes + 1]))
        self._motion.append(np.concatenate([[moment], bend, tip]))
        self._frames += 1


def _loaded(model: Path | str) -> Any:
    """The compiled model of an MJCF file or its text. UserError where MuJoCo refuses it."""
    try:
        if isinstance(model, Path):
            return mujoco.MjModel.from_xml_path(str(model))
        return mujoco.MjModel.from_xml_string(model)
    except ValueError as error:
        where = str(model) if isinstance(model, Path) else "MujocoRig"
        raise UserError(f"MuJoCo cannot read the model: {error}", where, "see what it names") from error
