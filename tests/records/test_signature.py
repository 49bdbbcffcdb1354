"""A signature tells who vouched for a run, and does not survive a change, another key or another purpose."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from wristctl.cli.app import main
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import Run, start_run
from wristctl.records.manifest import SIGNATURE
from wristctl.records.seal import write_seal
from wristctl.records.signature import sign, signature

Make = Callable[..., Run]
Call = Callable[..., tuple[object, str]]
pytestmark = pytest.mark.skipif(shutil.which("ssh-keygen") is None, reason="needs OpenSSH")


@pytest.fixture
def keys(tmp_path: Path) -> dict[str, Path]:
    """Two keys, and a file of allowed signers that knows the first."""
    made = {}
    for name in ("ada", "eve"):
        made[name] = tmp_path / name
        subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(made[name])], check=True)
    made["signers"] = tmp_path / "signers"
    public = (tmp_path / "ada.pub").read_text().split()[:2]
    made["signers"].write_text(f"ada@example.org {' '.join(public)}\n")
    return made


@pytest.fixture
def call(results: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Call:
    """Runs `wristctl runs ...` in the results folder: exit code, all that was said."""

    def run(*arguments: str) -> tuple[object, str]:
        monkeypatch.setattr(sys, "argv", ["wristctl", "runs", *arguments, "--out", str(results)])
        with pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code, "".join(capsys.readouterr())

    return run


def test_who_signed_a_run_is_told_and_the_run_is_as_it_was_sealed(make: Make, keys: dict[str, Path]) -> None:
    run = make()
    assert sign(run, keys["ada"]).key.startswith("SHA256:")
    assert run.problems() == []
    found = signature(run, keys["signers"])
    assert (found.signer, found.fault) == ("ada@example.org", "")
    assert signature(run, None).signer == ""


def test_a_run_that_was_changed_and_sealed_anew_is_no_longer_signed(make: Make, keys: dict[str, Path]) -> None:
    run = make()
    sign(run, keys["ada"])
    (run.path / "config.yaml").write_text("seed: 3\n")
    with pytest.raises(UserError, match="hash does not match"):
        sign(run, keys["ada"])
    write_seal(run.path, {})
    assert run.problems() == [], "the seal alone cannot tell"
    assert "not of this SHA256SUMS" in signature(run, keys["signers"]).fault


def test_the_signature_of_a_stranger_or_for_another_purpose_does_not_count(make: Make, keys: dict[str, Path]) -> None:
    run = make()
    sign(run, keys["eve"])
    assert "is nobody's in" in signature(run, keys["signers"]).fault
    (run.path / SIGNATURE).unlink()
    other = ["ssh-keygen", "-Y", "sign", "-q", "-f", str(keys["ada"]), "-n", "file", str(run.path / "SHA256SUMS")]
    subprocess.run(other, check=True)
    assert signature(run, keys["signers"]).fault


def test_what_cannot_be_signed_or_checked_says_why(make: Make, keys: dict[str, Path], tmp_path: Path) -> None:
    run = make()
    with pytest.raises(UserError, match="not signed"):
        signature(run, None)
    with pytest.raises(UserError, match="cannot sign"):
        sign(run, tmp_path / "absent")
    sign(run, keys["ada"])
    with pytest.raises(UserError, match="No such file"):
        signature(run, tmp_path / "absent")
    (run.path / SIGNATURE).write_text("scribbled")
    assert signature(run, keys["signers"]).fault


def test_the_commands_say_so(make: Make, keys: dict[str, Path], call: Call) -> None:
    signed, bare = make(), make("tune")
    assert call("sign", signed.id, "--key", str(keys["ada"]))[0] == 0
    code, said = call("verify", signed.id, "--signers", str(keys["signers"]))
    assert code == 0 and "as sealed, signed by ada@example.org with SHA256:" in said
    code, said = call("verify", "--signed")
    name = f"{bare.id:{max(len(signed.id), len(bare.id))}}"
    assert code == 3 and f"{name}  as sealed, but nobody vouches for it\n  SHA256SUMS.sig: run is not signed" in said
    assert call("verify")[0] == 0
    assert call("verify", "--signers", "absent")[0] == 2


@contextmanager
def lock_held(run: Path, text: str) -> Iterator[None]:
    """Somebody has the lock of a run, as anybody who may write there can."""
    descriptor = os.open(run / ".lock", os.O_CREAT | os.O_RDWR)
    try:
        os.write(descriptor, text.encode())
        if not text:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)
        (run / ".lock").unlink()


@pytest.mark.parametrize("text", ["", "another-machine 0-boot 12 34\n"], ids=["held", "another machine's, no locks"])
@pytest.mark.slow
def test_a_lock_hides_nothing_of_a_sealed_run(
    make: Make, keys: dict[str, Path], call: Call, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    honest, bad = make(), make("tune")
    for run in (honest, bad):
        sign(run, keys["ada"])
    (bad.path / "config.yaml").write_text("seed: 3\n")
    if text:  # a file system without locks
        monkeypatch.setattr("wristctl.records.lock.fcntl.flock", no_locks)
    signers = ("--signers", str(keys["signers"]))
    with lock_held(honest.path, text), lock_held(bad.path, text):
        assert honest.state == bad.state == "running", "as far as the lock tells"
        for must in ((), ("--signed",), signers):
            code, said = call("verify", honest.id, *must)
            assert code == 0 and f"{honest.id}  as sealed" in said, must
            code, said = call("verify", bad.id, *must)
            assert code == 3 and f"{bad.id}  changed\n  config.yaml: " in said, must
            code, said = call("verify", "--json", honest.id, bad.id, *must)
            told = json.loads(said[: said.rindex("}") + 1])["runs"]
            assert code == 3 and told[honest.id] == [], must
            assert [each["file"] for each in told[bad.id]] == ["config.yaml"], must
        assert "signed by ada@example.org" in call("verify", honest.id, *signers)[1]


def no_locks(descriptor: int, operation: int) -> None:
    raise OSError(errno.ENOLCK, "No locks available")


def test_a_run_that_goes_on_is_never_as_sealed(call: Call, results: Path, keys: dict[str, Path]) -> None:
    with start_run("tune", Study(), "", results) as live:
        for must, expected in (((), 0), (("--signed",), 3), (("--signers", str(keys["signers"])), 3)):
            code, said = call("verify", live.id, *must)
            assert code == expected and f"{live.id}  is running" in said and "as sealed\n" not in said
            code, said = call("verify", "--json", live.id, *must)
            assert code == expected and json.loads(said[: said.rindex("}") + 1])["runs"][live.id], must
    assert call("verify", live.id) == (0, f"{live.id}  as sealed\n")
