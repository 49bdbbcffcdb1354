"""Exports of motion capture, read to rigid bodies: Motive's and Vicon's CSV, Qualisys' TSV.

The layouts are those of the makers' documentation: OptiTrack, Data Export: CSV; Vicon Nexus and Tracker, exports of
objects, segments and trajectories; Qualisys Track Manager, TSV exports of 6DOF and 3D data.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.records.log_columns import ANGLE, LENGTH
from wristctl.records.recorded_table import LogFormat, RecordedTable, RigidBody, unit_quaternions
from wristctl.records.table_text import cells_of

_LENGTHS = {"meters": 1.0, "centimeters": 1e-2, "millimeters": 1e-3, **LENGTH}
_VICON = ("Trajectories", "Objects", "Segments", "Bones", "Joints", "Model Outputs", "Devices", "Events")
_QUALISYS = ("NO_OF_FRAMES", "FILE_VERSION")
# Columns of a body in a 6DOF export of Qualisys: x, y, z, three angles, residual, nine of the rotation matrix.
_OF_BODY = 16


class _Grid(NamedTuple):
    """Rows of numbers (T, C), nan where a cell is empty, and their lines."""

    numbers: Array
    lines: list[int]


def motive_table(text: str, file: Path) -> RecordedTable:
    """Rigid bodies of a CSV that Motive exports. Raises UserError where there are none."""
    rows = _rows(text, ",")
    begin = _header(rows, "Frame", file, "an export of Motive")
    about = dict(zip(rows[0][1][::2], rows[0][1][1::2], strict=False))
    scale = _LENGTHS.get(about.get("Length Units", "Meters").strip().lower())
    if scale is None:
        raise UserError(f"lengths in {about.get('Length Units')!r}", f"{file}:1", "Length Units,Millimeters")
    above = [row for _, row in rows[1:begin] if any(row)]
    what = next((row for row in reversed(above) if "Rotation" in row or "Position" in row), [])
    kinds = next((row for row in above if any("body" in cell.replace(" ", "").lower() for cell in row)), [])
    names = above[above.index(kinds) + 1] if kinds and kinds is not above[-1] else []
    grid = _numbers(rows[begin + 1 :], len(rows[begin][1]), file)
    head = rows[begin][1]
    if "Time (Seconds)" in head:
        time = grid.numbers[:, head.index("Time (Seconds)")]
    else:
        time = grid.numbers[:, 0] / _rate(about.get("Export Frame Rate", about.get("Capture Frame Rate", "")), file, 1)
    places = dict[str, dict[str, int]]()
    for place, (kind, name, part, axis) in enumerate(zip(kinds, names, what, head, strict=False)):
        if kind.replace(" ", "").lower() == "rigidbody" and part in ("Rotation", "Position"):
            places.setdefault(name, {})[part[0] + axis] = place
    bodies, euler = dict[str, RigidBody](), list[str]()
    for name, at in places.items():
        position = _part(grid, at, ["PX", "PY", "PZ"])
        turn = _part(grid, at, ["RX", "RY", "RZ", "RW"])
        if turn is None and (angles := _part(grid, at, ["RX", "RY", "RZ"])) is not None:
            order = about.get("Rotation Type", "XYZ").strip() or "XYZ"
            turn = _of_angles(angles, order, file)
            euler.append(name)
        if turn is not None:
            bodies[name] = _body(time, turn, None if position is None else scale * position)
    told = [f"{file.name}: rotations are read as angles [deg] about the body's own axes, in their order."] * bool(euler)
    return _table(time, bodies, grid, rows[begin][0], file, told)


def vicon_table(text: str, file: Path) -> RecordedTable:
    """Rigid bodies of a CSV that Vicon's Nexus or Tracker exports: objects, segments, or three or more markers of each.

    Raises UserError where there are none.
    """
    mark = ";" if text.count(";") > text.count(",") else ","
    rows = _rows(text, mark)
    sections = [k for k, (_, row) in enumerate(rows) if row[0] in _VICON]
    bodies, clock = dict[str, RigidBody](), None
    told, shown = list[str](), None
    for begin, end in zip(sections, [*sections, len(rows)][1:], strict=True):
        section = [row for row in rows[begin:end] if any(row[1])]
        kind = rows[begin][1][0]
        if kind not in ("Objects", "Segments", "Bones", "Trajectories") or len(section) < 5:
            continue
        line, rate = section[1]
        head_at = _header(section, "Frame", file, f"Vicon's {kind}")
        names, head, units = section[head_at - 1][1], section[head_at][1], section[head_at + 1][1]
        grid = _numbers(section[head_at + 2 :], len(head), file)
        if not len(grid.numbers):
            continue
        time = (grid.numbers[:, 0] - grid.numbers[0, 0]) / _rate(rate[0], file, line)
        clock = time if clock is None else clock
        if len(time) != len(clock):
            continue
        shown = shown or (grid, section[head_at][0])
        found, helical = _vicon_bodies(kind, names, head, units, grid, time, file)
        bodies |= {name: body for name, body in found.items() if name not in bodies}
        told += [f"{file.name}: RX, RY, RZ are read as Vicon's rotation vectors (angle-axis)."] * helical
    if shown is None or clock is None:
        raise _none(file)
    return _table(clock, bodies, shown[0], shown[1], file, told[:1])


def _vicon_bodies(
    kind: str, names: Sequence[str], head: Sequence[str], units: Sequence[str], grid: _Grid, time: Array, file: Path
) -> tuple[dict[str, RigidBody], bool]:
    """Bodies of a section, and whether their rotations are rotation vectors."""
    from scipy.spatial.transform import Rotation

    starts = [place for place, name in enumerate(names[: len(head)]) if name.strip() and place > 1]
    parts = dict[str, dict[str, int]]()
    for start, end in zip(starts, [*starts, len(head)][1:], strict=True):
        name = names[start].strip().removeprefix("Global Angle ").removeprefix("Global ")
        parts.setdefault(name, {}).update({head[place].strip(): place for place in range(start, min(end, len(head)))})

    def factor(place: int, known: Mapping[str, float], default: str) -> float:
        unit = units[place].strip() if place < len(units) else ""
        if unit and unit not in known:
            raise UserError(f"{names[place] or head[place]} is in {unit!r}", str(file), " or ".join(known))
        return known[unit or default]

    if kind == "Trajectories":
        markers = dict[str, Array]()
        for name, at in parts.items():
            position = _part(grid, at, ["X", "Y", "Z"])
            if position is not None:
                markers[name] = factor(at["X"], LENGTH, "mm") * position
        return bodies_of_markers(markers, time), False
    bodies, helical = dict[str, RigidBody](), False
    for name, at in parts.items():
        turn = _part(grid, at, ["RX", "RY", "RZ", "RW"])
        vector = _part(grid, at, ["RX", "RY", "RZ"])
        if turn is None and vector is not None:
            scaled = factor(at["RX"], ANGLE, "rad") * vector
            turn, there = np.full((len(time), 4), np.nan), np.isfinite(vector).all(axis=1)
            turn[there] = Rotation.from_rotvec(scaled[there]).as_quat()
            helical = True
        position = _part(grid, at, ["TX", "TY", "TZ"])
        if turn is not None:
            subject, _, segment = name.partition(":")
            short = segment if segment and segment != subject else subject
            place = None if position is None else factor(at["TX"], LENGTH, "mm") * position
            bodies[name if short in bodies else short] = _body(time, turn, place)
    return bodies, helical


def qualisys_table(text: str, file: Path) -> RecordedTable:
    """Rigid bodies of a TSV that Qualisys Track Manager exports: of 6DOF data, or three or more markers of each.

    Raises UserError where there are none.
    """
    from scipy.spatial.transform import Rotation

    rows = _rows(text, "\t")
    about = {row[0].strip(): (line, row[1:]) for line, row in rows if row[0].strip() and not _is_number(row[0])}
    line, rate = about.get("FREQUENCY", (1, [""]))
    names = [name.strip() for name in about.get("BODY_NAMES", (0, []))[1] if name.strip()]
    markers = [name.strip() for name in about.get("MARKER_NAMES", (0, []))[1] if name.strip()]
    numbers_from = next((k for k, (_, row) in enumerate(rows) if _is_number(row[0]) and len(row) > 2), len(rows))
    grid = _numbers(rows[numbers_from:], max((len(row) for _, row in rows[numbers_from:]), default=0), file)
    wide = _OF_BODY * len(names) if names else 3 * len(markers)
    whole = grid.numbers[:, ~np.isnan(grid.numbers).all(axis=0)] if wide > grid.numbers.shape[1] else grid.numbers
    lead = next((k for k in (2, 1, 0) if whole.shape[1] >= wide + k), -1) if wide else -1
    heads = [row for _, row in rows[:numbers_from] if row[0].strip() == "Frame"]
    if heads:
        lead = 2 if len(heads[0]) > 1 and heads[0][1].strip() == "Time" else 1
    if lead < 0 or not len(whole):
        raise _none(file)
    time = whole[:, 1] if lead == 2 else np.arange(len(whole)) / _rate(rate[0], file, line)
    values = whole[:, lead : lead + wide]
    bodies = dict[str, RigidBody]()
    if names:
        for k, name in enumerate(names):
            own = values[:, _OF_BODY * k : _OF_BODY * (k + 1)]
            matrix = own[:, 7:].reshape(-1, 3, 3).transpose(0, 2, 1)  # column after column
            there = np.isfinite(own).all(axis=1) & (own[:, 6] >= 0.0) & (np.abs(matrix).sum(axis=(1, 2)) > 0.0)
            turn, place = np.full((len(own), 4), np.nan), np.full((len(own), 3), np.nan)
            turn[there] = Rotation.from_matrix(matrix[there]).as_quat()
            place[there] = 1e-3 * own[there, :3]
            bodies[name] = _body(time, turn, place)
    else:
        at = {name: 1e-3 * values[:, 3 * k : 3 * k + 3] for k, name in enumerate(markers)}
        lost = {name: np.where((place == 0.0).all(axis=1)[:, None], np.nan, place) for name, place in at.items()}
        bodies = bodies_of_markers(lost, time)
    return _table(time, bodies, grid, rows[numbers_from - 1][0], file, [])


def bodies_of_markers(markers: Mapping[str, Array], time: Array) -> dict[str, RigidBody]:
    """Rigid bodies of three or more markers each, which share what stands before a colon, or before their numbers.

    A body's pose is the turn and shift that takes its markers (T, 3) [m], where they were first all seen, to their
    places (least squares: Kabsch, Acta Crystallographica A32, 1976).
    """
    groups = dict[str, list[str]]()
    for name in markers:
        subject, colon, _ = name.partition(":")
        groups.setdefault(subject if colon else re.sub(r"[\W_]*(?:\d+|[A-Z])$", "", name), []).append(name)
    bodies = dict[str, RigidBody]()
    for body, parts in groups.items():
        places = np.stack([markers[name] for name in parts], axis=1)
        seen = np.asarray(np.isfinite(places).all(axis=2))
        if len(parts) < 3 or not seen.all(axis=1).any():
            continue
        first = int(np.argmax(seen.all(axis=1)))
        turn, place = _fitted(places[first], places, seen)
        bodies[body] = RigidBody(time, turn, place, np.arange(len(time)), first)
    return bodies


def _fitted(model: Array, places: Array, seen: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Orientations (T, 4) and places of the middle (T, 3) of markers (M, 3) that are at places (T, M, 3)."""
    from scipy.spatial.transform import Rotation

    there = seen.sum(axis=1) >= 3
    weight = seen[there].astype(np.float64)
    weight /= weight.sum(axis=1, keepdims=True)
    at = np.where(seen[there][..., None], places[there], 0.0)
    middle, center = np.einsum("tm,tmk->tk", weight, at), weight @ model
    moved, still = at - middle[:, None], model[None] - center[:, None]
    left, _, right = np.linalg.svd(np.einsum("tm,tmi,tmj->tij", weight, moved, still))
    flip = np.sign(np.linalg.det(left) * np.linalg.det(right))
    left[:, :, 2] *= flip[:, None]
    matrix = left @ right
    turn, place = np.full((len(places), 4), np.nan), np.full((len(places), 3), np.nan)
    turn[there] = Rotation.from_matrix(matrix).as_quat()
    place[there] = middle + np.einsum("tij,tj->ti", matrix, model.mean(axis=0) - center)
    return turn, place


