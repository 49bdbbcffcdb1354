"""A motion as a table, the same for simulated loops and for trials on a rig."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from wristctl.config.wrist import WristParameters

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.arrays import Array
    from wristctl.simulation.trajectory import Trajectory

_PLANES = ("ulnar", "flexion")


def course_table(
    time: Array, bend: Array, reference: Array, torque: Array, tension: Mapping[str, Array], tip: Array
) -> pd.DataFrame:
    """One row per instant, SI units: time, bend, reference and torque of each plane, tensions by place, and the tip.

    Of `time` (T,) [s], `bend` and `reference` [rad] and `torque` [N m] (T, P), which in two planes end in _ulnar and
    _flexion, the commanded tension of one tendon of each place (T,) [N], and the centre of the last disc (T, P + 1)
    [m]: along the straight wrist, then across.
    """
    import pandas as pd

    columns: dict[str, Array] = {"time": time}
    for name, values in (("bend", bend), ("reference", reference), ("torque", torque)):
        if values.shape[1] == 1:
            columns[name] = values[:, 0]
        else:
            columns |= {f"{name}_{plane}": column for plane, column in zip(_PLANES, values.T, strict=True)}
    columns |= {f"tension_{place}": column for place, column in tension.items()}
    columns |= {f"tip_{axis}": column for axis, column in zip("xyz", tip.T, strict=False)}
    return pd.DataFrame(columns)


def course_of_trajectory(trajectory: Trajectory) -> pd.DataFrame:
    """The table of a simulated loop. In one plane places are the plus and the minus side, in two they are numbers."""
    rows, planes = len(trajectory.time), trajectory.planes
    places = ["plus", "minus"] if planes == 1 else [str(place) for place in range(1, trajectory.tension.shape[1] + 1)]
    tension = dict(zip(places, trajectory.tension.T, strict=True))
    torque = trajectory.torque.reshape(rows, -1)
    return course_table(trajectory.time, trajectory.bend, trajectory.bend_ref, torque, tension, trajectory.tip)


def course_of_log(log: pd.DataFrame, wrist: WristParameters) -> pd.DataFrame:
    """The table of a rig's ticks, with the number of the `trial` in front; the tip is that of an arc bent as estimated.

    The torque is that of the commanded tensions, and tensions have the tendons' numbers.
    """
    import numpy as np

    from wristctl.wrist.kinematics import arc_tip
    from wristctl.wrist.spatial.spatial_kinematics import spatial_tips

    two = "bend_ulnar" in log

    def of_planes(name: str, alone: str) -> Array:
        names = [f"{name}_{plane}" for plane in _PLANES] if two else [alone]
        values: Array = log[names].to_numpy(np.float64)
        return values

    bend = of_planes("bend", "theta")
    tip = spatial_tips(bend, wrist.length) if two else arc_tip(bend[:, 0], wrist.length)
    places = [name for name in map(str, log.columns) if name.startswith("tension_")]
    tension = {name.removeprefix("tension_"): log[name].to_numpy(np.float64) for name in places}
    reference, torque = of_planes("bend_ref", "theta_ref"), of_planes("torque", "torque")
    course = course_table(log["time"].to_numpy(np.float64), bend, reference, torque, tension, tip)
    course.insert(0, "trial", log["trial"].to_numpy())
    return course
