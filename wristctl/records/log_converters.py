"""Converters by name: files of real robots as their authors published them, read as open logs.

Nobody's recordings are part of this package; `wristctl validate --list` says where each set is. Axes are those of
this package: the straight robot along +x, bending toward +y and +z.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.config.choices import LOG_FORMATS
from wristctl.errors import UserError, nearest
from wristctl.records.column_ranges import TENDON_OFFSET, numbers_of
from wristctl.records.log_columns import Units
from wristctl.records.matlab_vectors import variables_of
from wristctl.records.open_log import OpenLog, read_table, text_of
from wristctl.records.parquet_logs import data_frame
from wristctl.records.workbooks import read_sheets

NECK_WINCH = 0.010
"""Radius of the soft neck's winches [m]: 0.1745 mm of tendon a degree."""
ARM_STEP = math.pi * 10e-3 / 200
"""Length of tendon that a step of the silicone arm's motors reels in [m]: pulley of 10 mm, 200 steps a turn."""
ARM_PERIOD = 0.25
"""Time between two samples of the silicone arm [s]."""
PROBE_RADIUS = 0.010
"""Length of tendon [m] that the probe is taken to move for a radian of bend: its pulleys are not published."""

_NECK_LOAD = re.compile(r"(\d+)gr")
_COMMAND = re.compile("cmd|command|target|ref|angle_deg_")


@dataclass(frozen=True)
class Converter:
    """Reader of one laboratory's files."""

    what: str
    """Description of the files, for a list."""
    read: Callable[[Path], OpenLog]


def _soft_neck(file: Path) -> OpenLog:
    """The motors' encoders as spools, the inertial unit's inclination and orientation; the load by the file's name.

    The open loop and the steps have encoders in degrees of the winch, the closed loops in radians.
    """
    heads = _heads(file)
    unit = f"{1e3 * NECK_WINCH}" if "control_signal_m1" in heads else f"{1e3 * math.radians(NECK_WINCH)}"
    known = {
        "time": "time=time [s]",
        "inclination_sensor": "inclination=inclination_sensor [deg]",
        "sensor_inclination": "inclination=sensor_inclination [deg]",
        "orientation_sensor": "orientation=orientation_sensor [deg]",
        "sensor_orientation": "orientation=sensor_orientation [deg]",
    } | {f"encoder{k}": f"spool_{k}=encoder{k} [{unit} mm]" for k in (1, 2, 3)}
    names = [entry for head, entry in known.items() if head in heads]
    if not any(name.startswith("inclination") for name in names):
        raise UserError("no inclination of a soft neck", str(file), "a file of HUMASoft/Data-and-Results")
    log = read_table(file, ", ".join(names), "recording of the soft neck")
    trial = file.stem.rpartition("__")[2]
    load = _NECK_LOAD.search(trial)
    mass = {"mass": np.full(len(log), 1e-3 * float(load[1]))} if load else {}
    return replace(log, columns={**log.columns, **mass}, words={"trial": np.full(len(log), trial)})


def _opencr(file: Path) -> OpenLog:
    """Nine tendons' displacements in the order of their columns, and the tip by motion capture; z is along the rod."""
    servos = [head for head in _heads(file) if re.fullmatch(r"servo_\d+_mm", head)]
    if len(servos) != 9:
        raise UserError(f"{len(servos)} columns servo_<id>_mm", str(file), "nine, as in OpenCR's data/sysid")
    names = ["time=timestamp [s]", "trial=pattern_label", "tip_x=tip_z [mm]", "tip_y=tip_x [mm]", "tip_z=tip_y [mm]"]
    names += [f"spool_{k}={servo} [mm]" for k, servo in enumerate(servos, 1)]
    return read_table(file, ", ".join(names), "recording of OpenCR")


def _silicone_arm(file: Path) -> OpenLog:
    """Steps of three motors and the tip of the hanging arm: text without a header, or MATLAB's ud and yd.

    The arm hangs along -z of the authors, which is +x here; their x is +y, their y is -z here.
    """
    if file.suffix == ".mat":
        return _arm_of_matlab(file)
    rows = [line.replace(",", " ").split() for line in text_of(file, "recording of the arm").splitlines()]
    lines = [number for number, row in enumerate(rows, 1) if row]
    return _arm(file, [row for row in rows if row], lines)