def _rows(text: str, mark: str) -> list[tuple[int, list[str]]]:
    """Rows of cells with their lines, without empty ones."""
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip()]
    cells = cells_of([line for _, line in lines], mark)
    return [(number, row) for (number, _), row in zip(lines, cells, strict=True)]


def _header(rows: Sequence[tuple[int, Sequence[str]]], first: str, file: Path, what: str) -> int:
    place = next((k for k, (_, row) in enumerate(rows) if row[0].strip() == first), 0)
    if place < 1 or place + 1 >= len(rows):
        raise UserError(f"no row {first}, ... with samples below it", str(file), f"{what} as it was written")
    return place


def _numbers(rows: Sequence[tuple[int, Sequence[str]]], width: int, file: Path) -> _Grid:
    numbers, lines = np.full((len(rows), width), np.nan), [line for line, _ in rows]
    for into, (line, row) in zip(numbers, rows, strict=True):
        if any(cell.strip() for cell in row[width:]):
            problem = f"{len(row)} cells under {width} columns"
            raise UserError(problem, f"{file}:{line}", "the export as it was written")
        for place, cell in enumerate(row[:width]):
            if cell.strip():
                if not _is_number(cell):
                    raise UserError(f"{cell.strip()!r} among the samples", f"{file}:{line}", "a number")
                into[place] = float(cell)
    return _Grid(numbers, lines)


