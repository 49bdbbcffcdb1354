"""A run carries code: nothing loads it before a person has seen it and agreed."""

from __future__ import annotations

import hashlib
import json
import os
import pty
import py_compile
import shutil
import sys
from pathlib import Path

import pytest

import wristctl as face
from tests.doors.conftest import ROOT, elsewhere, wristctl
from wristctl.errors import UserError
from wristctl.plugins.places import load
from wristctl.plugins.trust import asking
from wristctl.records import Run

HOSTILE = "open({marker!r}, 'a').close()\n"


ONE = "simulate: {controller: strange.py:STRANGE, gains: default, horizon: 0.3, loop: {plant_segments: 1}}\n"
SWEPT = """
sweep: ["simulate.controller= strange.py:STRANGE, 'pid'"]
simulate: {horizon: 0.3, loop: {plant_segments: 1}}
"""


def sealed(stranger: Path, study: str = ONE) -> Run:
    """A run of the stranger's law, by the stranger, whose original is gone."""
    (stranger / "study.yaml").write_text(study)
    with elsewhere(stranger):
        done = face.simulate(face.load_study(stranger / "study.yaml"), out=stranger / "results")
    for name in ("strange.py", "helper.py"):
        (stranger / name).unlink()
    assert done.run is not None
    return Run(done.run.path)


def seal_anew(run: Path) -> None:
    """What whoever means to deceive does: manifest and sums are made to fit what is there."""
    manifest = json.loads((run / "run.json").read_text())
    for name in manifest["code"]["foreign"]:
        manifest["code"]["foreign"][name] = hashlib.sha256((run / name).read_bytes()).hexdigest()
    (run / "run.json").write_text(json.dumps(manifest))
    lines = []
    for line in (run / "SHA256SUMS").read_text().splitlines():
        name = line[66:]
        lines.append(f"{hashlib.sha256((run / name).read_bytes()).hexdigest()}  {name}\n")
    (run / "SHA256SUMS").write_text("".join(lines))


@pytest.mark.parametrize("by", ["its law", "its reference", "its sweep"])
@pytest.mark.slow
def test_nothing_of_a_hostile_run_executes(stranger: Path, by: str) -> None:
    run, marker = sealed(stranger, SWEPT if by == "its sweep" else ONE), stranger / "was here"
    for file in (run.path / "code/strange/helper.py", run.path / "code/strange/strange.py"):
        file.write_text(HOSTILE.format(marker=str(marker)) + file.read_text())
    name, results = run.id, str(run.path.parent)
    again = ("simulate", "--config", f"results/{name}/config.yaml")
    tried: list[tuple[str, ...]] = [("runs", "replay", name), again]
    if by == "its reference":  # kinds of references are read where a study is
        config = run.path / "config.yaml"
        config.write_text(config.read_text().replace("kind: minimum-jerk", 'kind: "code/strange/strange.py:STRANGE"'))
    else:
        tried += [("runs", "verify", name), ("runs", "report", name), ("runs", "show", name)]
        tried += [("check-law", f"{file}:STRANGE")]
        tried += [("simulate", "--controller", f"{results}/{name}/code/strange/strange.py:STRANGE")]
    seal_anew(run.path)
    for arguments in tried:
        done = wristctl(stranger, *arguments)
        assert not marker.exists(), arguments
        refused = arguments[0] != "runs" or arguments[1] == "replay"
        assert done.returncode == (2 if refused else 0), (arguments, done.stderr)
        if refused:
            digest = hashlib.sha256(file.read_bytes()).hexdigest()
            assert digest in done.stderr and "--trust-code" in done.stderr and file.name in done.stderr
    assert [each.name for each in run.path.parent.iterdir() if each.is_dir()] == [name], "and no run looks complete"


