"""Worlds that differ in one thing alone run beside each other as each does by itself, to the last bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Actuator, Disturbances, Plant, Push, Sensor, TrueSensor
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout

WRIST = WristParameters()
TENDON = Actuator(level="tendon", sheath=1.0)
LOOP = Loop(control_period=5e-3, actuator=TENDON, sensor=Sensor(level="camera", noise_deg=0.05))


def run(loops: list[Loop], wrists: list[WristParameters]) -> Outcome:
    """Of the same gains, noise and motion."""
    law, count = controller("smc-tracking"), len(loops)
    gains = np.tile(gains_of(law, "hardware"), (count, 1)) * 3.0
    followed = motion(Reference(duration=0.3), WRIST, 0.6, 5e-3)
    streams = [(7,)] * count
    return rollout(law, gains, [followed], np.zeros(count, np.int64), loops, wrists, streams=streams, record=True)


@pytest.mark.parametrize(
    "changed",
    [
        {"disturbances": Disturbances(push=Push(force=3.0, start=0.2, duration=0.3))},
        {"limits": False},
        {"plant": Plant(stiffness_scale=0.7)},
        {"actuator": TENDON.model_copy(update={"tendon_stiffness": 9e3})},
        {"sensor": LOOP.sensor.model_copy(update={"noise_deg": 0.2})},
        {"sensor": LOOP.sensor.model_copy(update={"frame_rate": 47.0})},
        {"sensor": LOOP.sensor.model_copy(update={"frame_rate": 200.0})},
        {"sensor": LOOP.sensor.model_copy(update={"delay_frames": 5.0})},
        {"plant": Plant(sensor=TrueSensor(delay_frames=0.5))},
        {"wrist": WristParameters(tension_limit=25.0)},
    ],
    ids=lambda changed: next(iter(changed)),
)
def test_one_that_is_otherwise_is_otherwise_beside_the_usual_one(changed: dict[str, Any]) -> None:
    wrist = changed.pop("wrist", WRIST)
    loops, wrists = [LOOP, LOOP.model_copy(update=changed)] * 5, [WRIST, wrist] * 5
    together = run(loops, wrists).samples
    assert together is not None
    for each in (0, 1):
        alone = run(loops[each : each + 1], wrists[each : each + 1]).samples
        assert alone is not None
        assert all(one.tobytes() == alone[0].tobytes() for one in together[each::2])
    assert together[0].tobytes() != together[1].tobytes(), "it makes a difference"


CAMERAS = st.tuples(st.floats(20.0, 200.0), st.floats(0.0, 6.0), st.floats(0.0, 6.0))
"""Frame rate, the delay in frames that the observer believes, and the true one."""


@settings(max_examples=15, deadline=None)
@given(st.lists(CAMERAS, min_size=2, max_size=11))
@example([(20.0, 0.0, 0.0), (23.0, 0.0, 2.0)])  # the first frame comes late, and is believed to be fresh
@pytest.mark.slow
def test_cameras_of_any_rates_and_delays_do_not_disturb_each_other(cameras: list[tuple[float, float, float]]) -> None:
    loops = [
        LOOP.model_copy(
            update={
                "sensor": LOOP.sensor.model_copy(update={"frame_rate": rate, "delay_frames": believed, "dropped": 0.2}),
                "plant": Plant(sensor=TrueSensor(delay_frames=delay)),
            }
        )
        for rate, believed, delay in cameras
    ]
    together = run(loops, [WRIST] * len(loops)).samples
    assert together is not None
    for own, loop in zip(together, loops, strict=True):
        alone = run([loop], [WRIST]).samples
        assert alone is not None and own.tobytes() == alone[0].tobytes()
