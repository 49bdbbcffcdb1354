"""What a control step costs, by a clock of which every chunk is known."""

from __future__ import annotations

import time
from itertools import accumulate, chain

import numpy as np
import pytest

from wristctl.comparison.step_cost import step_time
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of


def test_a_step_costs_its_share_of_a_chunk_in_microseconds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Chunk k of 400 takes k^2 times 500 us, so that a step of it takes k^2 us; the first of all does not count."""
    order = [1e6, *(np.random.default_rng(0).permutation(400) + 1)]
    clock = accumulate(chain.from_iterable((1.0, 500e-6 * float(k) ** 2) for k in order))
    monkeypatch.setattr(time, "perf_counter", lambda: next(clock))
    law = controller("pid")
    found = step_time(law, gains_of(law, "printed"), WristParameters())
    assert found.median == pytest.approx((200.0**2 + 201.0**2) / 2.0, rel=1e-6)
    assert found.p99 == pytest.approx(396.0**2 + 0.01 * (397.0**2 - 396.0**2), rel=1e-6)
    assert next(clock, None) is None, "400 chunks and the first, no more and no less"
