"""Bends and tips from poses of rigid bodies: which is the tip, which the base, and along which axis the wrist is.

`--columns 'tip=Hand, base=Forearm, along=z, toward=x'` says it; where the bodies' names do, it need not be said.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wristctl.arrays import Array
from wristctl.errors import Argument, UserError, meant
from wristctl.records.recorded_table import RecordedTable, RigidBody

KEYS = ("tip", "base", "along", "toward")
"""Words of `--columns` that are about rigid bodies."""
_OF_BASE = ("base", "forearm", "arm", "unterarm", "sockel", "fix", "fixed", "mount", "ground", "table", "frame",
            "reference", "support", "socle", "avantbras")  # fmt: skip
_OF_TIP = ("tip", "hand", "end", "effector", "flange", "spitze", "main", "pointe", "disc", "palm")
_AXES: Mapping[str, tuple[float, ...]] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
# Share of a distance along one axis from which two bodies are one behind the other on it.
_BEHIND = 0.9


@dataclass(frozen=True)
class BodyNames:
    """Which bodies and axes are meant; empty where nothing is said."""

    tip: str = ""
    base: str = ""
    along: str = ""
    toward: str = ""

    @property
    def said(self) -> bool:
        """Whether anything is."""
        return bool(self.tip or self.base or self.along or self.toward)


def bends_of_bodies(table: RecordedTable, names: BodyNames, file: Path) -> tuple[dict[str, Array], list[str]]:
    """Columns bend_y, bend_z [rad] and, where places are known, tip_x, tip_y, tip_z [m] (T,), nan where it was lost.

    The bend is the direction of the tip's axis in the base's axes, so a turn about that axis is none. The second value
    has the sentences that say which body is which. Raises UserError, with the text that says it, where it is not known.
    """
    tip_name, base_name = _which(table.bodies, names, file)
    tip, base = table.bodies[tip_name], table.bodies.get(base_name)
    axes = axes_of(names, file)
    turn, place = _in_base(tip, base)
    bends = bends_of_turns(turn, axes)
    if base is not None and place is not None and not names.along:
        _check_along(place, bends, axes, tip_name, base_name, file)
    columns = {"bend_y": bends[:, 0], "bend_z": bends[:, 1]}
    if place is not None:
        columns |= dict(zip(("tip_x", "tip_y", "tip_z"), (place @ axes.T).T, strict=True))
    size = len(table.cells[0]) if table.cells else len(tip.time)
    spread = dict[str, Array]()
    for name, column in columns.items():
        spread[name] = np.full(size, np.nan)
        spread[name][tip.rows] = column
    return spread, _told(table, tip_name, base_name, axes, bends, file)


def _which(bodies: Mapping[str, RigidBody], names: BodyNames, file: Path) -> tuple[str, str]:
    """Names of tip and base, the base's empty where bends are in the laboratory's axes."""
    for name in (names.tip, names.base):
        if name and name not in bodies:
            raise UserError(f"no rigid body {name!r}", str(file), meant(name, bodies))
    if names.tip and (names.base or len(bodies) == 1):
        return names.tip, names.base
    if not names.tip and not names.base and len(bodies) == 1:
        return next(iter(bodies)), ""
    bases = [names.base] if names.base else [name for name in bodies if _is(name, _OF_BASE) and name != names.tip]
    tips = [names.tip] if names.tip else [name for name in bodies if _is(name, _OF_TIP) and name not in bases]
    if len(bodies) == 2:
        bases = bases or [name for name in bodies if [name] != tips and len(tips) == 1]
        tips = tips or [name for name in bodies if [name] != bases and len(bases) == 1]
    if len(bases) == 1 and len(tips) == 1:
        return tips[0], bases[0]
    problem = f"{len(bodies)} rigid bodies, {', '.join(list(bodies)[:8])}: which is the wrist's tip, which its base?"
    first, second = [*tips, *(name for name in bodies if name not in tips)][:2]
    raise UserError(problem, str(file), Argument("columns", f"tip={first}, base={second}", quoted=True))


def _is(name: str, words: Sequence[str]) -> bool:
    parts = [part.lower() for part in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)]
    return any(part in words for part in parts) or name.lower().replace("-", "").replace(" ", "") in words


def axes_of(names: BodyNames, file: Path) -> Array:
    """Axes of an open log in those of the base, as rows (3, 3): along the straight wrist, bend_y's and bend_z's."""
    along = _axis(names.along or "x", "along")
    following = {"x": "y", "y": "z", "z": "x"}
    toward = _axis(names.toward or following[(names.along or "x").lstrip("+-")], "toward")
    if abs(float(along @ toward)) > 0.5:
        raise UserError(
            f"along={names.along or 'x'} and toward={names.toward} are one axis", "columns", "two axes of x, y, z"
        )
    return np.stack([along, toward, np.cross(along, toward)])


def _axis(text: str, key: str) -> Array:
    if text.lstrip("+-") not in _AXES or len(text) > 2:
        raise UserError(f"{key}={text} is no axis", "columns", f"{key}=x, y or z, or -x, -y or -z")
    return (-1.0 if text[0] == "-" else 1.0) * np.array(_AXES[text[-1]])


def _in_base(tip: RigidBody, base: RigidBody | None) -> tuple[Array, Array | None]:
    """Orientations (T, 4) and places (T, 3) of the tip in the axes of the base at the tip's times."""
    from scipy.spatial.transform import Rotation

    if base is None:
        return tip.turn, tip.place
    there = np.isfinite(tip.turn).all(axis=1)
    turn, place = _at(base, tip.time)
    there &= np.isfinite(turn).all(axis=1)
    relative = np.full(tip.turn.shape, np.nan)
    held = Rotation.from_quat(turn[there]).inv()
    relative[there] = (held * Rotation.from_quat(tip.turn[there])).as_quat()
    if tip.place is None or place is None:
        return relative, None
    apart = np.full(tip.place.shape, np.nan)
    apart[there] = held.apply(tip.place[there] - place[there])
    return relative, apart


