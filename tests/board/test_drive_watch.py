"""The judge of drive timings, on pulse trains with known faults."""

from __future__ import annotations

import numpy as np
import pytest

from tests.board.drive_watch import MICROSECOND, DriveWatch

STEP, DIR = 4, 8  # axis 1 on port A
DTYPE = np.dtype([("cycle", "<u8"), ("port", "u1"), ("value", "u1")])


def watch(*changes: tuple[float, str, int], cut: int = 0) -> DriveWatch:
    """Show axis 1's drive these changes (us, port, value), in two looks cut at `cut`."""
    drive = DriveWatch(axis=1)
    events = np.array([(round(us * MICROSECOND), ord(port), value) for us, port, value in changes], DTYPE)
    drive.read(events[:cut])
    drive.read(events[cut:])
    return drive


ON = (0.0, "C", 0b1101)
GOOD = [
    ON,
    (10, "A", STEP),
    (13, "A", 0),
    (16, "A", STEP),
    (19, "A", 0),
    (22, "A", DIR),
    (30, "A", DIR | STEP),
    (34, "A", DIR),
]


@pytest.mark.parametrize("cut", range(len(GOOD)))
def test_steps_are_counted_with_their_direction_and_a_good_train_passes(cut: int) -> None:
    drive = watch(*GOOD, cut=cut)
    assert (drive.position, drive.steps, drive.steps_while_off) == (1, 3, 0)
    assert drive.violations() == {}
    assert drive.least == {"high": 3, "low": 3, "dir_setup": 8, "dir_hold": 6, "ena_setup": 10}


@pytest.mark.parametrize(
    ("changes", "violated"),
    [
        ([ON, (10, "A", STEP), (12, "A", 0)], {"high": 2}),
        ([ON, (10, "A", STEP), (13, "A", 0), (15, "A", STEP), (18, "A", 0)], {"low": 2}),
        ([ON, (10, "A", DIR), (14, "A", DIR | STEP), (18, "A", DIR)], {"dir_setup": 4}),
        ([ON, (10, "A", STEP), (13, "A", 0), (14, "A", DIR)], {"dir_hold": 4}),
        ([ON, (3, "A", STEP), (6, "A", 0)], {"ena_setup": 3}),
    ],
)
def test_each_timing_shorter_than_the_drive_allows_is_found(
    changes: list[tuple[float, str, int]], violated: dict[str, float]
) -> None:
    for cut in range(len(changes)):
        assert watch(*changes, cut=cut).violations() == violated


def test_a_step_with_the_drive_off_is_found() -> None:
    assert watch((0, "C", 0b1111), (9, "A", STEP), (12, "A", 0)).steps_while_off == 1
    assert watch(*GOOD, (40, "C", 0b1111), (50, "A", DIR | STEP), (53, "A", DIR)).steps_while_off == 1


def test_pins_of_other_axes_are_none_of_its_business() -> None:
    drive = watch(ON, (1, "A", 1), (1.5, "A", 0b10), (2, "A", 0b10010000))
    assert (drive.steps, drive.position) == (0, 0)
    assert drive.violations() == {}