@pytest.mark.slow
@pytest.mark.parametrize("sweep", ["3", "[1, 2]", "controller=strange.py:STRANGE", "{a: b}"])
def test_a_run_whose_sweep_is_none_is_refused_and_is_no_bug(stranger: Path, sweep: str) -> None:
    run = sealed(stranger)
    config = run.path / "config.yaml"
    config.write_text(f"sweep: {sweep}\n{config.read_text()}")
    seal_anew(run.path)
    done = wristctl(stranger, "runs", "replay", run.id, "--trust-code")
    assert done.returncode == 2 and "sweep" in done.stderr and "bug" not in done.stderr, done.stderr


@pytest.mark.painted
@pytest.mark.slow
def test_a_sweep_over_a_law_replays_from_its_copy_once_it_is_trusted(stranger: Path) -> None:
    run = sealed(stranger, SWEPT)
    assert set(run.manifest.code.foreign) == {"code/strange/helper.py", "code/strange/strange.py"}
    assert str(stranger) not in (run.path / "config.yaml").read_text() and run.problems() == []
    assert "nobody has said that it may run" in wristctl(stranger, "runs", "replay", run.id).stderr
    done = wristctl(stranger, "runs", "replay", run.id, "--trust-code")
    assert done.returncode == 0 and f"{run.id}: identical" in done.stdout, done.stderr


TRIAL = (
    "--set", "directions=[ulnar]", "--set", "push.force=0", "--set", "horizon=0.5", "--set", "back=0.3",
    "--set", "reference={duration: 0.4, angle_deg: 10.0}",
    "--set", "homing={move: 1.0e-4, rest: 0.15, frames: 2, slack: 5.0e-4, let_go: 1.0}",
)  # fmt: skip


@pytest.mark.slow
def test_a_trial_of_a_law_by_its_place_replays_from_its_copy_once_it_is_trusted(stranger: Path) -> None:
    planned = wristctl(stranger, "hw-run", "--controller", "strange.py:STRANGE", "--dry-run")
    assert planned.returncode == 0 and "gains: default" in planned.stdout
    done = wristctl(stranger, "hw-run", "--controller", "strange.py:STRANGE/rig", *TRIAL)
    assert done.returncode == 0, done.stdout + done.stderr
    (run,) = (stranger / "results").glob("*hw-run*")
    (row,) = face.load_study(run / "config.yaml").hw_run.rows
    assert row.gains == "rig" and "code/strange/strange.py:STRANGE" in row.controller
    assert Run(run).data("trials")["outcome"].tolist() == ["ok"]
    (stranger / "strange.py").unlink()
    done = wristctl(stranger, "runs", "replay", run.name, "--trust-code")
    assert done.returncode == 0 and f"{run.name}: identical" in done.stdout, done.stdout + done.stderr


@pytest.mark.painted
@pytest.mark.slow
def test_a_run_replays_identically_from_its_copy_once_it_is_trusted(stranger: Path) -> None:
    run = sealed(stranger)
    assert set(run.manifest.code.foreign) == {"code/strange/helper.py", "code/strange/strange.py"}
    assert run.problems() == []
    done = wristctl(stranger, "runs", "replay", run.id, "--trust-code")
    assert done.returncode == 0 and f"{run.id}: identical" in done.stdout, done.stderr
    assert run.manifest.code.foreign["code/strange/helper.py"] in done.stderr
    for drawn in (("figures", run.id, "--format", "svg"), ("report", run.id, "--all-figures")):
        done = wristctl(stranger, "runs", *drawn, "--trust-code")
        assert done.returncode == 0, done.stderr
    assert list((stranger / "results").glob("figures-*/*.svg"))


@pytest.mark.slow
def test_on_a_terminal_a_person_is_shown_files_and_hashes_and_asked(stranger: Path) -> None:
    run = sealed(stranger)
    for answer, lets in (("no", False), ("yes", True)):
        pid, terminal = pty.fork()
        if pid == 0:
            os.chdir(stranger)
            own = os.environ | {"PYTHONPATH": str(ROOT)}
            command = [sys.executable, "-P", "-m", "wristctl", "simulate", "--dry-run", "-c", f"{run.path}/config.yaml"]
            os.execve(sys.executable, command, own)
        said, answered = b"", False
        while chunk := _read(terminal):
            said += chunk
            if b"Type yes" in said and not answered:
                os.write(terminal, f"{answer}\n".encode())
                answered = True
        status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        assert answered and run.manifest.code.foreign["code/strange/strange.py"].encode() in said
        assert status == (0 if lets else 2) and (b"one rollout of 0.3 s" in said) == lets


