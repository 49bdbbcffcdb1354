"""When a board counted its steps, and where spools were in between, against the edges on the emulated board's pins."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
import pytest

from wristctl.arrays import Array
from wristctl.bench.faults import Faults
from wristctl.bench.virtual_bench import BenchTransport
from wristctl.board.driver import Board
from wristctl.board.emulator.atmega2560 import Atmega2560
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.messages import AXES, Configure, Limits
from wristctl.config.plant import Actuator
from wristctl.identification.spool_paths import answered, count_times, spool_paths
from wristctl.wrist.directions import ACTIVE

PERIOD, MOTORS = 10e-3, Actuator(level="tendon")
# Rates of a quick move of 25 deg and back, as feedforward sends them.
SPEEDS = 500.0 * np.concatenate([np.arange(10), np.arange(8, 0, -1), np.zeros(4)])
MOVES = np.concatenate([SPEEDS, -SPEEDS])[:, None] * np.array([1.0, 0.93, -0.97, -0.9])


class Turned(NamedTuple):
    """A log of ticks, and the times [s] and ways (1, -1) of the steps of each axis by the pins, on the log's time."""

    log: pd.DataFrame
    steps: list[tuple[Array, Array]]

    def made(self, axis: int, times: Array) -> Array:
        """Steps that a motor has made by these times."""
        when, ways = self.steps[axis]
        count: Array = np.append(0.0, ways.cumsum())[np.searchsorted(when, times, side="right")]
        return count


def turned(begun: float, moves: Array = MOVES) -> Turned:
    """A board that is sent step rates (T, 4), its host's ticks `begun` seconds after it was ready."""
    wire, rows = BenchTransport(Atmega2560(), Faults(())), []
    with Board(wire) as board:
        board.set_up(Configure(0.5, 0, round(MOTORS.ramp)), Limits((-100_000,) * 4, (100_000,) * 4))
        board.enable()
        board.home()
        wire.wait(begun)
        first = wire.now()
        wire.chip.events()
        for tick, rates in enumerate(moves.tolist()):
            began = wire.now() - first
            sent, status = board.turn(rates, 0.1)
            row = {"time": began, "counted": began + MOTORS.command_delay, "board": status.time}
            row |= {f"position_{name}": count for name, count in zip(ACTIVE, status.position, strict=True)}
            rows.append(row | {f"sent_{name}": rate for name, rate in zip(ACTIVE, sent, strict=True)})
            wire.wait(first + (tick + 1) * PERIOD - wire.now())
        events = wire.chip.events()
    events = events[events["port"] == ord("A")]
    latch, when = events["value"].astype(np.int64), events["cycle"].astype(np.int64) / FREQUENCY - first
    risen, steps = latch & ~np.append(0, latch[:-1]), []
    for axis in range(AXES):
        stepping = (risen >> 2 * axis & 1) == 1
        steps.append((when[stepping], 1.0 - 2.0 * (latch[stepping] >> (2 * axis + 1) & 1)))
    return Turned(pd.DataFrame(rows), steps)


def unknown_shift(board: Turned, times: Array) -> tuple[float, float]:
    """Shift [s] of count times (T, 4) by which most counts are those of the pins, and the share of these."""
    shifts = np.arange(-0.7e-3, 0.7e-3, 5e-6)
    right = [
        np.mean(
            [
                board.made(axis, of_axis + shift) == board.log[f"position_{name}"]
                for axis, (name, of_axis) in enumerate(zip(ACTIVE, times.T, strict=True))
            ]
        )
        for shift in shifts
    ]
    best = np.flatnonzero(np.array(right) == max(right))
    return float(shifts[best].mean()), float(max(right))


@pytest.mark.slow
@pytest.mark.parametrize("begun", [0.0, 0.35e-3, 0.8e-3])
def test_spools_had_been_counted_when_the_log_says_but_for_one_shift_within_a_frame_of_usb(begun: float) -> None:
    """The board's clock tells when; only where in a frame the host's ticks began, nothing tells."""
    board = turned(begun)
    shift, right = unknown_shift(board, count_times(board.log))
    by_the_host = np.repeat(board.log.counted.to_numpy()[:, None], AXES, axis=1)
    assert right > 0.98 and abs(shift) < 0.6e-3
    assert unknown_shift(board, by_the_host)[1] < 0.95


