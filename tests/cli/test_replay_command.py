"""What `wristctl runs replay` calls, says, keeps and ends with, the repetition itself aside."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.cli.conftest import Call
from wristctl.config.study import Study
from wristctl.processes import end_with_parent
from wristctl.records import InputRun, Run, start_run


def _made(kind: str, value: str = "1", out: Path = Path("results"), inputs: tuple[InputRun, ...] = ()) -> Run:
    with start_run(kind, Study(), "", out, inputs=inputs) as live:
        live.file("data/a.json").write_text('{"x": 1.0}')
        live.file("data/b.json").write_text(f'{{"x": {value}}}')
        live.file("timing.json").write_text("{}")
    return Run(live.path)


@pytest.fixture
def again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., list[list[str]]]:
    """The repetition ends with this code and finds this value, or leaves no run; gives what was called."""

    def prepared(value: str | None = "1", code: int = 0) -> list[list[str]]:
        called: list[list[str]] = []

        def run(command: list[str], **given: Any) -> SimpleNamespace:
            assert given.pop("env") == {**os.environ, "WRISTCTL_NO_HARDWARE": "yes"}
            assert given == {"stdout": subprocess.DEVNULL, "preexec_fn": end_with_parent}
            called.append(command)
            if value is not None:
                _made("train", value, Path(command[command.index("--out") + 1]))
            return SimpleNamespace(returncode=code)

        monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
        monkeypatch.setattr(
            "wristctl.cli.runs.verification.subprocess", SimpleNamespace(run=run, DEVNULL=subprocess.DEVNULL)
        )
        return called

    return prepared


def test_the_command_is_called_with_its_configuration_inputs_and_changes(call: Call, again: Any) -> None:
    data = _made("gen-data")
    run = _made("train", inputs=(InputRun("data", data),))
    called = again()
    call("runs", "replay", run.id, "--set", "epochs=3")
    (command,) = called
    scratch = Path(command[command.index("--out") + 1])
    assert command == [
        sys.executable, "-P", "-m", "wristctl", "train", "--config", str(run.path / "config.yaml"),
        "--out", str(scratch),
        "--set", f'train.data="{data.path}"', "--set", "epochs=3", "--label", "replay",
    ]  # fmt: skip


def test_inputs_are_named_where_the_command_finds_them(call: Call, again: Any) -> None:
    """Several by one leaf, and those of a command that works on another's section."""
    tuned, rigs = _made("tune"), [_made("hw-run"), _made("hw-run")]
    many = _made("identify", inputs=tuple(InputRun(f"runs[{at}]", run) for at, run in enumerate(rigs)))
    looped = _made("analyse", inputs=(InputRun("tuned", tuned),))
    called = again()
    for run in (many, looped):
        call("runs", "replay", run.id)
    named = [command[command.index("--set") + 1] for command in called]
    paths = json.dumps([str(run.path) for run in rigs])
    assert named == [f"identify.runs={paths}", f'simulate.tuned="{tuned.path}"']


def test_the_same_files_are_identical_and_nothing_is_kept(call: Call, again: Any) -> None:
    run = _made("train")
    called = again()
    code, out, err = call("runs", "replay", run.id)
    assert (code, err) == (0, "") and out.splitlines()[-1] == f"{run.id}: identical"
    assert [line.split()[:2] for line in out.splitlines()[2:5]] == [
        ["data/a.json", "identical"],
        ["data/b.json", "identical"],
        ["timing.json", "volatile"],
    ]
    assert not Path(called[0][called[0].index("--out") + 1]).exists()


def test_numbers_within_tolerance_are_no_difference_but_not_identical(call: Call, again: Any) -> None:
    run = _made("train")
    again("1.0000000001")
    code, out, _ = call("runs", "replay", run.id)
    assert code == 0 and out.splitlines()[-1] == f"{run.id}: the same within tolerance"
    told = json.loads(call("runs", "replay", run.id, "--json")[1])
    assert (told["schema"], told["run"], told["same"]) == ("wristctl.replay/1", run.id, True)
    assert (told["causes"], told["scratch"]) == ([], None)
    assert [each["verdict"] for each in told["files"]] == ["identical", "within tolerance", "volatile"]


def test_a_difference_has_a_cause_and_the_repetition_is_kept(call: Call, again: Any) -> None:
    run = _made("train")
    called = again("2")
    code, out, err = call("runs", "replay", run.id)
    scratch = Path(called[0][called[0].index("--out") + 1])
    assert code == 3 and "the repetition differs" in err and f"the repetition is in {scratch}" in err
    assert scratch.is_dir() and "cause: nondeterminism" in out.splitlines()[-1]
    code, out, _ = call("runs", "replay", run.id, "--json")
    told = json.loads(out)
    assert code == 3 and not told["same"] and Path(told["scratch"]).is_dir() and len(told["causes"]) == 1


@pytest.mark.parametrize(("value", "ended"), [("1", 4), (None, 4), (None, 0)])
def test_a_repetition_that_fails_or_leaves_no_run_is_none(
    call: Call, again: Any, value: str | None, ended: int
) -> None:
    run = _made("train")
    again(value, ended)
    code, out, err = call("runs", "replay", run.id)
    assert code == 3 and "the run was not repeated" in err
    first, *causes = out.splitlines()
    assert first.startswith(f"cause: the repetition ended with exit code {ended} (") and len(causes) == bool(value)


def test_an_input_that_is_gone_is_told_and_nothing_is_run(call: Call, again: Any) -> None:
    data = _made("gen-data")
    run = _made("train", inputs=(InputRun("data", data),))
    data.path.rename(data.path.with_name("other"))
    called = again()
    code, out, err = call("runs", "replay", run.id, "--json")
    told = json.loads(out)
    assert code == 3 and "mend the input" in err and called == []
    assert told["files"] == [] and told["scratch"] is None and told["causes"][0].startswith("input: data: ")


@pytest.mark.parametrize("kind", ["hw-run", "calibrate-wrist"])
@pytest.mark.slow
def test_a_repetition_never_moves_real_motors(call: Call, again: Any, kind: str) -> None:
    """Neither that of a run on hardware, nor that of an emulated one with a port put in."""
    section = kind.replace("-", "_")
    settings = getattr(Study(), section).model_copy(update={"port": "/dev/ttyACM0"})
    with start_run(kind, Study().model_copy(update={section: settings}), "", Path("results")) as live:
        live.file("data/a.json").write_text("{}")
    called = again()
    code, _, err = call("runs", "replay", live.path.name)
    assert code == 3 and "never moves real motors" in err and "wristctl runs report" in err and not called
    emulated = _made(kind)
    for port in ("port=/dev/ttyACM0", f"{kind}.port=/dev/ttyACM0", f"{kind}={{port: /dev/ttyACM0}}"):
        code, _, err = call("runs", "replay", emulated.id, "--set", port)
        assert code == 3 and "never moves real motors" in err and not called
