"""One control tick in two planes, in simulation and on hardware: a law once for each plane, and one allocation."""

from typing import Any, NamedTuple

from wristctl.control.response import Estimate, perceive_within, wanted_torque
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import clip
from wristctl.lanes.lane import planar, where, zero_like
from wristctl.lanes.rows import rows_of
from wristctl.simulation.spatial_observer import coupling
from wristctl.wrist.allocation import allocate
from wristctl.wrist.spatial.spatial_tendons import arms_about_bend

# Torque that counts as withheld, as a share of what a plane reaches: less is rounding.
_ROUNDING = 1e-9


class Laws(NamedTuple):
    """A law in both planes (Controlled), with the least and the greatest pull at each place of tendons [N]."""

    ulnar: Any
    flexion: Any
    least: Any
    greatest: Any


class Seen(NamedTuple):
    """What both laws see: rows of bend, rate and load of each plane, and the torque withheld in each (2 rows each).

    `withheld` is what motors are too slow for, `missed` what the tendons could not give beside the other plane's.
    """

    rows: Any
    withheld: Any
    missed: Any


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
    """Write the pulls (T rows) [N] of a tick; torques that the laws want and the tendons give [N m], share reached.

    `known` is Knowledge. The references are what they were `since` seconds ago, continued by their own derivatives. A
    law is told what its plane alone reaches; what it misses within that since the other plane wants its part, it is
    told at the next tick, by `seen.missed`.
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
    withheld, missed = seen.withheld, seen.missed
    perceive_within(ulnar, seen_y, withheld[0] + missed[0], (low_y, high_y), since, period)
    perceive_within(flexion, seen_z, withheld[1] + missed[1], (low_z, high_z), since, period)
    wanted_y, wanted_z = wanted_torque(ulnar) + extra[0], wanted_torque(flexion) + extra[1]
    share = allocate(room.arms, planar(wanted_y, wanted_z), least, greatest, pulls)
    torque_y, torque_z = zero_like(wanted_y), zero_like(wanted_z)
    for t in range(len(pulls)):
        torque_y = torque_y + pulls[t] * room.arms_y[t]
        torque_z = torque_z + pulls[t] * room.arms_z[t]
    missed[0] = _missed(wanted_y, torque_y, low_y + extra[0], high_y + extra[0])
    missed[1] = _missed(wanted_z, torque_z, low_z + extra[1], high_z + extra[1])
    return (wanted_y, wanted_z), (torque_y, torque_z), share


@compiled
def _missed(wanted: Any, torque: Any, low: Any, high: Any) -> Any:
    """What a plane misses of a torque [N m] that it could have alone, between `low` and `high`."""
    missed = clip(wanted, low, high) - torque
    return where(abs(missed) > _ROUNDING * (high - low), missed, 0.0)
