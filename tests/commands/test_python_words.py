"""In Python an error says what to pass and what to call, and nothing that only a shell understands."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import pytest

import wristctl
from wristctl.commands.gen_data.command import GEN_DATA
from wristctl.commands.perform import carry_out, in_python
from wristctl.commands.session import Session
from wristctl.errors import Argument, Call, UserError

study, STEP = wristctl.load_study, "reference: {kind: step, angle_deg: 5.0, inverse: network}"
CLAIM = "audit.claims=[{id: A, says: A, evidence: table1, value: 1.0, metric: r3}]"

Wrong = Callable[[], Any]
WRONG: list[tuple[Wrong, str]] = [
    (lambda: wristctl.simulate(study(None, "simulate.gains=tuned")), "fix: tuned=..., a tune run that tuned smc"),
    (lambda: wristctl.simulate(study(None, f"simulate={{{STEP}}}")), "fix: network=..."),
    (lambda: wristctl.tune(study(None, f"tune.scenarios=[{{{STEP}}}]")), "fix: network=..."),
    (lambda: wristctl.compare(study(None, "compare.inverses=[network]")), "fix: network=..."),
    (lambda: wristctl.gen_data(study(None, "gen-data.source=run")),
     "fix: wristctl.gen_data(study, run='latest:simulate')"),
    (lambda: wristctl.gen_data(study(), run=quick()), "fix: load_study(..., 'gen-data.source=run')"),
    (lambda: wristctl.identify(study()), "fix: runs='latest:hw-run', or the path or id of a hw-run run"),
    (lambda: wristctl.audit(study()), "fix: wristctl.audit(load_study('experiments/claims.yaml'))"),
    (lambda: wristctl.audit(study(None, CLAIM), table1=trained()),
     "fix: give table1=... a run of `wristctl.train(load_study('experiments/table1.yaml'))`"),
    (lambda: wristctl.audit(study(None, CLAIM), table1=trained(), out="here"), "fix: give table1=... a run"),
    (lambda: wristctl.train(study(), data=trained()),
     "a train result where a gen-data run is needed - data - fix: for example data='latest:gen-data'"),
    (lambda: wristctl.simulate(study(), network=trained(), out="here"),
     "this is in memory only - network - fix: write it too: wristctl.train(study, out=...)"),
    (lambda: wristctl.simulate(study(), network="latest:train"), "fix: run `wristctl.train(study, out=...)` first"),
    (lambda: wristctl.simulate(study(), tuned="latest:tune"), "fix: run `wristctl.tune(study, out=...)` first"),
    (lambda: wristctl.compare("pid-ff"), "fix: pid-ff is a controller: compare(controllers=['pid-ff'])"),
    (lambda: wristctl.simulate("pid-ff"), "fix: pid-ff is a controller: simulate(controller='pid-ff')"),
    (lambda: wristctl.identify("nofile.csv"), "cannot read the log: No such file or directory - nofile.csv"),
    (lambda: wristctl.identify("latest:hw-run"), "no hw-run run that ended ok - latest:hw-run in results"),
    (lambda: wristctl.identify("nofile.yaml"), "there is no study file"),
    (lambda: wristctl.simulate(study(), network="2026"), "fix: name a path, or the results folder with out=..."),
    (lambda: wristctl.simulate(study(), label="a/b", out="here"), "label='a/b' - fix: shorten or respell it"),
    (lambda: wristctl.simulate(study(), out="/dev/null/x"), "fix: choose a folder you can write to with out=..."),
    (lambda: wristctl.open_run("no/where"), "fix: name a run that `wristctl.runs()` shows"),
    (lambda: wristctl.runs("rmse<"), "where='rmse<' - fix: for example where='rmse<0.5deg'"),
    (lambda: wristctl.runs(newer="2x"), "not an age - newer='2x'"),
    (lambda: wristctl.load_study(None, "wrist.lenght=1"), "load_study(..., 'wrist.lenght=1')"),
    (lambda: wristctl.load_study(None, "length"), "fix: for example load_study(..., 'wrist.length=0.09')"),
]  # fmt: skip


def quick() -> Any:
    """A closed loop in memory."""
    return wristctl.simulate(study(None, "simulate={horizon: 0.05, loop: {plant_segments: 1}}"))


def trained() -> Any:
    """A network in memory."""
    return wristctl.train(study(None, "gen-data.samples=30", "train={hidden: [2], epochs: 1, workers: 1}"))


@pytest.mark.parametrize(("wrong", "words"), WRONG)
def test_what_is_wrong_is_said_in_pythons_words(
    wrong: Wrong, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError) as caught:
        wrong()
    said = str(caught.value)
    assert words in said and not re.search(r"(^|[\s`'(])--\w|wristctl [a-z]", said)
    assert not list(tmp_path.iterdir()), "what can be known before leaves nothing"


def test_what_an_error_calls_is_there_to_be_called() -> None:
    commands = (
        "gen-data",
        "train",
        "tune",
        "compare",
        "simulate",
        "analyse",
        "identify",
        "paper audit",
        "runs ls",
    )
    for call in (Call(command).in_python for command in commands):
        found = re.fullmatch(r"wristctl\.(\w+)\((study)?\)", call)
        assert found is not None and found[1] in dir(wristctl) and callable(getattr(wristctl, found[1]))


def test_an_error_from_a_run_directory_keeps_the_command_lines_words_in_its_manifest(tmp_path: Path) -> None:
    """The directory is for those who repeat it at the shell."""

    def fails(_: Session) -> NoReturn:
        raise UserError("a network is missing", "compare", Argument("network"))

    with pytest.raises(UserError) as caught, in_python():
        carry_out(replace(GEN_DATA, perform=fails), study(), {}, tmp_path, "", None)
    (run,) = tmp_path.iterdir()
    error = wristctl.open_run(run).manifest.error
    assert caught.value.fix == Argument("network").in_python and error is not None
    assert error.fix == Argument("network").typed


def test_a_metric_that_no_run_has_is_named_as_the_argument_it_was(tmp_path: Path) -> None:
    wristctl.gen_data(study(None, "gen-data.samples=20"), out=tmp_path)
    with pytest.raises(UserError) as caught:
        wristctl.runs(sort="sampels", out=tmp_path)
    assert str(caught.value) == "no run has a metric 'sampels' - sort='sampels' - fix: did you mean 'samples'?"
