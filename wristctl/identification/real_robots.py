"""Real robots whose recordings their authors published: geometry, what is fitted and predicted, their own error."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.identification.arc_robot import ArcRecording, ArcRobot, window_means
from wristctl.records.log_converters import read_log
from wristctl.records.log_looks import looked_at, telling
from wristctl.records.open_log import OpenLog

Cases = list[list[ArcRecording]]
_THIRDS = tuple(k * math.tau / 3.0 for k in range(3))
# Time between samples of the neck [s], length of a block of its recordings, and until when it rests in a closed loop.
_PERIOD, _BLOCK, _RESTS = 0.1, 5.0, 0.15
ZEROS_UNTIL = 20.0
"""Time [s] up to which the neck's predicted recording gives its zero and slack."""
# Samples of a block of a recording without times or patterns, and of one recording at most.
_SAMPLES, _MOST = 60, 1500


@dataclass(frozen=True)
class RealRobot:
    """A robot as its authors published it."""

    title: str
    """Its name in a sentence."""
    citation: str
    robot: ArcRobot
    read: Callable[[Mapping[str, Path]], Cases]
    """Recordings that are fitted together, several times; from files by the ends of their names."""
    parts: str
    """What is fitted and what is predicted, in a sentence."""
    asked: str
    """What is predicted, as the head of a table."""
    authors: tuple[tuple[str, float], ...] = ()
    """The authors' own models with their errors of what is predicted [deg or mm], the best one first."""
    centred: bool = False
    """Whether the mean error does not count, as its authors have it."""
    in_sample: bool = False
    """Whether what is predicted was fitted too."""
    steps: Callable[[Mapping[str, Path]], list[ArcRecording]] | None = None
    """Further recordings that are predicted with what was found, and their zero from their begin."""

    @property
    def unit(self) -> str:
        """Unit of errors."""
        return self.robot.unit

    @property
    def scale(self) -> float:
        """Error in its unit, over that in SI units."""
        return self.robot.scale


def _spools(log: OpenLog, tendons: int) -> Array:
    return np.column_stack([log.whole(f"spool_{k}") for k in range(1, tendons + 1)])


def _tips(log: OpenLog) -> Array:
    return np.column_stack([log.whole(f"tip_{axis}") for axis in "xyz"])


def _looked_at(file: Path, kind: str) -> OpenLog:
    """A recording with the looks that a log of one's own has; what they say is warned of."""
    return telling(looked_at(read_log(file, kind)))


def _neck_recording(log: OpenLog, name: str, fitted: bool, zeroing: float) -> ArcRecording:
    """Means over 0.1 s of a recording of the soft neck."""
    time, bends, spools = log.whole("time"), log.bends(), _spools(log, 3)
    assert bends is not None  # the converter refuses files without
    at = np.arange(time[0] + 0.5 * _PERIOD, time[-1] - 0.5 * _PERIOD, _PERIOD)
    whole, pause = np.ones(len(at), bool), np.full(len(at), _PERIOD)
    pause[0] = math.nan
    begin = at < zeroing
    return ArcRecording(
        name, name, at, window_means(time, spools, at, _PERIOD), window_means(time, bends, at, _PERIOD), pause,
        whole & fitted, begin & (not fitted), ~begin & (not fitted), (at // _BLOCK).astype(np.int64),
        float(log.columns["mass"][0]), course=(time, spools),
    )  # fmt: skip


def _neck(files: Mapping[str, Path]) -> Cases:
    loads = {0: True, 1000: True, 500: False}
    endings = {load: f"imu_openloop/spring_test_{load}gr.csv" for load in loads}
    logs = {load: _looked_at(files[ending], "humasoft") for load, ending in endings.items()}
    return [[_neck_recording(logs[load], f"{load} g", fitted, ZEROS_UNTIL) for load, fitted in loads.items()]]


def _neck_steps(files: Mapping[str, Path]) -> list[ArcRecording]:
    """Every step of the closed loops: a file has several, each with a clock that starts again."""
    steps = []
    for load in ("000", "200", "400", "600", "800", "1000"):
        log = _looked_at(files[f"imu_closeloop/frontier_test_{load}gr.csv"], "humasoft")
        for number, trial in enumerate(log.trials().values(), 1):
            steps.append(_neck_recording(trial, f"step {number}, {int(load)} g", False, _RESTS))
    return steps


def _opencr(files: Mapping[str, Path]) -> Cases:
    """Rows in the order of time; a pattern, with the rows where it is held, begins at the straight robot."""
    parts = []
    for ending, file in files.items():
        log = _looked_at(file, "opencr")
        patterns = np.array([str(word).removesuffix("_hold") for word in log.words["trial"]])
        fitted = np.full(len(log), ending.endswith("_train.csv"))
        parts.append((log.whole("time"), _spools(log, 9), _tips(log), patterns, fitted))
    time, spools, tips, patterns, fitted = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    order = np.argsort(time, kind="stable")
    time, spools, tips, patterns, fitted = (x[order] for x in (time, spools, tips, patterns, fitted))
    block = np.unique(patterns, return_inverse=True)[1]
    pause = np.diff(time, prepend=math.nan)
    pause[1:][block[1:] != block[:-1]] = math.nan
    nothing = np.zeros(len(time), bool)
    return [[ArcRecording("all", "all", time - time[0], spools, tips, pause, fitted, nothing, ~fitted, block)]]


def _halves(count: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.int64]]:
    first = np.arange(count) < count // 2
    return first, ~first, np.arange(count) // _SAMPLES