def _at(body: RigidBody, time: Array) -> tuple[Array, Array | None]:
    """Orientations and places of a body at other times: by spherical and by straight lines; nan outside of its own."""
    from scipy.spatial.transform import Rotation, Slerp

    if np.array_equal(body.time, time):
        return body.turn, body.place
    there = np.isfinite(body.turn).all(axis=1)
    clock, first = np.unique(body.time[there], return_index=True)
    turn = np.full((len(time), 4), np.nan)
    if len(clock) > 1:
        within = (time >= clock[0]) & (time <= clock[-1])
        turn[within] = Slerp(clock, Rotation.from_quat(body.turn[there][first]))(time[within]).as_quat()
    if body.place is None or len(clock) < 2:
        return turn, None
    places = body.place[there][first]
    place = np.stack([np.interp(time, clock, column, np.nan, np.nan) for column in places.T], axis=1)
    return turn, place


def bends_of_turns(turn: Array, axes: Array) -> Array:
    """Bends (T, 2) [rad] toward the second and the third axis of the direction that the first one turns to."""
    from scipy.spatial.transform import Rotation

    bends = np.full((len(turn), 2), np.nan)
    there = np.isfinite(turn).all(axis=1)
    direction = Rotation.from_quat(turn[there]).apply(axes[0]) @ axes.T
    across = np.hypot(direction[:, 1], direction[:, 2])
    size = np.arctan2(across, direction[:, 0])
    share = np.divide(size, across, out=np.ones_like(size), where=across > 0.0)
    bends[there] = share[:, None] * direction[:, 1:]
    return bends


def _check_along(place: Array, bends: Array, axes: Array, tip: str, base: str, file: Path) -> None:
    """UserError where the tip stands on another axis of its base than the one the wrist is taken to be along."""
    there = np.isfinite(place).all(axis=1) & np.isfinite(bends).all(axis=1)
    if not there.any():
        return
    straight = place[there][np.argmin(np.hypot(*bends[there].T))]
    distance = float(np.linalg.norm(straight))
    axis = int(np.argmax(np.abs(straight)))
    on_axis = distance > 0.0 and abs(straight[axis]) > _BEHIND * distance
    if on_axis and float(straight @ axes[0]) < _BEHIND * distance:
        letter = ("-" if straight[axis] < 0.0 else "") + "xyz"[axis]
        problem = f"{tip} stands {1e3 * distance:.3g} mm along {letter} of {base}, not along x"
        raise UserError(problem, str(file), Argument("columns", f"tip={tip}, base={base}, along={letter}", quoted=True))


def axes_told(axes: Array) -> tuple[str, str]:
    """Letters of the axes along the straight wrist and toward bend_y, as `--columns` has them."""
    along, toward = ("-" * bool(axis.min() < -0.5) + "xyz"[int(np.argmax(np.abs(axis)))] for axis in axes[:2])
    return along, toward


def _told(table: RecordedTable, tip: str, base: str, axes: Array, bends: Array, file: Path) -> list[str]:
    along, toward = axes_told(axes)
    against = f"rigid body {base}" if base else "the laboratory's axes"
    remarks = [
        f"{file.name}: the bend is that of rigid body {tip} against {against}, the straight wrist along {along}, "
        f"bend_y toward {toward} (--columns 'tip=NAME, base=NAME, along={along}, toward={toward}' says it otherwise)."
    ]
    since = table.bodies[tip].since
    if since is not None:
        where = f"line {table.lines[since]}" if table.lines else f"row {since + 1}"
        remarks.append(
            f"{file.name}: orientations are those of markers and count from {where}, in the laboratory's axes."
        )
    lost = int(np.sum(np.isnan(bends[:, 0])))
    return [*remarks, *[f"{file.name}: in {lost} of {len(bends)} rows a rigid body was lost."] * (lost > 0)]
