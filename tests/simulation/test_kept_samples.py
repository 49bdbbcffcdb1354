"""Columns and rollouts out of blocks of lanes are those that were recorded, whatever batches they come of."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.kernel import BRIEFLY, RECORDED
from wristctl.simulation.outcome import KeptSamples, Outcome
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import How, rollout

SAMPLES, COLUMNS = 7, 3


def kept(count: int, blocks: int, lanes: int) -> tuple[KeptSamples, np.ndarray]:
    """Of random numbers, with them as (count, T, columns)."""
    numbers = np.random.default_rng(count).random((blocks * lanes, SAMPLES, COLUMNS))
    of_blocks = numbers.reshape(blocks, lanes, SAMPLES, COLUMNS).transpose(0, 2, 3, 1)
    return KeptSamples.of(of_blocks if lanes > 1 else of_blocks[..., 0], count), numbers[:count]


@pytest.mark.parametrize(("count", "blocks", "lanes"), [(1, 1, 1), (5, 1, 8), (8, 1, 8), (19, 3, 8)])
def test_blocks_are_taken_apart_and_their_filling_dropped(count: int, blocks: int, lanes: int) -> None:
    samples, numbers = kept(count, blocks, lanes)
    for column in range(COLUMNS):
        np.testing.assert_array_equal(samples.column(column), numbers[:, :, column])
    for each in range(count):
        np.testing.assert_array_equal(samples.rollout(each), numbers[each])
    np.testing.assert_array_equal(samples.all(), numbers)


def test_batches_are_joined_in_the_order_that_is_asked_for() -> None:
    parts = [kept(19, 3, 8), kept(1, 1, 1), kept(5, 1, 8)]
    order = np.random.default_rng(0).permutation(25)
    joined = KeptSamples.joined([each for each, _ in parts], order)
    numbers = np.concatenate([each for _, each in parts])[order]
    np.testing.assert_array_equal(joined.all(), numbers)
    np.testing.assert_array_equal(joined.column(1), numbers[:, :, 1])
    again = KeptSamples.joined([joined, parts[1][0]], np.arange(26)[::-1])
    np.testing.assert_array_equal(again.all()[1:], numbers[::-1])


def cameras(record: How) -> Outcome:
    """Of two frame rates, which cannot run side by side, in turn."""
    loops = [
        Loop(control_period=5e-3, sensor=Sensor(level="camera", frame_rate=rate)) for rate in (60.0, 30.0, 60.0, 30.0)
    ]
    law, wrist = controller("pid-ff"), WristParameters()
    gains = np.tile(gains_of(law, "hardware"), (4, 1)) * np.array([1.0, 1.0, 0.9, 0.9])[:, None]
    followed = motion(Reference(), wrist, 0.5, 5e-3)
    streams = [(each,) for each in range(4)]
    return rollout(law, gains, [followed], np.zeros(4, np.int64), loops, wrist, streams=streams, record=record)


def test_what_is_recorded_briefly_is_what_is_recorded_of_these_columns() -> None:
    whole, brief = cameras(True), cameras("briefly")
    assert whole.samples is not None and brief.samples is not None
    assert brief.samples.shape[2] == len(BRIEFLY) < len(RECORDED) < whole.samples.shape[2]
    for name in BRIEFLY:
        np.testing.assert_array_equal(whole.columns(name), brief.columns(name))
        for each in range(4):
            np.testing.assert_array_equal(whole.column(name, each), whole.columns(name)[each])
    assert len(np.unique(whole.columns("theta")[:, -1])) == 4
    assert cameras(False).kept is None and cameras(False).samples is None