def _silicone_arm(files: Mapping[str, Path]) -> Cases:
    """Of each day the first half is fitted and the second predicted."""
    cases: Cases = []
    for name, file in files.items():
        log = _looked_at(file, "deepc-arm")
        if "spool_1" not in log.columns:  # tips of the closed loops
            continue
        time = log.whole("time")
        pause = np.diff(time, prepend=math.nan)
        first, second, block = _halves(len(log))
        nothing = np.zeros(len(log), bool)
        cases.append(
            [ArcRecording(name, name, time, _spools(log, 3), _tips(log), pause, first, nothing, second, block)]
        )
    return cases


def _probe(files: Mapping[str, Path]) -> Cases:
    """Every sheet is fitted by itself, whole; thinned to no more samples than a cycle needs."""
    cases: Cases = []
    for name, file in files.items():
        for sheet, log in _looked_at(file, "tee-probe").trials().items():
            bends = log.bends()
            assert bends is not None
            kept = np.arange(0, len(log), max(1, math.ceil(len(log) / _MOST)))
            pause = np.ones(len(kept))
            pause[0] = math.nan
            whole, nothing = np.ones(len(kept), bool), np.zeros(len(kept), bool)
            block = np.arange(len(kept)) // _SAMPLES
            title = f"{name}, {sheet}" if sheet else name
            cases.append(
                [
                    ArcRecording(
                        title, title, kept.astype(float), _spools(log, 2)[kept], bends[kept], pause, whole, nothing,
                        whole, block,
                    )
                ]
            )  # fmt: skip
    return cases


def recordings_of(robot: RealRobot, files: Mapping[str, Path]) -> Cases:
    """Recordings of a robot by the ends of its files' names. Raises UserError where none is of its kind."""
    cases = robot.read(files)
    if not cases:
        where = ", ".join(map(str, files.values())) or "no file"
        raise UserError(f"no recording of {robot.title} with its motors", where, "wristctl validate --list")
    return cases


SOFT_NECK = RealRobot(
    title="UC3M's soft neck",
    citation="Mena et al., doi 10.3389/frobt.2020.00027; HUMASoft/Data-and-Results @704ab9a, LGPL-2.1",
    robot=ArcRobot(
        (0.107,), _THIRDS, 0.052, (1, 1, 1), "bend",
        ("gain", "tendon", "softening", "shortening", "delay", "turn"), {"turn": 1.5},
    ),
    read=_neck,
    parts="0 and 1,000 g are fitted; the first 20 s of 500 g give its zero and slack; the rest of it is predicted",
    asked="500 g, 20 to 70 s",
    authors=(("authors' geometry", 2.31),),
    steps=_neck_steps,
)  # fmt: skip


def _opencr_robot(lengths: tuple[float, float, float]) -> ArcRobot:
    base = (
        "tendon_1", "tendon_2", "tendon_3", "stiffness_2", "stiffness_3", "turn_1", "turn_2", "turn_3", "tilt_y",
        "tilt_z",
    )  # fmt: skip
    turns = {"turn_1": -3.1, "turn_2": -2.55, "turn_3": -2.05, "tendon_1": 5.0, "tendon_2": 5.0, "tendon_3": 5.0}
    return ArcRobot(lengths, _THIRDS * 3, 0.0045, (1, 1, 1, 2, 2, 2, 3, 3, 3), "tip", base, turns)


_OPENCR = "arXiv 2606.22397; ContinuumRoboticsLab/opencr-mujoco @17fff8b, MIT"
_SPLIT = "fitted to its authors' training patterns; their held-out patterns are predicted"
OPENCR_V4 = RealRobot(
    title="OpenCR v4", citation=_OPENCR, robot=_opencr_robot((0.060, 0.0625, 0.064)), read=_opencr, parts=_SPLIT,
    asked="18 held-out patterns",
    authors=(("OpenCR-MuJoCo, better calibration", 9.38), ("OpenCR-MuJoCo, other", 12.11)), centred=True,
)  # fmt: skip
OPENCR_V6 = RealRobot(
    title="OpenCR v6", citation=_OPENCR, robot=_opencr_robot((0.100, 0.100, 0.022)), read=_opencr, parts=_SPLIT,
    asked="12 held-out patterns", centred=True,
)  # fmt: skip
DEEPC_ARM = RealRobot(
    title="the DeePC arm",
    citation="arXiv 2510.08953; chengoy30/DeePC-for-Soft-Robot-Control @b073f32, no licence",
    robot=ArcRobot(
        (0.090,), _THIRDS, 0.010, (1, 1, 1), "tip",
        ("gain", "tendon", "shortening", "delay", "turn", "tilt_y", "tilt_z"), {"delay": 0.1},
    ),
    read=_silicone_arm,
    parts="the first half of each day is fitted; the second is predicted",
    asked="second half of each day",
)  # fmt: skip
TEE_PROBE = RealRobot(
    title="the TEE probe",
    citation="bfortuno/TEE-Probe_hysteresis_id @dba400e, no licence",
    robot=ArcRobot((0.08,), (0.0, math.pi), 0.010, (1, 1), "bend", ("gain", "tendon"), {}, timed=False),
    read=_probe,
    parts="each sheet is fitted, whole: what is predicted was fitted too",
    asked="all samples, in sample",
    in_sample=True,
)