def _read(terminal: int) -> bytes:
    try:
        return os.read(terminal, 4096)
    except OSError:  # its other end is closed
        return b""


@pytest.mark.slow
def test_bytecode_and_libraries_beside_a_law_are_never_looked_at(stranger: Path) -> None:
    """Bytecode that is not checked against its source would run in place of what was shown."""
    run, marker = sealed(stranger), stranger / "was here"
    folder = run.path / "code" / "strange"
    bad = stranger / "bad.py"
    bad.write_text(HOSTILE.format(marker=str(marker)))
    for name in ("helper", "strange"):
        kept = folder / "__pycache__" / f"{name}.{sys.implementation.cache_tag}.pyc"
        kept.parent.mkdir(exist_ok=True)
        mode = py_compile.PycInvalidationMode.UNCHECKED_HASH
        py_compile.compile(str(bad), str(kept), invalidation_mode=mode)
        shutil.copy(kept, folder / f"{name}.pyc")
    with asking(lambda shown: True):
        law, origin = load(f"{folder}/strange.py:STRANGE")
    assert law.name == "strange" and not marker.exists()
    assert {file.name for file in origin.files} == {"strange.py", "helper.py"}


def test_code_that_is_not_as_it_was_sealed_is_refused_even_to_who_trusts_it(stranger: Path) -> None:
    run = sealed(stranger)
    (run.path / "code/strange/helper.py").write_text(HOSTILE.format(marker=str(stranger / "was here")))
    with asking(lambda shown: True), pytest.raises(UserError, match="not as it was sealed"):
        load(f"{run.path}/code/strange/strange.py:STRANGE")
    assert not (stranger / "was here").exists()


@pytest.mark.slow
def test_code_that_changes_after_it_was_shown_is_not_loaded(stranger: Path) -> None:
    run = sealed(stranger)
    helper = run.path / "code/strange/helper.py"

    def swap(shown: str) -> bool:
        helper.write_text(HOSTILE.format(marker=str(stranger / "was here")))
        return True

    with asking(swap), pytest.raises(UserError, match="changed after it was shown"):
        load(f"{run.path}/code/strange/strange.py:STRANGE")
    assert not (stranger / "was here").exists()


@pytest.mark.slow
def test_a_runs_configuration_may_not_name_code_outside_the_run(stranger: Path) -> None:
    run = sealed(stranger)
    (stranger / "other.py").write_text(HOSTILE.format(marker=str(stranger / "was here")))
    config = run.path / "config.yaml"
    config.write_text(config.read_text().replace("code/strange/strange.py", "../../other.py"))
    done = wristctl(stranger, "simulate", "-c", f"results/{run.id}/config.yaml", "--trust-code")
    assert done.returncode == 2 and "outside the run" in done.stderr and not (stranger / "was here").exists()


@pytest.mark.slow
def test_agreeing_to_one_code_is_not_agreeing_to_another(stranger: Path) -> None:
    run, asked = sealed(stranger), []

    def note(shown: str) -> bool:
        asked.append(shown)
        return True

    folder = run.path / "code"
    shutil.copytree(folder / "strange", folder / "same")
    shutil.copytree(folder / "strange", folder / "other")
    (folder / "other" / "helper.py").write_text((folder / "other" / "helper.py").read_text() + "\n")
    (run.path / "SHA256SUMS").unlink()
    with asking(note):
        for each in ("strange", "same", "other"):
            load(f"{folder}/{each}/strange.py:STRANGE")
    assert len(asked) == 2 and "other" in asked[1]
