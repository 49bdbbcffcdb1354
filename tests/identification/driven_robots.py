"""Robots of three tendons on motors whose currents are logged, drawn at random, each simulated and identified.

What is counted: how many 95 % intervals of stiffness ratios, directions and delays hold the truth, and how well a
circle that is in no log is predicted. `python -m tests.identification.driven_robots --count 20` keeps what has ended,
and goes on where it was.
"""

from __future__ import annotations

import math
import tempfile
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from tests.drawn_rigs import options, tried
from wristctl.arrays import Array
from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import Actuator, TrueWrist
from wristctl.config.wrist import TendonPlace, WristParameters
from wristctl.identification.arc_robot import inertia_of_arc
from wristctl.identification.driven_fit import DrivenFit, fitted_logs, motion_of
from wristctl.identification.driven_log import recordings_of
from wristctl.records.log_converters import read_log
from wristctl.records.log_looks import looked_at
from wristctl.records.open_log import OpenLog
from wristctl.simulation.spool_driven import SpooledWrist, spooled

SEED = 20261129
BELIEVED = WristParameters.model_validate(
    {"tendons": "three", "gravity": (0.0, 0.0), "gravity_flexion": 0.0, "hand_mass": 0.2}
)
# Integration step [s] and segments of the simulated wrist; noise of an inertial unit [rad] and of a current [A].
_STEP, _SEGMENTS, _NOISE, _CURRENT = 1e-3, 4, math.radians(0.1), 4e-3
# Least and largest moment of the plan over the stiffness [rad]; time of a log and of a circle [s].
_BEND, _LOG, _CIRCLE = 0.45, 60.0, 12.0
# Time at the begin of another log that gives its zero [s].
_ZEROED = 2.0


class DrivenRig(NamedTuple):
    """A robot that nobody knows."""

    wrist: WristParameters
    plant: TrueWrist
    actuator: Actuator
    newtons: Array
    """Tension of an ampere of each motor (M,) [N/A]."""
    delay: float
    rate: float
    """Rows of the log per second."""


class Counted(NamedTuple):
    """What one log told: intervals by name, by (low, truth, high), and the error of a circle over its motion."""

    intervals: dict[str, tuple[float, float, float]]
    circle: float
    left_out: float
    terms: tuple[str, ...]
    rate: float


def drawn_rig(rng: np.random.Generator, rate: float) -> DrivenRig:
    """Springs, damping and gains that are 10 to 40 % from each other, tendons up to 8 deg off, friction in all."""
    turn = rng.uniform(0.0, 360.0)
    places = tuple(TendonPlace(angle_deg=turn + 120.0 * k + rng.uniform(-8.0, 8.0)) for k in range(3))
    wrist = BELIEVED.model_copy(
        update={
            "stiffness": rng.uniform(0.6, 1.4), "damping": rng.uniform(0.05, 0.15), "tendons": places,
            "hand_mass": rng.uniform(0.1, 0.3),
        }
    )  # fmt: skip
    plant = TrueWrist(inner_friction=rng.uniform(0.005, 0.03), inner_presliding_deg=rng.uniform(0.3, 1.0))
    actuator = Actuator(level="tendon", friction=rng.uniform(0.02, 0.1), sheath=0.0)
    newtons = rng.uniform(8.0, 20.0) * (1.0 + 0.08 * rng.standard_normal(3))
    return DrivenRig(wrist, plant, actuator, newtons, rng.uniform(0.01, 0.06), rate)


def plan(rng: np.random.Generator) -> Any:
    """Tendons' pulls over the stiffness and radius (T, 3) [rad] by times: slow sums of sines of each, none negative."""
    sizes, pace = rng.uniform(0.5, 1.0, (3, 4)), rng.uniform(0.08, 0.6, (3, 4))
    phase = rng.uniform(0.0, math.tau, (3, 4))

    def pulls(time: Array) -> Array:
        waves = np.sin(math.tau * pace * time[:, None, None] + phase) * sizes
        begin = np.minimum(1.0, time / 2.0)[:, None]
        return 0.1 + begin * _BEND * np.maximum(0.0, 0.25 + waves.sum(axis=2) / 2.0)

    return pulls


def circle(time: Array) -> Array:
    """Pulls (T, 3) of a circle of 0.3 rad, begun slowly."""
    angle, size = math.tau * time / 6.0, 0.3 * np.minimum(1.0, time / 2.0)
    toward = np.cos(angle[:, None] - math.tau / 3.0 * np.arange(3))
    return 0.1 + size[:, None] * np.maximum(0.0, toward)


