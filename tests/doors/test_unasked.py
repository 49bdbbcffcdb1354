"""Every command that takes a run, its configuration or its law leaves the law alone until somebody has agreed."""

from __future__ import annotations

import io
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from tests.cli.conftest import Call, call  # noqa: F401
from tests.doors.carrier import CARRIED, LAW_FILE, MARK, carrier
from wristctl.cli.app import typer_of
from wristctl.cli.commands import COMMANDS
from wristctl.records import Run

ROW = {"controller": CARRIED, "gains": "rig"}
CARRIERS: dict[str, dict[str, Any]] = {
    "simulate": {"controller": CARRIED, "gains": "default"},
    "tune": {"controllers": (CARRIED,)},
    "compare": {"rows": (ROW,)},
    "hw-run": {"rows": (ROW,)},
}
"""Where the configuration of each kind of run names its law."""
NO_RUN = {"init", "new"}
"""Commands that take nothing of a run; those of a rig that takes none are known by it."""
PLACES, COUNTS = ("--out", "--file", "--label", "--slurm"), ("--seed", "--segments", "--table", "--last", "--every")


def _leaves(command: Any, name: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    if lazy := getattr(command, "entry", None):
        command = get_command(typer_of(lazy))
    below: Mapping[str, Any] = getattr(command, "commands", {})
    if not below:
        yield name, command
    for word, one in below.items():
        yield from _leaves(one, (*name, word))


def _program() -> dict[tuple[str, ...], list[Any]]:
    """The parameters of every command, by its words."""
    found: dict[tuple[str, ...], list[Any]] = {}
    for name, entry in COMMANDS.items():
        found |= {words: command.params for words, command in _leaves(get_command(typer_of(entry)), (name,))}
    return found


def _options(parameters: list[Any]) -> dict[str, Any]:
    return {each.opts[0]: each for each in parameters if each.param_type_name == "option"}


def _calls(run: Run, kind: str, law: str) -> Iterator[tuple[str, ...]]:
    """What can be said of a run, its configuration and its law, by the table of commands."""
    config, many = str(run.path / "config.yaml"), {"--set": "controller={}", "--sweep": "controller={},pid"}
    for words, parameters in _program().items():
        options = _options(parameters)
        names = {each.name for each in parameters if each.param_type_name == "argument"}
        takes = bool(names & {"ref", "refs", "before", "files", "runs", "video", "law"}) or "--config" in options
        if words[0] in NO_RUN or not takes:
            continue
        first = [law] if "law" in names else [run.id] if names & {"ref", "refs", "before", "runs"} else []
        first += [run.id] * ("after" in names)
        dry = ["--dry-run"] * ("--dry-run" in options)
        if words[0] == "runs" or words == ("export-model",):
            first = [str(run.path), *first[1:]]
            to = {"export": ("mat", "mcap", "lerobot"), "export-model": ("mujoco", "matlab", "urdf")}.get(words[-1], ())
            for form in to or ("",):
                yield (*words, *first, *(["--to", form] if form else ()))
            for flag in ("--all-figures", "--json", "--latex", "--signed"):
                if flag in options:
                    yield (*words, *first, flag)
            if "--set" in options:
                yield (*words, *first, "--set", "horizon=0.1")
            continue
        yield (*words, *first, *dry)
        if "--config" in options:
            yield (*words, *first, "--config", config, *dry)
            yield (*words, *first, "--config", config, *dry, "--json")
        if "files" in names:
            yield (*words, config, *dry)
        for option, parameter in options.items():
            if getattr(parameter, "is_flag", False) or option in (*PLACES, *COUNTS, "--config", "--executor"):
                continue
            for value in (run.id, f"latest:{kind}", many.get(option, "{}").format(law)):
                yield (*words, *first, option, value, *dry)


CASES = [(kind, "whole") for kind in CARRIERS]
CASES += [("simulate", left) for left in ("no manifest", "no manifest, no seal", "its manifest leads nowhere")]


@pytest.mark.parametrize(("kind", "left"), CASES)
@pytest.mark.slow
def test_no_command_imports_the_law_of_a_run_unasked(
    tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch, kind: str, left: str  # noqa: F811
) -> None:  # fmt: skip
    monkeypatch.setattr("sys.stdin", io.StringIO())
    run = carrier(tmp_path, kind, CARRIERS[kind])
    shutil.rmtree(tmp_path / "sources")
    if left != "whole":
        (run.path / "run.json").unlink()
    if "no seal" in left:
        (run.path / "SHA256SUMS").unlink()
    if "nowhere" in left:
        (run.path / "run.json").symlink_to("/nowhere/run.json")
    law, config = f"{run.path / LAW_FILE}:STRANGE", str(run.path / "config.yaml")
    whole = kind == "simulate" and left == "whole"
    calls = [each for each in _calls(run, kind, law) if whole or each[0] in (kind, "runs", "export-model")]
    said = {each: call(*each) for each in (*calls, (kind, config), ("check-law", law))}
    assert not (tmp_path / MARK).exists()
    assert {code for code, _, _ in said.values()} <= {0, 2, 3, 130}, "130: nobody answers whether to delete it"
    assert not [each for each, (_, _, err) in said.items() if "bug in wristctl" in err or "Traceback" in err]
    assert len(said) >= (120 if whole else 30)
    refused = [each for each, (_, _, err) in said.items() if "nobody has said" in err]
    assert (kind, config) in refused and (kind, "--config", config, "--dry-run") in refused
    program = _program()
    for each in refused:
        words = max((words for words in program if each[: len(words)] == words), key=len)
        assert "--trust-code" in _options(program[words]), each