@pytest.mark.slow
def test_between_counts_a_spool_is_where_the_boards_ramp_has_it() -> None:
    """A smooth path is behind late in a tick, when a new rate has been reached long ago. Microsteps, mean of ticks."""
    board = turned(0.35e-3)
    times = count_times(board.log)
    shift, _ = unknown_shift(board, times)
    instants = times[1:-1].mean(axis=1) + 7e-3
    pins = np.stack([board.made(axis, instants + shift) for axis in range(AXES)], axis=1)
    speeding = np.sign(np.diff(MOVES, axis=0))[:-1]
    unsent = board.log.drop(columns=[f"sent_{name}" for name in ACTIVE])
    ramped, smooth = (np.mean(speeding * (spool_paths(log, MOTORS)(instants) - pins)) for log in (board.log, unsent))
    assert abs(ramped) < 0.06
    assert smooth < -0.15


def test_a_clock_that_runs_at_another_rate_and_a_tick_that_was_late_move_no_count() -> None:
    host = 0.01 * np.arange(60)
    late = np.where(np.arange(60) % 17 == 3, 4e-3, 0.0)
    columns = {f"position_{name}": 0 for name in ACTIVE}
    log = pd.DataFrame({"counted": host - late, "board": (4294.9 + 1.003 * host) % (2.0**32 * 1e-6)} | columns)
    times = count_times(log)
    assert np.abs(times.mean(axis=1) - host).max() < 1e-6
    assert np.diff(times, axis=1) == pytest.approx(np.full((60, 3), 2.5e-5))


def test_rates_that_no_answer_followed_turn_spools_all_the_same() -> None:
    """Of the tick whose answer was lost the step rate is in the log, and the next count shows that it was obeyed."""
    board = turned(0.0)
    lost = board.log.copy()
    repeated = ["counted", "board", *(f"position_{name}" for name in ACTIVE)]
    lost.loc[[6, 7], repeated] = lost.loc[[5, 5], repeated].to_numpy()
    assert len(answered(lost)) == len(board.log) - 2
    instants = np.arange(0.02, 0.4, 1e-3)
    apart = spool_paths(lost, MOTORS)(instants) - spool_paths(board.log, MOTORS)(instants)
    assert np.abs(apart).max() < 1.5, "microsteps, of 60 on the way"


@pytest.mark.slow
def test_a_path_is_off_by_a_delay_alone_and_not_by_what_goes_with_the_direction_of_a_move() -> None:
    """Microsteps: half of one, against each move, would be friction that the tendons have not."""
    swings = 2.0 * np.pi * PERIOD * np.arange(300)[:, None] / np.array([0.47, 0.61, 0.83, 1.13])
    board = turned(0.35e-3, 2500.0 * np.sin(swings) * np.sin(0.31 * swings + 1.0))
    shift, _ = unknown_shift(board, count_times(board.log))
    instants = np.arange(board.log.time.iloc[1], board.log.time.iloc[-1], 1e-3)

    def made(*since: float) -> Array:
        """Mean (T, 4) of the steps made at these times since each instant."""
        times = instants + shift + np.array(since)[:, None]
        return np.stack([board.made(axis, times).mean(axis=0) for axis in range(AXES)], axis=1)

    ahead = spool_paths(board.log, MOTORS)(instants) - made(*np.linspace(-4e-4, 4e-4, 5))
    rates = (made(10e-3) - made(-10e-3)) / 20e-3
    turning = rates != 0.0
    columns = np.stack([np.sign(rates[turning]), rates[turning]], axis=1)
    (against, delay), *_ = np.linalg.lstsq(columns, ahead[turning], rcond=None)
    assert abs(against) < 0.04 and abs(delay) < 4e-5
