"""What the motors hear under a fault of wires, drives and supply, and when tendons give way."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from wristctl.bench.faults import Faults, MotorFaults
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.config.bench import InjectedFault

A, C = ord("A"), ord("C")
STEP, DIR = 0b01, 0b10


def at(seconds: float) -> int:
    return round(seconds * FREQUENCY)


def heard(
    edges: list[tuple[float, int, int]], *faults: dict[str, Any], until: float = 1.0, order: Any = (0, 1, 2, 3)
) -> Any:
    """Edges (time, port, value) as the motors hear them."""
    known = MotorFaults(Faults([InjectedFault(since="power-on", **fault) for fault in faults]), order)
    told = np.array([(at(time), port, value) for time, port, value in edges], np.int64).reshape(-1, 3)
    return [(each[0] / FREQUENCY, each[1], each[2]) for each in known.hear(told, at(1.0)).tolist()]


def test_without_a_fault_the_motors_hear_what_the_board_says() -> None:
    edges = [(0.1, A, 0b1101), (0.2, C, 0b1010)]
    assert heard(edges) == edges and heard([]) == []


@pytest.mark.parametrize(
    ("kind", "value", "found"),
    [("direction-flipped", 0b11 << 2, 0b01 << 2), ("direction-flipped", 0b01 << 2, 0b11 << 2),
     ("direction-stuck", 0b11 << 2, 0b01 << 2), ("direction-stuck", 0b01 << 2, 0b01 << 2),
     ("motor-stalled", 0b11 << 2, 0b10 << 2)],
)  # fmt: skip
def test_a_broken_wire_changes_bits_of_its_axis_alone_for_as_long(kind: str, value: int, found: int) -> None:
    others = 0b01 | 0b11 << 6
    fault = {"kind": kind, "at": 0.3, "duration": 0.4, "axis": 1}
    edges = [(0.2, A, others | value), (0.3, A, others | value), (0.7, A, others | value)]
    assert [each[2] for each in heard(edges, fault)] == [others | value, others | found, others | value]


def test_a_supply_that_goes_and_comes_switches_the_drives_off_and_on() -> None:
    blip = {"kind": "supply-off", "at": 0.3, "duration": 0.4}
    found = heard([(0.1, C, 0b0000), (0.5, A, 0b01010101), (0.6, C, 0b0010)], blip)
    assert found == [
        (0.1, C, 0b0000), (0.3, C, 0b1111), (0.5, A, 0), (0.6, C, 0b1111), (0.7, C, 0b0010),
    ]  # fmt: skip


def test_one_drive_without_power_leaves_the_others_on() -> None:
    found = heard([(0.1, C, 0b0001), (0.5, A, 0b01010101)], {"kind": "drive-off", "at": 0.3, "axis": 2})
    assert found == [(0.1, C, 0b0001), (0.3, C, 0b0101), (0.5, A, 0b01000101)]


def test_exchanged_cables_carry_step_direction_and_enable() -> None:
    edges = [(0.1, A, DIR | STEP << 2), (0.2, C, 0b0001)]
    assert heard(edges, order=(1, 0, 2, 3)) == [(0.1, A, STEP | DIR << 2), (0.2, C, 0b0010)]
    assert heard([(0.1, A, STEP << 6)], order=(3, 0, 1, 2)) == [(0.1, A, STEP)], "motor 0 hangs on axis 3"


def test_tendons_give_way_once_each_time_their_moment_comes() -> None:
    slips = InjectedFault(kind="tendon-slipped", at=0.5, axis=3, size=-2.0)
    faults = Faults([slips, InjectedFault(kind="tendon-detached", at=0.7, axis=1, since="power-on")])
    motors = MotorFaults(faults, (0, 1, 2, 3))
    assert motors.next(0.0) == 0.7 and motors.give_way(0.6) == []
    assert motors.give_way(0.8) == [(1, 1.0)] and motors.give_way(0.9) == []
    faults.begin(1.0)
    assert motors.next(0.9) == 1.5 and motors.give_way(1.5) == [(3, -2e-3)] and motors.give_way(2.0) == []
    faults.begin(3.0)
    assert motors.give_way(3.6) == [(3, -2e-3)], "in every trial"


def test_a_tendon_that_creeps_does_so_for_as_long_as_it_is_told_beside_others_that_give_way() -> None:
    creeps = InjectedFault(kind="tendon-creeps", at=0.5, duration=0.2, axis=1, size=-1.5, since="power-on")
    detaches = InjectedFault(kind="tendon-detached", at=0.602, axis=3, since="power-on")
    motors = MotorFaults(Faults([creeps, detaches]), (0, 1, 2, 3))
    assert motors.next(0.0) == 0.5 and motors.creeping(0.49) == motors.creeping(0.71) == []
    assert motors.creeping(0.5) == [(1, -1.5e-3)]
    assert 0.5 < motors.next(0.5) <= 0.51 and motors.next(0.6) == 0.602, "in small pieces"


def test_of_faults_at_once_drives_multiply_weak_supplies_bound_by_the_least_and_loads_add() -> None:
    def fault(kind: Any, size: float, at: float, duration: float | None = None) -> InjectedFault:
        return InjectedFault(kind=kind, size=size, at=at, duration=duration, axis=2, since="power-on")

    known = MotorFaults(
        Faults([
            fault("drive-rescaled", 0.5, 1.0), fault("drive-rescaled", 0.8, 2.0, 1.0),
            fault("torque-lost", 9.0, 1.0), fault("torque-lost", 4.0, 2.0, 1.0),
            fault("payload-taken", 0.3, 1.0), fault("payload-taken", 0.1, 2.0, 1.0),
        ]), (0, 1, 2, 3),
    )  # fmt: skip
    for time, scale, most, load in (
        (0.5, 1.0, np.inf, 0.0),
        (1.5, 0.5, 9.0, 0.3),
        (2.5, 0.4, 4.0, 0.4),
        (3.5, 0.5, 9.0, 0.3),
    ):
        assert known.rescaled(time) == pytest.approx([1.0, 1.0, scale, 1.0])
        assert known.holding(time) == most and known.carried(time) == pytest.approx(load)
