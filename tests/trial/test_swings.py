"""A simulated trial swings where the trial on the emulated rig does, as fast and as far, and rests where it rests."""

from __future__ import annotations

import numpy as np
import pytest

from tests.trial.conftest import WRIST, Run, settings_of
from wristctl.arrays import Array
from wristctl.config.loop import sample_period
from wristctl.control.table import controller, gains_of
from wristctl.simulation.reference import motion, toward
from wristctl.simulation.rollout import rollout
from wristctl.simulation.worlds import loop_facing
from wristctl.trial.safety import SafetyStop

# What is looked at [s], of a trial that rests from 1 s on; peak to peak beyond which a wrist swings [deg].
_FROM, _TO, _SWINGS = 1.5, 3.0, 0.2


def swing(time: Array, theta: Array) -> tuple[float, float]:
    """Peak to peak [deg] about its trend, and the frequency [Hz] at which there is most of it."""
    late = (time >= _FROM) & (time < _TO)
    time, angle = time[late], np.degrees(theta[late])
    angle = angle - np.polyval(np.polyfit(time - _FROM, angle, 1), time - _FROM)
    power = np.abs(np.fft.rfft(angle * np.hanning(len(angle)), 8 * len(angle)))
    frequency = np.fft.rfftfreq(8 * len(angle), float(np.median(np.diff(time))))
    power[frequency < 3.0] = 0.0
    return float(np.ptp(angle)), float(frequency[power.argmax()])


@pytest.mark.parametrize("ramp", [50_000.0, 200_000.0])
@pytest.mark.parametrize("stronger", [1.0, 5.0])
@pytest.mark.slow
def test_a_simulation_swings_as_the_emulated_rig_does(experiment: Run, stronger: float, ramp: float) -> None:
    law = controller("pid-ff")
    gains = dict(zip(law.gains, map(float, gains_of(law, "hardware")), strict=True))
    gains |= {name: stronger * gains[name] for name in ("Kp", "Kd")}
    changes = {
        "rows": ({"controller": law.name, "gains": gains},), "horizon": _TO,
        "reference": {"duration": 1.0, "angle_deg": 20.0}, "actuator": {"level": "tendon", "ramp": ramp},
    }  # fmt: skip
    done = experiment(**changes)
    truth = done.table("truth")
    truth = truth[truth["trial"] == 0]
    settings = settings_of(**changes)
    wrist, loop = loop_facing(WRIST, settings.loop, "ulnar")
    course = motion(toward(settings.reference, "ulnar"), wrist, _TO, sample_period(loop.control_period))
    rows = np.array([law.values(gains)])
    outcome = rollout(law, rows, [course], np.zeros(1, np.int64), loop, wrist, None, [(0,)], record=True)
    simulated, at = swing(course.time, outcome.column("theta", 0))
    if truth["time"].max() < _FROM + 0.5:  # it swung so far that it was stopped before there is much to measure
        assert isinstance(done.error, SafetyStop) and simulated > _SWINGS and stronger > 3.0
        return
    size, frequency = swing(truth["time"].to_numpy(), truth["theta"].to_numpy())
    assert (size > _SWINGS) == (simulated > _SWINGS) == (stronger > 3.0)
    assert done.error is None or stronger > 3.0, "a rig that swings is stopped"
    if size > _SWINGS:
        assert 0.5 < simulated / size < 2.0 and at == pytest.approx(frequency, rel=0.2)
