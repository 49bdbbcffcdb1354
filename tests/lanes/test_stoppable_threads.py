"""What is left by an exception ends soon: running work is told, and what waits is not begun."""

from __future__ import annotations

from threading import Event

import numpy as np
import pytest

from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.processes import stoppable
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout


def test_an_exception_stops_what_runs_and_leaves_what_waits() -> None:
    stop, running, begun = Event(), Event(), list[int]()

    def work(number: int) -> None:
        begun.append(number)
        running.set()
        assert stop.wait(20.0)

    with pytest.raises(KeyboardInterrupt), stoppable(1, stop) as pool:
        for number in range(5):
            pool.submit(work, number)
        assert running.wait(20.0)
        raise KeyboardInterrupt
    assert begun == [0] and stop.is_set()


def test_all_is_done_where_nothing_is_wrong() -> None:
    with stoppable(2, stop := Event()) as pool:
        assert list(pool.map(lambda each: each**2, range(20))) == [each**2 for each in range(20)]
    assert not stop.is_set()


@pytest.mark.parametrize("threads", [1, 2])
def test_a_rollout_that_is_told_to_stop_ends_before_its_wrist_has_moved(threads: int) -> None:
    law, wrist = controller("smc-tracking"), WristParameters()
    gains = np.tile(gains_of(law, "hardware"), (40, 1))
    followed = motion(Reference(), wrist, 1.0, 1e-3)

    def until(stop: Event) -> np.ndarray:
        which = np.zeros(40, np.int64)
        return rollout(law, gains, [followed], which, Loop(), wrist, threads=threads, stop=stop).until

    stopped = Event()
    stopped.set()
    assert until(Event()) == pytest.approx(1.0, abs=2e-3) and (until(stopped) == 0.0).all()
