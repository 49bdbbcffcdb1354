"""The log of trials: tables that are written as they come, and lose nothing when the disk is full."""

import errno
import math
import os
import time
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wristctl.records.run_writer import RESERVE
from wristctl.trial.camera_record import Frame
from wristctl.trial.residuals import columns
from wristctl.trial.rig_belief import PLANES
from wristctl.vision.marker import Sighting
from wristctl.wrist.directions import ACTIVE

# Name -> unit and meaning.
Columns = Mapping[str, tuple[str, str]]


def _by_tendon(tendons: Sequence[int], name: str, unit: str, meaning: str) -> dict[str, tuple[str, str]]:
    return {f"{name}_{tendon}": (unit, f"{meaning}, tendon {tendon}") for tendon in tendons}


_CLOCKS: Columns = {
    "trial": ("", "number, from 0"),
    "time": ("s", "since the trial's motion began"),
    "clock": ("s", "the run's one clock"),
    "utc": ("s", "the same moment since 1970-01-01T00:00Z; empty in virtual time"),
}
_OF_A_PLANE: Columns = {
    "bend": ("rad", "bending angle as estimated"),
    "rate": ("rad/s", "its rate as estimated"),
    "load": ("N m", "load torque as estimated: what the model does not explain"),
    "bend_measured": ("rad", "newest usable bend by the plane's camera; empty where none came in this tick"),
    "captured": ("s", "when that frame was taken, on the trial's time"),
    "verdict": ("", "on the newest frame of the plane's camera; empty where none came"),
    "bend_ref": ("rad", "reference that the controller follows"),
    "rate_ref": ("rad/s", "its rate"),
    "acceleration_ref": ("rad/s^2", "its acceleration"),
    "bend_desired": ("rad", "true wanted angle"),
    "error": ("rad", "bend less its reference (E12)"),
    "torque_wanted": ("N m", "torque that the controller wants"),
    "torque": ("N m", "torque of the commanded tensions on the one-segment model"),
}
OF_LOAD_CELLS: Columns = _by_tendon(ACTIVE, "pull", "N", "by load cell as read last; empty where it gives nothing")
_OF_LOOKS = "by the look of this tick; empty where it gives none"
WIRE: Columns = {
    "clock": ("s", "the run's one clock"),
    "way": ("", "sent to the board, or came from it"),
    "bytes": ("", "as hexadecimal digits"),
}
FRAMES: Columns = {
    "trial": ("", "number, from 0"),
    "number": ("", "of the frame, as the camera counts; gaps are frames that nobody saw"),
    "captured": ("s", "middle of the exposure, on the trial's time"),
    "used": ("s", "when the loop had its angle, on the trial's time"),
    "theta": ("rad", "marker angle less zero; empty where unusable"),
    "verdict": ("", "whether it can be used, and if not why"),
    "tip_x": ("m", "tip from the first disc along the straight wrist, by the same frame; empty where unusable"),
    "tip_y": ("m", "tip across, toward theta > 0"),
    "size": ("", "tip's marker over the base's, by the edges that a bend across does not foreshorten"),
    "predicted": (
        "rad",
        "angle that the spools should have made by then, with tendons as believed; empty where unused",
    ),
    "predicted_soft": ("rad", "the same with tendons of safety.softest"),
    **{
        f"{marker}_{axis}{corner}": ("px", f"corner {corner} of the {marker}'s marker, {meaning}; empty where not seen")
        for marker in ("base", "tip")
        for corner in range(4)
        for axis, meaning in (("x", "rightward"), ("y", "downward"))
    },
}
_RESERVED = 4 << 20
# Rows of truth written in one tick: well above the five that it adds, and nothing that a tick would be late by.
_AT_ONCE = 40


def residual_columns(planes: int, weighed: bool, own: bool = False) -> Columns:
    """Columns of the residuals of a rig in so many planes, with load cells or without, or of one's `own` robot."""
    return {
        "trial": ("", "number, from 0; -1 between trials"),
        "clock": ("s", "the run's one clock"),
        **columns(planes, weighed, own),
    }


