"""The ways a command ends, and what holds for the options of every command."""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NoReturn

import pytest
from typer.main import get_command

from tests.cli.conftest import Call, Command
from wristctl.cli import app
from wristctl.cli.app import typer_of
from wristctl.cli.commands import CALIBRATIONS, COMMANDS
from wristctl.commands.perform import perform
from wristctl.records import Run


def every_command() -> Iterator[tuple[str, Any]]:
    """Every command and group below `wristctl`, as it is when called."""
    modules = {**COMMANDS, **{f"hw calibrate {name}": entry for name, entry in CALIBRATIONS.items()}}
    waiting = [(name, get_command(typer_of(entry))) for name, entry in modules.items()]
    while waiting:
        name, found = waiting.pop()
        yield name, found
        waiting += [(f"{name} {each}", below) for each, below in getattr(found, "commands", {}).items()]


def test_a_switch_that_is_not_given_is_off() -> None:
    found = [
        (name, each) for name, found in every_command() for each in found.params if getattr(each, "is_flag", False)
    ]
    assert len(found) > 50
    on = [f"{name} --{each.name}" for name, each in found if each.default]
    assert on == []


def test_only_wristctl_itself_installs_completion() -> None:
    assert not [name for name, found in every_command() for each in found.params if "completion" in (each.name or "")]


@pytest.mark.parametrize("group", ["hw", "runs", "hw calibrate"])
def test_a_group_alone_shows_its_help(call: Call, group: str) -> None:
    _, out, err = call(*group.split())
    assert f"Usage: wristctl {group}" in out + err and "Commands" in out + err


@pytest.mark.parametrize(
    ("typed", "where"),
    [
        (["simulate", "--controller", "pdi"], "--controller pdi: simulate.controller"),
        (["simulate", "--reference", "my file.py:R"], "--reference 'my file.py:R': simulate.reference.kind"),
        (["hw-run", "--gains", "hardwrae", "--controller", "pid-ff"], "--gains hardwrae: hw-run.controllers.0.gains"),
        (["simulate", "--sweep", "horizon=1,2", "--sweep", "wrist.lenght=1,2"], "--sweep wrist.lenght=1,2"),
        (["tune", "--set", "controllers=[pdi]"], "--set controllers=[pdi]: tune.controllers.0"),
        (["simulate", "--from-identified", "no-run"], "no-run in"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_as_it_was_typed(call: Call, typed: list[str], where: str) -> None:
    code, _, err = call(*typed)
    assert code == 2 and f" - {where}" in err and '"' not in err.partition(" - fix: ")[0]


def _ends_with(monkeypatch: pytest.MonkeyPatch, act: Callable[[], object]) -> None:
    monkeypatch.setattr(app, "get_command", lambda _: lambda **_given: act())


class _Odd(BaseException):
    """No Exception."""


def _fail(error: BaseException) -> NoReturn:
    raise error


@pytest.mark.parametrize(
    ("act", "code", "said"),
    [
        (lambda: None, 0, ""),
        (lambda: 5, 5, ""),
        (lambda: _fail(KeyboardInterrupt()), 130, ""),
        (lambda: _fail(_Odd("x")), 1, "error: bug in wristctl: _Odd: x"),
        (lambda: _fail(ZeroDivisionError("by\nhand")), 1, "error: bug in wristctl: ZeroDivisionError: by hand"),
    ],
)
def test_a_command_ends_with_a_code_and_one_line(
    call: Call, monkeypatch: pytest.MonkeyPatch, act: Callable[[], object], code: int, said: str
) -> None:
    _ends_with(monkeypatch, act)
    ended, out, err = call()
    assert (ended, out) == (code, "") and err.startswith(said) and len(err.splitlines()) == bool(said)


def test_what_fails_after_an_interruption_is_an_interruption(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted() -> None:
        try:
            os.kill(os.getpid(), signal.SIGINT)
            signal.pause()
        except KeyboardInterrupt:
            raise RuntimeError("a library's own word for it") from None

    _ends_with(monkeypatch, interrupted)
    assert call() == (130, "", "")


def test_an_interruption_that_a_destructor_swallows_comes_again(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "unraisablehook", sys.__unraisablehook__)

    class Last:
        def __del__(self) -> None:
            os.kill(os.getpid(), signal.SIGINT)

    def interrupted() -> None:
        Last()
        until = time.monotonic() + 30.0
        while time.monotonic() < until:
            time.sleep(0.001)

    _ends_with(monkeypatch, interrupted)
    began = time.monotonic()
    assert call() == (130, "", "") and time.monotonic() - began < 20.0


def test_whatever_else_a_destructor_swallows_is_told(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[Any] = []
    monkeypatch.setattr(sys, "unraisablehook", None)
    monkeypatch.setattr(sys, "__unraisablehook__", told.append)
    call("--version")
    sys.unraisablehook(SimpleNamespace(exc_type=ValueError))
    assert [each.exc_type for each in told] == [ValueError]


@pytest.mark.parametrize(
    ("files", "label"),
    [((), ""), (("a b.yaml",), "a-b"), (("x.yaml", "y.yaml", "z.yaml"), "z"), ((f"{70 * 'n'}.yaml",), 60 * "n")],
)
def test_a_run_is_labelled_by_the_last_study_file(
    probe: Command, tmp_path: Path, files: tuple[str, ...], label: str
) -> None:
    for file in files:
        (tmp_path / file).write_text("seed: 1\n")
    manifest = Run(tmp_path / probe("gen-data", *files).stdout.splitlines()[-1]).manifest
    assert manifest.label == label and manifest.argv == ["wristctl", "gen-data", *files]


def test_quiet_and_verbose_reach_the_messages_and_the_operator(probe: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Any] = []

    def watched(prepared: Any, run: Any, show: Any, operator: Any, *others: Any) -> Any:
        seen.append((operator.quiet, operator.flags, operator.console.stderr))
        return perform(prepared, run, show, operator, *others)

    monkeypatch.setattr("wristctl.commands.perform.perform", watched)
    assert "sampling" in probe("gen-data", "-v").stderr and probe("gen-data", "-q").stderr == ""
    assert seen == [(False, frozenset(), True), (True, frozenset(), True)]


def test_a_result_for_programs_says_which_run_it_is(probe: Command, tmp_path: Path) -> None:
    told = json.loads(probe("gen-data", "--json").stdout)
    run = Run(tmp_path / told["run"])
    assert (told["schema"], told["kind"], told["id"], told["state"]) == ("wristctl.result/1", "gen-data", run.id, "ok")
    plan = json.loads(probe("gen-data", "--dry-run", "--json", "--set", "samples=77").stdout)
    assert (plan["schema"], plan["kind"], plan["plan"]) == ("wristctl.plan/1", "gen-data", "77 samples")
