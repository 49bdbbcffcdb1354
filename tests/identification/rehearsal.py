"""Rehearsals: the log that a bench would write of a wrist whose parameters are given.

For weighing an experiment before anyone performs it: does it tell what is to be found, and how well?
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wristctl.arrays import Array
from wristctl.config.choices import PLANTS
from wristctl.config.loop import DirectionName, Loop, Reference
from wristctl.config.plant import Actuator, TendonFacts, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.control.belief import Sides, belief_in_lanes
from wristctl.control.table import controller
from wristctl.errors import UserError
from wristctl.identification.forward import Supposed, across_plane, courses
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.actuator import Aim, actuate, deliver
from wristctl.simulation.reference import motion, toward
from wristctl.simulation.rollout import rollout
from wristctl.simulation.simulated_drives import SIDES, Motor, at_rest, counted_motor, drive_in_lanes, drive_of
from wristctl.simulation.worlds import facing, plant_of
from wristctl.wrist.directions import ACTIVE, DIRECTIONS, in_plane, tendons_of
from wristctl.wrist.pcc import PCC
from wristctl.wrist.segments import segments

if TYPE_CHECKING:
    import pandas as pd


# Tick of the simulation [s], and how many of them lie between two rows of the log.
_PERIOD, _LOGGED = 1e-3, 5


_SPREADS = tuple(name for name in TrueWrist.model_fields if name.endswith("_spread"))
_NOTHING_ELSE, _NOR_OF_TENDONS = TrueWrist(), TendonFacts()


@dataclass(frozen=True)
class RehearsedTruth:
    """True parameters of a rehearsed bench, unknown to its user.

    The marker's zero angle [deg] in the ulnar and the flexion plane, and what tendons 1, 2, 4, 5 have reeled in more
    than their spools' counts say [m].
    """

    wrist: WristParameters
    actuator: Actuator
    delay: float = 0.03
    noise_deg: float = 0.05
    zero_deg: tuple[float, float] = (0.0, 0.0)
    taut: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    frame_rate: float = 60.0
    exposure: float = 4e-3
    dropped: float = 0.05
    plant: TrueWrist = _NOTHING_ELSE
    """Further true parameters of the wrist, and the plant's model."""
    facts: TendonFacts = _NOR_OF_TENDONS
    """Further true facts of the tendons."""
    segments: int = Loop().plant_segments

    def __post_init__(self) -> None:
        """UserError for what no rehearsal could have."""
        if spreads := [name for name in _SPREADS if getattr(self.plant, name) != 0.0]:
            raise UserError("a rehearsed bench has one wrist", f"plant.{spreads[0]}", "give its own value, no spread")
        if self.actuator.level != "tendon":
            raise UserError("spools reel in elastic tendons", "actuator.level", "level: tendon")


@kernel
def _reel_in(drive: Any, motors: Any, belief: Any, winding: Any, commands: Any, out: Any, h: float) -> None:
    known, motor, on_spools = belief_in_lanes(belief), rows_of(motors), drive_in_lanes(drive)
    as_counted, zero = rows_of(winding), zero_like(motor[0])
    for tick in range(commands.shape[0]):
        command, reeled = rows_of(commands[tick]), part(rows_of(out[tick]), 0, (0, 0))
        counts, bend = lanes_like(reeled), part(command, 2, (0,))
        aim = Aim(bend, part(command, 3, (0,)), lanes_like(reeled))
        actuate(on_spools, motor, known, aim, part(command, 0, (0, 0)), h, counts)
        deliver(on_spools, (motor, as_counted, counts, bend, h), 0.5 * h + zero, (reeled, lanes_like(reeled)))