# Of what the motors are told and do.
_WHERE = "spool position, 0 where straight and just taut, positive reeled in"
_OF_MOTORS: Columns = {
    "tension": ("N", "commanded"),
    "target": ("steps", f"wanted {_WHERE}"),
    "position": ("steps", "spool position by the board's status"),
    "counted": ("s", "when the board had those positions, as the host reckons, on the trial's time"),
    "board": ("s", "the board's own clock then"),
    "sent": ("1/s", "step rate really sent"),
    "state": ("", "of the board"),
    "faults": ("", "of the board"),
    "late": ("s", "from the tick's due time to its beginning"),
    "woken": ("s", "part of that for which the computer slept on; the rest is what the tick before took too long"),
    "round_trip": ("s", "from the tick's command to the board's answer"),
}
_OF_TENDONS = "tension", "target", "position", "sent"
# Columns that a robot of one's own has not, and those whose meaning is another one there.
_OF_A_BOARD = "board", "state", "faults"
_OF_A_RIG = {
    "bend_measured": "newest bend by look(); empty where it brought none in this tick",
    "captured": "when it was true, on the trial's time",
    "verdict": "on the newest look; empty where there was none",
    "position": "where the spool is reckoned to be by the facts' delay and lag",
    "counted": "when the spools were there, on the trial's time",
    "sent": "rate of the target that was really sent",
    "round_trip": "seconds that send() took",
}
_SEEN_BY_A_RIG: Columns = {
    "trial": ("", "number, from 0"),
    "number": ("", "of the look that was news, as they are counted"),
    "captured": ("s", "when it was true, on the trial's time"),
    "used": ("s", "when the loop had it, on the trial's time"),
    "theta": ("rad", "bend less zero; empty where it is no number"),
    "verdict": ("", "whether it can be used, and if not why"),
    "predicted": ("rad", "bend that targets should have made by then, with tendons as believed; empty where unused"),
    "predicted_soft": ("rad", "the same with tendons of safety.softest"),
}


def _in_words(columns: Columns, own: bool) -> Columns:
    """Columns as of a board, or in the words of a robot of one's `own`."""
    if not own:
        return columns
    kept = {name: column for name, column in columns.items() if name not in _OF_A_BOARD}
    return {name: (unit, _OF_A_RIG.get(name, meaning)) for name, (unit, meaning) in kept.items()}


def tick_columns(planes: int, tendons: Sequence[int] = ACTIVE, own: bool = False) -> Columns:
    """Columns of the control ticks of a rig with so many planes and these tendons.

    Load cells have further ones; a robot of one's `own` has its measured tensions.
    """
    of_planes = _by_plane(planes, _in_words(_OF_A_PLANE, own))
    if planes > 1:  # no network stands behind such a reference, and the planes share the tendons
        of_planes = {name: column for name, column in of_planes.items() if not name.startswith("bend_desired")}
        of_planes["share"] = ("1", "share of the wanted torque that the tendons could give")
    columns = {**_CLOCKS, **of_planes}
    for name, (unit, meaning) in _in_words(_OF_MOTORS, own).items():
        columns |= _by_tendon(tendons, name, unit, meaning) if name in _OF_TENDONS else {name: (unit, meaning)}
    return columns | (_by_tendon(tendons, "pull", "N", f"tension {_OF_LOOKS}") if own else {})


def frame_columns(planes: int, own: bool) -> Columns:
    """Columns of a trial's frames, of one camera or of two; of looks at one's `own` robot, a row for each plane."""
    columns = _SEEN_BY_A_RIG if own else FRAMES
    if planes == 1:
        return columns
    seen = "that the bend is in" if own else "the bending plane that the camera looks at"
    bend = "" if own else "bend in that plane, by the marker's angle and the other bend; empty where unusable"
    named = {"bend" if name == "theta" else name: column for name, column in columns.items()}
    named["bend"] = "rad", bend or columns["theta"][1]
    return {"trial": named.pop("trial"), "plane": ("", f"ulnar or flexion: {seen}"), **named}


def look_columns(planes: int) -> Columns:
    """Columns of a trial's looks at a robot of one's own that saw its tip, from which networks learn."""
    axes = {"x": "along the straight wrist", "y": "toward ulnar", "z": "toward flexion"}
    tips = {
        f"tip_{axis}": ("m", f"place of the tip from the first disc, {way}")
        for axis, way in [*axes.items()][: planes + 1]
    }
    bends = _by_plane(planes, {"bend": ("rad", "bend less zero, by the same look")})
    return {"trial": ("", "number, from 0"), "time": ("s", "when it was true, on the trial's time"), **tips, **bends}


