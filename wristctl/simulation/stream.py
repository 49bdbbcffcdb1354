"""Streams of rollouts: as many as one likes in the memory of one batch."""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.simulation.motion import Motion
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.rollout import rollout


def stream(
    controller: Controller,
    batches: Iterable[NDArray[np.float64]],
    followed: Motion,
    loop: Loop,
    wrist: WristParameters,
    threads: int | None = None,
) -> Iterator[Outcome]:
    """Outcomes of batches of gains, each (count, g), as they come, all on one motion; nothing of them is kept.

    The caller reduces each outcome (a histogram, a best, a line in a file), so that a million rollouts need no more
    memory than one batch. A few thousand lanes a batch keep all threads busy.
    """
    for gains in batches:
        yield rollout(controller, gains, [followed], np.zeros(len(gains), np.int64), loop, wrist, threads=threads)
