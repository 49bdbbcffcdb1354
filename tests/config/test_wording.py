"""An error says what to give in the words of whoever made it: options on the command line, arguments in Python."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

from wristctl.errors import Argument, Call, Phrase, Setting, UserError, under
from wristctl.study_files.error_messages import located
from wristctl.study_files.load import load_study, read_study

PHRASES: list[tuple[Phrase, str, str]] = [
    (Argument("network"), "--network RUN", "network=..."),
    (Argument("from_identified", "latest:identify"), "--from-identified latest:identify",
     "from_identified='latest:identify'"),
    (Argument("out", metavar=""), "--out", "out=..."),
    (Argument("where", "rmse<1", quoted=True), "--where 'rmse<1'", "where='rmse<1'"),
    (Argument("label", ""), "--label", "label=''"),
    (Argument("runs", "latest:hw-run", positional=True), "latest:hw-run", "runs='latest:hw-run'"),
    (Setting("wrist.length=0.09"), "--set wrist.length=0.09", "load_study(..., 'wrist.length=0.09')"),
    (Setting("of=loop", "analyse", option="--of loop"), "--of loop", "load_study(..., 'analyse.of=loop')"),
    (Call("train"), "wristctl train", "wristctl.train(study)"),
    (Call("gen-data", arguments=(Argument("run", "latest:simulate"),)), "wristctl gen-data --run latest:simulate",
     "wristctl.gen_data(study, run='latest:simulate')"),
    (Call("paper audit", "experiments/claims.yaml"), "wristctl paper audit experiments/claims.yaml",
     "wristctl.audit(load_study('experiments/claims.yaml'))"),
    (Call("runs ls"), "wristctl runs ls", "wristctl.runs()"),
    (Call("hw calibrate camera"), "wristctl hw calibrate camera", "wristctl hw calibrate camera"),
    (("give ", Argument("table1", metavar=""), " a run of `", Call("train"), "`"),
     "give --table1 a run of `wristctl train`", "give table1=... a run of `wristctl.train(study)`"),
]  # fmt: skip


@pytest.mark.parametrize(("phrase", "typed", "in_python"), PHRASES)
def test_every_part_has_words_for_the_command_line_and_for_python(phrase: Phrase, typed: str, in_python: str) -> None:
    error = UserError("it is missing", "reference.inverse", phrase)
    assert str(error) == f"it is missing - reference.inverse - fix: {typed}"
    error.in_python = True
    assert str(error) == f"it is missing - reference.inverse - fix: {in_python}" and error.fix == in_python


def test_of_a_key_that_nobody_gave_no_other_override_is_the_place_and_a_file_is() -> None:
    error = UserError("no taper", "hw-run.wrist.taper")
    assert located(error, read_study([], ["hw-run.directions=[ulnar]"])[1]).where == "hw-run.wrist.taper"
    given = UserError("no such side", "hw-run.directions.0")
    assert located(given, {("hw-run",): "a.yaml:1"}).where == "a.yaml:1: hw-run.directions.0"


def test_an_error_that_learns_its_place_keeps_what_to_give() -> None:
    with pytest.raises(UserError) as caught, under("simulate"):
        raise UserError("no tuned gains", "gains", (Argument("tuned"), ", a tune run"), exit_code=3)
    error = located(caught.value, read_study([], ["simulate.gains=tuned"])[1])
    assert str(error) == ("no tuned gains - --set simulate.gains=tuned: simulate.gains - fix: --tuned RUN, a tune run")
    error.in_python = True
    assert error.where == "load_study(..., 'simulate.gains=tuned'): simulate.gains" and error.exit_code == 3
    assert error.fix == "tuned=..., a tune run"


def test_an_error_goes_through_processes_with_its_parts() -> None:
    again = pickle.loads(pickle.dumps(UserError("a", "b", ("give ", Argument("network")), 4)))
    again.in_python = True
    assert (str(again), again.exit_code) == ("a - b - fix: give network=...", 4)


@pytest.mark.parametrize("override", ["wrist.mass=-1", "wrst.mass=1", "wrist.mass", "wrist.mass={:"])
def test_a_wrong_override_is_named_as_the_command_line_or_as_python_has_it(override: str, tmp_path: Path) -> None:
    with pytest.raises(UserError) as caught:
        read_study([], [override])
    assert f"--set {override}" in caught.value.where
    caught.value.in_python = True
    assert f"load_study(..., '{override}')" in caught.value.where and "--set" not in str(caught.value)


def test_a_file_is_named_with_its_line_in_both(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_text("wrist:\n  mass: -1\n")
    with pytest.raises(UserError) as caught:
        load_study([file])
    before = str(caught.value)
    caught.value.in_python = True
    assert str(caught.value) == before and f"{file}:2: wrist.mass" in before
