"""What the load cells of the emulated bench read, against the true pulls at its spools."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.bench.conftest import TAUT, Host, HostOn
from wristctl.bench.emulated_rig import Bystander
from wristctl.board.messages import AXES, Command, Pulls
from wristctl.config.bench import BenchSettings, EmulatedCells, InjectedFault

CELLS = EmulatedCells(noise=0.0)
SCALE, OFFSET = np.array(CELLS.counts_per_newton), np.array(CELLS.offset)
SILENT = 0.255


class Kept:
    """Keeps what the cells read."""

    def __init__(self) -> None:
        self.pulls: list[Pulls] = []

    def take(self, pulls: Pulls) -> None:
        self.pulls.append(pulls)

    def judge(self) -> None:
        """Nothing is judged here."""


def settings(**changes: Any) -> BenchSettings:
    return BenchSettings(motors=TAUT, load_cells=CELLS.model_copy(update=changes))


def newest(host: Host) -> Pulls:
    kept = Kept()
    host.board.cells = kept
    host.board.read()
    host.board.cells = None
    return kept.pulls[0]


def newtons(pulls: Pulls) -> np.ndarray:
    return np.asarray((np.array(pulls.counts) - OFFSET) / SCALE)


@pytest.mark.slow
def test_cells_of_tendons_at_rest_read_their_pulls_to_a_count(host_on: HostOn) -> None:
    host = host_on(settings())
    host.reel((40, 20, 60, 30))
    host.rest(1.5)
    pulls = newest(host)
    true = host.bench.truth(host.bench.transport.now() - 0.07).pull.mean(axis=0)
    assert true.max() > 5.0 and max(pulls.age) < 0.02
    assert newtons(pulls) == pytest.approx(true, abs=2.0 / SCALE.min())


@pytest.mark.slow
def test_a_reading_is_the_mean_of_the_last_four_conversions(host_on: HostOn) -> None:
    """Tendons of one side that are reeled in steadily: readings come half that time late, by their age more."""
    host = host_on(settings())
    host.reel((20, 20, 20, 20))
    host.rest(0.5)
    kept = Kept()
    host.board.cells = kept
    host.turn((60.0, 60.0, 60.0, 60.0), 0.5)
    truth = host.bench.truth()
    for pulls in kept.pulls[20:45]:
        for axis, period in enumerate(1.0 / (CELLS.rate * (1.0 + np.array(CELLS.clock_error)))):
            read = pulls.time - pulls.age[axis] - 3e-3  # polled every 4 ms
            during = (truth.time > read - 4 * period) & (truth.time <= read)
            assert newtons(pulls)[axis] == pytest.approx(truth.pull[during, axis].mean(), abs=0.5)
            assert pulls.age[axis] < period + 8e-3


@pytest.mark.slow
def test_readings_scatter_by_the_noise_and_are_the_same_however_often_somebody_looks_at_the_wrist(
    host_on: HostOn,
) -> None:
    read: list[list[tuple[int, ...]]] = []
    for looks in (1, 7):
        host, counts = host_on(settings(noise=20.0)), []
        for _ in range(50):
            for _ in range(looks):
                host.bench.truth()
                host.bench.transport.wait(0.042 / looks)
            counts.append(tuple(newest(host).counts))
        read.append(counts)
    assert read[0] == read[1]
    assert np.array(read[0]).std(axis=0) == pytest.approx(20.0, rel=0.35)


@pytest.mark.slow
def test_each_cell_has_noise_of_its_own(host_on: HostOn) -> None:
    """Of one stream for all, cells whose clocks differ would read the same noise a little apart: 15 and more of 50."""
    host, read = host_on(settings(noise=5000.0)), []
    for _ in range(50):
        host.bench.transport.wait(0.042)
        read.append(newest(host).counts)
    noise = np.array(read) - OFFSET
    for one in range(AXES):
        for other in range(one):
            apart = np.abs(noise[:, one][:, None] - noise[:, other][None, :]).min(axis=1)
            assert np.count_nonzero(apart < 3.0) < 6, "0.6 by chance"


@pytest.mark.slow
def test_an_unplugged_amplifier_is_silent_and_the_others_are_not_until_it_is_back(host_on: HostOn) -> None:
    fault = InjectedFault(kind="cell-unplugged", axis=2, since="power-on", at=1.0, duration=1.0)
    host = host_on(settings().model_copy(update={"faults": (fault,)}))
    for time, silent in ((0.9, False), (1.2, False), (1.3, True), (2.0, True), (2.1, False)):
        host.bench.transport.wait(time - host.bench.transport.now())
        ages = newest(host).age
        assert (ages[2] == SILENT) is silent
        assert max(ages[:2] + ages[3:]) < 0.02


def test_without_cells_all_are_silent(host_on: HostOn) -> None:
    assert newest(host_on()).age == (SILENT,) * 4


def test_a_weight_that_a_bystander_hangs_on_a_cell_is_read(host_on: HostOn) -> None:
    host = host_on(settings())
    rig = host.bench
    before = newtons(newest(host))
    bystander = Bystander(rig, -1)
    bystander.do("hang 3 2.5")
    host.bench.transport.wait(0.1)
    assert newtons(newest(host)) - before == pytest.approx([0.0, 0.0, 0.0, 2.5 * 9.80665], abs=0.1)
    bystander.do("hang 4 2.5")  # no such cell
    assert rig.cells is not None and rig.cells.hanging.tolist() == [0.0, 0.0, 0.0, 2.5]


def test_a_status_costs_the_line_half_a_millisecond_more_with_the_pulls(host_on: HostOn) -> None:
    board = host_on(settings()).board
    plain = board.ask(Command.STATUS, b"", 0.1, 1)
    weighed = board.ask(Command.PULLS, b"", 0.1, 1)
    assert len(weighed) - len(plain) == 12
