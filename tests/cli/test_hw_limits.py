"""`wristctl hw limits --from RUN`: several runs by their files, one of which a limit has stopped."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.cli.conftest import Call
from tests.trial.test_run_limits import LIMITS, PERIOD, logged
from wristctl.config.study import Study
from wristctl.records import start_run
from wristctl.trial.residuals import FILE, Limit, plain
from wristctl.trial.run_limits import Logged, StopTick

JUMP = next(limit for limit in LIMITS if limit.name == "jump")
Kept = Callable[..., str]


@pytest.fixture
def kept(tmp_path: Path) -> Kept:
    """A run with these residuals, 0 but where they are given, and its id."""

    def keep(label: str, trial: int = 0, limits: tuple[Limit, ...] = LIMITS, **sizes: Any) -> str:
        with start_run("hw-run", Study(), label, tmp_path / "results") as run:
            file = run.file("data/residuals.csv")
            logged(trial, **sizes).values.to_csv(file, index=False)
            run.file(FILE).write_text(json.dumps(plain(limits)))
        return run.path.name

    return keep


def rising(to: float) -> np.ndarray:
    """To this at the last of the fifty ticks."""
    return np.linspace(0.0, to, 50)


@pytest.fixture
def both(kept: Kept) -> tuple[str, str]:
    """One run that went through, to 40 % of the limit of a jump; one that was stopped by it in its trial 3."""
    return kept("sound", jump=rising(0.4 * JUMP.limit)), kept("stopped", 3, jump=np.eye(50)[30] * 50.0 * JUMP.limit)


def test_each_run_is_judged_by_its_own_file_and_named_where_its_residual_is_largest(
    call: Call, both: tuple[str, str]
) -> None:
    code, out, err = call("hw", "limits", *(part for name in both for part in ("--from", name)), "--json")
    assert code == 0, err
    told = json.loads(out)
    assert told["runs"] == list(both)
    through, stop = told["stopped"]
    assert through is None and (stop["trial"], stop["by"], stop["row"]) == (3, "jump", 30)
    assert stop["clock"] == pytest.approx(10.0 + 30 * PERIOD)
    nearest = told["residuals"][0]
    assert (nearest["name"], nearest["run"], nearest["trial"]) == ("jump", both[1], 3)
    assert nearest["largest"] == pytest.approx(50.0 * JUMP.limit) and nearest["limit"] == JUMP.limit
    assert nearest["proposed"] == pytest.approx(0.6 * JUMP.limit, rel=0.05), "1.5 times that of the sound run"


def test_people_read_which_run_was_stopped_and_where_and_whether_limits_are_proposed(
    call: Call, both: tuple[str, str]
) -> None:
    sound, stopped = both
    _, out, _ = call("hw", "limits", "--from", sound, "--from", stopped)
    assert f"{stopped} was stopped in trial 3, {10.0 + 30 * PERIOD:.3f} s" in out and f"{sound} was" not in out
    assert "No limit stopped" not in out and "Proposed" in out
    _, out, _ = call("hw", "limits", "--from", stopped)
    assert "proposes no limits" in out and "Proposed" not in out
    _, out, _ = call("hw", "limits", "--from", sound)
    (row,) = [line for line in out.splitlines() if line.startswith("jump ")]
    assert "No limit stopped 1 trial;" in out and "jump came nearest" in out and "Proposed" in out
    assert " 40 " in row and "safety.jump_deg=" in row


def test_trials_of_all_runs_are_counted_and_a_stop_between_trials_is_called_so(call: Call, kept: Kept) -> None:
    names = kept("a"), kept("b", 2)
    _, out, _ = call("hw", "limits", "--from", names[0], "--from", names[1])
    assert "No limit stopped 2 trials;" in out
    _, out, _ = call("hw", "limits", "--from", kept("c", -1, jump=np.eye(50)[30] * 50.0 * JUMP.limit))
    assert "was stopped between trials" in out


def test_the_picture_is_of_the_last_run_up_to_where_it_was_stopped(
    call: Call, both: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[tuple[Logged, StopTick | None]] = []

    def draw(run: Logged, stop: StopTick | None) -> Figure:
        drawn.append((run, stop))
        return Figure()

    monkeypatch.setattr("wristctl.plotting.residual_figure.residuals_over_time", draw)
    for names in (both, both[::-1], both[:1]):
        code, out, _ = call("hw", "limits", *(part for name in names for part in ("--from", name)), "--figure", "a.png")
        assert code == 0 and "a.png" in out and Path("a.png").read_bytes().startswith(b"\x89PNG")
        Path("a.png").unlink()
    trials = [int(run.values["trial"].iloc[0]) for run, _ in drawn]
    assert trials == [3, 0, 0] and [stop is not None for _, stop in drawn] == [True, False, False]


@pytest.mark.parametrize(("file", "said"), [("a.png", "could not be drawn: ZeroDivisionError"), ("a.gif", ".pdf")])
def test_a_picture_that_cannot_be_drawn_costs_nothing_that_is_printed(
    call: Call, both: tuple[str, str], monkeypatch: pytest.MonkeyPatch, file: str, said: str
) -> None:
    draw = (lambda *_: 1 / 0) if file == "a.png" else lambda *_: Figure()
    monkeypatch.setattr("wristctl.plotting.residual_figure.residuals_over_time", draw)
    _, plain, _ = call("hw", "limits", "--from", both[0])
    code, out, err = call("hw", "limits", "--from", both[0], "--figure", file)
    assert code != 0 and out == plain and said in err and file in err and not Path(file).exists()


def test_runs_of_other_limits_or_without_any_are_refused(call: Call, kept: Kept) -> None:
    first, other = kept("a"), kept("b", limits=tuple(limit._replace(limit=2.0 * limit.limit) for limit in LIMITS))
    code, out, err = call("hw", "limits", "--from", first, "--from", other)
    assert code == 2 and out == "" and f"not those of {first}" in err and other in err
    (Path("results") / other / FILE).unlink()
    code, out, err = call("hw", "limits", "--from", other)
    assert code == 2 and out == "" and "an hw-run run" in err
