"""What the neuro-controller promises: bounded weights whatever happens, and learning."""

from __future__ import annotations

import numpy as np

from tests.control.conftest import ClosedLoop, Sine
from wristctl.config.wrist import WristParameters
from wristctl.control.nc import UNITS
from wristctl.control.table import controller, gains_of

WRIST = WristParameters()


def test_weights_stay_within_their_bound_for_any_gains_in_the_box(closed_loop: ClosedLoop, sine: Sine) -> None:
    gains = controller("nc").gains
    box = np.log10([[g.low, g.high] for g in gains.values()]).T
    rng = np.random.default_rng(2)
    kappa = list(gains).index("kappa")
    for row in 10.0 ** rng.uniform(box[0], box[1], (40, box.shape[1])):
        course = closed_loop("nc", tuple(row), sine(1.4, 2.0, 0.5), WRIST, WRIST, segments_=4, limit=120.0)
        norm = np.linalg.norm(course.memory, axis=1)
        assert norm.max() <= np.sqrt(UNITS + 1) / row[kappa] * (1 + 1e-12)


def test_error_shrinks_with_training_on_a_repeated_move(closed_loop: ClosedLoop, sine: Sine) -> None:
    reference = sine(0.8, 0.5, 20.0)
    course = closed_loop("nc", gains_of(controller("nc"), "default"), reference, WRIST, WRIST, segments_=4, limit=120.0)
    each = np.sqrt(np.mean((course.theta - reference[:, 0]).reshape(10, -1) ** 2, axis=1))
    assert each[-1] < 0.5 * each[0]
    assert each[-1] <= each[4] <= each[1]


def test_without_learning_only_the_feedback_is_left(closed_loop: ClosedLoop, sine: Sine) -> None:
    reference = sine(0.8, 0.5, 4.0)
    still, learning = (
        closed_loop("nc", (50.0, 0.5, gamma, 0.1), reference, WRIST, WRIST, segments_=4) for gamma in (1e-3, 2.0)
    )
    rmse = [np.sqrt(np.mean((c.theta - reference[:, 0]) ** 2)) for c in (still, learning)]
    assert rmse[1] < 0.2 * rmse[0]
