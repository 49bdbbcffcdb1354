"""What the disturbance observer promises beside a loop's figures: on the model itself it finds nothing."""

from __future__ import annotations

import numpy as np
import pytest

from tests.control.conftest import ClosedLoop, Sine
from tests.control.test_laws import inertia_and_load, torque
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of

WRIST = WristParameters(gravity=(-8.0, 3.0), hand_mass=0.4)


@pytest.mark.slow
def test_on_the_model_itself_there_is_no_load_however_fast_the_wrist_moves(closed_loop: ClosedLoop, sine: Sine) -> None:
    """A period of 0.1 ms, so that what a period leaves out is little beside every term of the momentum's equation."""
    law = controller("ct-dob")
    course = closed_loop("ct-dob", gains_of(law, "default"), sine(1.4, 2.0, 1.0, 1e-4), WRIST, WRIST, period=1e-4)
    load = np.abs(course.memory[:, 0]).max()
    assert np.abs(course.rate).max() > 8.0 and load < 1e-3


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_it_expects_what_the_tendons_can_give_and_no_more_to_either_side(side: float) -> None:
    """Momentum over a period from rest: the torque that was asked for, or the limit where that is beyond it."""
    law, period = controller("ct-dob"), 1e-3
    gains = gains_of(law, "default")
    _, resisting = inertia_and_load(0.0, 0.0)
    for reach, is_short in ((1e3, False), (0.02, True)):
        memory = np.zeros(law.memory)
        limits = {"torque_low": -reach, "torque_high": reach}
        asked = torque(law, gains, memory, theta_ref=0.3 * side, period=period, **limits)
        assert (abs(asked) > reach) == is_short and asked * side > 0.0
        delivered = memory[1] / period + resisting - memory[0]
        assert delivered == pytest.approx(np.clip(asked, -reach, reach), rel=1e-9)