def recorded(rig: DrivenRig, pulls: Any, duration: float, rng: np.random.Generator, file: Path) -> Path:
    """The log of a motion: currents [mA] and the quaternions of a unit that is stuck on somehow."""
    radius, stiffness = rig.wrist.tendon_radius, rig.wrist.stiffness

    def tensions(at: Array, which: Any) -> Array:
        return np.repeat((stiffness / radius * pulls(at))[:, :, None], len(which), axis=2)

    lane = SpooledWrist(rig.wrist, rig.actuator, np.zeros(2 * _SEGMENTS), winch=True, plant=rig.plant, planes=2)
    done = spooled([lane], tensions, math.ceil((duration + 0.2) / _STEP), _STEP)
    time = np.arange(0.0, duration, 1.0 / rig.rate)
    seen = np.maximum(0.0, time - rig.delay)
    bends = np.stack([np.interp(seen, _STEP * np.arange(done.bends.shape[1]), one) for one in done.bends[0].T], axis=1)
    currents = stiffness / radius * pulls(time) / rig.newtons + _CURRENT * rng.standard_normal((len(time), 3))
    turned = Rotation.from_rotvec(np.stack([0.0 * time, -bends[:, 1], bends[:, 0]], axis=1))
    shaken = Rotation.from_rotvec(_NOISE * rng.standard_normal((len(time), 3)))
    mounted = Rotation.random(random_state=int(rng.integers(2**31)))
    turns = (mounted * turned * shaken).as_quat()
    columns = np.column_stack([time, 1e3 * currents, turns])
    head = "time [s],current_1 [mA],current_2 [mA],current_3 [mA],quat_x,quat_y,quat_z,quat_w"
    np.savetxt(file, columns, "%.6f", ",", header=head, comments="")
    return file


def truth_of(rig: DrivenRig) -> dict[str, float]:
    """What a log is to tell, by the names of the unknowns."""
    stiffness, mean = rig.wrist.stiffness, float(rig.newtons.mean())
    assert not isinstance(rig.wrist.tendons, str)
    truth = {"stiffness": stiffness / (mean * rig.wrist.tendon_radius), "delay": rig.delay}
    truth |= {"damping": rig.wrist.damping / stiffness, "inertia": inertia_of_arc(rig.wrist) / stiffness}
    truth |= {f"direction_{k}": math.radians(place.angle_deg) for k, place in enumerate(rig.wrist.tendons, 1)}
    return truth | {f"gain_{k}": float(rig.newtons[k - 1]) / mean for k in (2, 3)}


def predicted(found: DrivenFit, log: OpenLog) -> tuple[float, float]:
    """RMS error of another log's bends and their motion [rad]; its begin gives its zero."""
    (recording,) = recordings_of([log], found.robot)
    begin = recording.time < recording.time[0] + _ZEROED
    nothing = np.zeros(len(begin), bool)
    recording = replace(recording, session="another", zeroing=begin, fitted=nothing, asked=~begin)
    asked = found.fit.asked_of(recording)
    return asked.rms("asked"), motion_of([recording.measured[~begin]])


def counted(number: int) -> Counted:
    """What a robot's log tells: half of the robots at 10 Hz, half at 50 Hz."""
    rng = np.random.default_rng([SEED, number])
    rig = drawn_rig(rng, (10.0, 50.0)[number % 2])
    with tempfile.TemporaryDirectory() as folder:
        files = [
            recorded(rig, pulls, duration, rng, Path(folder) / f"{name}.csv")
            for name, pulls, duration in (("log", plan(rng), _LOG), ("circle", circle, _CIRCLE))
        ]
        log, other = (looked_at(read_log(file)) for file in files)
    found: DrivenFit = fitted_logs([log], BELIEVED, IdentifySettings())
    truth, intervals = truth_of(rig), {}
    for name, told in found.fit.told.items():
        if name in truth:
            turns = round((told.value - truth[name]) / math.tau) * math.tau if name.startswith("direction") else 0.0
            intervals[name] = (told.low - turns, truth[name], told.high - turns)
    error, moved = predicted(found, other)
    return Counted(intervals, error / moved, found.share, found.chosen.terms, rig.rate)


def summary(results: list[Counted]) -> list[str]:
    """Lines: how many intervals hold the truth of those that are told, and how well circles are predicted."""
    held, told = Counter[str](), Counter[str]()
    for one in results:
        for name, (low, truth, high) in one.intervals.items():
            known = math.isfinite(low + high)
            told[name] += known
            held[name] += known and low <= truth <= high
    circles = sorted(one.circle for one in results)
    lines = [f"{len(results)} robots: {held.total()} of {told.total()} intervals that are told hold the truth "
             f"({100.0 * held.total() / max(1, told.total()):.1f} %); circles to {circles[len(circles) // 2]:.3f} of "
             f"their motion, the worst to {circles[-1]:.3f}; to a tenth {sum(c <= 0.1 for c in circles)}"]  # fmt: skip
    return lines + [f"  {name}: told in {told[name]}, holds the truth in {held[name]}" for name in told]


def main() -> None:
    """Identify robots, and say how many intervals hold."""
    asked = options(__doc__, 20, "driven-robots").parse_args()
    results = [Counted(**one) for _, one in tried(asked, lambda number: counted(number)._asdict())]
    print("\n".join(summary(results)), flush=True)


if __name__ == "__main__":
    main()
