"""With --json a command that fails prints one object: what is wrong, where, how to mend it. All else is as without."""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import pytest

from tests.cli.conftest import ROOT, Call, Command
from tests.cli.test_app import every_command
from tests.doors.carrier import CARRIED, carrier
from wristctl.__main__ import _INTERRUPTED
from wristctl.cli import app
from wristctl.commands.gen_data.command import GEN_DATA
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import list_runs, start_run

KEYS = {"schema", "kind", "exit_code", "what", "where", "fix"}

WRONG: dict[str, tuple[tuple[str, ...], str, str]] = {
    "option": (("simulate", "--nonsense"), "No such option: --nonsense", "wristctl simulate"),
    "option of a verb": (("runs", "ls", "--nonsense"), "No such option: --nonsense", "wristctl runs ls"),
    "option of the program": (("--nonsense",), "No such option: --nonsense", "wristctl"),
    "command": (("simulat",), "No such command 'simulat'", "wristctl"),
    "verb": (("runs", "lss"), "No such command 'lss'", "wristctl runs"),
    "no argument": (("runs", "show"), "Missing argument 'RUN'", "wristctl runs show"),
    "type of a value": (("simulate", "--seed", "x"), "Invalid value for '--seed'", "wristctl simulate"),
    "value": (("simulate", "--set", "wrist.length=95"), "95 m is 1,188 times the usual", "wrist.length"),
    "key": (("compare", "--set", "nonsense=1"), "unknown key 'nonsense'", "nonsense=1"),
    "file": (("tune", "none.yaml"), "none.yaml", "none.yaml"),
    "run": (("runs", "diff", "none", "none"), "no such run", "none"),
    "controller": (("check-controller", "none.py:LAW"), "no file ", "none.py"),
}
"""Arguments, a part of what is wrong, and a part of where."""


def _one_object(out: str) -> dict[str, Any]:
    shown = json.loads(out)
    assert isinstance(shown, dict)
    return shown


def _is_error(shown: dict[str, Any], kind: str, code: int) -> None:
    assert set(shown) == KEYS and shown["schema"] == "wristctl.error/1"
    assert (shown["kind"], shown["exit_code"]) == (kind, code)


@pytest.mark.parametrize("wrong", WRONG)
def test_what_is_wrong_where_and_how_to_mend_it(call: Call, wrong: str) -> None:
    typed, what, where = WRONG[wrong]
    code, out, err = call(*typed)
    assert code == 2 and out == "" and err.startswith("error: ")
    again, out, err_again = call(*typed, "--json")
    assert (again, err_again) == (code, err), "what people read, and the exit code, are the same"
    shown = _one_object(out)
    _is_error(shown, "usage", 2)
    assert what in shown["what"] and where in shown["where"] and len(shown["fix"]) > 5
    assert shown["what"] in err and shown["fix"] in err


def test_every_command_with_json_shows_a_wrong_option_so(call: Call) -> None:
    with_json = [
        name for name, found in every_command() if "--json" in {word for one in found.params for word in one.opts}
    ]
    assert len(with_json) > 25
    for name in with_json:
        code, out, _ = call(*name.split(), "--json", "--nonsense")
        _is_error(shown := _one_object(out), "usage", 2)
        assert code == 2 and "--nonsense" in shown["what"] and name.split()[-1] in shown["where"]


@pytest.mark.parametrize(
    ("act", "kind", "code"), [("check", "check", 3), ("bug", "bug", 1), ("fault", "", 3)], ids=["check", "bug", "fault"]
)
def test_a_run_that_fails(probe: Command, act: str, kind: str, code: int) -> None:
    plain, told = probe("gen-data", action=act), probe("gen-data", "--json", action=act)
    assert plain.returncode == told.returncode == code
    shown = _one_object(told.stdout)
    if act == "fault":  # a result all the same
        assert shown["schema"] == "wristctl.result/1" and shown["metrics"]["rmse"]["value"] == 1e-3
        assert shown["error"] == {
            "kind": "check", "exit_code": 3, "what": "the wrist buckled", "where": "here", "fix": "less load",
        }  # fmt: skip
        assert plain.stdout and told.stderr == plain.stderr
        return
    _is_error(shown, kind, code)
    assert plain.stdout == "" and shown["what"] in told.stderr
    if act == "bug":
        assert shown["what"] == "bug in wristctl: ZeroDivisionError: of this probe"
        assert "probe.py:" in shown["where"] and "the traceback is in" in shown["fix"]
    else:
        assert (shown["what"], shown["where"], shown["fix"]) == ("the check failed", "here", "mend it")


@pytest.mark.parametrize(("code", "kind"), [(4, "hardware"), (5, "safety-stop")])
def test_what_a_rig_refuses(call: Call, monkeypatch: pytest.MonkeyPatch, code: int, kind: str) -> None:
    def stopped(**_: object) -> None:
        raise UserError("axis 2\x1b slipped", "trial 3", "look at it", code)

    monkeypatch.setattr(app, "get_command", lambda _: stopped)
    ended, out, err = call("hw-run", "--json")
    _is_error(shown := _one_object(out), kind, code)
    assert ended == code and shown["what"] == "axis 2\x1b slipped" and "\x1b" not in out + err


