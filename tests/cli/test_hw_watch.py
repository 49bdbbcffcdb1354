"""`hw watch` draws the trials of a run until it ends."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

import wristctl
from wristctl.commands.hw_run import live_figure
from wristctl.records import Run, start_run

Call = Callable[..., tuple[int, str, str]]


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, float, float]]:
    """Whose log was read, for how many seconds of what period."""
    found: list[tuple[str, float, float]] = []

    def rows(log: Path, seconds: float, period: float) -> None:
        found.append((log.parents[1].name, seconds, period))

    monkeypatch.setattr(live_figure, "newest_rows", rows)
    monkeypatch.setattr(live_figure, "recent", lambda _: Figure(figsize=(2.0, 1.0)))
    return found


def performed(label: str, log: str | None = "time\n", kind: str = "hw-run") -> Run:
    study = wristctl.load_study(None, "hw-run.control_period=0.004")
    with start_run(kind, study, label) as run:
        if log is not None:
            run.file("data/log.csv").write_text(log)
    return Run(run.path)


def test_the_newest_run_of_trials_is_drawn_once_where_it_has_ended(call: Call, asked: list[Any]) -> None:
    older, newer = performed("a"), performed("b")
    performed("c", kind="gen-data")
    assert call("hw", "watch") == (0, "live.png\n", "")
    assert asked == [(newer.id, 10.0, 0.004)] and Path("live.png").read_bytes().startswith(b"\x89PNG")
    assert call("hw", "watch", older.id, "--last", "3", "--file", "seen.png")[:2] == (0, "seen.png\n")
    assert asked[1:] == [(older.id, 3.0, 0.004)] and Path("seen.png").is_file()


@pytest.mark.parametrize("log", ["", None])
def test_a_run_that_ended_before_its_first_trial_has_nothing_to_draw(
    call: Call, asked: list[Any], log: str | None
) -> None:
    performed("a", log)
    code, out, err = call("hw", "watch")
    assert (code, out) == (2, "") and "the run ended before its first trial" in err
    assert not asked and not Path("live.png").exists()


def test_other_runs_are_not_watched(call: Call, asked: list[Any]) -> None:
    run = performed("a", kind="gen-data")
    code, _, err = call("hw", "watch", run.id)
    assert code == 2 and "only runs of hw-run go on in time" in err and not asked


def test_a_run_is_drawn_again_until_it_has_ended(call: Call, asked: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    run = performed("a")
    states, waited = iter(["running", "running", "ok"]), list[float]()
    monkeypatch.setattr(Run, "state", property(lambda _: next(states)))
    monkeypatch.setattr("wristctl.cli.hw_bench.time.sleep", waited.append)
    assert call("hw", "watch", str(run.path), "--every", "0.2")[0] == 0
    assert len(asked) == 3 and waited == [0.2, 0.2], "once more after its end, and then no pause"


@pytest.mark.parametrize(("option", "least", "less"), [("--last", "0.5", "0.45"), ("--every", "0.1", "0.09")])
def test_a_picture_shows_half_a_second_at_least_at_most_ten_times_a_second(
    call: Call, asked: list[Any], option: str, least: str, less: str
) -> None:
    performed("a")
    assert call("hw", "watch", option, least)[0] == 0 and call("hw", "watch", option, less)[0] == 2
