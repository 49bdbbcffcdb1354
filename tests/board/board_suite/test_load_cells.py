"""The HX711 of each tendon, read while motors step: a model written from its data sheet, on either emulator."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from tests.board.bench import MS, Bench
from tests.board.drive_watch import CLOCK
from wristctl.board.messages import Command, Pulls, Result, Status, Turn

MICROSECOND = CLOCK // 1_000_000
SILENT = 0.255


class Hx711:
    """One amplifier on the pins of a bench's chip, looked at between instructions.

    Data sheet: DOUT is high until a conversion is done; 24 bits come on rising edges, the highest first; 25, 26 and 27
    pulses ask for a gain of 128, 32 (the other channel) and 64 next; a clock high for 60 us switches it off.
    """

    def __init__(self, bench: Bench, axis: int) -> None:
        self._bench, self._axis = bench, axis
        self._clock, self._pulses, self._bits = False, 0, 0
        self.highs: list[int] = []
        self.gains: list[int] = []
        self._rose = 0
        self._show(True)

    def _show(self, level: bool) -> None:
        self._bench.chip.drive("F", 2 * self._axis, level)

    def convert(self, counts: int) -> None:
        """End a conversion."""
        self.gains += [self._pulses] if self._pulses else []
        self._pulses, self._bits = 0, counts & 0xFFFFFF
        self._show(False)

    def look(self) -> None:
        """See what the clock has done since the last look."""
        level = self._bench.chip.pin("F", 2 * self._axis + 1)
        if level and not self._clock:
            self._pulses, self._rose = self._pulses + 1, self._bench.chip.cycles
            self._show(self._pulses > 24 or bool(self._bits >> (24 - self._pulses) & 1))
        elif self._clock and not level:
            self.highs.append(self._bench.chip.cycles - self._rose)
        self._clock = level

    @property
    def read(self) -> bool:
        return self._pulses >= 25 and not self._clock


def run(bench: Bench, amplifiers: Sequence[Hx711], ms: float) -> None:
    """Run until all have been read, or so long."""
    end = bench.chip.cycles + round(ms * MS)
    while bench.chip.cycles < end and not all(each.read for each in amplifiers):
        bench.run(4)
        for amplifier in amplifiers:
            amplifier.look()


def pulls(bench: Bench) -> Pulls:
    answer: Pulls = bench.do(Command.PULLS)
    return answer


def pulses(bench: Bench) -> np.ndarray:
    """Cycles of the changes of port F's clocks since the last look, (n, 2) with the pins' levels; drives look too."""
    events = bench.chip.events()
    for drive in bench._drives:
        drive.read(events)
    on_f = events[events["port"] == ord("F")]
    clocks = np.stack([on_f["cycle"].astype(np.int64), on_f["value"].astype(np.int64) & 0xAA], axis=1)
    return clocks[np.flatnonzero(np.diff(clocks[:, 1], prepend=0))]


def test_without_amplifiers_nothing_is_clocked_and_all_are_silent(bench: Bench) -> None:
    bench.run_ms(50)
    answer = pulls(bench)
    assert answer.age == (SILENT,) * 4 and answer.counts == (0,) * 4
    assert len(pulses(bench)) == 0


@pytest.mark.parametrize(
    "counts",
    [(0x123456, -0x123456, 0, -2), (2**23 - 1, -(2**23), 0x7F, -0x80), (0x555555, -0x555556, 255, -256)],
)
@pytest.mark.slow
def test_each_amplifier_is_read_with_its_sign_by_25_short_pulses(bench: Bench, counts: Sequence[int]) -> None:
    amplifiers = [Hx711(bench, axis) for axis in range(4)]
    for amplifier, value in zip(amplifiers, counts, strict=True):
        amplifier.convert(value)
    run(bench, amplifiers, 6.0)
    bench.run_ms(2)
    answer = pulls(bench)
    assert answer.counts == tuple(value >> 8 for value in counts)
    assert all(0.0 < age < 0.01 for age in answer.age)
    for amplifier in amplifiers:
        assert len(amplifier.highs) == 25  # a gain of 128
        assert min(amplifier.highs) >= 0.2 * MICROSECOND and max(amplifier.highs) < 2 * MICROSECOND


def test_a_pin_that_is_held_low_is_no_amplifier_and_costs_one_reading_in_four_milliseconds(bench: Bench) -> None:
    bench.chip.drive("F", 4, False)
    pulses(bench)
    bench.run_ms(40)
    rises = pulses(bench)
    assert (rises[:, 1] & ~0x20).max(initial=0) == 0 and len(rises) == 2 * 25 * 10
    assert pulls(bench).age == (SILENT,) * 4


def test_a_spike_on_an_open_pin_is_no_amplifier(bench: Bench) -> None:
    """All bits high is what a pull-up reads; a cell that shows just this is read at its next conversion."""
    for _ in range(3):
        bench.chip.drive("F", 6, False)
        while not bench.chip.pin("F", 7):
            bench.run(4)
        bench.chip.drive("F", 6, True)
        bench.run_ms(5)
        assert pulls(bench).age == (SILENT,) * 4


@pytest.mark.slow
def test_what_has_been_read_ages_and_is_silent_after_a_quarter_of_a_second(bench: Bench) -> None:
    amplifier = Hx711(bench, 2)
    amplifier.convert(-5000)
    run(bench, [amplifier], 6.0)
    for ms in (50, 100, 90):
        before = pulls(bench).age[2]
        bench.run_ms(ms)
        assert pulls(bench).age[2] - before == pytest.approx(1e-3 * ms, abs=5e-3)
    bench.run_ms(30)
    assert pulls(bench).age == (SILENT,) * 4


def test_a_turn_is_a_rate_whose_answer_holds_the_status_and_the_pulls(bench: Bench) -> None:
    assert bench.ask(Turn((0.0,) * 4))[0] is not Result.OK
    bench.get_ready()
    answer = bench.do(Turn((800.0, -400.0, 0.0, 0.0), 0.05))
    bench.run_ms(30)
    status, weighed = bench.status(), pulls(bench)
    assert status.rate == (800, -400, 0, 0) and weighed[3] == status.flags and answer.age == (SILENT,) * 4
    same = [name for name in Status._fields if name not in ("time", "watchdog_left", "position")]
    assert [getattr(weighed, name) for name in same] == [getattr(status, name) for name in same]
    assert all(abs(now - before) < 8 for now, before in zip(weighed.position, status.position, strict=True))


@pytest.mark.slow
def test_amplifiers_are_read_amid_40000_steps_a_second_without_a_late_step_or_a_long_pulse(bench: Bench) -> None:
    """The clock stays high for 1 us, whatever interrupts wait."""
    bench.get_ready()
    amplifiers = [Hx711(bench, axis) for axis in range(4)]
    rng, took = np.random.default_rng(3), []
    for _ in range(60):
        bench.do(Turn((10_000.0, -10_000.0, 10_000.0, -10_000.0), 0.2))
        bench.run_ms(3)
    for _ in range(4):
        bench.do(Turn((10_000.0, -10_000.0, 10_000.0, -10_000.0), 0.2))
        pulses(bench)
        values = rng.integers(-(2**23), 2**23, 4).tolist()
        for amplifier, value in zip(amplifiers, values, strict=True):
            amplifier.convert(value)
        run(bench, amplifiers, 8.0)
        changes = pulses(bench)
        for axis in range(4):
            high = changes[(changes[:, 1] & 2 << 2 * axis) > 0, 0]
            took.append(float(high[-1] - high[0]) / MICROSECOND)
        answer = pulls(bench)
        assert answer.counts == tuple(value >> 8 for value in values)
    assert max(took) < 400.0
    assert max(max(amplifier.highs) for amplifier in amplifiers) < 2 * MICROSECOND
    assert bench.do(Command.COUNTERS).late_steps == 0
