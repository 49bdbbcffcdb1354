"""What is known of trials one after the other, and what is kept of the stop that ends them: why, when, and how."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wristctl.board.messages import Fault, Flag, State, Status
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.experiment import Experiment, Stop
from wristctl.trial.motors_ready import Halt
from wristctl.trial.safety import SafetyStop
from wristctl.trial.trials import Trial

STATUS = Status(1.0, State.FAULT, Fault.LINK, Flag(0), 0.0, (1, 2, 3, 4), (5, 6, 7, 8), 0)


def test_a_stop_tells_what_the_board_last_said() -> None:
    plain = Stop(SafetyStop("too far"), 3, 1.25, Halt(True, "STOP, board FAULT", STATUS, 0.02)).plain()
    assert plain == {
        "reason": "stopped: too far", "trial": 3, "time": 1.25, "motors_stand": True, "how": "STOP, board FAULT",
        "seconds": 0.02, "state": "FAULT", "faults": "LINK", "position": (1, 2, 3, 4), "rate": (5, 6, 7, 8),
    }  # fmt: skip
    calm = Halt(True, "STOP", STATUS._replace(faults=Fault(0), state=State.ENABLED), 0.02)
    assert Stop(SafetyStop("x"), None, None, calm).plain() | {"faults": "none", "state": "ENABLED", "trial": None} == (
        Stop(SafetyStop("x"), None, None, calm).plain()
    )


def test_of_a_board_that_does_not_answer_nothing_is_known() -> None:
    plain = Stop(SafetyStop("lost"), 0, 0.5, Halt(False, "no answer", None, 0.3)).plain()
    assert not plain["motors_stand"]
    assert [plain[name] for name in ("state", "faults", "position", "rate")] == [None] * 4


def test_the_reason_is_the_users_error_the_operator_or_the_bug_by_its_kind() -> None:
    halted = Halt(True, "STOP", STATUS, 0.0)
    assert Stop(KeyboardInterrupt(), None, None, halted).reason == "interrupted by the operator"
    assert Stop(ZeroDivisionError("by zero"), None, None, halted).reason == "ZeroDivisionError: by zero"


class _Loop:
    """A loop whose residuals are given, and which may fail."""

    def __init__(self, error: BaseException | None = None, **most: float) -> None:
        self.watch, self._error = SimpleNamespace(most=most, words=lambda: f"{most}"), error
        self.next_tick, self.followed = 5.0, list[int]()

    def follow(self, motion: object, law: object, gains: object, trial: int = -1, *_: object) -> None:
        self.followed.append(trial)
        if self._error is not None:
            raise self._error


class _Stand:
    """Stopped at 7 s on its clock; it knows the truth of trials that began at 5 s."""

    def __init__(self) -> None:
        self.stopped = list[bool]()

    def begin(self, *_: object) -> None:
        """Nothing happens."""

    def now(self) -> float:
        return 7.0

    def stop(self, early: bool) -> Halt:
        self.stopped.append(early)
        return Halt(True, "stop()", None, 0.1)

    def truth(self, start: float) -> Any:
        return np.full((2, 3), start)


def trials_of_two() -> tuple[Any, list[tuple[int, Any]]]:
    """An experiment, and the truth that its log is given."""
    true = list[tuple[int, Any]]()
    kept: Any = SimpleNamespace(
        disk=SimpleNamespace(give_up_reserve=lambda: None), truth=lambda number, rows: true.append((number, rows))
    )
    return Experiment(HwRunSettings(), WristParameters(), [], kept), true


def trial(number: int) -> Trial:
    return Trial(number, "ulnar", 0, 0.0, 0)


def test_the_largest_residual_of_all_trials_counts_and_what_was_odd_is_of_each() -> None:
    """Of the first, of the last, and of one that failed."""
    trials, stand = trials_of_two()[0], _Stand()
    trials._one(stand, _Loop(tension=2.0, bend=0.1), trial(0))
    with pytest.raises(ValueError, match="ended"):
        trials._one(stand, _Loop(ValueError("ended"), tension=1.0, bend=0.3), trial(1))
    assert trials.most == {"tension": 2.0, "bend": 0.3} and set(trials.odd) == {0, 1}
    assert trials.outcomes == {0: "ok", 1: "begun"}


@pytest.mark.parametrize("rests", [True, False], ids=["board", "rig"])
def test_trials_are_checked_each_before_the_next_and_one_that_is_stopped_leaves_those_before_sound(
    monkeypatch: pytest.MonkeyPatch, rests: bool
) -> None:
    """A board's wrist is brought to rest after its check, a rig's before the next trial; the third trial is stopped."""
    (trials, _), did = trials_of_two(), list[str]()
    trials._trials = [trial(0), trial(1), trial(2)]

    class Watched(_Stand):
        zero, poses = "zero", {"ulnar": "pose"}

        def open(self, *_: object) -> None:
            did.append("open")

        def ready(self, one: Trial, loop: object) -> str | None:
            did.append(f"ready {one.number}")
            return "slack" if loop is None else None

        def check(self) -> str | None:
            did.append("check")
            return "slack" if rests else None

        def close(self) -> None:
            did.append("close")

    class Third(_Loop):
        def follow(self, *given: Any) -> None:
            did.append(f"trial {given[3]}" if len(given) > 3 else "back")
            if given[3:4] == (2,):
                raise SafetyStop("heat", "motor")

    def at_rest(self: Experiment, ready: str, shown: object) -> Any:
        did.append("rest")
        return Third()

    monkeypatch.setattr(Experiment, "_at_rest", at_rest)
    monkeypatch.setattr(Experiment, "_warm_up", lambda self, plane: did.append("warm"))
    stand = Watched()
    with pytest.raises(SafetyStop):
        trials.run(stand)
    assert trials.outcomes == {0: "ok", 1: "ok", 2: "stopped: heat"} and stand.stopped == [True]
    assert (trials.zero, trials.poses, trials.stop.trial) == ("zero", {"ulnar": "pose"}, 2)
    one = "trial 0 back check rest ready 1 trial 1 back check rest ready 2 trial 2 close"
    if not rests:
        one = one.replace("rest ready 1", "ready 1 rest").replace("rest ready 2", "ready 2 rest")
    assert " ".join(did) == f"warm open ready 0 rest {one}"


def test_after_a_trial_its_truth_is_kept_and_the_wrist_is_led_back_outside_of_it() -> None:
    (trials, true), loop = trials_of_two(), _Loop()
    trials._one(_Stand(), loop, trial(3))
    assert loop.followed == [3, -1] and trials._in_doubt == 3
    ((number, rows),) = true
    assert number == 3 and (rows == 5.0).all()


def test_a_stop_is_timed_from_the_beginning_of_its_trial_and_leaves_the_one_before_in_doubt() -> None:
    (trials, true), stand = trials_of_two(), _Stand()
    trials._stopped(stand, SafetyStop("heat", "motor"))
    between = trials.stop
    assert between.time is None and between.trial is None and not trials.outcomes and not true
    trials._in_doubt, trials.outcomes[2] = 2, "ok"
    with pytest.raises(ValueError, match="bug"):
        trials._one(stand, _Loop(ValueError("bug")), trial(3))
    trials._stopped(stand, SafetyStop("heat", "motor"))
    assert (trials.stop.trial, trials.stop.time) == (3, 2.0)
    assert trials.outcomes == {2: "after it: heat", 3: "stopped: heat"} and [number for number, _ in true] == [3]
    trials._in_doubt, trials.outcomes[2] = 2, "ok"
    trials._stopped(stand, KeyboardInterrupt())
    assert trials.outcomes[2] == "ok", "a person who stops says nothing of the trial before"
    assert stand.stopped == [True] * 3


@pytest.mark.parametrize(
    ("raised", "cause"),
    [(KeyboardInterrupt(), KeyboardInterrupt), (OSError(28, "No space left"), SafetyStop), (ValueError(), ValueError)],
)
def test_everything_is_stopped_before_what_ends_the_trials_is_raised(
    raised: BaseException, cause: type[BaseException]
) -> None:
    """A disk that is full is a stop like another."""
    trials, stand = trials_of_two()[0], _Stand()
    with pytest.raises(cause) as caught, trials._stopping(stand):
        raise raised
    assert stand.stopped == [True] and trials.stop.reason == Stop(caught.value, None, None, trials.stop.halt).reason
    assert caught.value is raised or caught.value.__cause__ is raised
