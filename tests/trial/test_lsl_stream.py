"""Wanted bends from a stream of the lab streaming layer, whose sender is another process."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from wristctl.config.loop import Reference
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.trial.live_datagrams import FOLLOWING, HOLDING, HOME, LiveReference

# Sends these samples in turn at 50 Hz until it is killed.
SENDER = """
import sys, time
import pylsl
samples = {samples}
outlet = pylsl.StreamOutlet(pylsl.StreamInfo({name!r}, "Bend", len(samples[0]), 50, "{kind}", {name!r}))
print("ready", flush=True)
number = 0
while True:
    outlet.push_sample(samples[number % len(samples)])
    number += 1
    time.sleep(0.02)
"""
pytestmark = pytest.mark.slow


@contextmanager
def sender(name: str, samples: list[list[object]], kind: str = "double64") -> Iterator[subprocess.Popen[bytes]]:
    text = SENDER.format(samples=str(samples).replace("nan", "float('nan')"), name=name, kind=kind)
    running = subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        assert running.stdout is not None and running.stdout.readline() == b"ready\n"
        yield running
    finally:
        running.kill()
        running.communicate()


def live_of(name: str, planes: int, horizon: float = 3.0) -> LiveReference:
    reference = Reference.model_validate({"kind": "live", "listen": f"lsl:{name}", "hold": 0.3})
    return LiveReference(reference, WristParameters(), planes, "ulnar", horizon, 0.01, paced=True)


def unused(name: str) -> str:
    return f"wristctl-{name}-{os.getpid()}"


@pytest.mark.parametrize("planes", [1, 2])
def test_a_stream_is_followed_and_when_its_program_dies_the_reference_stands_and_goes_home(planes: int) -> None:
    name, bend = unused(f"bend-{planes}"), np.array([12.0, -5.0])[:planes]
    with sender(name, [bend.tolist()]) as running:
        live = live_of(name, planes)
        try:
            assert not live.source.guarded and name in live.source.words
            course = np.zeros_like(live.course)
            for sample in range(100):
                live.fill(course, sample)
            running.kill()
            died = time.monotonic()
            while live.states[live.filled - 1] == FOLLOWING:
                live.fill(course, live.filled)
            held = time.monotonic() - died
            for sample in range(live.filled, len(course)):
                live.fill(course, sample)
        finally:
            live.close()
    assert live.bends.counts["followed"] > 25 and set(live.bends.counts) == {"followed"}
    assert np.degrees(course[99, :, 0]) == pytest.approx(bend, abs=0.1)
    assert held < 0.5 and {HOLDING, HOME} < set(live.states)
    assert np.abs(np.degrees(course[-1, :, 0])).max() < 0.1


def test_samples_that_are_no_numbers_or_out_of_range_are_refused_and_counted() -> None:
    name = unused("bad")
    with sender(name, [[10.0, 2.0], [float("nan"), 0.0], [90.0, 0.0]]):
        live = live_of(name, 2, 1.0)
        try:
            live.listen()
        finally:
            live.close()
    counts = live.bends.counts
    assert min(counts["followed"], counts["not finite"], counts["out of range"]) > 5
    assert live.course[90, :, 0] == pytest.approx(np.radians([10.0, 2.0]), abs=2e-3)


def test_a_stream_that_is_not_there_twice_there_or_of_texts_is_refused() -> None:
    name = unused("none")
    with pytest.raises(UserError, match=f"0 LSL streams are named '{name}'"):
        live_of(name, 1)
    with sender(name, [["10"]], "string"), pytest.raises(UserError, match="of texts"):
        live_of(name, 1)
    for listen in ("lsl:", "lsl: "):
        with pytest.raises(ValueError, match="listen"):
            Reference.model_validate({"kind": "live", "listen": listen})
