"""A study that no computer could do is refused before it begins, with the largest that there is room for."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from wristctl.commands.audit.command import AUDIT
from wristctl.commands.compare.command import COMPARE
from wristctl.commands.perform import prepare
from wristctl.commands.procedure import Procedure
from wristctl.commands.simulate.command import SIMULATE
from wristctl.commands.study.command import FAIR_STUDY
from wristctl.commands.tune.command import TUNE
from wristctl.config.loop import LOOPS, Loop
from wristctl.errors import UserError
from wristctl.simulation.closed_loop import MOST_BYTES, MOST_IN_ALL, Size, check_size
from wristctl.study_files.load import load_study

TABLE: dict[str, Procedure[Any]] = {"simulate": SIMULATE, "compare": COMPARE, "tune": TUNE, "audit": AUDIT}
NOWHERE = Path("nowhere")
CLAIMS = Path(__file__).parents[2] / "experiments" / "claims.yaml"


@pytest.mark.parametrize(
    ("loop", "horizon", "said"),
    [
        (Loop(), 1e9, "integration steps"),
        (Loop(control_period=1e-12), 5.0, "integration steps"),
        (Loop(substeps=1000, control_period=1e-6), 100.0, "integration steps"),
        (Loop(), 1e5, "GB"),
    ],
)
def test_too_much_is_refused_and_what_is_said_to_fit_does(loop: Loop, horizon: float, said: str) -> None:
    with pytest.raises(UserError, match=said) as caught:
        check_size(Size([Loop(), loop], horizon))
    found = re.search(r"at most ([0-9.e+-]+) s", str(caught.value.fix))
    assert found is not None and 0.0 < float(found[1]) < horizon
    check_size(Size([loop], 0.99 * min(float(found[1]), 1e4)))


def test_what_people_do_is_not_refused() -> None:
    check_size(Size([*LOOPS.values(), Loop(control_period=0.01, substeps=100)], 600.0))
    assert 8 * 5_000 * len(LOOPS) < MOST_BYTES


@pytest.mark.parametrize("loop", [Loop(), Loop(substeps=1000), Loop(control_period=1e-5)])
def test_rollouts_that_are_too_many_together_are_refused_with_steps_time_and_what_fits(loop: Loop) -> None:
    one = Size([loop], 5.0).steps
    with pytest.raises(UserError) as caught:
        check_size(Size([loop], 5.0, 2.0 * MOST_IN_ALL / one))
    assert re.search(r"2e\+13 integration steps of .* rollouts, some [0-9.e+]+ days on \d+ core", caught.value.what)
    most = re.search(r"at most ([0-9.e+]+) such rollouts", str(caught.value.fix))
    assert most is not None and float(most[1]) == pytest.approx(MOST_IN_ALL / one, rel=0.06)
    check_size(Size([loop], 5.0, 0.9 * float(most[1])))


def test_steps_of_all_loops_count_and_not_the_last_ones() -> None:
    both = Size([LOOPS["exact"], LOOPS["four-segments"]], 5.0, 10.0)
    assert both.steps == 5.0 * (Size(both.loops[:1], 5.0).steps + Size(both.loops[1:], 5.0).steps)


@pytest.mark.parametrize(
    ("command", "settings", "where"),
    [
        ("simulate", ["simulate.loop.control_period=1e-9", "simulate.horizon=50"], "simulate.horizon"),
        ("simulate", ["sweep=[loop.control_period=1e-6..1e-5:100000]", "simulate.horizon=500"], "--sweep KEY=VALUES"),
        ("compare", ["compare.inverses=[none]", "compare.loops={a: {substeps: 1000, sensor: {level: camera}}, b: {}}",
                     "compare.repetitions=1000", "compare.horizon=9000"], "compare"),
        ("tune", ["tune.candidates=10000", "tune.iterations=100000", "tune.horizon=50"], "tune"),
        ("audit", ["audit.horizon=1e7"], "audit.horizon"),
    ],
)  # fmt: skip
@pytest.mark.slow
def test_a_command_that_would_not_end_is_refused_before_it_begins(
    command: str, settings: list[str], where: str
) -> None:
    files = [CLAIMS] if command == "audit" else []
    with pytest.raises(UserError, match="integration steps") as caught:
        prepare(TABLE[command], load_study(files, settings, command), NOWHERE).plan()
    assert where in str(caught.value)


@pytest.mark.slow
def test_a_box_of_too_many_settings_is_refused_and_the_shipped_one_is_not() -> None:
    shipped = [CLAIMS, CLAIMS.with_name("unknowns.yaml")]
    prepare(AUDIT, load_study(shipped, [], "audit"), NOWHERE).plan()
    for many in ("continuous=[10000000, 1]", "unknowns={loop.control_period: {draw: [1.0e-9]}}"):
        study = load_study(shipped, [f"audit.box.{many}", "audit.box.draws=10000"], "audit")
        with pytest.raises(UserError, match=r"integration steps .* audit\.box"):
            prepare(AUDIT, study, NOWHERE).plan()


@pytest.mark.slow
def test_the_shipped_study_of_all_laws_is_not_refused_and_one_a_thousand_times_as_large_is() -> None:
    file = CLAIMS.with_name("fair_study.yaml")
    prepare(FAIR_STUDY, load_study([file], ["study.budget=full"], "study"), NOWHERE).plan()
    huge = "study.budgets={full: {candidates: 10000, iterations: 100000, draws: 4}}"
    with pytest.raises(UserError, match=r"integration steps of .* rollouts"):
        prepare(FAIR_STUDY, load_study([file], ["study.budget=full", huge], "study"), NOWHERE).plan()