def spools(wrist: WristParameters, reference: Reference, actuator: Actuator, horizon: float, motor: Motor) -> Array:
    """Length reeled in by both sides' spools (T, 2) [m] in the middle of every millisecond, as their host counts.

    Feedforward follows a reference; it believes in `actuator`, and the motors turn as `motor` does.
    """
    followed, law = motion(reference, wrist, horizon, _PERIOD), controller("feedforward")
    loop = Loop(actuator=actuator)
    rolled = rollout(law, np.zeros((1, 0)), [followed], np.zeros(1, np.int64), loop, wrist, record=True, threads=1)
    sides = [2.0 * rolled.column(name, 0) for name in ("tension_plus", "tension_minus")]
    commands = np.stack([*sides, followed.theta_ref, followed.rate_ref], axis=1)
    alike, out = np.array(SIDES), np.empty((len(commands), 2))
    drive = drive_of(actuator, alike, _PERIOD, motor)
    begin = at_rest(drive, alike * wrist.pretension, wrist.length, PCC.taut(wrist, np.zeros(1)))
    belief, as_counted = Sides(segments(wrist, 1)[None], alike), np.array([1.0, 0.0, 0.0])
    _reel_in(drive, begin, belief, as_counted, commands, out, _PERIOD)
    return out


def rehearse(
    wrist: WristParameters, actuator: Actuator, truth: RehearsedTruth,
    moves: Sequence[tuple[DirectionName, Reference]], horizon: float, rng: np.random.Generator,
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:  # fmt: skip
    """The tables log, frames and trials of moves, each from rest; a controller believes in `wrist` and `actuator`."""
    import pandas as pd

    logs, sightings, kinds = [], [], []
    for number, (direction, reference) in enumerate(moves):
        side = DIRECTIONS[direction]
        motor = counted_motor(actuator, truth.actuator)
        reeled = spools(in_plane(wrist, direction), toward(reference, direction), actuator, horizon, motor)
        own, model = _own(truth, direction), PLANTS[truth.plant.model]
        wound = reeled * (truth.actuator.step_length / actuator.step_length)
        angle = courses([own], np.repeat(wound, 2, axis=1), _PERIOD, truth.segments, model)[0, :, 0]
        time = _PERIOD * np.arange(len(angle))
        ticks = slice(None, None, _LOGGED)
        steps = np.rint(reeled[ticks] / actuator.step_length).astype(int)
        columns = {"trial": number, "time": time[ticks], "counted": time[ticks] + 0.5 * _PERIOD}
        tendons = enumerate(tendons_of(side.plane))
        logs.append(pd.DataFrame(columns | {f"position_{tendon}": steps[:, at // 2] for at, tendon in tendons}))
        captured = np.arange(rng.uniform(0.0, 1.0), horizon * truth.frame_rate) / truth.frame_rate
        open_ = captured - truth.delay + truth.exposure * np.linspace(-0.5, 0.5, 41)[:, None]
        theta = np.interp(open_, time, angle).mean(axis=0) + np.deg2rad(
            truth.noise_deg * rng.standard_normal(len(captured)) + truth.zero_deg[side.plane == "flexion"]
        )
        kept = rng.random(len(captured)) >= truth.dropped
        verdict = np.where(kept, "ok", "no tip")
        theta = np.where(kept, theta, np.nan)
        columns = {"trial": number, "captured": captured, "used": captured + 0.01, "theta": theta, "verdict": verdict}
        sightings.append(pd.DataFrame(columns))
        kinds.append({"trial": number, "direction": direction, "push": 0.0})
    return pd.concat(logs), pd.concat(sightings), pd.DataFrame(kinds)


def _own(truth: RehearsedTruth, direction: DirectionName) -> Supposed:
    taut = dict(zip(ACTIVE, truth.taut, strict=True))
    one, two, three, four = (taut[tendon] for tendon in tendons_of(DIRECTIONS[direction].plane))
    wrist = plant_of(*facing(truth.wrist, truth.plant, direction))
    plane, ulnar = DIRECTIONS[direction].plane, plant_of(*facing(truth.wrist, truth.plant, "ulnar"))
    flexion = plant_of(*facing(truth.wrist, truth.plant, "flexion"))
    across = across_plane(wrist, plane, ulnar.stiffness, flexion.stiffness / ulnar.stiffness)
    taken = one, two, three, four
    return Supposed(wrist, truth.actuator, taken, plant=truth.plant, facts=truth.facts, across=across)
