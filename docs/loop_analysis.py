"""How good the linearised loop's margins are, measured on the simulated one: `python docs/loop_analysis.py`.

For each row the gain's factor and the delay at which `wristctl analyse` says that the loop begins to oscillate, and at
which the simulated loop, with its limits, steps, friction and steppers, does. Writes docs/loop_analysis.md and
docs/images/loop-analysis.png; exit code 1 where a row's two numbers differ by more than 15 %.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import numpy as np

from wristctl.arrays import Array
from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Actuator, Plant, Sensor, TrueActuator, TrueSensor
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller, Gain
from wristctl.control.table import controller, gains_of
from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import where
from wristctl.simulation.batch import sample_period
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.stability.loop_analysis import AnalysedRow

HERE = Path(__file__).parent
WRIST = WristParameters()
FACTORS = np.round(np.arange(0.7, 1.51, 0.025), 3)
"""Of the predicted gain or delay."""
KICKS = (0.1, 0.3, 1.0, 3.0)
"""How far from straight the wrist is let go [deg]."""
STILL = 1e-3
"""Swing [deg] that is none: a quantised loop that does not oscillate comes to a complete rest."""
CLOSE = 0.15
LATEST = 40
"""Ticks by which a law's torque can be late here."""


@dataclass(frozen=True)
class Judged:
    """A row, and the kick [deg] that it is judged at."""

    law: str
    gains: str | dict[str, float]
    loop: Loop
    kick: float = 1.0
    note: str = ""

    @property
    def label(self) -> str:
        """What it is called in the table."""
        gains = self.gains if isinstance(self.gains, str) else " ".join(f"{k}={v:g}" for k, v in self.gains.items())
        level = f"{self.loop.actuator.level}{', camera' * (self.loop.sensor.level == 'camera')}"
        return f"{self.law}/{gains} | {level}, {1e3 * self.loop.control_period:g} ms"

    @property
    def row(self) -> AnalysedRow:
        """As it is analysed."""
        law = controller(self.law)
        named = dict(zip(law.gains, gains_of(law, self.gains), strict=True))
        return AnalysedRow(law, named, self.loop, WRIST, "slipping")


CAMERA = Sensor(level="camera", noise_deg=0.0, dropped=0.0)
LAGGED, TENDON = Actuator(level="lagged"), Actuator(level="tendon")
ROWS = (
    Judged("pid", {"Kp": 10.0, "Ki": 20.0, "Kd": 0.5}, Loop()),
    Judged("gvsc", "default", Loop()),
    Judged("computed-torque", "default", Loop(actuator=LAGGED)),
    Judged("computed-torque", "default", Loop(actuator=LAGGED, sensor=CAMERA)),
    Judged("nc", "stepper", Loop(actuator=LAGGED, sensor=CAMERA)),
    Judged("smc-tracking", "stepper", Loop(control_period=5e-3, actuator=TENDON, sensor=CAMERA), 0.3),
    Judged("super-twisting", "stepper", Loop(control_period=5e-3, actuator=TENDON, sensor=CAMERA), 0.3),
    Judged("smc", "initial", Loop(control_period=5e-3, actuator=TENDON, sensor=CAMERA), 0.3),
)


@cache
def altered(name: str) -> Controller:
    """The law with a torque that is multiplied about the resting one and comes late: gains factor, rest and late."""
    own = controller(name)
    inner, memory = compiled(own.law), own.memory

    def law(now: Any, wrist: Any, gains: Any, kept: Any) -> Any:
        torque = gains.factor * (inner(now, wrist, gains, kept) - gains.rest)
        late = torque
        for k in range(LATEST):
            late = where(abs(gains.late - (k + 1.0)) < 0.5, kept[memory + k], late)
        for k in range(LATEST - 1, 0, -1):
            kept[memory + k] = kept[memory + k - 1]
        kept[memory] = torque
        return gains.rest + late

    added = {each: Gain("", each, 1e-3, 1e3) for each in ("factor", "rest", "late")}
    return Controller(f"altered-{name}", law, own.source, {**own.gains, **added}, {}, memory + LATEST)


def swings(judged: Judged, theta: float, kick: float, factors: Sequence[float], delays: Sequence[float]) -> Array:
    """What is left [deg] of the loop's swing after a kick [deg] where its gain is multiplied and it is late [s]; inf
    where the wrist leaves its range.

    An ideal sensor's loop is changed at its law's torque, a camera's where its controller cannot know of it: pulleys
    are larger than believed, and frames older.
    """
    row, loop = judged.row, judged.loop
    values, ticks = list(row.law.values(row.gains)), [round(each / loop.control_period) for each in delays]
    law, loops, gains = row.law, [loop] * len(factors), np.tile(values, (len(factors), 1))
    if loop.sensor.level == "ideal":
        rest = row.analysed(theta)
        assert rest is not None
        law = altered(judged.law)
        own = [[factor, rest.linear.torque, tick] for factor, tick in zip(factors, ticks, strict=True)]
        gains = np.concatenate([gains, np.array(own, float)], axis=1)
    else:
        loops = [_louder_and_later(loop, *each) for each in zip(factors, ticks, strict=True)]
    horizon, k = 20.0, loop.plant_segments
    still = motion(
        Reference(kind="step", angle_deg=math.degrees(theta)), WRIST, horizon, sample_period(loop.control_period)
    )
    begin = np.full(k, (theta + math.radians(kick)) / k)
    which = np.zeros(len(factors), np.int64)
    done = rollout(law, gains, [still], which, loops, WRIST, start=lambda plant: begin, record=True)
    found = [_left(done.column("theta", lane)) for lane in range(len(factors))]
    return np.where(done.failed, math.inf, found)


def _louder_and_later(loop: Loop, factor: float, ticks: int) -> Loop:
    frames = loop.sensor.delay_frames + (ticks - 1e-6) * loop.control_period * loop.sensor.frame_rate
    motors = TrueActuator(pulley_radius=f"x{factor:.6f}") if factor != 1.0 else TrueActuator()
    camera = TrueSensor(delay_frames=frames) if ticks else TrueSensor()
    return loop.model_copy(update={"plant": Plant(actuator=motors, sensor=camera)})


def _left(theta: Array) -> float:
    """Half the peak-to-peak over the last fifth, its trend removed [deg]."""
    end = np.degrees(theta[-len(theta) // 5 :])
    place = np.linspace(-1.0, 1.0, len(end))
    return float(np.ptp(end - np.polynomial.Polynomial.fit(place, end, 1)(place)) / 2.0)


def onset(predicted: float, left: Array, values: Array) -> float:
    """The first of the values, as a share of what was predicted, at which the loop does not come to rest; nan: none."""
    swung = np.flatnonzero(~(left <= STILL))
    return float(values[swung[0]] / predicted) if len(swung) else math.nan
