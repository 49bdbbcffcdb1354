"""What is known of trials one after the other, whatever performs them, and the stop that ends them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.motors_ready import Halt
from wristctl.trial.safety import SafetyStop
from wristctl.trial.tick_timing import TickTiming
from wristctl.trial.trial_series import TrialSeries
from wristctl.trial.trials import Trial


class _Loop:
    """A loop whose residuals are given, and which may fail."""

    def __init__(self, error: Exception | None = None, **most: float) -> None:
        self.watch, self._error = SimpleNamespace(most=most, words=lambda: f"{most}"), error

    def follow(self, *_: object) -> None:
        if self._error is not None:
            raise self._error


def series() -> Any:
    settings, wrist = HwRunSettings().within(WristParameters()), WristParameters()
    kept: Any = SimpleNamespace(disk=SimpleNamespace(give_up_reserve=lambda: None))
    return TrialSeries(settings, wrist, wrist, [], kept, TickTiming(0.01), None, None, None)


def trial(number: int) -> Trial:
    return Trial(number, "ulnar", 0, 0.0, 0)


def test_the_largest_residual_of_all_trials_counts_and_what_was_odd_is_of_each() -> None:
    """Of the first, of the last, and of one that failed."""
    trials = series()
    trials._follow(_Loop(tension=2.0, bend=0.1), trial(0))
    with pytest.raises(ValueError, match="ended"):
        trials._follow(_Loop(ValueError("ended"), tension=1.0, bend=0.3), trial(1))
    assert trials.most == {"tension": 2.0, "bend": 0.3} and set(trials.odd) == {0, 1}


def test_a_stop_is_timed_from_the_beginning_of_its_trial_and_leaves_the_one_before_in_doubt() -> None:
    trials = series()
    between = trials._note_stop(SafetyStop("heat", "motor"), 7.0, Halt(True, "stop()", None, 0.1))
    assert between.time is None and between.trial is None and not trials.outcomes
    trials._begun(trial(3), 5.0)
    trials._in_doubt, trials.outcomes[2] = 2, "ok"
    stop = trials._note_stop(SafetyStop("heat", "motor"), 7.0, Halt(True, "stop()", None, 0.1))
    assert (stop.trial, stop.time, trials.outcomes[3]) == (3, 2.0, "begun") and trials.outcomes[2] == "after it: heat"
    trials._in_doubt, trials.outcomes[2] = 2, "ok"
    trials._note_stop(KeyboardInterrupt(), 7.0, Halt(True, "stop()", None, 0.1))
    assert trials.outcomes[2] == "ok", "a person who stops says nothing of the trial before"


@pytest.mark.parametrize(
    ("raised", "cause"),
    [(KeyboardInterrupt(), KeyboardInterrupt), (OSError(28, "No space left"), SafetyStop), (ValueError(), ValueError)],
)
def test_everything_is_stopped_before_what_ends_the_trials_is_raised(
    raised: BaseException, cause: type[BaseException]
) -> None:
    """A disk that is full is a stop like another."""
    stopped = list[BaseException]()
    with pytest.raises(cause) as caught, series()._stopping(stopped.append):
        raise raised
    assert stopped == [caught.value] and (caught.value is raised or caught.value.__cause__ is raised)