def truth_columns(coordinates: int, planes: int = 1, tendons: Sequence[int] = ACTIVE) -> Columns:
    """Columns of the emulated bench's true values, for a wrist of so many coordinates."""
    of_segments = {f"bend_{k + 1}": ("rad", "true angle of one segment") for k in range(coordinates // planes)}
    return {
        "trial": ("", "number, from 0"),
        "time": ("s", "since the trial's motion began"),
        **_by_plane(planes, {**of_segments, "bend": ("rad", "true bending angle")}),
        **_by_tendon(tendons, "pull", "N", "true tension at the spool"),
    }


def _by_plane(planes: int, columns: Columns) -> dict[str, tuple[str, str]]:
    """The columns of each of so many planes; one alone needs no name."""
    return {
        column_of(name, plane, planes): (unit, meaning if planes == 1 else f"{meaning}, toward {plane}")
        for name, (unit, meaning) in columns.items()
        for plane in PLANES[:planes]
    }


class Disk:
    """Space kept in a folder for what is still to be written when the disk is full: a trial's truth, some rows."""

    def __init__(self, folder: Path) -> None:
        self._reserve = folder / RESERVE
        try:
            self._reserve.write_bytes(bytes(_RESERVED))
        except OSError:
            self.give_up_reserve()
            raise
        self.pretend_full = False
        """A fault to inject: every further write fails until the reserve is given up."""

    def write(self, descriptor: int, data: bytes) -> int:
        """Write some of `data`; how much. Raises OSError."""
        if self.pretend_full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return os.write(descriptor, data)

    def give_up_reserve(self) -> None:
        """Free the space."""
        with suppress(OSError):  # whoever seals the run clears it away; what waits to be written is worth more
            self._reserve.unlink(missing_ok=True)
        self.pretend_full = False


class Stream:
    """A CSV file that grows row by row, so that no row is lost to a process that is killed.

    Rows that the disk does not take are kept and tried again at the end.
    """

    def __init__(self, path: Path, columns: Columns, disk: Disk) -> None:
        self.columns, self._disk = columns, disk
        self._file = path.open("wb", buffering=0)
        self._pending = bytearray(",".join(columns).encode() + b"\n")

    def row(self, values: Iterable[Any]) -> None:
        """Add a row, in the order of the columns. Raises OSError."""
        self.rows([values])

    def rows(self, many: Iterable[Iterable[Any]]) -> None:
        """Add rows, in one piece. Raises OSError."""
        for values in many:
            self.wait(values)
        self.flush()

    def wait(self, values: Iterable[Any]) -> None:
        """Add a row that may be written later."""
        self._pending += ",".join(map(_cell, values)).encode() + b"\n"

    def flush(self) -> None:
        """Hand over to the system what is pending. Raises OSError."""
        while self._pending:
            del self._pending[: self._disk.write(self._file.fileno(), bytes(self._pending))]

    def close(self) -> None:
        """Write the rest. Raises OSError."""
        try:
            self.flush()
        finally:
            self._file.close()


class TrialLog:
    """log.csv and frames.csv of trials; between.csv for the moves between them; residuals.csv of both; wire.csv with
    all bytes of the whole run; truth.csv of an emulated bench. The clock is `monotonic`, or virtual; a rig is `weighed`
    where it has load cells. The true wrist of a bench has so many `coordinates`. `tendons` are the numbers of those
    that motors wind. A robot of one's own is not `wired`: it has no board and no wire.csv; it may measure tensions,
    and tips, which are in looks.csv.
    """

    def __init__(
        self, folder: Path, coordinates: int | None, period: float, monotonic: bool = False, weighed: bool = False,
        planes: int = 1, tendons: Sequence[int] = ACTIVE, wired: bool = True,
    ) -> None:  # fmt: skip
        self.disk, self._monotonic = Disk(folder), monotonic
        self._planes, self._sightings = planes, list[Sighting]()
        ticks = {**tick_columns(planes, tendons, not wired), **(OF_LOAD_CELLS if weighed and wired else {})}
        tables = {"log": ticks, "between": ticks, "frames": frame_columns(planes, not wired)}
        if wired:
            tables["wire"] = WIRE
        else:
            tables["looks"] = look_columns(planes)
        tables["residuals"] = residual_columns(planes, weighed, not wired)
        if coordinates is not None:
            tables["truth"] = truth_columns(coordinates, planes, tendons)
        try:
            self.streams = {name: Stream(folder / f"{name}.csv", table, self.disk) for name, table in tables.items()}
        except OSError:
            self.disk.give_up_reserve()
            raise
        self.last: deque[dict[str, Any]] = deque(maxlen=round(1.0 / period))
        """The last second of ticks."""
        self._truth: deque[tuple[int, NDArray[np.float64]]] = deque()

    def tick(self, row: Mapping[str, Any]) -> None:
        """One control tick; in between.csv where it belongs to no trial. Some of the truth that waits goes with it."""
        self.last.append(dict(row))
        values = {**row, "utc": row["clock"] + time.time() - time.monotonic() if self._monotonic else math.nan}
        stream = self.streams["between" if row["trial"] < 0 else "log"]
        stream.row(values[name] for name in stream.columns)
        self.streams["residuals"].flush()
        if "wire" in self.streams:
            self.streams["wire"].flush()
        self._write_truth(_AT_ONCE)

    def frame(self, trial: int, used: float, begin: float, sighting: Sighting, frame: Frame | None) -> None:
        """One frame of a trial that began at `begin`, there at `used` on its time; `frame` where its angle counts."""
        predicted = (math.nan, math.nan) if frame is None else frame.predicted[:2].tolist()
        seen = sighting.theta, sighting.verdict, sighting.tip_x, sighting.tip_y, sighting.size
        plane = (PLANES[sighting.plane],) if self._planes == 2 else ()
        place = trial, *plane, sighting.number, sighting.time - begin, used
        if "wire" not in self.streams:
            self.streams["frames"].row((*place, *seen[:2], *predicted))
            self._look(trial, sighting, begin)
            return
        self.streams["frames"].row((*place, *seen, *predicted, *sighting.corners.ravel().tolist()))

    def _look(self, trial: int, sighting: Sighting, begin: float) -> None:
        """The sighting of one plane of a look; that of the last makes its row, where all of it was seen."""
        self._sightings = [*self._sightings, sighting] if sighting.plane else [sighting]
        if len(self._sightings) == self._planes:
            across, bends = ([getattr(one, name) for one in self._sightings] for name in ("tip_y", "theta"))
            values = [sighting.tip_x, *across, *bends]
            if np.isfinite(values).all():
                self.streams["looks"].row((trial, sighting.time - begin, *values))

    def residuals(self, trial: int, clock: float, values: Mapping[str, float]) -> None:
        """Residuals of a tick, written with its row: also of the tick that they end, which has none."""
        row = {"trial": trial, "clock": clock, **values}
        stream = self.streams["residuals"]
        stream.wait([row[name] for name in stream.columns])

    def wire(self, clock: float, way: str, data: bytes) -> None:
        """Bytes on the wire, written at the next tick: whoever stops the motors must not hear of a full disk."""
        self.streams["wire"].wait((clock, way, data.hex()))

    def truth(self, trial: int, rows: NDArray[np.float64]) -> None:
        """Queue true values of a trial, by the columns after the first; the ticks to come write them, or the end does.

        Thousands of rows in one piece would take longer than a tick may be late.
        """
        self._truth.extend((trial, row) for row in rows)

    def _write_truth(self, most: int) -> None:
        if self._truth:
            some = [self._truth.popleft() for _ in range(min(most, len(self._truth)))]
            self.streams["truth"].rows([trial, *row.tolist()] for trial, row in some)

    def close(self) -> None:
        """Write what is left, if need be into the space reserved for it. Raises OSError."""
        self.disk.give_up_reserve()
        for name, stream in self.streams.items():
            if name == "truth":  # the last, and the largest
                self._write_truth(len(self._truth))
            stream.close()


def of_tendons(tendons: Sequence[int], **values: NDArray[np.float64]) -> dict[str, float]:
    """Columns of values (T,) of the tendons of these numbers."""
    return {
        f"{name}_{tendon}": value
        for name, every in values.items()
        for tendon, value in zip(tendons, every.tolist(), strict=True)
    }


@cache
def column_of(name: str, plane: str, planes: int) -> str:
    """Name of a plane's column of a rig with so many planes: in one plane a bend is called theta."""
    return name.replace("bend", "theta") if planes == 1 else f"{name}_{plane}"


def of_planes(planes: Sequence[str], **values: Sequence[Any]) -> dict[str, Any]:
    """Columns of values (P,) of a rig's planes."""
    return {
        column_of(name, plane, len(planes)): value
        for name, every in values.items()
        for plane, value in zip(planes, every, strict=True)
    }


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return repr(float(value)) if math.isfinite(value) else ""
    return str(value)