def _arm(file: Path, rows: Sequence[Sequence[Any]], lines: Sequence[int]) -> OpenLog:
    if not rows:
        raise UserError("no sample of the arm", str(file), "six numbers a line: steps 1 to 3, then x, y, z [mm]")
    values = np.empty((len(rows), 6))
    for row, line, into in zip(rows, lines, values, strict=True):
        try:
            into[:] = [float(cell) for cell in row]
        except ValueError:
            problem = f"{' '.join(map(str, row))[:60]!r} is no sample of the arm"
            raise UserError(problem, f"{file}:{line}", "six numbers: steps 1 to 3, then x, y, z [mm]") from None
    columns: dict[str, Array] = {"time": ARM_PERIOD * np.arange(len(values), dtype=np.float64)}
    columns |= {f"spool_{k + 1}": ARM_STEP * values[:, k] for k in range(3)}
    x, y, z = 1e-3 * values[:, 3:].T
    columns |= {"tip_x": -z, "tip_y": x, "tip_z": -y}
    return OpenLog(file, "recording of the arm", columns, {}, {}, list(lines))


def _arm_of_matlab(file: Path) -> OpenLog:
    """Steps ud and tips yd, 3 x T, or tips of the closed loops, yex21 and yex22."""
    content = variables_of(file, "file of MATLAB")
    if "ud" in content and "yd" in content:
        rows = np.concatenate([content["ud"], content["yd"]]).T
        return _arm(file, rows.tolist(), range(1, 1 + len(rows)))
    loops = {name: content[name] for name in ("yex21", "yex22") if name in content}
    if not loops:
        raise UserError("neither ud with yd nor yex21 or yex22", str(file), "a file of DeePC-for-Soft-Robot-Control")
    x, y, z = 1e-3 * np.concatenate(list(loops.values()), axis=1)
    time = np.concatenate([ARM_PERIOD * np.arange(loop.shape[1]) for loop in loops.values()])
    trial = np.repeat(list(loops), [loop.shape[1] for loop in loops.values()])
    return OpenLog(file, "recording of the arm", {"time": time, "tip_x": -z, "tip_y": x, "tip_z": -y}, {"trial": trial})


def _tee_probe(file: Path) -> OpenLog:
    """Steps of one plane's motor and the bend in that plane, by the tip's orientation in the base; a sheet is a trial.

    An antagonist pair: what one tendon reels in the other pays out. Bends count from the middle of the range of steps;
    times are not published. Nor is the scale of the spools: they are taken to move 10 mm for a radian of bend.
    """
    parts, words, lines = list[dict[str, Array]](), list[str](), list[int]()
    for sheet, (head, *rows) in ((name, rows) for name, rows in read_sheets(file).items() if rows):
        names = _probe_columns([cell.strip().lower() for cell in head])
        if names is None:
            continue
        kept = [(number, row) for number, row in enumerate(rows, 2) if row[names[0]].strip()]
        values = np.stack([numbers_of([row[place] for _, row in kept]) for place in names], axis=1)
        turned = [(part != 0.0).any(axis=1) for part in (values[:, 1:5], values[:, 5:9])]  # zeros: a lost sensor
        whole = np.isfinite(values).all(axis=1) & turned[0] & turned[1]
        values, kept = values[whole], [row for row, there in zip(kept, whole, strict=True) if there]
        if not len(values) or not np.ptp(values[:, 0]):
            continue
        steps = values[:, 0] - 0.5 * (values[:, 0].max() + values[:, 0].min())
        bend = _turned(steps, values[:, 1:5], values[:, 5:9])
        spool = PROBE_RADIUS * float(np.ptp(bend) / np.ptp(steps)) * steps
        parts.append({"spool_1": spool, "spool_2": -spool, "bend_y": bend})
        words += [sheet] * len(values)
        lines += [number for number, _ in kept]
    if not parts:
        problem = "no sheet has a motor position with orientations of tip and base"
        raise UserError(problem, str(file), "a workbook of TEE-Probe_hysteresis_id")
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return OpenLog(file, "recording of the probe", columns, {"trial": np.array(words)}, {}, lines)


def _probe_columns(heads: Sequence[str]) -> list[int] | None:
    """Places of the motor's position and of both quaternions (x, y, z, w), None where one is missing."""
    letters = [re.sub(r"\[.*|[^a-z0-9]", "", head) for head in heads]
    places = list[int]()
    for name in ("motorposition", *(f"{part}orientation{axis}" for part in ("tip", "base") for axis in "xyzw")):
        place = next((k for k, head in enumerate(letters) if head.startswith(name)), None)
        if place is None:
            return None
        places.append(place)
    return places


