"""Bends from an inertial unit on the tip: by its orientation as quaternions, or by gravity's direction in its axes.

Where the unit sits is not known, so orientations count from the first row, in which the wrist is taken to be straight;
what it is bent there is the zero that a fit finds. `along=z, toward=x` in `--columns` names the unit's axes along the
wrist and toward bend_y.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from wristctl.arrays import Array
from wristctl.errors import Argument, UserError
from wristctl.records.log_columns import QUATERNION, VERTICAL
from wristctl.records.rigid_bodies import BodyNames, axes_of, axes_told, bends_of_turns

# Norm of a quaternion beyond which it is none, and share of the rotation about the wrist's axis that no bend has.
_NORM, _TWIST = 0.1, 0.7
# Steps in which the twist of the first row is found.
_TURNS = 3
# Component of gravity along the straight wrist from which it tells bends in two planes.
_ALONG = 0.5
# Rows at the begin whose mean is the straight wrist's, and spread of an accelerometer's size that is said.
_FIRST, _SHAKEN = 5, 0.05


def bends_of_unit(
    columns: Mapping[str, Array], names: BodyNames, file: Path, header: str, at: Callable[[int], str]
) -> tuple[dict[str, Array], list[str]]:
    """Columns bend_y and bend_z [rad] (T,) by an inertial unit, and what is to be said; none of a log without one.

    Raises UserError, with the text that says it, where the unit stands another way or gravity tells no bend.

    Parameters
    ----------
    columns : of the log, with quaternions or the direction of gravity
    names : the unit's axes along the wrist and toward bend_y
    file, header : the log, and its header's place for errors
    at : file and line of a row
    """
    parts = [part for part in (QUATERNION, VERTICAL) if set(part) <= columns.keys()]
    if not parts:
        return {}, []
    values = np.stack([columns[name] for name in parts[0]], axis=1)
    axes, there = axes_of(names, file), np.isfinite(values).all(axis=1) & (np.abs(values).sum(axis=1) > 0.0)
    if not there.any():
        return {}, []
    of_quaternions = parts[0] is QUATERNION
    bends = np.full((len(values), 2), np.nan)
    bends[there] = (_by_quaternions if of_quaternions else _by_gravity)(values[there], axes, header or str(file))
    along, toward = axes_told(axes)
    how = "orientation" if of_quaternions else "direction of gravity"
    first = Path(at(int(np.flatnonzero(there)[0]))).name
    remarks = [
        f"{file.name}: the bend is by the inertial unit's {how}, counted from {first}, the straight wrist along its "
        f"{along}, bend_y toward its {toward} (--columns 'along={along}, toward={toward}' says it otherwise)."
    ]
    size = np.linalg.norm(values[there], axis=1)
    if not of_quaternions and float(np.std(size)) > _SHAKEN * float(np.mean(size)):
        remarks.append(
            f"{file.name}: gravity's size varies by {100.0 * float(np.std(size) / np.mean(size)):.2g} %: quick "
            "motions shake an accelerometer, and its bend is wrong then; the unit's own filter is better."
        )
    return {"bend_y": bends[:, 0], "bend_z": bends[:, 1]}, remarks


def _by_quaternions(turns: Array, axes: Array, where: str) -> Array:
    from scipy.spatial.transform import Rotation

    size = np.linalg.norm(turns, axis=1)
    if (wrong := np.flatnonzero(np.abs(size - 1.0) > _NORM)).size:
        problem = f"the quaternion's norm is {size[wrong[0]]:.3g}"
        raise UserError(problem, where, "quat_w, quat_x, quat_y, quat_z of one orientation")
    orientations = Rotation.from_quat(turns)
    relative = orientations[0].inv() * orientations
    turned = np.sqrt(np.mean(relative.as_rotvec() ** 2, axis=0))
    along = int(np.argmax(np.abs(axes[0])))
    if turned[along] > _TWIST * float(np.linalg.norm(turned)):
        letter = "xyz"[int(np.argmin(turned))]
        problem = f"the unit turns about its {'xyz'[along]}, which is to be along the wrist: no bend does so"
        raise UserError(problem, where, Argument("columns", f"along={letter}", quoted=True))
    for _ in range(_TURNS):  # bends have no twist: that of the first row is its noise
        relative = Rotation.from_rotvec(-float(np.mean(relative.as_rotvec() @ axes[0])) * axes[0]) * relative
    return bends_of_turns(relative.as_quat(), axes)


def _by_gravity(values: Array, axes: Array, where: str) -> Array:
    """Bends (T, 2) [rad] by the rotation without twist that takes gravity (T, 3) to where it was at first."""
    now = values / np.linalg.norm(values, axis=1)[:, None] @ axes.T
    first = now[:_FIRST].mean(axis=0)
    first /= np.linalg.norm(first)
    if abs(first[0]) < _ALONG:
        problem = "gravity is across the straight wrist: a bend about it does not show"
        fix = "a wrist that stands or hangs, along=x, y or z in --columns if the unit's axes are others, or quaternions"
        raise UserError(problem, where, fix)
    return bends_of_gravity(now, first)


def bends_of_gravity(now: Array, first: Array) -> Array:
    """Bends (T, 2) [rad] by directions of gravity (T, 3), which at the straight wrist is `first` (3,).

    Both are unit vectors on axes along the wrist and toward both bends.
    """
    change = now - first
    across = np.hypot(change[:, 1], change[:, 2])
    share = np.divide(1.0, across, out=np.zeros_like(across), where=across > 1e-12)
    toward = share[:, None] * change[:, 1:]
    axis = np.stack([0.0 * across, -toward[:, 1], toward[:, 0]], axis=1)
    sine = np.sum(axis * np.cross(now, first), axis=1)
    cosine = now @ first - np.sum(axis * now, axis=1) * (axis @ first)
    bends: Array = np.arctan2(sine, cosine)[:, None] * toward
    return bends
