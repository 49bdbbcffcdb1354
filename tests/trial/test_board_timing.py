"""The flashed firmware moves a spool as the simulation says, by real messages over the emulated wire."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from wristctl.arrays import Array
from wristctl.bench.faults import Faults
from wristctl.bench.virtual_bench import BenchTransport
from wristctl.board.driver import Board
from wristctl.board.emulator.atmega2560 import Atmega2560
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.messages import AXES, Configure, Limits
from wristctl.config.plant import Actuator
from wristctl.simulation.spool_timing import remembered_commands
from wristctl.trial.spools import Spools, spools_of

PERIOD = 10e-3
_PORT_A = ord("A")


def stepped(rates: Array, ramp: float, begun: float) -> Array:
    """Steps (T + 1, 4) that the motors have made at the begin of each tick, by the edges on the board's pins.

    `rates` (T, 4) are sent at the begin of each tick [1/s]; the first begins `begun` seconds after the board is ready.
    """
    wire = BenchTransport(Atmega2560(), Faults(()))
    with Board(wire) as board:
        board.set_up(Configure(0.5, 0, round(ramp)), Limits((-100_000,) * 4, (100_000,) * 4))
        board.enable()
        board.home()
        wire.wait(begun)
        first = wire.now()
        wire.chip.events()
        for tick, now in enumerate(rates.tolist(), 1):
            board.turn(now, 0.1)
            wire.wait(first + tick * PERIOD - wire.now())
        events = wire.chip.events()
    events = events[events["port"] == _PORT_A]
    latch = events["value"].astype(np.int64)
    risen = latch & ~np.append(0, latch[:-1])
    ticks = np.floor((events["cycle"].astype(np.int64) / FREQUENCY - first) / PERIOD).astype(np.int64)
    made = np.zeros((len(rates) + 1, AXES))
    for axis in range(AXES):
        way = (risen >> 2 * axis & 1) * (1 - 2 * (latch >> (2 * axis + 1) & 1))
        made[1:, axis] = np.bincount(ticks, way, len(rates))[: len(rates)]  # the board goes on for a moment
    return made.cumsum(axis=0)


def simulated(rates: Array, counted: Array, spools: Spools) -> Array:
    """Steps (T, 4) at the end of each tick as the simulation has them, from those counted at its begin."""
    ends, sent = np.empty_like(rates), np.zeros((AXES, remembered_commands(spools.timing.delay, PERIOD)))
    for tick, now in enumerate(rates):
        # where it was when a rate took effect in the last tick, so that it is now where it is counted
        place = counted[tick] - spools.reckoned(np.zeros(AXES), np.column_stack([now, sent[:, :-1]]), 0.0, PERIOD)
        sent = np.column_stack([now, sent[:, :-1]])
        ends[tick] = spools.reckoned(place, sent, PERIOD, PERIOD)
    return ends


@settings(deadline=None, max_examples=6)
@given(st.integers(0, 10**6), st.sampled_from([50_000.0, 100_000.0, 200_000.0]))
@example(13168, 50_000.0)  # a step falls on the moment after the last tick
@pytest.mark.slow
def test_a_spool_is_within_two_microsteps_of_where_the_simulation_has_it_at_every_tick(seed: int, ramp: float) -> None:
    """Of rates up to 1,500 steps/s that change by up to 300 from tick to tick.

    A motor that turns round waits for a whole interval before its first step: up to one more is between them then. What
    a rate changes within an interval is up to a twentieth beside the two (2.01 of seed 4970, ramp 50,000).
    """
    rng = np.random.default_rng(seed)
    rates = np.zeros((60, AXES))
    for before, now in itertools.pairwise(rates):
        now[:] = np.clip(before + rng.uniform(-300.0, 300.0, AXES), -1500.0, 1500.0)
    counted = stepped(rates, ramp, rng.uniform(0.0, 0.02))
    spools = spools_of(Actuator(level="tendon", ramp=ramp))
    apart = np.abs(simulated(rates, counted, spools) - counted[1:])
    turned_round = np.append(np.zeros((1, AXES)), rates[:-1], axis=0) * rates <= 0.0
    assert apart[~turned_round].max() < 2.1 and apart.max() < 3.0
    at_once = np.abs(counted[:-1] + PERIOD * rates - counted[1:])
    assert math.sqrt(np.mean(apart**2)) < 0.6 < math.sqrt(np.mean(at_once**2)), "half a step is rounding"


@pytest.mark.slow
def test_a_board_that_has_reached_its_rates_is_a_delay_behind_them() -> None:
    """On the way up by the same change each tick, to a tenth of a tick, whatever the phase of its updates."""
    rates = 200.0 * np.arange(1.0, 21.0)[:, None] * np.array([1.0, -1.0, 1.0, -1.0])
    rates[10:] = rates[10]
    timing = spools_of(Actuator(level="tendon")).timing
    late = []
    for begun in (0.0, 3.3e-3, 6.1e-3, 8.7e-3):
        counted = stepped(rates, 200_000.0, begun)
        late += ((PERIOD * rates.sum(axis=0) - counted[-1]) / rates[-1]).tolist()
    ramped = 0.5 * (200.0 / (timing.ramp * timing.update))  # none: one update takes a change of 200 up
    assert ramped < 0.5 and np.mean(late) == pytest.approx(timing.delay, abs=1e-3)