def _turned(steps: Array, tip: Array, base: Array) -> Array:
    """Angle (T,) [rad] by which the tip has turned in its base about the axis that it turns about most.

    It counts from the mean orientation at the middle of the steps, and grows with them.
    """
    from scipy.spatial.transform import Rotation

    relative = Rotation.from_quat(base).inv() * Rotation.from_quat(tip)
    middle = relative[np.abs(steps) <= np.quantile(np.abs(steps), 0.1)].mean()
    vectors = (middle.inv() * relative).as_rotvec()
    axis = np.linalg.svd(vectors - vectors.mean(axis=0), full_matrices=False)[2][0]
    angle: Array = vectors @ axis
    return angle if float(np.sum(steps * (angle - angle.mean()))) >= 0.0 else -angle


def _spirob(file: Path) -> OpenLog:
    """Measured forces and lengths of two antagonists, and the sum of the joints' angles as the bend."""
    frame = data_frame(file, "recording")
    return spirob_log(file, {str(name): column.to_numpy() for name, column in frame.items()})


def spirob_log(file: Path, table: Mapping[str, Any]) -> OpenLog:
    """The columns of a recording of the SpiRob as an open log.

    Their authors' names are global_timestamp_s, joint_1_deg to joint_13_deg, meas_force_0_N and meas_length_0_mm;
    commands and the markers' own angles and times stand beside them, and are passed over. Lengths count from the first
    one. The bend grows where the first tendon pulls more, and a spool reels in as the bend goes to its tendon's side.
    """

    def like(*patterns: str) -> list[Array]:
        """The columns that the first pattern finds that finds any, without commands."""
        for pattern in patterns:
            names = [name for name in table if re.search(pattern, name.lower()) and not _COMMAND.match(name.lower())]
            if names:
                return [np.asarray(table[name], float) for name in names]
        return []

    time, forces = like("^global_timestamp", "^t$|time"), like("^meas_force", "force|tension")
    lengths, angles = like("^meas_length", "length|position"), like(r"^joint_\d+_deg", "angle|joint|theta|aruco")
    if len(forces) != 2 or len(lengths) != 2 or not angles:
        problem = f"{len(forces)} forces, {len(lengths)} lengths, {len(angles)} angles by the names of the columns"
        raise UserError(problem, str(file), "two forces [N], two lengths [mm] and the joints' angles [deg]")
    columns = {"time": time[0] - np.nanmin(time[0])} if time else {}
    bend = _along(np.radians(np.sum(angles, axis=0)), forces[0] - forces[1])
    shorter = [1e-3 * (length[np.isfinite(length)][:1] - length) for length in lengths]
    side = 1.0 if np.array_equal(_along(shorter[0] - shorter[1], bend), shorter[0] - shorter[1]) else -1.0
    for number, (force, reeled) in enumerate(zip(forces, shorter, strict=True), 1):
        columns |= {f"spool_{number}": side * reeled, f"tension_{number}": force}
    return OpenLog(file, "recording of the SpiRob", columns | {"bend_y": bend})


def _along(values: Array, other: Array) -> Array:
    """Values (T,) with the sign with which they grow with others (T,); as they are where these do not tell it."""
    there = np.isfinite(values) & np.isfinite(other)
    together = float(np.sum((values[there] - values[there].mean()) * (other[there] - other[there].mean())))
    return -values if together < 0.0 else values


def _heads(file: Path) -> list[str]:
    return [head.strip() for head in text_of(file).partition("\n")[0].split(",")]


CONVERTERS: dict[str, Converter] = {
    "humasoft": Converter("soft neck of UC3M: CSV of HUMASoft/Data-and-Results", _soft_neck),
    "opencr": Converter("OpenCR: CSV of ContinuumRoboticsLab/opencr-mujoco, data/sysid", _opencr),
    "deepc-arm": Converter("silicone arm: text or .mat of chengoy30/DeePC-for-Soft-Robot-Control", _silicone_arm),
    "tee-probe": Converter("probe: workbooks of bfortuno/TEE-Probe_hysteresis_id", _tee_probe),
    "spirob": Converter("SpiRob: parquet of arben24/spirob-mjlab-sysid, data", _spirob),
}


def read_log(
    file: Path,
    names: str = "",
    what: str = "log",
    others: bool = False,
    more: Mapping[str, Units] | None = None,
    tendon_offset: float = TENDON_OFFSET,
) -> OpenLog:
    """Read an open log: a table, or with the name of a converter as `names` that laboratory's file.

    Parameters and errors are those of `wristctl.records.open_log.read_table`. Raises UserError for a name that is
    nearly that of a format.
    """
    name = names.strip()
    if name in CONVERTERS:
        return replace(CONVERTERS[name].read(file), what=what)
    formats = [*LOG_FORMATS, *CONVERTERS]
    if "=" not in name and name not in formats and (like := nearest(name, formats)):
        raise UserError(f"unknown log format '{name}'", "columns", f"did you mean '{like}'?")
    return read_table(file, names, what, others, more, tendon_offset)
