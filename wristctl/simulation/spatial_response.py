"""One control tick in two planes, in simulation and on hardware: a law once for each plane, and one allocation."""

from typing import Any, NamedTuple

from wristctl.control.response import Estimate, perceive_within, wanted_torque
from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import planar, where
from wristctl.lanes.rows import rows_of
from wristctl.simulation.spatial_observer import coupling
from wristctl.wrist.allocation import allocate
from wristctl.wrist.spatial.spatial_tendons import arms_about_bend


class Laws(NamedTuple):
    """A law in both planes (Controlled), with the least and the greatest pull at each place of tendons [N]."""

    ulnar: Any
    flexion: Any
    least: Any
    greatest: Any


class Seen(NamedTuple):
    """What both laws see: rows of bend, rate and load of each plane, and the torque that motors withhold in each."""

    rows: Any
    withheld_y: Any
    withheld_z: Any


class Room(NamedTuple):
    """Rows to work on: two each, and for each place of tendons its moment arms [m], and these as a planar vector.

    Behind a tick `bend` is what the laws have seen, and the moment arms are those there.
    """

    bend: Any
    speed: Any
    wish: Any
    extra: Any
    arms_y: Any
    arms_z: Any
    arms: Any


@compiled
def respond_in_planes(laws: Any, known: Any, seen: Any, room: Any, since: float, period: float, pulls: Any) -> Any:
    """Write the pulls (T rows) [N] of a tick; the torques that the laws want [N m], and the share that is reached.

    `known` is Knowledge. The references are what they were `since` seconds ago, continued by their own derivatives.
    """
    ulnar, flexion, least, greatest = laws
    target_y, target_z = rows_of(ulnar.reference), rows_of(flexion.reference)
    rows, bend, speed, wish, extra = seen.rows, room.bend, room.speed, room.wish, room.extra
    wish[0], wish[1] = target_y[2], target_z[2]
    bend[0], bend[1], speed[0], speed[1] = rows[0], rows[3], rows[1], rows[4]
    coupling(known.coupling, known, bend, speed, wish, extra)
    low_y, high_y, low_z, high_z = -extra[0], -extra[0], -extra[1], -extra[1]
    arms_about_bend(known.wrist, bend, room.arms_y, room.arms_z)
    for t in range(len(pulls)):
        arm_y, arm_z, forth, back = room.arms_y[t], room.arms_z[t], least[t], greatest[t]
        room.arms[t] = planar(arm_y, arm_z)
        low_y = low_y + arm_y * where(arm_y > 0.0, forth, back)
        high_y = high_y + arm_y * where(arm_y > 0.0, back, forth)
        low_z = low_z + arm_z * where(arm_z > 0.0, forth, back)
        high_z = high_z + arm_z * where(arm_z > 0.0, back, forth)
    seen_y, seen_z = Estimate(rows[0], rows[1], rows[2]), Estimate(rows[3], rows[4], rows[5])
    perceive_within(ulnar, seen_y, seen.withheld_y, (low_y, high_y), since, period)
    perceive_within(flexion, seen_z, seen.withheld_z, (low_z, high_z), since, period)
    wanted_y, wanted_z = wanted_torque(ulnar) + extra[0], wanted_torque(flexion) + extra[1]
    share = allocate(room.arms, planar(wanted_y, wanted_z), least, greatest, pulls)
    return wanted_y, wanted_z, share