def _is_number(cell: str) -> bool:
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False


def _rate(text: str, file: Path, line: int) -> float:
    if not _is_number(text) or float(text) <= 0.0:
        raise UserError(f"a frame rate of {text!r}", f"{file}:{line}", "frames in a second, as 100")
    return float(text)


def _part(grid: _Grid, at: Mapping[str, int], names: Sequence[str]) -> Array | None:
    return grid.numbers[:, [at[name] for name in names]] if all(name in at for name in names) else None


def _of_angles(angles: Array, order: str, file: Path) -> Array:
    from scipy.spatial.transform import Rotation

    if sorted(order) != ["X", "Y", "Z"]:
        raise UserError(f"rotations of type {order!r}", str(file), "Rotation Type,Quaternion or XYZ")
    turn, there = np.full((len(angles), 4), np.nan), np.isfinite(angles).all(axis=1)
    in_order = angles[there][:, ["XYZ".index(axis) for axis in order]]
    turn[there] = Rotation.from_euler(order, in_order, degrees=True).as_quat()
    return turn


def _body(time: Array, turn: Array, place: Array | None) -> RigidBody:
    return RigidBody(time, unit_quaternions(turn), place, np.arange(len(time)))


def _table(
    time: Array, bodies: Mapping[str, RigidBody], grid: _Grid, header: int, file: Path, told: Sequence[str]
) -> RecordedTable:
    if not bodies:
        raise _none(file)
    return RecordedTable(["time [s]"], [time], grid.lines, header, list(told), bodies)


def _none(file: Path) -> UserError:
    fix = "export rigid bodies with their rotations, or three or more markers of each, named Body:1, Body:2, ..."
    return UserError("no rigid body in this export", str(file), fix)


def _first_cell(words: Collection[str]) -> Callable[[str], bool]:
    """Whether a first line begins with a cell that is one of these words."""
    return lambda line: re.split(r"[,;\t]", line, maxsplit=1)[0].strip().strip('"') in words


MOTIVE = LogFormat("rigid bodies of Motive: CSV", _first_cell(["Format Version"]), motive_table)
VICON = LogFormat("objects, segments or markers of Vicon's Nexus and Tracker: CSV", _first_cell(_VICON), vicon_table)
QUALISYS = LogFormat("6DOF bodies or markers of Qualisys Track Manager: TSV", _first_cell(_QUALISYS), qualisys_table)