def test_code_that_nobody_trusts(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO())
    monkeypatch.delenv("WRISTCTL_TRUSTED_CODE", raising=False)
    run = carrier(tmp_path, "simulate", {"controller": CARRIED, "gains": "default"})
    for typed in (("simulate", "-c", f"{run.path}/config.yaml", "--dry-run"), ("runs", "replay", run.id)):
        code, out, _ = call(*typed, "--json")
        _is_error(shown := _one_object(out), "usage", 2)
        assert code == 2 and "nobody has said" in shown["what"] and "--trust-code" in shown["fix"]
        assert "strange.py" in shown["where"]


def test_a_verdict_has_its_error_in_it(call: Call, tmp_path: Path) -> None:
    with start_run("tune", Study(), "", tmp_path / "results") as live:
        live.metric("rmse", 1.0)
    (live.path / "metrics.json").write_text("{}")
    plain = call("runs", "verify")
    code, out, err = call("runs", "verify", "--json")
    shown = _one_object(out)
    assert code == plain[0] == 3 and err == plain[2]
    assert shown["schema"] == "wristctl.verify/1" and shown["runs"][live.id][0]["file"] == "metrics.json"
    assert shown["error"]["kind"] == "check" and "not as they were sealed" in shown["error"]["what"]
    assert "metrics.json" in plain[1]


@pytest.mark.slow
def test_an_interrupted_run(begin: Callable[..., subprocess.Popen[bytes]], tmp_path: Path) -> None:
    child = begin("gen-data", "--json", stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert child.stdout and child.stdout.readline() == b"ready\n", "in the middle of its work"
    child.send_signal(signal.SIGINT)
    out, err = child.communicate(timeout=60)
    (run,) = list_runs(tmp_path / "results")
    _is_error(shown := _one_object(out.decode()), "interrupted", 130)
    assert child.returncode == 130 and shown["where"] == f"results/{run.id}" and run.state == "interrupted"
    assert shown["fix"] == f"what was found: wristctl runs show results/{run.id}" and shown["fix"] in err.decode()


@pytest.mark.parametrize("some", [False, True])
def test_an_interrupted_command_says_whether_anything_was_found(
    call: Call, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, some: bool
) -> None:
    def interrupted(session: Session) -> NoReturn:
        if some:
            session.findings.metric("rmse", 1.0)
        session.findings.keep_overview()
        raise KeyboardInterrupt

    monkeypatch.setattr("wristctl.commands.gen_data.command.GEN_DATA", replace(GEN_DATA, perform=interrupted))
    code, out, _ = call("gen-data", "--json")
    (run,) = list_runs(tmp_path / "results")
    fix = _one_object(out)["fix"]
    assert code == 130 and (f"wristctl runs show results/{run.id}" in fix) == some
    assert ("nothing was found" in fix and f"wristctl runs rm results/{run.id}" in fix) != some


def test_an_interrupted_verb(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("wristctl.cli.runs.listing.entries", interrupted)
    code, out, err = call("runs", "ls", "--json")
    _is_error(shown := _one_object(out), "interrupted", 130)
    assert (code, err) == (130, "") and json.loads(_INTERRUPTED) == shown
    assert call("runs", "ls") == (130, "", "")


EARLY = """
import os, runpy, signal, sys
class Early:
    def find_spec(self, name, *_):
        if name == "wristctl.cli.app":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Early())
sys.argv = ["wristctl", *sys.argv[1:]]
runpy.run_module("wristctl", run_name="__main__")
"""


@pytest.mark.parametrize("told", [(), ("--json",)])
def test_interrupted_before_it_could_begin(tmp_path: Path, told: tuple[str, ...]) -> None:
    done = _process(tmp_path, "-c", EARLY, "runs", "ls", *told)
    assert done.returncode == 130 and done.stderr == b""
    assert json.loads(done.stdout)["kind"] == "interrupted" if told else done.stdout == b""


def _process(folder: Path, *typed: str, **streams: Any) -> subprocess.CompletedProcess[bytes]:
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | streams
    return subprocess.run([sys.executable, "-P", *typed], cwd=folder, env=environment, **pipes)


@pytest.mark.slow
def test_processes_end_as_they_do_without(tmp_path: Path) -> None:
    for typed, what, _ in (WRONG[name] for name in ("option", "command", "value", "file")):
        plain = _process(tmp_path, "-m", "wristctl", *typed)
        told = _process(tmp_path, "-m", "wristctl", *typed, "--json")
        assert plain.returncode == told.returncode == 2 and plain.stderr == told.stderr and plain.stdout == b""
        assert what in json.loads(told.stdout)["what"]


@pytest.mark.slow
@pytest.mark.parametrize("stdout", ["full", "closed", "left"])
def test_nobody_who_could_read_the_object_changes_nothing(tmp_path: Path, stdout: str) -> None:
    plain = _process(tmp_path, "-m", "wristctl", "simulat")
    if stdout == "full":
        with open("/dev/full", "wb") as full:
            told = _process(tmp_path, "-m", "wristctl", "simulat", "--json", stdout=full)
    elif stdout == "closed":
        told = _process(tmp_path, "-m", "wristctl", "simulat", "--json", preexec_fn=lambda: os.close(1))
    else:
        reading, writing = os.pipe()
        os.close(reading)
        told = _process(tmp_path, "-m", "wristctl", "simulat", "--json", stdout=writing)
        os.close(writing)
    assert (told.returncode, told.stderr) == (plain.returncode, plain.stderr) == (2, plain.stderr)
